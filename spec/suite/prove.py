"""Runs the query of a case in both ways, and states or compares the truth.

A truth is JSON: true, false or null; text; lists of pairs; or, for numbers, {"square": "p/q"} or {"exact": "p/q"} where that is
short, and in all cases {"lower": hex, "upper": hex}, two floats, neighbours or equal, between which the number lies.
"""

from fractions import Fraction

import exact
import second
import truth
from exact import from_hex, placed, root_bounds, to_grid, to_hex

MAX_EXACT_CHARACTERS = 60


def is_finite(numbers):
    return all(x not in exact.SPECIAL for x in numbers)


def corners_of(mesh, pose=None):
    points = [tuple(exact.fraction(x) for x in p) for p in mesh[0]]
    return points if pose is None else placed(points, [exact.fraction(x) for x in pose])


def gather(points, triangles):
    return [tuple(points[i] for i in t) for t in triangles]


def stated_root(square):
    """States a length by the square of it."""
    lower, upper = root_bounds(square)
    stated = {"lower": to_hex(lower), "upper": to_hex(upper)}
    text = str(square)
    return stated if len(text) > MAX_EXACT_CHARACTERS else {"square": text, **stated}


def stated(number):
    """States a fraction."""
    lower, upper = root_bounds(number * number)
    text = str(number)
    return {"lower": to_hex(lower), "upper": to_hex(upper), **({"exact": text} if len(text) <= MAX_EXACT_CHARACTERS else {})}


def rigid_fault(pose):
    """Returns why a pose is none, or None: a number that is not finite, or a matrix that is not a rotation to within 2^-20."""
    if not is_finite(pose):
        return "a number that is not finite"
    rows = [[exact.fraction(v) for v in pose[i : i + 3]] for i in (0, 4, 8)]
    off = max(abs(truth.dot(rows[i], rows[j]) - (i == j)) for i in range(3) for j in range(3))
    if off > Fraction(1, 2**20):
        return "a matrix that is not a rotation"
    return "a reflection" if truth.dot(rows[0], truth.cross(rows[1], rows[2])) < 0 else None


def mesh_fault(mesh):
    """Returns why a mesh is none, or None."""
    vertices, triangles = mesh
    if any(i >= len(vertices) or i < 0 for t in triangles for i in t):
        return "an index beyond the corners"
    used = {i for t in triangles for i in t}
    return None if all(is_finite(vertices[i]) for i in used) else "a coordinate that is not finite"


def scene(case, meshes, pose):
    """Returns the triangles of both meshes as placed, on one grid, and the number of grid units in 1."""
    (a, b), unit = to_grid(corners_of(meshes[case["a"]]), corners_of(meshes[case["b"]], pose))
    return gather(a, meshes[case["a"]][1]), gather(b, meshes[case["b"]][1]), unit


def around(case, meshes, *points):
    """Returns the triangles of a mesh and points on one grid, and the number of grid units in 1."""
    points = [[exact.fraction(x) for x in p] for p in points]
    (a, on_grid), unit = to_grid(corners_of(meshes[case["a"]]), points)
    return gather(a, meshes[case["a"]][1]), on_grid, unit


def fault(case, meshes, item):
    """Returns why a question has to be refused, or None."""
    for name in (case["a"], case.get("b")):
        if name is not None and (found := mesh_fault(meshes[name])):
            return found
    if "pose" in item:
        return rigid_fault(item["pose"])
    return None if is_finite([x for v in item.values() if isinstance(v, list) for x in v if isinstance(x, str)]) else "a number that is not finite"


def first(case, meshes, item):
    """Returns the truth of one question by features."""
    ask = case["ask"]
    if fault(case, meshes, item):
        return "refused"
    if ask in ("closest", "side", "ray", "segment"):
        return about_probe(ask, case, meshes, item)
    if ask == "self_contacts":
        (a,), _ = to_grid(corners_of(meshes[case["a"]]))
        return truth.self_contacts(gather(a, meshes[case["a"]][1]))
    if ask == "motion":
        a, b, v, _ = motion_scene(case, meshes, item)
        at = truth.motion(a, b, v)
        return {"free": True} if at is None else {"free": False, **stated(at)}
    a, b, unit = scene(case, meshes, item["pose"])
    if ask == "contacts":
        return truth.contacts(a, b)
    if ask == "relation":
        return truth.relation(a, b)
    if ask == "penetration":
        square = truth.depth_of_parts(a, b)[0] if has_parts(a, b) else truth.depth(a, b)
        return stated_root(square / unit**2)
    square = truth.squared_distance(a, b)
    if ask == "collide":
        return square == 0
    if square is None:
        raise ValueError("the distance of an empty mesh")
    square = Fraction(square) / unit**2
    return stated_root(square) if ask == "distance" else square <= exact.fraction(item["within"]) ** 2


