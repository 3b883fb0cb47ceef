"""Meshes made from integers: the same bytes on every machine.

Each maker returns corners, as triples of integers, and triangles. `scaled` and `shifted` give floats that are exact. A mesh that is
too large to be written into `cases/meshes.jsonl` is stated there by its maker and its arguments, and by the hash of what they give.
"""

import hashlib
from math import isqrt

from exact import fraction, to_hex


class Random:
    """SplitMix64: the numbers of a seed, the same everywhere."""

    def __init__(self, seed):
        self.state = seed

    def next(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) % 2**64
        z = self.state
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
        return z ^ z >> 31

    def below(self, count):
        return self.next() % count

    def between(self, low, high):
        """Returns an integer from low to high, both included."""
        return low + self.below(high - low + 1)

    def pick(self, things):
        return things[self.below(len(things))]


BOX = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]


def box(x, y, z, cx=0, cy=0, cz=0):
    """A box by its half sides and its centre: 12 triangles."""
    corners = [(cx + i * x, cy + j * y, cz + k * z) for k in (-1, 1) for j in (-1, 1) for i in (-1, 1)]
    return corners, list(BOX)


def together(*parts):
    """Several meshes as one."""
    corners, triangles = [], []
    for points, faces in parts:
        triangles += [tuple(i + len(corners) for i in t) for t in faces]
        corners += points
    return corners, triangles


def boxes(*of):
    """Boxes that may overlap or touch, each by its half sides and centre, as one mesh."""
    return together(*(box(*one) for one in of))


def group(*of):
    """Other meshes, each moved by a shift, as one mesh: (shift, maker, arguments) of each."""
    made = ((shift, *MAKERS[maker](*arguments)) for shift, maker, arguments in of)
    return together(*(([tuple(x + s for x, s in zip(p, shift)) for p in points], faces) for shift, points, faces in made))


def tetrahedron(r):
    return [(r, r, r), (r, -r, -r), (-r, r, -r), (-r, -r, r)], [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]


def octahedron(x, y, z):
    corners = [(x, 0, 0), (-x, 0, 0), (0, y, 0), (0, -y, 0), (0, 0, z), (0, 0, -z)]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    return corners, faces


def prism(outline, z):
    """A convex outline in the plane, counterclockwise, between -z and z."""
    n = len(outline)
    corners = [(*p, -z) for p in outline] + [(*p, z) for p in outline]
    faces = []
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, n + i), (j, n + j, n + i)]
    faces += [(0, i + 1, i) for i in range(1, n - 1)] + [(n, n + i, n + i + 1) for i in range(1, n - 1)]
    return corners, faces


def ell(a, b, z):
    """An L: a square of half side a without its corner beyond b, between -z and z."""
    outline = [(-a, -a), (a, -a), (a, b), (b, b), (b, a), (-a, a)]
    corners, faces = prism(outline, z)
    n = len(outline)
    faces = faces[: 2 * n]
    for i, j, k in ((0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)):
        faces += [(i, k, j), (n + i, n + j, n + k)]
    return corners, faces


def ring(a, b, z):
    """A square ring, a torus by its shape: outer half side a, inner half side b."""
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    corners = [(s * x, s * y, h) for h in (-z, z) for s in (a, b) for x, y in square]
    faces = []
    for i in range(4):
        j = (i + 1) % 4
        faces += [(i, j, 8 + i), (j, 8 + j, 8 + i)]
        faces += [(4 + i, 12 + i, 4 + j), (4 + j, 12 + i, 12 + j)]
        faces += [(8 + i, 8 + j, 12 + i), (8 + j, 12 + j, 12 + i)]
        faces += [(i, 4 + i, j), (j, 4 + i, 4 + j)]
    return corners, faces


def ball(radius, depth):
    """An octahedron whose faces are cut into four, depth times, with corners rounded towards the centre: 8 * 4^depth triangles."""
    corners, faces = octahedron(radius, radius, radius)
    for _ in range(depth):
        known, cut = {}, []

        def middle(i, j):
            key = min(i, j), max(i, j)
            if key not in known:
                v = [x + y for x, y in zip(corners[i], corners[j])]
                size = sum(x * x for x in v)
                # The root of x^2 r^2 / size, rounded down, with the sign of x.
                known[key] = len(corners)
                corners.append(tuple((1 if x >= 0 else -1) * isqrt(x * x * radius * radius // size) for x in v))
            return known[key]

        for i, j, k in faces:
            a, b, c = middle(i, j), middle(j, k), middle(k, i)
            cut += [(i, a, c), (a, j, b), (c, b, k), (a, b, c)]
        faces = cut
    return corners, faces


def terrain(cells, step, height, seed):
    """A field of random heights, which is open at its sides: 2 * cells^2 triangles."""
    random, n = Random(seed), cells + 1
    corners = [((2 * x - cells) * step, (2 * y - cells) * step, random.between(-height, height)) for y in range(n) for x in range(n)]
    faces = []
    for y in range(cells):
        for x in range(cells):
            i = y * n + x
            faces += [(i, i + 1, i + n), (i + 1, i + n + 1, i + n)]
    return corners, faces


def soup(count, reach, size, seed):
    """Random triangles that do not belong together, with corners in a cube."""
    random, corners = Random(seed), []
    for _ in range(count):
        centre = [random.between(-reach, reach) for _ in range(3)]
        corners += [tuple(c + random.between(-size, size) for c in centre) for _ in range(3)]
    return corners, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(count)]


def mesh(corners, triangles):
    """Corners and triangles as they are: for meshes of a few triangles."""
    return [tuple(p) for p in corners], [tuple(t) for t in triangles]


def turned_over(maker, *arguments):
    """Another mesh inside out."""
    corners, faces = MAKERS[maker](*arguments)
    return corners, [(i, k, j) for i, j, k in faces]


def without(count, maker, *arguments):
    """Another mesh without its last triangles, so that it does not close."""
    corners, faces = MAKERS[maker](*arguments)
    return corners, faces[:-count]


def twice(maker, *arguments):
    """Another mesh with each triangle twice."""
    corners, faces = MAKERS[maker](*arguments)
    return corners, faces + faces


MAKERS = {f.__name__: f for f in (box, boxes, group, tetrahedron, octahedron, prism, ell, ring, ball, terrain, soup, mesh, turned_over, without, twice)}


def make(maker, arguments, scale=1, shift=(0, 0, 0)):
    """Returns exact fractions: corner * scale + shift, and triangles."""
    corners, faces = MAKERS[maker](*arguments)
    scale, shift = fraction(scale), [fraction(x) for x in shift]
    return [tuple(x * scale + s for x, s in zip(p, shift)) for p in corners], faces


def content_hash(vertices, triangles):
    """Returns the hash that names the content of a mesh: of its numbers as text, one corner or triangle per line."""
    text = "".join(" ".join(p) + "\n" for p in vertices) + "".join(" ".join(map(str, t)) + "\n" for t in triangles)
    return hashlib.sha256(text.encode()).hexdigest()


def load(record):
    """Returns the corners of a record of `cases/meshes.jsonl` as hex floats, and its triangles. The hash must be right."""
    if "make" in record:
        points, triangles = make(record["make"], record["arguments"], record.get("scale", 1), record.get("shift", (0, 0, 0)))
        vertices = [[to_hex(float(x)) for x in p] for p in points]
    else:
        vertices, triangles = record["vertices"], record["triangles"]
    if content_hash(vertices, triangles) != record["sha256"]:
        raise ValueError(f"mesh {record['mesh']}: expected the content with the hash {record['sha256']}")
    return vertices, triangles
