"""Bounds the distance of two placed meshes, with proof: closed intervals from boxes, slabs and, where these leave doubt, integers.

Trees of boxes find the pairs of triangles that may be nearest. The boxes of B turn with B, because those of a fan or of a row of
slivers are thin in the mesh's own frame only. An upper bound is the exact distance of one pair (`truth.py`). A lower bound of a pair
is the width of a slab between its triangles or its boxes. Any direction of the slab gives a valid bound, so the search for a good
one need not be exact. What floats round is charged, as the constants derive. Pairs that no slab separates well enough are computed
exactly.
"""

import sys
from fractions import Fraction
from functools import reduce
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import truth
from exact import root_bounds

EDGES = np.array(truth.EDGES)
# What a slab may be off by, as a part of M, the magnitudes that are added to make the largest placed coordinate. A placed coordinate is
# three products and three sums. Each of the five roundings on its way is at most 2^-53 M, or a little more, so that it is off by less
# than 6 * 2^-53 M, which is below 2^-50 M. A slab is dot products of a direction of length at most 2 with placed corners. Three
# coordinates, each off by 2^-50 M and multiplied by at most 2, and five roundings of sums of at most 6 M, are below 2^-46 M. A quotient
# and a difference more are within 2^-45 M. The same holds for slabs between boxes, whose centres and half sides are off by 2^-53 M, and
# which sum over six half sides.
SLAB_ERROR = 2.0**-45
# Once `FIRST` pairs are computed exactly, a lower bound that is less than this part below the upper bound is good enough.
SLACK = 1e-9
# So many of the pairs with the least lower bounds are looked at first.
FIRST = 512
# So many pairs are looked at in one go, which bounds the memory.
CHUNK = 1 << 15


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
        self.largest = float(np.abs(triangles).max())
        # The centres and half sides of the boxes on each level, from the root to the leaves.
        low, high = self.triangles.min(1), self.triangles.max(1)
        self.levels = [((low + high) / 2, (high - low) / 2)]
        for _ in range(self.depth):
            low, high = np.minimum(low[0::2], low[1::2]), np.maximum(high[0::2], high[1::2])
            self.levels.append(((low + high) / 2, (high - low) / 2))
        self.levels.reverse()

    def placed(self, pose):
        """Returns this mesh as a `Placed` at the twelve numbers of a pose, or where it is."""
        return Placed(self, pose)


class Placed:
    """A mesh at a pose, and how large its numbers are."""

    def __init__(self, tree, pose):
        self.tree, self.pose, self.size, self.bits, self.rotation = tree, pose, tree.largest, tree.bits, np.eye(3)
        if pose is not None:
            rows = np.array(pose).reshape(3, 4)
            self.rotation = rows[:, :3]
            self.size = float((np.abs(self.rotation).sum(1) * tree.largest + np.abs(rows[:, 3])).max())
            self.bits += max(map(fraction_bits, pose))

    def moved(self, points):
        return points if self.pose is None else moved(points, self.pose)

    def triangles(self, leaves):
        return self.moved(self.tree.triangles[leaves])

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
    """Returns points at R x + t, whose error `SLAB_ERROR` includes."""
    r = np.array(pose).reshape(3, 4)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return np.stack([row[0] * x + row[1] * y + row[2] * z + row[3] for row in r], -1)


def dot(a, b):
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def length(v):
    return np.sqrt(dot(v, v))


def unit(v):
    """Returns vectors of length 1, to within 2^-50, or shorter ones where that would divide by nothing."""
    return v / np.maximum(length(v), 2.0**-400)[..., None]


def chunks(i, j):
    """Returns pieces of a list of pairs that are short enough to be looked at in one go: at least one."""
    return ((i[k : k + CHUNK], j[k : k + CHUNK]) for k in range(0, max(1, len(i)), CHUNK))


def box_gaps(a, b, axes, step, i, j):
    """Returns lower bounds of distances of nodes on a level, but for what is rounded, from slabs across all axes."""
    (centre_a, half_a), (centre_b, half_b) = a.tree.levels[min(step, a.tree.depth)], b.tree.levels[min(step, b.tree.depth)]
    apart = np.abs(axes @ (b.moved(centre_b[j]) - a.moved(centre_a[i])).T)
    apart -= np.abs(axes @ a.rotation) @ half_a[i].T + np.abs(axes @ b.rotation) @ half_b[j].T
    # The first three axes are those of the coordinates, so their gaps are the sides of a box.
    return np.maximum(length(np.maximum(apart[:3], 0.0).T), apart.max(0))


def walk(a, b, choose):
    """Returns the pairs of leaves that are left if `choose` says on each level which pairs of nodes to keep, from their gaps."""
    x, y, between = np.eye(3), b.rotation.T, b.moved(b.tree.levels[0][0]) - a.moved(a.tree.levels[0][0])
    # Any direction is valid, so a common normal of two axes that are nearly parallel, which means little, does no harm.
    axes = unit(np.concatenate([x, y, *(np.cross(x, one) for one in y), between]))
    i, j = np.zeros(1, np.int64), np.zeros(1, np.int64)
    for step in range(max(a.tree.depth, b.tree.depth) + 1):
        if 0 < step <= a.tree.depth:
            i, j = split(i, j)
        if 0 < step <= b.tree.depth:
            j, i = split(j, i)
        kept = choose(np.concatenate([box_gaps(a, b, axes, step, *some) for some in chunks(i, j)]))
        i, j = i[kept], j[kept]
    return i, j


