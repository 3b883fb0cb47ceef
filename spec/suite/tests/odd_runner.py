"""A runner that claims everything and answers each question with one line of text, in which ID stands for the number of the question.

    python odd_runner.py ANSWER [CLAIMS]
"""

import json
import sys

EVERYTHING = {
    "questions": ["collide", "contacts", "distance", "within", "relation", "closest", "side", "ray", "segment", "motion", "penetration", "self_contacts"],
    "features": ["open", "concave", "degenerate", "nested", "overlapping parts", "range", "refuses", "empty"],
    "coordinates": "f64",
    "placement": "f64",
}


def main():
    claims = json.loads(sys.argv[2]) if len(sys.argv) > 2 else {}
    for line in sys.stdin:
        message = json.loads(line)
        if "hello" in message:
            answer = json.dumps({"hello": 1, "name": "odd", "version": "1", **EVERYTHING, **claims})
        elif "mesh" in message:
            answer = json.dumps({"mesh": message["mesh"]})
        else:
            answer = sys.argv[1].replace("ID", str(message["id"]))
        sys.stdout.write(answer + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
