"""Makes the rays and points of the timed queries, and proves their results, or proves again those that are there.

    python probes.py make [--jobs N] [MESH ...]       writes probes/MESH.jsonl
    python probes.py check [--jobs N] [--sample N] [MESH ...]

No library takes part. Floats leave out the triangles that the line of a ray certainly misses; integers (`truth.py`) decide all
others. The distance of a point is bounded by `gaps.py`. All numbers of a ray or point are of single precision, so all libraries
have the same questions. Needs numpy.
"""

import argparse
import functools
import hashlib
import json
import multiprocessing
import sys
from fractions import Fraction
from math import inf, nextafter

import numpy as np

import forms
import gaps
import truth
from exact import to_hex

MESHES = ("scan-10k", "scan-100k", "part-15k")
# Rays or points of a kind: 128 by 128.
SIDE = 128
COUNT = SIDE * SIDE
# Every so many of them are proved.
STEP = 15
SEED = 40
# What a turn of `Lines` may be off by, as a part of M^2 D: M is the largest coordinate of a corner as seen from the origin, D that
# of the direction. A turn is a sum of six products of three numbers, each at most M^2 D. On its way each is rounded at most seven
# times, by 2^-53 of itself or a little more, which makes 42 * 2^-53, and 2^-46 is more than twice that.
TURN_ERROR = 2.0**-46
# The farthest that a point near the surface is moved from it, as a part of the diagonal.
NEAR = 0.01


def frame(corners):
    """Returns the middle of the box around a mesh, its half sides, and its diagonal."""
    low, high = corners.min(0).astype(float), corners.max(0).astype(float)
    return (low + high) / 2, (high - low) / 2, float(forms.length(high - low))


def unit(v):
    return v / forms.length(v)[..., None]


def rays(origins, directions):
    return np.concatenate([np.broadcast_to(origins, directions.shape), unit(directions)], 1).astype(np.float32)


def camera(corners, faces, random):
    """The pixels of a square image, row by row, by a camera outside that has the mesh in view."""
    middle, _, diagonal = frame(corners)
    away = np.array([0.75, -0.5, 0.625])
    right = np.array([0.5, 0.75, 0.0])
    up = unit(np.cross(away, right))
    at = (2.0 * np.arange(SIDE) + 1.0 - SIDE) / SIDE * 0.3
    y, x = (grid.ravel()[:, None] for grid in np.meshgrid(-at, at, indexing="ij"))
    return rays(middle + diagonal * away, x * unit(right) + y * up - unit(away))


