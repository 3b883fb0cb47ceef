"""Tests of what stops questions and bakes: flags, times and signals, before they begin and while they run."""

import os
import pathlib
import signal
import tempfile
import threading
import time
import unittest

import numpy as np

import cbvh
from cbvh import Stop, StoppedError
from common import TESTDATA, check_errors, cube, shifts

URDF = TESTDATA / "robot" / "robot.urdf"
HERE = np.eye(4)


def fan(count):
    """Triangles that all contain a point, each beside the others: of two such meshes, all pairs touch."""
    corners = np.array([[[0, 0, 0], [1, 0, 0], [k, 1, 0]] for k in range(count)], float)
    return cbvh.bake(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def sheet(side):
    """The vertices and faces of a surface over a grid, which takes about a microsecond per face to bake."""
    x, y = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    first = (x * side + y)[:-1, :-1].ravel()
    faces = np.concatenate([[first, first + 1, first + side], [first + 1, first + side + 1, first + side]], axis=1).T
    return np.stack([x, y, (x * x + y * y) % 7], axis=-1).reshape(-1, 3).astype(float), faces.astype(np.uint32)


class Questions:
    """Questions of all kinds: short ones, and long ones that take seconds on one core."""

    def __init__(self):
        self.cube = cbvh.bake(*cube())
        self.fan = fan(6000)
        self.scene = cbvh.Scene()
        self.robot = cbvh.Robot.from_urdf(URDF)
        for x in range(4):
            self.scene.add(self.cube, shifts((0.75 * x, 0, 0))[0])
        self.fans = {parallel: cbvh.Scene() for parallel in (False, True)}
        for parallel, scene in self.fans.items():
            scene.parallel = parallel
            for _ in range(2):
                scene.add(self.fan)
        self.rows = np.random.default_rng(3).uniform(-2, 2, (300000, len(self.robot.joints)))

    def short(self, parallel):
        poses, q = shifts((0.25, 0, 0.5), (3, 0, 0)), self.rows[:3]
        a, b, scene, robot = self.cube, self.cube, self.scene, self.robot
        scene.parallel = parallel
        motion = cbvh.Motion.between(poses, shifts((0, 5, 0), (0, 0, 5)))
        points = np.array([[0.1, 0, 0], [0, 0, 3]])
        yield lambda: a.collide(b, poses, parallel=parallel)
        yield lambda: a.distance(b, poses, parallel=parallel)
        yield lambda: a.contacts(b, poses, parallel=parallel)
        yield lambda: a.penetration(b, poses, parallel=parallel)
        yield lambda: a.clash(b, poses, parallel=parallel)
        yield lambda: a.patches(b, poses, parallel=parallel)
        yield lambda: a.is_free(b, motion, parallel=parallel)
        yield lambda: a.motion(b, motion, parallel=parallel)
        yield lambda: a.closest_points(points, parallel=parallel)
        yield lambda: a.first_hits(points, [1, 0, 0], parallel=parallel)
        yield lambda: a.self_contacts()
        yield lambda: scene.collide()
        yield lambda: scene.pairs_in_contact()
        yield lambda: scene.distance()
        yield lambda: scene.closest_points(points)
        yield lambda: robot.collide(q, parallel=parallel)
        yield lambda: robot.distance(q, parallel=parallel)
        yield lambda: robot.near_pairs(q, 0.1, parallel=parallel)
        yield lambda: robot.is_free(q, q[::-1], parallel=parallel)
        yield lambda: robot.motion(q[0], q[1])

    def long(self):
        """Each asks until it is stopped, in questions that take seconds."""
        yield lambda: self.fan.contacts(self.fan, HERE)
        yield lambda: self.fan.contacts(self.fan, np.stack([HERE] * 4), parallel=True)
        for scene in self.fans.values():
            yield lambda scene=scene: scene.contacts()
        for parallel in (False, True):
            yield lambda parallel=parallel: [
                self.robot.is_free(self.rows, self.rows[::-1], parallel=parallel) for _ in range(100)
            ]
        yield lambda: [self.robot.allow_frequent(10**7, 1.0) for _ in range(100)]


class Stopping(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.questions = Questions()
        # Far more than a question goes on after it is stopped, also on a machine with much else to do: at least a second and a half, and
        # twenty times what a hundredth of the shortest of the long ones takes, on this machine.
        part, began = fan(600), time.monotonic()
        part.contacts(part, HERE)
        cls.soon = max(1.5, 20 * (time.monotonic() - began))
        # Python has this handler unless whoever started it ignores Ctrl-C, as shells do for what runs in the background.
        cls.addClassCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))

    def test_a_question_that_is_stopped_does_not_begin(self):
        for parallel in (False, True):
            stop = Stop()
            for number, question in enumerate(self.questions.short(parallel)):
                with self.subTest(parallel=parallel, number=number):
                    expected = repr(question())
                    stop.set()
                    with stop:
                        self.assertTrue(stop.is_set())
                        with self.assertRaisesRegex(StoppedError, "found the query stopped"):
                            question()
                        stop.clear()
                        self.assertEqual(repr(question()), expected)
                        stop.set()
                    # Behind the block, as without it.
                    self.assertEqual(repr(question()), expected)

    def test_another_thread_stops_a_question_under_way(self):
        stop, mesh = Stop(), fan(200)
        for number, question in enumerate(self.questions.long()):
            with self.subTest(number=number):
                when = []

                def set_it(when=when):
                    when.append(time.monotonic())
                    stop.set()

                timer = threading.Timer(0.1, set_it)
                with stop:
                    timer.start()
                    with self.assertRaises(StoppedError):
                        question()
                    self.assertLess(time.monotonic() - when[0], self.soon)
                    stop.clear()
                    self.assertEqual(len(mesh.contacts(mesh, HERE)), 200 * 200)
                timer.join()

    def test_time_stops_a_question(self):
        for number, question in enumerate(self.questions.long()):
            with self.subTest(number=number):
                began = time.monotonic()
                with Stop(after=0.1) as stop, self.assertRaises(StoppedError):
                    question()
                self.assertFalse(stop.is_set())
                self.assertTrue(0.1 <= time.monotonic() - began < 0.1 + self.soon)
        with Stop(after=1e300), Stop(after=1000):
            self.assertTrue(self.questions.cube.collide(self.questions.cube, HERE))
        with Stop(after=0), self.assertRaises(StoppedError):
            self.questions.cube.collide(self.questions.cube, HERE)

    def test_blocks_are_of_their_threads_and_may_be_nested(self):
        mesh, outer, inner, found = self.questions.cube, Stop(), Stop(), []

        def is_stopped():
            try:
                mesh.collide(mesh, HERE)
            except StoppedError:
                return True
            return False

        with outer, inner:
            self.assertFalse(is_stopped())
            outer.set()
            self.assertTrue(is_stopped())
            thread = threading.Thread(target=lambda: found.append(is_stopped()))
            thread.start()
            thread.join()
            self.assertEqual(found, [False])
            inner.set()
            outer.clear()
            self.assertTrue(is_stopped())
        with inner:
            with inner:
                self.assertTrue(is_stopped())
            self.assertTrue(is_stopped())
        self.assertFalse(is_stopped())

    @unittest.skipUnless(hasattr(signal, "pthread_kill"), "this system cannot send signals to itself")
    def test_ctrl_c_ends_a_question(self):
        for number, question in enumerate(self.questions.long()):
            with self.subTest(number=number):
                when = []

                def interrupt(when=when):
                    when.append(time.monotonic())
                    os.kill(os.getpid(), signal.SIGINT)

                timer = threading.Timer(0.1, interrupt)
                timer.start()
                with self.assertRaises(KeyboardInterrupt):
                    question()
                self.assertLess(time.monotonic() - when[0], self.soon)
                timer.join()
                self.assertTrue(self.questions.cube.collide(self.questions.cube, HERE))

    @unittest.skipUnless(hasattr(signal, "setitimer"), "this system has no timers that signal")
    def test_handlers_may_ask_and_do_not_disturb(self):
        mesh, small, found = fan(2500), self.questions.cube, []

        def ring(*_):
            found.append(small.collide(small, shifts((0.5, 0, 0), (5, 0, 0)), parallel=True).tolist())
            with Stop() as stop:
                stop.set()
                try:
                    small.collide(small, HERE)
                except StoppedError:
                    found.append("stopped")

        before = signal.signal(signal.SIGALRM, ring)
        try:
            for ask in (
                lambda: len(mesh.contacts(mesh, HERE)),
                lambda: len(mesh.contacts(mesh, np.stack([HERE] * 2), parallel=True)[1]),
            ):
                found.clear()
                signal.setitimer(signal.ITIMER_REAL, 0.02)
                self.assertEqual(ask(), 2500 * 2500)
                self.assertEqual(found, [[True, False], "stopped"])
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)

    def test_bakes_are_stopped_and_leave_nothing(self):
        arrays = sheet(1200)
        with tempfile.TemporaryDirectory() as folder:
            mesh, output = pathlib.Path(folder, "sheet.stl"), pathlib.Path(folder, "sheet.cbvh")
            corners = arrays[0][arrays[1]].astype("<f4")
            facets = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
            facets["corners"] = corners
            mesh.write_bytes(bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes())
            output.write_bytes(b"old")

            def in_files(**options):
                return cbvh.bake_files(mesh, output, force=True, **options)

            bakes = [
                lambda: cbvh.bake(*arrays),
                lambda: cbvh.bake(*arrays, effort="quick"),
                lambda: cbvh.cloud(arrays[0], 0.1),
                in_files,
                lambda: in_files(max_memory=150 << 20),
            ]
            for number, bake in enumerate(bakes):
                for is_signal in [False] + [True] * hasattr(signal, "pthread_kill"):
                    with self.subTest(number=number, is_signal=is_signal):
                        when = []

                        def interrupt(when=when):
                            when.append(time.monotonic())
                            os.kill(os.getpid(), signal.SIGINT)

                        if is_signal:
                            timer = threading.Timer(0.1, interrupt)
                            timer.start()
                            with self.assertRaises(KeyboardInterrupt):
                                bake()
                            timer.join()
                        else:
                            when.append(time.monotonic() + 0.1)
                            with Stop(after=0.1), self.assertRaisesRegex(StoppedError, "found it stopped"):
                                bake()
                        self.assertLess(time.monotonic() - when[0], self.soon)
                        self.assertEqual(output.read_bytes(), b"old")
                        self.assertEqual(sorted(os.listdir(folder)), ["sheet.cbvh", "sheet.stl"])
            stop = Stop()
            stop.set()
            with stop:
                for bake in [lambda: cbvh.bake(*cube()), lambda: cbvh.box([1, 1, 1]), in_files]:
                    with self.assertRaises(StoppedError):
                        bake()
                stop.clear()
                self.assertEqual(cbvh.bake(*cube()).triangle_count, 12)
                self.assertEqual(in_files(effort="quick").triangle_count, len(facets))

    def test_misuse(self):
        check_errors(
            self,
            [
                (ValueError, "after: expected seconds of at least 0, found -1", Stop, -1),
                (ValueError, "after: expected seconds of at least 0, found NaN", Stop, np.nan),
                (TypeError, "after: expected a number, found str", Stop, "1"),
                (RuntimeError, "on the thread that began it", Stop().__exit__, None, None, None),
            ],
        )
        self.assertEqual(repr(Stop()), "<cbvh.Stop, not set>")


if __name__ == "__main__":
    unittest.main()
