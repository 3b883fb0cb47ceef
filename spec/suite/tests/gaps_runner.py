"""A runner of timed questions that answers by `gaps.py`, and lies in every Nth answer if it is given an N, or ends at the Nth if -N.

Of rays and points it tells the first hit and the side, in one call, by `probes.py`.
"""

import sys
from pathlib import Path

SUITE = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(SUITE / "speed"), str(SUITE / "runners")]

import gaps
import probes
from serve import serve

EVERY = int(sys.argv[1]) if len(sys.argv) > 1 else 0
asked = 0


def pose_of(rotation, translation):
    return [x for row, t in zip(rotation.tolist(), translation.tolist()) for x in (*row, t)]


def distance(a, b, pose):
    return gaps.float_gap(a.tree.placed(None), b.tree.placed(pose))[0]


def contacts(a, b, pose):
    return len(gaps.contacts(a.tree.placed(None), b.tree.placed(pose)))


def as_floats(of):
    return [tuple(map(float, one)) for one in of]


def first_hits(a, rays):
    return [a.first_hit(ray) for ray in rays]


def parameters(found):
    return [honest(-1.0 if at is None else float(at)) for at in found]


def sides(a, points):
    return [a.side(point) for point in points]


def honest(right):
    """Returns a number as it is, and now and then another one."""
    global asked
    asked += 1
    if asked == -EVERY:
        sys.exit(3)
    return 1.0 - right if EVERY > 0 and asked % EVERY == 0 else right


def honestly(number):
    """Returns a function that turns answers into numbers, and now and then into others."""
    return lambda found: honest(float(number(found)))


serve(
    "gaps", "1", "floats", probes.Mesh, {},
    {"collide": (pose_of, distance, honestly(lambda d: d == 0.0)), "distance": (pose_of, distance, honestly(float)), "contacts": (pose_of, contacts, honestly(float))},
    batches={"ray": (as_floats, first_hits, parameters), "side": (as_floats, sides, lambda found: list(map(honest, map(float, found))))},
    distance_error=1e-12, error_unit="size",
)  # fmt: skip
