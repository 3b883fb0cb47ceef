"""A runner as a process: one line in, one line out, with a time limit."""

import json
import os
import queue
import shlex
import signal
import subprocess
import threading
import time

# A line that is longer is garbage. The longest answers are lists of pairs: all pairs of two meshes of 512 triangles take 3 MB.
MAX_LINE_BYTES = 2**23
# An integer that is longer is read as a float. Python reads integers in quadratic time.
MAX_INTEGER_CHARACTERS = 20
# So often a runner that does not answer is looked at: it may have ended.
SECONDS_BETWEEN_LOOKS = 0.2
# What is shown of a line that is garbage.
MAX_SHOWN_CHARACTERS = 200


class Crashed(Exception):
    """The runner has ended without an answer."""


class Hung(Exception):
    """The runner has not answered in time."""


class Garbage(Exception):
    """The runner has written something else than an answer to the question."""

    def __init__(self, line):
        text = line.decode("utf-8", "replace") if isinstance(line, bytes) else str(line)
        super().__init__(text[:MAX_SHOWN_CHARACTERS])


class Process:
    """A running runner, and the meshes that it has been sent.

    Two threads write and read, and each closes its own pipe. A runner that does not read, or whose children keep its pipes open after its
    end, then blocks such a thread, and not the suite: a pipe in use cannot be closed from another thread without waiting for it.
    """

    def __init__(self, command):
        self.sent, self.stopped = set(), False
        self.child = subprocess.Popen(
            # Windows splits a command by itself.
            (shlex.split(command) or [""]) if os.name == "posix" else command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self.messages, self.lines = queue.SimpleQueue(), queue.SimpleQueue()
        threading.Thread(target=self.write, daemon=True).start()
        threading.Thread(target=self.read, daemon=True).start()

    def write(self):
        """Writes all messages of a queue, until None."""
        try:
            with self.child.stdin as stream:
                while (message := self.messages.get()) is not None:
                    stream.write(message)
                    stream.flush()
        except OSError:
            pass  # The runner has ended, which its output tells as well.

    def read(self):
        """Puts all lines into a queue, and None at their end. A line without an end is none, unless it is too long."""
        try:
            with self.child.stdout as stream:
                while (line := stream.readline(MAX_LINE_BYTES)) and not self.stopped:
                    if line.endswith(b"\n") or len(line) == MAX_LINE_BYTES:
                        self.lines.put(line)
        except OSError:
            pass
        self.lines.put(None)

    def exchange(self, message, timeout):
        """Sends an object as one line, and returns the object of the next line and the seconds that it took."""
        if not self.lines.empty():
            # The end of the output, or an answer that comes before its question.
            raise Crashed if (line := self.lines.get()) is None else Garbage(line)
        started = time.perf_counter()
        self.messages.put(json.dumps(message).encode() + b"\n")
        return parsed(self.line(started + timeout)), time.perf_counter() - started

    def line(self, until):
        """Returns the next line, or None at the end. The end of the runner counts, even if a child keeps its output open."""
        while True:
            has_ended = self.child.poll() is not None
            left = until - time.perf_counter()
            try:
                return self.lines.get(timeout=max(0.0, min(left, SECONDS_BETWEEN_LOOKS)))
            except queue.Empty:
                if has_ended:
                    return None
                if left <= 0.0:
                    raise Hung from None

    def stop(self):
        """Ends the runner and what it has started."""
        self.stopped = True
        self.messages.put(None)
        try:
            if os.name == "posix":
                os.killpg(self.child.pid, signal.SIGKILL)
            else:
                subprocess.run(["taskkill", "/T", "/F", "/PID", str(self.child.pid)], capture_output=True, check=False)
        except OSError:
            pass
        self.child.kill()
        self.child.wait()


def parsed(line):
    """Returns the object of a line, or raises what the line is instead of one."""
    if line is None:
        raise Crashed
    try:
        answer = json.loads(line, parse_int=lambda text: int(text) if len(text) <= MAX_INTEGER_CHARACTERS else float(text))
    except (ValueError, RecursionError) as error:
        raise Garbage(line) from error
    if not isinstance(answer, dict):
        raise Garbage(line)
    return answer
