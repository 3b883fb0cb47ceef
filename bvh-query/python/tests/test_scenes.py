"""Tests of scenes: brute force over all pairs with questions about meshes, the command, threads, copies and pickles."""

import concurrent.futures
import copy
import itertools
import multiprocessing
import pathlib
import pickle
import shutil
import tempfile
import threading
import unittest

import numpy as np

import cbvh
from cbvh import MotionKind, Relation, Side
from common import COMMAND, SHARED, TESTDATA, WITHOUT_COMMAND, WITHOUT_SHARED
from common import ask_command, bottom_row, check_errors, cube, numbers_of, random_poses, shifts, write_rows


def read_scene(path, folder):
    """A scene file in words: the scene, and the numbers of what moves."""
    scene, meshes, moving = cbvh.Scene(), {}, []
    for line in path.read_text().splitlines():
        word, *fields = line.split("#")[0].split() or [""]
        if word == "mesh":
            meshes[fields[0]] = cbvh.bake_files(path.parent / fields[1], folder / f"{fields[0]}.cbvh")
        elif word == "instance":
            scene.add(meshes[fields[1]], bottom_row([float(n) for n in fields[2:14]]), name=fields[0])
        elif word == "moving":
            moving += [scene.find(name) for name in fields]
        elif word == "allow":
            scene.set_allowed(*map(scene.find, fields))
    # What stands still is asked about with what moves alone.
    for number in scene:
        moves = number in moving
        scene.set_groups(number, member=2 if moves else 1, meets=3 if moves else 2)
    return scene, moving


class Asked:
    """All questions over pairs, by asking about each pair of meshes."""

    def __init__(self, scene):
        order, allowed = list(scene), {tuple(pair) for pair in scene.allowed().tolist()}
        self.pairs = []
        for a, b in itertools.combinations(order, 2):
            (member_a, meets_a), (member_b, meets_b) = scene.groups(a), scene.groups(b)
            if member_a & meets_b and member_b & meets_a and (min(a, b), max(a, b)) not in allowed:
                relative = np.linalg.inv(scene.pose(a)) @ scene.pose(b)
                relative[3] = [0, 0, 0, 1]
                self.pairs.append((a, b, scene.mesh(a), scene.mesh(b), relative))

    def of(self, ask):
        return [(a, b, ask(mesh_a, mesh_b, pose)) for a, b, mesh_a, mesh_b, pose in self.pairs]