def has_parts(a, b):
    return any(len(truth.components(of)) > 1 for of in (a, b))


def about_probe(ask, case, meshes, item):
    if ask in ("closest", "side"):
        triangles, (point,), unit = around(case, meshes, item["point"])
        return truth.side(point, triangles) if ask == "side" else stated_root(truth.point_distance(point, triangles) / unit**2)
    keys = ("origin", "direction") if ask == "ray" else ("from", "to")
    triangles, (p, q), _ = around(case, meshes, *(item[key] for key in keys))
    if ask == "segment":
        return truth.segment_hits(p, q, triangles)
    at = truth.first_hit(p, q, triangles)
    return {"hit": False} if at is None else {"hit": True, **stated(at)}


def motion_scene(case, meshes, item):
    """Returns both meshes at the start of a translation, and the way of b, on one grid."""
    start = item["start"]
    if any(start[i] != item["end"][i] for i in range(12) if i % 4 != 3):
        raise ValueError("expected a translation")
    way = [exact.fraction(item["end"][i]) - exact.fraction(start[i]) for i in (3, 7, 11)]
    (a, b, (v,)), unit = to_grid(corners_of(meshes[case["a"]]), corners_of(meshes[case["b"]], start), [way])
    return gather(a, meshes[case["a"]][1]), gather(b, meshes[case["b"]][1]), v, unit


def confirmed(case, meshes, item, stated_truth):
    """Tells whether the second way gives the stated truth as well."""
    ask = case["ask"]
    if fault(case, meshes, item):
        return stated_truth == "refused"
    if ask == "side":
        triangles, (point,), _ = around(case, meshes, item["point"])
        return second.side(point, triangles) == stated_truth
    if ask == "closest":
        triangles, (point,), unit = around(case, meshes, item["point"])
        return holds(stated_truth, second.point_distance(point, triangles) / unit**2)
    if ask == "segment":
        triangles, (p, q), _ = around(case, meshes, item["from"], item["to"])
        return second.segment_hits(p, q, triangles) == stated_truth
    if ask == "ray":
        triangles, (o, d), _ = around(case, meshes, item["origin"], item["direction"])
        if not stated_truth["hit"] or "exact" in stated_truth:
            return second.first_hit_is(o, d, triangles, number_in(stated_truth) if stated_truth["hit"] else None)
        # The number is too long to be stated: the first way only suggests it.
        at = truth.first_hit(o, d, triangles)
        return at is not None and second.first_hit_is(o, d, triangles, at) and {"hit": True, **stated(at)} == stated_truth
    if ask == "motion":
        a, b, v, _ = motion_scene(case, meshes, item)
        return second.motion_is(a, b, v, None if stated_truth["free"] else number_in(stated_truth))
    if ask == "self_contacts":
        (a,), _ = to_grid(corners_of(meshes[case["a"]]))
        return second.self_contacts(gather(a, meshes[case["a"]][1])) == stated_truth
    a, b, unit = scene(case, meshes, item["pose"])
    if ask == "contacts":
        return second.contacts(a, b) == stated_truth
    if ask == "relation":
        return second.relation(a, b) == stated_truth
    if ask == "penetration":
        if has_parts(a, b):
            # The first way only suggests where to move.
            square, exit = truth.depth_of_parts(a, b)
            return second.depth_is(a, b, square, exit) and holds(stated_truth, square / unit**2)
        return holds(stated_truth, second.depth(a, b) / unit**2)
    square = second.squared_distance(a, b)
    if ask == "collide":
        return (square == 0) == stated_truth
    square = Fraction(square) / unit**2
    return holds(stated_truth, square) if ask == "distance" else (square <= exact.fraction(item["within"]) ** 2) == stated_truth


def number_in(stated_truth):
    """Returns the exact number of a truth, where that is short enough to be stated."""
    return Fraction(stated_truth["exact"])


def holds(stated_truth, square):
    """Tells whether a stated length has this square, and whether its bounds are the nearest floats."""
    lower, upper = from_hex(stated_truth["lower"]), from_hex(stated_truth["upper"])
    exact_part = "square" not in stated_truth or Fraction(stated_truth["square"]) == square
    return exact_part and (lower, upper) == root_bounds(Fraction(square))
