"""Meshes, poses and places of data that several tests share."""

import os
import pathlib
import subprocess

import numpy as np

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"
SHARED = pathlib.Path(__file__).resolve().parents[4] / "shared"
COMMAND = os.environ.get("CBVH")
WITHOUT_COMMAND = "CBVH does not name the command cbvh"
WITHOUT_SHARED = "there is no folder shared beside the checkout, with meshes and questions about them"


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


def turns(axis, *angles):
    """Poses that turn about an axis of the coordinates, 0 to 2, shape (N, 4, 4)."""
    poses = np.tile(np.eye(4), (len(angles), 1, 1))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    poses[:, i, i], poses[:, i, j] = np.cos(angles), -np.sin(angles)
    poses[:, j, i], poses[:, j, j] = np.sin(angles), np.cos(angles)
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


def bottom_row(rows):
    """Poses of shape (..., 4, 4) from rows of 12 numbers each."""
    rows = np.asarray(rows, float)
    poses = np.zeros((*rows.shape[:-1], 4, 4))
    poses[..., :3, :], poses[..., 3, 3] = rows.reshape(*rows.shape[:-1], 3, 4), 1
    return poses


def check_errors(test, cases):
    """Checks that each call, with its arguments, raises the exception, and that its message has the words."""
    for kind, words, call, *arguments in cases:
        with test.subTest(words), test.assertRaises(kind) as caught:
            call(*arguments)
        test.assertIn(words, str(caught.exception))


def numbers_of(path, limit=None):
    """The rows of a text file of numbers, without what follows a #."""
    rows = []
    for line in path.read_text().splitlines():
        fields = line.split("#")[0].split()
        if fields and (limit is None or len(rows) < limit):
            rows.append([float(field) for field in fields])
    return np.array(rows)


def write_rows(path, rows):
    """Writes rows of numbers with all digits."""
    path.write_text("".join(" ".join(repr(float(n)) for n in row) + "\n" for row in rows))


def ask_command(folder, *arguments):
    """Runs the command, and returns the fields of the answers that it writes to a file, line by line."""
    raw = folder / "raw.txt"
    subprocess.run([COMMAND, *map(str, arguments), "--out", str(raw)], check=True, capture_output=True)
    lines = [line.split() for line in raw.read_text().splitlines()]
    return [line for line in lines if line and not line[0].startswith("#")]
