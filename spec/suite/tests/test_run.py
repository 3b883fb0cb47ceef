"""A runner that answers by the truth is found right, and those that lie, crash, hang or babble are found out and survived."""

import contextlib
import io
import json
import shlex
import sys
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
    output = io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        code = run.main(["--runner", shlex.join(command), "--json", *(options or ("--sample", "61", "--level", "2"))])
    return code, json.loads(output.getvalue().splitlines()[-1]) if code != 2 else output.getvalue()


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

    def test_a_budget_ends_the_run(self):
        code, report = asked(HONEST, "--budget", "0")
        self.assertEqual((code, report["unasked"]), (1, report["answers"]))


if __name__ == "__main__":
    unittest.main()
