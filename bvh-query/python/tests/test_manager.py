"""Tests of the collision manager: what trimesh documents, by brute force over pairs of meshes. It needs no trimesh."""

import copy
import itertools
import pickle
import threading
import types
import unittest

import numpy as np

import cbvh
from cbvh import manager as module
from common import check_errors, cube, random_poses, shifts


def solid(size=1.0):
    """What has vertices and faces, as a mesh of trimesh."""
    vertices, faces = cube(size)
    return types.SimpleNamespace(vertices=vertices, faces=np.array(faces))


class Manager(unittest.TestCase):
    def manager(self, seed, count):
        """A manager, and the meshes and poses of its objects by name."""
        manager, objects = cbvh.CollisionManager(), {}
        for number, pose in enumerate(random_poses(seed, count, 3.0)):
            vertices, faces = cube(1.0 if number % 2 else 0.5)
            objects[f"part {number}"] = (cbvh.bake(vertices, faces), pose)
            manager.add_object(f"part {number}", solid(1.0 if number % 2 else 0.5), pose)
        return manager, objects

    def relative(self, a, b):
        pose = np.linalg.inv(a) @ b
        pose[3] = [0, 0, 0, 1]
        return pose

    def touching(self, pairs):
        return {names for names, (a, at), (b, bt) in pairs if a.collide(b, self.relative(at, bt))}

    def nearest(self, pairs):
        return min((a.distance(b, self.relative(at, bt)).distance, names) for names, (a, at), (b, bt) in pairs)

    def test_collisions_are_those_of_all_pairs(self):
        manager, objects = self.manager(1, 20)
        other, others = self.manager(2, 10)
        among = [(tuple(sorted((a, b))), objects[a], objects[b]) for a, b in itertools.combinations(objects, 2)]
        between = [((a, b), objects[a], others[b]) for a in objects for b in others]
        expected = self.touching(among)
        self.assertTrue(0 < len(expected) < len(among))
        self.assertEqual(manager.in_collision_internal(return_names=True), (True, expected))
        self.assertIs(manager.in_collision_internal(), True)
        expected = self.touching(between)
        self.assertEqual(manager.in_collision_other(other, return_names=True), (True, expected))
        self.assertEqual(other.in_collision_other(manager, return_names=True)[1], {pair[::-1] for pair in expected})
        self.assertIs(manager.in_collision_other(other), True)
        single = {name: manager.in_collision_single(solid(), pose, return_names=True) for name, (_, pose) in others.items()}
        own = cbvh.bake(*cube())
        for name, (found, names) in single.items():
            pose = others[name][1]
            self.assertEqual(names, self.touching([(of, objects[of], (own, pose)) for of in objects]))
            self.assertIs(found, bool(names))
            self.assertIs(manager.in_collision_single(own, pose), found)
        # Nothing of the questions is left behind.
        self.assertEqual(manager.in_collision_internal(return_names=True)[1], self.touching(among))

    def test_contacts_are_pairs_of_triangles_in_contact_and_a_point_of_both(self):
        manager, objects = self.manager(1, 8)
        found, contacts = manager.in_collision_internal(return_data=True)
        self.assertIs(found, True)
        rows = set()
        for contact in contacts:
            a, b = sorted(contact.names)
            rows.add((a, b, contact.index(a), contact.index(b)))
            for name in (a, b):
                vertices, faces = cube(0.5 if int(name.split()[1]) % 2 == 0 else 1.0)
                corners = vertices[faces[contact.index(name)]] @ objects[name][1][:3, :3].T + objects[name][1][:3, 3]
                normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
                self.assertAlmostEqual((contact.point - corners[0]) @ normal, 0, places=12)
                weights = np.linalg.lstsq(np.vstack([corners.T, [1, 1, 1]]), [*contact.point, 1], rcond=None)[0]
                self.assertGreater(weights.min(), -1e-9)
        expected = set()
        for a, b in itertools.combinations(sorted(objects), 2):
            pose = self.relative(objects[a][1], objects[b][1])
            expected |= {(a, b, of_a, of_b) for _, of_a, _, of_b in objects[a][0].contacts(objects[b][0], pose).tolist()}
        self.assertEqual(rows, expected)
        # Depths and normals are those of pairs of objects: the one that is last in alphabetical order has to move.
        for contact in contacts:
            (a, at), (b, bt) = (objects[name] for name in sorted(contact.names))
            self.assertGreater(contact.depth, 0)
            self.assertAlmostEqual(np.linalg.norm(contact.normal), 1, places=12)
            bt = bt.copy()
            bt[:3, 3] += 1.0000001 * contact.depth * contact.normal
            self.assertEqual(a.relation(b, self.relative(at, bt)), cbvh.Relation.APART)
        with self.assertRaisesRegex(KeyError, "expected one of .*found 'no such'"):
            contacts[0].index("no such")
        mesh, pose = objects["part 0"]
        single = manager.in_collision_single(mesh, pose, return_names=True, return_data=True)
        self.assertEqual({name for contact in single[2] for name in contact.names}, single[1] | {"__external"})
        self.assertEqual(single[2][0].point.shape, (3,))

    def test_depths_and_normals_of_cubes_are_known(self):
        manager, turned = cbvh.CollisionManager(), random_poses(6, 1, 2.0)[0]
        manager.add_object("b", solid(), turned)
        at = turned @ shifts((0.9, 0.2, 0))[0]
        along = turned[:3, 0]
        manager.add_object("a", solid(), at)
        # The second object has to move: the last one in alphabetical order, or that of the question or the other manager.
        other = cbvh.CollisionManager()
        other.add_object("0", solid(), at)
        pairs = manager.in_collision_internal(return_data=True)[1]
        manager.remove_object("a")
        asked = [(pairs, -along), (manager.in_collision_single(solid(), at, return_data=True)[1], along)]
        asked += [(manager.in_collision_other(other, return_data=True)[1], along)]
        asked += [(other.in_collision_other(manager, return_data=True)[1], -along)]
        for contacts, normal in asked:
            for contact in contacts:
                self.assertAlmostEqual(contact.depth, 0.1, places=6)
                np.testing.assert_allclose(contact.normal, normal, atol=1e-6)
        self.assertAlmostEqual(manager.min_distance_single(solid(), at), -0.1, places=6)
        # A mesh that is not closed has patches, and no negative distance.
        opened = solid()
        opened.faces = opened.faces[:4]
        _, contacts = manager.in_collision_single(opened, turned @ shifts((0, 0, 0.9))[0], return_data=True)
        self.assertEqual(len({contact.depth for contact in contacts}), 1)
        self.assertTrue(all(contact.normal.shape == contact.point.shape == (3,) for contact in contacts))
        self.assertEqual(manager.min_distance_single(opened, turned @ shifts((0, 0, 0.9))[0]), 0.0)
        # The deepest pair counts.
        manager.add_object("c", solid(), turned @ shifts((0, 0.5, 0))[0])
        distance, names, data = manager.min_distance_internal(return_names=True, return_data=True)
        self.assertEqual((names, data.distance, data.names), (("b", "c"), distance, {"b", "c"}))
        self.assertAlmostEqual(distance, -0.5, places=6)

    def test_distances_are_the_least_of_all_pairs(self):
        manager, other = cbvh.CollisionManager(), cbvh.CollisionManager()
        poses = shifts((0, 0, 0), (3, 0, 0), (0, 5, 0), (0, 0, -8), (9, 9, 9))
        meshes = {name: (cbvh.bake(*cube()), pose) for name, pose in zip("abcde", poses)}
        for name, (mesh, pose) in meshes.items():
            (manager if name in "abc" else other).add_object(name, mesh, pose)
        of = [((a, b), meshes[a], meshes[b]) for a, b in itertools.combinations(meshes, 2)]
        among = self.nearest([row for row in of if "".join(row[0]) in ("ab", "ac", "bc")])
        self.assertEqual(manager.min_distance_internal(return_names=True), among)
        self.assertEqual(manager.min_distance_internal(), 2.0)
        of_c = self.nearest([row for row in of if "".join(row[0]) in ("ac", "bc")])
        self.assertEqual(manager.min_distance_internal("c", return_names=True), of_c)
        between = self.nearest([row for row in of if row[0][0] in "abc" and row[0][1] in "de"])
        distance, names, data = manager.min_distance_other(other, return_names=True, return_data=True)
        self.assertEqual((distance, names, data.distance, data.names), (*between, distance, set(names)))
        self.assertAlmostEqual(np.linalg.norm(data.point(names[0]) - data.point(names[1])), distance, places=12)
        self.assertEqual(other.min_distance_other(manager, return_names=True), (distance, names[::-1]))
        asked = manager.min_distance_single(solid(), shifts((0, 5, 3))[0], return_name=True, return_data=True)
        distance, name, data = asked
        self.assertEqual((distance, name, data.names), (2.0, "c", {"c", "__external"}))
        self.assertEqual((data.point("c")[2], data.point("__external")[2]), (0.5, 2.5))
        self.assertIn(data.index("c"), range(12))
        # A cube in another one: less the depth, and 0 where they only touch.
        self.assertAlmostEqual(manager.min_distance_single(solid(), shifts((0.5, 0, 0))[0]), -0.5, places=9)
        self.assertEqual(manager.min_distance_single(solid(), shifts((-1, 0, 0))[0]), 0.0)

    def test_distances_are_negative_only_where_surfaces_touch_and_insides_meet(self):
        flat, (corners, faces) = solid(2), cube()
        flat.vertices = flat.vertices * [1, 1, 0]
        bare, opened = cbvh.bake(corners, faces, topology=False), cbvh.bake(corners, faces[:-1])
        for other in (flat, bare, opened):
            for turn in (np.eye(4), random_poses(12, 1, 0)[0]):
                manager = cbvh.CollisionManager()
                manager.add_object("cube", solid())
                at = shifts((0.25, 0.375, 0.125))[0] @ turn
                self.assertEqual(manager.min_distance_single(other, at, return_name=True), (0.0, "cube"))
                # Two cubes overlap a little. All are inside a shell, which none of them touches.
                manager.add_object("other", other, at)
                manager.add_object("next", solid(), shifts((0, 0, 0.875))[0])
                manager.add_object("shell", solid(20.0))
                distance, names = manager.min_distance_internal(return_names=True)
                self.assertEqual(names, ("cube", "next"))
                self.assertAlmostEqual(distance, -0.125, places=9)

    def test_objects_come_go_and_move(self):
        manager = cbvh.CollisionManager()
        self.assertEqual(manager.in_collision_internal(return_names=True, return_data=True), (False, set(), []))
        self.assertEqual(manager.min_distance_internal(return_names=True, return_data=True), (np.inf, None, None))
        self.assertEqual(manager.min_distance_single(solid(), return_name=True), (np.inf, None))
        manager.add_object("a", solid())
        manager.add_object(("b", 2), solid(), shifts((5, 0, 0))[0])
        self.assertIs(manager.in_collision_internal(), False)
        manager.set_transform(("b", 2), shifts((1, 0, 0))[0])
        self.assertIs(manager.in_collision_internal(), True)
        manager.add_object("a", solid(0.5))
        self.assertIs(manager.in_collision_internal(), False)
        manager.remove_object("a")
        self.assertEqual(manager.min_distance_single(solid(), return_name=True), (0.0, ("b", 2)))
        # Transforms of float32, as trimesh rounds them.
        for pose in random_poses(3, 50, 5.0).astype(np.float32):
            manager.set_transform(("b", 2), pose)
            manager.in_collision_single(solid(), pose)

    def test_each_content_is_baked_once(self):
        manager = cbvh.CollisionManager()
        calls, bake = [], module.bake
        module.bake = lambda *arguments: calls.append(arguments) or bake(*arguments)
        try:
            own = solid(0.123)
            for number in range(10):
                manager.add_object(number, own, shifts((number, 0, 0))[0])
                manager.in_collision_single(solid(0.123))
            self.assertEqual(len(calls), 1)
            own.vertices = own.vertices * 2
            manager.add_object("larger", own)
            self.assertEqual(len(calls), 2)
        finally:
            module.bake = bake

    def test_bad_arguments_are_named(self):
        manager = cbvh.CollisionManager()
        manager.add_object("a", solid())
        flat, add = types.SimpleNamespace(vertices=[1], faces=[[0]]), manager.add_object
        cases = [
            (TypeError, "unhashable", add, ["b"], solid()),
            (ValueError, "name: expected that of an object of the manager, found 'b'", manager.remove_object, "b"),
            (ValueError, "name: expected that of an object", manager.set_transform, "b", np.eye(4)),
            (ValueError, "name: expected that of an object", manager.min_distance_internal, "b"),
            (ValueError, "transform: expected shape (4, 4)", manager.add_object, "b", solid(), np.eye(3)),
            (ValueError, "transform: expected a rotation", manager.add_object, "b", solid(), np.diag([2.0, 2, 2, 1])),
            (ValueError, "transform: row 4", manager.set_transform, "a", np.full((4, 4), np.nan)),
            (TypeError, "mesh: expected a cbvh.Mesh or an object with vertices and faces, found str", add, "b", "x"),
            (TypeError, "make a cbvh.ground that reaches far enough", add, "b", type("Halfspace", (), {})()),
            (ValueError, "vertices: expected shape (V, 3)", manager.in_collision_single, flat),
            (TypeError, "other_manager: expected a cbvh.CollisionManager, found int", manager.in_collision_other, 3),
        ]
        check_errors(self, cases)
        # Nothing was added.
        self.assertEqual(manager.in_collision_internal(return_names=True), (False, set()))
        self.assertEqual(manager.min_distance_internal(), np.inf)

    def test_threads_share_a_manager(self):
        manager, objects = self.manager(4, 20)
        expected, failures = manager.in_collision_single(solid(), return_names=True), []

        def use(number):
            for _ in range(30):
                if number % 2:
                    manager.add_object(number, solid(), shifts((99, number * 3, 0))[0])
                elif manager.in_collision_single(solid(), return_names=True) != expected:
                    failures.append(number)

        threads = [threading.Thread(target=use, args=(number,)) for number in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
        self.assertFalse(failures or any(thread.is_alive() for thread in threads))


class Copies(unittest.TestCase):
    """Managers that are copied and pickled, and objects that are solid."""

    def test_copies_and_pickles_are_managers_of_their_own(self):
        manager, _ = Manager.manager(self, 1, 12)
        manager.add_object(("a", 1), cbvh.sphere(0.5), random_poses(7, 1, 1.0)[0].astype(np.float32), radius=0.25)
        manager.add_object("full", solid(9.0), solid=True)
        manager.set_transform("part 3", shifts([0.1, 0, 0])[0])
        single = solid(0.5), shifts([0.2, 0.3, 0])[0]

        def answers(manager):
            return (
                manager.in_collision_internal(return_names=True),
                manager.in_collision_single(*single, return_names=True),
                manager.min_distance_internal("part 1", return_names=True),
                [(pair.names, pair.point.tolist()) for pair in manager.in_collision_internal(return_data=True)[1]],
            )

        expected = answers(manager)
        for other in (copy.copy(manager), copy.deepcopy(manager), pickle.loads(pickle.dumps(manager))):
            self.assertEqual(answers(other), expected)
            other.remove_object("full")
            self.assertNotEqual(answers(other), expected)
            other.add_object("full", solid(9.0), solid=True)
            self.assertEqual(answers(other)[:3], expected[:3])
        self.assertEqual(answers(manager), expected)

    def test_what_is_inside_a_mesh_collides_if_that_is_solid(self):
        for kinds in ({}, {"solid": True}):
            manager, is_solid = cbvh.CollisionManager(), bool(kinds)
            manager.add_object("shell", solid(4.0), **kinds)
            self.assertIs(manager.in_collision_single(solid()), is_solid)
            manager.add_object("part", solid())
            self.assertIs(manager.in_collision_internal(), is_solid)
            other = cbvh.CollisionManager()
            other.add_object("part", solid())
            self.assertIs(other.in_collision_single(solid(4.0), **kinds), is_solid)
            self.assertEqual(other.min_distance_single(solid(4.0), **kinds) > 0, not is_solid)
        opened = solid()
        opened.faces = opened.faces[1:]
        with self.assertRaises(ValueError) as caught:
            manager.add_object("opened", opened, solid=True)
        self.assertIn("closed", str(caught.exception))


class Primitives(unittest.TestCase):
    """Balls and capsules of trimesh, by classes that look like them to the manager."""

    @staticmethod
    def primitive(kind, **numbers):
        made = type(kind, (), {"__module__": "trimesh.primitives", "primitive": types.SimpleNamespace(**numbers)})()
        return made

    def test_balls_and_capsules_are_exact(self):
        manager = cbvh.CollisionManager()
        manager.add_object("ball", self.primitive("Sphere", radius=2.0, transform=shifts([3, 4, 0])[0]))
        capsule = self.primitive("Capsule", radius=1.0, height=2.0, transform=shifts([0, 0, 0.5])[0])
        manager.add_object("capsule", capsule)
        self.assertEqual(manager.min_distance_internal(), 2.0)
        manager.set_transform("ball", shifts([-1.2, -1.6, 0])[0])
        self.assertAlmostEqual(manager.min_distance_internal(), 0.0, delta=1e-14)
        manager.set_transform("ball", shifts([-2, -2, 0])[0])
        self.assertTrue(manager.in_collision_internal())

    def test_what_is_inside_a_solid_has_a_contact_without_triangles(self):
        manager, block = cbvh.CollisionManager(), cbvh.box([2, 2, 2])
        manager.add_object("block", block)
        self.assertIs(manager.in_collision_single(solid(0.5)), True)
        found, names, (contact,) = manager.in_collision_single(solid(0.5), return_names=True, return_data=True)
        self.assertEqual((found, names, contact.index("block"), contact.index("__external")), (True, {"block"}, -1, -1))
        self.assertTrue(np.abs(contact.point).max() <= 0.25)
        self.assertAlmostEqual(contact.depth, 1.25, places=6)
        self.assertAlmostEqual(manager.min_distance_single(solid(0.5)), -1.25, places=6)


if __name__ == "__main__":
    unittest.main()
