"""Makes a page, plots and CSV files of the raw times of run.py.

    python report.py DIR [--page FILE] [--subject cbvh]

The time of a pose is the median over the steady rounds, and a cell has the median of these over the poses. The 99th percentile is over all
single queries. A library with a wrong answer in a cell counts neither as best nor as other there. One whose budget did not suffice for all
poses has fewer of them: its time is about the first ones. The subject is the library that the ratios are about. The page has the ratios,
and what the subject loses comes first; the CSV files have all times. Rays and points are nanoseconds per ray or point, which run.py has
already reduced in the same way. Needs Python alone.
"""

import argparse
import csv
import io
import json
import os
import sys
from math import ceil, log10
from pathlib import Path
from statistics import median

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#8c564b", "#bcbd22", "#17becf", "#000000", "#f781bf")
PRESETS = ("deep", "touching", "0.0001%", "0.5%", "1%", "5%", "10%", "far")
QUESTIONS = {
    "collide": "Do the two touch?",
    "distance": "How far apart are they?",
    "contacts": "Which pairs of triangles touch?",
    "touched": "How many instances of the field does the mesh touch?",
}
# Questions about rays and points, one by one and in one call.
PROBED = {
    "ray": "What does the ray hit first?",
    "hit": "Does the ray hit anything?",
    "closest": "How far is the point from the mesh?",
    "side": "Is the point inside?",
}
# What the summary is about: meshes that just touch, that are just apart, and that are near.
SHORT = {("collide", "touching"): "collide, touching", ("collide", "0.0001%"): "collide, 0.0001 % apart", ("distance", "1%"): "distance, 1 % apart"}
# What it costs until a mesh that was never seen has its first result.
FIRST_COSTS = ("build, ms", "first result from the mesh, ms")
SCALING = ("scan-1k", "scan-10k", "scan-100k")


class Cell:
    """What one library needed for one question at one preset of a pair."""

    def __init__(self, rounds, wrong):
        # The first round is cold, unless it is the only one.
        steady, self.wrong = rounds[1:] or rounds, wrong
        count = max(map(len, steady))
        self.poses, self.cold = count, median(rounds[0])
        self.median = median(median(times[k] for times in steady if k < len(times)) for k in range(count))
        ordered = sorted(x for times in steady for x in times)
        self.p99 = ordered[min(len(ordered), ceil(0.99 * len(ordered))) - 1]


class ProbedCell:
    """What one library needed for one question about a kind of rays or points, in nanoseconds for each."""

    def __init__(self, record):
        self.median, self.p99, self.cold, self.wrong = (record[key] for key in ("median", "p99", "cold", "wrong"))
        self.count, self.checked, self.threads = (record[key] for key in ("count", "checked", "threads"))


def read(folder):
    """Returns the head, what builds cost, what batches took, who failed, the cells by question, pair, preset and library, and those of rays and points by question, in one call or not, mesh, kind and library."""
    head, builds, batches, failed, cells, probed = None, [], [], [], {}, {}
    for line in (folder / "times.jsonl").read_text(encoding="utf-8").splitlines():
        record = json.loads(line)
        if "ask" in record:
            cells.setdefault((record["ask"], record["pair"], record["preset"]), {})[record["runner"]] = Cell(record["rounds"], record["wrong"])
        elif "probe" in record:
            probed.setdefault((record["probe"], record["batch"], record["mesh"], record["kind"]), {})[record["runner"]] = ProbedCell(record)
        elif "batch" in record:
            batches.append(record)
        elif "failed" in record:
            failed.append(f"{record['runner']} failed on {record['pair']}: `{record['failed']}`")
        elif "meshes" in record:
            builds.append(record)
        else:
            head = record
    return head, builds, batches, failed, cells, probed


def microseconds(nanoseconds):
    value = nanoseconds / 1000
    return f"{value:.2f}" if value < 10 else f"{value:.1f}" if value < 100 else f"{value:,.0f}"


def table(names, rows):
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def marked(name, lines):
    """Returns lines that the book includes by their name."""
    return [f"<!-- ANCHOR: {name} -->", *lines, f"<!-- ANCHOR_END: {name} -->"]


def is_own(name, subject):
    """Tells whether a runner is the subject, or the subject with other options."""
    return name == subject or name.startswith(subject + ", ")


def best_other(row, subject):
    """Returns the fastest other library whose answers are right, or None."""
    others = [(cell.median, name) for name, cell in row.items() if not is_own(name, subject) and not cell.wrong]
    return min(others, default=None)


