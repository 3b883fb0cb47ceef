"""Answers queries by brute force, over every pair of triangles of two meshes whose boxes do not rule it out.

A vertex of an object is `origin + v` (format.md, 15.1). Mesh B is placed by a pose, the rows of a 3x4 matrix [R | t]:
coordinate i of a placed vertex is ((R[i][0] x + R[i][1] y) + R[i][2] z) + t[i], each product and sum rounded to f64 and
never fused. Before that, entries of R below 2^-64 and of t below 2^-213 in magnitude are replaced by 0. Contacts are
decided exactly on these points: touching counts, and a triangle without area stands for the segment or point that it
is. A filter in f64 decides what it can with a bound on its rounding, and integers decide the rest. The distance is
computed in plain f64.
"""

from itertools import product

import numpy as np

import cbvh

ROUNDING = 2.0**-53  # of one f64 operation, relative
UNDERFLOW = 2.0**-1060  # more than all absolute errors of underflow in one sum of products
ROWS, PAIRS = 1 << 20, 1 << 14  # pairs at once: of boxes, of triangles
CORNERS = ((0, 1), (1, 2), (2, 0))


def corners(file):
    """All stored triangles of all objects, with the origins added: [triangle, corner, axis] in f64."""
    return np.concatenate([one.triangles_f32().astype(np.float64) + one.origin for one in file.objects])


def weights(file):
    """How many triangles of the input each stored one represents: itself and its listed duplicates (13)."""
    if cbvh.IDS not in file.sections:
        return np.ones(sum(one.triangles for one in file.objects), int)
    ids = np.concatenate([one.ids() for one in file.objects])
    kept, counts = np.unique(file.duplicates()[:, 0], return_counts=True)
    places = np.searchsorted(kept, ids)
    listed = (places < len(kept)) & (np.append(kept, 0)[places] == ids)
    return 1 + np.where(listed, np.append(counts, 0)[places], 0)


def read_poses(text):
    """Parses one pose [3, 4] from each line of 12 numbers; # starts a comment."""
    rows = [line.split("#")[0].split() for line in text.splitlines()]
    return [np.array(row, np.float64).reshape(3, 4) for row in rows if row]


def place(triangles, pose):
    rotation, translation = pose[:, :3], pose[:, 3]
    rotation = np.where(np.abs(rotation) < 2.0**-64, 0.0, rotation)
    translation = np.where(np.abs(translation) < 2.0**-213, 0.0, translation)
    x, y, z = (triangles[..., axis] for axis in range(3))
    along = [((r[0] * x + r[1] * y) + r[2] * z) + t for r, t in zip(rotation, translation)]
    return np.stack(along, axis=-1)


