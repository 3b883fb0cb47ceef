"""Pairs of meshes with coordinates as people and programs write them, which single precision does not hold.

A pair is arranged on small integers. Then each axis is stretched and moved, and each coordinate becomes the float that a reader makes of its
text. Equal integers become equal floats, so that a shared face, edge or corner stays shared. A gap or an overlap moves the corners of B
that are in contact, in floats, by a part of the size or, where that is too fine, to the next float.

B is stored turned back by a quarter turn, which its pose undoes: that only exchanges and negates numbers, so it rounds nothing.
"""

import struct
from fractions import Fraction
from math import inf, nextafter, ulp

import exact
import meshes
from truth import cross, dot, sub

COUNT = 68
# Sizes of the meshes, about, that lie between them and the origin.
FAR = [0, *(10**i for i in range(7))]
# Parts of the size by which meshes miss or overlap; None for the next float.
PARTS = [None, *(Fraction(1, 10**i) for i in range(7, 17))]
# A shape reaches about so many grid units from its middle.
REACH = 12


# How numbers are written and read back


def after_the_point(digits):
    return lambda x: float(Fraction(round(x * 10**digits), 10**digits))


def significant(x):
    """Six significant digits: `%g` of C."""
    return float(f"{float(x):g}")


def single(x):
    """An `f32` that is printed with nine significant digits: read back as an `f64`, it is another number."""
    (rounded,) = struct.unpack("<f", struct.pack("<f", float(x)))
    return float(f"{rounded:.9g}")


# Name, function, and the greatest distance from the origin, in sizes, at which neighbours on the grid stay apart.
WRITINGS = [
    ("with 3 digits after the point", after_the_point(3), 10**6),
    ("with 17 significant digits", float, 10**6),
    ("as %g has them", significant, 10**2),
    ("with 6 digits after the point", after_the_point(6), 10**6),
    ("that were f32, printed with 9 digits", single, 10**4),
    ("with 15 digits after the point", after_the_point(15), 10**6),
    ("with 4 digits after the point", after_the_point(4), 10**6),
    ("with 9 digits after the point", after_the_point(9), 10**6),
    ("with 12 digits after the point", after_the_point(12), 10**6),
    ("with 3 digits after the point, and noise of 1e-17 where they are 0", None, 0),
]