def ratio(row, subject):
    """Returns how many times as long as the subject the best other library takes, or None."""
    other = best_other(row, subject)
    return None if other is None or subject not in row or row[subject].wrong else other[0] / row[subject].median


def ordered(cells, question):
    pairs = list(dict.fromkeys(pair for _, pair, _ in cells))
    return sorted((key for key in cells if key[0] == question), key=lambda key: (pairs.index(key[1]), PRESETS.index(key[2])))


def summary(builds, cells, subject):
    """Returns a row for each pair: the subject beside the best other library, where most is to be done."""
    rows = []
    asked = {pair for _, pair, _ in cells}
    triangles = {record["pair"]: record["triangles"].values() for record in builds if record["pair"] in asked}
    for pair, counts in triangles.items():
        row = [pair, ", ".join(f"{count:,}" for count in counts)]
        for question, preset in SHORT:
            of = cells.get((question, pair, preset), {})
            other = best_other(of, subject)
            row.append(microseconds(of[subject].median) if subject in of else "")
            row.append(f"{microseconds(other[0])}, {other[1]}" if other else "")
        rows.append(row)
    heads = [name for title in SHORT.values() for name in (title, "best other")]
    return table(["pair", "triangles", *heads], rows)


def losses(cells, subject):
    found = []
    for (question, pair, preset), row in cells.items():
        share = ratio(row, subject)
        if share is not None and share < 1:
            other, name = best_other(row, subject)
            found.append((share, [question, pair, preset, microseconds(row[subject].median), name, microseconds(other), f"{1 / share:.2f}"]))
    return [row for _, row in sorted(found)]


def ratio_table(cells, question, subject):
    """Returns a row for each pair: how many times as long as the subject the best other library takes, by the gap."""
    keys = ordered(cells, question)
    gaps = [preset for preset in PRESETS if any(key[2] == preset for key in keys)]
    rows = []
    for pair in dict.fromkeys(pair for _, pair, _ in keys):
        shares = [ratio(cells.get((question, pair, gap), {}), subject) for gap in gaps]
        rows.append([pair, *(f"{share:.1f}" if share else "" for share in shares)])
    return table(["pair", *gaps], rows)


def wrong_table(cells):
    """Returns a row for each cell with wrong answers, and for the libraries that have the same number of them."""
    rows = {}
    for key in sorted(cells):
        for name, cell in cells[key].items():
            if cell.wrong:
                rows.setdefault((*key, f"{len(cell.wrong)} of {cell.poses}"), []).append(name)
    return table(["libraries", "query", "pair", "gap", "wrong"], [["; ".join(names), *row] for row, names in rows.items()])


def batch_table(batches):
    """Returns a row for each pair and library, with the time per query for each question and gap."""
    asked = list(dict.fromkeys((batch["batch"], batch["preset"]) for batch in batches))
    rows = {}
    for batch in batches:
        row = rows.setdefault((batch["pair"], batch["runner"], str(batch["queries"]), str(batch["threads"])), [""] * len(asked))
        row[asked.index((batch["batch"], batch["preset"]))] = microseconds(1e9 * batch["seconds"] / batch["queries"])
    return table(["pair", "library", "queries", "threads", *(f"{question}, {preset}" for question, preset in asked)], [[*head, *row] for head, row in rows.items()])


def comma_separated(names, rows):
    output = io.StringIO()
    csv.writer(output, lineterminator="\n").writerows([names, *rows])
    return output.getvalue()


def queries_file(cells):
    """Returns the CSV file of all cells, in microseconds."""
    rows = []
    for question in QUESTIONS:
        for key in ordered(cells, question):
            rows += [[*key, name, cell.poses, len(cell.wrong), *(f"{x / 1000:.2f}" for x in (cell.median, cell.p99, cell.cold))] for name, cell in cells[key].items()]
    return comma_separated(["query", "pair", "gap", "library", "poses", "wrong", "median", "99th percentile", "cold"], rows)


def costs(record):
    """Returns what it costs to get ready: milliseconds and bytes per triangle, or None where a library does not tell."""
    of = list(record["meshes"].values())
    total = lambda key: None if any(cost[key] is None for cost in of) else sum(cost[key] for cost in of)
    built, opened, size = total("seconds"), total("open_seconds"), total("bytes")
    field, first = record.get("field_seconds", 0), record["first_nanoseconds"]
    ready = lambda seconds: None if seconds is None or first is None else 1e3 * (seconds + field) + first / 1e6
    per_triangle = None if size is None else size / sum(record["triangles"].values())
    return {"build, ms": 1e3 * (built + field), "bytes per triangle": per_triangle, "first result from the mesh, ms": ready(built), "first result from a file, ms": ready(opened)}


