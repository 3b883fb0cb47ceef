"""Makes the tables of paper.md of the notebook from the figures that measure.py wrote, and puts them into the page.

    page.py [--figures paper.json] [--page paper.md] [--check]

Each table stands between the comments `<!-- made: NAME -->` and `<!-- end -->`. With --check, nothing is written, and the exit code
is 1 if the page has other tables than the figures give.
"""

from __future__ import annotations

import argparse
import json
import math
import pathlib
import re
import sys
from typing import Any, Callable, Iterable

ROOT = pathlib.Path(__file__).resolve().parents[3]
NOTEBOOK = ROOT / "bvh-query/lab/notebook"
PLAIN = "dop14-f32 f32"  # the uncompressed layout, to which times are compared
FAST, SMALL = "dop26-u8-wide f32", "dop6-u8 packed"
LIBRARIES = {"pqp": "PQP", "coal": "Coal", "fcl": "FCL"}
POINTER_BYTES = 12  # in a plain binary tree: the numbers of two children and of the parent, or of a triangle
CORNER_BYTES = 36
QUESTIONS = [("collide", "touching"), ("collide", "near"), ("distance", "touching"), ("distance", "near")]
ENDS = {"u4": "4 bits", "u8": "8 bits", "f16": "half float", "f32": "float"}


