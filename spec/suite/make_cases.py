"""Makes `cases/*.jsonl`: chooses meshes, poses and points, and states the truth that the first way gives. `check.py` proves it again.

    python make_cases.py [--jobs N] [--files NAMES]

Everything comes from seeds and integers, so that the same files come out on every machine.
"""

import argparse
import json
from fractions import Fraction
from functools import lru_cache
from math import nextafter
from multiprocessing import Pool
from pathlib import Path

import decimals
import exact
import meshes
import prove
import second
import truth
from exact import to_hex

CASES = Path(__file__).parent / "cases"

# Name, maker, arguments, and what else `meshes.make` takes. Radii are below 256, so that poses turned on a grid of 2^-40 are exact.
CLOSED = {
    "box": ("box", (60, 40, 30)),
    "plate": ("box", (100, 80, 1)),
    "bar": ("box", (120, 6, 5)),
    "tetrahedron": ("tetrahedron", (50,)),
    "octahedron": ("octahedron", (70, 50, 40)),
    "wedge": ("prism", ([[-40, -30], [60, -30], [-40, 50]], 35)),
    "ell": ("ell", (60, -10, 25)),
    "ring": ("ring", (80, 50, 20)),
    "needle": ("octahedron", (2, 3, 200)),
    "ball-32": ("ball", (90, 1)),
    "ball-128": ("ball", (100, 2)),
    "ball-512": ("ball", (250, 3)),
    "two-boxes": ("boxes", ([30, 30, 30, -50, 0, 0], [20, 40, 25, 50, 10, 0])),
    "grain": ("tetrahedron", (3,)),
}
OTHERS = {
    "terrain-128": ("terrain", (8, 16, 40, 11)),
    "terrain-512": ("terrain", (16, 8, 30, 12)),
    "soup-40": ("soup", (40, 80, 40, 13)),
    "soup-200": ("soup", (200, 100, 15, 14)),
    "open-box": ("without", (2, "box", 60, 40, 30)),
    "open-ball": ("without", (16, "ball", 100, 2)),
    "inside-out": ("turned_over", ("ring", 80, 50, 20)),
    "box-twice": ("twice", ("box", 60, 40, 30)),
    "triangle": ("mesh", ([[0, 0, 0], [64, 0, 0], [0, 64, 0]], [[0, 1, 2]])),
    "overlapping-boxes": ("boxes", ([40, 40, 40, -10, 0, 0], [40, 30, 30, 20, 10, 5])),
    "touching-boxes": ("boxes", ([40, 40, 40, 0, 0, 0], [20, 20, 20, 60, 0, 0])),
    "nested-boxes": ("boxes", ([90, 90, 90, 0, 0, 0], [60, 60, 60, 5, 5, 5])),
}
DEGENERATE = {
    "point": ("mesh", ([[3, 4, 5]], [[0, 0, 0]])),
    "segment": ("mesh", ([[-40, 0, 0], [0, 0, 0], [40, 0, 0]], [[1, 0, 2]])),
    "folded-segment": ("mesh", ([[-40, -40, -40], [40, 40, 40]], [[0, 1, 1]])),
    "points": ("mesh", ([[x, y, z] for x in (-8, 0, 8) for y in (-8, 0, 8) for z in (-8, 0, 8)], [[i, i, i] for i in range(27)])),
    "box-and-lines": ("mesh", ([[-50, 0, 0], [50, 0, 0], [0, 50, 0], [0, -50, 0]], [[0, 1, 2], [0, 1, 1], [2, 3, 3], [0, 3, 1]])),
}
# The factors are exact in single precision, and so are all coordinates.
SCALED = {
    "huge-box": ("box", (60, 40, 30), Fraction(2) ** 90),
    "huge-ball": ("ball", (90, 1), Fraction(2) ** 90),
    "tiny-box": ("box", (60, 40, 30), Fraction(1, 2**90)),
    "tiny-ball": ("ball", (90, 1), Fraction(1, 2**90)),
    "far-box": ("box", (60, 40, 30), 1, (2**20, -(2**20), 2**20)),
    "far-ball": ("ball", (90, 1), 1, (2**20, -(2**20), 2**20)),
    "fine-box": ("box", (60, 40, 30), Fraction(2**40 + 1, 2**40)),
    "fine-ball": ("ball", (90, 1), Fraction(2**40 + 1, 2**40)),
}
SLIVERS = {
    "sliver": ("mesh", ([[-(2**20), 0, 0], [2**20, 0, 0], [0, 1, 0]], [[0, 1, 2]]), Fraction(1, 2**14)),
    "sliver-fan": ("mesh", ([[0, 0, 0]] + [[2**20, i, i * i] for i in range(8)], [[0, i, i + 1] for i in range(1, 8)]), Fraction(1, 2**14)),
}
# Meshes of several convex parts that do not touch each other.
GROUPS = {
    "comb": ("boxes", [[3, 40, 30, x, 0, 0] for x in (-52, -26, 0, 26, 52)]),
    "posts": ("boxes", [[9, 11, 60, x, y, 0] for x in (-32, 32) for y in (-30, 30)]),
    "corner": ("boxes", [[4, 60, 60, -64, 4, 4], [56, 4, 60, 0, -64, 4], [56, 56, 4, 0, 0, -64]]),
    "crowd": ("group", ([[-70, 0, 0], "octahedron", [50, 40, 30]], [[60, 5, -10], "tetrahedron", [45]], [[0, 80, 15], "prism", [[[-40, -30], [60, -30], [-40, 50]], 35]])),
    "beads": ("group", [[[x, x // 8, -x // 4], "octahedron", [22, 26, 24]] for x in (-96, -48, 0, 48, 96)]),
}
BROKEN = {
    "nan-corner": ([["nan", "0x0p+0", "0x0p+0"], ["0x1p+0", "0x0p+0", "0x0p+0"], ["0x0p+0", "0x1p+0", "0x0p+0"]], [[0, 1, 2]]),
    "infinite-corner": ([["0x0p+0", "-inf", "0x0p+0"], ["0x1p+0", "0x0p+0", "0x0p+0"], ["0x0p+0", "0x1p+0", "0x0p+0"]], [[0, 1, 2]]),
    "index-beyond": ([["0x0p+0", "0x0p+0", "0x0p+0"], ["0x1p+0", "0x0p+0", "0x0p+0"], ["0x0p+0", "0x1p+0", "0x0p+0"]], [[0, 1, 3]]),
}
# Meshes up to this number of triangles are written out.
MAX_INLINE = 40


def quarter_turns():
    """Returns the 24 rotations of a cube, as rows of matrices."""
    found = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for signs in range(8):
            rows = [[(1 - 2 * (signs >> i & 1)) if j == order[i] else 0 for j in range(3)] for i in range(3)]
            if truth.dot(rows[0], truth.cross(rows[1], rows[2])) == 1:
                found.append(tuple(x for row in rows for x in row))
    return found


QUARTER_TURNS = quarter_turns()
IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1)
PAIRS = [decimals.Pair(number, [IDENTITY, *(turn for turn in QUARTER_TURNS if turn != IDENTITY)]) for number in range(decimals.COUNT)]
# The numbers of the pairs that are also one mesh, for questions about itself, and of those whose A is asked about points and lines.
SELF, PROBED = range(0, decimals.COUNT, 5), range(0, decimals.COUNT, 4)


def kept(file):
    """Returns the lines of a file of cases as they are."""
    return [json.loads(line) for line in (CASES / file).read_text(encoding="utf-8").splitlines()]


def mesh_records():
    """Returns the lines of `meshes.jsonl` by name. Meshes of hard pairs come from no rule, and are kept."""
    records = {}
    for name, (maker, arguments, *rest) in {**CLOSED, **OTHERS, **DEGENERATE, **SCALED, **SLIVERS, **GROUPS}.items():
        points, triangles = meshes.make(maker, arguments, *rest)
        vertices = [[to_hex(float(x)) for x in p] for p in points]
        assert all(Fraction(float(x)) == x for p in points for x in p), name
        record = {"mesh": name, "triangle_count": len(triangles)}
        if len(triangles) <= MAX_INLINE:
            record |= {"vertices": vertices, "triangles": [list(t) for t in triangles]}
        else:
            record |= {"make": maker, "arguments": list(arguments)}
            record |= {k: v for k, v in zip(("scale", "shift"), [str(rest[0])] + [list(x) for x in rest[1:]] if rest else [])}
        records[name] = record | {"sha256": meshes.content_hash(vertices, triangles)}
    for name, (vertices, triangles) in {**BROKEN, "empty": ([], [])}.items():
        record = {"mesh": name, "triangle_count": len(triangles), "vertices": vertices, "triangles": triangles}
        records[name] = record | {"sha256": meshes.content_hash(vertices, triangles)}
    records |= {record["mesh"]: record for record in kept("meshes.jsonl") if record["mesh"].startswith("hard-")}
    for pair in PAIRS:
        made = {"a": pair.a, "b": pair.b} | ({"both": pair.both} if pair.number in SELF else {})
        for of, (points, triangles) in made.items():
            vertices, triangles = [[to_hex(x) for x in p] for p in points], [list(t) for t in triangles]
            record = {"mesh": pair.name(of), "triangle_count": len(triangles), "vertices": vertices, "triangles": triangles}
            records[record["mesh"]] = record | {"sha256": meshes.content_hash(vertices, triangles)}
    return records


RECORDS = mesh_records()
MESHES = {name: meshes.load(record) for name, record in RECORDS.items()}
def turn(quaternion):
    """Returns the rotation of an integer quaternion with each entry rounded to a multiple of 2^-40."""
    w, x, y, z = quaternion
    size = w * w + x * x + y * y + z * z
    rows = (
        w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z,
    )  # fmt: skip
    return tuple(Fraction((2 * v * 2**40 + size) // (2 * size), 2**40) for v in rows)


def random_turn(random):
    while True:
        q = [random.between(-9, 9) for _ in range(4)]
        if sum(x != 0 for x in q) >= 3:
            return turn(q)


def pose_of(rotation, translation):
    """Returns the 12 numbers of a pose as hex floats."""
    numbers = [v for i in range(3) for v in (*rotation[3 * i : 3 * i + 3], translation[i])]
    assert all(Fraction(float(v)) == v for v in numbers)
    return [to_hex(float(v)) for v in numbers]


def corners(name):
    return prove.corners_of(MESHES[name])


def reach(name):
    return max(abs(x) for p in corners(name) for x in p)


def direction(random):
    while True:
        d = tuple(random.between(-3, 3) for _ in range(3))
        if d != truth.ZERO:
            return d


def boundary_poses(random, a, b, rotation, bits, count):
    """Returns poses of b that come from outside along a direction: the last one apart and the first one that touches, on a grid
    of 2^-bits times the direction.

    The exact time of the first contact tells between which two grid points they are.
    """
    found = []
    while len(found) < 2 * count:
        d = direction(random)
        far = 8 * int(reach(a) + reach(b) + 1)
        aside = tuple(random.between(-12, 12) for _ in range(3))
        start = tuple(Fraction(s + far * x) for s, x in zip(aside, d))
        turned = prove.placed(corners(b), [Fraction(v) for i in range(3) for v in (*rotation[3 * i : 3 * i + 3], start[i])])
        (on_a, on_b, (v,)), _ = exact.to_grid(corners(a), turned, [tuple(-far * x for x in d)])
        at = truth.motion(prove.gather(on_a, MESHES[a][1]), prove.gather(on_b, MESHES[b][1]), v)
        if at is None or at == 0:
            continue
        step = far * (1 - at) * 2**bits
        touching = step.numerator // step.denominator
        for k in (touching, touching + 1):
            where = [s + Fraction(k, 2**bits) * x for s, x in zip(aside, d)]
            found.append(pose_of(rotation, where))
    return found


def needs(case):
    """Returns what a runner has to claim before it is asked: precisions of coordinates and of placed corners, and features."""
    names = [case[k] for k in ("a", "b") if k in case]
    finite = [x for name in names for p in MESHES[name][0] for x in p if x not in exact.SPECIAL]
    coordinates = "f32" if all(exact.is_f32(exact.fraction(x)) for x in finite) else "f64"
    placement = "f32"
    for item in case["items"]:
        for key in ("pose", "start", "end"):
            if key in item and prove.rigid_fault(item[key]) is None and all(x not in exact.SPECIAL for p in MESHES[case["b"]][0] for x in p):
                found = exact.placement(corners(case["b"]), [exact.fraction(x) for x in item[key]])
                assert found, (case["id"], item)
                placement = max(placement, found)
        for key in ("point", "origin", "direction", "from", "to"):
            if key in item and prove.is_finite(item[key]) and not all(exact.is_f32(exact.fraction(x)) for x in item[key]):
                placement = "f64"
    features = set(case.pop("features")).union(*(kind(name) for name in names))
    if any(is_nested(case, item) for item in case["items"] if "pose" in item or "start" in item):
        features.add("nested")
    return {"coordinates": coordinates, "placement": placement, "features": sorted(features)}


@lru_cache(maxsize=None)
def kind(name):
    """Returns the features that a mesh needs: open, concave, or with parts that meet each other."""
    if prove.mesh_fault(MESHES[name]) or not MESHES[name][1]:
        return ()
    (points,), _ = exact.to_grid(corners(name))
    triangles = prove.gather(points, MESHES[name][1])
    if not truth.is_closed(triangles):
        return ("concave", "open")
    convex = all(truth.dot(truth.normal(t), truth.sub(p, t[0])) <= 0 for t in triangles for p in points)
    parts = truth.self_contacts(triangles)
    return (() if convex else ("concave",)) + (("overlapping parts",) if parts else ())


@lru_cache(maxsize=None)
def parts(name):
    """Returns the triangles of each connected part of a mesh, on a grid of its own."""
    (points,), _ = exact.to_grid(corners(name))
    return truth.components(prove.gather(points, MESHES[name][1]))


def has_depth(name):
    """Tells whether a mesh is closed and its connected parts are convex, as the proofs of depths demand."""
    of = parts(name)
    convex = all(truth.dot(truth.normal(t), truth.sub(p, t[0])) <= 0 for part in of for t in part for u in part for p in u)
    return convex and all(truth.is_closed(part) for part in of) and "overlapping parts" not in kind(name)


def is_nested(case, item):
    """Tells whether a part of a closed mesh is inside the other one and touches nothing, where a solid would answer otherwise."""
    if prove.fault(case, MESHES, item) or any("open" in kind(case[k]) or not MESHES[case[k]][1] for k in ("a", "b")):
        return False
    return placed_relation(case["a"], case["b"], tuple(item.get("pose") or item["start"])) not in ("apart", "touching")


@lru_cache(maxsize=1000)
def placed_relation(a, b, pose):
    triangles_a, triangles_b, _ = prove.scene({"a": a, "b": b}, MESHES, pose)
    return truth.relation(triangles_a, triangles_b)


PROOFS = {
    "collide": ["features", "shortest vector"],
    "contacts": ["features", "shortest vector"],
    "distance": ["features", "shortest vector"],
    "within": ["features", "shortest vector"],
    "relation": ["features and crossings", "shortest vector and solid angles"],
    "closest": ["features", "shortest vector"],
    "side": ["features and crossings", "shortest vector and solid angles"],
    "ray": ["features", "shortest vectors of segments"],
    "segment": ["features", "shortest vector"],
    "motion": ["events of corners and edges", "shortest vectors of swept hulls"],
    "penetration": ["overlaps along normals", "hull of differences"],
    "penetration of parts": ["planes of overlaps of parts", "hulls of differences that cover a ball"],
    "self_contacts": ["features", "shortest vector"],
    "refused": ["by definition", "by definition"],
}


def state(case):
    """Adds truths, proofs and needs to a case. Items of no use are left out; returns None if none is left."""
    items = []
    for item in case["items"]:
        item["truth"] = prove.first(case, MESHES, item)
        if case["ask"] == "contacts" and len(item["truth"]) > 60:
            continue
        if case["ask"] == "motion":
            if not item["truth"]["free"] and "exact" not in item["truth"]:
                continue
            if is_grazing(case, item):
                item["grazing"] = True
        items.append(item)
    case["items"] = items
    if not items:
        return None
    refused = items[0]["truth"] == "refused"
    has_parts = case["ask"] == "penetration" and any(len(parts(case[k])) > 1 for k in ("a", "b"))
    case["proof"] = PROOFS["refused" if refused else "penetration of parts" if has_parts else case["ask"]]
    case["needs"] = needs(case)
    return case


def is_grazing(case, item):
    """Tells whether a motion touches or misses by so little that a runner may call it undecided: by a hundred-thousandth of the size.

    A motion that hits is not grazing if the meshes still touch 2^-20 of the time later.
    """
    a, b, v, unit = prove.motion_scene(case, MESHES, item)
    found = item["truth"]
    if not found["free"]:
        at = Fraction(found["exact"])
        later = min(at + Fraction(1, 2**20), Fraction(1))
        scale = later.denominator
        a, b = ([tuple(tuple(x * scale for x in p) for p in t) for t in of] for of in (a, b))
        return truth.squared_distance(a, [truth.moved(u, tuple(x * later.numerator for x in v)) for u in b]) != 0
    size = max(x for t in a for p in t for x in map(abs, p))
    near = Fraction(size, 10**5) ** 2
    hulls = [(u + truth.moved(u, v), truth.swept_box(u, v)) for u in b]
    return any(truth.box_gap(truth.box(t), reach) < near and second.hulls_apart(t, hull) < near for t in a for hull, reach in hulls)


class Maker:
    """Collects cases before their truths are known."""

    def __init__(self):
        self.cases = {}

    def add(self, file, ask, names, items, reason, tags, level, features=()):
        cases = self.cases.setdefault(file, [])
        case = {"id": f"{file}/{len(cases):04}", "ask": ask, "a": names[0]}
        if len(names) > 1:
            case["b"] = names[1]
        case |= {"items": items, "reason": reason, "tags": list(tags), "level": level, "features": list(features)}
        cases.append(case)

    def pairs(self, file, names, poses, reason, tags, level, features=(), asks=("collide", "distance", "within", "contacts", "relation"), inside=()):
        """Adds a case for each question about the same poses."""
        for ask in asks:
            more = inside if ask == "relation" else ()
            if ask == "within":
                items = [{"pose": pose, "within": d} for pose in poses for d in thresholds(names, pose)]
            else:
                items = [{"pose": pose} for pose in poses]
            self.add(file, ask, names, items, reason, (*tags, ask), level, (*features, *more))


def thresholds(names, pose):
    """Returns lengths next to the distance: the greatest float below it and the least one that is not, or 0 and the least float."""
    stated = prove.first({"ask": "distance", "a": names[0], "b": names[1]}, MESHES, {"pose": pose})
    lower, upper = exact.from_hex(stated["lower"]), exact.from_hex(stated["upper"])
    return [to_hex(lower if lower < upper else nextafter(lower, 0.0)), to_hex(upper)] if upper else [to_hex(0.0)]


def make_pairs(maker):
    random, names = meshes.Random(100), list(CLOSED)
    pairs = [(x, y) for i, x in enumerate(names) for y in names[i:]]
    for a, b in pairs:
        if {a, b} == {"ball-512"} or random.below(2) == 0 and a != b:
            continue
        sum_of_reaches = int(reach(a) + reach(b))
        poses = []
        for _ in range(5):
            away = [random.between(-sum_of_reaches, sum_of_reaches) * random.pick((1, 2)) // 2 for _ in range(3)]
            poses.append(pose_of(random.pick(QUARTER_TURNS), away))
        maker.pairs("placed", (a, b), poses, "quarter turns and whole translations, from apart to overlapping", ("quarter",), 1)
        poses = boundary_poses(random, a, b, random.pick(QUARTER_TURNS), 0, 1) + boundary_poses(random, a, b, random.pick(QUARTER_TURNS), 10, 2)
        maker.pairs("boundary", (a, b), poses, "the last pose apart and the first that touches, on a grid of 1 or of 2^-10", ("quarter", "boundary"), 2)
        poses = boundary_poses(random, a, b, random.pick(QUARTER_TURNS), 28, 2)
        maker.pairs("boundary", (a, b), poses, "the last pose apart and the first that touches, on a grid of 2^-28", ("quarter", "boundary"), 2)
        poses = []
        for _ in range(3):
            away = [Fraction(random.between(-256 * sum_of_reaches, 256 * sum_of_reaches), 512) for _ in range(3)]
            poses.append(pose_of(random_turn(random), away))
        maker.pairs("turned", (a, b), poses, "turned about any axis, from apart to overlapping", ("turned",), 1)
        poses = boundary_poses(random, a, b, random_turn(random), 28, 2)
        maker.pairs("turned", (a, b), poses, "turned, the last pose apart and the first that touches, on a grid of 2^-28", ("turned", "boundary"), 2)


def make_nested(maker):
    random = meshes.Random(200)
    for a, b in (("ball-512", "box"), ("ball-512", "tetrahedron"), ("ball-512", "ring"), ("ring", "grain"), ("ell", "grain"), ("two-boxes", "grain"), ("nested-boxes", "box"), ("box", "grain")):
        spread = int(reach(a)) * 3 // 4
        poses = [pose_of(random.pick(QUARTER_TURNS), [random.between(-spread, spread) for _ in range(3)]) for _ in range(8)]
        poses.append(pose_of(IDENTITY, (0, 0, 0)))
        for names in ((a, b), (b, a)):
            maker.pairs("nested", names, poses, "a mesh within the reach of another, often inside it or in its hole", ("nested",), 1, ("nested",))


def make_surfaces(maker):
    random = meshes.Random(300)
    for a in OTHERS:
        for b in ("box", "ball-32", "triangle", "soup-40"):
            if b == a or {a, b} == {"soup-200", "soup-40"}:
                continue
            spread = int(reach(a) + reach(b))
            poses = [pose_of(random.pick(QUARTER_TURNS), [random.between(-spread, spread) for _ in range(3)]) for _ in range(4)]
            poses += boundary_poses(random, a, b, random.pick(QUARTER_TURNS), 10, 1)
            surface = ("collide", "distance", "within", "contacts")
            maker.pairs("surfaces", (a, b), poses, "surfaces that are open, overlap themselves or do not belong together", ("surface", a), 2, (), surface)
    for a in ("overlapping-boxes", "nested-boxes", "inside-out"):
        poses = [pose_of(IDENTITY, [random.between(-60, 60) for _ in range(3)]) for _ in range(8)]
        maker.pairs("surfaces", (a, "grain"), poses, "closed parts that overlap count as one solid, whichever way they face", ("nested", a), 2, ("nested", "overlapping parts"), ("relation",))


def make_hostile(maker):
    random = meshes.Random(400)
    surface = ("collide", "distance", "within", "contacts")
    others = ("triangle", "box", "ball-32", *DEGENERATE)
    for a in DEGENERATE:
        for b in others:
            spread = 48
            poses = [pose_of(random.pick(QUARTER_TURNS), [8 * random.between(-6, 6) for _ in range(3)]) for _ in range(5)]
            poses += boundary_poses(random, a, b, IDENTITY, 10, 1) if b in ("box", "ball-32") else []
            maker.pairs("hostile", (a, b), poses, "triangles without area: points and segments", ("degenerate",), 3, ("degenerate",), surface)
    for a in SLIVERS:
        for b in ("box", "triangle", "sliver", "ball-32"):
            poses = [pose_of(random.pick(QUARTER_TURNS), [random.between(-40, 40) for _ in range(3)]) for _ in range(4)]
            poses += boundary_poses(random, a, b, random.pick(QUARTER_TURNS), 14, 2)
            maker.pairs("hostile", (a, b), poses, "triangles two million times as long as wide", ("sliver",), 3, (), surface)
    for kind, scale, features in (("huge", Fraction(2) ** 90, ("range",)), ("tiny", Fraction(1, 2**90), ("range",)), ("far", 1, ()), ("fine", Fraction(2**40 + 1, 2**40), ())):
        for pair in ((f"{kind}-box", f"{kind}-ball"), (f"{kind}-box", f"{kind}-box")):
            turns = [IDENTITY] if kind == "far" else QUARTER_TURNS
            poses = [pose_of(random.pick(turns), [scale * random.between(-120, 120) for _ in range(3)]) for _ in range(6)]
            poses.append(pose_of(IDENTITY, (0, 0, 0)))
            poses.append(pose_of(IDENTITY, (120 * scale, 0, 0)))
            reason = {"huge": "coordinates near 2^96", "tiny": "coordinates near 2^-84", "far": "meshes far from the origin", "fine": "coordinates that single precision does not hold"}[kind]
            maker.pairs("hostile", pair, poses, reason, (kind,), 3, features)
    for a, b in (("box-twice", "box"), ("box-twice", "triangle"), ("box-twice", "box-twice")):
        poses = [pose_of(random.pick(QUARTER_TURNS), [random.between(-90, 90) for _ in range(3)]) for _ in range(6)]
        maker.pairs("hostile", (a, b), poses, "each triangle occurs twice, and each of both is in contact", ("duplicates",), 3, (), surface)
    for a, b in (("open-box", "grain"), ("open-ball", "grain"), ("terrain-128", "grain")):
        poses = [pose_of(IDENTITY, [random.between(-20, 20) for _ in range(3)]) for _ in range(4)]
        asks = ("collide", "distance", "contacts")
        maker.pairs("hostile", (a, b), poses, "a small mesh where the inside would be if the other one were closed", ("open",), 3, (), asks)
    for b in ("box", "triangle", "empty"):
        for names in (("empty", b), (b, "empty")):
            maker.add("hostile", "collide", names, [{"pose": pose_of(IDENTITY, (0, 0, 0))}], "a mesh without triangles touches nothing", ("empty",), 3, ("empty",))
            maker.add("hostile", "contacts", names, [{"pose": pose_of(IDENTITY, (0, 0, 0))}], "a mesh without triangles touches nothing", ("empty",), 3, ("empty",))


def make_refused(maker):
    pose = pose_of(IDENTITY, (1, 2, 3))
    for name in BROKEN:
        for ask in ("collide", "distance"):
            maker.add("refused", ask, (name, "box"), [{"pose": pose}], f"{name.replace('-', ' ')}: no mesh, so there is no answer", ("refused",), 3, ("refuses",))
            maker.add("refused", ask, ("box", name), [{"pose": pose}], f"{name.replace('-', ' ')}: no mesh, so there is no answer", ("refused",), 3, ("refuses",))
        maker.add("refused", "side", (name,), [{"point": [to_hex(0.0)] * 3}], "no mesh, so there is no answer", ("refused",), 3, ("refuses",))
    wrong = {
        "twice as large": pose_of((2, 0, 0, 0, 2, 0, 0, 0, 2), (0, 0, 0)),
        "longer along one axis": pose_of((Fraction(1001 * 2**20 // 1000, 2**20), 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 0)),
        "sheared": pose_of((1, Fraction(1, 64), 0, 0, 1, 0, 0, 0, 1), (0, 0, 0)),
        "a mirror": pose_of((-1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 0)),
        "a row of zeros": pose_of((1, 0, 0, 0, 1, 0, 0, 0, 0), (0, 0, 0)),
        "NaN in the rotation": ["nan", *pose[1:]],
        "infinity in the rotation": [*pose[:6], "inf", *pose[7:]],
        "NaN in the translation": [*pose[:3], "nan", *pose[4:]],
        "infinity in the translation": [*pose[:7], "-inf", *pose[8:]],
    }
    for what, found in wrong.items():
        for ask in ("collide", "distance", "contacts", "relation"):
            maker.add("refused", ask, ("box", "ball-32"), [{"pose": found}], f"the pose is not rigid: {what}", ("refused",), 3, ("refuses",))
    for ask in ("closest", "side"):
        for found in ("nan", "inf", "-inf"):
            maker.add("refused", ask, ("box",), [{"point": [to_hex(1.0), found, to_hex(0.0)]}], "the point is none", ("refused",), 3, ("refuses",))


def on_surface(random, name):
    """Returns a point of a triangle that is exactly on it: a corner, the middle of an edge, or a quarter of the sum of corners."""
    vertices, triangles = MESHES[name]
    t = random.pick(triangles)
    a, b, c = ([exact.fraction(x) for x in vertices[i]] for i in (t[random.below(3)], t[random.below(3)], t[random.below(3)]))
    return tuple((x + y + 2 * z) / 4 for x, y, z in zip(a, b, c))


def hexes(point):
    assert all(Fraction(float(x)) == x for x in point)
    return [to_hex(float(x)) for x in point]


def make_hard(maker):
    """Adds the pairs of small meshes that are in `hard.jsonl`: each was thought of by itself."""
    for case in kept("hard.jsonl"):
        if case["ask"] == "collide":
            features = sorted({"degenerate", "range"} & set(case["needs"]["features"]))
            poses = [item["pose"] for item in case["items"]]
            maker.pairs("hard", (case["a"], case["b"]), poses, case["reason"], case["tags"][:-1], 3, features, ("collide", "distance", "contacts"))


def make_probes(maker):
    random = meshes.Random(500)
    solids = [n for n in CLOSED] + ["inside-out", "overlapping-boxes", "nested-boxes"]
    for name in solids + ["terrain-128", "terrain-512", "soup-40", "open-box", "open-ball"]:
        spread = int(reach(name)) * 5 // 4 + 1
        tiny = Fraction(1, 2**28)
        anywhere = [tuple(random.between(-spread, spread) for _ in range(3)) for _ in range(20)]
        on = [on_surface(random, name) for _ in range(12)]
        beside = [tuple(x + tiny * random.between(-1, 1) for x in p) for p in on]
        open_mesh = name not in solids
        features = ("overlapping parts",) if name in ("overlapping-boxes", "nested-boxes") else ()
        groups = ((anywhere, "points on a grid around the mesh", 1), (on, "points on the surface, on its edges and on its corners", 2), (beside, "points at most 2^-28 beside the surface", 2))
        for points, reason, level in groups:
            items = [{"point": hexes(p)} for p in points]
            maker.add("probes", "closest", (name,), items, reason, ("closest",), level)
            wanted = ("open",) if open_mesh else features
            maker.add("probes", "side", (name,), [dict(i) for i in items], reason, ("side",), level, wanted)
        rays = [{"origin": hexes(o), "direction": hexes(direction(random))} for o in anywhere[:12]]
        maker.add("probes", "ray", (name,), rays, "rays from points around the mesh", ("ray",), 1)
        aimed = []
        for o, p in zip(anywhere, on):
            d = tuple(x - y for x, y in zip(p, o))
            if d != (0, 0, 0):
                aimed.append({"origin": hexes(o), "direction": hexes(d)})
        maker.add("probes", "ray", (name,), aimed, "rays that reach a point of the surface, an edge or a corner at 1, if nothing is before", ("ray", "boundary"), 2)
        segments = [{"from": hexes(p), "to": hexes(q)} for p, q in zip(anywhere, anywhere[10:])]
        maker.add("probes", "segment", (name,), segments, "segments between points around the mesh", ("segment",), 1)
        short = []
        for o, p in zip(anywhere, on):
            for parts in (2**20 - 1, 2**20, 2**20 + 1):
                q = tuple(x + Fraction(parts, 2**20) * (y - x) for x, y in zip(o, p))
                short.append({"from": hexes(o), "to": hexes(q)})
        maker.add("probes", "segment", (name,), short, "segments that end at the surface, a millionth before it or a millionth behind it", ("segment", "boundary"), 2)


def make_motions(maker):
    random = meshes.Random(600)
    names = ["box", "plate", "tetrahedron", "octahedron", "wedge", "ell", "ring", "ball-32", "ball-128", "terrain-128", "grain"]
    for i, a in enumerate(names):
        for b in names[i:]:
            if random.below(2) and a != b:
                continue
            spread = int(reach(a) + reach(b)) + 20
            items = []
            for _ in range(8):
                rotation = random.pick(QUARTER_TURNS)
                start, end = ([random.between(-spread, spread) for _ in range(3)] for _ in range(2))
                axis = random.below(3)
                start[axis], end[axis] = -spread, spread
                if random.below(4) == 0:
                    end[axis] = -spread // 2
                items.append({"start": pose_of(rotation, start), "end": pose_of(rotation, end)})
            maker.add("motions", "motion", (a, b), items, "translations past and into another mesh", ("motion",), 1)


def make_depths(maker):
    random = meshes.Random(700)
    solids = ["box", "tetrahedron", "octahedron", "wedge", "bar", "needle", "grain"]
    for i, a in enumerate(solids):
        for b in solids[i:]:
            rotation = random.pick(QUARTER_TURNS)
            spread = int(reach(a) + reach(b)) // 3
            poses = [pose_of(rotation, [random.between(-spread, spread) for _ in range(3)]) for _ in range(10)]
            maker.add("depths", "penetration", (a, b), [{"pose": p} for p in poses], "convex meshes, apart or overlapping", ("penetration",), 1)


def grazing_motion(random, a, b, rotation, normal, depth):
    """Returns a motion along a plane with this normal, whose first component that is not 0 is 1, which is deeper by `depth` than the one
    that only touches.

    At half time, the first corners along the normal meet, or are aside of each other, so that edges or faces do.
    """
    turned = prove.placed(corners(b), [Fraction(v) for i in range(3) for v in (*rotation[3 * i : 3 * i + 3], 0)])
    top = max(corners(a), key=lambda p: truth.dot(normal, p))
    bottom = min(turned, key=lambda p: truth.dot(normal, p))
    while (way := truth.cross(normal, direction(random))) == truth.ZERO:
        pass
    aside = random.pick((truth.ZERO, truth.cross(normal, direction(random))))
    lift = [-depth if i == next(i for i in range(3) if normal[i]) else 0 for i in range(3)]
    steps = int(reach(a) + reach(b)) // max(map(abs, way)) + 1
    middle = [x - y + s + d for x, y, s, d in zip(top, bottom, aside, lift)]
    return {key: pose_of(rotation, [m + sign * steps * w for m, w in zip(middle, way)]) for key, sign in (("start", -1), ("end", 1))}


def make_grazing(maker):
    random = meshes.Random(800)
    names = ["box", "tetrahedron", "octahedron", "wedge", "ell", "ring", "ball-32"]
    normals = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, -1), (1, 1, 1), (1, -1, 1)]
    little, tiny = Fraction(1, 2**12), Fraction(1, 2**28)
    for i, a in enumerate(names):
        for b in names[i:]:
            rotation = random.pick(QUARTER_TURNS)
            chosen = [random.pick(normals) for _ in range(4)]
            for depths, reason in (((0,), "motions that touch and never go in"), ((-little, tiny), "motions that miss by 2^-12, or go in by 2^-28")):
                items = [grazing_motion(random, a, b, rotation, n, depth) for n in chosen for depth in depths]
                maker.add("motions", "motion", (a, b), items, reason, ("motion", "grazing"), 2)
    for b, half in (("box", (60, 40, 30)), ("grain", (3, 3, 3))):
        # Through the hole of the ring, along a wall or two of it, which are 50 from the middle.
        items = []
        for turn in (IDENTITY, (0, 1, 0, 0, 0, 1, 1, 0, 0)):
            x, y, z = (sum(abs(turn[3 * i + j]) * half[j] for j in range(3)) for i in range(3))
            if x <= 50 and y <= 50:
                for room in (0, little, -tiny):
                    for at in ((50 - x - room, 0), (0, y - 50 + room), (50 - x - room, y - 50 + room)):
                        items.append({key: pose_of(turn, (*at, h * (z + 30))) for key, h in (("start", -1), ("end", 1))})
        maker.add("motions", "motion", ("ring", b), items, "motions through a hole, along its walls, 2^-12 beside them or 2^-28 into them", ("motion", "grazing"), 2)


def make_slides(maker):
    random, box = meshes.Random(1000), "box"
    items = [grazing_motion(random, box, box, IDENTITY, (1, 0, 0), -Fraction(1, 2**bits)) for bits in (16, 20, 28)]
    maker.add("motions", "motion", (box, box), items, "motions along a face, 2^-16 to 2^-28 beside it all the time", ("motion", "grazing"), 3)


def make_depths_of_parts(maker):
    random = meshes.Random(900)
    for a in GROUPS:
        for b in ("box", "octahedron", "wedge", "bar", "two-boxes", "tetrahedron"):
            spread = int(reach(a)) * 3 // 4
            poses = [pose_of(random.pick(QUARTER_TURNS), [random.between(-spread, spread) for _ in range(3)]) for _ in range(4)]
            reason = "meshes of several convex parts: what frees B from one part may move it into another"
            maker.add("depths", "penetration", (a, b), [{"pose": p} for p in poses], reason, ("penetration", "concave"), 2)


def make_self_contacts(maker):
    for name in (*CLOSED, *OTHERS):
        if name != "soup-200" and name != "ball-512":
            maker.add("self", "self_contacts", (name,), [{}], "pairs of triangles of one mesh that share more than their common corners", ("self",), 1)
    maker.add("self", "self_contacts", ("soup-200",), [{}], "pairs of triangles of one mesh that share more than their common corners", ("self",), 2)


def make_decimals(maker):
    for pair in PAIRS:
        names, writing = (pair.name("a"), pair.name("b")), ("decimals", "noise" if pair.is_noisy else "written")
        poses = [[to_hex(float(x)) for x in pair.pose(shift)] for shift in pair.shifts()]
        maker.pairs("decimals", names, poses, pair.reason, writing, 2)
        # The way out of a slot that a plate hardly overfills is far, and to prove that takes cubes as small as the overlap.
        is_jammed = pair.change < 0 and any(len(parts(name)) > 1 for name in names)
        if all(map(has_depth, names)) and not is_jammed:
            maker.add("decimals", "penetration", names, [{"pose": pose} for pose in poses], pair.reason, (*writing, "penetration"), 2)
        items = [{key: [to_hex(float(x)) for x in pair.pose(shift)] for key, shift in zip(("start", "end"), shifts)} for shifts in pair.motions()]
        if items:
            maker.add("decimals", "motion", names, items, pair.reason, (*writing, "motion"), 2)
        if pair.number in SELF:
            maker.add("decimals", "self_contacts", (pair.name("both"),), [{}], f"{pair.reason}, as one mesh", (*writing, "self"), 2)
        if pair.number in PROBED:
            for ask, items in probes_of(pair).items():
                maker.add("decimals", ask, names[:1], items, f"corners, edges and faces of mesh A: {pair.reason}", (*writing, ask), 2)


def probes_of(pair):
    """Returns questions about points and lines at the first mesh of a pair."""
    asked = {"closest": [{"point": hexes(p)} for p in pair.points()], "side": [{"point": hexes(p)} for p in pair.points()], "ray": [], "segment": []}
    for origin, direction, target in pair.lines():
        asked["ray"].append({"origin": hexes(origin), "direction": hexes(direction)})
        asked["segment"].append({"from": hexes(origin), "to": hexes(target)})
    return asked


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--files", default="", help="make only these files of cases, separated by commas, and the meshes")
    arguments = parser.parse_args()
    jobs, files = arguments.jobs, set(filter(None, arguments.files.split(",")))
    maker = Maker()
    for make in (make_pairs, make_nested, make_surfaces, make_hostile, make_refused, make_hard, make_probes, make_motions, make_depths, make_grazing, make_slides, make_depths_of_parts, make_self_contacts, make_decimals):
        make(maker)
    maker.cases = {file: of for file, of in maker.cases.items() if not files or file in files}
    CASES.mkdir(exist_ok=True)
    cases = [case for of in maker.cases.values() for case in of]
    with Pool(jobs) as pool:
        stated = dict((case["id"], case) for case in pool.imap_unordered(state, cases, chunksize=20) if case)
    written = 0
    for file, of in maker.cases.items():
        lines = [json.dumps(stated[case["id"]], separators=(",", ":")) + "\n" for case in of if case["id"] in stated]
        (CASES / f"{file}.jsonl").write_bytes("".join(lines).encode())
        written += len(lines)
    lines = [json.dumps(record, separators=(",", ":")) + "\n" for record in RECORDS.values()]
    (CASES / "meshes.jsonl").write_bytes("".join(lines).encode())
    answers = sum(len(case["items"]) for case in stated.values())
    bytes_written = sum(path.stat().st_size for path in CASES.glob("*.jsonl"))
    print(f"{written} cases, {answers} results, {bytes_written} bytes")


if __name__ == "__main__":
    main()
