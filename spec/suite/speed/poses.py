"""Finds the poses of the timed queries and proves their gaps, or proves again those that are there.

    python poses.py make [--jobs N] [PAIR ...]       writes poses/PAIR.jsonl, with the proved bounds of each gap
    python poses.py check [--jobs N] [--sample N] [PAIR ...]

B is turned at random and brought in along a random direction. A preset states the gap as a part of the diagonal of A's box. No
library takes part: the search uses `gaps.py` in floats, and what it finds is then proved. Needs numpy.
"""

import argparse
import json
import multiprocessing
import sys
from math import sqrt

import forms
import gaps
from exact import to_hex

POSES = 20
SEED = 20
# The gap of each preset, as a part of the diagonal, from far to near.
PRESETS = {"far": 100.0, "10%": 0.1, "5%": 0.05, "1%": 0.01, "0.5%": 0.005, "0.0001%": 1e-6}
# A gap may differ from its preset by this part.
TOLERANCE = 0.05
# Meshes that just touch are at most this part of the diagonal beyond a pose at which they are apart.
TOUCHING = 1e-6
MAX_STEPS = 40


def on_sphere(random, n):
    """Returns the next point of a sphere in n dimensions, from points in a cube."""
    while True:
        v = [2.0 * next(random) - 1.0 for _ in range(n)]
        size = sqrt(sum(x * x for x in v))
        if 0.1 < size <= 1.0:
            return [x / size for x in v]


def rotation(w, x, y, z):
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


class Approach:
    """B on its way towards A: turned once, and moved along one direction."""

    def __init__(self, a, b, random):
        self.a, self.b = a.placed(None), b
        (middle, half), (middle_b, half_b) = ((centre[0], half[0]) for centre, half in (a.levels[0], b.levels[0]))
        self.size = 2.0 * float(gaps.length(half))
        self.rotation, self.direction = rotation(*on_sphere(random, 4)), on_sphere(random, 3)
        self.start = [m - sum(r * x for r, x in zip(row, middle_b.tolist())) for m, row in zip(middle.tolist(), self.rotation)]
        self.reach = self.size + 2.0 * float(gaps.length(half_b))

    def pose(self, along):
        return [x for row, s, d in zip(self.rotation, self.start, self.direction) for x in (*row, s + along * d)]

    def at(self, along):
        return self.b.placed(self.pose(along))

    def to_gap(self, along, gap, tolerance=TOLERANCE):
        """Returns where the gap is as wanted, on the way inwards, or None."""
        outside, inside = along, None
        for _ in range(MAX_STEPS):
            found, normal = gaps.float_gap(self.a, self.at(along))
            if abs(found - gap) <= tolerance * gap:
                return along
            if found > gap:
                outside = along
                along -= (found - gap) / max(0.5, sum(float(n) * d for n, d in zip(normal, self.direction)))
            else:
                inside = along
            if inside is not None and not inside < along < outside:
                along = (inside + outside) / 2
        return None

    def poses(self):
        """Returns where B is at each preset, or None if the direction is of no use."""
        found, along = {"far": PRESETS["far"] * self.size}, self.reach
        for preset, gap in list(PRESETS.items())[1:]:
            along = self.to_gap(along, gap * self.size)
            if along is None:
                return None
            found[preset] = along
        near = self.to_gap(along, TOUCHING * self.size / 10, 0.5)
        if near is None or near <= 0.1 * self.size:
            return None
        return found | {"touching": near - TOUCHING * self.size, "deep": near / 2}


def proved(a, b, owners, pose, preset):
    """Returns what is certain about a pose: bounds of its gap, or how many pairs of triangles touch, or how many instances B touches."""
    placed = b.placed(pose)
    if preset in PRESETS:
        lower, upper = gaps.bounds(a, placed)
        return {"lower": lower, "upper": upper}
    found = gaps.contacts(a, placed)
    if owners is not None:
        return {"touched": len({owners[i] for i, _ in found})}
    return {"contacts": len(found)}


def is_good(fact, preset, size):
    if preset not in PRESETS:
        return all(fact.values())
    if preset == "far":
        return fact["upper"] - fact["lower"] <= 1e-8 * fact["upper"]
    # The interval is far narrower than what any library claims.
    return fact["upper"] - fact["lower"] <= 1e-12 * size and abs(fact["upper"] / size / PRESETS[preset] - 1) < 2 * TOLERANCE


