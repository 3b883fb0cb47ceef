"""A runner as a process: one line in, one line out, with a time limit."""

import json
import os
import queue
import shlex
import signal
import subprocess
import threading
import time


class Crashed(Exception):
    """The runner has ended without an answer."""


class Hung(Exception):
    """The runner has not answered in time."""


class Garbage(Exception):
    """The runner has written something else than an answer to the question."""


class Process:
    """A running runner, and the meshes that it has been sent."""

    def __init__(self, command, timeout):
        self.timeout, self.sent = timeout, set()
        self.child = subprocess.Popen(
            shlex.split(command, posix=os.name == "posix"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
        self.lines = queue.SimpleQueue()
        threading.Thread(target=self.read, args=(self.child.stdout, self.lines), daemon=True).start()

    @staticmethod
    def read(stream, lines):
        """Puts all lines into a queue, and None at their end."""
        try:
            for line in stream:
                lines.put(line)
        except (OSError, ValueError):
            pass
        lines.put(None)

    def exchange(self, message, timeout=None):
        """Sends an object as one line, and returns the object of the next line and the seconds that it took."""
        started = time.perf_counter()
        try:
            self.child.stdin.write(json.dumps(message) + "\n")
            self.child.stdin.flush()
            line = self.lines.get(timeout=self.timeout if timeout is None else timeout)
        except (BrokenPipeError, OSError) as error:
            raise Crashed from error
        except queue.Empty as error:
            raise Hung from error
        seconds = time.perf_counter() - started
        if line is None:
            raise Crashed
        try:
            answer = json.loads(line)
        except ValueError as error:
            raise Garbage(line) from error
        if not isinstance(answer, dict):
            raise Garbage(line)
        return answer, seconds

    def stop(self):
        """Ends the runner and what it has started."""
        try:
            os.killpg(self.child.pid, signal.SIGKILL)
        except (AttributeError, ProcessLookupError, PermissionError):
            self.child.kill()
        self.child.wait()
        for stream in (self.child.stdin, self.child.stdout):
            try:
                stream.close()
            except OSError:
                pass
