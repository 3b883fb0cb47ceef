"""Tests with objects of other libraries: primitives and clouds of trimesh, and trees of pyoctomap.

They skip what is not installed. Closed formulas and brute force in numpy are the oracles.
"""

import importlib.util
import itertools
import unittest

import numpy as np

import cbvh
from common import check_errors, random_poses, shifts

HAS_TRIMESH = importlib.util.find_spec("trimesh") is not None
HAS_OCTOMAP = importlib.util.find_spec("pyoctomap") is not None


def distance_of(kind, numbers, points):
    """The distances of points from a solid of trimesh in its own frame, by closed formulas."""
    if kind == "Sphere":
        return np.maximum(np.linalg.norm(points, axis=1) - numbers["radius"], 0)
    if kind == "Box":
        return np.linalg.norm(np.maximum(np.abs(points) - np.array(numbers["extents"]) / 2, 0), axis=1)
    along = np.maximum(np.abs(points[:, 2]) - numbers["height"] / 2, 0)
    across = np.linalg.norm(points[:, :2], axis=1)
    if kind == "Capsule":
        return np.maximum(np.hypot(along, across) - numbers["radius"], 0)
    return np.hypot(along, np.maximum(across - numbers["radius"], 0))


SIZES = {
    "Sphere": {"radius": 0.7},
    "Box": {"extents": [1.0, 2.0, 0.5]},
    "Capsule": {"radius": 0.3, "height": 1.5},
    "Cylinder": {"radius": 0.6, "height": 1.2},
}


@unittest.skipUnless(HAS_TRIMESH, "trimesh is not installed")
class Primitives(unittest.TestCase):
    def test_distances_of_points_are_those_of_closed_formulas(self):
        from trimesh import primitives

        rng = np.random.default_rng(5)
        for (kind, numbers), pose in itertools.product(SIZES.items(), random_poses(1, 4, 2.0)):
            manager = cbvh.CollisionManager()
            # Half of the pose is that of the primitive, half that of the object.
            at, further = pose, random_poses(9, 1, 1.0)[0]
            manager.add_object("solid", getattr(primitives, kind)(transform=at, **numbers), further)
            points = rng.uniform(-1.2, 1.2, (200, 3)) + (further @ at)[:3, 3]
            inverse = np.linalg.inv(further @ at)
            expected = distance_of(kind, numbers, points @ inverse[:3, :3].T + inverse[:3, 3])
            probe = cbvh.sphere(0.0)
            found = np.array([manager.min_distance_single(probe, shifts(point)[0]) for point in points])
            self.assertTrue(np.all(found[expected > 0] > -1e-6))
            found = np.maximum(found, 0)
            error = 0.0025 * numbers["radius"] if kind == "Cylinder" else 2e-6
            self.assertTrue(np.all(found <= expected + 2e-6) and np.all(found >= expected - error), kind)
            self.assertTrue(np.any(expected == 0) and np.any(expected > 0))
            touches = [manager.in_collision_single(probe, shifts(point)[0]) for point in points]
            self.assertTrue(np.all(np.array(touches)[expected == 0]), f"a {kind} is solid")

    def test_a_primitive_counts_as_it_is_when_it_is_given(self):
        from trimesh import primitives

        for kind, numbers in SIZES.items():
            solid, manager, probe = getattr(primitives, kind)(**numbers), cbvh.CollisionManager(), cbvh.sphere(0.0)
            at = shifts((0, 0, 5))[0]
            before = cbvh.CollisionManager()
            before.add_object("solid", solid)
            distance = before.min_distance_single(probe, at)
            solid.apply_scale(2)
            solid.apply_translation([0, 0, 1])
            manager.add_object("solid", solid)
            half = 5 - distance
            # trimesh scales the height of a capsule by another number than its radius.
            if kind in ("Sphere", "Box"):
                self.assertAlmostEqual(manager.min_distance_single(probe, at), 5 - 1 - 2 * half, places=5)
            self.assertLess(manager.min_distance_single(probe, at), distance)
            # What is in a manager stays.
            self.assertEqual(before.min_distance_single(probe, at), distance)
            if kind != "Box":
                solid.primitive.radius = 0.125
            else:
                solid.primitive.extents = [0.125] * 3
            self.assertGreater(manager.min_distance_single(solid, shifts((0, 4, 4))[0]), 1)
            frozen = getattr(primitives, kind)(mutable=False, **numbers)
            before.add_object("solid", frozen)
            self.assertEqual(before.min_distance_single(probe, at), distance)

    def test_transforms_that_are_not_rigid_are_refused(self):
        from trimesh import primitives

        for kind, numbers in SIZES.items():
            solid, manager = getattr(primitives, kind)(**numbers), cbvh.CollisionManager()
            for wrong in (np.diag([2.0, 2, 2, 1]), np.diag([1.0, 1, 3, 1])):
                solid.primitive.transform = wrong
                check_errors(self, [(ValueError, "transform of the mesh: expected a rotation", manager.add_object, "a", solid)])

    def test_extrusions_are_meshes(self):
        from trimesh import primitives

        try:
            from shapely.geometry import Polygon

            solid = primitives.Extrusion(polygon=Polygon([(0, 0), (2, 0), (2, 2), (1, 0.5)]), height=2, transform=shifts((0, 0, 1))[0])
            mesh = cbvh.bake(solid.vertices, solid.faces)
        except ImportError as error:
            self.skipTest(f"Extrusion needs more: {error}")
        manager, probe = cbvh.CollisionManager(), cbvh.sphere(0.1)
        manager.add_object("extrusion", solid)
        for pose in shifts(*np.random.default_rng(2).uniform(-3, 3, (50, 3))):
            self.assertEqual(max(manager.min_distance_single(probe, pose), 0), mesh.distance(probe, pose).distance)

    def test_clouds_are_points_with_a_radius(self):
        import trimesh

        rng = np.random.default_rng(4)
        points = rng.uniform(-1, 1, (300, 3)).astype(np.float32).astype(float)
        cloud, manager = trimesh.PointCloud(points), cbvh.CollisionManager()
        manager.add_object("cloud", cloud, radius=0.05)
        for shift in rng.uniform(-1.5, 1.5, (40, 3)):
            gaps = np.linalg.norm(points - shift, axis=1) - 0.05 - 0.25
            ball = trimesh.primitives.Sphere(radius=0.25, center=shift)
            self.assertAlmostEqual(max(manager.min_distance_single(ball), 0), max(gaps.min(), 0), places=6)
            found, contacts = manager.in_collision_single(ball, return_data=True)
            self.assertEqual({contact.index("cloud") for contact in contacts}, set(np.flatnonzero(gaps <= 0).tolist()))
            self.assertEqual(found, gaps.min() <= 0)
            # The same by a radius of the question.
            point = trimesh.PointCloud([shift])
            self.assertEqual(manager.in_collision_single(point, radius=0.25), found)
            self.assertAlmostEqual(max(manager.min_distance_single(point, radius=0.25), 0), max(gaps.min(), 0), places=6)
        # A point that both have.
        manager.add_object("box", trimesh.primitives.Box(extents=[0.5, 0.5, 0.5]), radius=0.01)
        for contact in manager.in_collision_internal(return_data=True)[1]:
            self.assertLess(np.linalg.norm(contact.point - points[contact.index("cloud")]), 0.05 + 1e-6)
            outside = np.maximum(np.abs(contact.point) - 0.25, 0)
            self.assertLess(np.linalg.norm(outside), 0.01 + 1e-6)
        check_errors(
            self,
            [
                (ValueError, "radius", lambda: manager.add_object("a", cloud, radius=-1)),
                (TypeError, "radius", lambda: manager.add_object("a", cloud, radius="1")),
            ],
        )


