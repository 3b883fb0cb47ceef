"""Tests of the arrays of a mesh, of answers that print names, and of poses that are made rigid: numpy is the oracle."""

import pathlib
import pickle
import tempfile
import unittest

import numpy as np

import cbvh
from cbvh import MotionKind, Relation, Side
from common import TESTDATA, check_errors, cube, random_poses, shifts


def read_obj(path):
    """Vertices and triangles of an OBJ file of triangles."""
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([line[1:4] for line in lines if line[:1] == ["v"]], float)
    faces = [[field.split("/")[0] for field in line[1:4]] for line in lines if line[:1] == ["f"]]
    return vertices.astype(np.float32).astype(float), np.array(faces, int) - 1


class Triangles(unittest.TestCase):
    """`Mesh.triangles`, `Mesh.vertices` and `Mesh.faces` are the input's."""

    def check(self, mesh, vertices, faces):
        expected = vertices[faces]
        found = mesh.triangles
        self.assertEqual((found.shape, found.dtype), (expected.shape, np.float64))
        turned = [np.roll(expected, shift, axis=1) for shift in range(3)]
        self.assertTrue(np.any([(found == one).all(axis=(1, 2)) for one in turned], axis=0).all())
        np.testing.assert_array_equal(mesh.vertices, np.unique(expected.reshape(-1, 3), axis=0))
        self.assertEqual((mesh.faces.shape, mesh.faces.dtype), ((len(faces), 3), np.int64))
        np.testing.assert_array_equal(mesh.vertices[mesh.faces], found)

    def test_rows_are_the_triangles_of_the_input(self):
        random_numbers = np.random.default_rng(1)
        for name in ("fclenv", "fclrob"):
            vertices, faces = read_obj(TESTDATA / f"{name}.obj")
            for triangles in ("f32", "packed"):
                self.check(cbvh.bake(vertices, faces, triangles=triangles), vertices, faces)
        # A duplicate that is left out is the triangle that is stored.
        vertices = random_numbers.uniform(-1, 1, (30, 3)).astype(np.float32).astype(float)
        faces = np.array([random_numbers.choice(30, 3, replace=False) for _ in range(40)])
        faces[[7, 35]] = faces[2]
        mesh = cbvh.bake(vertices, faces)
        self.assertEqual(mesh.triangle_count, 38)
        self.check(mesh, vertices, faces)

    def test_coordinates_are_rounded_as_numpy_rounds_them(self):
        random_numbers = np.random.default_rng(2)
        vertices = 10.0 ** random_numbers.uniform(-6, 6, (90, 3)) * random_numbers.choice([-1, 1], (90, 3))
        faces = np.arange(90).reshape(30, 3)
        rounded = vertices.astype(np.float32).astype(float)
        self.check(cbvh.bake(vertices, faces, round="f32"), rounded, faces)
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "mesh.obj"
            lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
            lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
            source.write_text("\n".join(lines))
            mesh = cbvh.bake_files(source, source.with_suffix(".cbvh"), round="f32")
            self.check(mesh, rounded, faces)
            del mesh  # Windows removes no file that is open.

    def test_ids_of_answers_are_rows(self):
        vertices, faces = read_obj(TESTDATA / "fclenv.obj")
        mesh, corners = cbvh.bake(vertices, faces), vertices[faces]
        middles = corners.mean(axis=1)
        found = mesh.closest_points(middles)
        # The closest point is in the plane of the triangle that is named.
        a, b, c = np.moveaxis(mesh.triangles[found.triangle], 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        off = np.abs(np.sum((found.point - a) * normal, axis=1))
        self.assertLess(off.max(), 1e-9 * np.ptp(vertices))

    def test_rows_of_other_objects_are_nan(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "two.obj").write_text("o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no b\nv 0 0 5\nf 1 2 4\nf 2 3 4\n")
            whole = cbvh.bake_files(folder / "two.obj", folder / "two.cbvh")
            vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5.0]])
            self.check(whole, vertices, np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3]]))
            if len(whole.names) == 2:
                one = whole.object(1)
                self.assertEqual((np.isnan(one.triangles).all(axis=(1, 2)).tolist(), one.triangle_count), ([True, False, False], 2))
                self.assertEqual(one.faces[0].tolist(), [-1, -1, -1])
                np.testing.assert_array_equal(one.triangles[1:], whole.triangles[1:])
                without = cbvh.bake_files(folder / "two.obj", folder / "without.cbvh", ids=False)
                with self.assertRaisesRegex(ValueError, "triangles: expected one object in a file without ids, found 2"):
                    without.triangles
                self.assertEqual(len(without.object(1).vertices), 4)


