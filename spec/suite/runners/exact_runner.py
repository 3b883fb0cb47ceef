"""Brute force in exact arithmetic: the first way to the truth, as a runner. It shows that the protocol carries every question."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

import json

import exact
import prove
from exact import from_hex, to_hex

QUESTIONS = ["collide", "contacts", "distance", "within", "relation", "closest", "side", "ray", "segment", "motion", "penetration", "self_contacts"]
FEATURES = ["open", "concave", "degenerate", "nested", "overlapping parts", "range", "refuses", "empty"]


def hexes(value):
    """Returns the numbers of a line as hex floats, in which the proofs are written."""
    if isinstance(value, list):
        return [hexes(v) for v in value]
    return value if isinstance(value, str) and value in exact.SPECIAL else to_hex(float(value))


def answer(question, meshes):
    item = {key: hexes(value) for key, value in question.items() if key not in ("id", "ask", "a", "b")}
    truth = prove.first(question, meshes, item)
    if truth == "refused":
        return {"refused": True, "reason": prove.fault(question, meshes, item)}
    if not isinstance(truth, dict):
        return {"answer": truth}
    if truth.get("free") is True:
        return {"answer": True}
    if truth.get("hit") is False:
        return {"answer": False}
    lower, upper = from_hex(truth["lower"]), from_hex(truth["upper"])
    if "free" in truth:
        return {"answer": False, "free_until": lower, "touching_at": upper}
    if "hit" in truth:
        return {"answer": True, "t": lower, "lower": lower, "upper": upper}
    return {"lower": lower, "upper": upper} if question["ask"] == "penetration" else {"answer": lower, "lower": lower, "upper": upper}


def main():
    meshes = {}
    for line in sys.stdin:
        message = json.loads(line)
        if "hello" in message:
            reply = {"hello": 1, "name": "exact brute force", "version": "1", "settings": "", "coordinates": "f64", "placement": "f64"}
            reply |= {"questions": QUESTIONS, "features": FEATURES, "distance_error": 1e-15, "error_unit": "distance"}
        elif "mesh" in message:
            meshes[message["mesh"]] = hexes(message["vertices"]), message["triangles"]
            reply = {"mesh": message["mesh"]}
        else:
            reply = {"id": message["id"], **answer(message, meshes)}
        print(json.dumps(reply), flush=True)


if __name__ == "__main__":
    main()
