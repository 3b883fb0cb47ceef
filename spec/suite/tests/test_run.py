"""A runner that answers by the truth is found right, and those that lie, crash, hang or babble are found out and survived."""

import contextlib
import io
import json
import os
import shlex
import subprocess
import sys
import time
import unittest
from pathlib import Path

SUITE = Path(__file__).parent.parent
sys.path.insert(0, str(SUITE))

import run

HONEST = [sys.executable, str(SUITE / "runners" / "exact_runner.py")]


def through(how, every):
    return [sys.executable, str(SUITE / "tests" / "bad_runner.py"), how, str(every), *HONEST]


def asked(command, *options):
    """Returns the exit code and the report of a run on a few cases."""
    output, joined = io.StringIO(), shlex.join(command) if os.name == "posix" else subprocess.list2cmdline(command)
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        code = run.main(["--runner", joined, "--json", *(options or ("--sample", "61", "--level", "2"))])
    return code, json.loads(output.getvalue().splitlines()[-1], parse_constant=no_json) if code != 2 else output.getvalue()


def no_json(text):
    raise ValueError(f"expected JSON, found {text}")


def odd(answer, **claims):
    return [sys.executable, str(SUITE / "tests" / "odd_runner.py"), answer, json.dumps(claims)]


class Runs(unittest.TestCase):
    def test_the_truth_is_right(self):
        code, report = asked(HONEST, "--sample", "37")
        self.assertEqual((code, report["wrong"], report["right"]), (0, 0, report["answers"]), report["examples"])
        self.assertGreater(report["answers"], 200)
        self.assertGreater(len(report["by_question"]), 8)

    def test_a_lie_in_fifty_answers_is_caught(self):
        code, report = asked(through("lie", 50))
        self.assertEqual(code, 1)
        # Each lie is found, and nothing else.
        self.assertEqual(report["wrong"], report["answers"] // 50)
        self.assertGreater(report["wrong"], 3)
        self.assertEqual((report["crashes"], report["hangs"], report["garbage"]), (0, 0, 0))

    def test_crashes_are_counted_and_the_runner_starts_again(self):
        code, report = asked(through("crash", 40))
        self.assertEqual((code, report["wrong"]), (1, 0))
        self.assertGreaterEqual(report["crashes"], 2)
        self.assertEqual(report["right"] + report["crashes"] + report["unasked"], report["answers"])
        self.assertGreater(report["right"], 20 * report["crashes"])

    def test_hangs_are_counted_and_the_runner_starts_again(self):
        code, report = asked(through("hang", 60), "--sample", "61", "--level", "2", "--timeout", "1")
        self.assertEqual(code, 1)
        self.assertGreaterEqual(report["hangs"], 1)
        self.assertGreater(report["right"], 40 * report["hangs"])

    def test_garbage_is_wrong(self):
        code, report = asked(through("garbage", 50))
        self.assertEqual(code, 1)
        self.assertGreater(report["garbage"], 0)
        self.assertEqual(report["wrong"], report["garbage"])

    def test_a_runner_that_always_crashes_is_not_asked_forever(self):
        code, report = asked(through("crash", 1), "--sample", "400")
        self.assertEqual((code, report["right"]), (1, 0))
        self.assertEqual(report["crashes"] + report["unasked"], report["answers"])
        self.assertLessEqual(report["crashes"], 3 * report["cases"])

    def test_what_does_not_greet_does_not_run(self):
        self.assertEqual(asked([sys.executable, "-c", "print('hello')"])[0], 2)
        self.assertEqual(asked(["/no/such/runner"])[0], 2)
        for command in ("", "'"):
            with contextlib.redirect_stderr(io.StringIO()):
                self.assertEqual(run.main(["--runner", command]), 2)

    def test_claims_that_are_none_do_not_run(self):
        for claims in (
            {"hello": 2}, {"questions": "collide"}, {"questions": 5}, {"features": [["open"]]}, {"coordinates": "f16"}, {"error_unit": "metre"},
            {"distance_error": "1"}, {"distance_error": -1}, {"distance_error": 1.0}, {"distance_error": float("nan")}, {"distance_error": 10**400},
        ):  # fmt: skip
            self.assertEqual(asked(odd("", **claims))[0], 2, claims)

    def test_who_claims_nothing_has_not_passed(self):
        code, report = asked(odd("", questions=[]))
        self.assertEqual((code, report["cases"], report["answers"], report["wrong"]), (1, 0, 0, 0))

    def test_who_refuses_everything_has_not_passed(self):
        code, report = asked(odd('{"id": ID, "refused": true}'))
        self.assertEqual((code, report["right"], report["refused"]), (1, 0, report["answers"]))

    def test_odd_answers_are_wrong_and_end_nothing(self):
        long, deep = "1" * 400, "[" * 500 + "]" * 500
        for answer in (
            '"nan"', "NaN", "-Infinity", "1e999", long, f'"{"x" * 10**5}"', "[" + "[1, 1], " * 10**4 + "[1, 1]]", deep, '"\\ud800"',
            "null", "{}", '[["0", "1"]]', "[[1e999, 0]]", f"[[{long}, {long}]]", '1, "lower": NaN, "upper": Infinity', '-5, "t": 1e308',
        ):  # fmt: skip
            code, report = asked(odd(f'{{"id": ID, "answer": {answer}}}'), "--sample", "211")
            # Only a motion that grazes may be undecided.
            undecided = report["by_question"].get("motion", {}).get("undecided", 0) if answer == "null" else 0
            self.assertEqual((code, report["right"], report["wrong"] + undecided), (1, 0, report["answers"]), answer)
            self.assertLess(len(json.dumps(report)), 50_000)

    def test_an_answer_to_another_question_is_garbage(self):
        for line in ('{"id": 0, "answer": true}', '{"answer": true}', '{"id": "ID", "answer": true}', "[]"):
            code, report = asked(odd(line), "--sample", "601")
            self.assertEqual((code, report["garbage"] + report["unasked"]), (1, report["answers"]))
            self.assertGreater(report["garbage"], 0)

    def test_claims_cannot_change_when_the_runner_starts_again(self):
        one = run.Run(None, {})
        one.profile = {"hello": 1, "distance_error": 0.0}
        one.arguments = type("Arguments", (), {"until": time.monotonic() + 60, "runner": shlex.join(odd(""))})
        with self.assertRaises(run.Garbage):
            one.start()
        one.stop()

    def test_the_largest_coordinate_counts_the_origin_of_a_ray(self):
        item = {"origin": ["0x1p+10", "-0x1p+11", "0x0p+0"], "direction": ["0x0p+0", "0x1p+2", "0x0p+0"]}
        one = run.Run(None, {"a": ([["0x1p+0", "0x0p+0", "0x0p+0"]], [])})
        self.assertEqual(one.size_of({"ask": "ray", "a": "a"}, item), 512.0)

    def test_hangs_do_not_outlast_the_budget(self):
        started = time.monotonic()
        code, report = asked(through("hang", 1), "--timeout", "1000", "--budget", "3")
        self.assertEqual((code, report["hangs"], report["unasked"]), (1, 0, report["answers"]))
        self.assertLess(time.monotonic() - started, 20)

    def test_a_budget_ends_the_run(self):
        code, report = asked(HONEST, "--budget", "0")
        self.assertEqual((code, report["unasked"]), (1, report["answers"]))


if __name__ == "__main__":
    unittest.main()