class Pairs(unittest.TestCase):
    """Questions over all pairs."""

    @classmethod
    def setUpClass(cls):
        cls.meshes = [cbvh.bake(*cube()), cbvh.bake(*cube(0.25)), cbvh.bake(*cube(3.0))]

    def scene(self, seed, count=30, reach=4.0):
        scene = cbvh.Scene()
        poses = random_poses(seed, count, reach)
        for number, pose in enumerate(poses):
            groups = {"member": 1 << number % 3, "meets": 0b011 if number % 3 else 0xFFFFFFFF}
            scene.add(self.meshes[number % 7 % 3], pose, name=f"part {number}" if number % 2 else None, **groups)
        for a, b in ((0, 1), (9, 3), (4, 25)):
            scene.set_allowed(a, b)
        return scene

    def check(self, scene):
        asked = Asked(scene)
        self.assertGreater(len(asked.pairs), 50)
        touching = [[a, b] for a, b, touch in asked.of(lambda a, b, pose: a.collide(b, pose)) if touch]
        self.assertTrue(touching)
        self.assertEqual(scene.pairs_in_contact().tolist(), touching)
        self.assertIs(scene.collide(), True)
        near = [[a, b] for a, b, touch in asked.of(lambda a, b, pose: a.within(b, pose, 0.5)) if touch]
        self.assertEqual(scene.pairs_within(0.5).tolist(), near)
        self.assertIs(scene.within(0.5), True)
        relations = asked.of(lambda a, b, pose: a.relation(b, pose))
        expected = [([a, b], relation) for a, b, relation in relations if relation != Relation.APART]
        found = scene.relations()
        self.assertEqual(list(zip(found.pairs.tolist(), map(Relation, found.relations))), expected)
        contacts = scene.contacts()
        rows = [[a, b, *row] for a, b, rows in asked.of(lambda a, b, pose: a.contacts(b, pose)) for row in rows.tolist()]
        self.assertEqual(np.hstack([contacts.pairs, contacts.triangles]).tolist(), rows)
        least = scene.distance()
        self.assertEqual([least.a, least.b], touching[0])
        self.assertEqual(least.nearest.distance, 0.0)
        # Without those, the nearest is somewhere else.
        for a, b in touching:
            scene.set_allowed(a, b)
        apart = min((of.distance, a, b) for a, b, of in Asked(scene).of(lambda a, b, pose: a.distance(b, pose)))
        least = scene.distance()
        self.assertEqual((least.a, least.b), apart[1:])
        self.assertAlmostEqual(least.nearest.distance, apart[0], places=12)
        between = least.nearest.point_a - least.nearest.point_b
        self.assertAlmostEqual(np.linalg.norm(between), apart[0], places=12)
        self.assertIs(scene.collide(), False)
        for a, b in touching:
            scene.set_allowed(a, b, False)

    def test_questions_are_about_all_pairs_that_are_asked_about(self):
        scene = self.scene(1)
        for parallel, tracking in itertools.product((False, True), repeat=2):
            scene.parallel, scene.tracking = np.bool_(parallel), tracking
            self.assertEqual((scene.parallel, scene.tracking), (parallel, tracking))
            self.check(scene)
        # Others move, come and go.
        scene.set_poses(list(scene)[::3], random_poses(2, 10, 4.0))
        for number in (0, 5, 20):
            scene.remove(number)
        added = [scene.add(self.meshes[2], pose) for pose in random_poses(3, 2, 3.0)]
        self.assertEqual(added, [30, 31])
        self.check(scene)

    def test_distances_of_pairs_are_those_of_meshes(self):
        scene = self.scene(1)
        asked = Asked(scene)
        for parallel in (False, True):
            found = scene.distances(parallel=parallel)
            self.assertEqual(found.pairs.tolist(), [[a, b] for a, b, *_ in asked.pairs])
            poses = [cbvh.relative(scene.pose(a), scene.pose(b)) for a, b, *_ in asked.pairs]
            expected = [a.distance(b, pose) for (_, _, a, b, _), pose in zip(asked.pairs, poses)]
            for part, values in zip(found.nearest, zip(*expected)):
                np.testing.assert_array_equal(part, np.array(values))
        near = scene.distances(within=0.5)
        chosen = found.nearest.distance <= 0.5
        np.testing.assert_array_equal(near.pairs, found.pairs[chosen])
        np.testing.assert_array_equal(near.nearest.point_b, found.nearest.point_b[chosen])
        # In the order given, named or not, asked about or not.
        some = scene.distances([["part 3", "part 1"], [0, 1]])
        self.assertEqual(some.pairs.tolist(), [[3, 1], [0, 1]])
        of = [scene.mesh(a).distance(scene.mesh(b), cbvh.relative(scene.pose(a), scene.pose(b))) for a, b in some.pairs]
        self.assertEqual(some.nearest.distance.tolist(), [one.distance for one in of])
        for none in (scene.distances(np.zeros((0, 2), int)), scene.distances([]), cbvh.Scene().distances()):
            self.assertEqual((none.pairs.shape, none.nearest.point_a.shape), ((0, 2), (0, 3)))
            self.assertEqual(none.nearest.triangle_a.dtype, np.uint32)

    def test_the_least_signed_distance_is_that_of_all_pairs(self):
        scene, signs = self.scene(1), []
        for _ in range(2):
            asked = Asked(scene)
            poses = [cbvh.relative(scene.pose(a), scene.pose(b)) for a, b, *_ in asked.pairs]
            answers = [(a, b, of_a.signed_distance(of_b, pose)) for (a, b, of_a, of_b, _), pose in zip(asked.pairs, poses)]
            a, b, expected = min(answers, key=lambda answer: answer[2].lower)
            signs.append(np.sign(expected.lower))
            for scene.parallel, scene.tracking in itertools.product((False, True), repeat=2):
                found = scene.signed_distance()
                self.assertEqual((found.a, found.b), (a, b))
                self.assertEqual(list(map(type, found.nearest)), list(map(type, expected)))
                for part, of_pair in zip(found.nearest, expected):
                    np.testing.assert_array_equal(part, of_pair)
            # Without those that overlap, the nearest pair is the answer.
            for a, b, of_pair in answers:
                scene.set_allowed(a, b, of_pair.lower <= 0)
        self.assertEqual(signs, [-1, 1])

    def test_near_pairs_are_those_of_meshes(self):
        scene, margin = self.scene(1), 0.5
        asked = Asked(scene)
        expected = []
        for a, b, of_a, of_b, _ in asked.pairs:
            found = of_a.signed_distance(of_b, cbvh.relative(scene.pose(a), scene.pose(b)))
            if found.upper <= margin:
                expected.append(((a, b), found))
        signs = {found.lower > 0 for _, found in expected}
        self.assertTrue(signs == {False, True} and len(expected) < len(asked.pairs), (len(expected), len(asked.pairs)))
        for scene.parallel, scene.tracking in itertools.product((False, True), repeat=2):
            near = scene.near_pairs(margin)
            self.assertEqual([tuple(pair) for pair in near.pairs.tolist()], [pair for pair, _ in expected])
            for number, (_, of_pair) in enumerate(expected):
                for part, of_part in zip(near.nearest, of_pair):
                    np.testing.assert_array_equal(part[number], of_part)
            self.assertTrue(np.all((near.nearest.lower <= near.distance) & (near.distance <= near.nearest.upper)))
        none = cbvh.Scene().near_pairs(1)
        self.assertEqual((none.pairs.shape, none.distance.shape, none.nearest.normal.shape), ((0, 2), (0,), (0, 3)))
        check_errors(
            self,
            [(ValueError, "margin: expected a finite distance", scene.near_pairs, bad) for bad in (-1, np.nan, np.inf)]
            + [
                (TypeError, "margin: expected a number", scene.near_pairs, None),
                (ValueError, "relative_gap", lambda: scene.near_pairs(1, relative_gap=-1)),
            ],
        )

    def test_a_block_passes_through_another_one(self):
        # The third one is always 0.75 from the large one, which it faces.
        scene, around = cbvh.Scene(), random_poses(9, 1, 5.0)[0]
        corners, faces = cube()
        large, third = scene.add(cbvh.bake(corners * [2, 4, 4], faces), around), scene.add(self.meshes[0])
        small = scene.add(self.meshes[0])
        scene.set_pose(third, around @ shifts((0, -3.25, 0))[0])
        for x in np.arange(-24, 25) / 8:
            scene.set_pose(small, around @ shifts((x, 0.25, 0))[0])
            of_small, of_third = (abs(x) - 1.5, small, np.sign(x) * around[:3, 0]), (0.75, third, -around[:3, 1])
            number, other, along = of_small if of_small[0] < 0.75 else of_third
            for gap in (1e-6, 1.0):
                found = scene.signed_distance(relative_gap=gap)
                self.assertTrue(found.nearest.lower <= number + 1e-12 and number - 1e-12 <= found.nearest.upper)
                self.assertLess(found.nearest.upper - found.nearest.lower, 1e-9 + gap * abs(number))
                if abs(x) == 2.25:
                    continue
                self.assertEqual((found.a, found.b), (large, other))
                if abs(x) not in (0, 1.5) and gap < 1:
                    np.testing.assert_allclose(around[:3, :3] @ found.nearest.normal, along, atol=1e-9)
        # A margin makes it less.
        scene.set_pose(small, around @ shifts((1, 0.25, 0))[0])
        scene.set_margin(large, 0.125)
        self.assertAlmostEqual(scene.signed_distance().nearest.lower, -0.625, places=9)
        # What is not closed has no depth, and where it touches, the number is 0.
        scene.set_mesh(small, cbvh.bake(corners, faces[2:]))
        found = scene.signed_distance()
        self.assertEqual(({found.a, found.b}, found.nearest.is_signed), ({large, small}, False))
        self.assertEqual((found.nearest.lower, found.nearest.translation.tolist()), (0, [0, 0, 0]))
        scene.remove(small)
        scene.remove(third)
        self.assertIsNone(scene.signed_distance())

    def test_closest_points_of_some_instances(self):
        scene = self.scene(7)
        points = np.random.default_rng(8).uniform(-4, 4, (100, 3))
        some = [9, 2, 20, 2]
        distances = {number: scene.mesh(number).closest_points(points, pose=scene.pose(number)).distance for number in some}
        least = np.min(list(distances.values()), axis=0)
        for scene.parallel in (False, True):
            found = scene.closest_points(points, instances=["part 9", 2, 20, 2])
            self.assertEqual(set(found.instance), {2, 9, 20})
            np.testing.assert_array_equal(found.closest.distance, least)
            of = [distances[number][place] for place, number in enumerate(found.instance.tolist())]
            np.testing.assert_array_equal(of, least)
            near = scene.closest_points(points, instances=some, within=0.5)
            np.testing.assert_array_equal(near.instance >= 0, least <= 0.5)
        whole = scene.closest_points(points, instances=list(scene))
        np.testing.assert_array_equal(whole.closest.distance, scene.closest_points(points).closest.distance)
        self.assertEqual(scene.closest_points(points[0], instances=[]).instance, -1)

    def test_names_stand_for_instances(self):
        named, numbered = cbvh.Scene(), cbvh.Scene()
        for scene in (named, numbered):
            for name, pose in zip("abc", random_poses(9, 3, 2.0)):
                scene.add(self.meshes[0], pose, name=name)
        poses = random_poses(10, 3, 2.0)
        for scene, (a, b, c) in ((named, "abc"), (numbered, range(3))):
            scene.set_pose(a, poses[0])
            scene.set_poses([c, b], poses[1:])
            scene.set_groups(b, member=3)
            scene.set_allowed(a, c)
            self.assertEqual((scene.name(a), scene.groups(b), scene.mesh(c)), ("a", (3, 0xFFFFFFFF), self.meshes[0]))
        np.testing.assert_array_equal(named.poses(["a", "b", "c"]), numbered.poses())
        np.testing.assert_array_equal(named.poses(np.array(["b", "a"])), numbered.poses([1, 0]))
        np.testing.assert_array_equal(named.pose("c"), numbered.pose(2))
        self.assertEqual(named.allowed().tolist(), numbered.allowed().tolist())
        way = cbvh.Motion.between(poses[0], poses[1])
        self.assertEqual(repr(named.motion({"a": way})), repr(numbered.motion({0: way})))
        self.assertEqual(named.is_free({"a": way}), numbered.is_free({0: way}))
        named.remove("b")
        self.assertEqual(list(named), [0, 2])

    def test_instances_are_what_was_added(self):
        scene = cbvh.Scene()
        poses = random_poses(4, 3, 2.0)
        a = scene.add(self.meshes[0], poses[0], name="a")
        b = scene.add(self.meshes[1], name="b", member=1, meets=2)
        c = scene.add(self.meshes[0], poses[2])
        self.assertEqual((list(scene), len(scene), a in scene, 7 in scene, "a" in scene, "x" in scene),
                         ([a, b, c], 3, True, False, True, False))
        self.assertEqual([scene.name(number) for number in scene], ["a", "b", None])
        self.assertEqual((scene.find("b"), scene.find("c")), (b, None))
        self.assertEqual((scene.groups(a), scene.groups(b)), ((0xFFFFFFFF, 0xFFFFFFFF), (1, 2)))
        self.assertIs(scene.mesh(b), self.meshes[1])
        np.testing.assert_array_equal(scene.poses(), [poses[0], np.eye(4), poses[2]])
        np.testing.assert_array_equal(scene.poses([c, a]), poses[[2, 0]])
        scene.set_pose(b, poses[1])
        np.testing.assert_array_equal(scene.pose(b), poses[1])
        scene.set_groups(a, member=4)
        self.assertEqual(scene.groups(a), (4, 0xFFFFFFFF))
        scene.set_allowed(c, a)
        self.assertEqual(scene.allowed().tolist(), [[a, c]])
        scene.remove(a)
        self.assertEqual((scene.allowed().tolist(), scene.find("a"), list(scene)), ([], None, [b, c]))
        self.assertEqual(scene.add(self.meshes[0], name="a"), 3)

    def test_an_empty_scene_has_nothing_in_it(self):
        scene = cbvh.Scene()
        self.assertEqual((scene.collide(), scene.distance(), len(scene), list(scene)), (False, None, 0, []))
        self.assertEqual((scene.pairs_within(3).shape, scene.contacts().triangles.shape), ((0, 2), (0, 4)))
        self.assertEqual((scene.sides([0, 0, 0]), scene.closest_points([0, 0, 0]).instance), (Side.OUTSIDE, -1))
        self.assertTrue(np.isnan(scene.signed_point_distances([0, 0, 0])))
        self.assertIsNone(scene.signed_distance(relative_gap=0.1, tolerance=1))

    def test_probes_meet_the_nearest_instance(self):
        scene = cbvh.Scene()
        poses = random_poses(5, 12, 3.0)
        for number, pose in enumerate(poses):
            scene.add(self.meshes[number % 2], pose)
        random_numbers = np.random.default_rng(6)
        points, others = random_numbers.uniform(-4, 4, (2, 100, 3))
        of = [(scene.mesh(number), scene.pose(number)) for number in scene]
        distances = np.array([mesh.closest_points(points, pose=pose).distance for mesh, pose in of])
        sides = np.array([mesh.sides(points, pose=pose) for mesh, pose in of])
        hits = [mesh.first_hits(points, others - points, pose=pose) for mesh, pose in of]
        ts = np.array([np.where(hit.found, hit.t, np.inf) for hit in hits])
        meets = np.array([mesh.segment_hits(points, others, pose=pose) for mesh, pose in of]).any(axis=0)
        for scene.parallel in (False, True):
            near = scene.closest_points(points)
            np.testing.assert_array_equal(near.instance, np.argmin(distances, axis=0))
            np.testing.assert_array_equal(near.closest.distance, distances.min(axis=0))
            found = scene.sides(points)
            np.testing.assert_array_equal(found == Side.INSIDE, (sides == Side.INSIDE).any(axis=0))
            signs = np.where(found == Side.INSIDE, -1, 1)
            np.testing.assert_array_equal(scene.signed_point_distances(points), signs * distances.min(axis=0))
            first = scene.first_hits(points, others - points)
            np.testing.assert_array_equal(first.hit.found, np.isfinite(ts).any(axis=0))
            np.testing.assert_array_equal(first.instance, np.where(first.hit.found, np.argmin(ts, axis=0), -1))
            np.testing.assert_array_equal(first.hit.t[first.hit.found], ts.min(axis=0)[first.hit.found])
            np.testing.assert_array_equal(scene.any_hits(points, others - points), first.hit.found)
            np.testing.assert_array_equal(scene.segment_hits(points, others), meets)
            every = scene.all_hits(points, others - points)
            of_each = [mesh.all_hits(points, others - points, pose=pose) for mesh, pose in of]
            expected = [sum(len(hit.t) for hit in hits) for hits in zip(*of_each)]
            self.assertEqual([len(hit.instance) for hit in every], expected)
            self.assertTrue(all(np.all(np.diff(hit.hit.t) >= 0) for hit in every))
            limited = scene.closest_points(points, within=0.5)
            np.testing.assert_array_equal(limited.instance >= 0, distances.min(axis=0) <= 0.5)
        one = scene.first_hits(points[0], others[0] - points[0], until=1)
        self.assertEqual((type(one.instance), one.hit.found), (int, bool(meets[0])))


