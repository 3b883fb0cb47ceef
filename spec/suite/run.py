"""Runs the queries of the suite on a runner, and counts what is wrong.

    python run.py --runner 'COMMAND' [--json]

Needs Python 3.9 or later. Exits with 0 if all results are right, with 1 if not, and with 2 if the runner does not start.
`PROTOCOL.md` says what a runner gets.
"""

import argparse
import json
import reprlib
import sys
import time
from pathlib import Path

import meshes
from exact import SPECIAL, from_hex
from judge import FALSE_NEGATIVE, FALSE_POSITIVE, REFUSED, RIGHT, UNDECIDED, WRONG, is_number, judge
from process import Crashed, Garbage, Hung, Process

HERE = Path(__file__).parent
PROTOCOL = 1
HELLO_SECONDS = 60
# After this many crashes, hangs and lines of garbage, the rest of a case is not asked.
MAX_FAILURES_PER_CASE = 3
# The largest error that a profile may claim, as a part of the number or of the size. With 1, a distance of 0 would always be right.
MAX_CLAIMED_ERROR = 0.01
CLAIMS = ("questions", "coordinates", "placement", "features", "distance_error", "error_unit")
# A longer answer is cut short in a report.
MAX_SHOWN_CHARACTERS = 1000
COUNTS = ("right", "false_negatives", "false_positives", "other_wrong", "garbage", "crashes", "hangs", "refused", "undecided", "unasked")
WORDS = {RIGHT: "right", FALSE_NEGATIVE: "false_negatives", FALSE_POSITIVE: "false_positives", WRONG: "other_wrong", REFUSED: "refused", UNDECIDED: "undecided"}


def read_lines(path):
    with open(path, encoding="utf-8") as lines:
        return [json.loads(line) for line in lines]


def load(folder=HERE / "cases"):
    """Returns the meshes by name and all cases in order."""
    records = {record["mesh"]: record for record in read_lines(folder / "meshes.jsonl")}
    files = sorted(path for path in folder.glob("*.jsonl") if path.name != "meshes.jsonl")
    return {name: meshes.load(record) for name, record in records.items()}, [case for path in files for case in read_lines(path)]


def plain(text):
    """Returns the number of a hex float as JSON has it. What JSON has not stays text."""
    return text if text in SPECIAL else from_hex(text)


def is_claimed(case, profile):
    """Tells whether a runner claims to answer a case."""
    needs = case["needs"]
    return (
        case["ask"] in profile.get("questions", ())
        and (needs["coordinates"] == "f32" or profile.get("coordinates") == "f64")
        and (needs["placement"] == "f32" or profile.get("placement") == "f64")
        and set(needs["features"]) <= set(profile.get("features", ()))
    )


def question(number, case, item):
    """Returns the line of a question."""
    asked = {"id": number, "ask": case["ask"], "a": case["a"]}
    if "b" in case:
        asked["b"] = case["b"]
    for key, value in item.items():
        if key not in ("truth", "grazing"):
            asked[key] = [plain(x) for x in value] if isinstance(value, list) else plain(value)
    return asked


def profile_fault(profile):
    """Returns what is wrong with a greeting, or None."""
    for key in ("questions", "features"):
        names = profile.get(key, [])
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            return f"expected {key} to be a list of names"
    for key, known in (("coordinates", ("f32", "f64")), ("placement", ("f32", "f64")), ("error_unit", ("distance", "size"))):
        if profile.get(key, known[0]) not in known:
            return f"expected {key} to be {known[0]} or {known[1]}"
    error = profile.get("distance_error", 0.0)
    if not is_number(error) or not 0.0 <= error <= MAX_CLAIMED_ERROR:
        return f"expected distance_error to be from 0 to {MAX_CLAIMED_ERROR}"
    return None if profile.get("hello") == PROTOCOL else f"expected hello to be {PROTOCOL}"


def shown(value):
    """Returns what a runner said as the report has it: as text, cut short, if it is long or if JSON cannot state it."""
    try:
        if len(json.dumps(value, allow_nan=False)) <= MAX_SHOWN_CHARACTERS:
            return value
    except (ValueError, RecursionError):
        pass
    return reprlib.repr(value)


