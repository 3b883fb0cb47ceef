"""Tests of questions about overlaps: how deep, in which regions and patches, how parts clash, and where a mesh meets itself."""

import json
import math
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

import cbvh
from common import COMMAND, SHARED, WITHOUT_COMMAND, WITHOUT_SHARED
from common import bottom_row, check_errors, cube, random_poses, shifts, turns, write_rows


def moved(poses, translations):
    """Poses of which B is moved in A's frame."""
    poses = poses.copy()
    poses[..., :3, 3] += translations
    return poses


def opened():
    """A cube without one triangle."""
    vertices, faces = cube()
    return cbvh.bake(vertices, faces[:-1])


def block(*sides):
    """A block around the origin."""
    vertices, faces = cube()
    return cbvh.bake(vertices * sides, faces)


def volume_within(surface):
    """The volume within polygons, by the divergence theorem: that of cones over fans of all loops."""
    volume, first = 0.0, 0
    for count in surface.loops:
        corners = surface.points[first : first + count]
        volume += np.linalg.det(np.stack([np.tile(corners[0], (count - 2, 1)), corners[1:-1], corners[2:]], axis=1)).sum() / 6
        first += count
    return volume


def two_cubes(offset):
    """A cube around the origin and another one, as one mesh, which is not convex."""
    vertices, faces = cube()
    return cbvh.bake(np.concatenate([vertices, vertices + offset]), np.concatenate([faces, np.add(faces, 8)]))


