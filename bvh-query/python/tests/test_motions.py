"""Tests of motions and paths: plain geometry, samples along the way, the bits of the command, paths of one's own."""

import concurrent.futures
import pathlib
import pickle
import re
import tempfile
import threading
import unittest

import numpy as np

import cbvh
from cbvh import MotionKind
from common import COMMAND, SHARED, TESTDATA, WITHOUT_COMMAND, WITHOUT_SHARED
from common import ask_command, bottom_row, check_errors, cube, numbers_of, random_poses, shifts, turns


class Line:
    """A path of one's own: along x from ``start`` by ``way``, with a bump of height ``bump`` in y."""

    def __init__(self, start, way, bump=0.0):
        self.start, self.way, self.bump, self.calls = start, way, bump, 0

    def pose(self, t):
        self.calls += 1
        return shifts((self.start + self.way * t, self.bump * t * (1 - t), 0))[0]

    def sagitta(self, radius, t0, t1):
        # The second derivative of y is -2 bump; the rest is for rounding.
        return 2 * self.bump * (t1 - t0) ** 2 / 8 + 1e-12


class Paths(unittest.TestCase):
    """Where a path leads."""

    def test_a_motion_turns_the_shorter_way_while_its_origin_moves_on_a_line(self):
        start, end = turns(2, 0.3, 1.7)
        start[:3, 3], end[:3, 3] = [1, 2, 3], [5, 2, -1]
        motion = cbvh.Motion.between(start, end)
        times = np.linspace(0, 1, 11)
        found = motion.pose(times)
        np.testing.assert_allclose(found[:, :3, :3], turns(2, *(0.3 + 1.4 * times))[:, :3, :3], atol=1e-14)
        np.testing.assert_allclose(found[:, :3, 3], np.outer(1 - times, [1, 2, 3]) + np.outer(times, [5, 2, -1]))
        np.testing.assert_array_equal(found[[0, -1]], [start, end])
        self.assertEqual((motion.pose(0.5).shape, motion.pose([]).shape), ((4, 4), (0, 4, 4)))
        np.testing.assert_array_equal(motion.pose(0.5), found[5])
        np.testing.assert_array_equal(motion.pose([-1, 7, np.nan]), [start, end, start])

    def test_a_screw_turns_about_its_axis_and_moves_along_it(self):
        start = shifts((2, 0, 0))[0]
        screw = cbvh.Motion.screw(start, [1, 0, 0], [0, 0, 5], 4 * np.pi, 3)
        times = np.linspace(0, 1, 17)
        places = screw.pose(times)[:, :3, 3]
        expected = [1 + np.cos(4 * np.pi * times), np.sin(4 * np.pi * times), 3 * times]
        np.testing.assert_allclose(places, np.transpose(expected), atol=1e-14)
        np.testing.assert_array_equal(cbvh.Motion.screw(start, [1, 0, 0], [0, 0, 1], 1.0).pose(1)[2], start[2])

    def test_a_polyline_leads_through_its_poses(self):
        poses = random_poses(3, 5, 2.0)
        line = cbvh.Polyline(poses)
        np.testing.assert_array_equal(line.pose(np.arange(5) / 4), poses)
        np.testing.assert_array_equal(line.pose(0.375), cbvh.Motion.between(*poses[1:3]).pose(0.5))

    def test_many_motions_are_each_of_them(self):
        starts, ends = random_poses(4, 6, 2.0), random_poses(5, 6, 2.0)
        motions = cbvh.Motion.between(starts, ends)
        self.assertEqual((len(motions), motions.pose(0.5).shape, motions.pose([0, 1]).shape), (6, (6, 4, 4), (6, 2, 4, 4)))
        self.assertEqual(motions.sagitta(1.0, 0, 1).shape, (6,))
        for number in (0, 3, -1):
            one = cbvh.Motion.between(starts[number], ends[number])
            np.testing.assert_array_equal(motions[number].pose(0.3), one.pose(0.3))
            np.testing.assert_array_equal(motions.pose(0.3)[number], one.pose(0.3))
            self.assertEqual(motions.sagitta(2.0, 0.25, 0.5)[number], one.sagitta(2.0, 0.25, 0.5))
        fan = cbvh.Motion.between(starts[0], ends)
        np.testing.assert_array_equal(fan[2].pose(0.5), cbvh.Motion.between(starts[0], ends[2]).pose(0.5))
        self.assertEqual(len(list(motions)), 6)

    def test_no_point_leaves_the_straight_way_by_more_than_the_sagitta(self):
        starts, ends = random_poses(6, 20, 3.0), random_poses(7, 20, 3.0)
        paths = [*cbvh.Motion.between(starts, ends), cbvh.Polyline(starts)]
        paths.append(cbvh.Motion.screw(starts[0], [1, 0, 0], [1, 1, 0], 5, 1))
        random_numbers = np.random.default_rng(8)
        nearest = 0.0
        for path in paths:
            t0, t1 = np.sort(random_numbers.uniform(size=2))
            point = random_numbers.normal(size=3)
            point /= np.linalg.norm(point)
            shares = np.linspace(0, 1, 65)[:, None]
            places = path.pose(t0 + (t1 - t0) * shares[:, 0]) @ [*point, 1]
            off = places - (1 - shares) * places[0] - shares * places[-1]
            ratio = np.max(np.linalg.norm(off[:, :3], axis=1)) / path.sagitta(1.0, t0, t1)
            self.assertLessEqual(ratio, 1)
            nearest = max(nearest, ratio)
        self.assertGreater(nearest, 0.3)

    def test_arrays_may_change_afterwards(self):
        poses, point = random_poses(10, 4, 1.0), np.array([0.0, 0, 1])
        every = [cbvh.Motion.between(*poses[:2]), cbvh.Motion.between(poses, poses[::-1]), cbvh.Polyline(poses)]
        every += [cbvh.Motion.screw(poses[0], point, [1, 0, 0], 9.0, 2.0), cbvh.Motion.between(poses, poses[0])[1]]
        before = [path.pose([0, 0.3, 1]) for path in every]
        poses[:] = random_poses(11, 4, 1.0)
        point[:] = 5
        for path, expected in zip(every, before):
            np.testing.assert_array_equal(path.pose([0, 0.3, 1]), expected)
            np.testing.assert_array_equal(pickle.loads(pickle.dumps(path)).pose([0, 0.3, 1]), expected)

    def test_pickles_lead_the_same_way(self):
        poses = random_poses(9, 3, 1.0)
        every = [cbvh.Motion.between(*poses[:2]), cbvh.Motion.between(poses, poses[::-1]), cbvh.Polyline(poses)]
        every += [cbvh.Motion.screw(poses[0], [0, 0, 1], [1, 0, 0], 9.0, 2.0), cbvh.Motion.between(poses, poses[0])[1]]
        for path in every:
            again = pickle.loads(pickle.dumps(path))
            np.testing.assert_array_equal(again.pose([0, 0.3, 1]), path.pose([0, 0.3, 1]))
            self.assertEqual(repr(again), repr(path))


