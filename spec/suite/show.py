"""Shows a proof of one result that can be checked by hand, with the two triangles that decide it as fractions.

    python show.py CASE ITEM [TRIANGLE_OF_A TRIANGLE_OF_B]

Without triangles, the nearest two are shown. Triangles that touch have a common point, given by its weights in both. Triangles that are apart
have a direction along which all corners of one are beyond all corners of the other. A point, a segment and a ray up to its hit count as
triangles without area. A motion that is not free is shown at its first contact, and each triangle of a free one with all that it sweeps.
"""

import sys
from fractions import Fraction

import prove
import run
import second
import truth


def main():
    name, number, *pair = sys.argv[1], int(sys.argv[2]), *map(int, sys.argv[3:])
    meshes, cases = run.load()
    case = next((case for case in cases if case["id"] == name), None)
    if case is None or not 0 <= number < len(case["items"]):
        sys.exit(f"expected a case and an item of it, found {name} {number}")
    a, b, unit = both(case, meshes, case["items"][number])
    i, j = pair or nearest_pair(a, b)
    print(f"{name}, item {number}: {case['ask']} of {case['a']} and {case.get('b', 'a probe')}, {case['reason']}; truth {case['items'][number]['truth']}")
    for what, index, t in (("A", i, a[i]), ("B", j, b[j])):
        print(f"triangle {index} of {what}: " + "  ".join("(" + ", ".join(str(Fraction(x, unit)) for x in p) + ")" for p in t))
    of = {}
    for p in a[i]:
        for q in b[j]:
            of.setdefault(truth.sub(p, q), (p, q))
    square, kept, weights = second.nearest(list(of))
    if square == 0:
        for what, side, t in (("A", 0, a[i]), ("B", 1, b[j])):
            shares = {p: sum(w for d, w in zip(kept, weights) if of[d][side] == p) for p in t}
            print(f"a common point in {what}, by weights of its corners (equal ones count once): " + ", ".join(str(share) for share in shares.values()))
        return
    v = [sum(w * d[k] for w, d in zip(weights, kept)) for k in range(3)]
    scale = Fraction(1, max(abs(x) for x in v))
    n = [x * scale for x in v]
    print("direction: (" + ", ".join(map(str, n)) + "), squared distance " + str(square / unit**2))
    for what, t in (("A", a[i]), ("B", b[j])):
        print(f"corners of {what} along it: " + ", ".join(str(truth.dot(n, p) / unit) for p in t))


def both(case, meshes, item):
    """Returns the triangles of both sides on one grid, and the number of grid units in 1. Exits where two triangles prove nothing."""
    if fault := prove.fault(case, meshes, item):
        sys.exit(f"to be refused: {fault}")
    if case["ask"] in ("penetration", "self_contacts") or item["truth"] == {"hit": False} or not all(meshes[case[key]][1] for key in ("a", "b") if key in case):
        sys.exit(f"no two triangles decide this result of {case['ask']}; check.py proves it")
    if "pose" in item:
        return prove.scene(case, meshes, item["pose"])
    if case["ask"] == "motion":
        a, b, v, unit = prove.motion_scene(case, meshes, item)
        if item["truth"]["free"]:
            return a, [u + truth.moved(u, v) for u in b], unit
        at = prove.number_in(item["truth"])
        a, b = ([scaled(t, at.denominator) for t in of] for of in (a, b))
        return a, [truth.moved(u, scaled([v], at.numerator)[0]) for u in b], unit * at.denominator
    if case["ask"] == "ray":
        triangles, (origin, direction), unit = prove.around(case, meshes, item["origin"], item["direction"])
        at = prove.number_in(item["truth"])
        (start,), (way,) = scaled([origin], at.denominator), scaled([direction], at.numerator)
        return [scaled(t, at.denominator) for t in triangles], [(start, start, *truth.moved([start], way))], unit * at.denominator
    ends = [item[key] for key in ("point", "from", "to") if key in item]
    triangles, points, unit = prove.around(case, meshes, *ends)
    return triangles, [(points[0], points[0], points[-1])], unit


def scaled(points, factor):
    return tuple(tuple(x * factor for x in p) for p in points)


def nearest_pair(a, b):
    """Returns the numbers of the two triangles that are nearest to each other."""
    best = None
    for gap, i, j in truth.by_gap(a, b):
        if best is not None and gap >= best[0]:
            break
        square = second.hulls_apart(a[i], b[j])
        if best is None or square < best[0]:
            best = square, (i, j)
    return best[1]


if __name__ == "__main__":
    main()