def gaps_of_boxes(a, b):
    """Squared distances between boxes, in blocks of rows: yields the first row and [rows of a, triangles of b]."""
    a_lo, a_hi, b_lo, b_hi = a.min(1), a.max(1), b.min(1), b.max(1)
    step = max(1, ROWS // len(b))
    for first in range(0, len(a), step):
        rows = slice(first, first + step)
        total = 0.0
        for axis in range(3):
            gap = np.maximum(b_lo[:, axis] - a_hi[rows, axis, None], a_lo[rows, axis, None] - b_hi[:, axis])
            total = total + np.maximum(gap, 0.0) ** 2
        yield first, total


def contacts(a, b):
    """Finds the pairs of triangles that have a point in common. Returns their numbers in a and in b."""
    found = [(np.empty(0, int), np.empty(0, int))]
    for first, gaps in gaps_of_boxes(a, b):
        of_a, of_b = np.nonzero(gaps <= 0.0)
        of_a += first
        for start in range(0, len(of_a), PAIRS):
            one, other = of_a[start : start + PAIRS], of_b[start : start + PAIRS]
            maybe = ~are_apart(a[one], b[other])
            one, other = one[maybe], other[maybe]
            meet = do_cross(a[one], b[other]) | do_cross(b[other], a[one])
            for open_pair in np.nonzero(~meet)[0]:
                meet[open_pair] = have_common_point(a[one[open_pair]], b[other[open_pair]])
            found.append((one[meet], other[meet]))
    return tuple(np.concatenate(side) for side in zip(*found))


def dot(u, v):
    return (u * v).sum(axis=-1)


def are_apart(a, b):
    """True for pairs that a plane certainly separates.

    Any separating axis n is valid, however it was rounded. A projection n·(p - o) takes a rounded difference, a
    product and two sums, so it is off by at most 4 roundings of the sum of |n||p - o|. A bound of 8 also covers the
    rounding of that sum.
    """
    from_o = np.concatenate([a, b], axis=1) - a[:, :1]
    edges_a, edges_b = (t[:, [1, 2, 0]] - t for t in (a, b))
    normals = [np.cross(edges[:, 0], edges[:, 1]) for edges in (edges_a, edges_b)]
    axes = normals + [np.cross(n, edges[:, i]) for n, edges in zip(normals, (edges_a, edges_b)) for i in range(3)]
    axes += [np.cross(edges_a[:, i], edges_b[:, j]) for i, j in product(range(3), repeat=2)]
    apart = np.zeros(len(a), bool)
    for axis in axes:
        axis = axis[:, None]
        reach = dot(axis, from_o)
        doubt = (8 * ROUNDING * dot(np.abs(axis), np.abs(from_o)) + UNDERFLOW).max(axis=1)
        of_a, of_b = reach[:, :3], reach[:, 3:]
        gap = np.maximum(of_b.min(1) - of_a.max(1), of_a.min(1) - of_b.max(1))
        apart |= gap > 2 * doubt
    return apart


def side(p, q, r, s):
    """The signs of the volumes of tetrahedra p, q, r, s; 0 where rounding leaves the sign undecided.

    A term takes 3 rounded differences, 2 products and 3 sums, which makes 8 roundings of the sum of its magnitudes. A
    bound of 16 also covers the rounding of that sum.
    """
    u, v, w = q - p, r - p, s - p
    terms = [u[:, i] * (v[:, j] * w[:, k]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
    terms += [-u[:, i] * (v[:, j] * w[:, k]) for i, j, k in ((0, 2, 1), (1, 0, 2), (2, 1, 0))]
    volume, size = sum(terms), sum(np.abs(term) for term in terms)
    return np.where(np.abs(volume) > 16 * ROUNDING * size + UNDERFLOW, np.sign(volume), 0)


def do_cross(a, b):
    """True for pairs where an edge of the first triangle certainly crosses the interior of the second."""
    cross = np.zeros(len(a), bool)
    sides = [side(b[:, 0], b[:, 1], b[:, 2], a[:, i]) for i in range(3)]
    for i, j in CORNERS:
        turns = [side(a[:, i], a[:, j], b[:, k], b[:, m]) for k, m in CORNERS]
        cross |= (sides[i] * sides[j] < 0) & (np.abs(sum(turns)) == 3)
    return cross


# Exact arithmetic on triples of integers


def minus(u, v):
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


def inner(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def outer(u, v):
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


NOTHING = (0, 0, 0)


def have_common_point(a, b):
    """Decides exactly whether two triangles meet. They do if and only if an edge of one meets the other, because the
    extreme points of their intersection lie on such edges.
    """
    ratios = [float(value).as_integer_ratio() for value in np.concatenate([a, b]).ravel()]
    scale = max(below for _, below in ratios)  # all are powers of two
    whole = [above * (scale // below) for above, below in ratios]
    points = [tuple(whole[i : i + 3]) for i in range(0, 18, 3)]
    a, b = points[:3], points[3:]
    return any(segment_meets_triangle(one[i], one[j], other) for one, other in ((a, b), (b, a)) for i, j in CORNERS)


def segment_meets_triangle(p, q, triangle):
    normal = outer(minus(triangle[1], triangle[0]), minus(triangle[2], triangle[0]))
    if normal != NOTHING:
        of_p, of_q = (inner(normal, minus(end, triangle[0])) for end in (p, q))
        if of_p * of_q > 0:
            return False
        # The point where the line meets the plane, times `weight`; p itself if the segment lies in the plane.
        weight, share = (of_p - of_q, of_p) if of_p != of_q else (1, 0)
        if weight < 0:
            weight, share = -weight, -share
        x = tuple(p[i] * weight + (q[i] - p[i]) * share for i in range(3))
        if all(
            inner(normal, outer(minus(v, u), tuple(x[i] - u[i] * weight for i in range(3)))) >= 0
            for u, v in ((triangle[i], triangle[j]) for i, j in CORNERS)
        ):
            return True
    return any(segments_meet(p, q, triangle[i], triangle[j]) for i, j in CORNERS)


def segments_meet(p, q, r, s):
    along, other, between = minus(q, p), minus(s, r), minus(r, p)
    normal = outer(along, other)
    if normal == NOTHING:  # parallel, or a point
        return is_on(p, r, s) or is_on(q, r, s) or is_on(r, p, q) or is_on(s, p, q)
    square = inner(normal, normal)
    return (
        inner(normal, between) == 0
        and 0 <= inner(outer(between, other), normal) <= square
        and 0 <= inner(outer(between, along), normal) <= square
    )


def is_on(x, r, s):
    return outer(minus(s, r), minus(x, r)) == NOTHING and inner(minus(x, r), minus(x, s)) <= 0


# Distance


def least_distance(a, b):
    """Returns 0 if the meshes meet, else the least distance of two triangles, in f64."""
    if len(contacts(a, b)[0]):
        return 0.0
    best = np.inf
    for first, gaps in gaps_of_boxes(a, b):
        flat = gaps.ravel()
        near = np.nonzero(flat < best)[0]
        if len(near) > PAIRS:  # a first bound from the nearest boxes, then the pairs that it leaves
            head = near[np.argpartition(flat[near], PAIRS // 4)[: PAIRS // 4]]
            best = min(best, squares_of_pairs(a, b, first, head))
            near = near[flat[near] < best]
        near = near[np.argsort(flat[near])]
        for start in range(0, len(near), PAIRS):
            part = near[start : start + PAIRS]
            if flat[part[0]] >= best:
                break
            best = min(best, squares_of_pairs(a, b, first, part[flat[part] < best]))
    return float(np.sqrt(best))


def squares_of_pairs(a, b, first, places):
    of_a, of_b = np.divmod(places, len(b))
    return squares_of_distances(a[first + of_a], b[of_b]).min()


def squares_of_distances(a, b):
    """For each pair, the least squared distance over edges and edges, corners and edges, and corners and faces.

    Each candidate is the distance of two points that certainly lie on the triangles, so rounding of their places cannot
    make it too small. Corners against edges are separate because the search on two edges is ill-conditioned where they
    are parallel.
    """
    best = np.full(len(a), np.inf)
    with np.errstate(all="ignore"):  # edges and faces without extent give NaN, which `fmin` and `clip01` ignore
        for (i, j), (k, m) in product(CORNERS, repeat=2):
            best = np.fmin(best, edge_to_edge(a[:, i], a[:, j], b[:, k], b[:, m]))
        for one, other in ((a, b), (b, a)):
            for corner in range(3):
                p = one[:, corner]
                for i, j in CORNERS:
                    best = np.fmin(best, point_to_edge(p, other[:, i], other[:, j]))
                best = np.fmin(best, point_to_face(p, other[:, 0], other[:, 1], other[:, 2]))
    return best


def clip01(share):
    return np.clip(np.nan_to_num(share, nan=0.0), 0.0, 1.0)[:, None]


def square(u):
    return dot(u, u)


def point_to_edge(p, q, r):
    along = r - q
    return square(q + clip01(dot(p - q, along) / square(along)) * along - p)


def edge_to_edge(p, q, r, s):
    along, other, between = q - p, s - r, r - p
    c = dot(along, other)
    share = clip01(
        (dot(along, between) * square(other) - c * dot(other, between)) / (square(along) * square(other) - c * c)
    )
    on_other = clip01((share[:, 0] * c - dot(other, between)) / square(other))
    share = clip01((dot(along, between) + on_other[:, 0] * c) / square(along))
    return square(p + share * along - (r + on_other * other))


def point_to_face(p, q, r, s):
    u, v, w = r - q, s - q, p - q
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    below = uu * vv - uv * uv
    along_u, along_v = (vv * uw - uv * vw) / below, (uu * vw - uv * uw) / below
    inside = (along_u >= 0) & (along_v >= 0) & (along_u + along_v <= 1)
    return np.where(inside, square(w - along_u[:, None] * u - along_v[:, None] * v), np.nan)
