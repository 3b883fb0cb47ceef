"""A truth that is changed, a case that breaks the schema and a mesh that is changed are all found."""

import copy
import csv
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SUITE = Path(__file__).parent.parent
sys.path.insert(0, str(SUITE))

import check
import compare
import exact
import meshes
from schema import problems


class Checks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cases, cls.faults = check.load()

    def test_the_files_are_as_promised(self):
        self.assertEqual(self.faults, [])
        self.assertGreaterEqual(len(self.cases), 1000)
        self.assertGreaterEqual(sum(len(case["items"]) for case in self.cases), 10_000)
        self.assertLess(sum(path.stat().st_size for path in (SUITE / "cases").iterdir()), 5_000_000)

    def test_the_documents_state_the_counts(self):
        text = (SUITE / "README.md").read_text(encoding="utf-8")
        queries = sum(len(case["items"]) for case in self.cases)
        self.assertIn(f"runs {queries:,} queries in {len(self.cases):,} cases", " ".join(text.split()))
        for path in (SUITE / "cases").iterdir():
            self.assertIn(f"| `{path.stem}` |", text)
        version = (SUITE / "VERSION").read_text().strip()
        self.assertIn(f"\nversion: {version}\n", (SUITE / "CITATION.cff").read_text())

    def test_the_results_are_those_of_all_questions(self):
        with open(SUITE / "results.csv", encoding="utf-8", newline="") as stream:
            columns, *rows = csv.reader(stream)
        self.assertEqual(columns, list(compare.COLUMNS))
        self.assertIn("\n".join(["", *compare.summary(rows), ""]), (SUITE / "RESULTS.md").read_text(encoding="utf-8"))

    def test_a_changed_truth_is_found(self):
        changed = 0
        for ask in sorted({case["ask"] for case in self.cases}):
            case = copy.deepcopy(next(c for c in self.cases if c["ask"] == ask and c["level"] < 3))
            case["items"] = case["items"][:1]
            self.assertEqual(check.check(case), [], ask)
            truth = case["items"][0]["truth"]
            if isinstance(truth, bool):
                case["items"][0]["truth"] = not truth
            elif isinstance(truth, list):
                case["items"][0]["truth"] = [*truth, [0, 999]]
            elif isinstance(truth, dict) and "lower" in truth:
                truth["lower"] = exact.to_hex(exact.from_hex(truth["lower"]) * 0.5 - 1)
            elif isinstance(truth, dict):
                case["items"][0]["truth"] = {"free": False} if "free" in truth else {"hit": True}
            else:
                case["items"][0]["truth"] = "mixed"
            changed += 1
            self.assertNotEqual(check.check(case), [], ask)
        self.assertEqual(changed, 12)

    def test_a_precision_that_does_not_hold_the_numbers_is_found(self):
        for key, fits in (("coordinates", lambda c: c["a"] == "fine-box"), ("placement", lambda c: c["ask"] == "closest"), ("placement", lambda c: c["ask"] == "collide")):
            case = copy.deepcopy(next(c for c in self.cases if c["needs"][key] == "f64" and fits(c)))
            case["items"] = case["items"][:2]
            self.assertEqual(check.check(case), [])
            case["needs"][key] = "f32"
            self.assertNotEqual(check.check(case), [], key)

    def test_processes_that_start_empty_prove_as_well(self):
        # So start the processes of a pool on Windows and macOS.
        program = "import multiprocessing, sys, check\nif __name__ == '__main__':\n multiprocessing.set_start_method('spawn')\n sys.exit(check.main(['--sample', '800', '--jobs', '2']))"
        with tempfile.TemporaryDirectory() as folder:
            script = Path(folder) / "spawn.py"
            script.write_text(f"import sys\nsys.path.insert(0, {str(SUITE)!r})\n{program}\n", encoding="utf-8")
            found = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=300)
        self.assertEqual(found.returncode, 0, found.stderr[-500:])
        self.assertIn(" 0 faults", found.stdout)

    def test_the_schema_finds_faults(self):
        schema = json.loads((SUITE / "SCHEMA.json").read_text(encoding="utf-8"))
        for change in ({"level": 4}, {"id": "x"}, {"items": []}, {"extra": 1}, {"ask": "age"}, {"tags": "a"}, {"items": [{"truth": 0.5}]}):
            self.assertNotEqual(problems({**self.cases[0], **change}, schema["$defs"]["case"], schema), [], change)

    def test_a_changed_mesh_is_found(self):
        lines = check.read_lines(SUITE / "cases" / "meshes.jsonl")
        written, made = (next(line for line in lines if key in line) for key in ("vertices", "make"))
        written["vertices"][0][0] = "0x1p+9"
        made["arguments"][0] += 1
        for line in (written, made):
            with self.assertRaises(ValueError):
                meshes.load(line)


if __name__ == "__main__":
    unittest.main()
