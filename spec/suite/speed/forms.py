"""Makes the meshes of the timed queries: the same bytes on every machine.

Only operations that IEEE 754 rounds correctly are used, one after another: sums, products, quotients and square roots. Nothing is
left to a mathematical library or to the order of a sum. Coordinates are rounded to single precision, so all libraries hold the same
mesh. A link of a robot comes from the pip package example-robot-data, if it is installed.
"""

import functools
import hashlib
import importlib.metadata
import json
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent


class Missing(Exception):
    """What is not on this machine, with what makes it."""


def uniform(seed, *shape):
    """Returns numbers from 0 to 1, of which 1 is excluded, from the bits of PCG64."""
    bits = np.random.PCG64(seed).random_raw(int(np.prod(shape)))
    return ((bits >> np.uint64(11)) * 2.0**-53).reshape(shape)


def length(v):
    return np.sqrt(v[..., 0] * v[..., 0] + v[..., 1] * v[..., 1] + v[..., 2] * v[..., 2])


def scan(n, seed):
    """A closed surface as a scanner gives it: small irregular triangles, lumps and dents, and noise. 12 n^2 triangles.

    The surface of a cube with n by n cells on each face is shaken, blown up to a sphere, and given lumps.
    """
    corners, faces = [], []
    steps = np.arange(-n, n + 1, 2)
    u, v = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    cell = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    squares = np.stack([cell, cell + n + 1, cell + n + 2, cell + 1], 1)
    for axis in range(3):
        for sign in (1, -1):
            points = np.empty((len(u), 3), np.int64)
            points[:, axis], points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = sign * n, sign * u, v
            faces.append(squares + len(u) * len(corners))
            corners.append(points)
    # Faces of the cube share their edges.
    points, index = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    a, b, c, d = index.reshape(-1)[np.concatenate(faces)].T
    random = uniform(seed, len(points), 4)
    at = points + 1.4 * (random[:, :3] - 0.5)
    at = at / length(at)[:, None]
    radius = 1.0 + 0.3 / n * (random[:, 3] - 0.5)
    for x, y, z, width, height in uniform(seed + 1, 24, 5) - 0.5:
        along = (x * at[:, 0] + y * at[:, 1] + z * at[:, 2]) / np.sqrt(x * x + y * y + z * z)
        start = 0.7 + 0.5 * width
        lump = np.maximum(along - start, 0.0) / (1.0 - start)
        radius = radius + (1.2 * height + 0.1) * lump * lump
    return at * radius[:, None], np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def circle(n):
    """Returns n points on the unit circle, by rational functions. n is a multiple of 4."""
    t = np.arange(n // 4) / (n // 4)
    x, y = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
    return np.concatenate([np.stack(quarter, 1) for quarter in ((x, y), (-y, x), (-x, -y), (y, -x))])


def strip(lower, upper, is_round=True):
    """Returns the quadrilaterals between two lines of points, as triangles of points."""
    next_lower, next_upper = np.roll(lower, -1, 0), np.roll(upper, -1, 0)
    faces = np.stack([np.stack([lower, next_lower, upper], 1), np.stack([next_lower, next_upper, upper], 1)], 1)
    return (faces if is_round else faces[:-1]).reshape(-1, 3, 3)


def at_height(points, z):
    return np.concatenate([points, np.full((len(points), 1), float(z))], 1)


def box(low, high):
    """Returns the 12 triangles of a box."""
    (x, y, z), (a, b, c) = low, high
    square = np.array([[x, y], [a, y], [a, b], [x, b]], float)
    lower, upper = at_height(square, z), at_height(square, c)
    caps = [lower[[0, 2, 1]], lower[[0, 3, 2]], upper[[0, 1, 2]], upper[[0, 2, 3]]]
    return np.concatenate([strip(lower, upper), caps])


def cylinder(n, x, y, radius, low, high):
    """Returns an upright cylinder whose caps are fans of thin triangles from one corner."""
    ring = circle(n) * radius + (x, y)
    lower, upper = at_height(ring, low), at_height(ring, high)
    fans = [np.stack([np.broadcast_to(cap[0], (n - 2, 3)), cap[1:-1], cap[2:]], 1) for cap in (lower[::-1], upper)]
    return np.concatenate([strip(lower, upper), *fans])


def part(fineness):
    """A part as CAD exports it: a plate of 8 by 5 cells with round holes, studs, and ribs with fillets, each a surface of its own.

    Its triangles have very different sizes, and many are fans and slivers. Some 14,000 triangles for each unit of fineness.
    """
    columns, rows, thick = 8, 5, 0.25
    found = []
    square = np.array([[1, 1], [0, 1], [0, 0], [1, 0]], float)
    for i in range(columns):
        for j in range(rows):
            corners, n = square + (i, j), fineness * (0, 16, 32, 64, 128, 256)[(3 * i + 5 * j) % 6]
            lower, upper = at_height(corners, 0), at_height(corners, thick)
            if n == 0:
                found.append([lower[[0, 2, 1]], lower[[0, 3, 2]], upper[[0, 1, 2]], upper[[0, 2, 3]]])
            else:
                hole = circle(n) * (0.2 + 0.02 * j) + (i + 0.5, j + 0.5)
                below, above = at_height(hole, 0), at_height(hole, thick)
                found.append(strip(above, below))
                for ring, cap in ((below, lower), (above, upper)):
                    # Each corner of the cell sees a quarter of the hole, and each side sees the point between two quarters.
                    corner = np.repeat(cap, n // 4, axis=0)
                    fan = np.stack([corner, np.roll(ring, -1, 0), ring], 1)
                    sides = np.stack([cap, np.roll(cap, -1, 0), ring[np.arange(1, 5) * (n // 4) % n]], 1)
                    fans = np.concatenate([fan, sides])
                    found.append(fans[:, ::-1] if ring is below else fans)
            for side in range(4):
                is_outer = (j == rows - 1, i == 0, j == 0, i == columns - 1)[side]
                if is_outer:
                    ends = [side, (side + 1) % 4]
                    found.append(strip(lower[ends], upper[ends], False))
    for k in range(4):
        found.append(cylinder(64 * fineness, (0.5, 7.5)[k % 2], (0.5, 4.5)[k // 2], 0.15, thick, thick + 1.0))
        y, radius = 1.0 + k, 0.125
        found.append(box((0.0, y - 0.03125, thick), (columns, y + 0.03125, thick + 0.5)))
        # A fillet is a quarter of a hollow cylinder, as long as the plate.
        quarter = np.concatenate([circle(64 * fineness)[: 16 * fineness], [[0.0, 1.0]]])
        for sign in (1, -1):
            arc = np.stack([np.zeros(len(quarter)), y + sign * (0.03125 + radius - radius * quarter[:, 0]), thick + radius - radius * quarter[:, 1]], 1)
            found.append(strip(arc[::-sign], arc[::-sign] + (columns, 0.0, 0.0), False))
    return joined(np.concatenate([np.asarray(piece).reshape(-1, 3, 3) for piece in found]) / 4.0)


def shell(n):
    """A thin dish with ripples, 2^-8 thick and closed: 4 n^2 + 8 n triangles."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(-n, n + 1, 2) / n, np.arange(-n, n + 1, 2) / n, indexing="ij"))
    ripple = np.abs(np.mod(12.0 * x, 2.0) - 1.0) * np.abs(np.mod(12.0 * y, 2.0) - 1.0)
    z = 0.5 * (x * x + y * y) + ripple / 32.0
    count, cell = len(x), (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = cell, cell + n + 1, cell + n + 2, cell + 1
    up = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    side = np.arange(n)
    rims = [side * (n + 1), n * (n + 1) + side, n * (n + 2) - side * (n + 1), n - side]
    rims = np.concatenate([np.stack([rim, rim + step], 1) for rim, step in zip(rims, (n + 1, 1, -n - 1, -1))])
    p, q = rims.T
    rim = np.concatenate([np.stack([p, p + count, q], 1), np.stack([q, p + count, q + count], 1)])
    points = np.concatenate([np.stack([x, y, z], 1), np.stack([x, y, z - 2.0**-8], 1)])
    return points, np.concatenate([up, up[:, ::-1] + count, rim])


def joined(triangles):
    """Returns triangles of points as corners, each once, and indices."""
    corners, index = np.unique(triangles.reshape(-1, 3).astype(np.float32), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    return corners, faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]


def link(path):
    """A link of a robot, from a binary STL file of the package example-robot-data."""
    try:
        share = importlib.metadata.distribution("example-robot-data").locate_file("cmeel.prefix/share")
        data = (Path(str(share)) / "example-robot-data" / "robots" / path).read_bytes()
    except (importlib.metadata.PackageNotFoundError, OSError) as absent:
        raise Missing("pip install example-robot-data") from absent
    count = int.from_bytes(data[80:84], "little")
    record = np.dtype([("numbers", "<f4", 12), ("attribute", "<u2")])
    return joined(np.frombuffer(data, record, count, 84)["numbers"][:, 3:].reshape(-1, 3, 3))


# The joints of the arm UR3 from its base to its hand: the name of the link, where its frame is in that of the link before, the axis
# around which it turns, and the tangent of half the angle. An angle includes the quarter turn that some frames have.
UR3 = (
    ("base", (0.0, 0.0, 0.0), 2, 0.0),
    ("shoulder", (0.0, 0.0, 0.1519), 2, 0.25),
    ("upperarm", (0.0, 0.1198, 0.0), 1, 0.25),
    ("forearm", (0.0, -0.0925, 0.24365), 1, 0.5),
    ("wrist1", (0.0, 0.0, 0.21325), 1, 0.375),
    ("wrist2", (0.0, 0.08505, 0.0), 2, -0.25),
    ("wrist3", (0.0, 0.0, 0.08535), 1, 0.125),
)


def ur3(name):
    """A link of the arm UR3 where it is when all joints are turned: its corners are in the frame of the base."""
    corners, faces = link(f"ur_description/meshes/ur3/collision/{name}.stl")
    number = [joint[0] for joint in UR3].index(name)
    for _, offset, axis, tangent in UR3[number::-1]:
        corners = turned(corners.astype(float), axis, tangent) + offset
    return corners, faces


def turned(points, axis, tangent):
    """Returns points turned around an axis of the coordinates, by the tangent of half the angle."""
    cosine, sine = (1.0 - tangent * tangent) / (1.0 + tangent * tangent), 2.0 * tangent / (1.0 + tangent * tangent)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    found = points.copy()
    found[:, i] = cosine * points[:, i] - sine * points[:, j]
    found[:, j] = sine * points[:, i] + cosine * points[:, j]
    return found


def scaled(factor, maker, *arguments):
    """Another mesh, made larger or smaller by a power of two."""
    corners, faces = MAKERS[maker](*arguments)
    return corners * np.float32(factor), faces


MAKERS = {f.__name__: f for f in (scan, part, shell, link, ur3, scaled)}


def content(corners, faces):
    """Returns the bytes of a mesh file: the corners as little-endian f32, then the triangles as little-endian u32."""
    return corners.astype("<f4").tobytes() + faces.astype("<u4").tobytes()


def catalogue():
    """Returns the meshes and the pairs of `pairs.json`."""
    return json.loads((HERE / "pairs.json").read_text(encoding="utf-8"))


@functools.lru_cache(maxsize=8)
def made(maker, arguments):
    """Returns corners in f32 and triangles by a maker and its arguments as JSON."""
    corners, faces = MAKERS[maker](*json.loads(arguments))
    return corners.astype(np.float32), faces


def make(record):
    """Returns corners in f32 and triangles of a record of `pairs.json`. The hash must be right."""
    corners, faces = made(record["make"], json.dumps(record["arguments"]))
    found = hashlib.sha256(content(corners, faces)).hexdigest()
    if record.get("sha256", found) != found:
        raise ValueError(f"{record}: expected a mesh with this hash, found {found}")
    return corners, faces


# The rotations by quarter turns: signed permutations of the axes with determinant 1.
TURNS = [
    np.stack([s * np.eye(3)[k] for s, k in zip(signs, axes)])
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2))
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1), (-1, -1, -1), (-1, 1, 1), (1, -1, 1), (1, 1, -1))
]
TURNS = [turn for turn in TURNS if np.cross(turn[0], turn[1]) @ turn[2] > 0]


def instances(field):
    """Returns the instances of a field: the number of each mesh, and its pose as twelve numbers.

    They stand in a cube of `side` cells along each axis, shaken and turned by quarters, so that no placed corner is rounded in f64.
    Without a side, each mesh is there once, in its own place.
    """
    if "side" not in field:
        return list(range(len(field["meshes"]))), [np.eye(3, 4).ravel().tolist()] * len(field["meshes"])
    side, step = field["side"], field["step"]
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3) - (side - 1) / 2
    random = uniform(field["seed"], len(cells), 5)
    at = cells * step + np.floor(1024 * (random[:, :3] - 0.5) * step / 4) / 1024
    turns = [TURNS[int(x * len(TURNS))] for x in random[:, 3]]
    numbers = [int(x * len(field["meshes"])) for x in random[:, 4]]
    return numbers, [np.concatenate([turn, t[:, None]], 1).ravel().tolist() for turn, t in zip(turns, at)]


def flattened(field, meshes):
    """Returns a field as one mesh in f64, in exactly the places of its instances, and the number of the instance of each triangle."""
    corners, faces, owners, count = [], [], [], 0
    for owner, (number, row) in enumerate(zip(*instances(field))):
        points, triangles = make(meshes[field["meshes"][number]])
        pose = np.array(row).reshape(3, 4)
        turned = np.stack([points[:, k] * sign for k, sign in ((np.flatnonzero(r)[0], r[np.flatnonzero(r)[0]]) for r in pose[:, :3])], 1).astype(float)
        placed = turned + pose[:, 3]
        if not np.array_equal(placed - pose[:, 3], turned) or not np.array_equal(placed - turned, np.broadcast_to(pose[:, 3], placed.shape)):
            raise ValueError("expected instances whose corners need no rounding")
        corners.append(placed)
        faces.append(triangles + count)
        owners.append(np.full(len(triangles), owner))
        count += len(points)
    return np.concatenate(corners), np.concatenate(faces), np.concatenate(owners)