class Depths(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cube, cls.small = cbvh.bake(*cube()), cbvh.bake(*cube(0.25))
        # A cube to all that is near it, whose depth is searched for as that of a mesh that is not convex.
        cls.not_convex = two_cubes([0, 0, 9])

    def test_depths_of_cubes_are_known(self):
        offsets = np.random.default_rng(1).uniform(-1.2, 1.2, (100, 3))
        offsets[:3] = [[0, 0, 0], [1, 0, 0], [3, 0, 0]]
        poses, known = shifts(*offsets), np.maximum(1 - np.abs(offsets).max(axis=1), 0)
        for mesh, parallel in ((self.cube, False), (self.not_convex, False), (self.not_convex, True), (self.cube, True)):
            found, of_one = mesh.penetration(self.cube, poses, parallel=parallel), [mesh.penetration(self.cube, pose) for pose in poses]
            self.assertTrue(np.all(found.lower <= known + 1e-12) and np.all(known <= found.upper))
            np.testing.assert_allclose(found.upper, known, rtol=0.011, atol=1e-12)
            np.testing.assert_allclose(np.linalg.norm(found.translation, axis=1), found.upper, rtol=1e-15)
            proved_by_balls = found.lower if mesh is self.not_convex else np.zeros(100)
            np.testing.assert_allclose(found.radii.sum(axis=1), proved_by_balls, atol=1e-12)
            self.assertFalse(found.is_spent.any())
            apart = mesh.relation(self.cube, moved(poses, found.translation), parallel=parallel)
            self.assertEqual(set(apart.tolist()), {cbvh.Relation.APART})
            for number, one in enumerate(of_one):
                for part, parts in zip(one, found):
                    np.testing.assert_array_equal(part, parts[number])
        one = of_one[0]
        self.assertEqual((type(one.lower), type(one.is_spent)), (float, bool))
        self.assertEqual((one.translation.shape, one.point.shape, one.radii.shape), ((3,), (3,), (2,)))
        none = self.cube.penetration(self.cube, np.zeros((0, 4, 4)))
        self.assertEqual((none.upper.shape, none.point.shape, none.radii.shape), ((0,), (0, 3), (0, 2)))
        # A mesh inside another one has to go all the way out.
        self.assertAlmostEqual(self.cube.penetration(self.small, np.eye(4), relative_gap=1e-9).upper, 0.625, places=9)
        # Balls overlap by what their radii say.
        depth = cbvh.sphere(1.0).penetration(cbvh.sphere(0.5), shifts([0.6, 0.8, 0])[0], relative_gap=1e-6)
        self.assertAlmostEqual(depth.upper, 0.5, delta=0.01)
        self.assertTrue(depth.lower <= 0.5 <= depth.upper)

    def test_a_search_ends_where_it_is_told_to(self):
        poses = random_poses(3, 50, 0.4)
        full = self.not_convex.penetration(self.cube, poses)
        for parallel in (False, True):
            spent = self.not_convex.penetration(self.cube, poses, budget=300, parallel=parallel)
            self.assertTrue(spent.is_spent.any() and np.all(spent.lower <= full.upper) and np.all(full.lower <= spent.upper))
            apart = self.not_convex.relation(self.cube, moved(poses, spent.translation))
            self.assertEqual(set(apart.tolist()), {cbvh.Relation.APART})
            # The budget is that of one call.
            again = self.not_convex.penetration(self.cube, poses, parallel=parallel)
            np.testing.assert_array_equal(again.upper, full.upper)
        deeper = self.not_convex.penetration(self.cube, poses, tolerance=0.2)
        self.assertTrue(np.all((deeper.lower > 0.2) == (full.lower > 0.2)))

    def test_signed_distances_pass_through_zero(self):
        # A block passes through another one, from far on one side to the other.
        (corners, faces), small = cube(), cbvh.bake(*cube())
        large = cbvh.bake(corners * [2, 4, 4], faces)
        x = np.arange(-24, 25) / 8
        poses, known = shifts(*((along, 0.25, 0) for along in x)), np.abs(x) - 1.5
        of_one = [large.signed_distance(small, pose) for pose in poses]
        for parallel in (False, True):
            found = large.signed_distance(small, poses, parallel=parallel)
            self.assertTrue(np.all(found.lower <= known) and np.all(known <= found.upper))
            np.testing.assert_allclose(found.upper, found.lower, atol=1e-9)
            np.testing.assert_allclose(found.normal[x != 0], np.outer(np.sign(x[x != 0]), [1, 0, 0]), atol=1e-9)
            along = np.einsum("ki,ki->k", found.normal, found.point_b - found.point_a)
            np.testing.assert_allclose(along, known, atol=1e-9)
            np.testing.assert_allclose(np.abs(found.point_a[:, 0]), 1, atol=1e-9)
            np.testing.assert_allclose(np.linalg.norm(found.translation, axis=1), np.maximum(-found.lower, 0), rtol=1e-14)
            apart = large.relation(small, moved(poses, found.translation), parallel=parallel)
            self.assertEqual(set(apart[found.lower < 0].tolist()), {cbvh.Relation.APART})
            self.assertTrue(found.is_signed.all() and not found.is_spent.any())
            for number, one in enumerate(of_one):
                for part, parts in zip(one, found):
                    np.testing.assert_array_equal(part, parts[number])
        one = of_one[0]
        self.assertEqual([type(part) for part in (one.lower, one.upper, one.is_signed, one.is_spent)], [float, float, bool, bool])
        self.assertEqual({part.shape for part in one[2:6]}, {(3,)})
        none = large.signed_distance(small, np.zeros((0, 4, 4)))
        self.assertEqual(([none.lower.shape, none.is_signed.dtype], {part.shape for part in none[2:6]}), ([(0,), bool], {(0, 3)}))

    def test_signed_distances_are_distances_or_depths(self):
        two = two_cubes([1.25, 0, 0])
        hull = cbvh.convex_hull(np.random.default_rng(4).normal(size=(60, 3)))
        poses = random_poses(11, 60, 4.0)
        is_apart = two.relation(hull, poses) == cbvh.Relation.APART
        self.assertTrue(5 < np.count_nonzero(is_apart) < 55)
        distance, depth = two.distance(hull, poses), two.penetration(hull, poses)
        for parallel in (False, True):
            found = two.signed_distance(hull, poses, parallel=parallel)
            np.testing.assert_array_equal(found.lower, np.where(is_apart, distance.lower, -depth.upper))
            np.testing.assert_array_equal(found.upper, np.where(is_apart, distance.upper, -depth.lower))
            np.testing.assert_array_equal(found.translation, np.where(is_apart[:, None], 0, depth.translation))
            np.testing.assert_array_equal(found.point_a[is_apart], distance.point_a[is_apart])
            np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1, rtol=1e-12)
            self.assertTrue(found.is_signed.all() and not found.is_spent.any())
        # The options are those of the depth.
        near = two.signed_distance(hull, poses[~is_apart], tolerance=0.2)
        far = two.penetration(hull, poses[~is_apart], tolerance=0.2)
        np.testing.assert_array_equal([-near.upper, -near.lower], [far.lower, far.upper])
        spent = two.signed_distance(hull, poses, budget=3000)
        self.assertTrue(0 < np.count_nonzero(spent.is_spent) < 60 and np.all(spent.lower <= found.upper))
        np.testing.assert_array_equal(two.signed_distance(hull, poses).lower, found.lower)
        # A mesh inside another one has to go all the way out.
        inside = self.cube.signed_distance(self.small, np.eye(4), relative_gap=1e-9)
        self.assertTrue(inside.lower <= -0.625 <= inside.upper < -0.625 + 1e-8)

    def test_what_has_no_inside_has_a_distance_only(self):
        cloud = cbvh.cloud([[0, 0, 0], [0, 0, 3]], 0)
        cases = [(opened(), 2, 1), (opened(), 1, 0), (cloud, 2.5, 2), (cloud, 0, 0.5), (cloud, 0.5, 0)]
        for mesh, height, known in cases:
            for found in (self.cube.signed_distance(mesh, shifts((0, 0, height))[0]),
                          mesh.signed_distance(self.cube, shifts((0, 0, -height))[0])):
                self.assertFalse(found.is_signed or found.is_spent)
                self.assertTrue(0 <= found.lower <= known <= found.upper < known + 1e-12, (known, found))
                self.assertEqual(found.translation.tolist(), [0, 0, 0])
        # With a radius, points have an inside.
        found = self.cube.signed_distance(cbvh.cloud([[0, 0, 0], [0, 0, 3]], 0.5), shifts((0, 0, 0.75), (0, 0, 1.5)))
        self.assertTrue(found.is_signed.all())
        self.assertTrue(np.all(found.lower <= [-0.25, 0.5]) and np.all(found.upper >= [-0.25, 0.5]))

    def test_separations_are_along_the_direction(self):
        offsets = np.random.default_rng(2).uniform(-0.9, 0.9, (30, 3))
        poses = shifts(*offsets, (0, 0, 5))
        for parallel in (False, True):
            found = self.cube.separation(self.cube, poses, [0, -3, 0], parallel=parallel)
            known = [*(1 + offsets[:, 1]), 0]
            self.assertTrue(np.all(found.lower <= np.array(known) + 1e-12))
            np.testing.assert_allclose(found.upper, known, atol=1e-11)
            np.testing.assert_allclose(found.lower, known, atol=1e-11)
            np.testing.assert_allclose(found.translation, np.outer(found.upper, [0, -1, 0]), rtol=1e-14)
        along = self.cube.separation(self.cube, np.eye(4), [1, 1, 0])
        self.assertAlmostEqual(along.upper, math.sqrt(2), places=11)

    def test_regions_are_where_triangles_meet(self):
        poses = np.concatenate([shifts((0.5, 0.3, 0.1), (1, 0, 0), (1, 1, 1), (3, 0, 0)), turns(2, 0.3)])
        for parallel in (False, True):
            found = self.cube.contact_regions(self.cube, poses, parallel=parallel)
            contacts = self.cube.contacts(self.cube, poses)
            for pose, of, rows in zip(poses, found, contacts):
                np.testing.assert_array_equal(of.triangles, rows)
                self.assertEqual((of.total, of.points.shape), (len(rows), (len(rows), 6, 3)))
                is_point = np.arange(6) < of.point_count[:, None]
                np.testing.assert_array_equal(np.isnan(of.points[:, :, 0]), ~is_point)
                # Each point is in the planes of both triangles.
                of_b = self.cube.triangles[of.triangles[:, 3]] @ pose[:3, :3].T + pose[:3, 3]
                for corners, normals in ((self.cube.triangles[of.triangles[:, 1]], of.normal_a), (of_b, of.normal_b)):
                    height = np.einsum("kpi,ki->kp", of.points - corners[:, :1], normals)
                    self.assertLess(np.abs(height[is_point]).max(initial=0), 1e-12)
        self.assertEqual({cbvh.RegionKind(kind).name for kind in found[1].kind}, {"POINT", "SEGMENT", "POLYGON"})
        self.assertIn("POLYGON", str(found[1].kind))
        self.assertEqual((found[2].kind.tolist(), found[3].points.shape), ([0] * len(found[2].kind), (0, 6, 3)))
        first = self.cube.contact_regions(self.cube, poses[0], limit=2)
        self.assertEqual((len(first.points), first.total), (2, found[0].total))
        np.testing.assert_array_equal(first.points, found[0].points[:2])
        self.assertEqual(self.cube.contact_regions(self.cube, poses[:0]), [])

    def test_patches_are_those_of_cubes(self):
        on_face, poked = shifts((0.25, 0, 0.625), (0.25, 0, 0.55))
        patches = self.cube.patches(self.small, np.stack([on_face, poked, shifts((9, 0, 0))[0]]), parallel=True)
        self.assertEqual([len(of.depth) for of in patches], [1, 1, 0])
        touching, deep, apart = patches
        np.testing.assert_allclose(touching.area, 0.0625)
        np.testing.assert_allclose(touching.normal, [[0, 0, 1]], atol=1e-15)
        np.testing.assert_allclose(deep.length, 1.0)
        np.testing.assert_allclose(deep.center, [[0.25, 0, 0.5]])
        np.testing.assert_allclose((deep.depth, *deep.normal.T), [[0.075], [0], [0], [1]], atol=1e-15)
        self.assertEqual((deep.first.tolist(), deep.contact_count.tolist()), ([0], [deep.regions.total]))
        self.assertEqual((apart.center.shape, apart.regions.triangles.shape), ((0, 3), (0, 4)))
        # Meshes that are not closed have patches as well.
        one = opened().patches(self.small, poked)
        self.assertEqual(len(one.depth), 1)
        two = cbvh.cloud([[0, 0, 0], [0, 0, 1]], 0.1).patches(cbvh.capsule(0.1, 4.0), shifts((0.15, 0, 0))[0])
        np.testing.assert_allclose((len(two.depth), *two.depth), [2, 0.05, 0.05])
        cut = self.cube.patches(self.small, poked, max_contacts=3, tolerance=0.1)
        self.assertEqual((len(cut.regions.triangles), cut.regions.total), (3, deep.regions.total))

    def test_points_of_patches_are_corners(self):
        poked, apart = shifts((0.25, 0, 0.55), (9, 0, 0))
        deep, none = self.cube.patches(self.small, np.stack([poked, apart]), max_points=4)
        self.assertEqual((deep.first_point.tolist(), deep.point_count.tolist()), ([0], [4]))
        # The small cube has sides of 0.25, and its bottom is 0.075 below the top of the other one.
        corners = [[x, y, 0.4625] for x in (0.125, 0.375) for y in (-0.125, 0.125)]
        np.testing.assert_allclose(sorted(deep.points.tolist()), corners, atol=1e-12)
        np.testing.assert_allclose(deep.point_normals, [[0, 0, 1]] * 4, atol=1e-12)
        np.testing.assert_allclose(deep.point_depths, [0.075] * 4)
        self.assertEqual((none.points.shape, none.point_normals.shape, none.point_depths.shape), ((0, 3), (0, 3), (0,)))
        without, one = self.cube.patches(self.small, poked), self.cube.patches(self.small, poked, max_points=1)
        self.assertEqual((len(without.points), without.point_count.tolist(), len(one.points)), (0, [0], 1))
        for name in ("center", "normal", "length", "area", "depth", "first", "contact_count"):
            np.testing.assert_array_equal(getattr(without, name), getattr(deep, name))
        # As a margin, a radius gives the gap of the cores, here 0.05.
        near = self.cube.rounded(0.1).patches(self.small, shifts((0.25, 0, 0.675))[0], tolerance=1.0, max_points=4)
        np.testing.assert_allclose(sorted(near.points.tolist()), np.add(corners, [0, 0, 0.0625]), atol=1e-12)
        np.testing.assert_allclose(near.point_depths, [-0.05] * 4)

    def test_self_contacts_are_those_of_known_meshes(self):
        vertices, faces = cube()
        both = cbvh.bake(np.concatenate([vertices, vertices + 0.5]), np.concatenate([faces, np.array(faces) + 8]))
        found = both.self_contacts()
        pairs = self.cube.contacts(self.cube, shifts((0.5, 0.5, 0.5))[0])
        self.assertEqual(found.triangles[:, [1, 3]].tolist(), [[a, b + 12] for _, a, _, b in pairs.tolist()])
        self.assertEqual((found.total, set(found.kind.tolist())), (len(pairs), {cbvh.SelfContactKind.CROSSING}))
        first = both.self_contacts(limit=3)
        self.assertEqual((first.triangles.tolist(), first.total), (found.triangles[:3].tolist(), found.total))
        self.assertEqual(str(first.kind), "[CROSSING, CROSSING, CROSSING]")
        folded = cbvh.bake([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [0, 1, 3], [2, 1, 0]]).self_contacts()
        names = [cbvh.SelfContactKind(kind).name for kind in folded.kind]
        self.assertEqual(names, ["FOLDED", "DUPLICATE", "FOLDED"])
        none = self.cube.self_contacts()
        self.assertEqual((none.triangles.shape, none.total, str(none.kind)), ((0, 4), 0, "[]"))

    def test_parts_clash_as_their_gap_and_depth_say(self):
        kind, cube_again = cbvh.ClashClass, cbvh.bake(*cube())
        options = dict(clearance=0.25, tolerance=2.0**-10)
        # The cube has sides of 1. The second part and where it is, and the class, the distance and the depth of both.
        cases = [
            (self.cube, (1.375, 0.125, 0), kind.APART, np.inf, None),
            (self.cube, (1.0625, 0.125, 0), kind.NEAR, 0.0625, None),
            (self.cube, (1 + 2.0**-11, 0.125, 0), kind.TOUCHING, 2.0**-11, 0),
            (self.cube, (1, 0.125, 0), kind.TOUCHING, 0, 0),
            (self.cube, (0.75, 0.125, 0), kind.OVERLAPPING, 0, 0.25),
            (self.small, (0.125, 0.125, 0), kind.CONTAINED, 0, None),
            (cube_again, (2.0**-11, 0, 0), kind.DUPLICATED, 0, None),
            (opened(), (1, 0.125, 0), kind.INTERSECTING, 0, None),
        ]
        for other, offset, expected, distance, depth in cases:
            pose = shifts(offset)[0]
            found = self.cube.clash(other, pose, **options)
            self.assertEqual((found.kind, found.distance), (expected, distance))
            self.assertEqual((type(found.kind), type(found.distance), found.point.shape), (kind, float, (3,)))
            self.assertIs(found.relation, self.cube.relation(other, pose))
            self.assertEqual(np.isnan([found.depth.lower, found.depth.upper, *found.depth.translation]).all(), depth is None)
            self.assertFalse(found.depth.is_spent)
            if depth is not None:
                self.assertTrue(found.depth.lower <= depth <= found.depth.upper <= 1.1 * found.depth.lower + 1e-6)
            if expected == kind.NEAR:
                self.assertEqual(found.point[0], 0.53125)
            else:
                self.assertTrue(np.abs(found.point).max() <= 0.5 + 2.0**-12)
        self.assertIs(self.small.clash(self.cube, np.eye(4)).relation, cbvh.Relation.A_IN_B)
        # Of two cubes side by side, the depth is known, and with it the class.
        offsets = np.random.default_rng(8).uniform(-1.5, 1.5, (200, 3))
        poses, gaps = shifts(*offsets), np.abs(offsets) - 1
        depths, apart = -gaps.max(axis=1), np.linalg.norm(np.maximum(gaps, 0), axis=1)
        found = self.cube.clash(self.cube, poses, clearance=0.25, tolerance=0.1, relative_gap=1e-3)
        near = np.where(apart > 0.25, kind.APART, np.where(apart > 0.1, kind.NEAR, kind.TOUCHING))
        known = np.where(depths < 0, near, np.where(depths > 0.1, kind.OVERLAPPING, kind.TOUCHING))
        np.testing.assert_array_equal(found.kind, known)
        self.assertEqual(len(set(known.tolist())), 4)
        is_near = (depths < 0) & (known != kind.APART)
        np.testing.assert_allclose(found.distance[is_near], apart[is_near])
        is_touching = is_near & (known == kind.TOUCHING)
        self.assertTrue(0 < np.count_nonzero(is_touching) < np.count_nonzero(known == kind.TOUCHING))
        self.assertTrue(np.all(found.depth.upper[is_touching] == 0))
        is_deep = depths >= 0
        self.assertTrue(np.all(found.depth.lower[is_deep] <= depths[is_deep] + 1e-12))
        self.assertTrue(np.all(found.depth.upper[is_deep] >= depths[is_deep] - 1e-12))
        self.assertTrue(np.isnan(found.depth.point[~is_deep & ~is_touching]).all())
        self.assertEqual(str(found.kind[:0]), "[]")
        self.assertIn("OVERLAPPING", str(found.kind))
        parallel = self.cube.clash(self.cube, poses, clearance=0.25, tolerance=0.1, relative_gap=1e-3, parallel=True)
        self.assertIsNone(found.magnitudes)
        for one, other in zip((*found[:4], *found.depth), (*parallel[:4], *parallel.depth)):
            np.testing.assert_array_equal(one, other)
        # Where the visits end the search, the bounds so far are the answer.
        spent = self.not_convex.clash(self.cube, shifts((0.96875, 0.125, 0)), tolerance=2.0**-10, relative_gap=0.01, visits=200)
        self.assertEqual((spent.kind.tolist(), spent.depth.is_spent.tolist()), ([kind.UNDECIDED], [True]))
        self.assertTrue(spent.depth.lower[0] <= 0.03125 <= spent.depth.upper[0])
        full = self.not_convex.clash(self.cube, shifts((0.96875, 0.125, 0)), tolerance=2.0**-10, visits=None)
        self.assertEqual((full.kind.tolist(), full.depth.is_spent.tolist()), ([kind.OVERLAPPING], [False]))
        # By default nothing is near, and the tolerance is a millionth of the side.
        by_default = self.cube.clash(self.cube, shifts((1.0625, 0, 0), (1 - 5e-7, 0.125, 0), (1 - 4e-6, 0.125, 0)))
        self.assertEqual(by_default.kind.tolist(), [kind.APART, kind.TOUCHING, kind.OVERLAPPING])

    def test_what_blocks_have_in_common_is_known(self):
        sides, offsets = np.array([1.5, 0.75, 0.5]), np.random.default_rng(9).uniform(-1.25, 1.25, (200, 3))
        offsets[:2] = [[0.25, 0, 0], [3, 0, 0]]
        other, poses = block(*sides), shifts(*offsets)
        lo, hi = np.maximum(-0.5, offsets - sides / 2), np.minimum(0.5, offsets + sides / 2)
        is_shared = np.all(lo < hi, axis=1)
        self.assertTrue(20 < np.count_nonzero(is_shared) < 180)
        x, y, z = np.where(is_shared[:, None], hi - lo, 0).T
        for mesh, parallel in ((self.cube, False), (two_cubes([0, 0, 9]), True)):
            found = mesh.intersection(other, poses, parallel=parallel)
            self.assertTrue(np.all(np.abs(found.volume - x * y * z) <= found.volume_error + 1e-15))
            self.assertTrue(np.all(found.volume_error <= 1e-12))
            np.testing.assert_allclose(found.area_a + found.area_b, 2 * (x * y + y * z + z * x), atol=1e-14)
            np.testing.assert_allclose(found.bounds[is_shared], np.stack([lo, hi], axis=1)[is_shared], atol=1e-15)
            self.assertTrue(np.isnan(found.bounds[~is_shared]).all())
            surfaces = mesh.intersection_surface(other, poses, parallel=parallel)
            np.testing.assert_allclose([volume_within(of) for of in surfaces], x * y * z, atol=1e-14)
            for number, pose in enumerate(poses[:50]):
                for parts, one in ((found, mesh.intersection(other, pose)), (surfaces[number], mesh.intersection_surface(other, pose))):
                    for several, part in zip(parts, one):
                        np.testing.assert_array_equal(part, several[number] if parts is found else several)
            of_clash = mesh.clash(other, poses, magnitudes=True, parallel=parallel)
            has = ~np.isnan(of_clash.magnitudes.volume)
            np.testing.assert_array_equal(has, is_shared)
            for part, parts in zip(of_clash.magnitudes, found):
                np.testing.assert_array_equal(part[has], parts[has])
            self.assertFalse(np.any(of_clash.kind == cbvh.ClashClass.OVERLAPPING))
        none = self.cube.intersection(other, np.zeros((0, 4, 4)))
        self.assertEqual((none.volume.shape, none.bounds.shape), ((0,), (0, 2, 3)))
        self.assertEqual(self.cube.intersection_surface(other, np.zeros((0, 4, 4))), [])
        one, surface = self.cube.intersection(other, poses[0]), self.cube.intersection_surface(other, poses[0])
        self.assertEqual((type(one.volume), type(one.pierced_a), one.bounds.shape), (float, float, (2, 3)))
        self.assertEqual((surface.points.shape[1], surface.loops.dtype, surface.polygons.dtype), (3, np.uint32, np.uint32))
        self.assertEqual((surface.loops.sum(), surface.polygons.sum()), (len(surface.points), len(surface.loops)))
        # Flush faces enclose nothing, and blocks that fill each other have all in common.
        flush = self.cube.intersection(block(1, 1, 1), shifts((1, 0.25, 0), (0, 0, 0)))
        np.testing.assert_array_equal(flush.volume, [0, 1])

    def test_a_pierced_plate_is_as_thick_as_it_is(self):
        kind, (plate, rod) = cbvh.ClashClass, (block(4, 3, 0.25), block(0.5, 0.5, 2))
        world = random_poses(11, 1, 3.0)[0]
        # Where the rod passes through the plate, sticks in it, and takes a side of it along.
        poses = shifts((1, 0.5, 0.25), (1, 0.5, 1.0625), (2, 0.5, 0.25))
        clash = plate.clash(rod, poses, magnitudes=True)
        self.assertEqual(clash.kind.tolist(), [kind.PIERCING, kind.PROTRUDING, kind.PROTRUDING])
        np.testing.assert_allclose(clash.magnitudes.volume, [0.0625, 0.015625, 0.03125], rtol=1e-14)
        np.testing.assert_array_equal(clash.magnitudes.pierced_a, [0.25, np.nan, np.nan])
        self.assertTrue(np.isnan(clash.magnitudes.pierced_b).all())
        np.testing.assert_array_equal(rod.intersection(plate, shifts((-1, -0.5, -0.25))).pierced_b, [0.25])
        self.assertIs(plate.clash(rod, poses[0]).kind, kind.OVERLAPPING)
        # Of parts without a depth, and of parts that are near, there are none.
        for other, pose in ((opened(), shifts((1, 0.125, 0))[0]), (self.cube, shifts((1.125, 0, 0))[0])):
            found = self.cube.clash(other, pose, clearance=0.25, magnitudes=True)
            self.assertTrue(np.isnan(found.magnitudes.volume) and np.isnan(found.magnitudes.bounds).all())
        # In a scene, boxes are along the axes of the world.
        scene = cbvh.Scene()
        scene.add(plate, world, name="plate")
        scene.add(rod, world @ poses[0], name="rod")
        corners = np.array([[x, y, z, 1] for x in (0.75, 1.25) for y in (0.25, 0.75) for z in (-0.125, 0.125)]) @ world[:3].T
        for scene.parallel in (False, True):
            pairs, found = scene.clashes(magnitudes=True)
            self.assertEqual((pairs.tolist(), found.kind.tolist()), ([[0, 1]], [kind.PIERCING]))
            np.testing.assert_allclose(found.magnitudes.bounds[0], [corners.min(axis=0), corners.max(axis=0)], atol=1e-12)
            np.testing.assert_allclose(found.magnitudes.volume, [0.0625], rtol=1e-12)
            np.testing.assert_allclose(found.magnitudes.pierced_a, [0.25], rtol=1e-12)
        self.assertEqual(cbvh.Scene().clashes(magnitudes=True).clash.magnitudes.bounds.shape, (0, 2, 3))
        self.assertIsNone(cbvh.Scene().clashes().clash.magnitudes)

    def test_numbers_are_checked(self):
        mesh, at, none = self.cube, np.eye(4), np.zeros((0, 4, 4))
        depth = lambda **options: lambda: mesh.penetration(mesh, none, **options)
        signed = lambda **options: lambda: mesh.signed_distance(mesh, none, **options)
        clash = lambda **options: lambda: mesh.clash(mesh, none, **options)
        cases = [
            (ValueError, "relative_gap: expected a finite part above 0, found 0", depth(relative_gap=0)),
            (ValueError, "relative_gap: expected a finite part above 0, found NaN", depth(relative_gap=np.nan)),
            (ValueError, "tolerance: expected a finite depth of at least 0, found -1", depth(tolerance=-1)),
            (TypeError, "tolerance: expected a number, found str", depth(tolerance="x")),
            (TypeError, "budget: expected a whole number or None, found float", depth(budget=1.5)),
            (ValueError, "budget: expected a whole number from 0 to 2^64 - 1, found -1", depth(budget=-1)),
            (ValueError, "budget", lambda: mesh.penetration(mesh, at, budget=0)),
            (ValueError, "relative_gap: expected a finite part above 0, found 0", signed(relative_gap=0)),
            (ValueError, "tolerance: expected a finite depth of at least 0, found -1", signed(tolerance=-1)),
            (TypeError, "tolerance: expected a number, found str", signed(tolerance="x")),
            (ValueError, "budget: expected a whole number from 0 to 2^64 - 1, found -1", signed(budget=-1)),
            (ValueError, "budget", lambda: mesh.signed_distance(mesh, shifts((3, 0, 0)), budget=0)),
            (ValueError, "clearance: expected a finite length of at least 0, found -1", clash(clearance=-1)),
            (ValueError, "clearance: expected a finite length of at least 0, found inf", clash(clearance=np.inf)),
            (ValueError, "tolerance: expected a finite depth of at least 0, found -1", clash(tolerance=-1)),
            (ValueError, "tolerance: expected a finite depth of at least 0, found NaN", clash(tolerance=np.nan)),
            (ValueError, "relative_gap: expected a finite part above 0, found 0", clash(relative_gap=0)),
            (TypeError, "clearance: expected a number, found str", clash(clearance="x")),
            (TypeError, "visits: expected a whole number or None, found float", clash(visits=1.5)),
            (TypeError, "magnitudes: expected a bool, found str", clash(magnitudes="x")),
            (TypeError, "other: expected a cbvh.Mesh", mesh.intersection, "x", at),
            (ValueError, "poses: expected shape (4, 4) or (N, 4, 4), found (3, 4)", mesh.intersection_surface, mesh, at[:3]),
            (ValueError, "expected closed objects, found object 0 open: ", opened().intersection, mesh, at),
            (ValueError, "expected closed objects, found object 0 open: ", mesh.intersection_surface, opened(), at),
            (ValueError, "topology", cbvh.bake(*cube(), topology=False).intersection, mesh, at),
            (ValueError, "visits: expected a whole number from 0 to 2^64 - 1, found -1", clash(visits=-1)),
            (ValueError, "tolerance: expected a finite depth", lambda: cbvh.Scene().clashes(tolerance=-1)),
            (TypeError, "other: expected a cbvh.Mesh", mesh.clash, "x", at),
            (ValueError, "topology", cbvh.bake(*cube(), topology=False).clash, mesh, shifts((0.5, 0, 0))),
            (ValueError, "direction: expected numbers the largest of which", mesh.separation, mesh, none, [0, 0, 0]),
            (ValueError, "direction: expected shape (3,), found (1, 3)", mesh.separation, mesh, at, [[0, 0, 1]]),
            (ValueError, "limit: expected a whole number", lambda: mesh.contact_regions(mesh, at, limit=-1)),
            (ValueError, "tolerance: expected a finite length of at least 0", lambda: mesh.patches(mesh, none, tolerance=-1)),
            (TypeError, "max_contacts: expected a whole number", lambda: mesh.patches(mesh, at, max_contacts="x")),
            (TypeError, "max_points: expected a whole number", lambda: mesh.patches(mesh, at, max_points=1.5)),
            (ValueError, "max_points: expected a whole number", lambda: mesh.patches(mesh, at, max_points=-1)),
            (TypeError, "limit: expected a whole number", lambda: mesh.self_contacts(limit="x")),
            (TypeError, "other: expected a cbvh.Mesh", mesh.penetration, "x", at),
            (ValueError, "poses: expected shape (4, 4) or (N, 4, 4), found (3, 4)", mesh.patches, mesh, at[:3]),
            (ValueError, "expected closed objects, found object 0 open: ", opened().penetration, mesh, at),
            (ValueError, "expected closed objects, found object 0 open: ", mesh.separation, opened(), at, [1, 0, 0]),
            (ValueError, "topology", cbvh.bake(*cube(), topology=False).penetration, mesh, at),
            (TypeError, "other: expected a cbvh.Mesh", mesh.signed_distance, "x", at),
            (ValueError, "topology", cbvh.bake(*cube(), topology=False).signed_distance, mesh, at),
        ]
        check_errors(self, cases)

    def test_open_edges_tell_why_and_a_weld_closes(self):
        vertices, faces = cube()
        self.assertEqual(cbvh.bake(vertices, faces).open_edges()[:4], (0, 0, 0, []))
        hole = cbvh.bake(vertices, faces[1:])
        open_edges = hole.open_edges()
        self.assertEqual((open_edges.boundary, open_edges.flipped, open_edges.crowded), (3, 0, 0))
        self.assertEqual((open_edges.cracks, open_edges.proposed_weld), (0, None))
        self.assertEqual(str(open_edges)[:28], "3 edges have one triangle; t")
        corners = {tuple(vertex) for vertex in np.asarray(vertices, float)[faces[0]].tolist()}
        for edge in open_edges.edges:
            self.assertEqual((edge.kind, edge.object, len(edge.triangles)), ("boundary", 0, 1))
            self.assertLessEqual({tuple(end) for end in edge.ends.tolist()}, corners)
        # Each triangle with vertices of its own, some of which are a little off.
        apart = np.asarray(vertices, float)[np.asarray(faces).reshape(-1)]
        apart[::4] *= 1 + 1e-6
        own = np.arange(len(apart)).reshape(-1, 3)
        cracked = cbvh.bake(apart, own)
        weld = cracked.open_edges().proposed_weld
        self.assertTrue(1e-6 < weld < 1e-4, weld)
        with self.assertRaisesRegex(ValueError, f"bake with --weld {weld:.0e}".replace("e-0", "e-")):
            cracked.solid()
        closed = cbvh.bake(apart, own, weld=weld)
        self.assertEqual(closed.open_edges()[:4], (0, 0, 0, []))
        self.assertIs(closed.sides([0.0, 0.0, 0.0]), cbvh.Side.INSIDE)
        with self.assertRaisesRegex(ValueError, "topology"):
            cbvh.bake(vertices, faces, topology=False).open_edges()

    def test_scenes_ask_about_pairs(self):
        scene = cbvh.Scene()
        poses = random_poses(5, 1, 2.0)[0] @ shifts((0, 0, 0), (0.75, 0, 0), (5, 0, 0), (0.2, 0, 0))
        for name, mesh, pose in zip("abcd", (self.cube, self.cube, self.cube, self.small), poses):
            scene.add(mesh, pose, name=name)
        found = scene.penetrations()
        np.testing.assert_array_equal(found.pairs, scene.relations().pairs)
        self.assertEqual(found.pairs.tolist(), [[0, 1], [0, 3], [1, 3]])
        np.testing.assert_allclose(found.depth.upper, [0.25, 0.425, 0.075], rtol=0.011)
        any_pairs = scene.penetrations([["b", "a"], ["a", "c"]], parallel=True)
        np.testing.assert_allclose(any_pairs.depth.upper, [0.25, 0], rtol=0.011)
        scene.set_margin("a", 0.05)
        wider = scene.penetrations([["a", "b"]], relative_gap=1e-6).depth
        self.assertAlmostEqual(wider.upper[0], 0.3, places=6)
        self.assertEqual(cbvh.Scene().penetrations().depth.translation.shape, (0, 3))
        # The cubes a and b overlap by a quarter, c is apart, and d, which is in a, sticks out of b.
        scene.set_margin("a", 0)
        for scene.parallel in (False, True):
            clashes = scene.clashes(tolerance=1e-3)
            np.testing.assert_array_equal(clashes.pairs, found.pairs)
            names = [kind.name for kind in clashes.clash.kind]
            self.assertEqual(names, ["OVERLAPPING", "CONTAINED", "OVERLAPPING"])
            self.assertTrue(clashes.clash.depth.lower[0] <= 0.25 <= clashes.clash.depth.upper[0])
            a_b = self.cube.clash(self.cube, cbvh.relative(poses[0], poses[1]), tolerance=1e-3)
            np.testing.assert_array_equal(clashes.clash.point[0], a_b.point)
            pairs, near = scene.clashes(clearance=3.5)
            self.assertEqual((pairs.tolist(), near.kind[2].name), ([[0, 1], [0, 3], [1, 2], [1, 3]], "NEAR"))
            self.assertAlmostEqual(near.distance[2], 3.25, places=9)
        self.assertEqual(cbvh.Scene().clashes().clash.depth.translation.shape, (0, 3))
        scene.add(opened(), poses[0], name="open")
        with self.assertRaisesRegex(ValueError, "expected closed objects"):
            scene.penetrations()


