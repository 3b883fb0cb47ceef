"""Runs the Python blocks of the book, and compares their output with the `text` block that follows them.

The blocks of a page run in order, with the same names, in a new folder where `testdata` is that of the repository. A block marked
`ignore` is only compiled. A block that needs a library names it as `needs=NAME`, and is left out where that is not installed: `.ci/python`
runs this test again with trimesh.
"""

import contextlib
import importlib.util
import io
import os
import pathlib
import sys
import tempfile
import traceback
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "spec/book"))

import check  # noqa: E402


@unittest.skipIf(os.name == "nt", "links to folders need rights on Windows")
class Book(unittest.TestCase):
    def test_python_blocks(self):
        ran = 0
        for path in check.pages.chapters():
            with self.subTest(path=check.name(path)):
                ran += self.run_page(path)
        self.assertGreater(ran, 15)

    def run_page(self, path):
        names, ran = {"__name__": "__main__"}, 0
        with tempfile.TemporaryDirectory() as place, contextlib.ExitStack() as back:
            back.callback(os.chdir, os.getcwd())
            os.chdir(place)
            os.symlink(ROOT / "testdata", "testdata")
            for block, shown in check.pairs(path):
                if block.language != "python":
                    continue
                program = compile(block.text, f"{check.name(path)}:{block.line}", "exec")
                if "ignore" in block.words:
                    continue
                needed = [word.removeprefix("needs=") for word in block.words if word.startswith("needs=")]
                if any(importlib.util.find_spec(name) is None for name in needed):
                    continue
                said = io.StringIO()
                try:
                    with contextlib.redirect_stdout(said):
                        exec(program, names)
                except Exception:
                    self.fail(f"{check.name(path)}:{block.line}: {traceback.format_exc()}")
                ran += 1
                if shown is not None and not check.expected(shown, said.getvalue()):
                    self.fail(f"{check.name(path)}:{block.line}: expected\n{shown}found\n{said.getvalue()}")
            # Nothing keeps a file of the folder open.
            names.clear()
        return ran


if __name__ == "__main__":
    unittest.main()
