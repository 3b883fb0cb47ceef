"""The two ways to a truth agree on random small integers, where contact, coplanarity and degenerate triangles are frequent."""

import sys
import unittest
from fractions import Fraction
from math import isqrt
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

import exact
import meshes
import second
import truth


def triangles_of(maker, *arguments):
    points, faces = meshes.make(maker, arguments)
    (points,), _ = exact.to_grid(points)
    return [tuple(points[i] for i in t) for t in faces]


class BothWays(unittest.TestCase):
    def setUp(self):
        self.random = meshes.Random(7)

    def points(self, count, size):
        return tuple(tuple(self.random.between(-size, size) for _ in range(3)) for _ in range(count))

    def test_triangles(self):
        met = 0
        for _ in range(1500):
            size = self.random.pick((1, 2, 3, 10))
            t, u = self.points(3, size), self.points(3, size)
            square = second.hulls_apart(t, u)
            self.assertEqual(truth.triangles_meet(t, u), square == 0, (t, u))
            met += square == 0
            if square:
                self.assertEqual(Fraction(*truth.triangles_apart(t, u)), square, (t, u))
        self.assertTrue(300 < met < 1200)

    def test_segments_and_rays(self):
        hits = 0
        for _ in range(500):
            size = self.random.pick((1, 2, 3, 10))
            t, o, d = self.points(3, size), *self.points(2, size)
            self.assertEqual(truth.segment_hits(o, d, [t]), second.segment_hits(o, d, [t]), (o, d, t))
            if d != truth.ZERO:
                at = truth.first_hit(o, d, [t])
                self.assertTrue(second.first_hit_is(o, d, [t], at), (o, d, t, at))
                # A claim that is off by a part in a thousand is refuted.
                if at:
                    hits += 1
                    self.assertFalse(second.first_hit_is(o, d, [t], at * Fraction(1001, 1000)) and at < 1)
                    self.assertFalse(second.first_hit_is(o, d, [t], None))
        self.assertGreater(hits, 10)

    def test_motions(self):
        hits = 0
        for _ in range(250):
            size = self.random.pick((2, 3, 10))
            t, u = self.points(3, size), self.points(3, size)
            v = tuple(5 * x for x in self.points(1, self.random.pick((0, 2, 2)))[0])
            at = truth.motion([t], [u], v)
            self.assertTrue(second.motion_is([t], [u], v, at), (t, u, v, at))
            if at:
                hits += 1
                self.assertFalse(second.motion_is([t], [u], v, None))
                self.assertFalse(second.motion_is([t], [u], v, at * Fraction(999, 1000)))
        self.assertGreater(hits, 20)

    def test_sides(self):
        found = set()
        for triangles in (triangles_of("box", 2, 3, 1), triangles_of("ring", 4, 2, 1), triangles_of("ell", 4, 0, 2)):
            for _ in range(80):
                point = self.points(1, 4)[0]
                side = truth.side(point, triangles)
                found.add(side)
                self.assertEqual(side, second.side(point, triangles), point)
        self.assertEqual(found, {"on", "inside", "outside"})

    def test_relations(self):
        a = triangles_of("boxes", [6, 6, 6, 0, 0, 0], [2, 2, 2, 20, 0, 0])
        known = {
            "apart": triangles_of("box", 1, 1, 1, 0, 0, 12),
            "touching": triangles_of("box", 1, 1, 1, 0, 0, 7),
            "b in a": triangles_of("boxes", [1, 1, 1, 0, 0, 0], [1, 1, 1, 20, 0, 0]),
            "a in b": triangles_of("box", 40, 40, 40),
            "mixed": triangles_of("boxes", [1, 1, 1, 0, 0, 0], [1, 1, 1, 0, 0, 20]),
            "undefined": triangles_of("without", 2, "box", 1, 1, 1),
        }
        for relation, b in known.items():
            self.assertEqual((truth.relation(a, b), second.relation(a, b)), (relation, relation))
        # Each has a part inside the other one.
        b = triangles_of("boxes", [1, 1, 1, 0, 0, 0], [4, 4, 4, 20, 0, 0])
        self.assertEqual((truth.relation(a, b), second.relation(a, b)), ("mixed", "mixed"))
        self.assertEqual((truth.relation(a, []), second.relation(a, [])), ("apart", "apart"))

    def test_closed_surfaces_and_parts(self):
        closed = 0
        for _ in range(300):
            corners = self.points(4, 1)
            faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)][: self.random.pick((3, 4, 4))]
            triangles = [tuple(corners[i] for i in (f if self.random.below(20) else f[::-1])) for f in faces] + [self.points(3, 1)] * self.random.pick((0, 0, 0, 1))
            self.assertEqual(truth.is_closed(triangles), second.is_closed(triangles), triangles)
            closed += truth.is_closed(triangles)
            parts = [{p for t in part for p in t} for part in truth.components(triangles)]
            self.assertEqual(sorted(map(sorted, parts)), sorted(map(sorted, second.corners_of_parts(triangles))))
        self.assertTrue(50 < closed < 250, closed)

    def test_depths(self):
        for a, b in ((("box", 2, 3, 4), ("octahedron", 3, 4, 5)), (("tetrahedron", 3), ("box", 1, 2, 2))):
            a, b = triangles_of(*a), triangles_of(*b)
            for _ in range(5):
                v = self.points(1, 4)[0]
                there = [truth.moved(t, v) for t in b]
                self.assertEqual(truth.depth(a, there), second.depth(a, there), v)

    def test_depths_of_parts(self):
        for v in (self.points(1, 4)[0] for _ in range(3)):
            a, b = triangles_of("octahedron", 3, 4, 5), [truth.moved(t, v) for t in triangles_of("box", 1, 9, 9)]
            square, exit = truth.depth_of_parts(a, b)
            self.assertEqual(square, truth.depth(a, b), v)
            self.assertTrue(second.depth_is(a, b, square, exit), v)
        # Two blocks with a gap of 1, which is too narrow for the plug: the way out is up. Two plates with a gap of 2, in which it fits exactly.
        blocks, plates = ("boxes", [2, 2, 2, 0, 0, 0], [2, 2, 2, 5, 0, 0]), ("boxes", [2, 9, 9, 0, 0, 0], [2, 9, 9, 6, 0, 0])
        known = ((blocks, (2, 0, 1), 2), (blocks, (1, 0, 0), 3), (blocks, (2, 1, 0), 2), (plates, (1, 0, 0), 2), (plates, (2, 1, 0), 1), (plates, (3, 0, 0), 0))
        for mesh, v, expected in known:
            a, b = triangles_of(*mesh), [truth.moved(t, v) for t in triangles_of("box", 1, 1, 1)]
            square, exit = truth.depth_of_parts(a, b)
            self.assertEqual(square, expected**2, (mesh, v))
            self.assertTrue(second.depth_is(a, b, square, exit), (mesh, v))
            if expected:
                # A shorter way that is not free, and a longer one: the ball that reaches there is not covered.
                for factor in (1, 4):
                    other = tuple(factor * x for x in exit[0]), 2 * exit[1]
                    self.assertFalse(second.depth_is(a, b, square * Fraction(factor, 2) ** 2, other), (mesh, v, factor))

    def test_self_contacts(self):
        found = 0
        for _ in range(60):
            corners = self.points(6, 2)
            faces = [tuple(self.random.below(6) for _ in range(3)) for _ in range(6)]
            triangles = [tuple(corners[i] for i in t) for t in faces]
            triangles = [t for t in triangles if truth.normal(t) != truth.ZERO]
            pairs = truth.self_contacts(triangles)
            self.assertEqual(pairs, second.self_contacts(triangles), triangles)
            found += len(pairs)
        self.assertGreater(found, 30)


