"""The second way to a truth: other algorithms, each of which ends with a certificate that is checked exactly.

Distances, contacts and motions come from the shortest vector of a convex hull (Wolfe, "Finding the nearest point in a polytope",
1976), insides from solid angles, hits of rays from segments that end at them, and depths from the hull of all differences of
corners. Only vector arithmetic and boxes are shared with `truth`.
"""

from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from math import atan2, isqrt, lcm, pi

from truth import ZERO, box, box_gap, by_gap, cross, dot, moved, primitive, sub, swept_box


def shortest(points):
    """Returns the square of the shortest vector in the convex hull of points, with a proof.

    The vector x is a convex combination of points, and x . p >= x . x holds for every point p. So no vector of the hull is
    shorter. The loop is Wolfe's, in exact arithmetic; it cannot return to a set of points that it has left.
    """
    return nearest(points)[0]


def nearest(points):
    """Returns the square of the shortest vector, and the points and weights that it is made of."""
    points = list(dict.fromkeys(points))
    kept = [min(points, key=lambda p: dot(p, p))]
    weights = [Fraction(1)]
    while True:
        # The vector is x / unit, in integers.
        unit = lcm(*(w.denominator for w in weights))
        x = tuple(sum(int(w * unit) * p[i] for w, p in zip(weights, kept)) for i in range(3))
        square = dot(x, x)
        closest = min(points, key=lambda p: dot(x, p))
        if dot(x, closest) * unit >= square:
            assert sum(weights) == 1 and min(weights) >= 0 and all(dot(x, p) * unit >= square for p in points)
            return Fraction(square, unit * unit), kept, weights
        kept.append(closest)
        weights.append(Fraction(0))
        while True:
            target = nearest_of_span(kept)
            if min(target) > 0:
                weights = target
                break
            step = min(w / (w - t) for w, t in zip(weights, target) if t <= 0)
            weights = [w + step * (t - w) for w, t in zip(weights, target)]
            kept = [p for p, w in zip(kept, weights) if w]
            weights = [w for w in weights if w]


