"""Compares the reports of several runs, made by `run.py --json`: a CSV file of all queries, and a table in Markdown.

    python compare.py [--csv FILE] REPORT.json...
"""

import argparse
import csv
import json
import sys
from pathlib import Path

COUNTS = ("results", "right", "missed", "invented", "otherwise wrong", "crashes, hangs", "refused", "undecided")
COLUMNS = ("runner", "version", "query", *COUNTS, "error of the number", "error of the size")


def error(value):
    return f"{value:.0e}" if value else "0"


def rows_of(report):
    """Returns a row of `COLUMNS` for each query of a report."""
    rows = []
    for ask, row in report["by_question"].items():
        keys = ("right", "false_negatives", "false_positives", "other_wrong", "garbage", "crashes", "hangs", "refused", "undecided", "unasked")
        counts = (sum(row[key] for key in keys), row["right"], row["false_negatives"], row["false_positives"], row["other_wrong"] + row["garbage"], row["crashes"] + row["hangs"], row["refused"], row["undecided"])
        numbers = ask in ("distance", "closest", "ray")
        errors = [error(row[key]) if numbers else "" for key in ("max_relative_error", "max_error_of_size")]
        rows.append([report["runner"]["name"], report["runner"]["version"], ask, *counts, *errors])
    return [list(map(str, row)) for row in rows]


def summary(rows):
    """Returns a table in Markdown with a row for each runner."""
    lines = ["| runner | version | queries | " + " | ".join(COUNTS) + " |", "|" + "---|" * (3 + len(COUNTS))]
    for runner, version in dict.fromkeys((row[0], row[1]) for row in rows):
        of = [row for row in rows if row[0] == runner]
        totals = [sum(int(row[3 + k]) for row in of) for k in range(len(COUNTS))]
        lines.append("| " + " | ".join((runner, version, str(len(of)), *(f"{total:,}" for total in totals))) + " |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("reports", nargs="+", type=Path)
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write a row for each query of each runner")
    arguments = parser.parse_args()
    reports = [json.loads(path.read_text(encoding="utf-8").splitlines()[-1]) for path in arguments.reports]
    rows = [row for report in reports for row in rows_of(report)]
    if arguments.csv:
        with open(arguments.csv, "w", encoding="utf-8", newline="") as output:
            csv.writer(output, lineterminator="\n").writerows([COLUMNS, *rows])
    print("\n".join(summary(rows)))


if __name__ == "__main__":
    sys.exit(main())