def short(value):
    return "" if value is None else f"{value:.3g}" if value < 100 else f"{value:,.0f}"


def builds_file(builds):
    rows = [[record["pair"], record["runner"], *("" if value is None else f"{value:.4g}" for value in costs(record).values())] for record in builds]
    return comma_separated(["pair", "library", *costs(builds[0])], rows)


def build_table(builds, subject):
    """Returns a row for each pair or mesh and the options of the subject: what it costs, and what is least among the others."""
    names, rows = list(costs(builds[0])), []
    for record in (record for record in builds if is_own(record["runner"], subject)):
        cells = []
        for name, own in costs(record).items():
            best = least_other(builds, record, name, subject)
            cells += [short(own), f"{short(best[0])}, {best[1]}" if best else ""]
        rows.append([record["pair"] + record["runner"][len(subject) :], *cells])
    return table(["pair", *(head for name in names for head in (name, "least other"))], rows)


def least_other(builds, record, name, subject):
    """Returns the least cost of another library where the subject has a record, and whose it is, or None."""
    others = [other for other in builds if other["pair"] == record["pair"] and not is_own(other["runner"], subject)]
    return min(((costs(other)[name], other["runner"]) for other in others if costs(other)[name] is not None), default=None)


def lost_builds(builds, subject):
    """Returns a row for each pair or mesh, and the options of the subject, where another library builds faster or gives the first result from the mesh sooner."""
    rows = []
    for record in (record for record in builds if is_own(record["runner"], subject)):
        cells = []
        for name in FIRST_COSTS:
            own, best = costs(record)[name], least_other(builds, record, name, subject)
            is_lost = own is not None and best is not None and best[0] < own
            cells += [short(own), f"{short(best[0])}, {best[1]}" if is_lost else "", f"{own / best[0]:.2f}" if is_lost else ""]
        if any(cells[1::3]):
            rows.append([record["pair"], record["runner"], *cells])
    return rows


def probed_losses(probed, subject):
    """Returns a row for each question about rays and points where another library is faster and right, the farthest behind first."""
    found = []
    for (question, is_batch, mesh, kind), row in probed.items():
        share = ratio(row, subject)
        if share is not None and share < 1:
            other, name = best_other(row, subject)
            found.append((share, [titled(question, is_batch), mesh, kind, f"{row[subject].median:,.0f}", name, f"{other:,.0f}", f"{1 / share:.2f}"]))
    return [row for _, row in sorted(found)]


def titled(question, is_batch):
    return f"{question}, in one call" if is_batch else question


def probed_table(probed, question, is_batch, names, subject):
    """Returns a row for each mesh and kind: the times of all libraries, and how many times as long as the subject the best other one takes."""
    rows = {key[2:]: row for key, row in probed.items() if key[:2] == (question, is_batch)}
    names = [name for name in names if any(name in row for row in rows.values())]
    wrong = lambda cell: f" ({len(cell.wrong)} wrong)" if cell.wrong else ""
    cells = lambda row: [f"{row[name].median:,.0f}{wrong(row[name])}" if name in row else "" for name in names]
    last = lambda share: f"{share:.2f}" if share else ""
    return table(["mesh", "kind", *names, "best other / " + subject], [[*key, *cells(row), last(ratio(row, subject))] for key, row in rows.items()])


def probed_lines(builds, probed, names, subject):
    """Returns the section about rays and points."""
    checked = max(cell.checked for row in probed.values() for cell in row.values())
    lines = ["", "## Rays and points", "", "Nanoseconds for each ray or point, on the same core: one by one the median over them, in one call the mean, which is larger where some queries take",
             "long. *best other* is the fastest other library that is right. Libraries in Python get all in one call only, because a call from Python costs",
             f"more than a query. Of each kind, {checked:,} results are checked."]  # fmt: skip
    for question, title in PROBED.items():
        if any(key[0] == question for key in probed):
            lines += ["", f"### {title} (`{question}`)"]
            for is_batch in (False, True):
                if any(key[:2] == (question, is_batch) for key in probed):
                    lines += ["", "In one call:" if is_batch else "One by one:", "", *probed_table(probed, question, is_batch, names, subject)]
    meshes = [pair for pair in dict.fromkeys(record["pair"] for record in builds) if pair.startswith("probes/")]
    if meshes:
        built = {(record["pair"], record["runner"]): short(costs(record)["build, ms"]) for record in builds}
        makers = [name for name in names if any((mesh, name) in built for mesh in meshes)]
        lines += ["", "### Builds for them, ms", "", *table(["mesh", *makers], [[mesh[7:], *(built.get((mesh, name), "") for name in makers)] for mesh in meshes])]
    return lines