class Ways(unittest.TestCase):
    """Whether ways are free."""

    @classmethod
    def setUpClass(cls):
        cls.cube = cbvh.bake(*cube())

    def test_cubes_that_pass_and_cubes_that_meet(self):
        past = cbvh.Motion.between(*shifts((-5, 1.5, 0), (5, 1.5, 0)))
        free = self.cube.motion(self.cube, past)
        self.assertIs(free.kind, MotionKind.FREE)
        self.assertEqual(free.free_until, 1.0)
        self.assertTrue(np.isnan(free.at) and np.isnan(free.nearest.distance))
        self.assertIs(self.cube.is_free(self.cube, past), True)
        # Half a unit apart.
        self.assertIs(self.cube.is_free(self.cube, past, clearance=0.49), True)
        self.assertIs(self.cube.is_free(self.cube, past, clearance=0.5), False)
        # At -5 + 10 t = -1 they touch.
        hit = self.cube.motion(self.cube, cbvh.Motion.between(*shifts((-5, 0.3, 0), (5, 0.3, 0))))
        self.assertIs(hit.kind, MotionKind.HIT)
        self.assertTrue(hit.free_until <= 0.4 <= hit.at < 0.4 + 1e-6, hit)
        self.assertEqual((hit.nearest.distance, hit.nearest.point_a.shape), (0.0, (3,)))
        grazing = cbvh.Motion.between(*shifts((-5, 1 + 1e-9, 0), (5, 1 + 1e-9, 0)))
        near = self.cube.motion(self.cube, grazing, tolerance=1e-3)
        self.assertIs(near.kind, MotionKind.NEAR)
        self.assertTrue(near.free_until <= near.at and 0 < near.nearest.distance < 1e-8)

    def test_the_default_tolerance_is_that_of_the_smaller_mesh(self):
        falls = cbvh.Motion.between(*shifts((0, 0, 10), (0, 0, -10)))
        # The ball's middle is at 10 - 20 t. The ground under z = 0 has sides of 1,000.
        found = cbvh.ground().motion(cbvh.sphere(0.5), falls)
        self.assertIs(found.kind, MotionKind.HIT)
        self.assertTrue(found.free_until <= 0.475 <= found.at + 1e-15 and found.at - found.free_until < 1e-6 / 20, found)

    def test_many_motions_get_the_answers_of_each(self):
        starts, ends = random_poses(1, 300, 2.5), random_poses(2, 300, 2.5)
        motions = cbvh.Motion.between(starts, ends)
        found = self.cube.motion(self.cube, motions)
        free = self.cube.is_free(self.cube, motions)
        self.assertEqual((found.kind.dtype, free.dtype, found.nearest.point_a.shape), (np.uint8, bool, (300, 3)))
        self.assertEqual(set(found.kind), {0, 1})
        np.testing.assert_array_equal(free, found.kind == MotionKind.FREE)
        for other in (
            self.cube.motion(self.cube, motions, parallel=True),
            self.cube.motion(self.cube, list(motions)),
            self.cube.motion(self.cube, list(motions), parallel=True),
        ):
            for one, same in zip((*found[:3], *found.nearest), (*other[:3], *other.nearest)):
                np.testing.assert_array_equal(one, same)
        np.testing.assert_array_equal(self.cube.is_free(self.cube, motions, parallel=True), free)
        # Samples: none before the way ends, and the pose of the hit.
        times = np.linspace(0, 1, 101)
        for number in range(0, 300, 7):
            motion, kind, until = motions[number], found.kind[number], found.free_until[number]
            touch = self.cube.collide(self.cube, motion.pose(times))
            self.assertFalse(touch[times < until].any())
            if kind == MotionKind.HIT:
                self.assertIs(self.cube.collide(self.cube, motion.pose(found.at[number])), True)
            one = self.cube.motion(self.cube, motion)
            self.assertEqual((one.kind, one.free_until), (kind, until))

    def test_no_motions_have_no_answers(self):
        none = cbvh.Motion.between(np.zeros((0, 4, 4)), np.zeros((0, 4, 4)))
        self.assertEqual(self.cube.motion(self.cube, none).kind.shape, (0,))
        self.assertEqual(self.cube.is_free(self.cube, []).shape, (0,))

    def test_bad_arguments_are_named(self):
        one = np.eye(4)
        flip = turns(2, np.pi)[0]
        motion = cbvh.Motion.between(one, one)
        several = cbvh.Motion.between([one, one], one)
        cases = [
            (ValueError, "start: expected shape (4, 4) or (N, 4, 4), found (3, 4)", cbvh.Motion.between, one[:3], one),
            (ValueError, "end: row 4: expected 0 0 0 1, found NaN", cbvh.Motion.between, one, one * np.nan),
            (ValueError, "end: expected as many as of start, 2, found 3", cbvh.Motion.between, [one] * 2, [one] * 3),
            (ValueError, "start[1] and end[1]: expected a turn of less than half", cbvh.Motion.between, one, [one, flip]),
            (ValueError, "start: expected shape (4, 4)", cbvh.Motion.screw, [one], [0, 0, 0], [0, 0, 1], 1.0),
            (ValueError, "point: expected shape (3,), found (2,)", cbvh.Motion.screw, one, [0, 0], [0, 0, 1], 1.0),
            (ValueError, "direction", cbvh.Motion.screw, one, [0, 0, 0], [0, 0, 0], 1.0),
            (ValueError, "angle", cbvh.Motion.screw, one, [0, 0, 0], [0, 0, 1], np.nan),
            (ValueError, "poses: expected shape (N, 4, 4), found (4, 4)", cbvh.Polyline, one),
            (ValueError, "poses: expected at least two poses, found 1", cbvh.Polyline, [one]),
            (ValueError, "t: expected shape () or (T,), found (1, 1)", motion.pose, [[0.5]]),
            (TypeError, "one motion, which has no length", len, motion),
            (IndexError, "motion: expected a number from -2 to 1, found 2", several.__getitem__, 2),
            (TypeError, "motion: expected a number, found slice", several.__getitem__, slice(2)),
            (TypeError, "angle: expected a number, found str", cbvh.Motion.screw, one, [0, 0, 0], [0, 0, 1], "x"),
            (TypeError, "radius: expected a number, found str", motion.sagitta, "x", 0, 1),
            (TypeError, "clearance: expected a number", lambda: self.cube.motion(self.cube, motion, clearance="x")),
            (TypeError, "motion: expected a cbvh.Motion", self.cube.motion, self.cube, one),
            (TypeError, "motion: expected a cbvh.Motion", self.cube.is_free, self.cube, Line),
            (TypeError, "motion[1]: expected a cbvh.Motion", self.cube.is_free, self.cube, [motion, 3]),
            (ValueError, "motion[0]: expected one path, found 2 motions", self.cube.is_free, self.cube, [several]),
            (TypeError, "other: expected a cbvh.Mesh, found Motion", self.cube.motion, motion, motion),
        ]
        check_errors(self, cases)
        for keyword, number in (("clearance", -1.0), ("clearance", np.nan), ("tolerance", 0.0), ("tolerance", np.inf)):
            with self.assertRaisesRegex(ValueError, f"{keyword}: expected a finite length"):
                self.cube.motion(self.cube, motion, **{keyword: number})


