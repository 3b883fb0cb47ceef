"""The figures of speed that README.md and the book state are those of the measured times."""

import re
import sys
import unittest
from pathlib import Path

SUITE = Path(__file__).resolve().parent.parent
ROOT = SUITE.parent.parent
sys.path[:0] = [str(SUITE / "speed")]

import report

SUBJECT = "cbvh"
# The two gaps about which the documents state how far `collide` leads.
LEADING = ("touching", "0.0001%")


def read(path):
    return " ".join((ROOT / path).read_text(encoding="utf-8").split())


def tables(path):
    return [line for line in (ROOT / path).read_text(encoding="utf-8").splitlines() if line.startswith("|")]


class Stated(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        _, cls.builds, _, _, cls.cells, cls.probed = report.read(SUITE / "speed" / "results")
        cls.readme, cls.compare = read("README.md"), read("spec/book/src/compare.md")

    def ratios(self, question, gaps):
        """Returns the pairs by how many times as long as the subject the best other library takes, the least first."""
        found = [(report.ratio(row, SUBJECT), pair) for (asked, pair, gap), row in self.cells.items() if asked == question and gap in gaps]
        return sorted((share, pair) for share, pair in found if share is not None)

    def test_rows_of_the_readme_are_rows_of_the_summary(self):
        head, rule, *rows = report.summary(self.builds, self.cells, SUBJECT)
        shown = tables("README.md")
        self.assertIn(head, shown)
        start = shown.index(head)
        chosen = [row for row in rows if row in shown]
        self.assertEqual(shown[start : start + 2 + len(chosen)], [head, rule, *chosen])
        # No other row stands in this table.
        self.assertTrue(all(row.count("|") != head.count("|") or row in (head, rule, *rows) for row in shown))
        self.assertEqual((len(chosen), len(rows)), (4, 9))
        self.assertIn("and five more pairs", self.readme)
        # Those where the subject leads least and most are among them.
        names = {row.split(" | ")[0].strip("| ") for row in chosen}
        leads = self.ratios("collide", LEADING)
        self.assertLessEqual({leads[0][1], leads[-1][1]}, names)

    def test_how_far_the_subject_leads(self):
        leads = self.ratios("collide", LEADING)
        said = f"{leads[0][0]:.1f} to {leads[-1][0]:.1f} times as fast"
        self.assertIn(said, self.readme)
        self.assertIn(said, self.compare)
        leads = self.ratios("distance", ("1%",))
        self.assertIn(f"{leads[0][0]:.1f} to {leads[-1][0]:.0f} times as fast at a gap of 1 %", self.compare)

    def test_how_far_others_lead(self):
        lost = report.losses(self.cells, SUBJECT)
        compared = sum(report.ratio(row, SUBJECT) is not None for row in self.cells.values())
        self.assertIn(f"In {len(lost)} of {compared} comparisons of contact and distance, all where nothing is near,", self.readme)
        self.assertLessEqual({gap for _, _, gap, *_ in lost}, {"5%", "10%", "far"})

        rays, others, compared = [], 0, 0
        for (question, *_), row in self.probed.items():
            share = report.ratio(row, SUBJECT)
            if share is None:
                continue
            if question in ("ray", "hit"):
                self.assertTrue(report.best_other(row, SUBJECT)[1].startswith("Embree"))
                rays.append(1 / share)
            else:
                others, compared = others + (share < 1), compared + 1
        said = f"Embree finds hits of rays {min(rays):.1f} to {max(rays):.0f} times as fast"
        self.assertIn(said, self.readme)
        self.assertIn(said.replace("of rays ", ""), self.compare)
        self.assertIn(f"faster in {others} of {compared} comparisons of closest points and sides", self.readme)

    def test_how_much_faster_others_build(self):
        times = {True: [], False: []}
        for pair, runner, _, _, faster, *_ in report.lost_builds(self.builds, SUBJECT):
            times["quick" in runner].append(float(faster or 0))
        self.assertRegex(self.readme, rf"up to {max(times[False]):.1f} times as fast as bakes, {max(times[True]):.1f} times as fast as quick ones")
        self.assertIn(f"Embree up to {max(times[False]):.1f} times", self.compare)


if __name__ == "__main__":
    unittest.main()