class Known(unittest.TestCase):
    def test_a_point_beside_a_segment_of_no_length(self):
        point, line = ((0, 1, 1),) * 3, ((0, -1, -1), (-1, 0, -1), (-1, 0, 0))
        self.assertFalse(truth.triangles_meet(point, line))

    def test_the_closed_makers_close_and_do_not_meet_themselves(self):
        for maker, arguments in (("box", (1, 2, 3)), ("tetrahedron", (3,)), ("ell", (4, 0, 1)), ("ring", (4, 2, 1)), ("ball", (100, 2))):
            triangles = triangles_of(maker, *arguments)
            self.assertTrue(truth.is_closed(triangles), maker)
            self.assertEqual(truth.self_contacts(triangles), [], maker)
            self.assertGreater(sum(truth.dot(t[0], truth.cross(t[1], t[2])) for t in triangles), 0, maker)

    def test_roots_are_between_neighbours(self):
        self.assertEqual(exact.root_bounds(Fraction(9, 4)), (1.5, 1.5))
        lower, upper = exact.root_bounds(Fraction(2))
        self.assertTrue(Fraction(lower) ** 2 < 2 < Fraction(upper) ** 2)
        self.assertEqual(exact.root_bounds(Fraction(1, 4**400)), (2.0**-400, 2.0**-400))
        self.assertTrue(isqrt(10**40) == 10**20)

    def test_placements(self):
        turn = [Fraction(x) for x in (0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3)]
        self.assertEqual(exact.placement([(Fraction(1), Fraction(2), Fraction(3))], turn), "f32")
        self.assertEqual(exact.placement([(Fraction(1), Fraction(2**24), Fraction(3))], turn), "f64")
        turn[0] = Fraction(0.6)
        self.assertIsNone(exact.placement([(Fraction(1 << 10), Fraction(0.1), Fraction(3))], turn))


if __name__ == "__main__":
    unittest.main()
