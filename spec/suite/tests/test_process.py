"""A runner that does not read, does not stop writing, or leaves children behind does not block the suite."""

import os
import shlex
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

import process
from process import Crashed, Garbage, Hung, Process

SECONDS = 20.0


def python(program):
    """Returns a runner that reads its first line, if the program asks for it with `hear`, and then does as the program says."""
    command = [sys.executable, "-c", "import os, sys, time\nsay, hear = (lambda s: os.write(1, s)), sys.stdin.readline\n" + program]
    return Process(shlex.join(command) if os.name == "posix" else subprocess.list2cmdline(command))


class Processes(unittest.TestCase):
    def setUp(self):
        self.started = time.monotonic()

    def tearDown(self):
        self.assertLess(time.monotonic() - self.started, SECONDS)

    def fails_with(self, what, program, message=None, seconds=SECONDS, good=0):
        """Checks that so many exchanges succeed, and that the next one fails, and not only at the end of its time."""
        runner = python(program)
        try:
            for _ in range(good):
                self.assertEqual(runner.exchange({}, SECONDS)[0], {"id": 1})
            with self.assertRaises(what) as caught:
                runner.exchange(message or {}, seconds)
            return str(caught.exception)
        finally:
            runner.stop()

    def test_a_runner_that_does_not_read_hangs_by_itself(self):
        self.fails_with(Hung, "time.sleep(1000)", {"much": "x" * 10**6}, 1.0)

    def test_a_line_without_an_end_is_garbage_when_it_is_too_long(self):
        shown = self.fails_with(Garbage, "while True: say(b'[' * 65536)")
        self.assertLessEqual(len(shown), process.MAX_SHOWN_CHARACTERS)

    def test_what_is_no_object_is_garbage(self):
        for line in ("b'\\n'", "b'[1]\\n'", "b'\\xff\\n'", "b'{\"id\": }\\n'", "b'[' * 10**6 + b'\\n'"):
            self.fails_with(Garbage, f"hear(); say({line}); time.sleep(1000)")

    def test_a_line_that_is_cut_off_is_a_crash(self):
        self.fails_with(Crashed, "hear(); say(b'{\"id\": 1}')")

    def test_an_answer_before_its_question_is_garbage(self):
        runner = python("hear(); say(b'{\"id\": 1}\\n{\"id\": 1}\\n'); time.sleep(1000)")
        runner.exchange({}, SECONDS)
        while runner.lines.empty():
            time.sleep(0.01)
        with self.assertRaises(Garbage):
            runner.exchange({}, SECONDS)
        runner.stop()

    def test_a_runner_that_dies_after_an_answer_has_crashed(self):
        self.fails_with(Crashed, "hear(); say(b'{\"id\": 1}\\n')", good=1)

    def test_a_long_integer_is_read_as_a_float(self):
        runner = python("hear(); say(b'{\"answer\": ' + b'1' * 10**6 + b'}\\n'); time.sleep(1000)")
        self.assertEqual(runner.exchange({}, SECONDS)[0], {"answer": float("inf")})
        runner.stop()

    def test_both_ends_of_lines_are_read(self):
        runner = python("hear(); say(b'{\"id\": 1}\\r\\n'); hear()")
        self.assertEqual(runner.exchange({}, SECONDS)[0], {"id": 1})
        runner.stop()

    @unittest.skipUnless(hasattr(os, "fork"), "only POSIX forks")
    def test_a_child_that_leaves_the_group_and_keeps_the_pipes_open_blocks_nothing(self):
        leave = f"if os.fork() == 0:\n os.setsid(); time.sleep({SECONDS + 10}); os._exit(0)\n"
        self.fails_with(Crashed, leave + "hear(); os._exit(1)")
        self.fails_with(Hung, leave + "time.sleep(1000)", {"much": "x" * 10**6}, 1.0)


if __name__ == "__main__":
    unittest.main()
