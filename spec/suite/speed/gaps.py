"""Bounds the distance of two placed meshes, with proof: closed intervals from boxes, slabs and, where these leave doubt, integers.

A tree of boxes finds the pairs of triangles that may be nearest. An upper bound is the exact distance of one pair (`truth.py`). A
lower bound of a pair is the width of a slab between its triangles. Any direction of the slab gives a valid bound, so the search for
a good one need not be exact. What floats round is charged: the two functions that do so derive it. Pairs that no slab separates well
enough are computed exactly.
"""

import sys
from fractions import Fraction
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import truth
from exact import root_bounds

EDGES = np.array(truth.EDGES)
# A placed coordinate is three products and three sums of numbers whose magnitudes add up to at most M. Each of the five roundings on
# its way is at most 2^-53 of M, or a little more, so that it is off by less than 6 * 2^-53 M, which is below 2^-50 M.
PLACING_ERROR = 2.0**-50
# A slab is dot products of a direction of length at most 2 with placed corners. Three coordinates, each off by 2^-50 M and multiplied
# by at most 2, and five roundings of sums of at most 6 M, are below 2^-46 M. A quotient and a difference more are within 2^-45 M.
SLAB_ERROR = 2.0**-45
# A lower bound that is less than this part below the upper bound is good enough.
SLACK = 1e-9
# So many of the pairs with the least lower bounds are looked at first.
FIRST = 512


class Tree:
    """The triangles of a mesh in the order of a complete binary tree, whose leaves have one triangle each. The last may repeat."""

    def __init__(self, corners, faces):
        self.faces, self.corners = faces, [tuple(map(float, corner)) for corner in corners]
        self.bits = max(fraction_bits(x) for corner in self.corners for x in corner)
        triangles = corners.astype(float)[faces]
        self.depth = max(len(faces) - 1, 0).bit_length()
        order = np.minimum(np.arange(2**self.depth), len(faces) - 1)[None]
        centres = triangles.sum(1)
        for _ in range(self.depth):
            at = centres[order]
            axis = np.argmax(np.ptp(at, axis=1), axis=1)
            keys = np.take_along_axis(at, axis[:, None, None], 2)[..., 0]
            order = np.take_along_axis(order, np.argsort(keys, axis=1, kind="stable"), 1).reshape(2 * len(order), -1)
        self.order = order.ravel()
        self.triangles = triangles[self.order]

    def placed(self, pose):
        """Returns this mesh as a `Placed` at the twelve numbers of a pose, or where it is."""
        return Placed(self, self.triangles if pose is None else moved(self.triangles, pose), pose)


class Placed:
    """A mesh at a pose: its triangles in floats, their boxes on all levels, and how large its numbers are."""

    def __init__(self, tree, triangles, pose):
        self.tree, self.triangles, self.pose = tree, triangles, pose
        self.size = float(np.abs(triangles).max())
        if pose is not None:
            r = np.abs(np.array(pose).reshape(3, 4))
            self.size = float((r[:, :3].sum(1) * np.abs(tree.triangles).max() + r[:, 3]).max())
        low, high = triangles.min(1), triangles.max(1)
        self.levels = [(low, high)]
        for _ in range(tree.depth):
            low, high = np.minimum(low[0::2], low[1::2]), np.maximum(high[0::2], high[1::2])
            self.levels.append((low, high))
        self.levels.reverse()

        self.bits = tree.bits + (max(map(fraction_bits, pose)) if pose is not None else 0)

    def exact(self, leaf, bits):
        """Returns the corners of the triangle of a leaf as integers, in units of 2^-bits, with no fewer bits than needed."""
        corners = [self.tree.corners[k] for k in self.tree.faces[self.tree.order[leaf]]]
        if self.pose is None:
            return [tuple(integer(x, bits) for x in corner) for corner in corners]
        rows = [[integer(x, bits - self.tree.bits) for x in self.pose[k : k + 3]] + [integer(self.pose[k + 3], bits)] for k in (0, 4, 8)]
        at = [[integer(x, self.tree.bits) for x in corner] for corner in corners]
        return [tuple(r[0] * x + r[1] * y + r[2] * z + r[3] for r in rows) for x, y, z in at]


def fraction_bits(x):
    """Returns the least number of bits after the point with which a float is written."""
    return x.as_integer_ratio()[1].bit_length() - 1


def integer(x, bits):
    """Returns a float times 2^bits, which must be an integer."""
    numerator, denominator = x.as_integer_ratio()
    return numerator << bits - denominator.bit_length() + 1


