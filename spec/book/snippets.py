"""Writes the C and C++ blocks of the book that are no whole programs into one file, which a compiler checks.

    snippets.py FILE.cpp
"""

import pathlib
import sys

import check

# The names that blocks use without declaring them.
HEAD = """#include <cbvh.hpp>
#include <cstdio>
using cbvh::check;
extern const cbvh::Mesh room, robot, part;
extern cbvh::Querier querier;
extern cbvh::Scene scene;
extern cbvh::Robot arm;
extern const cbvh::Pose pose, pose_a, pose_b, start, goal;
extern const std::vector<cbvh::Pose> poses, starts, ends;
extern const std::vector<double> q, q0, q1;
"""


def main() -> None:
    parts = [HEAD]
    for path in check.pages.chapters():
        for block, _ in check.pairs(path):
            if block.language in ("c", "cpp") and "ignore" not in block.words and check.shown_file(block) is None:
                parts.append(f'void block_{len(parts)}() {{\n#line {block.line + 1} "{check.name(path)}"\n{block.text}}}\n')
    assert len(parts) > 2, "expected more blocks of C++"
    pathlib.Path(sys.argv[1]).write_text("".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
