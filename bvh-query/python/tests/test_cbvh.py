"""Tests of the Python module: the bits of the command, plain geometry, bad arguments, threads and processes.

CBVH names the command `cbvh`, with which answers are compared; without it, those tests are skipped.
"""

import ast
import concurrent.futures
import doctest
import inspect
import multiprocessing
import os
import pathlib
import pickle
import random
import subprocess
import tempfile
import unittest

import numpy as np

import cbvh
from cbvh import _cbvh

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"
COMMAND = os.environ.get("CBVH")


def cube(size=1.0):
    """A cube around the origin, closed and oriented."""
    vertices = size * (np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 0.5)
    faces = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]]
    faces += [[2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
    return vertices, faces


def shifts(*offsets):
    """Poses without rotation, shape (N, 4, 4)."""
    poses = np.tile(np.eye(4), (len(offsets), 1, 1))
    poses[:, :3, 3] = offsets
    return poses


def random_poses(seed, count, reach):
    """Random rotations, by the polar factor of a random matrix, and translations."""
    random_numbers = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (count, 1, 1))
    for pose in poses:
        u, _, v = np.linalg.svd(random_numbers.normal(size=(3, 3)))
        u[:, 0] *= np.linalg.det(u @ v)
        pose[:3, :3] = u @ v
        pose[:3, 3] = random_numbers.uniform(-reach, reach, 3)
    return poses


class Geometry(unittest.TestCase):
    """Cubes, whose answers are known."""

    @classmethod
    def setUpClass(cls):
        cls.cube = cbvh.bake(*cube())
        cls.small = cbvh.bake(*cube(0.25))

    def test_examples_of_the_documentation(self):
        failed, attempted = doctest.testmod(cbvh)
        self.assertEqual(failed, 0)
        self.assertGreater(attempted, 3)

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
        self.assertEqual(self.cube.signed_distances([0, 0, 0.25]), -0.25)
        self.assertEqual(self.cube.closest_points([0, 0, 2]).point.tolist(), [0, 0, 0.5])
        hit = self.cube.first_hits([0.1, 0.2, 5], [0, 0, -1])
        self.assertEqual((hit.found, hit.t, hit.point.tolist()), (True, 4.5, [0.1, 0.2, 0.5]))
        self.assertIs(self.cube.any_hits([0, 0, 5], [0, 0, 1]), False)
        self.assertEqual(self.cube.all_hits([0.1, 0.2, 5], [0, 0, -1]).t.tolist(), [4.5, 5.5])
        self.assertIs(self.cube.meet_segments([0, 0, 0], [0, 0, 0.5]), True)

    def test_probes(self):
        points = np.random.default_rng(1).uniform(-1, 1, (200, 3))
        outside = np.maximum(np.abs(points) - 0.5, 0)
        inside = np.min(0.5 - np.abs(points), axis=1)
        expected = np.where(inside > 0, -inside, np.linalg.norm(outside, axis=1))
        placed = shifts((1, 2, 3))[0]
        for parallel in (False, True):
            for pose, moved in ((None, points), (placed, points + [1, 2, 3])):
                found = self.cube.signed_distances(moved, pose=pose, parallel=parallel)
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
            np.testing.assert_array_equal(self.cube.meet_segments(above, below, parallel=parallel), crosses)

    def test_no_questions_have_no_answers(self):
        none = np.zeros((0, 4, 4))
        self.assertEqual(self.cube.collide(self.cube, none).shape, (0,))
        self.assertEqual(self.cube.distance(self.cube, none).point_a.shape, (0, 3))
        self.assertEqual(self.cube.contacts(self.cube, none), [])
        self.assertEqual(self.cube.sides(np.zeros((0, 3))).shape, (0,))
        self.assertEqual(self.cube.all_hits(np.zeros((0, 3)), np.zeros((0, 3))), [])

    def test_arrays_of_any_layout_are_read(self):
        poses = shifts((0, 0, 0), (3, 0, 0), (0, 0, 0))
        every = np.asfortranarray(poses), poses.astype(np.float32), np.repeat(poses, 2, axis=0)[::2], poses.tolist()
        for array in every:
            self.assertEqual(self.cube.collide(self.cube, array).tolist(), [True, False, True])
        vertices, faces = cube()
        for dtype in (np.int8, np.int64, np.uint16):
            self.assertEqual(cbvh.bake(vertices, np.array(faces, dtype)).triangles, 12)


class BadArguments(unittest.TestCase):
    """Each gives an exception that names the argument, what was expected, and what was found."""

    def setUp(self):
        self.cube = cbvh.bake(*cube())

    def test_exceptions_name_what_is_wrong(self):
        mesh, one = self.cube, np.eye(4)
        nan, scaled, mirrored = np.full((4, 4), np.nan), np.diag([2.0, 2, 2, 1]), np.diag([1.0, 1, -1, 1])
        vertices, faces = cube()
        cases = [
            (ValueError, "poses: expected shape (4, 4) or (N, 4, 4), found (3, 4)", mesh.collide, mesh, one[:3]),
            (ValueError, "poses[1]: ", mesh.collide, mesh, np.stack([one, nan])),
            (ValueError, "poses[0]: ", mesh.distance, mesh, scaled),
            (ValueError, "reflection", mesh.contacts, mesh, mirrored),
            (TypeError, "poses: expected numbers, found dtype <U1", mesh.within, mesh, "x", 1),
            (TypeError, "poses: expected numbers, found dtype object", mesh.relation, mesh, None),
            (TypeError, "expected numbers, found dtype complex128", mesh.collide, mesh, one * 1j),
            (TypeError, "other: expected a cbvh.Mesh, found str", mesh.collide, "mesh", one),
            (ValueError, "NaN", mesh.within, mesh, one, np.nan),
            (ValueError, "-1", mesh.within, mesh, one, -1),
            (ValueError, "points: expected shape (3,) or (N, 3), found (2,)", mesh.sides, [0, 0]),
            (ValueError, "pose: expected shape (4, 4)", mesh.sides, [0, 0, 0], ),
            (ValueError, "inf", mesh.sides, [0, 0, np.inf]),
            (ValueError, "as many directions", mesh.first_hits, np.zeros((2, 3)), np.ones((3, 3))),
            (ValueError, "as many ends", mesh.meet_segments, np.zeros((2, 3)), np.ones((3, 3))),
            (ValueError, "direction", mesh.first_hits, [0, 0, 0], [0, 0, 0]),
            (ValueError, "vertices: expected shape (V, 3), found (8, 2)", cbvh.bake, vertices[:, :2], faces),
            (ValueError, "faces: expected numbers from 0 to 7, found 0 to 8", cbvh.bake, vertices, [[0, 1, 8]]),
            (ValueError, "faces: expected numbers from 0 to 7, found -1 to 2", cbvh.bake, vertices, [[0, -1, 2]]),
            (TypeError, "faces: expected integers, found dtype float64", cbvh.bake, vertices, [[0.0, 1, 2]]),
            (cbvh.BakeError, "", cbvh.bake, vertices * np.nan, faces),
            (cbvh.BakeError, "", cbvh.bake, np.zeros((0, 3)), np.zeros((0, 3), int)),
            (IndexError, "object: expected a number below 1, found 1", mesh.object, 1),
            (ValueError, "object: expected one name", mesh.object, "no such"),
            (cbvh.FormatError, "R01", cbvh.Mesh.from_bytes, b"nothing of the kind"),
            (FileNotFoundError, "no such.cbvh", cbvh.open, "no such.cbvh"),
            (cbvh.FormatError, "R0", cbvh.open, __file__),
            (cbvh.BakeError, "no such.obj", cbvh.bake_files, "no such.obj", "x.cbvh"),
        ]
        for kind, message, call, *arguments in cases:
            keywords = {"pose": np.eye(3)} if message.startswith("pose: ") else {}
            with self.subTest(message), self.assertRaises(kind) as caught:
                call(*arguments, **keywords)
            self.assertIn(message, str(caught.exception))
        for options in ({"profile": "dop7"}, {"triangles": "small"}, {"effort": "low"}):
            with self.assertRaisesRegex(ValueError, f"{next(iter(options))}: expected one of"):
                cbvh.bake(vertices, faces, **options)
        with self.assertRaisesRegex(ValueError, "parallel"):
            mesh.distance(mesh, one, rel_err=0.1, parallel=True)

    def test_the_compiled_module_checks_shapes_itself(self):
        for call, array in (
            (lambda rows: _cbvh.sides(self.cube._mesh, rows, np.eye(4), False), np.zeros((3, 2))),
            (lambda pose: _cbvh.sides(self.cube._mesh, np.zeros((1, 3)), pose, False), np.zeros((2, 8))),
            (lambda poses: _cbvh.collide(self.cube._mesh, self.cube._mesh, poses, False), np.zeros((1, 2, 8))),
        ):
            with self.assertRaisesRegex(ValueError, "expected rows of shape"):
                call(array)

    def test_damage_is_an_exception(self):
        whole = self.cube.tobytes()
        random_numbers = random.Random(3)
        found = 0
        for _ in range(300):
            damaged = bytearray(whole)
            damaged[random_numbers.randrange(len(whole))] ^= 1 << random_numbers.randrange(8)
            try:
                mesh = cbvh.Mesh.from_bytes(bytes(damaged))
                mesh.contacts(mesh, np.eye(4))
                mesh.check()
            except cbvh.FormatError:
                found += 1
        self.assertGreater(found, 50)

    def test_ten_thousand_misuses_raise_nothing_unexpected(self):
        random_numbers = random.Random(5)
        mesh = self.cube
        odd = [None, "x", b"", 0, -1, 1e308, np.nan, np.inf, True, [], [[]], {}, mesh, object(), np.zeros((2, 0))]
        odd += [np.eye(4), np.eye(3), shifts((0, 0, 0)), np.zeros((4, 4)), np.ones((3, 3)), np.zeros(3), np.zeros(2**12)]
        odd += [np.eye(4) * np.nan, np.eye(4, dtype=np.float16), np.eye(4, dtype=complex), np.array(["a"]), 2**70, "a\0b"]
        odd += [np.zeros((1, 1, 1, 1)), np.eye(4) * 1e300, [0, 0, 0], [[0, 0, 0], [1, 1, 1]], np.zeros((0, 3)), range(3)]
        methods = [mesh.collide, mesh.within, mesh.distance, mesh.relation, mesh.contacts, mesh.closest_points]
        methods += [mesh.sides, mesh.signed_distances, mesh.first_hits, mesh.any_hits, mesh.all_hits, mesh.meet_segments]
        methods += [mesh.object, cbvh.bake, cbvh.Mesh.from_bytes, cbvh.open]
        methods += [getattr(_cbvh, name) for name in ("collide", "sides", "first_hits", "contacts", "bake", "distance")]
        allowed = (TypeError, ValueError, IndexError, OverflowError, OSError)
        answered = 0
        for _ in range(10_000):
            call = random_numbers.choice(methods)
            arguments = [random_numbers.choice(odd) for _ in range(random_numbers.randrange(6))]
            try:
                call(*arguments)
                answered += 1
            except allowed:
                pass
        self.assertGreater(answered, 50)


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
            copy = pathlib.Path(folder) / "copy.cbvh"
            mesh.save(copy)
            self.assertEqual(copy.read_bytes(), output.read_bytes())
            self.assertEqual(sorted(os.listdir(folder)), ["copy.cbvh", "environment.cbvh"])
            mesh.check()

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


@unittest.skipUnless(COMMAND, "CBVH does not name the command cbvh")
class SameBits(unittest.TestCase):
    """Answers are those of the command, bit for bit."""

    def test_all_questions_about_pairs(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for triangles in ("f32", "packed"):
                meshes = [
                    cbvh.bake_files(TESTDATA / f"{name}.obj", folder / f"{name}-{triangles}.cbvh", triangles=triangles)
                    for name in ("fclenv", "fclrob")
                ]
                poses = random_poses(7, 300, 1200.0)
                poses[:, :3, 3] += [300, -1600, -500]
                (folder / "poses.txt").write_text(
                    "\n".join(" ".join(repr(float(n)) for n in pose[:3].ravel()) for pose in poses)
                )
                for mode in ("collide", "contacts", "distance", "within", "relation"):
                    command = [COMMAND, "query", *(f"{folder}/{name}-{triangles}.cbvh" for name in ("fclenv", "fclrob"))]
                    command += [f"{folder}/poses.txt", "--mode", mode, "--out", f"{folder}/raw.txt", "--json"]
                    command += ["--within", "200"] if mode == "within" else []
                    subprocess.run(command, check=True, capture_output=True)
                    raw = [line.split() for line in (folder / "raw.txt").read_text().splitlines()]
                    raw = np.array([float(line[0]) for line in raw if line and not line[0].startswith("#")])
                    a, b = meshes
                    for parallel in (False, True):
                        found = {
                            "collide": lambda: a.collide(b, poses, parallel=parallel),
                            "contacts": lambda: [len(rows) for rows in a.contacts(b, poses, parallel=parallel)],
                            "distance": lambda: a.distance(b, poses, parallel=parallel).distance,
                            "within": lambda: a.within(b, poses, 200, parallel=parallel),
                            "relation": lambda: a.relation(b, poses, parallel=parallel),
                        }[mode]()
                        np.testing.assert_array_equal(np.asarray(found, float), raw, f"{mode}, {triangles}")
                    self.assertGreater(len(set(raw.tolist())), 1, mode)


class Stubs(unittest.TestCase):
    """The stubs of the compiled module state what is there, and everything public is documented."""

    def test_stubs_state_what_is_there(self):
        stubs = ast.parse((pathlib.Path(cbvh.__file__).parent / "_cbvh.pyi").read_text())
        functions = {node.name: node for node in stubs.body if isinstance(node, ast.FunctionDef)}
        classes = {node.name: node for node in stubs.body if isinstance(node, ast.ClassDef)}
        there = {name for name in dir(_cbvh) if not name.startswith("_")}
        self.assertEqual(there, functions.keys() | classes.keys())
        methods = {node.name: node for node in classes["Mesh"].body if isinstance(node, ast.FunctionDef)}
        self.assertEqual({name for name in dir(_cbvh.Mesh) if not name.startswith("_")}, methods.keys())
        for holder, stated in ((_cbvh, functions), (_cbvh.Mesh, methods)):
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


if __name__ == "__main__":
    unittest.main()