class Ways(unittest.TestCase):
    """Instances that move."""

    def setUp(self):
        self.cube = cbvh.bake(*cube())
        self.scene = cbvh.Scene()
        self.wall = self.scene.add(self.cube, shifts((3, 0, 0))[0])
        self.part = self.scene.add(self.cube, shifts((0, 9, 0))[0])
        self.other = self.scene.add(self.cube, shifts((0, 0, 9))[0])

    def test_the_earliest_hit_of_all_pairs_is_the_answer(self):
        way = {self.part: cbvh.Motion.between(*shifts((0, 0, 0), (8, 0, 0)))}
        hit = self.scene.motion(way)
        # At 8 t = 2 they touch.
        self.assertIs(hit.kind, MotionKind.HIT)
        self.assertTrue(hit.free_until <= 0.25 <= hit.at < 0.25 + 1e-6)
        self.assertEqual((hit.a, hit.b, hit.nearest.distance), (self.wall, self.part, 0.0))
        self.assertIs(self.scene.is_free(way), False)
        # The wall moves away as fast.
        way[self.wall] = cbvh.Motion.between(*shifts((3, 0, 0), (11, 0, 0)))
        free = self.scene.motion(way)
        self.assertEqual((free.kind, free.free_until), (MotionKind.FREE, 1.0))
        self.assertEqual((free.a, free.b, free.nearest), (None, None, None))
        self.assertIs(self.scene.is_free(way), True)
        self.assertIs(self.scene.is_free(way, clearance=2.0), False)
        self.assertIs(self.scene.is_free(way, clearance=1.9), True)
        self.assertIs(self.scene.is_free({}), True)
        np.testing.assert_array_equal(self.scene.pose(self.part), shifts((0, 9, 0))[0])

    def test_paths_of_ones_own_may_use_the_scene(self):
        outer = self

        class Own:
            def pose(self, t):
                outer.scene.collide()
                outer.scene.set_pose(outer.other, shifts((0, 0, 9 + t))[0])
                return shifts((8 * t, 0, 0))[0]

            def sagitta(self, radius, t0, t1):
                return 1e-12

        class Falls(Own):
            def sagitta(self, radius, t0, t1):
                raise KeyError("beyond")

        for self.scene.parallel in (False, True):
            self.assertTrue(0.25 <= self.scene.motion({self.part: Own()}).at < 0.25 + 1e-6)
            self.assertIs(self.scene.is_free({self.part: Own()}), False)
            for ask in (self.scene.motion, self.scene.is_free):
                with self.assertRaisesRegex(KeyError, "beyond"):
                    ask({self.part: Falls()})
            with concurrent.futures.ThreadPoolExecutor(4) as pool:
                asked = [pool.submit(self.scene.is_free, {self.part: Own()}) for _ in range(8)]
                asked += [pool.submit(self.scene.collide) for _ in range(8)]
                self.assertFalse(any(future.result(60) for future in asked))


