"""Each kind of wrong answer is called what it is."""

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from judge import judge

RELATIVE = {"distance_error": 1e-9, "error_unit": "distance"}
OF_SIZE = {"distance_error": 1e-9, "error_unit": "size"}
HALF = {"square": "1/4", "lower": "0x1p-1", "upper": "0x1p-1"}
ZERO = {"square": "0", "lower": "0x0p+0", "upper": "0x0p+0"}


def word(ask, truth, answer, profile=RELATIVE, **item):
    return judge({"ask": ask}, {"truth": truth, **item}, answer, profile, 100.0).word


class Judge(unittest.TestCase):
    def test_yes_and_no(self):
        for ask in ("collide", "within", "segment"):
            self.assertEqual(word(ask, True, {"answer": True}), "right")
            self.assertEqual(word(ask, True, {"answer": False}), "false negative")
            self.assertEqual(word(ask, False, {"answer": True}), "false positive")
            for other in (1, 0, None, "true", []):
                self.assertEqual(word(ask, True, {"answer": other}), "wrong")
            self.assertEqual(word(ask, True, {}), "wrong")

    def test_pairs(self):
        truth = [[0, 1], [2, 3]]
        self.assertEqual(word("contacts", truth, {"answer": [[2, 3], [0, 1]]}), "right")
        self.assertEqual(word("contacts", truth, {"answer": [[2, 3]]}), "false negative")
        self.assertEqual(word("contacts", truth, {"answer": [[0, 1], [2, 3], [1, 0]]}), "false positive")
        self.assertEqual(word("contacts", truth, {"answer": [[0, 1], [2, 3], [2, 3]]}), "false positive")
        for other in (2, None, True, "01", {"01": 0, "23": 0}, ["01", "23"], [["0", "1"], ["2", "3"]], [[0.0, 1.0], [2.0, 3.0]]):
            self.assertEqual(word("contacts", truth, {"answer": other}), "wrong")
        for other in ([[False, True], [2, 3]], [[0, 1, 2]], [[0]], [0, 1], [[float("inf"), 0]], [[None, 0]], [[[0], [1]]], [{}]):
            self.assertEqual(word("contacts", truth, {"answer": other}), "wrong")
        self.assertEqual(word("self_contacts", truth, {"answer": [[1, 0], [3, 2]]}), "right")

    def test_distances(self):
        self.assertEqual(word("distance", HALF, {"answer": 0.5}), "right")
        self.assertEqual(word("distance", HALF, {"answer": 0.5 + 1e-8}), "wrong")
        self.assertEqual(word("distance", HALF, {"answer": 0.5 + 1e-8}, OF_SIZE), "right")
        self.assertEqual(word("distance", HALF, {"answer": 0.5 + 1e-6}, OF_SIZE), "wrong")
        self.assertEqual(word("distance", HALF, {"answer": 0.0}), "false positive")
        self.assertEqual(word("distance", ZERO, {"answer": 1e-12}), "false negative")
        self.assertEqual(word("distance", ZERO, {"answer": 1e-12}, OF_SIZE), "right")
        self.assertEqual(word("distance", ZERO, {"answer": -1e-12}), "wrong")
        for other in (None, "nan", True, "0.5", [0.5], {"answer": 0.5}, 10**400, -(10**400), float("nan"), float("inf"), float("-inf"), 1e308):
            self.assertEqual(word("distance", HALF, {"answer": other}), "wrong")
            self.assertEqual(word("distance", HALF, {"answer": 0.5, "lower": 0.4, "upper": other}) == "right", other == 1e308)

    def test_bounds_are_judged_exactly(self):
        self.assertEqual(word("distance", HALF, {"answer": 0.5, "lower": 0.4, "upper": 0.5}), "right")
        self.assertEqual(word("distance", HALF, {"answer": 0.5, "lower": 0.5 + 2.0**-53, "upper": 0.6}), "wrong")
        self.assertEqual(word("distance", HALF, {"answer": 0.5, "lower": 0.4, "upper": 0.5 - 2.0**-53}), "wrong")
        self.assertEqual(word("distance", HALF, {"answer": 0.5, "lower": 0.4}), "wrong")

    def test_rays(self):
        hit = {"hit": True, "exact": "1/2", "lower": "0x1p-1", "upper": "0x1p-1"}
        self.assertEqual(word("ray", hit, {"answer": True, "t": 0.5}), "right")
        self.assertEqual(word("ray", hit, {"answer": True, "t": 0.75}), "wrong")
        self.assertEqual(word("ray", hit, {"answer": False}), "false negative")
        self.assertEqual(word("ray", {"hit": False}, {"answer": True, "t": 0.5}), "false positive")
        self.assertEqual(word("ray", {"hit": False}, {"answer": False}), "right")

    def test_motions(self):
        hit = {"free": False, "exact": "1/2", "lower": "0x1p-1", "upper": "0x1p-1"}
        self.assertEqual(word("motion", hit, {"answer": False}), "right")
        self.assertEqual(word("motion", hit, {"answer": False, "free_until": 0.4, "touching_at": 0.6}), "right")
        self.assertEqual(word("motion", hit, {"answer": False, "free_until": 0.51}), "wrong")
        self.assertEqual(word("motion", hit, {"answer": False, "touching_at": 0.49}), "wrong")
        self.assertEqual(word("motion", hit, {"answer": True}), "false negative")
        self.assertEqual(word("motion", {"free": True}, {"answer": False}), "false positive")
        self.assertEqual(word("motion", hit, {"answer": None}), "wrong")
        self.assertEqual(word("motion", hit, {"answer": None}, grazing=True), "undecided")
        self.assertEqual(word("motion", hit, {}, grazing=True), "wrong")

    def test_depths(self):
        self.assertEqual(word("penetration", HALF, {"lower": 0.25, "upper": 0.5}), "right")
        self.assertEqual(word("penetration", HALF, {"lower": 0.75, "upper": 0.8}), "false positive")
        self.assertEqual(word("penetration", HALF, {"lower": 0.25, "upper": 0.4}), "false negative")
        self.assertEqual(word("penetration", ZERO, {"lower": 0, "upper": 0}), "right")
        self.assertEqual(word("penetration", ZERO, {"lower": 0, "upper": 0.1}), "false positive")
        self.assertEqual(word("penetration", ZERO, {"lower": 0, "upper": 1e-8}, OF_SIZE), "right")
        self.assertEqual(word("penetration", HALF, {"answer": 0.5}), "right")
        self.assertEqual(word("penetration", HALF, {"answer": 0.5, "lower": 0.4, "upper": 0.6}), "right")
        self.assertEqual(word("penetration", HALF, {"answer": 0.5, "lower": 0.6, "upper": 0.7}), "wrong")
        for other in (None, "0", True, 10**400, float("inf"), float("nan")):
            self.assertEqual(word("penetration", HALF, {"lower": 0, "upper": other}), "wrong")
            self.assertEqual(word("penetration", HALF, {"lower": other, "upper": 0.5}), "wrong")

    def test_bounds_that_hold_for_everything_are_not_right(self):
        self.assertEqual(word("penetration", HALF, {"lower": 0, "upper": 1.0}), "right")
        self.assertEqual(word("penetration", HALF, {"lower": 0, "upper": 1.01}), "wrong")
        self.assertEqual(word("penetration", HALF, {"lower": -1e308, "upper": 1e308}), "wrong")

    def test_refusals(self):
        self.assertEqual(word("collide", "refused", {"refused": True}), "right")
        self.assertEqual(word("collide", "refused", {"answer": False}), "wrong")
        self.assertEqual(word("collide", True, {"refused": True}), "refused")


if __name__ == "__main__":
    unittest.main()
