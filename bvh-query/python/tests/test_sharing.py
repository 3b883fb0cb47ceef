"""Tests of files, threads, processes, and of what the module says about itself."""

import ast
import concurrent.futures
import copy
import ctypes
import doctest
import inspect
import multiprocessing
import os
import pathlib
import pickle
import platform
import signal
import tempfile
import unittest
import warnings
from ctypes.util import find_library

import numpy as np

import cbvh
from cbvh import _cbvh
from common import TESTDATA, cube, random_poses, shifts


def _asks_and_bakes(mesh, poses, expected):
    scene = cbvh.Scene()
    scene.parallel = True
    for pose in poses:
        scene.add(mesh, pose)
    scene.pairs_in_contact()
    assert cbvh.bake(*cube()).tobytes() == mesh.tobytes()
    assert mesh.collide(mesh, poses, parallel=True).tolist() == expected


class Sharing(unittest.TestCase):
    """Files, threads and processes."""

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            output = pathlib.Path(folder) / "environment.cbvh"
            mesh = cbvh.bake_files(TESTDATA / "fclenv.obj", output, triangles="packed")
            self.assertEqual((mesh.nbytes, mesh.names), (output.stat().st_size, [""]))
            changed = output.stat().st_mtime_ns
            cbvh.bake_files([TESTDATA / "fclenv.obj"], output, triangles="packed")
            self.assertEqual(output.stat().st_mtime_ns, changed)
            saved = pathlib.Path(folder) / "copy.cbvh"
            mesh.save(saved)
            self.assertEqual(saved.read_bytes(), output.read_bytes())
            self.assertEqual(sorted(os.listdir(folder)), ["copy.cbvh", "environment.cbvh"])
            mesh.validate()

    def test_pickles_lead_to_the_same_file_and_to_the_same_bytes(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "cube.cbvh")
            cbvh.bake(*cube()).save(path)
            mapped = cbvh.open(path)
            self.assertLess(len(pickle.dumps(mapped)), 300)
            again = pickle.loads(pickle.dumps(mapped.object(0)))
            self.assertEqual(repr(again), repr(mapped.object(0)))
            held = pickle.loads(pickle.dumps(cbvh.bake(*cube())))
            self.assertEqual(held.tobytes(), mapped.tobytes())
            with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
                poses = shifts((0, 0, 0), (3, 0, 0))
                answers = pool.submit(mapped.collide, mapped, poses).result()
            self.assertEqual(answers.tolist(), [True, False])

    def test_threads_get_the_same_answers(self):
        mesh = cbvh.bake(*cube())
        poses = random_poses(2, 400, 1.5)
        expected = mesh.distance(mesh, poses)
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            for found in pool.map(lambda _: mesh.distance(mesh, poses), range(8)):
                for one, other in zip(found, expected):
                    np.testing.assert_array_equal(one, other)

    def test_arrays_may_change_while_a_question_runs(self):
        mesh = cbvh.bake(*cube())
        poses = np.empty((20_000, 4, 4))
        choices = [memoryview(np.tile(shifts(offset), (len(poses), 1, 1))).cast("B") for offset in ((0, 0, 0), (3, 0, 0))]
        # Unlike numpy, this keeps the lock until all is written.
        written = memoryview(poses).cast("B")
        written[:] = choices[0]
        found = set()
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            for parallel in (False, True):
                for _ in range(20):
                    asked = pool.submit(mesh.collide, mesh, poses, parallel=parallel)
                    rounds = 0
                    while not asked.done():
                        rounds += 1
                        written[:] = choices[rounds % 2]
                    answers = asked.result()
                    self.assertIn(answers.sum(), (0, len(poses)))
                    found.add(rounds > 2)
        self.assertIn(True, found, "nothing was written while a question ran")

    def test_threads_may_save_one_file(self):
        mesh = cbvh.bake(*cube())
        with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(4) as pool:
            path = os.path.join(folder, "cube.cbvh")
            for _ in pool.map(lambda _: mesh.save(path), range(200)):
                pass
            mesh.save(os.fsencode(path))
            self.assertEqual(os.listdir(folder), ["cube.cbvh"])
            self.assertEqual(cbvh.open(os.fsencode(path)).tobytes(), mesh.tobytes())

    @unittest.skipUnless("fork" in multiprocessing.get_all_start_methods(), "this system has no fork")
    def test_forked_processes_use_all_cores(self):
        mesh, poses = cbvh.bake(*cube()), random_poses(3, 100, 1.5)
        expected = mesh.collide(mesh, poses, parallel=True).tolist()
        with warnings.catch_warnings():
            # Threads may hold locks that a forked process waits for; those of this module do not.
            warnings.simplefilter("ignore", DeprecationWarning)
            child = multiprocessing.get_context("fork").Process(target=_asks_and_bakes, args=(mesh, poses, expected))
            child.start()
        child.join(60)
        if child.exitcode is None:
            child.kill()
        self.assertEqual(child.exitcode, 0)

    @unittest.skipUnless(platform.machine() == "x86_64" and find_library("m"), "roundings have other numbers here")
    def test_answers_do_not_depend_on_how_the_thread_rounds(self):
        vertices, faces = cube(0.1)
        vertices = vertices @ random_poses(5, 1, 0)[0, :3, :3]
        poses = random_poses(4, 200, 0.15)
        set_rounding = ctypes.CDLL(find_library("m")).fesetround

        def answers():
            mesh, scene = cbvh.bake(vertices, faces), cbvh.Scene()
            for pose in poses[:20]:
                scene.add(mesh, pose)
            motion = cbvh.Motion.between(poses[:20], poses[20:40])
            yield np.frombuffer(mesh.tobytes(), np.uint8)
            for parallel in (False, True):
                scene.parallel = parallel
                yield from mesh.distance(mesh, poses, parallel=parallel)
                yield mesh.collide(mesh, poses, parallel=parallel)
                yield mesh.motion(mesh, motion, parallel=parallel).free_until
                yield scene.pairs_within(0.01)
            yield motion.pose([0.3, 0.7])
            yield motion.sagitta(1.0, 0.3, 0.7)
            yield cbvh.relative(poses[:20], poses[20:40])

        expected = list(answers())
        for rounding in (0x400, 0x800, 0xC00):
            try:
                self.assertEqual(set_rounding(rounding), 0)
                found = list(answers())
            finally:
                set_rounding(0)
            for one, other in zip(found, expected, strict=True):
                np.testing.assert_array_equal(one, other)

    def test_meshes_are_shared_by_copies(self):
        mesh = cbvh.bake(*cube())
        self.assertIs(copy.copy(mesh), mesh)
        self.assertIs(copy.deepcopy({"mesh": [mesh]})["mesh"][0], mesh)
        for held in (bytearray(mesh.tobytes()), memoryview(mesh.tobytes())):
            self.assertEqual(cbvh.Mesh.from_bytes(held).triangle_count, 12)

    @unittest.skipUnless(hasattr(signal, "setitimer"), "this system has no timers that signal")
    def test_signals_end_questions(self):
        class Rang(Exception):
            pass

        def ring(*_):
            raise Rang

        mesh, poses = cbvh.bake(*cube()), np.tile(shifts((1.5, 0, 0)), (1 << 20, 1, 1))
        before = signal.signal(signal.SIGALRM, ring)
        try:
            for parallel in (False, True):
                signal.setitimer(signal.ITIMER_REAL, 0.3)
                with self.assertRaises(Rang):
                    # Takes seconds.
                    mesh.distance(mesh, poses, parallel=parallel)
                    mesh.distance(mesh, poses, parallel=parallel)
                self.assertEqual(mesh.distance(mesh, poses[0]).distance, 0.5)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)