@unittest.skipUnless(HAS_OCTOMAP, "pyoctomap is not installed")
class Trees(unittest.TestCase):
    def test_occupied_leaves_of_a_tree_are_full(self):
        import pyoctomap

        rng, side = np.random.default_rng(6), 0.1
        # A full block, which the tree joins to larger cells, and single cells, of which some are known to be free.
        block = np.argwhere(np.ones((8, 8, 8)))
        single = rng.integers(-12, 20, (150, 3))
        full = {tuple(cell) for cell in np.vstack([block, single])}
        free = {tuple(cell) for cell in rng.integers(-12, 20, (150, 3))} - full
        tree = pyoctomap.OcTree(side)
        for cells, is_full in ((full, True), (free, False)):
            for cell in sorted(cells):
                for _ in range(8):
                    tree.updateNode((np.array(cell) + 0.5) * side, is_full)
        tree.updateInnerOccupancy()
        self.assertGreater(max(leaf.getSize() for leaf in tree.begin_leafs()), 4 * side)
        found = cbvh.octree(tree).solid()
        cells = np.array(sorted(full))
        expected = cbvh.voxels(cells, side).solid()
        self.assertLess(found.triangle_count, expected.triangle_count)
        for shift in rng.uniform(-2, 3, (200, 3)):
            pose, ball = shifts(shift)[0], cbvh.sphere(0.02)
            self.assertAlmostEqual(found.distance(ball, pose).distance, expected.distance(ball, pose).distance, places=6)
            self.assertEqual(found.collide(ball, pose), expected.collide(ball, pose))
        with self.assertRaises(ValueError):
            cbvh.octree(tree, [side])
        with self.assertRaises(cbvh.BakeError):
            cbvh.octree(pyoctomap.OcTree(side))


if __name__ == "__main__":
    unittest.main()