def trees(pair):
    """Returns the trees of A and B, and for a field the number of the instance of each triangle of A."""
    known = forms.catalogue()
    a, b = known["pairs"][pair]
    b = gaps.Tree(*forms.make(known["meshes"][b]))
    if a in known["fields"]:
        corners, faces, owners = forms.flattened(known["fields"][a], known["meshes"])
        return gaps.Tree(corners, faces), b, owners.tolist()
    return gaps.Tree(*forms.make(known["meshes"][a])), b, None


def make(pair):
    """Returns the lines of a file of poses."""
    a, b, owners = trees(pair)
    numbers = iter(forms.uniform(SEED + sum(pair.encode()), 100_000).tolist())
    lines = []
    while len(lines) < POSES:
        approach = Approach(a, b, numbers)
        found = approach.poses()
        if found is None:
            continue
        facts = {preset: proved(approach.a, b, owners, approach.pose(along), preset) for preset, along in found.items()}
        if all(is_good(fact, preset, approach.size) for preset, fact in facts.items()):
            line = {"rotation": [to_hex(x) for row in approach.rotation for x in row]}
            for preset, fact in facts.items():
                # Another machine's numpy may add in another order, so a lower bound has room for its rounding.
                fact = {key: to_hex(x - (1e-14 * (approach.size + x) if key == "lower" else 0.0)) if isinstance(x, float) else x for key, x in fact.items()}
                line[preset] = {"translation": [to_hex(x) for x in approach.pose(found[preset])[3::4]], **fact}
            lines.append(line)
    return lines


def path(pair):
    return forms.HERE / "poses" / f"{pair}.jsonl"


def load(pair):
    """Returns for each preset the poses of a pair, as twelve floats, with what is proved about them."""
    if not path(pair).exists():
        raise forms.Missing(f"it needs poses: python poses.py make {pair}")
    found = {}
    for line in path(pair).read_text(encoding="utf-8").splitlines():
        line = json.loads(line)
        r = [float.fromhex(x) for x in line.pop("rotation")]
        for preset, fact in line.items():
            t = [float.fromhex(x) for x in fact.pop("translation")]
            pose = [*r[0:3], t[0], *r[3:6], t[1], *r[6:9], t[2]]
            found.setdefault(preset, []).append((pose, {key: float.fromhex(x) if isinstance(x, str) else x for key, x in fact.items()}))
    return found


def check(pair, sample=1):
    """Proves every Nth pose of a pair again, and returns how many were, and what is wrong."""
    a, b, owners = trees(pair)
    a, count, faults = a.placed(None), 0, []
    for preset, items in load(pair).items():
        for number in range(sum(preset.encode()) % sample, len(items), sample):
            pose, stated = items[number]
            fact, count = proved(a, b, owners, pose, preset), count + 1
            if "lower" in fact:
                is_proved = stated["lower"] <= fact["lower"] and fact["upper"] <= stated["upper"]
            else:
                is_proved = fact == stated
            if not is_proved:
                faults.append(f"{pair}, {preset}, pose {number}: expected {stated}, proved {fact}")
    return count, faults


def work(task):
    what, pair, sample = task
    try:
        return pair, make(pair) if what == "make" else check(pair, sample)
    except forms.Missing as missing:
        return pair, missing


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("make", "check"))
    parser.add_argument("pairs", nargs="*", metavar="PAIR")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--sample", type=int, default=1, metavar="N", help="check every Nth pose")
    arguments = parser.parse_intermixed_args(argv)
    tasks = [(arguments.what, pair, arguments.sample) for pair in arguments.pairs or forms.catalogue()["pairs"]]
    total, wrong = 0, []
    with multiprocessing.Pool(arguments.jobs) as pool:
        for pair, found in pool.imap_unordered(work, tasks):
            if isinstance(found, forms.Missing):
                print(f"{pair}: skipped, {found}")
            elif arguments.what == "make":
                path(pair).parent.mkdir(exist_ok=True)
                path(pair).write_text("".join(json.dumps(line) + "\n" for line in found), encoding="utf-8")
                print(f"{pair}: {len(found)} poses at {len(found[0]) - 1} presets", flush=True)
            else:
                total, wrong = total + found[0], wrong + found[1]
    if arguments.what == "check":
        print("\n".join([*wrong, f"{total} poses, {len(wrong)} wrong"]))
    return 1 if wrong or (arguments.what == "check" and total == 0) else 0


if __name__ == "__main__":
    sys.exit(main())