class Attached(unittest.TestCase):
    """Instances that move with others, and meshes that are swapped."""

    def setUp(self):
        self.cube = cbvh.bake(*cube())
        self.scene = cbvh.Scene()
        self.wall = self.scene.add(self.cube, shifts((3, 0, 0))[0])
        self.gripper = self.scene.add(self.cube, shifts((0, 0, 0))[0], name="gripper")
        self.part = self.scene.add(self.cube, shifts((0, 1.2, 0))[0], name="part")
        self.label = self.scene.add(self.cube.rounded(0.1), shifts((0, 1.2, 2))[0], name="label")

    def test_what_is_attached_follows_and_answers_are_those_of_its_poses(self):
        scene, touching = self.scene, 0
        scene.attach("part", "gripper")
        scene.attach(self.label, self.part)
        self.assertEqual([scene.parent(number) for number in scene], [None, None, self.gripper, self.part])
        kept = [scene.pose(self.part), np.linalg.inv(scene.pose(self.part)) @ scene.pose(self.label)]
        for pose in random_poses(12, 40, 2.0):
            scene.set_pose("gripper", pose)
            np.testing.assert_allclose(scene.pose("part"), pose @ kept[0], atol=1e-14)
            np.testing.assert_allclose(scene.pose("label"), pose @ kept[0] @ kept[1], atol=1e-14)
            by_hand = cbvh.Scene()
            for number in scene:
                by_hand.add(scene.mesh(number), scene.pose(number))
            contacts = scene.contacts(), by_hand.contacts()
            for one, other in zip(*contacts):
                np.testing.assert_array_equal(one, other)
            touching += len(contacts[0].triangles)
            self.assertEqual(str(scene.distance()), str(by_hand.distance()))
            for one, other in zip(scene.first_hits([0, 0, 9], [0, 0, -1]).hit, by_hand.first_hits([0, 0, 9], [0, 0, -1]).hit):
                np.testing.assert_array_equal(one, other)
        self.assertGreater(touching, 10)
        # The pose of a child changes what is kept; without its parent, it stays.
        scene.set_poses(["part", "gripper"], shifts((0, 5, 0), (0, 4, 0)))
        scene.set_pose("gripper", np.eye(4))
        np.testing.assert_array_equal(scene.pose("part"), shifts((0, 1, 0))[0])
        scene.detach("part")
        scene.remove("gripper")
        self.assertIs(scene.parent("part"), None)
        np.testing.assert_array_equal(scene.pose("part"), shifts((0, 1, 0))[0])
        self.assertEqual(scene.parent("label"), self.part)

    def test_a_motion_takes_along_what_is_attached(self):
        scene, way = self.scene, {"gripper": cbvh.Motion.between(*shifts((0, 3, 0), (8, 3, 0)))}
        self.assertIs(scene.is_free(way), True)
        scene.set_pose("part", shifts((0, -3, 0))[0])
        scene.attach("part", "gripper")
        hit = scene.motion(way)
        # At 8 t = 2 the part, which is 3 below, touches the wall.
        self.assertIs(hit.kind, MotionKind.HIT)
        self.assertTrue(hit.free_until <= 0.25 <= hit.at < 0.25 + 1e-6)
        self.assertEqual((hit.a, hit.b), (self.wall, self.part))
        way["part"] = cbvh.Motion.between(*shifts((0, -2, 0), (0, -3, 0)))
        self.assertIs(scene.is_free(way), True)

    def test_wrong_parents_are_refused(self):
        scene = self.scene
        scene.attach("part", "gripper")
        scene.attach("label", "part")
        expected = 'parent: expected an instance that does not move with instance "gripper", found "{}"'
        for parent in ("gripper", "part", "label"):
            with self.assertRaisesRegex(ValueError, expected.format(parent)):
                scene.attach("gripper", parent)
        check_errors(self, [
            (KeyError, "child: expected an instance of the scene, found 'nobody'", scene.attach, "nobody", "part"),
            (KeyError, "parent: expected an instance of the scene, found 77; was it removed?", scene.attach, "part", 77),
            (KeyError, "id: expected an instance of the scene, found 77; was it removed?", scene.detach, 77),
            (KeyError, "id: expected an instance of the scene, found 77; was it removed?", scene.parent, 77),
            (KeyError, "id: expected an instance of the scene, found 77; was it removed?", scene.set_mesh, 77, self.cube),
            (TypeError, "mesh: expected a cbvh.Mesh, found int", scene.set_mesh, "part", 5),
        ])
        scene.set_pose("part", shifts((2.0**117, 0, 0))[0])
        before = scene.poses()
        with self.assertRaisesRegex(ValueError, 'instance "part": expected a translation'):
            scene.set_pose("gripper", shifts((2.0**118, 0, 0))[0])
        np.testing.assert_array_equal(scene.poses(), before)

    def test_copies_and_pickles_keep_what_is_attached(self):
        scene = self.scene
        for number, pose in zip(scene, random_poses(13, 4, 2.0)):
            scene.set_pose(number, pose)
        scene.attach("part", "gripper")
        scene.attach("label", "part")
        turned = random_poses(14, 1, 2.0)[0]
        for other in (scene.copy(), pickle.loads(pickle.dumps(scene))):
            np.testing.assert_array_equal(other.poses(), scene.poses())
            moved = scene.copy()
            moved.set_pose("gripper", turned)
            other.set_pose("gripper", turned)
            np.testing.assert_array_equal(other.poses(), moved.poses())
            self.assertFalse(np.array_equal(other.pose("label"), scene.pose("label")))

    def test_a_swapped_mesh_keeps_the_rest(self):
        scene, cloud = self.scene, cbvh.bake(*cube(4.0))
        self.assertEqual(scene.pairs_in_contact().tolist(), [])
        scene.set_margin("part", 0.05)
        scene.set_allowed("part", "gripper")
        scene.attach("part", "gripper")
        scene.set_mesh("part", cloud)
        self.assertIs(scene.mesh("part"), cloud)
        self.assertEqual((scene.margin("part"), scene.parent("part"), scene.find("part")), (0.05, self.gripper, self.part))
        self.assertEqual(scene.pairs_in_contact().tolist(), [[self.part, self.label]])
        scene.set_mesh("part", self.cube)
        self.assertEqual(scene.pairs_in_contact().tolist(), [])

    def test_changes_do_not_wait_for_a_question_nor_disturb_it(self):
        scene, outer = self.scene, self
        begun, changed = threading.Event(), threading.Event()

        class Waits:
            def pose(self, t):
                begun.set()
                outer.assertTrue(changed.wait(60), "a change waits for the question")
                return shifts((8 * t, 0, 0))[0]

            def sagitta(self, radius, t0, t1):
                return 1e-12

        for self.scene.parallel in (False, True):
            begun.clear(), changed.clear()
            with concurrent.futures.ThreadPoolExecutor(1) as pool:
                asked = pool.submit(scene.motion, {"gripper": Waits()})
                self.assertTrue(begun.wait(60))
                # The wall of the question stays where it was, whatever happens to it.
                scene.set_pose(self.wall, shifts((30, 0, 0))[0])
                scene.set_mesh(self.wall, cbvh.bake(*cube(0.1)))
                scene.set_margin(self.wall, 0.2)
                self.assertEqual(scene.collide(), False)
                moved = scene.copy()
                scene.remove(self.wall)
                changed.set()
                hit = asked.result(60)
            self.assertEqual((hit.kind, hit.a, hit.b), (MotionKind.HIT, self.wall, self.gripper))
            self.assertTrue(hit.free_until <= 0.25 <= hit.at < 0.25 + 1e-6)
            self.assertNotIn(self.wall, scene)
            self.assertEqual(moved.margin(self.wall), 0.2)
            self.wall = scene.add(self.cube, shifts((3, 0, 0))[0])

    def test_each_answer_is_that_of_one_scene_while_another_thread_swaps_meshes(self):
        scene, meshes = self.scene, (self.cube, cbvh.bake(*cube(4.0)))
        for offset in range(12):
            scene.add(self.cube, shifts((1.5 * offset, 1.5, 0.3))[0])
        scene.tracking = True
        asked = scene.contacts, scene.distance, lambda: scene.first_hits([3, 0, 9], [0, 0, -1]), scene.pairs_in_contact
        answers = [[str(ask()) for ask in asked] for mesh in meshes if scene.set_mesh(self.wall, mesh) is None]
        for one, other in zip(*answers):
            self.assertNotEqual(one, other)
        over, seen = threading.Event(), [set() for _ in asked]

        def ask(number):
            for _ in range(100_000):
                found = str(asked[number]())
                self.assertIn(found, (answers[0][number], answers[1][number]))
                seen[number].add(found)
                if over.is_set():
                    return

        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            asking = [pool.submit(ask, number) for number in range(4)]
            for step in range(100_000):
                scene.set_mesh(self.wall, meshes[step % 2])
                if all(len(found) == 2 for found in seen) or any(future.done() for future in asking):
                    break
            over.set()
            for future in asking:
                future.result(60)
        self.assertEqual([len(found) for found in seen], [2] * 4)