class Run:
    """One runner and what it has been found to do."""

    def __init__(self, arguments, meshes_by_name):
        self.arguments, self.meshes = arguments, meshes_by_name
        self.process, self.profile, self.number = None, None, 0
        self.by_ask, self.by_tag, self.examples = {}, {}, {}
        self.cases, self.seconds = 0, []
        self.sizes = {}

    def start(self):
        """Starts the runner and greets it."""
        self.process = Process(self.arguments.runner)
        profile, _ = self.process.exchange({"hello": PROTOCOL}, HELLO_SECONDS if self.profile is None else self.at_most(HELLO_SECONDS))
        if fault := profile_fault(profile):
            raise Garbage(fault)
        if self.profile is not None and any(profile.get(key) != self.profile.get(key) for key in CLAIMS):
            raise Garbage("expected the claims of the first greeting")
        self.profile = profile

    def at_most(self, seconds):
        """Returns the seconds to wait for an answer: no more than the budget leaves."""
        return max(0.0, min(seconds, self.arguments.until - time.monotonic()))

    def stop(self):
        if self.process is not None:
            self.process.stop()
            self.process = None

    def size(self, name):
        """Returns the largest finite coordinate of a mesh."""
        if name not in self.sizes:
            self.sizes[name] = max((abs(from_hex(x)) for p in self.meshes[name][0] for x in p if x not in SPECIAL), default=0.0)
        return self.sizes[name]

    def size_of(self, case, item):
        """Returns the largest coordinate of a question, and for a ray the largest parameter that it makes."""
        size = max(self.size(case[key]) for key in ("a", "b") if key in case)
        for key in ("pose", "point", "origin"):
            finite = [abs(from_hex(x)) for x in item.get(key, ()) if x not in SPECIAL]
            size = max(size, *(finite[3::4] if key == "pose" and len(finite) == 12 else finite), 0.0)
        return size / max(abs(from_hex(x)) for x in item["direction"]) if case["ask"] == "ray" else size

    def send_mesh(self, name):
        if name in self.process.sent:
            return
        vertices, triangles = self.meshes[name]
        message = {"mesh": name, "vertices": [[plain(x) for x in p] for p in vertices], "triangles": triangles}
        answer, _ = self.process.exchange(message, self.at_most(self.arguments.timeout))
        if answer.get("mesh") != name:
            raise Garbage(answer)
        self.process.sent.add(name)

    def ask(self, case, item):
        """Asks one question and returns what became of it, a word of COUNTS, the verdict if there is one, and what the runner said."""
        try:
            if self.process is None:
                self.start()
            for key in ("a", "b"):
                if key in case:
                    self.send_mesh(case[key])
            self.number += 1
            answer, seconds = self.process.exchange(question(self.number, case, item), self.at_most(self.arguments.timeout))
            if answer.get("id") != self.number:
                raise Garbage(answer)
        except (Crashed, Hung, Garbage, OSError) as failure:
            self.stop()
            if isinstance(failure, Hung):
                # What the budget has cut short may not be the runner's fault.
                return "unasked" if self.is_late() else "hangs", None, None
            return "garbage" if isinstance(failure, Garbage) else "crashes", None, str(failure) or None
        self.seconds.append(seconds)
        verdict = judge(case, item, answer, self.profile, self.size_of(case, item))
        return WORDS[verdict.word], verdict, answer

    def is_late(self):
        """Tells whether the budget is spent."""
        return time.monotonic() >= self.arguments.until

    def case(self, case):
        """Asks all questions of a case."""
        self.cases += 1
        failures = 0
        for index, item in enumerate(case["items"]):
            is_left = failures >= MAX_FAILURES_PER_CASE or self.is_late()
            word, verdict, answer = ("unasked", None, None) if is_left else self.ask(case, item)
            failures += word in ("crashes", "hangs", "garbage")
            for group, key in ((self.by_ask, case["ask"]), (self.by_tag, case["tags"][0])):
                row = group.setdefault(key, dict.fromkeys(COUNTS, 0) | {"max_relative_error": 0.0, "max_error_of_size": 0.0})
                row[word] += 1
                if verdict is not None:
                    for name, error in (("max_relative_error", verdict.relative), ("max_error_of_size", verdict.of_size)):
                        # JSON has no infinity.
                        row[name] = max(row[name], min(error or 0.0, sys.float_info.max))
            if word != "right":
                known = self.examples.setdefault((case["ask"], word), [])
                if len(known) < self.arguments.examples:
                    known.append({"case": case["id"], "item": index, "truth": item["truth"], "answer": shown(answer)})

    def report(self, skipped):
        """Returns the object that `--json` prints."""
        total = {word: sum(row[word] for row in self.by_ask.values()) for word in COUNTS}
        wrong = sum(total[word] for word in ("false_negatives", "false_positives", "other_wrong", "garbage"))
        answers = sum(total.values())
        times = sorted(self.seconds)
        return {
            "runner": {key: shown(self.profile.get(key)) for key in ("name", "version", "settings", "coordinates", "placement", "features", "distance_error", "error_unit")},
            "suite": (HERE / "VERSION").read_text().strip(),
            "cases": self.cases,
            "answers": answers,
            "wrong": wrong,
            "skipped_cases": skipped,
            **total,
            "median_microseconds": round(1e6 * times[len(times) // 2], 1) if times else None,
            "by_question": self.by_ask,
            "by_tag": self.by_tag,
            "examples": [{"ask": ask, "what": word, **one} for (ask, word), found in self.examples.items() for one in found],
        }


def is_clean(report):
    """Tells whether nothing is wrong: no wrong answer, no crash, no hang, nothing refused that the profile claims, all asked."""
    return not any(report[key] for key in ("wrong", "crashes", "hangs", "refused", "unasked")) and report["answers"] > 0


def table(report):
    """Returns the counts as lines of text."""
    columns = ("right", "false_negatives", "false_positives", "other_wrong", "garbage", "crashes", "hangs", "refused", "undecided", "unasked")
    head = ("question", "answers", "right", "false neg", "false pos", "wrong", "garbage", "crash", "hang", "refused", "undecided", "unasked", "max rel error", "of size")
    rows = [head]
    for name, row in [*report["by_question"].items(), ("all", report)]:
        errors = [f"{row[key]:.1e}" if row.get(key) else "" for key in ("max_relative_error", "max_error_of_size")]
        rows.append((name, str(sum(row[key] for key in columns)), *(str(row[key]) for key in columns), *errors))
    widths = [max(len(row[i]) for row in rows) for i in range(len(head))]
    lines = ["  ".join(text.ljust(w) if i == 0 else text.rjust(w) for i, (text, w) in enumerate(zip(row, widths))).rstrip() for row in rows]
    for one in report["examples"]:
        lines.append(f"{one['what']}: case {one['case']}, item {one['item']}, {one['ask']}: truth {json.dumps(one['truth'])}, answer {json.dumps(one['answer'])}"[:400])
    return lines


def positive(text):
    """Returns a number above 0 of the command line."""
    if int(text) < 1:
        raise ValueError(text)
    return int(text)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runner", required=True, help="the command of the runner")
    parser.add_argument("--json", action="store_true", help="print one JSON object in place of the table")
    parser.add_argument("--level", type=int, default=3, help="run cases up to this level: 1 plain, 2 boundary, 3 hostile")
    parser.add_argument("--tags", default="", help="run only cases with one of these tags, separated by commas")
    parser.add_argument("--questions", default="", help="run only these queries, separated by commas")
    parser.add_argument("--sample", type=positive, default=1, metavar="N", help="run every Nth case")
    parser.add_argument("--timeout", type=float, default=10.0, help="seconds for one query")
    parser.add_argument("--budget", type=float, default=570.0, help="seconds for everything; what is left then counts as unasked")
    parser.add_argument("--examples", type=int, default=2, help="wrong results to show for each query and kind")
    arguments = parser.parse_args(argv)
    arguments.until = time.monotonic() + arguments.budget
    meshes_by_name, cases = load()
    run = Run(arguments, meshes_by_name)
    try:
        return ask_all(run, arguments, cases)
    finally:
        run.stop()


def ask_all(run, arguments, cases):
    """Greets the runner, asks it the cases that are chosen, prints the report, and returns the exit code."""
    try:
        run.start()
    except (Crashed, Hung, Garbage, OSError, ValueError) as failure:
        found = {Crashed: "the end of its output", Hung: f"nothing within {HELLO_SECONDS} seconds"}.get(type(failure), failure)
        print(f"{arguments.runner}: expected an answer to {json.dumps({'hello': PROTOCOL})}, found {found}", file=sys.stderr)
        return 2
    tags, questions = set(filter(None, arguments.tags.split(","))), set(filter(None, arguments.questions.split(",")))
    chosen = [c for c in cases if c["level"] <= arguments.level and (not tags or tags & set(c["tags"])) and (not questions or c["ask"] in questions)]
    chosen = chosen[:: arguments.sample]
    asked = [case for case in chosen if is_claimed(case, run.profile)]
    for case in asked:
        run.case(case)
    report = run.report(len(chosen) - len(asked))
    print(json.dumps(report, allow_nan=False) if arguments.json else "\n".join(table(report)))
    return 0 if is_clean(report) else 1


if __name__ == "__main__":
    sys.exit(main())