def lidar(corners, faces, random):
    """One turn of a scanner in the middle of the box: 256 directions around the upright axis, and 64 beams in each."""
    middle, _, _ = frame(corners)
    slope = np.tile(-0.5 + 0.75 * np.arange(COUNT // 256) / (COUNT // 256), 256)
    around = np.repeat(forms.circle(256), COUNT // 256, axis=0)
    return rays(middle, np.concatenate([around, slope[:, None]], 1))


def scattered(corners, faces, random):
    """Rays without order, from a sphere around the mesh to points in its box."""
    middle, half, diagonal = frame(corners)
    at = 2.0 * random(3 * COUNT, 3) - 1.0
    size = forms.length(at)
    starts = middle + diagonal * unit(at[(size > 0.1) & (size <= 1.0)][:COUNT])
    return rays(starts, middle + half * (2.0 * random(COUNT, 3) - 1.0) - starts)


def near(corners, faces, random):
    """Points near the surface, without order: on a triangle, and then moved by at most a hundredth of the diagonal."""
    _, _, diagonal = frame(corners)
    a, b, c = corners[faces[(random(COUNT) * len(faces)).astype(int)].T].astype(float)
    u, v = random(2, COUNT, 1)
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    return (a + u * (b - a) + v * (c - a) + NEAR * diagonal * (2.0 * random(COUNT, 3) - 1.0) / 2.0).astype(np.float32)


def around(corners, faces, random):
    """Points without order, in a box of half as much again as that of the mesh along each axis."""
    middle, half, _ = frame(corners)
    return (middle + 1.5 * half * (2.0 * random(COUNT, 3) - 1.0)).astype(np.float32)


KINDS = {"camera": camera, "lidar": lidar, "scattered": scattered, "near": near, "around": around}
RAYS, POINTS = ("camera", "lidar", "scattered"), ("near", "around")


def make_set(mesh, kind):
    """Returns the rays of a kind, as origins and directions, or its points, in f32."""
    corners, faces = forms.make(forms.catalogue()["meshes"][mesh])
    seeds = iter(range(SEED + 100 * sum((mesh + kind).encode()), 1 << 40))
    return KINDS[kind](corners, faces, lambda *shape: forms.uniform(next(seeds), *shape))


def digest(numbers):
    return hashlib.sha256(numbers.astype("<f4").tobytes()).hexdigest()


class Mesh:
    """A mesh for exact questions about lines and points."""

    def __init__(self, corners, faces):
        self.corners, self.faces = corners.astype(float), faces
        self.tree = gaps.Tree(corners, faces)

    @functools.cached_property
    def is_closed(self):
        return truth.is_closed([tuple(map(tuple, t)) for t in self.corners[self.faces].tolist()])

    def line(self, origin, direction):
        """Returns a ray and all triangles that its line does not certainly miss, as integers in one unit."""
        p = self.corners - origin
        x, y, z = direction
        q = np.stack([y * p[:, 2] - z * p[:, 1], z * p[:, 0] - x * p[:, 2], x * p[:, 1] - y * p[:, 0]], 1)
        turns = [gaps.dot(q[self.faces[:, i]], p[self.faces[:, j]]) for i, j in truth.EDGES]
        error = TURN_ERROR * float(np.abs(p).max()) ** 2 * max(map(abs, direction))
        left = (np.minimum.reduce(turns) >= -error) | (np.maximum.reduce(turns) <= error)
        bits = max(self.tree.bits, *map(gaps.fraction_bits, (*origin, *direction)))
        exactly = lambda point: tuple(gaps.integer(float(v), bits) for v in point)
        return exactly(origin), exactly(direction), [tuple(exactly(self.corners[k]) for k in face) for face in self.faces[left]]

    def first_hit(self, ray):
        """Returns the exact parameter of the first hit, or None."""
        return truth.first_hit(*self.line(ray[:3], ray[3:]))

    def side(self, point):
        """Returns 1 for a point inside, 0 on the surface, -1 outside."""
        for direction in truth.DIRECTIONS:
            at, along, triangles = self.line(point, tuple(map(float, direction)))
            if truth.point_on(at, triangles):
                return 0
            if (turns := truth.winding_along(at, along, triangles)) is not None:
                return 1 if turns else -1
        raise ValueError("no direction avoids all edges")

    def distance(self, point):
        """Returns two floats between which the distance of a point is."""
        corner = np.array([point] * 3, np.float32)
        return gaps.bounds(self.tree.placed(None), gaps.Tree(corner, np.array([[0, 1, 2]])).placed(None))


def below(value):
    """Returns the largest float that is at most as large as a fraction."""
    found = float(value)
    return nextafter(found, -inf) if Fraction(found) > value else found


def proved(mesh, kind, probe):
    """Returns what is certain about a ray: the largest float up to the parameter of its first hit, or None. About a point: bounds of its distance, and its side if the mesh is closed."""
    probe = tuple(map(float, probe))
    if kind in RAYS:
        at = mesh.first_hit(probe)
        return None if at is None else below(at)
    return [*mesh.distance(probe), *([mesh.side(probe)] if mesh.is_closed else [])]


def exactly(fact):
    """Returns what is proved about a ray or point with floats as hex floats."""
    if isinstance(fact, list):
        return [exactly(x) for x in fact]
    return to_hex(fact) if isinstance(fact, float) else fact


def numbers(fact):
    if isinstance(fact, list):
        return [numbers(x) for x in fact]
    return float.fromhex(fact) if isinstance(fact, str) else fact


def path(mesh):
    return forms.HERE / "probes" / f"{mesh}.jsonl"


def load(mesh):
    """Returns for each kind its rays or points, and what is proved about every `STEP`th of them."""
    if not path(mesh).exists():
        raise forms.Missing(f"it needs answers: python probes.py make {mesh}")
    found = {}
    for line in path(mesh).read_text(encoding="utf-8").splitlines():
        line = json.loads(line)
        if "kind" in line:
            kind, probes = line["kind"], make_set(mesh, line["kind"])
            if digest(probes) != line["sha256"]:
                raise ValueError(f"{mesh}, {kind}: expected {line['sha256']}, found {digest(probes)}")
            found[kind] = probes, []
        else:
            found[kind][1].extend(map(numbers, line["proved"]))
    return found


def loosened(fact, size):
    """Returns bounds of a distance with room for the rounding of another machine's numpy, which may add in another order."""
    lower, *rest = fact
    return [max(0.0, lower - 1e-14 * size), *rest]


def make(name):
    """Returns the lines of a file of answers: about each kind a head, and then 16 answers per line."""
    mesh = Mesh(*forms.make(forms.catalogue()["meshes"][name]))
    for kind in KINDS:
        probes = make_set(name, kind)
        yield {"kind": kind, "sha256": digest(probes)}
        facts = [proved(mesh, kind, probe) for probe in probes[::STEP]]
        if kind not in RAYS:
            facts = [loosened(fact, mesh.tree.largest) for fact in facts]
        for k in range(0, len(facts), 16):
            yield {"proved": [exactly(fact) for fact in facts[k : k + 16]]}


def is_right(what, answer, probe, fact, size, profile):
    """Tells whether an answer is what is proved, to within the error that a runner claims. The size is that of the mesh's largest coordinate."""
    error = profile["distance_error"]
    size = max(size, *(abs(float(x)) for x in probe[:3]))
    if what == "side":
        return answer == fact[2]
    if what == "closest":
        error *= fact[1] if profile["error_unit"] == "distance" else size
        return fact[0] - error <= answer <= fact[1] + error
    if what == "hit":
        return answer == float(fact is not None)
    if fact is None or answer < 0.0:
        return answer == -1.0 and fact is None
    error *= fact if profile["error_unit"] == "distance" else size / float(np.abs(probe[3:]).max())
    return fact - error <= answer <= nextafter(fact, inf) + error


def agrees(stated, fact):
    """Tells whether what is stated about a ray or point follows from what is proved."""
    if not isinstance(fact, list):
        return stated == fact
    return stated[0] <= fact[0] and fact[1] <= stated[1] and stated[1] - stated[0] <= 1e-12 * (1.0 + stated[1]) and stated[2:] == fact[2:]


def check(name, sample=1):
    """Proves every Nth answer again, and returns how many were, and what is wrong."""
    mesh = Mesh(*forms.make(forms.catalogue()["meshes"][name]))
    count, faults = 0, []
    for kind, (probes, facts) in load(name).items():
        for number in range(sum(kind.encode()) % sample, len(facts), sample):
            fact, count = proved(mesh, kind, probes[number * STEP]), count + 1
            if not agrees(facts[number], fact):
                faults.append(f"{name}, {kind} {number * STEP}: expected {facts[number]}, proved {fact}")
        if len(facts) != len(probes[::STEP]):
            faults.append(f"{name}, {kind}: expected {len(probes[::STEP])} answers, found {len(facts)}")
    return count, faults


def work(what, sample, name):
    return name, list(make(name)) if what == "make" else check(name, sample)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("make", "check"))
    parser.add_argument("meshes", nargs="*", metavar="MESH")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--sample", type=int, default=1, metavar="N", help="check every Nth result")
    arguments = parser.parse_intermixed_args(argv)
    total, wrong = 0, []
    with multiprocessing.Pool(arguments.jobs) as pool:
        for name, found in pool.imap_unordered(functools.partial(work, arguments.what, arguments.sample), arguments.meshes or MESHES):
            if arguments.what == "make":
                path(name).parent.mkdir(exist_ok=True)
                path(name).write_text("".join(json.dumps(line) + "\n" for line in found), encoding="utf-8")
                print(f"{name}: {sum(len(line.get('proved', ())) for line in found)} results", flush=True)
            else:
                total, wrong = total + found[0], wrong + found[1]
    if arguments.what == "check":
        print("\n".join([*wrong, f"{total} results, {len(wrong)} wrong"]))
    return 1 if wrong or (arguments.what == "check" and total == 0) else 0


if __name__ == "__main__":
    sys.exit(main())