def nearest_of_span(points):
    """Returns the weights, with the sum 1, of the shortest vector of the plane, line or space through points."""
    size = len(points)
    if size == 1:
        return [Fraction(1)]
    # Elimination without fractions (Bareiss), so that all numbers stay integers: each division is exact.
    rows = [[dot(p, q) for q in points] + [1, 0] for p in points] + [[1] * size + [0, 1]]
    last = 1
    for column in range(size + 1):
        pivot = next(r for r in range(column, size + 1) if rows[r][column])
        rows[column], rows[pivot] = rows[pivot], rows[column]
        head = rows[column][column]
        for r in range(size + 1):
            if r != column:
                factor = rows[r][column]
                rows[r] = [(x * head - factor * y) // last for x, y in zip(rows[r], rows[column])]
        last = head
    return [Fraction(row[-1], row[i]) for i, row in enumerate(rows[:size])]


def hulls_apart(t, u):
    """Returns the squared distance of the convex hulls of two sets of points."""
    return shortest([sub(p, q) for p in t for q in u])


def contacts(a, b):
    return sorted([i, j] for gap, i, j in by_gap(a, b) if gap == 0 and hulls_apart(a[i], b[j]) == 0)


def squared_distance(a, b):
    best = None
    for gap, i, j in by_gap(a, b):
        if best is not None and gap >= best:
            break
        found = hulls_apart(a[i], b[j])
        best = found if best is None else min(best, found)
    return best


def point_distance(point, triangles):
    return squared_distance([(point,)], triangles)


def segment_hits(p, q, triangles):
    around = box((p, q))
    return any(box_gap(around, box(t)) == 0 and hulls_apart((p, q), t) == 0 for t in triangles)


def first_hit_is(o, d, triangles, at):
    """Proves that a ray first hits at this parameter, or nowhere for None, by a segment up to it and one that ends just before.

    The segment before ends at (1 - 2^-60) of the parameter: what lies between is closer than any answer is compared.
    """
    if at is None:
        # A ray that has left the box of the mesh does not come back.
        low, high = box([p for t in triangles for p in t])
        reach = sum(h - l + abs(o[i] - l) for i, (l, h) in enumerate(zip(low, high)))
        step = reach // max(abs(x) for x in d) + 1
        return not segment_hits(o, tuple(o[i] + step * d[i] for i in range(3)), triangles)
    scale = at.denominator << 60
    start = tuple(x * scale for x in o)
    scaled = [tuple(tuple(x * scale for x in p) for p in t) for t in triangles]
    end, before = (at.numerator << 60), (at.numerator << 60) - at.numerator

    def point(k):
        return tuple(start[i] + k * d[i] for i in range(3))

    return segment_hits(start, point(end), scaled) and (at == 0 or not segment_hits(start, point(before), scaled))


def motion_is(a, b, v, at):
    """Proves that b, moving by v, first touches a at this time, or never for None.

    Nothing touches before (1 - 2^-50) of that time, because the hulls that the triangles sweep until then are apart.
    """
    scale = 1 if at is None else at.denominator << 50
    a, b = ([tuple(tuple(x * scale for x in p) for p in t) for t in of] for of in (a, b))
    until = 1 if at is None else (at.numerator << 50) - at.numerator
    swept = tuple(x * until for x in v)
    if at != 0:
        hulls = [(u + moved(u, swept), swept_box(u, swept)) for u in b]
        for t in a:
            around = box(t)
            if any(box_gap(around, reach) == 0 and hulls_apart(t, hull) == 0 for hull, reach in hulls):
                return False
    if at is None:
        return True
    there = tuple(x * (at.numerator << 50) for x in v)
    return squared_distance(a, [moved(u, there) for u in b]) == 0


def winding(point, triangles):
    """Returns how often a closed surface winds around a point, as the sum of solid angles over 4 pi (van Oosterom, Strackee).

    Sines and cosines are computed with 200 more bits than the grid has, and the sum has to be an integer to within 1e-6.
    """
    total = 0.0
    for t in triangles:
        a, b, c = (sub(p, point) for p in t)
        sine = dot(a, cross(b, c))
        x, y, z = (isqrt(dot(p, p) << 400) for p in (a, b, c))
        cosine = x * y * z + ((dot(a, b) * z + dot(b, c) * x + dot(c, a) * y) << 400)
        sine <<= 600
        shift = max(sine.bit_length(), cosine.bit_length(), 1) - 100
        if shift > 0:
            sine, cosine = sine >> shift, cosine >> shift
        total += 2.0 * atan2(sine, cosine)
    turns = round(total / (4.0 * pi))
    assert abs(total / (4.0 * pi) - turns) < 1e-6, "expected a whole number of turns"
    return turns


def is_closed(triangles):
    """Tells whether the boundary of a surface is 0: the sum of its edges, where an edge and its opposite cancel out."""
    boundary = {}
    for t in triangles:
        for p, q in zip(t, t[1:] + t[:1]):
            edge = min(p, q), max(p, q)
            boundary[edge] = boundary.get(edge, 0) + (p < q) - (q < p)
    return not any(boundary.values())


def corners_of_parts(triangles):
    """Returns the corners of each part that is connected, by joining the corners of triangles to the parts that have one of them."""
    parts = []
    for t in triangles:
        joined = set(t).union(*(part for part in parts if not part.isdisjoint(t)))
        parts = [part for part in parts if part.isdisjoint(t)] + [joined]
    return parts


def side(point, triangles):
    if any(shortest([sub(p, point) for p in t]) == 0 for t in triangles if box_gap((point, point), box(t)) == 0):
        return "on"
    if not is_closed(triangles):
        return "undefined"
    return "inside" if winding(point, triangles) else "outside"


def relation(a, b):
    """Returns how two meshes lie, from distances and solid angles at the greatest corner of each part."""
    if squared_distance(a, b) == 0:
        return "touching"
    if not is_closed(a) or not is_closed(b):
        return "undefined"
    a_inside = {winding(max(part), b) != 0 for part in corners_of_parts(a)}
    b_inside = {winding(max(part), a) != 0 for part in corners_of_parts(b)}
    if a_inside == {True} and True not in b_inside:
        return "a in b"
    if b_inside == {True} and True not in a_inside:
        return "b in a"
    return "mixed" if True in a_inside | b_inside else "apart"


@lru_cache(maxsize=64)
def difference_hull(a, b):
    """Returns the planes (n, h), n . x <= h, of the convex hull of all differences of a corner of a and one of b."""
    points = list({sub(p, q) for t in a for p in t for u in b for q in u})
    planes = {}
    for i, j, k in combinations(range(len(points)), 3):
        n = primitive(cross(sub(points[j], points[i]), sub(points[k], points[i])))
        if n == ZERO:
            continue
        for n in (n, (-n[0], -n[1], -n[2])):
            h = dot(n, points[i])
            if n not in planes and all(dot(n, p) <= h for p in points):
                planes[n] = h
    return planes


def depth(a, b):
    """Returns the squared depth of convex polytopes: the distance of the origin from the boundary of the hull of differences.

    The hull only moves with b, so it is computed once for each turn.
    """
    v = b[0][0]
    back = (-v[0], -v[1], -v[2])
    planes = difference_hull(tuple(a), tuple(moved(u, back) for u in b))
    heights = {n: h - dot(n, v) for n, h in planes.items()}
    if min(heights.values()) <= 0:
        return Fraction(0)
    return min(Fraction(h * h, dot(n, n)) for n, h in heights.items())


def depth_is(a, b, square, exit):
    """Proves the depth of two meshes whose connected parts are convex, with a translation of that length as a point and a denominator.

    After that translation no parts overlap. After each translation that is shorter by 2^-20 or more, some do: the ball of these is cut into
    cubes until each is beyond the ball or inside the hull of differences of two parts. Planes that the ball does not reach are left out.
    """
    hulls = []
    for x in corners_of_parts(a):
        for y in corners_of_parts(b):
            v = min(y)
            planes = difference_hull((tuple(sorted(x)),), (tuple(sorted(sub(p, v) for p in y)),))
            hulls.append([(n, h - dot(n, v)) for n, h in planes.items()])
    point, size = exit
    if Fraction(dot(point, point), size * size) != square or any(all(dot(n, point) < h * size for n, h in planes) for planes in hulls):
        return False
    limit = int(square * (2**20 - 1) ** 2 * 4**4)
    scaled = [[(n, sum(max(0, x) for x in n), h << 24) for n, h in planes if h < 0 or h * h < square * dot(n, n)] for planes in hulls]

    def is_covered(low, side):
        gaps = [max(x, -x - side, 0) for x in low]
        if dot(gaps, gaps) > limit or any(all(dot(n, low) + side * reach < h for n, reach, h in planes) for planes in scaled):
            return True
        half = side // 2
        return side > 1 and all(is_covered((low[0] + i, low[1] + j, low[2] + k), half) for i in (0, half) for j in (0, half) for k in (0, half))

    side = 2 ** (limit.bit_length() // 2 + 1)
    return square == 0 or is_covered((-side, -side, -side), 2 * side)


def meet_wrongly(t, u):
    """Tells whether triangles of one mesh meet in more than their common corners, from distances of the parts beyond them."""
    common = set(t) & set(u)
    if len(common) == 3:
        return True
    if not common:
        return hulls_apart(t, u) == 0
    rest_t, rest_u = [p for p in t if p not in common], [p for p in u if p not in common]
    if len(common) == 1:
        return hulls_apart(rest_t, u) == 0 or hulls_apart(rest_u, t) == 0
    # Close to the middle of the common edge, a triangle fills all of its side. So a point that is a millionth of the way from
    # there to the other corner of one triangle is in the other one if and only if both lie on the same side in one plane.
    middle, rest = tuple(x + y for x, y in zip(*common)), rest_t[0]
    point = tuple(m * 2**20 + 2 * x - m for m, x in zip(middle, rest))
    return hulls_apart([point], [tuple(x * 2**21 for x in p) for p in u]) == 0


def self_contacts(triangles):
    boxes = [box(t) for t in triangles]
    pairs = combinations(range(len(triangles)), 2)
    return [[i, j] for i, j in pairs if box_gap(boxes[i], boxes[j]) == 0 and meet_wrongly(triangles[i], triangles[j])]