class OwnPaths(unittest.TestCase):
    """Paths that Python code answers for."""

    @classmethod
    def setUpClass(cls):
        cls.cube = cbvh.bake(*cube())

    def test_a_path_of_ones_own_gets_the_answer_of_the_same_motion(self):
        same = cbvh.Motion.between(*shifts((-5, 0, 0), (5, 0, 0)))
        expected, found = self.cube.motion(self.cube, same), self.cube.motion(self.cube, Line(-5, 10))
        self.assertEqual((found.kind, found.at), (expected.kind, expected.at))
        # The bump lifts it over: at x = 0 it is 3 high.
        self.assertIs(self.cube.is_free(self.cube, Line(-5, 10, 12)), True)
        self.assertIs(self.cube.is_free(self.cube, Line(-5, 10, 3.9)), False)
        both = self.cube.is_free(self.cube, [Line(-5, 10, 12), Line(-5, 10), same], parallel=True)
        self.assertEqual(both.tolist(), [True, False, False])

    def test_an_exception_ends_the_question(self):
        class Falls(Line):
            def pose(self, t):
                if self.calls >= 6:
                    raise KeyError("beyond")
                return super().pose(t)

        class FallsLater(Line):
            def sagitta(self, radius, t0, t1):
                raise KeyError("beyond")

        for path in (Falls(-5, 10), Falls(-5, 10, 12), FallsLater(-5, 10)):
            for ask in (self.cube.motion, self.cube.is_free):
                path.calls = 0
                if ask == self.cube.is_free and type(path) is Falls and not path.bump:
                    # The middle is a hit, and nothing else is asked for.
                    self.assertIs(ask(self.cube, path), False)
                    continue
                with self.assertRaisesRegex(KeyError, "beyond"):
                    ask(self.cube, [Line(-5, 10), path, Falls(-5, 10)], parallel=True)
                self.assertLessEqual(path.calls, 6)

    def test_answers_that_mean_nothing_name_the_path(self):
        def path(pose=lambda t: np.eye(4), sagitta=lambda radius, t0, t1: 0.0):
            return type("Path", (), {"pose": staticmethod(pose), "sagitta": staticmethod(sagitta)})()

        far = shifts((9, 0, 0))[0]
        cases = [
            (ValueError, "path.pose(0.0): expected shape (4, 4), found (3, 4)", path(lambda t: np.eye(4)[:3])),
            (ValueError, "path.pose(1.0): row 4: expected 0 0 0 1, found NaN", path(lambda t: far if t < 1 else far * np.nan)),
            (ValueError, "path.pose(0.0): expected a rotation", path(lambda t: np.diag([2.0, 2, 2, 1]))),
            (TypeError, "path.pose(0.0): expected numbers, found dtype object", path(lambda t: None)),
            (ValueError, ": expected a length of at least 0, found NaN", path(lambda t: far + 0, lambda *_: np.nan)),
            (ValueError, ": expected a length of at least 0, found -1.0", path(lambda t: far + 0, lambda *_: -1)),
            (TypeError, "path.sagitta(", path(lambda t: far + 0, lambda *_: "x")),
            (TypeError, "positional argument", path(lambda t: far, lambda: 0.0)),
        ]
        check_errors(self, [(kind, message, self.cube.motion, self.cube, own) for kind, message, own in cases])

    def test_a_sagitta_that_the_middle_contradicts_is_refused(self):
        radius = np.sqrt(0.75)

        class Says(Line):
            def sagitta(self, radius, t0, t1):
                return self.times * super().sagitta(radius, t0, t1)

        class Spins:
            """A turn about the origin, whose middle departs by the rotation alone."""

            times = 1.0

            def pose(self, t):
                pose = turns(2, t)[0]
                pose[0, 3] = 2.0
                return pose

            def sagitta(self, radius, t0, t1):
                return self.times * radius * (1 - np.cos((t1 - t0) / 2)) + 1e-12

        for path, ratio in ((Says(-5, 10, 12), 1.0), (Spins(), 1.0)):
            for path.times, is_enough in ((ratio, True), (0.9 * ratio, False)):
                for ask in (self.cube.motion, self.cube.is_free):
                    if is_enough:
                        ask(self.cube, path)
                        continue
                    with self.assertRaisesRegex(ValueError, r"path.sagitta\(.*: expected at least .* in the middle"):
                        ask(self.cube, path)
        # The number is how far the middle departs, as numpy has it, of the radius that the question asks about.
        path = Spins()
        path.times = 0.0
        with self.assertRaises(ValueError) as caught:
            self.cube.is_free(self.cube, path)
        asked, t0, t1, least = map(float, re.match(
            r"path.sagitta\((.*), (.*), (.*)\): expected at least (.*), by", str(caught.exception)).groups())
        self.assertTrue(radius <= asked < 1.001 * radius)
        off = path.pose((t0 + t1) / 2) - (path.pose(t0) + path.pose(t1)) / 2
        self.assertAlmostEqual(least, asked * np.linalg.norm(off[:3, 0]), places=12)

    def test_a_path_of_which_nothing_is_known_is_refused(self):
        path = type("Path", (Line,), {"sagitta": lambda *_: np.inf})(-5, 10, 12)
        scene = cbvh.Scene()
        scene.add(self.cube)
        moving = scene.add(self.cube)
        asks = [lambda: self.cube.motion(self.cube, path), lambda: self.cube.is_free(self.cube, path)]
        asks += [lambda: scene.motion({moving: path}), lambda: scene.is_free({moving: path})]
        for ask in asks:
            with self.assertRaisesRegex(ValueError, r"path.sagitta\(.*: expected a finite length"):
                ask()

    def test_a_way_back_is_answered_as_the_way_there(self):
        class Back:
            def __init__(self, path):
                self.path = path

            def pose(self, t):
                return self.path.pose(1 - t)

            def sagitta(self, radius, t0, t1):
                return self.path.sagitta(radius, 1 - t0, 1 - t1)

        over, through = (cbvh.Polyline(shifts((-5, 3, 0), (0, y, 0), (5, 3, 0))) for y in (2, 0))
        for path, free in ((over, True), (through, False)):
            self.assertIs(self.cube.is_free(self.cube, path), free)
            self.assertIs(self.cube.is_free(self.cube, Back(path)), free)
            scene = cbvh.Scene()
            scene.add(self.cube)
            self.assertIs(scene.is_free({scene.add(self.cube): Back(path)}), free)

    def test_a_path_that_asks_about_itself_is_an_error(self):
        cube = self.cube

        class Itself(Line):
            def pose(self, t):
                cube.is_free(cube, self)
                return super().pose(t)

        with self.assertRaises(RecursionError):
            cube.is_free(cube, Itself(-5, 10))
        # The depth is counted anew.
        self.assertIs(cube.is_free(cube, Line(-5, 10, 12)), True)

    def test_what_a_sagitta_raises_is_raised(self):
        class Odd:
            def __float__(self):
                raise KeyboardInterrupt

        path = type("Path", (Line,), {"sagitta": lambda *_: Odd()})(-5, 10, 12)
        with self.assertRaises(KeyboardInterrupt):
            self.cube.is_free(self.cube, path)

    def test_any_iterable_of_paths_is_many(self):
        lines = [Line(-5, 10, 12), Line(-5, 10)]
        for many in (lines, tuple(lines), iter(lines), dict.fromkeys(lines)):
            self.assertEqual(self.cube.is_free(self.cube, many).tolist(), [True, False])

    def test_a_path_may_ask_questions_itself(self):
        outer = self

        class Asks(Line):
            def pose(self, t):
                pose = super().pose(t)
                outer.cube.distance(outer.cube, pose)
                outer.cube.collide(outer.cube, np.tile(pose, (64, 1, 1)), parallel=True)
                return pose

        self.assertIs(self.cube.is_free(self.cube, Asks(-5, 10, 12), parallel=True), True)

    def test_threads_with_paths_of_their_own(self):
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            found = list(pool.map(lambda bump: self.cube.is_free(self.cube, Line(-5, 10, bump)), [12, 1] * 8))
        self.assertEqual(found, [True, False] * 8)

    def test_other_threads_run_meanwhile(self):
        starts, ends = random_poses(1, 2000, 2.5), random_poses(2, 2000, 2.5)
        motions = cbvh.Motion.between(starts, ends)
        turns_of_loop, is_done = 0, threading.Event()
        thread = threading.Thread(target=lambda: (self.cube.motion(self.cube, motions), is_done.set()))
        thread.start()
        while not is_done.is_set():
            turns_of_loop += 1
        thread.join()
        self.assertGreater(turns_of_loop, 1000)


