"""The pairs with coordinates as people write them: shared numbers stay shared, gaps are as small as stated, and poses round nothing."""

import sys
import unittest
from fractions import Fraction
from math import nextafter
from pathlib import Path

SUITE = Path(__file__).parent.parent
sys.path.insert(0, str(SUITE))

import decimals
import exact
import meshes
import run
import second
import truth

IDENTITY = (1, 0, 0, 0, 1, 0, 0, 0, 1)
# Turns by a third about (1, 1, 1) and by a half about z.
TURNS = [IDENTITY, (0, 0, 1, 1, 0, 0, 0, 1, 0), (-1, 0, 0, 0, -1, 0, 0, 0, 1)]


class Pairs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pairs = [decimals.Pair(number, TURNS) for number in range(decimals.COUNT)]
        cls.meshes, cls.cases = run.load()

    def test_the_file_asks_every_question_and_needs_f64(self):
        of_file = [case for case in self.cases if case["id"].startswith("decimals/")]
        self.assertEqual({case["ask"] for case in of_file}, {case["ask"] for case in self.cases})
        self.assertEqual({case["needs"]["coordinates"] for case in of_file}, {"f64"})
        turned = sum("pose" in item and item["pose"][0] != "0x1p+0" for case in of_file for item in case["items"])
        self.assertGreater(turned, 300)

    def test_the_same_meshes_come_out(self):
        import make_cases

        for pair in make_cases.PAIRS:
            for of, (points, faces) in (("a", pair.a), ("b", pair.b)):
                stored = self.meshes[pair.name(of)]
                self.assertEqual(([[exact.to_hex(x) for x in p] for p in points], [list(t) for t in faces]), (stored[0], [list(t) for t in stored[1]]), pair.reason)

    def test_what_is_shared_stays_shared(self):
        touching = 0
        for pair in self.pairs:
            if "moved" in pair.reason or pair.is_noisy or "near as" in pair.reason or "that are apart" in pair.reason:
                continue
            touching += 1
            self.assertEqual(self.square(pair), 0, pair.reason)
        self.assertGreater(touching, 15)

    def test_what_is_moved_apart_by_a_part_is_so_far_apart(self):
        apart = 0
        for pair in self.pairs:
            if "moved apart" not in pair.reason or any(word in pair.reason for word in ("slanted", "same", "that are apart", "triangles")):
                continue
            apart += 1
            square = self.square(pair)
            self.assertGreater(square, 0, pair.reason)
            limit = Fraction(pair.size) / 10**6 + Fraction(max(abs(x) for p in pair.at_b for x in p)) / 2**50
            self.assertLess(square, limit * limit, pair.reason)
        self.assertGreater(apart, 8)

    def test_both_ways_agree_on_triangles_with_long_coordinates(self):
        random, met = meshes.Random(70), 0
        for pair in self.pairs[::4]:
            a, b = self.placed(pair)
            for _ in range(6):
                t, u = random.pick(a), random.pick(b)
                square = second.hulls_apart(t, u)
                self.assertEqual(truth.triangles_meet(t, u), square == 0, (t, u))
                met += square == 0
                if square:
                    self.assertEqual(Fraction(*truth.triangles_apart(t, u)), square, (t, u))
        self.assertGreater(met, 5)

    def test_numbers_are_read_as_they_are_written(self):
        third = Fraction(1, 3)
        self.assertEqual(decimals.after_the_point(3)(third), 0.333)
        self.assertEqual(decimals.significant(third * 1000), 333.333)
        self.assertEqual(decimals.single(third), 0.333333343)
        for part, expected in ((None, nextafter(0.1, 1)), (Fraction(1, 10**16), nextafter(0.1, 1)), (Fraction(1, 10**17), nextafter(0.1, 1)), (Fraction(1, 100), 0.11)):
            self.assertAlmostEqual(decimals.nudged(0.1, 1, part, 1.0), expected, delta=2e-16)
            self.assertGreater(decimals.nudged(0.1, 1, part, 1.0), 0.1)

    def placed(self, pair):
        """Returns the triangles of both meshes, on a grid, with B as its pose places it."""
        points = exact.placed(pair.fractions_of_b(), pair.pose((0, 0, 0)))
        self.assertEqual(points, [tuple(map(Fraction, p)) for p in pair.at_b])
        (a, b), self.unit = exact.to_grid(pair.a[0], points)
        return [tuple(a[i] for i in t) for t in pair.a[1]], [tuple(b[i] for i in t) for t in pair.b[1]]

    def square(self, pair):
        a, b = self.placed(pair)
        return truth.squared_distance(a, b) / self.unit**2


if __name__ == "__main__":
    unittest.main()
