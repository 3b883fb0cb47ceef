"""Asks a runner the questions of the suite, and counts what is wrong.

    python run.py --runner 'COMMAND' [--json]

Needs Python 3.9 or later. Exits with 0 if all answers are right, with 1 if not, and with 2 if the runner does not start.
`PROTOCOL.md` tells what a runner is asked.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import meshes
from exact import SPECIAL, from_hex
from judge import FALSE_NEGATIVE, FALSE_POSITIVE, REFUSED, RIGHT, UNDECIDED, WRONG, judge
from process import Crashed, Garbage, Hung, Process

HERE = Path(__file__).parent
PROTOCOL = 1
HELLO_SECONDS = 60
# After this many crashes and hangs, the rest of a case is not asked.
MAX_FAILURES_PER_CASE = 3
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


class Run:
    """One runner and what it has been found to do."""

    def __init__(self, arguments, meshes_by_name):
        self.arguments, self.meshes = arguments, meshes_by_name
        self.process, self.profile, self.number = None, None, 0
        self.by_ask, self.by_tag, self.examples = {}, {}, {}
        self.cases, self.seconds, self.starts = 0, [], 0
        self.sizes = {}

    def start(self):
        """Starts the runner and greets it."""
        self.process, self.starts = Process(self.arguments.runner, self.arguments.timeout), self.starts + 1
        profile, _ = self.process.exchange({"hello": PROTOCOL}, HELLO_SECONDS)
        if profile.get("hello") != PROTOCOL:
            raise Garbage(profile)
        self.profile = profile

    def stop(self):
        if self.process is not None:
            self.process.stop()
            self.process = None

    def size(self, name):
        """Returns the largest finite coordinate of a mesh."""
        if name not in self.sizes:
            self.sizes[name] = max((abs(from_hex(x)) for p in self.meshes[name][0] for x in p if x not in SPECIAL), default=0.0)
        return self.sizes[name]

    def send_mesh(self, name):
        if name in self.process.sent:
            return
        vertices, triangles = self.meshes[name]
        message = {"mesh": name, "vertices": [[plain(x) for x in p] for p in vertices], "triangles": triangles}
        answer, _ = self.process.exchange(message)
        if answer.get("mesh") != name:
            raise Garbage(answer)
        self.process.sent.add(name)

    def ask(self, case, item):
        """Asks one question and returns what became of it, a word of COUNTS, and the verdict if there is one."""
        try:
            if self.process is None:
                self.start()
            for key in ("a", "b"):
                if key in case:
                    self.send_mesh(case[key])
            self.number += 1
            answer, seconds = self.process.exchange(question(self.number, case, item))
            if answer.get("id") != self.number:
                raise Garbage(answer)
        except (Crashed, Hung, Garbage) as failure:
            self.stop()
            return {Crashed: "crashes", Hung: "hangs", Garbage: "garbage"}[type(failure)], None, None
        self.seconds.append(seconds)
        size = max(self.size(case[key]) for key in ("a", "b") if key in case)
        for key in ("pose", "point"):
            finite = [abs(from_hex(x)) for x in item.get(key, ()) if x not in SPECIAL]
            size = max(size, *(finite[3::4] if key == "pose" and len(finite) == 12 else finite), 0.0)
        if case["ask"] == "ray":
            size /= max(abs(from_hex(x)) for x in item["direction"])
        verdict = judge(case, item, answer, self.profile, size)
        return WORDS[verdict.word], verdict, answer

    def case(self, case):
        """Asks all questions of a case."""
        self.cases += 1
        failures = 0
        for index, item in enumerate(case["items"]):
            late = time.monotonic() > self.arguments.until
            word, verdict, answer = ("unasked", None, None) if failures >= MAX_FAILURES_PER_CASE or late else self.ask(case, item)
            failures += word in ("crashes", "hangs", "garbage")
            for group, key in ((self.by_ask, case["ask"]), (self.by_tag, case["tags"][0])):
                row = group.setdefault(key, dict.fromkeys(COUNTS, 0) | {"max_relative_error": 0.0, "max_error_of_size": 0.0})
                row[word] += 1
                if verdict is not None and verdict.relative is not None:
                    row["max_relative_error"] = max(row["max_relative_error"], verdict.relative)
                if verdict is not None and verdict.of_size is not None:
                    row["max_error_of_size"] = max(row["max_error_of_size"], verdict.of_size)
            if word != "right":
                known = self.examples.setdefault((case["ask"], word), [])
                if len(known) < self.arguments.examples:
                    known.append({"case": case["id"], "item": index, "truth": item["truth"], "answer": answer})

    def report(self, skipped):
        """Returns the object that `--json` prints."""
        total = {word: sum(row[word] for row in self.by_ask.values()) for word in COUNTS}
        wrong = sum(total[word] for word in ("false_negatives", "false_positives", "other_wrong", "garbage"))
        answers = sum(total.values())
        times = sorted(self.seconds)
        return {
            "runner": {key: self.profile.get(key) for key in ("name", "version", "settings", "coordinates", "placement", "features", "distance_error", "error_unit")},
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


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runner", required=True, help="the command of the runner")
    parser.add_argument("--json", action="store_true", help="print one JSON object in place of the table")
    parser.add_argument("--level", type=int, default=3, help="ask cases up to this level: 1 plain, 2 boundary, 3 hostile")
    parser.add_argument("--tags", default="", help="ask only cases with one of these tags, separated by commas")
    parser.add_argument("--questions", default="", help="ask only these questions, separated by commas")
    parser.add_argument("--sample", type=int, default=1, metavar="N", help="ask every Nth case")
    parser.add_argument("--timeout", type=float, default=10.0, help="seconds for one answer")
    parser.add_argument("--budget", type=float, default=600.0, help="seconds for everything; what is left then counts as unasked")
    parser.add_argument("--examples", type=int, default=2, help="wrong answers to show for each question and kind")
    arguments = parser.parse_args(argv)
    arguments.until = time.monotonic() + arguments.budget
    meshes_by_name, cases = load()
    run = Run(arguments, meshes_by_name)
    try:
        run.start()
    except (Crashed, Hung, Garbage, OSError) as failure:
        run.stop()
        print(f"{arguments.runner}: expected a greeting, found {type(failure).__name__}: {failure}", file=sys.stderr)
        return 2
    tags, questions = set(filter(None, arguments.tags.split(","))), set(filter(None, arguments.questions.split(",")))
    chosen = [c for c in cases if c["level"] <= arguments.level and (not tags or tags & set(c["tags"])) and (not questions or c["ask"] in questions)]
    chosen = chosen[:: arguments.sample]
    asked = [case for case in chosen if is_claimed(case, run.profile)]
    for case in asked:
        run.case(case)
    run.stop()
    report = run.report(len(chosen) - len(asked))
    print(json.dumps(report) if arguments.json else "\n".join(table(report)))
    return 0 if is_clean(report) else 1


if __name__ == "__main__":
    sys.exit(main())
