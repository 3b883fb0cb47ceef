"""Tests of questions about pairs of meshes: plain geometry, and the bits of the command."""

import pathlib
import tempfile
import unittest

import numpy as np

import cbvh
from common import COMMAND, SHARED, TESTDATA, WITHOUT_COMMAND, WITHOUT_SHARED
from common import ask_command, bottom_row, cube, numbers_of, random_poses, shifts, write_rows


class Convertible:
    """Another library's array."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return np.array(self.array, dtype)


class Geometry(unittest.TestCase):
    """Cubes, whose answers are known."""

    @classmethod
    def setUpClass(cls):
        cls.cube = cbvh.bake(*cube())
        cls.small = cbvh.bake(*cube(0.25))

    def test_pairs(self):
        poses = shifts((0, 0, 0), (1, 0, 0), (1.5, 0, 0), (2, 2, 0))
        for parallel in (False, True):
            touch = self.cube.collide(self.cube, poses, parallel=parallel)
            self.assertEqual((touch.dtype, touch.tolist()), (bool, [True, True, False, False]))
            near = self.cube.within(self.cube, poses, 0.5, parallel=parallel)
            self.assertEqual(near.tolist(), [True, True, True, False])
            distance = self.cube.distance(self.cube, poses, parallel=parallel)
            np.testing.assert_array_equal(distance.distance, [0, 0, 0.5, np.sqrt(2)])
            self.assertTrue(np.all((distance.lower <= distance.distance) & (distance.distance <= distance.upper)))
            self.assertEqual((distance.point_a.shape, distance.triangle_b.dtype), ((4, 3), np.uint32))
            apart = np.linalg.norm(distance.point_a - distance.point_b, axis=1)
            np.testing.assert_allclose(apart, distance.distance, atol=1e-12)
            relations = self.cube.relation(self.small, shifts((0, 0, 0), (3, 0, 0), (0.5, 0, 0)), parallel=parallel)
            self.assertEqual([cbvh.Relation(r).name for r in relations], ["B_IN_A", "APART", "TOUCHING"])
            contacts = self.cube.contacts(self.cube, poses, parallel=parallel)
            self.assertEqual([len(rows) > 0 for rows in contacts], touch.tolist())
            self.assertEqual((contacts[0].shape[1], contacts[2].shape), (4, (0, 4)))

    def test_one_question_has_one_plain_answer(self):
        pose = shifts((0, 0, 3))[0]
        self.assertIs(self.cube.collide(self.cube, pose), False)
        self.assertIs(self.cube.within(self.cube, pose, 2), True)
        self.assertIs(self.cube.relation(self.small, np.eye(4)), cbvh.Relation.B_IN_A)
        distance = self.cube.distance(self.cube, pose)
        self.assertEqual((type(distance.distance), distance.distance, distance.point_a.shape), (float, 2.0, (3,)))
        loose = self.cube.distance(self.cube, pose, rel_err=0.5)
        self.assertTrue(loose.lower <= 2.0 <= loose.upper <= 3.0)
        self.assertEqual(self.cube.contacts(self.cube, pose).shape, (0, 4))
        self.assertIs(self.cube.sides([0, 0, 0]), cbvh.Side.INSIDE)
        self.assertEqual(self.cube.signed_point_distances([0, 0, 0.25]), -0.25)
        near = self.cube.signed_point_distances([[0, 0, 0.25], [0, 0, 0], [0, 0, 0.75]], within=0.25)
        np.testing.assert_array_equal(near, [-0.25, np.nan, 0.25])
        self.assertEqual(self.cube.closest_points([0, 0, 2]).point.tolist(), [0, 0, 0.5])
        hit = self.cube.first_hits([0.1, 0.2, 5], [0, 0, -1])
        self.assertEqual((hit.found, hit.t, hit.point.tolist()), (True, 4.5, [0.1, 0.2, 0.5]))
        self.assertIs(self.cube.any_hits([0, 0, 5], [0, 0, 1]), False)
        self.assertEqual(self.cube.all_hits([0.1, 0.2, 5], [0, 0, -1]).t.tolist(), [4.5, 5.5])
        self.assertIs(self.cube.segment_hits([0, 0, 0], [0, 0, 0.5]), True)

    def test_no_questions_have_no_answers(self):
        none = np.zeros((0, 4, 4))
        self.assertEqual(self.cube.collide(self.cube, none).shape, (0,))
        self.assertEqual(self.cube.distance(self.cube, none).point_a.shape, (0, 3))
        self.assertEqual(self.cube.contacts(self.cube, none), [])
        self.assertEqual(self.cube.sides(np.zeros((0, 3))).shape, (0,))
        self.assertEqual(self.cube.all_hits(np.zeros((0, 3)), np.zeros((0, 3))), [])

    def test_arrays_of_any_layout_are_read(self):
        poses = shifts((0, 0, 0), (3, 0, 0), (0, 0, 0))
        read_only = poses.copy()
        read_only.flags.writeable = False
        every = [np.asfortranarray(poses), np.repeat(poses, 2, axis=0)[::2], poses[::-1], poses.tolist(), list(poses)]
        every += [poses.astype(dtype) for dtype in (">f8", "<f4", np.float16, np.longdouble, np.int8, np.uint64)]
        every += [read_only, Convertible(poses), memoryview(poses)]
        for array in every:
            self.assertEqual(self.cube.collide(self.cube, array).tolist(), [True, False, True])
        vertices, faces = cube()
        for dtype in (np.int8, np.int64, np.uint16):
            self.assertEqual(cbvh.bake(vertices, np.array(faces, dtype)).triangle_count, 12)


@unittest.skipUnless(COMMAND, WITHOUT_COMMAND)
class SameBits(unittest.TestCase):
    """Answers are those of the command, bit for bit."""

    def check(self, folder, meshes, poses_file, limit, within, triangles="auto"):
        """Asks about poses in all modes, and returns the modes in which answers differ from pose to pose."""
        options = {} if triangles == "auto" else {"triangles": triangles}
        files = [folder / f"{mesh.stem}-{triangles}.cbvh" for mesh in meshes]
        a, b = (cbvh.bake_files(mesh, file, **options) for mesh, file in zip(meshes, files))
        poses = bottom_row(numbers_of(poses_file, limit))
        varied = set()
        for mode in ("collide", "contacts", "distance", "within", "relation"):
            distance = ["--within", within] if mode == "within" else []
            raw = ask_command(folder, "query", *files, poses_file, "--mode", mode, "--limit", limit, *distance)
            raw = np.array([float(line[0]) for line in raw])
            self.assertEqual(len(raw), len(poses))
            for parallel in (False, True):
                found = {
                    "collide": lambda: a.collide(b, poses, parallel=parallel),
                    "contacts": lambda: [len(rows) for rows in a.contacts(b, poses, parallel=parallel)],
                    "distance": lambda: a.distance(b, poses, parallel=parallel).distance,
                    "within": lambda: a.within(b, poses, within, parallel=parallel),
                    "relation": lambda: a.relation(b, poses, parallel=parallel),
                }[mode]()
                np.testing.assert_array_equal(np.asarray(found, float), raw, f"{mode}, {poses_file.stem}, {triangles}")
            varied |= {mode} if len(set(raw.tolist())) > 1 else set()
        return varied

    def test_all_questions_about_bundled_meshes(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            poses = random_poses(7, 300, 1200.0)
            poses[:, :3, 3] += [300, -1600, -500]
            write_rows(folder / "poses.txt", poses[:, :3].reshape(-1, 12))
            meshes = [TESTDATA / f"{name}.obj" for name in ("fclenv", "fclrob")]
            for triangles in ("f32", "packed"):
                varied = self.check(folder, meshes, folder / "poses.txt", 300, 200.0, triangles)
                self.assertEqual(varied, {"collide", "contacts", "distance", "within", "relation"})

    @unittest.skipUnless(SHARED.exists(), WITHOUT_SHARED)
    def test_all_questions_about_shared_pairs(self):
        pairs = [line.split() for line in (SHARED / "poses" / "pairs.txt").read_text().splitlines()]
        varied = set()
        with tempfile.TemporaryDirectory() as folder:
            for pair, *meshes in pairs:
                for poses in sorted((SHARED / "poses").glob(f"{pair}_*.txt")):
                    files = [SHARED / "meshes" / mesh for mesh in meshes]
                    varied |= self.check(pathlib.Path(folder), files, poses, 100, 0.05)
        self.assertIn("distance", varied)


if __name__ == "__main__":
    unittest.main()
