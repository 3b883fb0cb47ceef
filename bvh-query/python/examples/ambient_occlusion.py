"""Ambient occlusion: how much of the sky each point of a mesh sees, as a picture.

    python examples/ambient_occlusion.py [PICTURE]

Rays of a camera find the points, and pairs of points in random directions tell how open each is: some ten million questions in a
few calls. The picture is a PNG, which needs numpy alone.
"""

import pathlib
import sys
import time
import zlib

import numpy as np

import cbvh

HERE = pathlib.Path(__file__).resolve().parent
TESTDATA = HERE.parents[2] / "testdata"
PICTURE = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "ambient_occlusion.png"
WIDTH, HEIGHT = 660, 440
# Rays per pixel, directions per ray, and how far away what hides the sky may be, in mesh units: most of the height of the room.
SAMPLES, DIRECTIONS, REACH = 4, 16, 2500.0


def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(field) for field in line[1:4]] for line in lines if line[:1] == ["v"]]
    faces = [[int(field.split("/")[0]) - 1 for field in line[1:4]] for line in lines if line[:1] == ["f"]]
    return np.array(vertices), np.array(faces)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def camera_rays(eye, target, width, height, random, angle=np.radians(41)):
    """The directions of a camera's rays, one somewhere in each pixel, row after row from the top left."""
    forward = unit(target - eye)
    right = unit(np.cross(forward, [0, 0, 1]))
    up = np.cross(right, forward)
    y, x = np.indices((height, width)) + random.random((2, height, width)) - np.reshape([height / 2, width / 2], (2, 1, 1))
    return forward + np.tan(angle / 2) / (width / 2) * (x[..., None] * right - y[..., None] * up).reshape(-1, 3)


def openness(mesh, points, normals, count, reach, random):
    """The share of directions in which each point sees something that far away, weighted by the cosine to its normal."""
    # The points are hits, which are off by rounding. The margin leaves out what is next to them.
    margin = 1e-6 * reach
    across = unit(np.cross(normals, [0.48, 0.6, 0.64]))
    along = np.cross(normals, across)
    first = random.random(len(points))
    seen = np.zeros(len(points))
    for number in range(count):
        # A disc, in rings of equal areas, is a hemisphere from above. The golden angle spreads the directions of a point.
        square = (number + random.random(len(points))) / count
        angle = 2 * np.pi * (first + 0.618034 * number)
        ways = np.sqrt(square) * [np.cos(angle), np.sin(angle)]
        ways = ways[0][:, None] * across + ways[1][:, None] * along + np.sqrt(1 - square)[:, None] * normals
        seen += mesh.visible(points, points + reach * ways, margin=margin, parallel=True)
    return seen / count


def meets_any(corners, starts, ends):
    """Whether segments cross any triangle, by the signs of the volumes that they span with its sides: all of them one by one."""
    a, b, c = (corners[:, k] - starts[:, None] for k in range(3))
    way = (ends - starts)[:, None]
    sides = np.stack([np.einsum("ijk,ijk->ij", way, np.cross(p, q)) for p, q in ((a, b), (b, c), (c, a))])
    normals = np.cross(b - a, c - a)
    ahead = np.einsum("ijk,ijk->ij", a, normals) * np.einsum("ijk,ijk->ij", a - way, normals) < 0
    return (((sides > 0).all(0) | (sides < 0).all(0)) & ahead).any(1)


def write_png(path, pixels):
    """Writes an array of height, width and three bytes."""
    height, width, _ = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], axis=1)

    def chunk(name, data):
        return len(data).to_bytes(4, "big") + name + data + zlib.crc32(name + data).to_bytes(4, "big")

    header = width.to_bytes(4, "big") + height.to_bytes(4, "big") + bytes([8, 2, 0, 0, 0])
    data = zlib.compress(rows.tobytes(), 9)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


# A flat with a table and chairs, and a piano in it, as one mesh.
(vertices, faces), (piano, piano_faces) = read_obj(TESTDATA / "fclenv.obj"), read_obj(TESTDATA / "fclrob.obj")
faces = np.concatenate([faces, piano_faces + len(vertices)])
vertices = np.concatenate([vertices, piano + [700.0, -1100.0, 430.0]])
walls = cbvh.bake(vertices, faces)
corners = vertices[faces]
normals = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))

start = time.perf_counter()
eye, target = np.array([-2400.0, -7200.0, 11600.0]), np.array([-100.0, 130.0, 600.0])
random = np.random.default_rng(1)
picture, count = np.zeros((HEIGHT * WIDTH, 3)), 0
surface, sky = np.array([0.96, 0.94, 0.9]), np.array([0.16, 0.2, 0.27])
for _ in range(SAMPLES):
    rays = camera_rays(eye, target, WIDTH, HEIGHT, random)
    hits = walls.first_hits(eye, rays, parallel=True)
    found = np.isfinite(hits.t)
    facing = normals[hits.triangle[found]]
    facing *= np.where(np.einsum("ij,ij->i", facing, rays[found]) > 0, -1, 1)[:, None]
    light = openness(walls, hits.point[found], facing, DIRECTIONS, REACH, random)
    picture[found] += light[:, None] * surface
    picture[~found] += sky
    count += len(light)
print(f"{count} points and {count * DIRECTIONS} pairs of points in {time.perf_counter() - start:.1f} s")
picture /= SAMPLES

# Points anywhere, with and without the library.
starts, ends = random.uniform(vertices.min(axis=0), vertices.max(axis=0), (2, 300, 3))
np.testing.assert_array_equal(walls.visible(starts, ends), ~meets_any(corners, starts, ends))

write_png(PICTURE, (255 * picture.clip(0, 1)).astype(np.uint8).reshape(HEIGHT, WIDTH, 3))
print(f"wrote {PICTURE}")
