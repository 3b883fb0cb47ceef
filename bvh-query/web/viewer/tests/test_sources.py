"""The hash of the sources of the page changes with each of them, and with nothing else."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).parents[1] / "sources"
REPOSITORY = SCRIPT.parents[3]
PLACE = "bvh-query/web/viewer/sources"

#: A repository with a crate of the page, one that it names by its path, and one that the latter inherits.
COVERED = {
    "Cargo.toml": '[workspace.dependencies]\nbase = { path = "base", version = "1" }\nhalf = "2"\n',
    ".ci/licences": "",
    ".ci/targets/in": "",
    "base/Cargo.toml": "[dependencies]\nhalf.workspace = true\n",
    "base/src/lib.rs": "",
    "base/build.rs": "",
    "middle/Cargo.toml": "[target.'cfg(unix)'.dependencies]\nbase.workspace = true\n[dev-dependencies]\nkit = { path = '../kit' }\n",
    "middle/src/deep/mod.rs": "fn deep() {}\n",
    "bvh-query/web/Cargo.toml": '[dependencies]\nmiddle = { path = "../../middle", optional = true }\njs-sys = "0.3"\n',
    "bvh-query/web/Cargo.lock": "",
    "bvh-query/web/module": "#!/bin/sh\n",
    "bvh-query/web/package.json": "{}",
    "bvh-query/web/package-lock.json": "{}",
    "bvh-query/web/src/lib.rs": "",
    "bvh-query/web/ts/mesh.ts": "",
    "bvh-query/web/viewer/build": "",
    "bvh-query/web/viewer/bundle.js": "",
    "bvh-query/web/viewer/page/main.ts": "first\nsecond\n",
    "bvh-query/web/viewer/page/style.css": "",
    "bvh-query/web/viewer/worker/worker.ts": "",
}
OTHERS = {
    "Cargo.lock": "",
    "README.md": "",
    "base/README.md": "",
    "base/tests/all.rs": "",
    "kit/Cargo.toml": "",
    "kit/src/lib.rs": "",
    "bvh-query/view/page.html": "",
    "bvh-query/web/README.md": "",
    "bvh-query/web/build": "",
    "bvh-query/web/tests/node.test.js": "",
    "bvh-query/web/viewer/pictures/inside.png": "",
    "bvh-query/web/viewer/tests/viewer.test.js": "",
}


def git(folder, *words):
    subprocess.run(["git", "-C", folder, *words], check=True)


class Sources(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = self.repository(temporary.name, "one")
        self.first = self.digest()

    def repository(self, *place):
        """Makes the repository in a folder."""
        folder = pathlib.Path(*place)
        for path, text in (COVERED | OTHERS).items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, newline="")
        shutil.copy(SCRIPT, folder / PLACE)
        git(folder, "init", "--quiet")
        git(folder, "add", "--all")
        return folder

    def run_script(self, *words, folder=None):
        command = [sys.executable, (folder or self.folder) / PLACE, *words]
        return subprocess.run(command, capture_output=True, text=True, cwd=os.sep)

    def digest(self, folder=None):
        ran = self.run_script(folder=folder)
        self.assertEqual((ran.returncode, ran.stderr, len(ran.stdout)), (0, "", 65))
        return ran.stdout

    def test_every_source_counts(self):
        for path in [*COVERED, PLACE]:
            with self.subTest(path):
                place = self.folder / path
                before = place.read_bytes()
                place.write_bytes(before + b"#")
                self.assertNotEqual(self.digest(), self.first)
                place.write_bytes(before)
        self.assertEqual(self.digest(), self.first)

    def test_nothing_else_counts(self):
        for path in OTHERS:
            with (self.folder / path).open("a") as file:
                file.write("\n# more\n")
        (self.folder / ".git/info/exclude").write_text("built.rs\n")
        (self.folder / "base/src/built.rs").write_text("// git leaves this out.\n")
        self.assertEqual(self.digest(), self.first)

    def test_the_same_files_elsewhere(self):
        other = self.repository(self.folder.parent, "another place")
        for path in [*COVERED, PLACE]:
            place = other / path
            place.write_bytes(place.read_bytes().replace(b"\n", b"\r\n"))
        self.assertEqual(self.digest(other), self.first)

    def test_new_renamed_and_moved_files(self):
        (self.folder / "base/src/new.rs").write_text("")
        found = {self.first, self.digest()}
        git(self.folder, "add", "--all")
        # It counts in the same way before git tracks it.
        self.assertIn(self.digest(), found)
        git(self.folder, "mv", "base/src/new.rs", "base/src/other.rs")
        found.add(self.digest())
        git(self.folder, "mv", "base/src/other.rs", "middle/src/other.rs")
        found.add(self.digest())
        # What moves from one file to the next.
        (self.folder / "bvh-query/web/viewer/page/main.ts").write_text("first\n")
        (self.folder / "bvh-query/web/viewer/page/style.css").write_text("second\n")
        found.add(self.digest())
        self.assertEqual(len(found), 5)

    def test_a_missing_file(self):
        (self.folder / "base/src/lib.rs").unlink()
        ran = self.run_script()
        self.assertEqual(ran.returncode, 1)
        self.assertIn("base/src/lib.rs: expected a file, because git tracks it, found none", ran.stderr)
        git(self.folder, "rm", "--quiet", "base/src/lib.rs")
        self.assertNotEqual(self.digest(), self.first)

    def test_pages(self):
        page = self.folder / "page.html"
        for stated, found in (self.first.strip(), None), ("0" * 64, "0" * 64), ("", ""), (None, "none"):
            page.write_text("<html>\n" if stated is None else f'<meta name="cbvh-sources" content="{stated}">\n')
            ran = self.run_script(page)
            if found is None:
                self.assertEqual((ran.returncode, ran.stdout, ran.stderr), (0, "", ""))
            else:
                self.assertEqual(ran.returncode, 1)
                self.assertIn(f"of its sources, found {found}; build it anew with bvh-query/web/viewer/build", ran.stderr)

    def test_this_repository(self):
        """The script finds the crates and the code of this repository."""
        program = f"import runpy; print(*runpy.run_path({str(SCRIPT)!r})['sources'](), sep='\\n')"
        listed = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout.split("\n")
        expected = [f"{crate}/{file}" for crate in ("bvh-format", "bvh-bake", "bvh-query") for file in ("Cargo.toml", "src/lib.rs")]
        expected += [path for path in COVERED if (REPOSITORY / path).exists()]
        self.assertEqual([path for path in expected if path not in listed], [])
        tests = ("bvh-query/tests/", "bvh-query/web/tests/", "bvh-query/web/viewer/tests/", "testdata/")
        self.assertEqual([path for path in listed if path.startswith(tests)], [])


if __name__ == "__main__":
    unittest.main()
