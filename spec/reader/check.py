"""The command of the reader: checks .cbvh files against the specification, or answers queries between two files.

    python3 check.py FILE...                                      checks every rule, including R35 and R39
    python3 check.py --strict FILE...                             also checks what binds only writers
    python3 check.py --query collide|contacts|distance A B POSES  prints one answer per line
    python3 check.py --query ... A B --pose "12 numbers"

A pose places B in A's frame. It is 12 numbers, the rows of a 3x4 matrix. A pose file has one pose per line, and #
starts a comment. Exit codes are those of `cbvh`: 0 success, 1 wrong usage, 2 a file cannot be read, 3 a file is
refused.
"""

import argparse
import sys

import musts
import query
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


def ask(mode, paths, pose, limit):
    texts = []
    for path in paths[2:]:
        with open(path, encoding="utf-8") as stream:
            texts.append(stream.read())
    poses = query.read_poses("\n".join(texts + ([pose] if pose else [])))[:limit]
    files = [load(path) for path in paths[:2]]
    a, b = map(query.corners, files)
    weights_a, weights_b = map(query.weights, files)
    for one in poses:
        placed = query.place(b, one)
        if mode == "distance":
            print(f"{query.least_distance(a, placed):.17g}")
        else:
            of_a, of_b = query.contacts(a, placed)
            count = int((weights_a[of_a] * weights_b[of_b]).sum())
            print(count if mode == "contacts" else int(count > 0))


def main(arguments):
    parser = Parser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("--strict", action="store_true")
    parser.add_argument("--query", choices=["collide", "contacts", "distance"])
    parser.add_argument("--pose")
    parser.add_argument("--limit", type=int, help="use only the first LIMIT poses")
    options = parser.parse_args(arguments)
    if options.query and (len(options.files) < 2 or (len(options.files) < 3 and not options.pose)):
        parser.error("a query needs two files and poses")
    try:
        if not options.query:
            accepted = [check(path, options.strict) for path in options.files]
            return OK if all(accepted) else INVALID
        ask(options.query, options.files, options.pose, options.limit)
        return OK
    except rules.Broken as broken:
        print(f"check.py: {broken}", file=sys.stderr)
        return INVALID
    except ValueError as error:
        print(f"check.py: poses: {error}", file=sys.stderr)
        return INVALID
    except OSError as error:
        print(f"check.py: {error}", file=sys.stderr)
        return SYSTEM


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
