"""Tests of simple shapes, radii and margins: closed formulas in numpy for balls, capsules and clouds."""

import copy
import os
import pickle
import tempfile
import unittest
import warnings
from pathlib import Path

import numpy as np

import cbvh
from common import check_errors, cube, random_poses, shifts


def ends(pose, length):
    """The ends of a capsule's axis."""
    return [pose[:3, :3] @ [0, 0, z] + pose[:3, 3] for z in (-length / 2, length / 2)]


def between_segments(p, q, r, s):
    """The distance of two segments: the least over a fine search and its refinement."""
    t = np.linspace(0, 1, 2001)[:, None]
    points = p + t * (q - p)
    along = np.clip((points - r) @ (s - r) / max((s - r) @ (s - r), 1e-300), 0, 1)[:, None]
    gaps = np.linalg.norm(points - (r + along * (s - r)), axis=1)
    return gaps.min()


class Shapes(unittest.TestCase):
    def test_balls_are_exact(self):
        rng = np.random.default_rng(1)
        for _ in range(200):
            radii, shift = rng.uniform(0.1, 2, 2), rng.uniform(-3, 3, 3)
            a, b = cbvh.sphere(radii[0]), cbvh.sphere(radii[1])
            pose = shifts(shift)[0]
            gap = np.linalg.norm(shift) - radii.sum()
            found = a.distance(b, pose)
            self.assertAlmostEqual(found.distance, max(gap, 0), delta=1e-14)
            self.assertEqual(a.collide(b, pose), gap <= 0)
            self.assertLessEqual(found.lower, max(gap, 0) + 1e-15)
        # Exactly touching: 3-4-5.
        self.assertTrue(cbvh.sphere(2).collide(cbvh.sphere(3), shifts([3, 4, 0])[0]))
        self.assertFalse(cbvh.sphere(2).collide(cbvh.sphere(3 - 2.0**-50), shifts([3, 4, 0])[0]))
        self.assertTrue(cbvh.sphere(1, centre=(3, 0, 0)).collide(cbvh.sphere(2), np.eye(4)))

    def test_files_state_radii_and_solids(self):
        cube = cbvh.box((2, 2, 2)).arrays()
        baked = cbvh.bake(*cube, radius=0.25, solid=True)
        self.assertEqual((baked.radius, baked.is_solid), (0.25, True))
        self.assertEqual(baked.distance(cbvh.sphere(0.5), shifts([3, 0, 0])[0]).distance, 1.25)
        bare = pickle.loads(pickle.dumps(baked.rounded(0)))
        self.assertEqual((bare.radius, bare.is_solid), (0, True))
        with tempfile.TemporaryDirectory() as folder:
            points, output = os.path.join(folder, "dots.xyz"), os.path.join(folder, "dots.cbvh")
            with open(points, "w") as file:
                file.write("0 0 0\n3 0 0\n3 0 0\n")
            dots = cbvh.bake_files(points, output, radius=0.5)
            self.assertEqual((dots.triangle_count, dots.radius, cbvh.open(output).radius), (3, 0.5, 0.5))
            cbvh.box((2, 2, 2), rounding=0.5).save(output)
            self.assertEqual((cbvh.open(output).radius, cbvh.open(output).is_solid), (0.5, True))
            self.assertEqual(cbvh.Mesh.from_bytes(cbvh.sphere(2).tobytes()).radius, 2)
            with self.assertRaisesRegex(cbvh.BakeError, "closed surface"):
                cbvh.bake([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], solid=True)
        for wrong in (-1, np.nan, np.inf, 1e40):
            with self.assertRaisesRegex(ValueError, "radius"):
                cbvh.bake(*cube, radius=wrong)
        with self.assertRaises(TypeError):
            cbvh.bake(*cube, solid=1)

    def test_capsules_are_segments_with_a_radius(self):
        a, b = cbvh.capsule(0.3, 1.0), cbvh.capsule(0.2, 2.0)
        for pose in random_poses(2, 60, 2.0):
            expected = between_segments(*ends(np.eye(4), 1.0), *ends(pose, 2.0)) - 0.5
            self.assertAlmostEqual(a.distance(b, pose).distance, max(expected, 0), delta=1e-6)

    def test_a_cloud_is_as_near_as_its_nearest_point(self):
        rng = np.random.default_rng(3)
        points = rng.uniform(-1, 1, (500, 3))
        cloud, ball = cbvh.cloud(points, 0.01), cbvh.sphere(0.1)
        self.assertEqual(cloud.triangle_count, 500)
        for shift in rng.uniform(-2, 2, (40, 3)):
            gaps = np.linalg.norm(points - shift, axis=1) - 0.11
            found = cloud.distance(ball, shifts(shift)[0])
            self.assertAlmostEqual(found.distance, max(gaps.min(), 0), delta=1e-6)
            contacts = cloud.contacts(ball, shifts(shift)[0])
            self.assertEqual(sorted(contacts[:, 1].tolist()), np.flatnonzero(gaps <= 0).tolist())
        twice = cbvh.cloud([[0, 0, 0], [0, 0, 0]], 1.0)
        self.assertEqual(len(twice.contacts(ball, np.eye(4))), 2, "equal points stay")

    def test_solids_hold_what_is_inside(self):
        inside, outside = shifts([0.1, 0.1, 0.1])[0], shifts([0, 0, 3])[0]
        ball = cbvh.sphere(0.01)
        for solid in (
            cbvh.box([1, 1, 1]),
            cbvh.box([1, 1, 1], rounding=0.2),
            cbvh.cylinder(0.5, 1),
            cbvh.cone(0.5, 1),
            cbvh.voxels([[0, 0, 0], [0, 0, 1]], 0.5).solid(),
            cbvh.voxels(np.ones((2, 2, 2), bool), 0.25).solid(),
            cbvh.octree([[0.5, 0.5, 0.5], [-0.25, 0.25, 0.25]], [1, 0.5]).solid(),
            cbvh.convex_hull(cube()[0]),
            cbvh.bake(*cube()).solid(),
        ):
            self.assertTrue(solid.is_solid and solid.collide(ball, inside))
            self.assertEqual(solid.distance(ball, inside).distance, 0)
            self.assertFalse(solid.collide(ball, outside))
        self.assertFalse(cbvh.bake(*cube()).collide(ball, inside))
        ground = cbvh.ground([10, 10], 1)
        self.assertTrue(ground.collide(ball, shifts([0, 0, -0.5])[0]))
        self.assertAlmostEqual(ground.distance(ball, shifts([0, 0, 1])[0]).distance, 0.99)
        field = cbvh.height_field([[0, 0, 0], [0, 1, 0]], [1, 1])
        self.assertEqual(field.triangle_count, 4)
        # A rounded box has its sides, and rounds its corners.
        rounded = cbvh.box([2, 2, 2], rounding=0.5)
        point = cbvh.sphere(0)
        self.assertEqual(rounded.distance(point, shifts([2, 0, 0])[0]).distance, 1)
        self.assertAlmostEqual(
            rounded.distance(point, shifts([2, 2, 0])[0]).distance, np.hypot(1.5, 1.5) - 0.5, delta=1e-14
        )

    def test_a_hull_has_the_support_of_its_points(self):
        rng, probe = np.random.default_rng(8), cbvh.sphere(0.0)
        points = rng.normal(size=(500, 3)).astype(np.float32).astype(float)
        hull = cbvh.convex_hull(points)
        self.assertTrue(np.all(hull.signed_point_distances(points) <= 0))
        self.assertEqual({*map(tuple, hull.vertices)} - {*map(tuple, points)}, set())
        for direction in rng.normal(size=(50, 3)):
            direction /= np.linalg.norm(direction)
            heights = [vertices @ direction for vertices in (points, hull.vertices)]
            self.assertEqual(*[height.max() for height in heights])
            self.assertTrue(hull.collide(probe, shifts(points[heights[0].argmax()])[0]))
            self.assertGreater(hull.distance(probe, shifts((heights[0].max() + 1) * direction)[0]).distance, 0.999)

    def test_cells_of_many_sizes_are_those_of_the_finest_grid(self):
        rng = np.random.default_rng(9)
        for _ in range(20):
            sizes = 2 ** rng.integers(0, 4, 12)
            corners = rng.integers(-8, 8, (12, 3)) // sizes[:, None] * sizes[:, None]
            full = np.zeros((64, 64, 64), bool)
            for corner, size in zip(corners, sizes):
                full[tuple(slice(at + 32, at + 32 + size) for at in corner)] = True
            middles = (corners + sizes[:, None] / 2) * 0.25
            cells = cbvh.octree(middles.astype(np.float32), sizes * 0.25).solid()
            fine = cbvh.voxels(np.argwhere(full) - 32, 0.25).solid()
            self.assertLessEqual(cells.triangle_count, 2 * fine.triangle_count)
            points = rng.uniform(-4, 6, (300, 3))
            np.testing.assert_allclose(cells.signed_point_distances(points), fine.signed_point_distances(points), atol=1e-12)
            np.testing.assert_array_equal(cells.sides(points), fine.sides(points))

    def test_points_and_rays_meet_rounded_shapes(self):
        ball = cbvh.sphere(2)
        self.assertEqual(ball.sides([1, 1, 1]), cbvh.Side.INSIDE)
        self.assertEqual(ball.sides([2, 0, 0]), cbvh.Side.ON)
        self.assertAlmostEqual(ball.signed_point_distances([1, 0, 0]), -1)
        self.assertAlmostEqual(ball.closest_points([5, 0, 0]).distance, 3)
        hit = ball.first_hits([[-5, 0, 0], [-5, 2, 0], [-5, 2.01, 0]], [1, 0, 0])
        self.assertAlmostEqual(hit.t[0], 3, delta=1e-9)
        self.assertEqual(np.isfinite(hit.t).tolist(), [True, True, False])
        np.testing.assert_allclose(ball.all_hits([-5, 0, 0], [1, 0, 0]).t, [3, 7], atol=1e-9)
        np.testing.assert_allclose(ball.all_hits([1, 0, 0], [1, 0, 0]).t, [0, 1], atol=1e-9)
        self.assertEqual(ball.all_hits([1, 0, 0], [1, 0, 0], until=0.5).t.tolist(), [0])
        # Two balls that overlap are one body, and two that are apart are two.
        for radius, ends in ((1.5, [0.5, 5.5]), (0.75, [1.25, 2.75, 3.25, 4.75])):
            cloud = cbvh.cloud([[0, 0, 0], [2, 0, 0]], radius)
            np.testing.assert_allclose(cloud.all_hits([-2, 0, 0], [1, 0, 0]).t, ends, atol=1e-9)

    def test_wrong_sizes_are_refused(self):
        nan, inf = float("nan"), float("inf")
        mesh = cbvh.bake(*cube())
        open_mesh = cbvh.bake([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        check_errors(
            self,
            [
                (ValueError, "radius", lambda: cbvh.sphere(-1)),
                (ValueError, "radius", lambda: mesh.rounded(nan)),
                (ValueError, "radius", lambda: mesh.rounded(inf)),
                (TypeError, "radius", lambda: mesh.rounded("1")),
                (ValueError, "side", lambda: cbvh.box([1, 0, 1])),
                (ValueError, "rounding: expected less than half of each side", lambda: cbvh.box([1, 1, 1], rounding=0.5)),
                (ValueError, "rounding: expected a finite length", lambda: cbvh.box([1, 1, 1], rounding=nan)),
                (ValueError, "rounding: expected a finite length", lambda: cbvh.box([1, 1, 1], rounding=-1)),
                (ValueError, "sides", lambda: cbvh.box([1, 1])),
                (ValueError, "sides: expected shape (3,), found ()", lambda: cbvh.box(1)),
                (TypeError, "sides: expected numbers, found dtype complex128", lambda: cbvh.box([1, 1j, 1])),
                (ValueError, "length: expected a finite length", lambda: cbvh.capsule(1, -1)),
                (ValueError, "length: expected a finite length", lambda: cbvh.capsule(1, nan)),
                (TypeError, "length: expected a number", lambda: cbvh.capsule(1, "1")),
                (TypeError, "centre: expected numbers", lambda: cbvh.sphere(1, ["1", 0, 0])),
                (TypeError, "centre: expected numbers", lambda: cbvh.sphere(1, np.array([1j, 0, 0]))),
                (ValueError, "centre: expected finite", lambda: cbvh.sphere(1, [nan, 0, 0])),
                (ValueError, "centre: expected shape (3,), found (2,)", lambda: cbvh.sphere(1, [0, 0])),
                (TypeError, "radius: expected a number, found dtype complex64", lambda: cbvh.sphere(np.complex64(1j))),
                (TypeError, "radius: expected a number, found dtype <U1", lambda: cbvh.sphere(np.str_("1"))),
                (ValueError, "points[1]: expected finite coordinates, found NaN", lambda: cbvh.cloud([[0, 0, 0], [nan, 0, 0]])),
                (ValueError, "heights: expected finite", lambda: cbvh.height_field([[0, nan], [0, 0]], [1, 1])),
                (TypeError, "heights: expected numbers", lambda: cbvh.height_field([[0, 1j], [0, 0]], [1, 1])),
                (ValueError, "length", lambda: cbvh.cylinder(1, nan)),
                (ValueError, "max_error", lambda: cbvh.cone(1, 1, max_error=0)),
                (ValueError, "heights", lambda: cbvh.height_field([1, 2], [1, 1])),
                (ValueError, "cells", lambda: cbvh.voxels([[0.5, 0, 0]], 1)),
                (ValueError, "cells", lambda: cbvh.voxels(np.ones((2, 2), bool), 1)),
                (ValueError, "a half-space cannot be baked; make a ground", lambda: cbvh.ground([inf, 1])),
                (TypeError, "cells", lambda: cbvh.octree([[0, 0, 0]])),
                (ValueError, "cells", lambda: cbvh.octree([[0, 0, 0]], [1, 2])),
                (ValueError, "finite sizes above 0", lambda: cbvh.octree([[0, 0, 0]], [inf])),
                (ValueError, "off by 0.5", lambda: cbvh.octree([[0, 0, 0]], [1])),
                (ValueError, "a power of two", lambda: cbvh.octree([[1.5] * 3, [0.5] * 3], [3, 1])),
                (ValueError, "2^31", lambda: cbvh.octree([[3e9] * 3, [0.5] * 3], [2, 1])),
                (ValueError, "found 3 in one plane", lambda: cbvh.convex_hull(np.eye(3))),
                (ValueError, "found 9 at one place", lambda: cbvh.convex_hull(np.ones((9, 3)))),
                (ValueError, "finite coordinates", lambda: cbvh.convex_hull([[0, 0, nan]])),
                (ValueError, "points", lambda: cbvh.convex_hull([[0, 0]])),
                (ValueError, "closed", lambda: open_mesh.solid()),
            ],
        )
        cells = np.zeros((0, 3), int)
        for empty in (
            lambda: cbvh.cloud(np.zeros((0, 3))),
            lambda: cbvh.voxels(cells, 1.0),
            lambda: cbvh.octree(cells, []),
        ):
            with self.assertRaises(cbvh.BakeError):
                empty()
        self.assertEqual(cbvh.capsule(1, 0).radius, 1)

    def test_shapes_travel(self):
        for mesh in (cbvh.sphere(1.5), cbvh.box([1, 2, 3], rounding=0.25), cbvh.cloud([[0, 0, 0]], 2.0)):
            other = pickle.loads(pickle.dumps(mesh))
            self.assertEqual((other.radius, other.is_solid), (mesh.radius, mesh.is_solid))
            self.assertIn("radius", repr(other))


class Margins(unittest.TestCase):
    def scene(self):
        scene = cbvh.Scene()
        meshes = [cbvh.sphere(0.3), cbvh.capsule(0.2, 1), cbvh.box([0.5, 0.5, 0.5]), cbvh.bake(*cube())]
        for number, pose in enumerate(random_poses(7, 8, 2.0)):
            id = scene.add(meshes[number % 4], pose, name=f"part {number}")
            scene.set_margin(id, 0.1 * number)
        scene.set_pair_margin("part 1", 6, 0.75)
        return scene

    def check(self, scene):
        touching = {tuple(pair) for pair in scene.pairs_in_contact().tolist()}
        distances = scene.distances()
        poses = scene.poses()
        for (a, b), distance in zip(distances.pairs.tolist(), distances.nearest.distance):
            further = 0.75 if {a, b} == {1, 6} else 0.0
            mesh_a, mesh_b = scene.mesh(a), scene.mesh(b)
            mesh_a = mesh_a.rounded(mesh_a.radius + scene.margin(a) + further)
            mesh_b = mesh_b.rounded(mesh_b.radius + scene.margin(b))
            pose = cbvh.relative(poses[a], poses[b])
            self.assertAlmostEqual(mesh_a.distance(mesh_b, pose).distance, distance, delta=1e-12)
            self.assertEqual(mesh_a.collide(mesh_b, pose), (a, b) in touching)
        self.assertEqual(scene.distance().nearest.distance, distances.nearest.distance.min())

    def test_every_question_respects_margins(self):
        scene = self.scene()
        self.assertEqual(scene.margin("part 3"), 0.1 * 3)
        for same in (scene, scene.copy(), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
            self.check(same)

    def test_wrong_margins_are_refused(self):
        scene = self.scene()
        check_errors(
            self,
            [
                (ValueError, "margin", lambda: scene.set_margin(0, -1)),
                (ValueError, "margin", lambda: scene.set_pair_margin(0, 1, float("nan"))),
                (TypeError, "margin", lambda: scene.set_margin(0, None)),
                (KeyError, "id", lambda: scene.set_margin(99, 1)),
            ],
        )


class Files(unittest.TestCase):
    def test_warnings_and_points_without_a_position(self):
        with tempfile.TemporaryDirectory() as folder:
            source, output = Path(folder) / "holes.xyz", Path(folder) / "holes.cbvh"
            source.write_text("0 0 0\nnan nan nan\n1 0 0\n")
            with self.assertRaisesRegex(cbvh.BakeError, "line 2: .*drop_nan"):
                cbvh.bake_files(source, output)
            with self.assertWarnsRegex(cbvh.BakeWarning, "holes.xyz: line 2: left out 1 point") as caught:
                mesh = cbvh.bake_files(source, output, drop_nan=True)
            self.assertEqual((mesh.triangle_count, caught.filename), (2, __file__))
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                cbvh.bake_files(source, output, drop_nan=True)  # which is up to date
            with self.assertRaisesRegex(TypeError, "drop_nan"):
                cbvh.bake_files(source, output, drop_nan="yes")


if __name__ == "__main__":
    unittest.main()
