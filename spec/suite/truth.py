"""The first way to a truth: the features of triangles, one pair after another, in integers.

Points are triples of integers on a common grid (`exact.to_grid`), so that nothing is rounded. Triangles may be degenerate: with
collinear corners they are segments, with equal corners they are points. Touching counts as contact.
"""

from fractions import Fraction
from itertools import combinations
from math import gcd


def sub(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


ZERO = (0, 0, 0)
EDGES = ((0, 1), (1, 2), (2, 0))


def normal(t):
    return cross(sub(t[1], t[0]), sub(t[2], t[0]))


def box(points):
    """Returns the least box around points."""
    xs, ys, zs = zip(*points)
    return (min(xs), min(ys), min(zs)), (max(xs), max(ys), max(zs))


def box_gap(a, b):
    """Returns the squared distance of two boxes."""
    total = 0
    for i in range(3):
        gap = max(a[0][i] - b[1][i], b[0][i] - a[1][i], 0)
        total += gap * gap
    return total


# Contact


def on_segment(p, r, s):
    e, w = sub(s, r), sub(p, r)
    if e == ZERO:
        return p == r
    return cross(w, e) == ZERO and 0 <= dot(w, e) <= dot(e, e)


def segments_meet(p, q, r, s):
    d, e, w = sub(q, p), sub(s, r), sub(r, p)
    c = cross(d, e)
    if c == ZERO:
        # Parallel, or one of them is a point: if they meet, an end of one is on the other.
        return on_segment(p, r, s) or on_segment(q, r, s) or on_segment(r, p, q) or on_segment(s, p, q)
    size = dot(c, c)
    return dot(w, c) == 0 and 0 <= dot(cross(w, e), c) <= size and 0 <= dot(cross(w, d), c) <= size


def in_triangle(p, t, n):
    """Tells whether a point in the plane of a triangle, whose normal n is not 0, is in the triangle."""
    return all(dot(cross(sub(t[j], t[i]), sub(p, t[i])), n) >= 0 for i, j in EDGES)


def segment_meets_triangle(p, q, t):
    n = normal(t)
    if n == ZERO:
        return any(segments_meet(p, q, t[i], t[j]) for i, j in EDGES)
    above_p, above_q = dot(n, sub(p, t[0])), dot(n, sub(q, t[0]))
    if (above_p > 0 and above_q > 0) or (above_p < 0 and above_q < 0):
        return False
    if above_p == above_q == 0:
        return in_triangle(p, t, n) or any(segments_meet(p, q, t[i], t[j]) for i, j in EDGES)
    # The line crosses the plane in one point, which is on the segment. It is in the triangle if all edges turn the same way.
    d = sub(q, p)
    turns = [dot(d, cross(sub(t[i], p), sub(t[j], p))) for i, j in EDGES]
    return all(v >= 0 for v in turns) or all(v <= 0 for v in turns)


def triangles_meet(t, u):
    """If two triangles meet, then an edge of one of them meets the other."""
    return any(segment_meets_triangle(t[i], t[j], u) or segment_meets_triangle(u[i], u[j], t) for i, j in EDGES)


# Distance: squares as pairs (numerator, denominator)


def less(a, b):
    return a[0] * b[1] < b[0] * a[1]


def point_segment(p, r, s):
    e, w = sub(s, r), sub(p, r)
    along, size = dot(w, e), dot(e, e)
    if along <= 0:
        return dot(w, w), 1
    if along >= size:
        w = sub(p, s)
        return dot(w, w), 1
    c = cross(w, e)
    return dot(c, c), size


def point_triangle(p, t):
    best = min((point_segment(p, t[i], t[j]) for i, j in EDGES), key=lambda v: Fraction(*v))
    n = normal(t)
    if n != ZERO and in_triangle(p, t, n):
        above = dot(n, sub(p, t[0]))
        flat = above * above, dot(n, n)
        return flat if less(flat, best) else best
    return best


def lines_apart(p, q, r, s):
    """Returns the squared distance of two segments whose closest points are inside both, or None."""
    d, e, w = sub(q, p), sub(s, r), sub(r, p)
    c = cross(d, e)
    size = dot(c, c)
    if size and 0 < dot(cross(w, e), c) < size and 0 < dot(cross(w, d), c) < size:
        return dot(w, c) ** 2, size
    return None


def triangles_apart(t, u):
    """Returns the squared distance of two triangles that do not meet: of a corner and a triangle, or of two edges."""
    best = None
    for found in (
        *(point_triangle(p, u) for p in t),
        *(point_triangle(p, t) for p in u),
        *(lines_apart(t[i], t[j], u[k], u[l]) for i, j in EDGES for k, l in EDGES),
    ):
        if found is not None and (best is None or less(found, best)):
            best = found
    return best


# Meshes, as lists of triangles


def by_gap(a, b):
    """Returns all pairs of numbers of triangles, those with the nearest boxes first, with the squared gaps of their boxes."""
    boxes_a, boxes_b = [box(t) for t in a], [box(t) for t in b]
    pairs = [(box_gap(x, y), i, j) for i, x in enumerate(boxes_a) for j, y in enumerate(boxes_b)]
    pairs.sort()
    return pairs


def contacts(a, b):
    """Returns all pairs of triangles that meet."""
    return sorted([i, j] for gap, i, j in by_gap(a, b) if gap == 0 and triangles_meet(a[i], b[j]))


def squared_distance(a, b):
    """Returns the squared distance of two meshes in grid units, 0 if they meet, or None if one is empty."""
    best = None
    for gap, i, j in by_gap(a, b):
        if best is not None and gap * best[1] >= best[0]:
            break
        found = (0, 1) if gap == 0 and triangles_meet(a[i], b[j]) else triangles_apart(a[i], b[j])
        if best is None or less(found, best):
            best = found
        if best[0] == 0:
            break
    return None if best is None else Fraction(*best)


# Inside


def is_closed(triangles):
    """Tells whether each directed edge has as many partners in the opposite direction as there are of it."""
    edges = {}
    for t in triangles:
        for i, j in EDGES:
            if t[i] != t[j]:
                edges[t[i], t[j]] = edges.get((t[i], t[j]), 0) + 1
    return all(edges.get((b, a), 0) == count for (a, b), count in edges.items())


DIRECTIONS = ((1, 0, 0), (3, 5, 7), (-11, 4, 9), (13, -17, 6), (101, 57, -31), (-997, 1009, 1013), (4099, -57, 10007))


def winding_along(point, d, triangles):
    """Returns how often a closed surface winds around a point that is not on it, from the signed crossings of a ray in direction d.

    Returns None if the ray meets an edge, a corner or the plane of a triangle edgewise, which says nothing.
    """
    total = 0
    for t in triangles:
        n = normal(t)
        if n == ZERO:
            continue
        slope, height = dot(n, d), dot(n, sub(t[0], point))
        turns = [dot(d, cross(sub(t[i], point), sub(t[j], point))) for i, j in EDGES]
        if all(v > 0 for v in turns) or all(v < 0 for v in turns):
            if slope and height * slope > 0:
                total += 1 if slope > 0 else -1
        elif all(v >= 0 for v in turns) or all(v <= 0 for v in turns):
            if slope == 0 and height == 0 or slope and height * slope > 0:
                return None
    return total


def winding(point, triangles):
    """Returns how often a closed surface winds around a point that is not on it, along the first direction that says it."""
    for d in DIRECTIONS:
        if (total := winding_along(point, d, triangles)) is not None:
            return total
    raise ValueError("no direction avoids all edges")


def point_on(point, triangles):
    return any(segment_meets_triangle(point, point, t) for t in triangles)


def side(point, triangles):
    if point_on(point, triangles):
        return "on"
    if not is_closed(triangles):
        return "undefined"
    return "inside" if winding(point, triangles) else "outside"


def components(triangles):
    """Returns the triangles of each part that is connected through common corners."""
    leader = {}

    def find(x):
        while leader.setdefault(x, x) != x:
            x = leader[x]
        return x

    for t in triangles:
        for corner in t[1:]:
            leader[find(corner)] = find(t[0])
    parts = {}
    for t in triangles:
        parts.setdefault(find(t[0]), []).append(t)
    return list(parts.values())


def relation(a, b):
    """Returns how two meshes lie. If they are closed and do not touch, one corner tells where a connected part is."""
    if squared_distance(a, b) == 0:
        return "touching"
    if not is_closed(a) or not is_closed(b):
        return "undefined"
    a_in_b = [winding(part[0][0], b) != 0 for part in components(a)]
    b_in_a = [winding(part[0][0], a) != 0 for part in components(b)]
    if not any(a_in_b) and not any(b_in_a):
        return "apart"
    if all(a_in_b) and not any(b_in_a):
        return "a in b"
    return "b in a" if all(b_in_a) and not any(a_in_b) else "mixed"


# Points and lines


def point_distance(point, triangles):
    """Returns the squared distance of a point from a mesh."""
    return min(Fraction(*point_triangle(point, t)) for t in triangles)


def ray_segment(o, d, r, s):
    """Returns the least parameter at which a ray meets a segment in one plane with it, or None."""
    e, w = sub(s, r), sub(r, o)
    c = cross(d, e)
    if c == ZERO:
        if cross(w, d) != ZERO:
            return None
        ends = sorted(Fraction(dot(sub(p, o), d), dot(d, d)) for p in (r, s))
        return None if ends[1] < 0 else max(ends[0], Fraction(0))
    size = dot(c, c)
    t, u = Fraction(dot(cross(w, e), c), size), Fraction(dot(cross(w, d), c), size)
    return t if dot(w, c) == 0 and t >= 0 and 0 <= u <= 1 else None


def ray_triangle(o, d, t):
    """Returns the least parameter at which a ray meets a triangle, or None."""
    n = normal(t)
    slope = dot(n, d)
    if slope:
        turns = [dot(d, cross(sub(t[i], o), sub(t[j], o))) for i, j in EDGES]
        if all(v >= 0 for v in turns) or all(v <= 0 for v in turns):
            at = Fraction(dot(n, sub(t[0], o)), slope)
            return at if at >= 0 else None
        return None
    if n != ZERO:
        if dot(n, sub(t[0], o)):
            return None
        if in_triangle(o, t, n):
            return Fraction(0)
    found = [at for i, j in EDGES if (at := ray_segment(o, d, t[i], t[j])) is not None]
    return min(found, default=None)


def first_hit(o, d, triangles):
    return min((at for t in triangles if (at := ray_triangle(o, d, t)) is not None), default=None)


def segment_hits(p, q, triangles):
    return any(segment_meets_triangle(p, q, t) for t in triangles)


# Translations: B moves by v during the time from 0 to 1


def first_touch(t, u, v):
    """Returns the time at which u, moving by v, first meets t, or None.

    Two triangles that come together first touch with a corner on a triangle, or with two edges across each other.
    """
    if triangles_meet(t, u):
        return Fraction(0)
    if v == ZERO:
        return None
    back = (-v[0], -v[1], -v[2])
    times = [ray_triangle(p, v, t) for p in u] + [ray_triangle(p, back, u) for p in t]
    for i, j in EDGES:
        for k, l in EDGES:
            # r + u e = p + s d + at v
            e, d, w = sub(t[j], t[i]), sub(u[l], u[k]), sub(t[i], u[k])
            across = dot(cross(d, v), e)
            if across == 0:
                continue  # Then corners meet no later than edges.
            s = Fraction(dot(cross(w, v), e), across)
            at = Fraction(dot(cross(d, w), e), across)
            along = Fraction(dot(cross(d, v), w), -across)
            if 0 <= s <= 1 and 0 <= along <= 1 and at >= 0:
                times.append(at)
    return min((at for at in times if at is not None and at <= 1), default=None)


def moved(triangle, v):
    return tuple((p[0] + v[0], p[1] + v[1], p[2] + v[2]) for p in triangle)


def swept_box(u, v):
    return box((*u, *moved(u, v)))


def motion(a, b, v):
    """Returns the time of the first contact while b moves by v, or None if there is none."""
    boxes_a = [box(t) for t in a]
    found = []
    for u in b:
        swept = swept_box(u, v)
        found += [first_touch(t, u, v) for t, around in zip(a, boxes_a) if box_gap(around, swept) == 0]
    return min((at for at in found if at is not None), default=None)


# Depth of convex meshes


def depth(a, b):
    """Returns the squared depth of two convex polytopes: the least overlap along a normal of a face or across two edges."""
    normals = {primitive(normal(t)) for t in (*a, *b)}
    edges_a, edges_b = ({primitive(sub(t[j], t[i])) for t in of for i, j in EDGES} for of in (a, b))
    normals |= {primitive(cross(d, e)) for d in edges_a for e in edges_b}
    normals.discard(ZERO)
    points_a, points_b = ({p for t in of for p in t} for of in (a, b))
    best = None
    for n in normals:
        for sign in (1, -1):
            overlap = max(sign * dot(n, p) for p in points_a) - min(sign * dot(n, p) for p in points_b)
            if overlap <= 0:
                return Fraction(0)
            square = Fraction(overlap * overlap, dot(n, n))
            best = square if best is None else min(best, square)
    return best


def projected(planes):
    """Returns the projection of the origin onto the plane, line or point in all planes n . x = h, with a common denominator, or None."""
    if len(planes) == 1:
        ((n, h),) = planes
        return tuple(h * x for x in n), dot(n, n)
    if len(planes) == 2:
        (n, h), (m, k) = planes
        nn, mm, nm = dot(n, n), dot(m, m), dot(n, m)
        along_n, along_m, size = h * mm - k * nm, k * nn - h * nm, nn * mm - nm * nm
        return (tuple(along_n * x + along_m * y for x, y in zip(n, m)), size) if size else None
    (l, g), (m, h), (n, k) = planes
    found = tuple(g * x + h * y + k * z for x, y, z in zip(cross(m, n), cross(n, l), cross(l, m)))
    size = dot(l, cross(m, n))
    return (found, size) if size > 0 else (tuple(-x for x in found), -size) if size else None


def overlap_planes(a, b):
    """Returns planes (n, h): two convex polytopes overlap if b is moved by t, where n . t < h for all of them."""
    if not all(dot(normal(t), sub(p, t[0])) <= 0 for part in (a, b) for t in part for u in part for p in u):
        raise ValueError("expected parts that are convex")
    edges_a, edges_b = ({primitive(sub(t[j], t[i])) for t in of for i, j in EDGES} for of in (a, b))
    normals = {primitive(n) for n in (*map(normal, a), *map(normal, b), *(cross(d, e) for d in edges_a for e in edges_b))} - {ZERO}
    planes = []
    for n in (m for x, y, z in normals for m in ((x, y, z), (-x, -y, -z))):
        planes.append((n, max(dot(n, p) for t in a for p in t) - min(dot(n, p) for t in b for p in t)))
    return planes


def depth_of_parts(a, b):
    """Returns the squared depth of two meshes whose connected parts are convex, and a translation of that length as a point and a denominator.

    Translations after which two parts overlap are the inside of a polytope. Consider the nearest one that is inside none. Along the planes
    of all polytopes that it is on, nothing changes around it, so it is the projection of the origin onto these: onto one plane, the line
    of two or the point of three.
    """
    solids = [overlap_planes(x, y) for x in components(a) for y in components(b)]

    def is_free(point, size):
        return not any(all(dot(n, point) < h * size for n, h in planes) for planes in solids)

    if is_free(ZERO, 1):
        return Fraction(0), (ZERO, 1)
    best, exit = None, None

    def look_at(planes):
        """Tells whether the projection onto planes is nearer than what is known, and keeps it if it is free."""
        nonlocal best, exit
        found = projected(planes)
        if found is None:
            return False
        square = Fraction(dot(found[0], found[0]), found[1] ** 2)
        if best is not None and square >= best:
            return False
        if is_free(*found):
            best, exit = square, found
        return True

    planes = sorted({plane for solid in solids for plane in solid}, key=lambda plane: Fraction(plane[1] ** 2, dot(plane[0], plane[0])))
    near = [plane for plane in planes if look_at([plane])]
    lines = {(i, j) for i, j in combinations(range(len(near)), 2) if look_at([near[i], near[j]])}
    for i, j in sorted(lines):
        for k in range(j + 1, len(near)):
            if (i, k) in lines and (j, k) in lines:
                look_at([near[i], near[j], near[k]])
    return best, exit


def primitive(v):
    """Returns a vector divided by the greatest common divisor, with its first component that is not 0 above 0."""
    common = gcd(*v)
    if common == 0:
        return ZERO
    first = next(x for x in v if x)
    common = common if first > 0 else -common
    return v[0] // common, v[1] // common, v[2] // common


# Contacts of a mesh with itself


def meet_wrongly(t, u):
    """Tells whether two triangles of one mesh share a point outside the hull of their common corners, or are the same."""
    common = [p for p in t if p in u]
    if len(common) == 3:
        return True
    if not common:
        return triangles_meet(t, u)
    rest_t, rest_u = [p for p in t if p not in common], [p for p in u if p not in common]
    if len(common) == 1:
        # From the common corner outwards, the first of the two opposite edges to be reached is in both triangles.
        return segment_meets_triangle(*rest_t, u) or segment_meets_triangle(*rest_u, t)
    edge = sub(common[1], common[0])
    n, m = cross(edge, sub(rest_t[0], common[0])), cross(edge, sub(rest_u[0], common[0]))
    return cross(n, m) == ZERO and dot(n, m) > 0


def self_contacts(triangles):
    boxes = [box(t) for t in triangles]
    count = range(len(triangles))
    pairs = ((i, j) for i in count for j in count[i + 1 :] if box_gap(boxes[i], boxes[j]) == 0)
    return [[i, j] for i, j in pairs if meet_wrongly(triangles[i], triangles[j])]
