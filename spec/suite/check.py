"""Proves the truths of the cases again, by both ways, and checks the files against `SCHEMA.json`.

    python check.py [--sample N] [--jobs N]

With --sample N, every Nth case is proved. Needs only Python's standard library, and does not import what makes the cases.
"""

import argparse
import json
import sys
from collections import Counter
from multiprocessing import Pool
from pathlib import Path

import exact
import meshes
import prove
from exact import from_hex, to_hex
from schema import problems

HERE = Path(__file__).parent
MESHES = {}


def read_lines(path):
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def load_meshes():
    """Fills MESHES. Each process of a pool needs its own: not every system starts it as a copy of this one."""
    MESHES.update((record["mesh"], meshes.load(record)) for record in read_lines(HERE / "cases" / "meshes.jsonl"))


def load():
    """Fills MESHES and returns all cases, and what is wrong with the files."""
    schema = json.loads((HERE / "SCHEMA.json").read_text(encoding="utf-8"))
    faults, cases = [], []
    load_meshes()
    for path in sorted((HERE / "cases").glob("*.jsonl")):
        kind = "mesh" if path.name == "meshes.jsonl" else "case"
        for number, line in enumerate(read_lines(path), 1):
            faults += [f"{path.name}:{number}: {found}" for found in problems(line, schema["$defs"][kind], schema)]
            if kind == "mesh":
                faults += [f"{path.name}:{number}: expected triangle_count {len(MESHES[line['mesh']][1])}"] if line["triangle_count"] != len(MESHES[line["mesh"]][1]) else []
            else:
                cases.append(line)
    names = [case["id"] for case in cases]
    faults += [f"{name}: expected an id once, found it {count} times" for name, count in Counter(names).items() if count > 1]
    return cases, faults


def check(case):
    """Returns what is wrong with a case."""
    coordinates = [x for key in ("a", "b") if key in case for corner in MESHES[case[key]][0] for x in corner]
    is_held = case["needs"]["coordinates"] == "f64" or are_f32(coordinates)
    faults = [] if is_held else [f"{case['id']}: expected coordinates that f32 holds"]
    for number, item in enumerate(case["items"]):
        where = f"{case['id']}, item {number}"
        question = {key: value for key, value in item.items() if key not in ("truth", "grazing")}
        for key, value in question.items():
            numbers = value if isinstance(value, list) else [value]
            faults += [f"{where}: {key}: expected the shortest hex float, found {x}" for x in numbers if x not in exact.SPECIAL and to_hex(from_hex(x)) != x]
        found = prove.first(case, MESHES, question)
        if found != item["truth"]:
            faults.append(f"{where}: {case['proof'][0]} give {found}, the case states {item['truth']}")
        elif not prove.confirmed(case, MESHES, question, item["truth"]):
            faults.append(f"{where}: {case['proof'][1]} do not confirm {item['truth']}")
        faults += [f"{where}: {fault}" for fault in check_placement(case, question)]
    return faults


def are_f32(numbers):
    return all(exact.is_f32(exact.fraction(x)) for x in numbers if x not in exact.SPECIAL)


def check_placement(case, question):
    """Checks that the precision that the case needs holds its points, and that poses place the corners in it without any rounding."""
    if prove.fault(case, MESHES, question):
        return []
    stated = case["needs"]["placement"]
    for key in ("point", "origin", "direction", "from", "to"):
        if stated == "f32" and not are_f32(question.get(key, ())):
            return [f"{key}: expected numbers that f32 holds"]
    for key in ("pose", "start", "end"):
        if key in question:
            found = exact.placement(prove.corners_of(MESHES[case["b"]]), [exact.fraction(x) for x in question[key]])
            if found is None or found > stated:
                return [f"{key}: expected placed corners that {stated} holds, found {found}"]
    return []


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sample", type=int, default=1, metavar="N", help="prove every Nth case")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args(argv)
    if not __debug__:
        parser.error("expected Python without -O, which leaves out what the second way asserts")
    cases, faults = load()
    chosen = cases[:: arguments.sample]
    if arguments.jobs == 1:
        faults += [fault for case in chosen for fault in check(case)]
    else:
        with Pool(arguments.jobs, load_meshes) as pool:
            faults += [fault for found in pool.imap(check, chosen, chunksize=4) for fault in found]
    for fault in faults:
        print(fault, file=sys.stderr)
    answers = sum(len(case["items"]) for case in chosen)
    print(f"{len(chosen)} of {len(cases)} cases, {answers} results proved by two ways, {len(faults)} faults")
    return 1 if faults or not chosen else 0


if __name__ == "__main__":
    sys.exit(main())