class Misuse(unittest.TestCase):
    """Wrong arguments."""

    def test_exceptions_name_what_is_wrong(self):
        mesh, scene, one = cbvh.bake(*cube()), cbvh.Scene(), np.eye(4)
        gone = scene.add(mesh, name="gone")
        scene.remove(gone)
        here = scene.add(mesh, name="here")
        skewed = one + np.eye(4, k=1) * [[2**-22], [0], [0], [0]]
        stale = f"expected an instance of the scene, found {gone}; was it removed?"
        motion = cbvh.Motion.between(one, one)
        cases = [
            (KeyError, f"id: {stale}", scene.remove, gone),
            (KeyError, f"id: {stale}", scene.name, gone),
            (KeyError, f"id: {stale}", scene.mesh, gone),
            (KeyError, f"id: {stale}", scene.groups, gone),
            (KeyError, f"id: {stale}", scene.set_groups, gone),
            (KeyError, f"id: {stale}", scene.pose, gone),
            (KeyError, f"ids: {stale}", scene.poses, [here, gone]),
            (KeyError, f"id: {stale}", scene.set_pose, gone, one),
            (KeyError, f"ids: {stale}", scene.set_poses, [here, gone], [one, one]),
            (KeyError, f"b: {stale}", scene.set_allowed, here, gone),
            (KeyError, f"paths: {stale}", scene.motion, {gone: motion}),
            (KeyError, "found 1208925819614629174706176", scene.remove, 2**80),
            (KeyError, "found -5", scene.pose, -5),
            (TypeError, "name: expected a str, found int", scene.find, 5),
            (TypeError, "d: expected a number, found str", scene.within, "x"),
            (TypeError, "clearance: expected a number, found str", lambda: scene.motion({here: motion}, clearance="x")),
            (TypeError, "id: expected the number or the name of an instance, found float", scene.remove, 1.5),
            (KeyError, "id: expected an instance of the scene, found 'gone'", scene.remove, "gone"),
            (KeyError, "paths: expected an instance of the scene, found 'gone'", scene.motion, {"gone": motion}),
            (ValueError, "paths: expected one path per instance", scene.motion, {"here": motion, here: motion}),
            (KeyError, "ids: expected an instance of the scene, found 'gone'", scene.poses, ["here", "gone"]),
            (KeyError, "instances: expected an instance of the scene, found 'gone'",
             lambda: scene.closest_points([0, 0, 0], instances=["gone"])),
            (KeyError, f"instances: {stale}", lambda: scene.closest_points([0, 0, 0], instances=[gone])),
            (ValueError, "pairs: expected numbers or names of instances of shape (N, 2)", scene.distances, [here]),
            (ValueError, "within: expected None beside pairs", lambda: scene.distances([[here, here]], within=1)),
            (KeyError, "pairs: expected an instance of the scene, found 'gone'", scene.distances, [["here", "gone"]]),
            (TypeError, "mesh: expected a cbvh.Mesh, found str", scene.add, "mesh"),
            (ValueError, "pose: expected shape (4, 4)", scene.add, mesh, one[:3]),
            (ValueError, "pose: expected a rotation within 2^-23 of orthonormal", scene.add, mesh, skewed),
            (ValueError, "pose: row 4", scene.add, mesh, one * np.nan),
            (ValueError, 'instance "here": expected a rotation within 2^-23', scene.set_pose, here, skewed),
            (ValueError, "poses[1]: expected a rotation", scene.set_poses, [here, here], [one, np.diag([2.0, 2, 2, 1])]),
            (ValueError, "poses: expected as many as ids, 1, found 2", scene.set_poses, [here], [one, one]),
            (ValueError, "ids: expected numbers or names of instances of shape (N,)", scene.set_poses, [[here]], [one]),
            (ValueError, "found dtype float64 of shape (1,)", scene.poses, np.array([0.5])),
            (TypeError, "ids: expected the number or the name of an instance, found float", scene.poses, [0.5]),
            (ValueError, "d: expected a finite distance of at least 0, found -1", scene.within, -1),
            (ValueError, "d: expected a finite distance of at least 0, found NaN", scene.pairs_within, np.nan),
            (ValueError, "relative_gap: expected a finite part above 0, found 0", lambda: scene.signed_distance(relative_gap=0)),
            (ValueError, "tolerance: expected a finite depth of at least 0", lambda: scene.signed_distance(tolerance=np.nan)),
            (TypeError, "tolerance: expected a number, found str", lambda: scene.signed_distance(tolerance="x")),
            (ValueError, "points: expected shape (3,) or (N, 3)", scene.sides, [0, 0]),
            (TypeError, "parallel: expected a bool, found str", setattr, scene, "parallel", "x"),
            (TypeError, "tracking: expected a bool, found int", setattr, scene, "tracking", 1),
            (TypeError, "paths: expected a mapping", scene.motion, [motion]),
            (TypeError, f"paths[{here}]: expected a cbvh.Motion", scene.is_free, {here: one}),
            (FileNotFoundError, "no such.cbvh", cbvh.Scene.open, "no such.cbvh"),
            (cbvh.FormatError, "expected a scene, a file with instances", cbvh.Scene.open, TESTDATA / "ok-plain.cbvh"),
        ]
        check_errors(self, cases)
        with self.assertRaisesRegex(ValueError, 'name: expected one that no instance has, found "here"'):
            scene.add(mesh, name="here")
        for groups in ({"member": -1}, {"meets": 1 << 32}):
            with self.assertRaisesRegex(ValueError, f"{next(iter(groups))}: expected 32 bits of groups"):
                scene.add(mesh, **groups)
        self.assertEqual((list(scene), scene.pose(here).tolist()), ([here], one.tolist()))

    def test_damage_names_the_instance(self):
        whole = cbvh.bake(*cube()).tobytes()
        damaged = cbvh.Mesh.from_bytes(whole[:8192] + bytes([whole[8192] ^ 1]) + whole[8193:])
        scene = cbvh.Scene()
        scene.add(cbvh.bake(*cube(0.5)), name="whole")
        scene.add(damaged)
        with self.assertRaisesRegex(cbvh.FormatError, 'instances "whole" and 1: .*R'):
            scene.contacts()
        with self.assertRaisesRegex(cbvh.FormatError, 'instances "whole" and 1: .*R'):
            scene.signed_distance()
        scene.set_mesh(1, cbvh.bake(*cube(), topology=False))
        with self.assertRaisesRegex(ValueError, 'instances "whole" and 1: .*topology'):
            scene.signed_distance()