@unittest.skipUnless(COMMAND, WITHOUT_COMMAND)
class SameBits(unittest.TestCase):
    """Answers are those of the command, bit for bit."""

    def check(self, folder, meshes, motions, limit):
        numbers = numbers_of(motions, limit)
        poses = bottom_row(numbers.reshape(-1, 2, 12))
        a, b = (cbvh.bake_files(mesh, folder / f"{mesh.stem}.cbvh") for mesh in meshes)
        ways = cbvh.Motion.between(poses[:, 0], poses[:, 1])
        for clearance in (0.0, 3.0):
            raw = ask_command(folder, "motion", folder / f"{meshes[0].stem}.cbvh", folder / f"{meshes[1].stem}.cbvh",
                              motions, "--limit", limit, "--clearance", clearance)
            self.assertEqual(len(raw), len(poses))
            for parallel in (False, True):
                found = a.motion(b, ways, clearance=clearance, parallel=parallel)
                kinds = [MotionKind(kind).name.lower() for kind in found.kind]
                self.assertEqual(kinds, [line[0] for line in raw])
                for number, line in enumerate(raw):
                    if line[0] != "free":
                        self.assertEqual([found.free_until[number], found.at[number]], [float(n) for n in line[1:3]])
        return kinds

    def test_motions_of_bundled_meshes(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            poses = random_poses(7, 80, 1200.0).reshape(-1, 2, 4, 4)
            poses[:, :, :3, 3] += [300, -1600, -500]
            rows = poses[:, :, :3].reshape(len(poses), 24)
            (folder / "motions.txt").write_text("\n".join(" ".join(repr(float(n)) for n in row) for row in rows))
            meshes = [TESTDATA / "fclenv.obj", TESTDATA / "fclrob.obj"]
            self.assertEqual(set(self.check(folder, meshes, folder / "motions.txt", 100)), {"free", "hit"})

    @unittest.skipUnless(SHARED.exists(), WITHOUT_SHARED)
    def test_motions_of_shared_meshes(self):
        with tempfile.TemporaryDirectory() as name:
            for pair, *meshes in (("fcl", "fclenv", "fclrob"), ("bunny", "bunny", "bunny"), ("a1hand", "a1", "hand")):
                for kind in ("short", "slide", "spin", "long"):
                    meshes_of = [SHARED / "meshes" / f"{mesh}.obj" for mesh in meshes]
                    self.check(pathlib.Path(name), meshes_of, SHARED / "motions" / f"{pair}_{kind}.txt", 10)


if __name__ == "__main__":
    unittest.main()