def axes(random, far):
    """Returns the middle and the step of each axis. From 10 sizes on, a mesh stays between two powers of two, so that short ways round nothing."""
    found = []
    for _ in range(3):
        step = Fraction(random.between(5 * 10**14, 15 * 10**14), 10**16)
        power = 2 ** (far * 2 * REACH // 10).bit_length() // 2
        middle = random.pick((1, -1)) * power * Fraction(random.between(14 * 10**15, 16 * 10**15), 10**16) if far else Fraction(0)
        found.append((middle, step))
    return found


# Arrangements on integers: A, B, and for each corner of B the direction in which it leaves A, or 0 for those that are not in contact


def leaving(points, is_in_contact, way):
    return [way if is_in_contact(p) else (0, 0, 0) for p in points]


def beside(random, along, part):
    """Two boxes with a face, an edge or a corner in common: B follows A along one, two or three axes."""
    half_a = [random.between(3, 6) for _ in range(3)]
    half_b = [random.between(1, h - 1) if part and i >= along else random.between(2, 5) if i < along else h for i, h in enumerate(half_a)]
    centre = [x + y if i < along else random.between(y - x, x - y) if part else 0 for i, (x, y) in enumerate(zip(half_a, half_b))]
    b = meshes.box(*half_b, *centre)
    return meshes.box(*half_a), b, leaving(b[0], lambda p: p[0] == half_a[0], (1, 0, 0))


def face(random):
    return beside(random, 1, False)


def part_of_a_face(random):
    return beside(random, 1, True)


def edge(random):
    return beside(random, 2, True)


def corner(random):
    return beside(random, 3, False)


def lining(random):
    """A box in a box, with part of a face in common."""
    half_a, half_b = [random.between(4, 6) for _ in range(3)], [random.between(1, 3) for _ in range(3)]
    b = meshes.box(*half_b, half_a[0] - half_b[0], 0, 0)
    return meshes.box(*half_a), b, leaving(b[0], lambda p: p[0] == half_a[0], (-1, 0, 0))


def sign(x):
    return (x > 0) - (x < 0)


def hole(random):
    """A box that fills the hole of a ring."""
    inner = random.between(3, 6)
    b = meshes.box(inner, inner, random.between(1, 4))
    return meshes.ring(inner + random.between(1, 4), inner, 2), b, [(-sign(p[0]), -sign(p[1]), 0) for p in b[0]]


def notch(random):
    """A box in the notch of an L, along two faces of it."""
    half = random.between(2, 3)
    b = meshes.box(half, half, random.between(1, 3), half - 1, half - 1, 0)
    return meshes.ell(6, -1, 2), b, [(int(p[0] == -1), int(p[1] == -1), 0) for p in b[0]]


def slot(random):
    """A plate between two boxes."""
    half = random.between(1, 3)
    a = meshes.boxes([2, 4, 5, -half - 2, 0, 0], [2, 5, 4, half + 2, 0, 0])
    b = meshes.box(half, 3, random.between(2, 7))
    return a, b, [(-sign(p[0]), 0, 0) for p in b[0]]


def slope(random):
    """Two wedges with a slanted side in common."""
    x, y, z = (random.between(3, 6) for _ in range(3))
    b = meshes.prism([[x, -y], [x, y], [-x, y]], z)
    return meshes.prism([[-x, -y], [x, -y], [-x, y]], z), b, leaving(b[0], lambda p: p[0] + p[1] < x + y, (1, 0, 0))


def tetrahedron_of(corners):
    """A tetrahedron of four corners in any order that do not lie in a plane."""
    p, q, r, s = corners
    if dot(cross(sub(q, p), sub(r, p)), sub(s, p)) > 0:
        q, r = r, q
    return [p, q, r, s], [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]


def tetrahedra(random, common):
    """Two tetrahedra on both sides of a plane, with so many corners in common, which lie in it."""
    while True:
        plane = [tuple(random.between(-6, 6) for _ in range(3)) for _ in range(3)]
        n = cross(sub(plane[1], plane[0]), sub(plane[2], plane[0]))
        corners = {-1: plane[:common], 1: plane[:common]}
        for side, of in corners.items():
            while 0 not in n and len(of) < 4:
                p = tuple(random.between(-9, 9) for _ in range(3))
                if side * dot(n, sub(p, plane[0])) > 0:
                    of.append(p)
        if 0 not in n and all(dot(cross(sub(q, p), sub(r, p)), sub(s, p)) for p, q, r, s in corners.values()):
            break
    b = tetrahedron_of(corners[1])
    return tetrahedron_of(corners[-1]), b, leaving(b[0], lambda p: p in plane[:common], (sign(n[0]), 0, 0))


def slanted_face(random):
    return tetrahedra(random, 3)


def slanted_edge(random):
    return tetrahedra(random, 2)


def tip(random):
    return tetrahedra(random, 1)


def resting(random):
    """A tetrahedron with its tip in a face of a box."""
    half = [random.between(3, 6) for _ in range(3)]
    top = half[0], random.between(1 - half[1], half[1] - 1), random.between(1 - half[2], half[2] - 1)
    b = tetrahedron_of([top, (half[0] + 5, 4, -3), (half[0] + 6, -4, -2), (half[0] + 4, 1, 5)])
    return meshes.box(*half), b, leaving(b[0], lambda p: p == top, (1, 0, 0))


def leaning(random):
    """A tetrahedron with its tip in a slanted side of a wedge, as near as the written numbers allow."""
    k = random.between(-2, 2)
    b = tetrahedron_of([(k, -k, random.between(-2, 2)), (7, 5, -3), (5, 8, -2), (6, 6, 5)])
    return meshes.prism([[-4, -4], [4, -4], [-4, 4]], 3), b, leaving(b[0], lambda p: p[0] + p[1] == 0, (1, 1, 0))


def same(random):
    """A mesh twice at the same place."""
    a = meshes.octahedron(*(random.between(3, 8) for _ in range(3)))
    return a, a, [(sign(p[0]), 0, 0) for p in a[0]]


def sheet(random):
    """Two triangles that lie on a face of a box."""
    half = [random.between(3, 6) for _ in range(3)]
    b = [(half[0], y, z) for z in (-2, 3) for y in (-1, 7)], [(0, 1, 3), (0, 3, 2)]
    return meshes.box(*half), b, leaving(b[0], lambda p: True, (1, 0, 0))


def triangles(random):
    """Two triangles with one corner in common."""
    p = tuple(random.between(-3, 3) for _ in range(3))
    a = [p, (-9, -2, random.between(-4, 4)), (-7, 6, -1)], [(0, 1, 2)]
    b = [(9, 3, random.between(-4, 4)), p, (8, -5, 2)], [(0, 1, 2)]
    return a, b, leaving(b[0], lambda q: q == p, (1, 0, 0))


def apart(random):
    """Two octahedra that are apart."""
    a, b = (meshes.octahedron(*(random.between(2, 4) for _ in range(3))) for _ in range(2))
    away = random.between(9, 11), random.between(-4, 4), random.between(-4, 4)
    return a, ([tuple(x + s for x, s in zip(p, away)) for p in b[0]], b[1]), [(1, 0, 0)] * 6


ARRANGEMENTS = [
    (face, "a face in common"),
    (slanted_face, "a slanted face in common"),
    (part_of_a_face, "part of a face in common"),
    (hole, "a box in the hole of a ring"),
    (edge, "part of an edge in common"),
    (slope, "slanted sides in common"),
    (corner, "a corner in common"),
    (tip, "tips in common"),
    (slot, "a plate between two boxes"),
    (resting, "a tip on a face"),
    (lining, "a box in a box, at a face of it"),
    (slanted_edge, "a slanted edge in common"),
    (notch, "a box in a notch"),
    (leaning, "a tip on a slanted side, as near as the numbers allow"),
    (same, "the same mesh"),
    (sheet, "a sheet on a face"),
    (triangles, "triangles with a corner in common"),
    (apart, "octahedra that are apart"),
]


class Pair:
    """Two meshes at the pose that arranges them, and where they are in contact."""

    def __init__(self, number, turns):
        random = meshes.Random(20_000 + number)
        self.number, (arrange, self.shares) = number, ARRANGEMENTS[number % len(ARRANGEMENTS)]
        lap = number // len(ARRANGEMENTS)
        writing, self.read, most = WRITINGS[(number + 3 * lap) % len(WRITINGS)]
        self.is_noisy = self.read is None
        far = 0 if self.is_noisy else min(FAR[random.below(len(FAR))], most)
        (a, faces_a), (b, faces_b), ways = arrange(random)
        if self.is_noisy:
            # Noise is left of numbers that are 0, so the corners in contact go there.
            zero = next(p for p, way in zip(b, ways) if any(way))
            a, b = ([sub(p, zero) for p in of] for of in (a, b))
        spin = random.pick(turns)
        a, b, ways = ([turned(spin, p) for p in of] for of in (a, b, ways))
        frame = axes(random, far)
        a, b = ([self.written(random, frame, p) for p in of] for of in (a, b))
        self.size = max(max(x) - min(x) for x in zip(*a))
        # In contact, moved apart or moved together.
        change = self.change = (0, 1, -1)[(lap + number % len(ARRANGEMENTS)) % 3]
        part = random.pick(PARTS)
        b = [tuple(nudged(x, change * w, part, self.size) for x, w in zip(p, way)) for p, way in zip(b, ways)]
        what = "" if not change else (", moved apart" if change > 0 else ", moved together") + (f" by {float(part):g} of the size or to the next float" if part else " to the next float")
        where = "at the origin" if not far else f"about {far:,} sizes from the origin" if far > 1 else "next to the origin"
        self.reason = f"{self.shares}{what}; numbers {writing}, {where}"
        self.way = next(way for way in ways if any(way))
        self.turn = turns[0] if number % 3 == 0 else random.pick(turns)
        self.a, self.b = (a, faces_a), ([turned(transposed(self.turn), p) for p in b], faces_b)
        self.both = meshes.together((a, faces_a), (b, faces_b))
        self.at_b = b

    def name(self, of):
        return f"decimal-{self.number:02}-{of}"

    def written(self, random, frame, point):
        if self.is_noisy:
            return tuple(float(Fraction(random.between(-9, 9), 10**17)) if x == 0 else float(Fraction(round(x * step * 1000), 1000)) for x, (_, step) in zip(point, frame))
        return tuple(self.read(middle + x * step) for x, (middle, step) in zip(point, frame))

    def shifts(self):
        """Returns translations along the direction that leaves A: none, the finest that place all corners exactly, and one by a quarter of the size."""
        finest = [ulp(max(abs(p[i]) for p in self.at_b)) * w for i, w in enumerate(self.way)]
        unit = 2.0 ** int(self.size).bit_length() / 4
        found = [(0.0, 0.0, 0.0), tuple(finest), tuple(-x for x in finest), tuple(unit * w for w in self.way)]
        return [v for v in found if self.is_exact(v)]

    def is_exact(self, shift):
        return exact.placement(self.fractions_of_b(), self.pose(shift)) is not None

    def fractions_of_b(self):
        return [tuple(map(Fraction, p)) for p in self.b[0]]

    def pose(self, shift):
        return [Fraction(v) for i in range(3) for v in (*self.turn[3 * i : 3 * i + 3], shift[i])]

    def motions(self):
        """Returns pairs of shifts between which B moves: towards A up to contact, to the next float before or behind it, and along A."""
        finest = tuple(ulp(max(abs(p[i]) for p in self.at_b)) * w for i, w in enumerate(self.way))
        long = 2.0 ** int(self.size).bit_length()
        axis = next(i for i, w in enumerate(self.way) if w)
        away = tuple(long * w for w in self.way)
        aside = tuple(long * (i == (axis + 1) % 3) for i in range(3))
        none, back = (0.0, 0.0, 0.0), tuple(-x for x in finest)

        def plus(v, w):
            return tuple(x + y for x, y in zip(v, w))

        found = [(away, none), (away, finest), (away, back), (plus(aside, finest), plus(tuple(-x for x in aside), finest)), (aside, none)]
        return [(v, w) for v, w in found if self.is_exact(v) and self.is_exact(w)]

    def points(self):
        """Returns points on A, next to it and around it."""
        random, (corners, faces) = meshes.Random(30_000 + self.number), self.a
        low, high = ([f(x) for x in zip(*corners)] for f in (min, max))
        found = []
        for _ in range(4):
            p, q, r = (corners[i] for i in random.pick(faces))
            middle = tuple(float((Fraction(x) + Fraction(y)) / 2) for x, y in zip(p, q))
            inner = tuple(float((Fraction(x) + Fraction(y) + 2 * Fraction(z)) / 4) for x, y, z in zip(p, q, r))
            # Across the triangle: along the axis that is nearest to its normal.
            normal = cross(sub(q, p), sub(r, p))
            axis, part = max(range(3), key=lambda i: abs(normal[i])), random.pick(PARTS)
            found += [p, middle, inner, replaced(inner, axis, nudged(inner[axis], random.pick((1, -1)), part, self.size))]
        for _ in range(3):
            found.append(tuple(float(Fraction(l) + (Fraction(h) - Fraction(l)) * random.between(-3, 13) / 10) for l, h in zip(low, high)))
        return list(dict.fromkeys(found))

    def lines(self):
        """Returns origins, directions and targets: lines along an axis that meet a corner, an edge or a face or miss it by a float, and others."""
        random, found = meshes.Random(40_000 + self.number), []
        for target in self.points()[:8]:
            axis, side = random.below(3), random.pick((1.0, -1.0))
            unit = 2.0 ** int(self.size).bit_length()
            origin = replaced(target, axis, target[axis] - side * unit)
            found.append((origin, tuple(side * (i == axis) for i in range(3)), target))
            origin = tuple(x + random.between(-3, 3) * unit / 4 for x in target)
            if origin != target:
                found.append((origin, tuple(x - y for x, y in zip(target, origin)), target))
        return found


def replaced(point, axis, value):
    return tuple(value if i == axis else x for i, x in enumerate(point))


def turned(rows, point):
    return tuple(sum(r * x for r, x in zip(rows[i : i + 3], point) if r) for i in (0, 3, 6))


def transposed(rows):
    return tuple(rows[3 * j + i] for i in range(3) for j in range(3))


def nudged(x, way, part, size):
    """Moves a number by a part of the size, or to the next float where the part is None or too fine."""
    if not way:
        return x
    moved = float(Fraction(x) + way * part * Fraction(size)) if part else x
    return moved if moved != x else nextafter(x, way * inf)