class Stubs(unittest.TestCase):
    """The stubs of the compiled module state what is there, and everything public is documented."""

    def test_stubs_state_what_is_there(self):
        stubs = ast.parse((pathlib.Path(cbvh.__file__).parent / "_cbvh.pyi").read_text())
        functions = {node.name: node for node in stubs.body if isinstance(node, ast.FunctionDef)}
        classes = {node.name: node for node in stubs.body if isinstance(node, ast.ClassDef)}
        there = {name for name in dir(_cbvh) if not name.startswith("_")}
        self.assertEqual(there, functions.keys() | classes.keys())
        holders = [(_cbvh, functions)]
        for name in ("Mesh", "Paths", "Scene"):
            methods = {node.name: node for node in classes[name].body if isinstance(node, ast.FunctionDef)}
            methods.pop("__new__", None)
            there = {method for method in dir(getattr(_cbvh, name)) if not method.startswith("_")}
            self.assertEqual(there, methods.keys(), name)
            holders.append((getattr(_cbvh, name), methods))
        for holder, stated in holders:
            for name, node in stated.items():
                parameters = list(inspect.signature(getattr(holder, name)).parameters)
                self.assertEqual(parameters, [argument.arg for argument in node.args.args], name)

    def test_everything_public_is_documented(self):
        for name in cbvh.__all__:
            if name.startswith("_"):
                continue
            thing = getattr(cbvh, name)
            self.assertTrue(thing.__doc__, name)
            for member, value in vars(thing).items() if inspect.isclass(thing) else ():
                if not member.startswith("_") and callable(value):
                    self.assertTrue(inspect.getdoc(value), f"{name}.{member}")

    def test_examples_of_the_documentation(self):
        failed, attempted = doctest.testmod(cbvh)
        # With what the classes say.
        self.assertEqual(failed, 0)
        self.assertGreater(attempted, 3)


if __name__ == "__main__":
    unittest.main()