def moved(points, pose):
    """Returns points at R x + t, with the error that `PLACING_ERROR` bounds."""
    r = np.array(pose).reshape(3, 4)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return np.stack([row[0] * x + row[1] * y + row[2] * z + row[3] for row in r], -1)


def dot(a, b):
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def length(v):
    return np.sqrt(dot(v, v))


def near_pairs(a, b, reach=None):
    """Returns the pairs of leaves whose boxes are at most `reach` apart, or at most a distance that the meshes certainly do not exceed.

    The distance of all other pairs is at least the third result.
    """
    error = PLACING_ERROR * (a.size + b.size)
    i, j = np.zeros(1, np.int64), np.zeros(1, np.int64)
    bound = np.inf if reach is None else reach
    for step in range(max(a.tree.depth, b.tree.depth) + 1):
        level_a, level_b = min(step, a.tree.depth), min(step, b.tree.depth)
        if 0 < step <= a.tree.depth:
            i, j = split(i, j)
        if 0 < step <= b.tree.depth:
            j, i = split(j, i)
        (low_a, high_a), (low_b, high_b) = a.levels[level_a], b.levels[level_b]
        gap = np.maximum(np.maximum(low_a[i] - high_b[j], low_b[j] - high_a[i]), 0.0)
        gap = length(gap)
        if reach is None:
            # Any two points of the meshes bound the distance: here one corner below each node.
            p = a.triangles[i << a.tree.depth - level_a, 0] - b.triangles[j << b.tree.depth - level_b, 0]
            bound = min(bound, float(length(p).min()))
        kept = gap <= bound * (1.0 + SLACK) + 4.0 * error
        i, j = i[kept], j[kept]
    return i, j, bound


def split(i, j):
    """Returns pairs with both children of i."""
    return np.concatenate([2 * i, 2 * i + 1]), np.concatenate([j, j])


def nearest_points(t, u):
    """Returns nearest points of pairs of triangles, in floats, and whether an edge of one seems to cross the other."""
    best, at_t, at_u = np.full(len(t), np.inf), np.zeros((len(t), 3)), np.zeros((len(t), 3))
    crosses = np.zeros(len(t), bool)

    def offer(p, q, valid=True):
        v = p - q
        square = np.where(valid, dot(v, v), np.inf)
        better = square < best
        best[better], at_t[better], at_u[better] = square[better], p[better], q[better]

    with np.errstate(divide="ignore", invalid="ignore"):
        for k, l in ((k, l) for k in EDGES for l in EDGES):
            p, d, q, e = t[:, k[0]], t[:, k[1]] - t[:, k[0]], u[:, l[0]], u[:, l[1]] - u[:, l[0]]
            w, dd, ee, de = p - q, dot(d, d), dot(e, e), dot(d, e)
            s = np.nan_to_num((de * dot(e, w) - ee * dot(d, w)) / (dd * ee - de * de)).clip(0.0, 1.0)
            for _ in range(2):  # The nearest point of one line to that of the other, back and forth.
                r = np.nan_to_num((de * s + dot(e, w)) / ee).clip(0.0, 1.0)
                s = np.nan_to_num((de * r - dot(d, w)) / dd).clip(0.0, 1.0)
            offer(p + s[:, None] * d, q + r[:, None] * e)
        for x, y, is_t in ((t, u, True), (u, t, False)):
            edge, other = y[:, 1] - y[:, 0], y[:, 2] - y[:, 0]
            n = np.cross(edge, other)
            size = dot(n, n)
            heights = [dot(n, x[:, k] - y[:, 0]) for k in range(3)]

            def inside(p):
                w = p - y[:, 0]
                v, z = dot(np.cross(w, other), n) / size, dot(np.cross(edge, w), n) / size
                return (v >= 0.0) & (z >= 0.0) & (v + z <= 1.0)

            for k in range(3):
                foot = x[:, k] - (heights[k] / size)[:, None] * n
                offer(*((x[:, k], foot) if is_t else (foot, x[:, k])), inside(foot))
                l = (k + 1) % 3
                part = heights[k] / (heights[k] - heights[l])
                crosses |= (heights[k] * heights[l] <= 0.0) & inside(x[:, k] + part[:, None] * (x[:, l] - x[:, k]))
    return np.sqrt(best), at_t, at_u, crosses