def promising_pairs(a, b):
    """Returns some pairs of leaves that are near each other: those that are below the nearest nodes on all levels."""
    return walk(a, b, lambda gaps: np.argsort(gaps, kind="stable")[:FIRST])


def near_pairs(a, b, reach):
    """Returns the pairs of leaves whose boxes are at most `reach` apart. The distance of all other pairs is certainly more."""
    limit = reach * (1.0 + SLACK) + 4.0 * SLAB_ERROR * (a.size + b.size)
    return walk(a, b, lambda gaps: gaps <= limit)


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
    n = unit(at_u - at_t)
    width = reduce(np.minimum, (dot(u[:, k], n) for k in range(3))) - reduce(np.maximum, (dot(t[:, k], n) for k in range(3)))
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


def ranked(a, b, reach):
    """Returns near pairs of leaves and lower bounds of their distances, by the slab between their centres, the least first."""
    i, j = near_pairs(a, b, reach)
    lowers = np.concatenate([centre_slabs(a, b, *some) for some in chunks(i, j)])
    order = np.argsort(lowers, kind="stable")
    return i[order], j[order], lowers[order]


def centre_slabs(a, b, i, j):
    t, u = a.triangles(i), b.triangles(j)
    return slabs(t, u, t.sum(1) / 3.0, u.sum(1) / 3.0, a.size + b.size)


def nearest_pair(a, b, i, j):
    """Returns the number of the pair that seems nearest, its distance in floats, 0 if it seems to touch, and the direction there."""
    distances, at_a, at_b, crosses = nearest_points(a.triangles(i), b.triangles(j))
    k = int(np.argmin(np.where(crosses, 0.0, distances)))
    return k, 0.0 if crosses[k] else float(distances[k]), (at_b[k] - at_a[k]) / max(distances[k], sys.float_info.min)


def float_gap(a, b):
    """Returns the distance in floats, 0 if the meshes seem to touch, and the direction from A to B there. Proves nothing."""
    _, least, normal = nearest_pair(a, b, *promising_pairs(a, b))
    i, j, lowers = ranked(a, b, least)
    begin, count = 0, FIRST
    while least > 0.0 and begin < len(i) and lowers[begin] < least:
        now = slice(begin, begin + count)
        _, found, direction = nearest_pair(a, b, i[now], j[now])
        if found < least:
            least, normal = found, direction
        begin, count = begin + count, min(4 * count, CHUNK)
    return least, normal


def bounds(a, b):
    """Returns two floats between which the exact distance of two placed meshes certainly is: 0 and 0 if they touch."""
    i, j = promising_pairs(a, b)
    k, _, _ = nearest_pair(a, b, i, j)
    reach = exact_distance(a, b, i[k], j[k])[1]
    i, j, lowers = ranked(a, b, reach)
    k, _, _ = nearest_pair(a, b, i[:FIRST], j[:FIRST])
    upper = min(reach, exact_distance(a, b, i[k], j[k])[1])
    # Only pairs that the slab between their centres does not separate as far are looked at again, with a better slab.
    i, j, lower = i[lowers < upper], j[lowers < upper], upper
    found, crosses = nearest_slabs(a, b, i, j)
    enough = upper * (1.0 - SLACK) - 2.0 * SLAB_ERROR * (a.size + b.size)
    for count, k in enumerate(np.lexsort((found, ~crosses))):
        if not crosses[k] and found[k] >= (upper if count < FIRST else enough):
            # All that follow are at least as far apart.
            lower = min(lower, float(found[k]))
            break
        low, high = exact_distance(a, b, i[k], j[k])
        lower, upper = min(lower, low), min(upper, high)
        if upper == 0.0:
            break
    return max(0.0, min(lower, upper)), upper


def nearest_slabs(a, b, i, j):
    """Returns lower bounds of distances by the slabs between nearest points, and which pairs seem to cross."""
    found = []
    for some_i, some_j in chunks(i, j):
        t, u = a.triangles(some_i), b.triangles(some_j)
        _, at_a, at_b, crosses = nearest_points(t, u)
        found.append((slabs(t, u, at_a, at_b, a.size + b.size), crosses))
    return [np.concatenate(of) for of in zip(*found)]


def contacts(a, b):
    """Returns all pairs of triangles that touch, exactly."""
    i, j, lowers = ranked(a, b, 0.0)
    i, j = i[lowers <= 0.0], j[lowers <= 0.0]
    # A triangle that pads the tree counts once.
    pairs = np.unique(np.stack([a.tree.order[i], b.tree.order[j]], 1), axis=0, return_index=True)[1]
    i, j = i[pairs], j[pairs]
    left = nearest_slabs(a, b, i, j)[0] <= 0.0
    meet = [(k, l) for k, l in zip(i[left], j[left]) if truth.triangles_meet(*exact_pair(a, b, k, l)[:2])]
    return [(int(a.tree.order[k]), int(b.tree.order[l])) for k, l in meet]