def probes_file(probed):
    """Returns the CSV file of all rays and points, in nanoseconds."""
    rows = []
    for (question, is_batch, mesh, kind), row in probed.items():
        for name, cell in row.items():
            rows.append([question, "one call" if is_batch else "one by one", mesh, kind, name, cell.threads, cell.count, cell.checked, len(cell.wrong), *(f"{x:.1f}" for x in (cell.median, cell.p99, cell.cold))])
    return comma_separated(["query", "calls", "mesh", "kind", "library", "threads", "count", "checked", "wrong", "median", "99th percentile", "cold"], rows)


def plot(title, labels, lines, x_title, colours):
    """Returns an SVG of times in microseconds on a logarithmic axis, one line per library."""
    width, height, left, top, right, bottom = 760, 400, 70, 40, 170, 50
    values = [y for line in lines.values() for y in line if y is not None]
    low, high = int(log10(min(values)) // 1), ceil(log10(max(values)) + 1e-9)
    x = lambda k: left + (width - left - right) * (k + 0.5) / len(labels)
    y = lambda value: top + (height - top - bottom) * (high - log10(value)) / (high - low)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
             f'<rect width="{width}" height="{height}" fill="white"/><text x="{left}" y="22" font-size="15">{title}</text>']  # fmt: skip
    for power in range(low, high + 1):
        at = y(10.0**power)
        parts.append(f'<line x1="{left}" x2="{width - right}" y1="{at:.1f}" y2="{at:.1f}" stroke="#ddd"/><text x="{left - 8}" y="{at + 4:.1f}" text-anchor="end">{10.0**power:g} µs</text>')
    for k, label in enumerate(labels):
        parts.append(f'<text x="{x(k):.1f}" y="{height - bottom + 18}" text-anchor="middle">{label}</text>')
    parts.append(f'<text x="{(left + width - right) / 2}" y="{height - 10}" text-anchor="middle">{x_title}</text>')
    for number, (name, line) in enumerate(lines.items()):
        colour = colours[name]
        points = [(x(k), y(value)) for k, value in enumerate(line) if value is not None]
        parts.append(f'<polyline points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in points)}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colour}"/>' for a, b in points]
        parts.append(f'<rect x="{width - right + 15}" y="{top + 18 * number}" width="12" height="12" fill="{colour}"/><text x="{width - right + 33}" y="{top + 18 * number + 10}">{name}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def plots(cells, names):
    """Returns the plots by the names of their files: for each question and pair over the presets, and over the size of the meshes."""
    names = [name for name in names if any(name in row for row in cells.values())]
    found, colours = {}, {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(names)}

    def add(file, title, keys, labels, x_title):
        lines = {name: [cells[key][name].median / 1000 if key in cells and name in cells[key] and not cells[key][name].wrong else None for key in keys] for name in names}
        lines = {name: line for name, line in lines.items() if any(value is not None for value in line)}
        if lines and len(keys) > 1:
            found[file] = plot(title, labels, lines, x_title, colours)

    for question in ("collide", "distance"):
        for pair in dict.fromkeys(pair for asked, pair, _ in cells if asked == question):
            keys = [key for key in ordered(cells, question) if key[1] == pair]
            add(f"{question}-{pair}.svg", f"{question}, {pair}: median time per query", keys, [key[2] for key in keys], "gap, as a part of the diagonal of A")
        sizes = [(question, pair, "1%") for pair in SCALING if (question, pair, "1%") in cells]
        add(f"{question}-scaling.svg", f"{question} at a gap of 1%: median time per query", sizes, [key[1] for key in sizes], "triangles of each mesh")
    return found


def page(head, builds, batches, failed, cells, probed, subject, drawn, folder, readme):
    """Returns the lines of the page of results. Its plots and CSV files are in a folder."""
    wrong = sum(len(cell.wrong) for row in cells.values() for cell in row.values())
    lost = losses(cells, subject)
    compared = sum(ratio(row, subject) is not None for row in cells.values())
    probed_wrong = sum(len(cell.wrong) for row in probed.values() for cell in row.values())
    probed_compared = sum(ratio(row, subject) is not None for row in probed.values())
    where = f"on one {'pinned ' if head['pinned'] else ''}core of {head['processor']}, {head['system']}"
    plotted = lambda wanted: [f"![{file[:-4]}]({folder}{file})" for file in drawn if wanted(file)]
    of_size = lambda file: file.endswith("-scaling.svg")
    lines = ["# Speed", "", *marked("made", [f"Made on {head['date']} by `speed/run.py` with version {head['suite']} of the suite, {where}."]), "",
             "Times are medians over the poses, in microseconds. The gap is a part of the diagonal of A's box. *far* is 100 diagonals away, where",
             f"`collide` shows the cost of a call. By the proofs, {wrong + probed_wrong or 'no'} results are wrong, counted once for each pose, ray and point. A library with a wrong result in a cell",
             f"is not counted as best there. [queries.csv]({folder}queries.csv)"
             + (f", [probes.csv]({folder}probes.csv)" if probed else "")
             + f" and [builds.csv]({folder}builds.csv) have all times.", f"[What is timed]({readme})", "",
             *(["## In short", "", *marked("short", summary(builds, cells, subject)), ""] if cells else [])]  # fmt: skip
    if sizes := plotted(of_size):
        lines += [*sizes, ""]
    lines += [f"## Where {subject} loses", ""]
    told = [f"No other library is faster in any of {compared} comparisons of queries."]
    if lost:
        told = [f"In {len(lost)} of {compared} comparisons of queries, another library is faster.", "", *table(["query", "pair", "gap", subject, "faster", "its time", "times as fast"], lost)]
    if probed:
        if lost := probed_losses(probed, subject):
            told += ["", f"In {len(lost)} of {probed_compared} comparisons of rays and points, another library is faster, in nanoseconds:", ""]
            told += table(["query", "mesh", "kind", subject, "faster", "its time", "times as fast"], lost)
        else:
            told += ["", f"No other library is faster in any of {probed_compared} comparisons of rays and points."]
    if lost := lost_builds(builds, subject):
        told += ["", "Other libraries build faster, or give the first result from the mesh sooner, build included:", ""]
        told += table(["pair", "options", *(head for name in FIRST_COSTS for head in (name, "faster", "times as fast"))], lost)
    lines += marked("losses", told)
    lines += ["", "## All gaps", "", f"How many times as long as {subject} the fastest other library takes whose results are right."]
    for question, title in QUESTIONS.items():
        if any(key[0] == question for key in cells):
            lines += ["", f"### {title} (`{question}`)", "", *ratio_table(cells, question, subject)]
            if charts := plotted(lambda file: file.startswith(question + "-") and file.endswith(".svg") and not of_size(file)):
                lines += ["", *charts]
    if probed:
        lines += probed_lines(builds, probed, list(head["runners"]), subject)
    if wrong:
        lines += ["", "## Wrong results", "", *wrong_table(cells)]
    starts = head.get("starts", 1)
    often = f" Costs are those of the median of {starts} builds." if starts > 1 else ""
    lines += ["", "## Builds, memory, and the first result", "", "All meshes of a pair together; a mesh of rays and points by itself. Bytes are the growth of resident memory, or of the library's file where it maps one." + often, "", *build_table(builds, subject)]
    if batches:
        lines += ["", "## Many poses in one call, on all cores", "", "The time per query, by kind and gap.", "", *batch_table(batches)]
    if failed:
        lines += ["", "## Failures", "", *(f"- {one}" for one in failed)]
    lines += ["", "## Libraries", "", *table(["name", "version", "settings"], [[name, str(of["version"]), str(of["settings"])] for name, of in head["runners"].items()])]
    return lines


def made(folder, place, subject=None):
    """Returns the plots and CSV files of the raw times in a folder, by name, and the page that is to be in a place."""
    head, builds, batches, failed, cells, probed = read(folder)
    names = list(head["runners"])
    subject = subject or ("cbvh" if "cbvh" in names else names[0])
    drawn = plots(cells, names) | {"queries.csv": queries_file(cells), "builds.csv": builds_file(builds)}
    if probed:
        drawn["probes.csv"] = probes_file(probed)
    to_folder, readme = (Path(os.path.relpath(to, place.parent)).as_posix() for to in (folder, Path(__file__).parent / "README.md"))
    lines = page(head, builds, batches, failed, cells, probed, subject, drawn, "" if to_folder == "." else to_folder + "/", readme)
    return drawn, "\n".join(lines) + "\n"


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--page", type=Path, help="the file of the page; DIR/SPEED.md")
    parser.add_argument("--subject", help="the library that ratios are about; cbvh, or the first one")
    arguments = parser.parse_args(argv)
    place = arguments.page or arguments.folder / "SPEED.md"
    drawn, text = made(arguments.folder, place, arguments.subject)
    for file, plotted in drawn.items():
        (arguments.folder / file).write_text(plotted, encoding="utf-8")
    place.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