class Sharing(unittest.TestCase):
    """Files, threads, copies and processes."""

    def scene(self):
        meshes = cbvh.bake(*cube()), cbvh.bake(*cube(0.5))
        scene = cbvh.Scene()
        for number, pose in enumerate(random_poses(8, 20, 3.0)):
            scene.add(meshes[number % 2], pose, name=f"part {number}", meets=0xFFFFFFFF ^ number)
        scene.set_allowed(2, 5)
        scene.remove(3)
        scene.tracking = True
        return scene

    def same(self, one, other):
        self.assertEqual(list(one), list(other))
        for left, right in zip(map(one.name, one), map(other.name, other)):
            self.assertEqual(left, right)
        self.assertEqual([one.groups(number) for number in one], [other.groups(number) for number in other])
        np.testing.assert_array_equal(one.poses(), other.poses())
        np.testing.assert_array_equal(one.allowed(), other.allowed())
        np.testing.assert_array_equal(one.contacts().triangles, other.contacts().triangles)
        self.assertEqual((one.parallel, one.tracking), (other.parallel, other.tracking))

    def test_solid_instances_are_touched_by_what_is_inside(self):
        shell, inner = cbvh.bake(*cube(4)), cbvh.bake(*cube(1))
        for solid in (False, True):
            scene = cbvh.Scene()
            outer = scene.add(shell, solid=solid)
            scene.add(inner)
            self.assertIs(scene.collide(), solid)
            self.assertIs(scene.mesh(outer).is_solid, solid)
            self.assertIs(pickle.loads(pickle.dumps(scene)).collide(), solid)
        vertices, faces = cube()
        with self.assertRaises(ValueError) as caught:
            scene.add(cbvh.bake(vertices, faces[1:]), solid=True)
        self.assertIn("closed", str(caught.exception))
        self.assertEqual(len(scene), 2)

    def test_copies_and_pickles_are_scenes_of_their_own(self):
        scene = self.scene()
        for other in (scene.copy(), copy.copy(scene), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
            self.same(scene, other)
            other.set_pose(0, np.eye(4))
            other.remove(1)
            self.assertEqual((other.add(other.mesh(0)), 1 in scene), (20, True))
        # Each mesh once.
        size = sum(len(scene.mesh(number).tobytes()) for number in (0, 1))
        self.assertLess(len(pickle.dumps(scene)), size + 20_000)

    def test_threads_share_a_scene(self):
        scene = self.scene()
        expected = scene.pairs_in_contact().tolist()
        ids, still = list(scene), scene.poses()

        def use(number):
            if number % 4 == 0:
                scene.set_poses(ids, still)
            if number % 4 == 1:
                scene.remove(scene.add(scene.mesh(0), shifts((99, number, 0))[0]))
            if number % 4 == 2:
                scene.parallel = number % 8 == 2
            return scene.pairs_in_contact().tolist(), scene.distance().nearest.distance

        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            for found in pool.map(use, range(400)):
                self.assertEqual(found, (expected, 0.0))

    def test_other_processes_open_the_same_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "cube.cbvh"
            cbvh.bake(*cube()).save(path)
            mesh, scene = cbvh.open(path), cbvh.Scene()
            for number in range(50):
                scene.add(mesh, shifts((number * 0.9, 0, 0))[0])
            self.assertLess(len(pickle.dumps(scene)), 50 * 300)
            with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
                found = pool.submit(scene.pairs_in_contact).result()
            self.assertEqual(found.tolist(), [[number, number + 1] for number in range(49)])

    def test_a_scene_file_is_opened_with_its_meshes(self):
        scene = cbvh.Scene.open(TESTDATA / "ok-scene.cbvh")
        self.assertGreater(len(scene), 1)
        again = pickle.loads(pickle.dumps(scene))
        self.same(scene, again)
        meshes = {repr(scene.mesh(number)) for number in scene}
        self.assertTrue(all("ok-scene.cbvh" in mesh and "object" in mesh for mesh in meshes))
        asked = Asked(scene).of(lambda a, b, pose: a.collide(b, pose))
        self.assertEqual(scene.pairs_in_contact().tolist(), [[a, b] for a, b, touch in asked if touch])


@unittest.skipUnless(COMMAND, WITHOUT_COMMAND)
class SameAnswers(unittest.TestCase):
    """Answers about scenes are those of the command."""

    def check(self, folder, files, near):
        """Checks a scene and its frames, and returns the modes with several answers."""
        scene, moving = read_scene(files[0], folder)
        frames = numbers_of(files[1], 20).reshape(-1, len(moving), 12)
        modes = {
            "collide": scene.collide,
            "pairs": lambda: len(scene.pairs_in_contact()),
            "distance": lambda: scene.distance().nearest.distance,
            "within": lambda: len(scene.pairs_within(near)),
        }
        varied = set()
        for mode, ask in modes.items():
            within = ["--within", str(near)] if mode == "within" else []
            raw = ask_command(folder, "scene", *files, "--mode", mode, "--limit", len(frames), *within)
            raw = [float(line[0]) for line in raw]
            for scene.parallel, scene.tracking in ((False, False), (True, True)):
                found = []
                for frame in frames:
                    scene.set_poses(moving, bottom_row(frame))
                    found.append(float(ask()))
                self.assertEqual(found, raw, f"{files[0]} {mode}")
            if len(set(raw)) > 1:
                varied.add(mode)
        return varied

    def test_frames_of_a_small_scene(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for mesh in ("fclenv", "fclrob"):
                shutil.copy(TESTDATA / f"{mesh}.obj", folder)
            still = " ".join(str(float(x)) for x in np.eye(4)[:3].ravel())
            lines = ["mesh room fclenv.obj", "mesh robot fclrob.obj", f"instance room room {still}"]
            lines += [f"instance {which} robot {still}" for which in "ab"]
            (folder / "cell.scene").write_text("\n".join([*lines, "moving a b"]) + "\n")
            poses = random_poses(7, 40, 2500.0)
            poses[:, :3, 3] += [300, -1600, -500]
            write_rows(folder / "frames.txt", poses[:, :3].reshape(20, 24))
            files = folder / "cell.scene", folder / "frames.txt"
            self.assertEqual(self.check(folder, files, 400.0), {"collide", "pairs", "distance", "within"})

    @unittest.skipUnless(SHARED.exists(), WITHOUT_SHARED)
    def test_frames_of_shared_scenes(self):
        for stem in ("clutter60", "arm"):
            with tempfile.TemporaryDirectory() as name:
                files = SHARED / "scenes" / f"{stem}.scene", SHARED / "scenes" / f"{stem}_frames.txt"
                self.assertIn("distance", self.check(pathlib.Path(name), files, 0.05))


if __name__ == "__main__":
    unittest.main()