def slabs(t, u, at_t, at_u, size):
    """Returns lower bounds of distances of pairs of triangles: the widths of slabs across given points, less what is rounded."""
    n = at_u - at_t
    with np.errstate(divide="ignore", invalid="ignore"):
        n = np.nan_to_num(n / length(n)[:, None]).clip(-1.0, 1.0)
    width = dot(u, n[:, None]).min(1) - dot(t, n[:, None]).max(1)
    # The direction is about 1 long: divided by a little more, the width is a lower bound.
    return np.where(width > 0.0, width / (1.0 + 2.0**-48), width) - SLAB_ERROR * size


def exact_pair(a, b, i, j):
    """Returns the triangles of two leaves as integers, and the bits of their unit."""
    bits = max(a.bits, b.bits)
    return a.exact(i, bits), b.exact(j, bits), bits


def exact_distance(a, b, i, j):
    """Returns two neighbouring floats between which the distance of two leaves is: 0 and 0 if they touch."""
    t, u, bits = exact_pair(a, b, i, j)
    return (0.0, 0.0) if truth.triangles_meet(t, u) else root_bounds(Fraction(*truth.triangles_apart(t, u)) / 4**bits)


def ranked(a, b, reach=None):
    """Returns near pairs of leaves, lower bounds of their distances by the slab between their centres, and what bounds the others."""
    i, j, bound = near_pairs(a, b, reach)
    t, u = a.triangles[i], b.triangles[j]
    lowers = slabs(t, u, t.sum(1) / 3.0, u.sum(1) / 3.0, a.size + b.size)
    order = np.argsort(lowers, kind="stable")
    return i[order], j[order], lowers[order], bound


def float_gap(a, b):
    """Returns the distance in floats, 0 if the meshes seem to touch, and the direction from A to B there. Proves nothing."""
    i, j, lowers, _ = ranked(a, b)
    begin, count, least, normal = 0, FIRST, np.inf, None
    while begin < len(i) and lowers[begin] < least:
        now = slice(begin, begin + count)
        distances, at_a, at_b, crosses = nearest_points(a.triangles[i[now]], b.triangles[j[now]])
        if crosses.any():
            return 0.0, None
        k = int(np.argmin(distances))
        if distances[k] < least:
            least, normal = float(distances[k]), (at_b[k] - at_a[k]) / max(distances[k], sys.float_info.min)
        begin, count = begin + count, 4 * count
    return least, normal


def bounds(a, b):
    """Returns two floats between which the exact distance of two placed meshes certainly is: 0 and 0 if they touch."""
    i, j, lowers, bound = ranked(a, b)
    distances, _, _, crosses = nearest_points(a.triangles[i[:FIRST]], b.triangles[j[:FIRST]])
    k = int(np.argmin(np.where(crosses, 0.0, distances)))
    upper = exact_distance(a, b, i[k], j[k])[1]
    enough = upper * (1.0 - SLACK) - 2.0 * SLAB_ERROR * (a.size + b.size)
    # Only pairs that the slab between their centres does not separate well enough are looked at again, with a better slab.
    left = lowers < enough
    i, j, lower = i[left], j[left], min(bound, lowers[~left].min(initial=np.inf))
    _, at_a, at_b, crosses = nearest_points(a.triangles[i], b.triangles[j])
    lowers = slabs(a.triangles[i], b.triangles[j], at_a, at_b, a.size + b.size)
    lower = min(lower, lowers[lowers >= enough].min(initial=np.inf))
    for k in sorted(np.flatnonzero(lowers < enough), key=lambda k: not crosses[k]):
        low, high = exact_distance(a, b, i[k], j[k])
        lower, upper = min(lower, low), min(upper, high)
        if upper == 0.0:
            break
    return max(0.0, min(float(lower), upper)), upper


def contacts(a, b):
    """Returns all pairs of triangles that touch, exactly."""
    i, j, lowers, _ = ranked(a, b, 0.0)
    i, j = i[lowers <= 0.0], j[lowers <= 0.0]
    # A triangle that pads the tree counts once.
    pairs = np.unique(np.stack([a.tree.order[i], b.tree.order[j]], 1), axis=0, return_index=True)[1]
    i, j = i[pairs], j[pairs]
    _, at_a, at_b, _ = nearest_points(a.triangles[i], b.triangles[j])
    left = slabs(a.triangles[i], b.triangles[j], at_a, at_b, a.size + b.size) <= 0.0
    meet = [(k, l) for k, l in zip(i[left], j[left]) if truth.triangles_meet(*exact_pair(a, b, k, l)[:2])]
    return [(int(a.tree.order[k]), int(b.tree.order[l])) for k, l in meet]
