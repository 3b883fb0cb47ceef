"""A runner that misbehaves once in so many questions, between the suite and a good runner.

    python bad_runner.py lie|crash|hang|garbage N COMMAND...
"""

import json
import subprocess
import sys
import time


def lied(line):
    """Turns a yes into a no, adds 1 to a number, and replaces everything else."""
    answer = json.loads(line)
    keys = [key for key in ("answer", "lower", "refused") if key in answer]
    truth = answer.pop(keys[0])
    if keys[0] == "refused":
        answer["answer"] = True
    elif isinstance(truth, bool):
        answer["answer"] = not truth
    elif isinstance(truth, float):
        answer[keys[0]] = truth + 1.0
    else:
        answer["answer"] = [[7, 7]] if isinstance(truth, list) else "nowhere"
    return json.dumps(answer) + "\n"


def main():
    how, every, command = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
    good = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    asked = 0
    for line in sys.stdin:
        good.stdin.write(line)
        good.stdin.flush()
        answer = good.stdout.readline()
        if '"ask"' in line:
            asked += 1
            if asked % every == 0:
                if how == "crash":
                    sys.exit(3)
                if how == "hang":
                    time.sleep(1000)
                answer = {"lie": lied, "garbage": lambda _: "pybullet build time\n"}[how](answer)
        sys.stdout.write(answer)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