@unittest.skipUnless(COMMAND, WITHOUT_COMMAND)
class SameBits(unittest.TestCase):
    def test_depths_are_those_of_the_command(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            a, b = cbvh.bake(*cube()), cbvh.convex_hull(np.random.default_rng(4).normal(size=(60, 3)))
            for mesh, file in ((a, "a.cbvh"), (b, "b.cbvh")):
                mesh.save(folder / file)
            poses = random_poses(6, 100, 2.0)
            write_rows(folder / "poses.txt", poses[:, :3].reshape(-1, 12))
            depths, distances = a.penetration(b, poses, parallel=True), a.signed_distance(b, poses, parallel=True)
            of_depth = ("lower", "upper", "translation", "point", "radii")
            of_distance = ("lower", "upper", "normal", "point_a", "point_b", "translation")
            for mode, found, names in (("penetration", depths, of_depth), ("signed", distances, of_distance)):
                arguments = [COMMAND, "query", "a.cbvh", "b.cbvh", "poses.txt", "--mode", mode, "--json"]
                asked = subprocess.run(arguments, cwd=folder, check=True, capture_output=True, text=True)
                rows = [json.loads(line) for line in asked.stdout.splitlines()]
                self.assertEqual(len(rows), 100)
                for name in names:
                    np.testing.assert_array_equal(getattr(found, name), [row[name] for row in rows], f"{mode}: {name}")
            self.assertTrue(0 < np.count_nonzero(depths.lower) < 100)


    def test_clashes_are_those_of_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            a, b = cbvh.bake(*cube()), cbvh.convex_hull(np.random.default_rng(4).normal(size=(60, 3)))
            scene, rows = cbvh.Scene(), []
            for number, pose in enumerate(random_poses(7, 30, 5.0)):
                name, mesh = f"{number:02}", (a, b)[number % 2]
                mesh.save(f"{folder}/{'ab'[number % 2]}.cbvh")
                scene.add(mesh, pose, name=name)
                rows.append({"file": f"{'ab'[number % 2]}.cbvh", "name": name, "pose": pose[:3].ravel().tolist()})
            pathlib.Path(folder, "parts.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
            arguments = [COMMAND, "clash", "--manifest", "parts.jsonl", "--clearance", "1", "--tolerance", "0.01", "--magnitudes", "--json"]
            asked = subprocess.run(arguments, cwd=folder, check=True, capture_output=True, text=True)
            rows = {(row["a"], row["b"]): row for row in json.loads(asked.stdout)["clashes"]}
            pairs, found = scene.clashes(clearance=1, tolerance=0.01, magnitudes=True)
            self.assertEqual(len(rows), len(pairs))
            for number, (pair, kind, depth) in enumerate(zip(pairs.tolist(), found.kind, np.array(found.depth[:2]).T)):
                row = rows[tuple(f"{instance:02}" for instance in pair)]
                self.assertEqual((row["class"], row["relation"]), (kind.name.lower(), found.relation[number]))
                known = [math.nan if row[name] is None else row[name] for name in ("lower", "upper")]
                np.testing.assert_array_equal(depth, known)
                world = scene.pose(pair[0])
                np.testing.assert_allclose(world[:3, :3] @ found.point[number] + world[:3, 3], row["point"], atol=1e-12)
                if "volume" in row:
                    shared = [part[number].tolist() for part in found.magnitudes]
                    pierced = [math.nan if part is None else part for part in row["pierced"]]
                    np.testing.assert_array_equal(shared[:4] + shared[5:], [row["volume"], row["volume_error"], *row["area"], *pierced])
                    np.testing.assert_array_equal(shared[4], row["box"])
                else:
                    self.assertTrue(np.isnan(found.magnitudes.volume[number]))
            self.assertTrue(0 < sum("volume" in row for row in rows.values()) < len(rows))
            self.assertGreater(len(set(found.kind.tolist())), 1)


@unittest.skipUnless(SHARED.exists(), WITHOUT_SHARED)
class Labels(unittest.TestCase):
    def test_labelled_depths_are_between_the_bounds(self):
        count = 0
        for line in (SHARED / "depth" / "pairs.txt").read_text().splitlines():
            words = line.split("#")[0].split()
            if not words:
                continue
            with tempfile.TemporaryDirectory() as folder:
                a, b = (cbvh.bake_files(SHARED / "depth" / name, f"{folder}/{side}") for side, name in enumerate(words[1:3]))
                labelled = [text.split("#") for text in (SHARED / "depth" / f"{words[0]}.txt").read_text().splitlines()]
                labelled = [(numbers.split(), label.split()) for numbers, label in labelled if numbers.strip()][::5]
                poses = bottom_row([numbers for numbers, _ in labelled])
                if labelled[0][1][0] == "open":
                    self.assertRaisesRegex(ValueError, "expected closed objects", a.penetration, b, poses)
                    continue
                found = a.penetration(b, poses, parallel=True)
                least = np.array([float(label[1]) for _, label in labelled])
                most = np.array([float(label[2]) if label[2:] and label[2][0].isdigit() else float(label[1]) for _, label in labelled])
                self.assertTrue(np.all(found.lower <= most * (1 + 1e-9) + 1e-13), line)
                self.assertTrue(np.all(found.upper >= least * (1 - 1e-9) - 1e-13), line)
                apart = a.relation(b, moved(poses, found.translation), parallel=True)
                self.assertEqual(set(apart[found.lower > 0].tolist()), {cbvh.Relation.APART}, line)
                count += len(poses)
        self.assertGreater(count, 100)


if __name__ == "__main__":
    unittest.main()
