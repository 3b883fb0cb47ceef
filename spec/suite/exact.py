"""Exact numbers: hex floats, common integer grids, placed corners, and bounds of square roots.

Every finite float is a fraction whose denominator is a power of two. So the corners of both meshes of a question have a common
grid, on which all of them are integers. Integers are exact, and much faster than fractions.
"""

from fractions import Fraction
from math import isqrt, inf, nextafter

SPECIAL = {"nan", "inf", "-inf"}


def to_hex(value):
    """Returns a float as a C99 hex float, without the zeros that `float.hex` adds."""
    if value != value or value in (inf, -inf):
        return str(value)
    mantissa, exponent = float(value).hex().split("p")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}p{exponent}"


def from_hex(text):
    """Returns the float that a hex float states, or NaN or an infinity."""
    return float(text) if text in SPECIAL else float.fromhex(text)


def fraction(number):
    """Returns a number as a fraction: a float, a hex float, an integer, or text such as "1/3"."""
    if isinstance(number, str):
        return Fraction(number) if "x" not in number else Fraction(float.fromhex(number))
    return Fraction(number)


def is_f32(value):
    """Tells whether a fraction is a number of single precision."""
    return fits(value, 24, -149) and abs(value) < 2**128


def fits(value, bits, least_exponent):
    """Tells whether a dyadic fraction has at most so many significant bits, and no bit below 2^least_exponent."""
    value = Fraction(value)
    if value == 0:
        return True
    low = lowest_bit(value)
    return low >= least_exponent and abs(value) < Fraction(2) ** (low + bits)


def lowest_bit(value):
    """Returns the exponent of the lowest bit of a dyadic fraction that is not 0."""
    numerator, denominator = abs(value.numerator), value.denominator
    if denominator & (denominator - 1):
        raise ValueError(f"expected a dyadic fraction, found {value}")
    return (numerator & -numerator).bit_length() - 1 - (denominator.bit_length() - 1)


def placed(vertices, pose):
    """Returns corners placed by the 12 numbers of a pose, in exact arithmetic: R x + t."""
    rows = [[Fraction(v) for v in pose[i : i + 4]] for i in (0, 4, 8)]
    return [tuple(r[0] * x + r[1] * y + r[2] * z + r[3] for r in rows) for x, y, z in vertices]


def placement(vertices, pose):
    """Returns the precision, f32 or f64, in which each order of operations places the corners without rounding.

    All terms of a sum are multiples of a power of two g. If their magnitudes add up to less than 2^24 g or 2^53 g, then each
    partial sum is a number of that precision. Returns None if f64 does not suffice.
    """
    worst = "f32"
    rows = [[Fraction(v) for v in pose[i : i + 4]] for i in (0, 4, 8)]
    if not all(is_f32(v) for row in rows for v in row):
        worst = "f64"
    for corner in vertices:
        for row in rows:
            terms = [t for t in (row[0] * corner[0], row[1] * corner[1], row[2] * corner[2], row[3]) if t]
            if not terms:
                continue
            low = min(lowest_bit(t) for t in terms)
            total = sum(abs(t) for t in terms) / Fraction(2) ** low
            if total >= 2**53 or low < -1000:
                return None
            if total >= 2**24 or low < -126 or sum(abs(t) for t in terms) >= 2**127:
                worst = "f64"
    return worst


def to_grid(*point_lists):
    """Returns lists of points as integers on one common grid, and the number of grid units in 1."""
    low = 0
    for points in point_lists:
        for point in points:
            for value in point:
                value = Fraction(value)
                low = max(low, value.denominator)
    return [[tuple(int(Fraction(v) * low) for v in p) for p in points] for points in point_lists], low


def root_bounds(square):
    """Returns two floats, neighbours or equal, between which the root of a fraction lies."""
    if square == 0:
        return 0.0, 0.0
    # The root of n/d is isqrt(n * d * 4^k) / (d * 2^k), to within one unit of that.
    n, d = square.numerator, square.denominator
    k = max(0, 140 - (n * d).bit_length() // 2)
    value = Fraction(isqrt(n * d << (2 * k)), d << k)
    lower = float(value)
    while Fraction(lower) ** 2 > square:
        lower = nextafter(lower, 0.0)
    while Fraction(nextafter(lower, inf)) ** 2 <= square:
        lower = nextafter(lower, inf)
    return lower, lower if Fraction(lower) ** 2 == square else nextafter(lower, inf)
