"""Prints the reports of several runs, made by `run.py --json`, as a table in Markdown.

    python compare.py REPORT.json...
"""

import json
import sys
from pathlib import Path


def cell(value):
    return str(value) if value else "0"


def error(value):
    return f"{value:.0e}" if value else "0"


def main():
    print("| runner | version | question | answers | right | missed | invented | otherwise wrong | crashes, hangs | refused | undecided | error, of the number | of the size |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    for path in sys.argv[1:]:
        report = json.loads(Path(path).read_text(encoding="utf-8").splitlines()[-1])
        name, version = (str(report["runner"][key]) for key in ("name", "version"))
        for ask, row in report["by_question"].items():
            counts = ("right", "false_negatives", "false_positives", "other_wrong", "garbage", "crashes", "hangs", "refused", "undecided", "unasked")
            answers = sum(row[key] for key in counts)
            numbers = ask in ("distance", "closest", "ray")
            errors = [error(row[key]) if numbers else "" for key in ("max_relative_error", "max_error_of_size")]
            shown = (row["false_negatives"], row["false_positives"], row["other_wrong"] + row["garbage"], row["crashes"] + row["hangs"], row["refused"], row["undecided"])
            print("| " + " | ".join((name, version, ask, str(answers), str(row["right"]), *map(cell, shown), *errors)) + " |")


if __name__ == "__main__":
    main()