def table(head: list[str], rows: Iterable[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def figure(number: float) -> str:
    """Three digits, and no more than one behind the point from 10 on."""
    return f"{number:.0f}" if number >= 100 else f"{number:.1f}" if number >= 10 else f"{number:.2f}"


def spread(numbers: Iterable[float], show: Callable[[float], str] = figure) -> str:
    """The least and the greatest number, or one if they are shown alike."""
    every = sorted(numbers)
    low, high = show(every[0]), show(every[-1])
    return low if low == high else f"{low} to {high}"


def mean(numbers: Iterable[float]) -> float:
    """The geometric mean."""
    logs = [math.log(number) for number in numbers]
    return math.exp(sum(logs) / len(logs))


def parts_of(layout: str) -> tuple[str, str, str]:
    """k, how ends are stored, and how triangles are."""
    k, ends, triangles = re.fullmatch(r"dop(\d+)-(u4|u8|f16|f32)(?:-wide)? (\w+)", layout).groups()
    return k, ENDS[ends], triangles


def times_of(mesh: dict, layout: str, field: str = "us") -> dict[tuple[str, str], float]:
    return {(row["mode"], row["gap"]): row[field] for row in mesh["times"] if row["layout"] == layout}


def of_meshes(told: dict) -> str:
    rows = [[name, mesh["what"], f"{mesh['triangles']:,}", mesh["terms"]] for name, mesh in told["meshes"].items()]
    return table(["class", "mesh", "triangles", "terms"], rows)


def of_memory(told: dict) -> str:
    """Bytes per triangle, of all meshes."""
    meshes = list(told["meshes"].values())
    rows = []
    for k in (14, 26):
        nodes = [(2 - 1 / mesh["triangles"]) * (4 * k + POINTER_BYTES) for mesh in meshes]
        rows.append([f"{k}", "float, binary tree (computed)", spread(nodes), spread(CORNER_BYTES + one for one in nodes), ""])
    for layout in meshes[0]["sizes"]:
        k, ends, triangles = parts_of(layout)
        if triangles != "f32":
            continue
        files = [[mesh["sizes"][f"{layout.split()[0]} {kind}"] for mesh in meshes] for kind in ("f32", "packed")]
        nodes, *whole = ([size[part] / size["triangles"] for size in sizes] for part, sizes in
                         (("nodes", files[0]), ("file", files[0]), ("file", files[1])))  # fmt: skip
        rows.append([k, f"{ends} (`{layout.split()[0]}`)", *map(spread, (nodes, *whole))])
    for library, title in LIBRARIES.items():
        taken = [row["bytes"] for mesh in meshes for row in mesh["others"] if row["library"] == library]
        if taken:
            rows.append(["", f"{title}, in memory", "", spread(taken), ""])
    return table(["k", "ends of slabs", "bounds and links", "all, plain triangles", "all, packed triangles"], rows)


def of_predictors(told: dict) -> str:
    """The bounds of one mesh, with 14 directions."""
    rows: dict[Any, dict[str, dict]] = {}
    for row in next(iter(told["meshes"].values()))["bounds"]["rows"]:
        if row["k"] == 14:
            rows.setdefault(row["precision"], {})[row["predictor"]] = row
    percent = lambda row: f"{100 * row['excess']:.2f} %"  # noqa: E731
    cells = []
    for precision, of in rows.items():
        fields = ("bytes_coded", "bytes_coded_knowing_parent")
        coded = [figure(of["parent"][field]) if field in of["parent"] else "" for field in fields]
        name = "half float" if precision == "half" else f"{precision} bits"
        cells.append([name, figure(of["parent"]["bytes"]), percent(of["object"]), percent(of["parent"]), *coded])
    head = ["end of a slab", "bytes", "wider by, no predictor", "wider by, predictor", "coded", "coded, knowing the parent's codes"]
    return table(head, cells)


def of_least(told: dict) -> str:
    """The least bits per end with which slabs are at most one percent wider."""
    rows = []
    for name, mesh in told["meshes"].items():
        least = {(row["k"], row["predictor"]): row for row in mesh["bounds"]["least"]}
        cells = []
        for k in (6, 14, 26):
            none, chain = least[k, "object"], least[k, "parent"]
            cells.append(f"{none['bits']} → {chain['bits']} bits, {figure(none['bytes'])} → {figure(chain['bytes'])}")
        rows.append([name, *cells])
    return table(["mesh", "k = 6", "k = 14", "k = 26"], rows)


def of_times(told: dict) -> str:
    """Times relative to plain floats: the geometric mean over all meshes, with the least and the greatest.

    Of packed triangles, those with eight bits are enough: unpacking takes the same time with any bounds.
    """
    meshes = list(told["meshes"].values())
    rows = []
    for layout in meshes[0]["sizes"]:
        k, ends, triangles = parts_of(layout)
        if triangles == "packed" and ends != ENDS["u8"]:
            continue
        cells = [f"{k}", ends, "plain" if triangles == "f32" else "packed"]
        for question in QUESTIONS:
            ratios = [times_of(mesh, layout)[question] / times_of(mesh, PLAIN)[question] for mesh in meshes]
            cells.append("1" if layout == PLAIN else f"{mean(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})")
        tests = [times_of(mesh, layout, "node_tests") for mesh in meshes]
        plain = [times_of(mesh, PLAIN, "node_tests") for mesh in meshes]
        cells.append(f"{mean(a[question] / b[question] for a, b in zip(tests, plain) for question in QUESTIONS):.2f}")
        rows.append(cells)
    return table(["k", "ends", "triangles", *(f"{mode}, {gap}" for mode, gap in QUESTIONS), "node tests"], rows)


def of_libraries(told: dict) -> str:
    """Microseconds of all libraries, and the geometric mean of how many times as long others take."""
    used = [library for library in LIBRARIES if library in told["libraries"]]
    rows, ratios, wrong = [], {library: [] for library in used}, {library: [0, 0] for library in used}
    for name, mesh in told["meshes"].items():
        others = {(row["library"], row["mode"], row["gap"]): row for row in mesh["others"]}
        fast, small = times_of(mesh, FAST), times_of(mesh, SMALL)
        for library in used:
            ratios[library] += [others[library, *question]["us"] / fast[question] for question in QUESTIONS]
            for row in (others[library, *question] for question in fast):
                wrong[library] = [wrong[library][0] + row["differ"], wrong[library][1] + row["poses"]]
        for question in (("collide", "touching"), ("distance", "near")):
            cells = [figure(us[question]) for us in (fast, small)]
            rows.append([name, question[0], *cells, *(figure(others[library, *question]["us"]) for library in used)])
    rows.append(["all", "all, times cbvh", "1", "", *(figure(mean(ratios[library])) for library in used)])
    rows.append(["all", "answers that differ", "", "", *(f"{wrong[library][0]} of {wrong[library][1]:,}" for library in used)])
    titles = [f"{LIBRARIES[library]} {told['libraries'][library]}" for library in used]
    return table(["mesh", "question", f"cbvh, `{FAST}`", f"cbvh, `{SMALL}`", *titles], rows)


def of_machine(told: dict) -> str:
    return f"Measured on {told['date']} on one core of {told['processor']}, with {told['isa']}."


TABLES = {
    "machine": of_machine, "meshes": of_meshes, "memory": of_memory, "predictors": of_predictors, "least": of_least,
    "times": of_times, "libraries": of_libraries,
}  # fmt: skip


def filled(page: str, told: dict) -> str:
    """The page with the tables that the figures give."""
    places = re.compile(r"(<!-- made: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
    found = {place[2] for place in places.finditer(page)}
    assert found == set(TABLES), f"expected places for {sorted(TABLES)}, found {sorted(found)}"
    return places.sub(lambda place: place[1] + TABLES[place[2]](told) + "\n" + place[3], page)


def main() -> int:
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figures", type=pathlib.Path, default=NOTEBOOK / "paper.json")
    parser.add_argument("--page", type=pathlib.Path, default=NOTEBOOK / "paper.md")
    parser.add_argument("--check", action="store_true", help="compare, and write nothing")
    arguments = parser.parse_args()
    page = arguments.page.read_text()
    made = filled(page, json.loads(arguments.figures.read_text()))
    if made == page:
        return 0
    if arguments.check:
        print(f"{arguments.page}: its tables are not those of {arguments.figures}", file=sys.stderr)
        return 1
    arguments.page.write_text(made)
    return 0


if __name__ == "__main__":
    sys.exit(main())
