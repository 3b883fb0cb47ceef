"""Tests of poses and of the arrays that callers give."""

import unittest

import numpy as np

import cbvh
from common import cube, random_poses, shifts, turns


class Poses(unittest.TestCase):
    """Poses from quaternions and of one body in the frame of another."""

    def test_quaternions_turn_as_stated(self):
        half = np.sqrt(0.5)
        for axis in range(3):
            quaternion = [0.0, 0.0, 0.0, half]
            quaternion[axis] = half
            expected = turns(axis, np.pi / 2)[0]
            expected[:3, 3] = [1, 2, 3]
            np.testing.assert_allclose(cbvh.pose([1, 2, 3], quaternion), expected, atol=1e-15)
        np.testing.assert_array_equal(cbvh.pose([4, 5, 6]), shifts((4, 5, 6))[0])

    def test_one_serves_many(self):
        found = cbvh.pose(np.arange(6).reshape(2, 3), [0, 0, 1, 0])
        np.testing.assert_array_equal(found[:, :3, 3], [[0, 1, 2], [3, 4, 5]])
        np.testing.assert_array_equal(found[:, :3, :3], [np.diag([-1, -1, 1])] * 2)
        self.assertEqual(cbvh.pose([1, 2, 3], np.tile([0, 0, 0, 1], (3, 1))).shape, (3, 4, 4))
        self.assertEqual(cbvh.pose(np.zeros((0, 3))).shape, (0, 4, 4))

    def test_relative_poses_are_what_scenes_ask_about(self):
        a, b = random_poses(1, 50, 3.0), random_poses(2, 50, 3.0)
        found = cbvh.relative(a, b)
        np.testing.assert_allclose(found, np.linalg.inv(a) @ b, atol=1e-14)
        np.testing.assert_array_equal(cbvh.relative(a[0], b), [cbvh.relative(a[0], pose) for pose in b])
        mesh, scene = cbvh.bake(*cube()), cbvh.Scene()
        first, second = scene.add(mesh), scene.add(mesh)
        for number, pose in enumerate(found):
            scene.set_poses([first, second], [a[number], b[number]])
            nearest = scene.distance().nearest
            self.assertEqual(nearest.distance, mesh.distance(mesh, pose).distance)


class Arrays(unittest.TestCase):
    """Arrays of any order, alignment and type."""

    @staticmethod
    def misaligned(array):
        array = np.asarray(array)
        buffer = bytearray(array.nbytes + 1)
        buffer[1:] = array.tobytes()
        found = np.frombuffer(buffer, array.dtype, array.size, 1).reshape(array.shape)
        assert not found.flags.aligned
        return found

    def test_any_layout_gives_the_same_answers(self):
        vertices, faces = cube()
        mesh, poses, points = cbvh.bake(vertices, faces), random_poses(3, 40, 1.5), random_poses(4, 40, 1.0)[:, :3, 3]
        scene = cbvh.Scene()
        ids = np.array([scene.add(mesh, pose) for pose in poses])
        expected = mesh.distance(mesh, poses).distance, mesh.sides(points), scene.poses(ids[::-1])
        strided = lambda array: np.repeat(array, 2, axis=0)[::2]
        swapped = lambda array: array.astype(array.dtype.newbyteorder())
        for change in (self.misaligned, np.asfortranarray, strided, swapped, np.ndarray.tolist):
            np.testing.assert_array_equal(mesh.distance(mesh, change(poses)).distance, expected[0])
            np.testing.assert_array_equal(mesh.sides(change(points)), expected[1])
            np.testing.assert_array_equal(scene.poses(change(ids)[::-1]), expected[2])
            baked = cbvh.bake(change(vertices), change(np.asarray(faces)))
            self.assertEqual(baked.tobytes(), mesh.tobytes())
            self.assertEqual(len(cbvh.Motion.between(np.eye(4), change(poses))), len(poses))
            scene.set_pose(0, change(poses[0]))

    def test_bounds_hold_all_vertices(self):
        vertices, faces = cube(3.0)
        np.testing.assert_array_equal(cbvh.bake(vertices + 7, faces).bounds, [[5.5] * 3, [8.5] * 3])


if __name__ == "__main__":
    unittest.main()
