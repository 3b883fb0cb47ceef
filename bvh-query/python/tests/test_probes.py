"""Tests of questions about points, rays and segments: plain geometry, and the bits of the command."""

import pathlib
import tempfile
import unittest

import numpy as np

import cbvh
from common import COMMAND, SHARED, TESTDATA, WITHOUT_COMMAND, WITHOUT_SHARED
from common import ask_command, cube, numbers_of, shifts, write_rows


class Geometry(unittest.TestCase):
    """A cube, whose answers are known."""

    @classmethod
    def setUpClass(cls):
        cls.cube = cbvh.bake(*cube())

    def test_one_end_serves_many(self):
        ways = np.array([[0.0, 0, -1], [0, 0, 1], [0, 1, 0.5]])
        origin, many = [0, 0, 5], np.tile([0.0, 0, 5], (3, 1))
        for ask in (self.cube.first_hits, self.cube.any_hits, self.cube.all_hits):
            np.testing.assert_equal(ask(origin, ways), ask(many, ways))
            np.testing.assert_equal(ask(many, ways[0]), ask(many, np.tile(ways[0], (3, 1))))
        self.assertEqual(self.cube.any_hits([origin], ways[0]).tolist(), [True])
        self.assertEqual(self.cube.any_hits(origin, ways[:1]).tolist(), [True])
        self.assertEqual(self.cube.segment_hits(origin, [[0, 0, 0.5], [0, 0, 4]]).tolist(), [True, False])
        self.assertEqual(self.cube.segment_hits([[0, 0, 0], [0, 0, 4]], origin).tolist(), [True, False])
        scene = cbvh.Scene()
        scene.add(self.cube)
        self.assertEqual(scene.any_hits(origin, ways).tolist(), self.cube.any_hits(origin, ways).tolist())
        self.assertEqual(scene.segment_hits(origin, [[0, 0, 0.5], [0, 0, 4]]).tolist(), [True, False])
        for of in (self.cube, scene):
            self.assertEqual(of.visible(origin, [[0, 0, 0.5], [0, 0, 4]]).tolist(), [False, True])
            self.assertEqual(of.visible([[0, 0, 0.5], [0, 0, 4]], origin, margin=0.25).tolist(), [True, True])
            self.assertIs(of.visible(origin, [0, 0, -5]), False)
            with self.assertRaisesRegex(ValueError, "margin: expected a finite distance of at least 0, found -1"):
                of.visible(origin, [0, 0, -5], margin=-1)

    def test_probes(self):
        points = np.random.default_rng(1).uniform(-1, 1, (200, 3))
        outside = np.maximum(np.abs(points) - 0.5, 0)
        inside = np.min(0.5 - np.abs(points), axis=1)
        expected = np.where(inside > 0, -inside, np.linalg.norm(outside, axis=1))
        placed = shifts((1, 2, 3))[0]
        for parallel in (False, True):
            for pose, moved in ((None, points), (placed, points + [1, 2, 3])):
                found = self.cube.signed_point_distances(moved, pose=pose, parallel=parallel)
                np.testing.assert_allclose(found, expected, atol=1e-14)
                sides = self.cube.sides(moved, pose=pose, parallel=parallel)
                np.testing.assert_array_equal(sides == cbvh.Side.INSIDE, inside > 0)
            near = self.cube.closest_points(points, within=0.1, parallel=parallel)
            np.testing.assert_array_equal(near.found, np.abs(expected) <= 0.1)
            self.assertTrue(np.all(np.isnan(near.distance[~near.found])))
            # A ray along z hits both faces if it is inside in x and y.
            above = points * [1, 1, 0] + [0, 0, 2]
            hits = self.cube.first_hits(above, np.tile([0, 0, -1], (200, 1)), parallel=parallel)
            crosses = np.all(np.abs(points[:, :2]) < 0.5, axis=1)
            np.testing.assert_array_equal(hits.found, crosses)
            np.testing.assert_array_equal(hits.t[crosses], 1.5)
            every = self.cube.all_hits(above, np.tile([0, 0, -1], (200, 1)), until=2, parallel=parallel)
            self.assertEqual([len(hit.t) for hit in every], crosses.astype(int).tolist())
            below = above * [1, 1, -1]
            np.testing.assert_array_equal(self.cube.segment_hits(above, below, parallel=parallel), crosses)
            np.testing.assert_array_equal(self.cube.visible(above, below, parallel=parallel), ~crosses)
            # From one face of the cube to what is beyond the other one, and to where the margins end.
            top = points * [1, 1, 0] + [0, 0, 0.5]
            for margin, sees in ((0.0, ~crosses), (0.01, ~crosses), (1.25, np.ones(200, bool))):
                found = self.cube.visible(top, below, margin=margin, parallel=parallel)
                np.testing.assert_array_equal(found, sees)
            np.testing.assert_array_equal(self.cube.visible(top, above, margin=0.01, parallel=parallel), np.ones(200, bool))
            np.testing.assert_array_equal(self.cube.visible(top, above, parallel=parallel), ~crosses)

    def test_as_many_ends_as_rays(self):
        above, down = [[0.1, 0.2, 5], [0.1, 0.2, 5]], [[0, 0, -1], [0, 0, -1]]
        found = self.cube.first_hits(above, down, until=[4, 5])
        self.assertEqual(found.found.tolist(), [False, True])
        with self.assertRaisesRegex(ValueError, r"until: expected shape \(\) or \(2,\), found \(3,\)"):
            self.cube.any_hits(above, down, until=[1, 2, 3])


