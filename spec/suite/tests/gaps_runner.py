"""A runner of timed questions that answers by `gaps.py`, and lies in every Nth answer if it is given an N, or ends at the Nth if -N."""

import sys
from pathlib import Path

SUITE = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(SUITE / "speed"), str(SUITE / "runners")]

import gaps
from serve import serve

EVERY = int(sys.argv[1]) if len(sys.argv) > 1 else 0
asked = 0


def pose_of(rotation, translation):
    return [x for row, t in zip(rotation.tolist(), translation.tolist()) for x in (*row, t)]


def distance(a, b, pose):
    return gaps.float_gap(a.placed(None), b.placed(pose))[0]


def contacts(a, b, pose):
    return len(gaps.contacts(a.placed(None), b.placed(pose)))


def honestly(number):
    """Returns a function that turns answers into numbers, and now and then into others."""

    def answer(found):
        global asked
        asked += 1
        if asked == -EVERY:
            sys.exit(3)
        right = float(number(found))
        return 1.0 - right if EVERY > 0 and asked % EVERY == 0 else right

    return answer


serve(
    "gaps", "1", "floats", gaps.Tree, {},
    {"collide": (pose_of, distance, honestly(lambda d: d == 0.0)), "distance": (pose_of, distance, honestly(float)), "contacts": (pose_of, contacts, honestly(float))},
    distance_error=1e-12, error_unit="size",
)  # fmt: skip
