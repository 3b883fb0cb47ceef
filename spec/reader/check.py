"""The command of the reader: checks .cbvh files against the specification.

    python3 check.py FILE...             checks every rule, including R35 and R39
    python3 check.py --strict FILE...    also checks what binds only writers

Exit codes are those of `cbvh`: 0 success, 1 wrong usage, 2 a file cannot be read, 3 a file is refused.
"""

import argparse
import sys

import musts
import rules

OK, USAGE, SYSTEM, INVALID = 0, 1, 2, 3


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.print_usage(sys.stderr)
        self.exit(USAGE, f"{self.prog}: {message}\n")


def load(path):
    """Returns the file if it breaks no rule."""
    with open(path, "rb") as stream:
        file = rules.validate(stream.read())
    rules.verify(file)
    return file


def summary(file):
    def total(field):
        return sum(getattr(one, field) for one in file.objects)

    layouts = sorted({f"{one.layout.name} {rules.cbvh.ENCODINGS[one.triangle_encoding]}" for one in file.objects})
    counts = [f"{len(file.objects)} objects", *(f"{total(what)} {what}" for what in ("triangles", "pages", "treelets"))]
    if file.instances:
        counts.append(f"{len(file.instances)} instances")
    return ", ".join(counts + layouts)


def check(path, strict):
    """Prints the verdict on a file and returns whether it is accepted."""
    try:
        file = load(path)
    except rules.Broken as broken:
        print(f"{path}: {broken}")
        return False
    violations = list(musts.violations(file)) if strict else []
    for violation in violations:
        print(f"{path}: {violation}")
    if not violations:
        print(f"{path}: ok: {summary(file)}")
    return not violations


def main(arguments):
    parser = Parser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("--strict", action="store_true")
    options = parser.parse_args(arguments)
    try:
        accepted = [check(path, options.strict) for path in options.files]
        return OK if all(accepted) else INVALID
    except OSError as error:
        print(f"check.py: {error}", file=sys.stderr)
        return SYSTEM


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