@unittest.skipUnless(COMMAND, WITHOUT_COMMAND)
class SameBits(unittest.TestCase):
    """Answers about meshes and probes are those of the command, bit for bit."""

    def check(self, folder, source, files):
        """Checks a mesh with files of points, rays and segments, and returns the modes with several answers."""
        file, varied = folder / "mesh.cbvh", set()
        mesh = cbvh.bake_files(source, file, force=True)
        for mode, kind in {"closest": "points", "side": "points", "ray": "rays", "segment": "segments"}.items():
            raw = ask_command(folder, "probe", file, files[kind], "--mode", mode, "--limit", 200)
            raw = np.array([float(line[0]) for line in raw])
            rows = numbers_of(files[kind], 200)
            self.assertEqual(len(raw), len(rows))
            first, last = rows[:, :3], rows[:, 3:6]
            for parallel in (False, True):
                # The command prints -1 for no hit.
                found = {
                    "closest": lambda: mesh.closest_points(first, parallel=parallel).distance,
                    "side": lambda: mesh.sides(first, parallel=parallel),
                    "ray": lambda: np.nan_to_num(mesh.first_hits(first, last, parallel=parallel).t, nan=-1.0),
                    "segment": lambda: mesh.segment_hits(first, last, parallel=parallel),
                }[mode]()
                np.testing.assert_array_equal(np.asarray(found, float), raw, f"{source}, {mode}")
            if len(set(raw.tolist())) > 1:
                varied.add(mode)
        return varied

    def test_probes_of_a_small_mesh(self):
        hand = TESTDATA / "robot" / "hand.obj"
        corners = np.array([line.split()[1:4] for line in hand.read_text().splitlines() if line.startswith("v ")], float)
        low, high = corners.min(axis=0), corners.max(axis=0)
        # In the box of the mesh and around it.
        places = np.random.default_rng(5).uniform(1.2 * low - 0.2 * high, 1.2 * high - 0.2 * low, (2, 150, 3))
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            files = {kind: folder / f"{kind}.txt" for kind in ("points", "rays", "segments")}
            write_rows(files["points"], places[0])
            write_rows(files["rays"], np.hstack([places[0], places[1] - places[0]]))
            write_rows(files["segments"], np.hstack(places))
            self.assertEqual(self.check(folder, hand, files), {"closest", "side", "ray", "segment"})

    @unittest.skipUnless(SHARED.exists(), WITHOUT_SHARED)
    def test_probes_of_shared_meshes(self):
        with tempfile.TemporaryDirectory() as name:
            for mesh in ("apollo", "bunny", "nao"):
                files = {kind: SHARED / "probes" / f"{mesh}_{kind}.txt" for kind in ("points", "rays", "segments")}
                varied = self.check(pathlib.Path(name), SHARED / "meshes" / f"{mesh}.obj", files)
                self.assertLessEqual({"closest", "ray", "segment"}, varied)


if __name__ == "__main__":
    unittest.main()
