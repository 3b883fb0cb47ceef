"""Tests of wrong arguments: each gives an exception that says what is wrong, and none a crash."""

import random
import unittest

import numpy as np

import cbvh
from cbvh import _cbvh
from common import TESTDATA, check_errors, cube, random_poses, shifts


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
            (ValueError, "poses: expected a rotation", mesh.distance, mesh, scaled),
            (ValueError, "reflection", mesh.contacts, mesh, mirrored),
            (TypeError, "poses: expected numbers, found dtype <U1", mesh.within, mesh, "x", 1),
            (TypeError, "poses: expected numbers, found dtype object", mesh.relation, mesh, None),
            (TypeError, "expected numbers, found dtype complex128", mesh.collide, mesh, one * 1j),
            (TypeError, "other: expected a cbvh.Mesh, found str", mesh.collide, "mesh", one),
            (ValueError, "NaN", mesh.within, mesh, one, np.nan),
            (ValueError, "-1", mesh.within, mesh, one, -1),
            (ValueError, "points: expected shape (3,) or (N, 3), found (2,)", mesh.sides, [0, 0]),
            (ValueError, "pose: expected shape (4, 4)", lambda: mesh.sides([0, 0, 0], pose=np.eye(3))),
            (ValueError, "points: expected finite coordinates, found inf", mesh.sides, [0, 0, np.inf]),
            (ValueError, "points[1]: expected finite coordinates, found NaN", mesh.sides, [[0, 0, 0], [0, np.nan, 0]]),
            (ValueError, "origins[1]: expected finite", mesh.any_hits, [[0, 0, 0], [0, np.nan, 0]], [1, 0, 0]),
            (ValueError, "poses: expected numbers in an array", mesh.collide, mesh, [[1, 2], [3]]),
            (ValueError, "within: expected", lambda: mesh.closest_points([0, 0, 0], within=-1)),
            (TypeError, "d: expected a number, found str", mesh.within, mesh, one, "x"),
            (TypeError, "d: expected a number, found dtype complex128", mesh.within, mesh, one, np.complex128(1j)),
            (ValueError, "d: expected a number that a float can hold", mesh.within, mesh, one, 10**400),
            (ValueError, "d: expected", mesh.within, mesh, np.zeros((0, 4, 4)), -1),
            (TypeError, "parallel: expected a bool, found int", lambda: mesh.collide(mesh, one, parallel=1)),
            (TypeError, "rel_err: expected a number, found str", lambda: mesh.distance(mesh, one, rel_err="x")),
            (TypeError, "expected cbvh.open or cbvh.bake to make a mesh", cbvh.Mesh, vertices, faces),
            (TypeError, "expected cbvh.Motion.between", cbvh.Motion, one, one),
            (ValueError, "faces: expected shape (F, 3)", cbvh.bake, vertices, [[0, 1], [2]]),
            (TypeError, "ids: expected a bool, found int", lambda: cbvh.bake(vertices, faces, ids=1)),
            (ValueError, "max_error: expected triangles", lambda: cbvh.bake(vertices, faces, max_error=0.1)),
            (ValueError, "max_error: expected a finite", lambda: cbvh.bake(vertices, faces, triangles="quantized", max_error=-1)),
            (ValueError, "max_error: expected a finite", lambda: cbvh.bake(vertices, faces, triangles="quantized", max_error=np.nan)),
            (ValueError, "weld: expected a finite length of at least 0", lambda: cbvh.bake(vertices, faces, weld=-1)),
            (ValueError, "weld: expected a finite length of at least 0", lambda: cbvh.bake(vertices, faces, weld=np.nan)),
            (TypeError, "weld: expected a number", lambda: cbvh.bake(vertices, faces, weld="x")),
            (cbvh.BakeError, "expected a weld distance from 0 to the diagonal", lambda: cbvh.bake(vertices, faces, weld=1e3)),
            (TypeError, "max_error: expected a number", lambda: cbvh.bake(vertices, faces, max_error="x")),
            (TypeError, "round: expected a str", lambda: cbvh.bake(vertices, faces, round=32)),
            (ValueError, "inputs: expected at least one file", cbvh.bake_files, [], "x.cbvh"),
            (TypeError, "inputs: expected a path", cbvh.bake_files, 5, "x.cbvh"),
            (TypeError, "max_memory: expected bytes", lambda: cbvh.bake_files("x.obj", "x.cbvh", max_memory=1e9)),
            (ValueError, "max_memory: expected bytes", lambda: cbvh.bake_files("x.obj", "x.cbvh", max_memory=-1)),
            (IndexError, "object: expected a number below 1", mesh.object, -1),
            (IndexError, "object: expected a number below 1", mesh.object, 2**70),
            (TypeError, "object: expected a number or a name, found float", mesh.object, 1.5),
            (TypeError, "", cbvh.Mesh.from_bytes, 5),
            (ValueError, "directions: expected as many as of origins, 2, found 3", mesh.first_hits, np.zeros((2, 3)), np.ones((3, 3))),
            (ValueError, "ends: expected as many as of starts, 2, found 3", mesh.segment_hits, np.zeros((2, 3)), np.ones((3, 3))),
            (ValueError, "points_b: expected as many as of points_a, 2, found 3", mesh.visible, np.zeros((2, 3)), np.ones((3, 3))),
            (TypeError, "margin: ", lambda: mesh.visible([0, 0, 0], [1, 1, 1], margin="far")),
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
            (FileNotFoundError, "no such.obj", cbvh.bake_files, "no such.obj", "x.cbvh"),
            (FileNotFoundError, "no such folder", cbvh.bake_files, TESTDATA / "fclrob.obj", "no such folder/x.cbvh"),
            (cbvh.BakeError, "expected", cbvh.bake_files, __file__, "x.cbvh"),
            (ValueError, "position: expected shape (3,) or (N, 3), found (4,)", cbvh.pose, [0, 0, 0, 1]),
            (ValueError, "position and quaternion: ", cbvh.pose, [0, 0, 0], [0, 0, 0, 2]),
            (ValueError, "quaternion: expected as many as of position, 2, found 3", cbvh.pose, np.zeros((2, 3)), np.eye(4)[:3]),
            (ValueError, "b: expected a rotation", cbvh.relative, one, scaled),
        ]
        check_errors(self, cases)
        for options in ({"profile": "dop7"}, {"triangles": "small"}, {"round": "f16"}, {"effort": "low"}):
            with self.assertRaisesRegex(ValueError, f"{next(iter(options))}: expected one of"):
                cbvh.bake(vertices, faces, **options)
        with self.assertRaisesRegex(ValueError, "parallel"):
            mesh.distance(mesh, one, rel_err=0.1, parallel=True)

    def test_arrays_of_as_many_numbers_in_another_shape_are_refused(self):
        for call, array in (
            (self.cube.sides, np.zeros((3, 2))),
            (lambda pose: self.cube.sides(np.zeros((1, 3)), pose=pose), np.zeros((2, 8))),
            (lambda poses: self.cube.collide(self.cube, poses), np.zeros((1, 2, 8))),
            (lambda poses: self.cube.collide(self.cube, poses), np.eye(4)[None, None]),
            (lambda poses: self.cube.collide(self.cube, poses), np.eye(4).reshape(16)),
        ):
            with self.assertRaisesRegex(ValueError, "expected shape"):
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
                mesh.validate()
            except cbvh.FormatError:
                found += 1
        self.assertGreater(found, 50)

    def test_ten_thousand_misuses_raise_nothing_unexpected(self):
        random_numbers = random.Random(5)
        mesh, scene, manager = self.cube, cbvh.Scene(), cbvh.CollisionManager()
        poses = random_poses(1, 3, 2.0)
        for number, pose in enumerate(poses):
            scene.add(mesh, pose, name=f"part {number}")
            manager.add_object(number, mesh, pose)
        motion, line = cbvh.Motion.between(poses[0], poses[1:]), cbvh.Polyline(poses)
        odd = [None, "x", b"", 0, -1, 1e308, np.nan, np.inf, True, [], [[]], {}, mesh, object(), np.zeros((2, 0))]
        odd += [np.eye(4), np.eye(3), shifts((0, 0, 0)), np.zeros((4, 4)), np.ones((3, 3)), np.zeros(3), np.zeros(2**12)]
        odd += [np.eye(4) * np.nan, np.eye(4, dtype=np.float16), np.eye(4, dtype=complex), np.array(["a"]), 2**70, "a\0b"]
        odd += [np.zeros((1, 1, 1, 1)), np.eye(4) * 1e300, [0, 0, 0], [[0, 0, 0], [1, 1, 1]], np.zeros((0, 3)), range(3)]
        odd += [scene, manager, motion, motion[0], line, {0: line}, {1: motion, "x": line}, [line, motion[1]], 2**63, 1.5]
        odd += [mesh._mesh, scene._scene, line._paths, np.arange(3), poses, "part 1"]
        things = [(mesh, 4), (scene, 4), (manager, 2), (motion, 1), (line, 1), (_cbvh, 3), (cbvh.Motion, 1), (cbvh, 1)]
        methods = []
        for thing, share in things:
            names = [name for name in dir(thing) if not name.startswith("_") and callable(getattr(thing, name))]
            # Those that write files are not asked with random names.
            calls = [getattr(thing, name) for name in names if name not in ("save", "bake_files", "open", "Path", "view")]
            methods += [(share / len(calls), call) for call in calls]
        shares = [share for share, _ in methods]
        allowed = (TypeError, ValueError, LookupError, OverflowError, OSError, AttributeError)
        answered = set()
        for _ in range(10_000):
            (_, call), = random_numbers.choices(methods, shares)
            arguments = [random_numbers.choice(odd) for _ in range(random_numbers.randrange(6))]
            try:
                call(*arguments)
                answered.add(getattr(call, "__qualname__", call))
            except allowed:
                pass
        self.assertGreater(len(answered), 40)
        # All are still whole.
        self.assertIs(mesh.collide(mesh, np.eye(4)), True)
        scene.distance(), manager.in_collision_internal()


if __name__ == "__main__":
    unittest.main()