class Names(unittest.TestCase):
    """Numbers that print names."""

    def test_answers_print_names_and_are_numbers(self):
        mesh = cbvh.bake(*cube())
        poses = shifts((0, 0, 0), (3, 0, 0))
        relations = mesh.relation(mesh, poses)
        self.assertEqual((str(relations), repr(relations)), ("[TOUCHING, APART]", "Relation([TOUCHING, APART])"))
        self.assertEqual((relations.dtype, relations.tolist()), (np.uint8, [0, 1]))
        self.assertIs(relations[1], Relation.APART)
        self.assertEqual(str(relations[1:]), "[APART]")
        self.assertEqual([type(one) for one in relations], [Relation, Relation])
        for computed in (relations == Relation.APART, relations + 1, relations.sum(), np.where(relations, 1, 0)):
            self.assertNotIn("Relation", repr(computed))
        again = pickle.loads(pickle.dumps(relations))
        self.assertEqual(repr(again), repr(relations))
        sides = mesh.sides([[0, 0, 0], [0, 0, 0.5], [0, 0, 1]])
        self.assertEqual((str(sides), sides.tolist()), ("[INSIDE, ON, OUTSIDE]", [1, 0, -1]))
        kinds = mesh.motion(mesh, [cbvh.Motion.between(poses[1], pose) for pose in poses]).kind
        self.assertEqual((str(kinds), kinds.tolist()), ("[HIT, FREE]", [1, 0]))
        self.assertEqual([f"{one}" for one in (Relation.B_IN_A, Side.ON, MotionKind.NEAR)], ["B_IN_A", "ON", "NEAR"])
        scene = cbvh.Scene()
        scene.add(mesh), scene.add(mesh, poses[0])
        self.assertEqual(str(scene.relations().relations), "[TOUCHING]")
        self.assertIs(scene.sides([0, 0, 0]), Side.INSIDE)
        self.assertEqual(str(scene.sides([[0, 0, 0]])), "[INSIDE]")


class NearestPose(unittest.TestCase):
    """The polar factor, which numpy's singular values give as well."""

    def test_it_is_the_polar_factor(self):
        poses = random_poses(3, 200, 5.0)
        random_numbers = np.random.default_rng(4)
        for noise in (0.0, 1e-7, 1e-5, 2e-3):
            rough = poses.copy()
            rough[:, :3] += random_numbers.uniform(-noise, noise, (200, 3, 4))
            u, _, v = np.linalg.svd(rough[:, :3, :3])
            found = cbvh.nearest_pose(rough)
            np.testing.assert_allclose(found[:, :3, :3], u @ v, atol=1e-14)
            np.testing.assert_array_equal(found[:, :3, 3], rough[:, :3, 3])
            np.testing.assert_array_equal(found[:, 3], rough[:, 3])
            np.testing.assert_array_equal(cbvh.nearest_pose(rough[0]), found[0])
            # What it makes, everything takes.
            cbvh.relative(found, found[0])

    def test_what_is_far_from_rigid_is_refused(self):
        sheared = np.eye(4)
        sheared[0, 1] = 0.1
        cases = [
            ("matrix: expected shape (4, 4) or (N, 4, 4), found (3, 3)", np.eye(3)),
            ("matrix[1]: expected a rotation, found a reflection", [np.eye(4), np.diag([1, 1, -1, 1])]),
            ("matrix: expected a rotation, found a matrix scaled by 2", np.diag([2, 2, 2, 1])),
            ("matrix: expected", sheared),
            ("matrix: row 4", shifts((1, 2, 3))[0].T),
            ("matrix: ", np.full((4, 4), np.nan)),
        ]
        check_errors(self, [(ValueError, message, cbvh.nearest_pose, matrix) for message, matrix in cases])


if __name__ == "__main__":
    unittest.main()
