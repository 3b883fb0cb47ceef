"""Compares a result with the truth of its query."""

from fractions import Fraction
from math import isfinite

from exact import from_hex

RIGHT, FALSE_NEGATIVE, FALSE_POSITIVE, WRONG, UNDECIDED, REFUSED = "right", "false negative", "false positive", "wrong", "undecided", "refused"
# Times of motions are those of poses that a runner interpolates in its own arithmetic: this much, of 1, is forgiven.
TIME_SLACK = 2.0**-40
# Without a limit, 0 and a number beyond both meshes would bound every depth.
MAX_UPPER_PER_DEPTH = 2.0


class Verdict:
    """What became of an answer: one of the words above, and the errors of its number as parts of the number and of the size."""

    def __init__(self, word, relative=None, of_size=None):
        self.word, self.relative, self.of_size = word, relative, of_size


def judge(case, item, answer, profile, size):
    """Judges an answer. `size` is the largest coordinate of the question, in the unit of the number that it asks for."""
    truth, ask = item["truth"], case["ask"]
    if answer.get("refused") is True:
        return Verdict(RIGHT if truth == "refused" else REFUSED)
    if truth == "refused":
        return Verdict(WRONG)
    found = answer.get("answer")
    if ask in ("collide", "within", "segment"):
        return Verdict(yes_or_no(truth, found))
    if ask in ("contacts", "self_contacts"):
        return Verdict(pairs(truth, found, ask == "self_contacts"))
    if ask in ("side", "relation"):
        return Verdict(RIGHT if found == truth else WRONG)
    if ask in ("distance", "closest"):
        return number(truth, found, answer, profile, size)
    if ask == "ray":
        word = yes_or_no(truth["hit"], found)
        return Verdict(word) if word != RIGHT or not truth["hit"] else number(truth, answer.get("t"), answer, profile, size)
    if ask == "motion":
        return Verdict(motion(truth, found, answer, item.get("grazing", False)))
    if ask == "penetration":
        return penetration(truth, found, answer, profile, size)
    raise ValueError(f"expected a question of the protocol, found {ask}")


def yes_or_no(truth, found):
    if found is truth:
        return RIGHT
    if found is (not truth):
        return FALSE_NEGATIVE if truth else FALSE_POSITIVE
    return WRONG


def pairs(truth, found, either_way):
    """Compares lists of pairs of triangles, in any order. A missing pair weighs more than one too many."""
    if not isinstance(found, list) or not all(is_pair(pair) for pair in found):
        return WRONG
    found = [tuple(sorted(pair) if either_way else pair) for pair in found]
    truth = {tuple(pair) for pair in truth}
    if truth - set(found):
        return FALSE_NEGATIVE
    return RIGHT if len(found) == len(truth) and not set(found) - truth else FALSE_POSITIVE


def is_pair(value):
    return isinstance(value, list) and len(value) == 2 and all(type(index) is int for index in value)


def is_number(value):
    """Tells whether a value of JSON is a number that a float can state."""
    try:
        return type(value) in (int, float) and isfinite(value)
    except OverflowError:
        return False


def is_at_most(value, truth):
    """Tells whether a float is at most the number of a truth, exactly where the truth states it exactly."""
    if "square" in truth:
        return value <= 0 or Fraction(value) ** 2 <= Fraction(truth["square"])
    return Fraction(value) <= Fraction(truth["exact"]) if "exact" in truth else value <= from_hex(truth["upper"])


def is_at_least(value, truth):
    if "square" in truth:
        return value >= 0 and Fraction(value) ** 2 >= Fraction(truth["square"])
    return Fraction(value) >= Fraction(truth["exact"]) if "exact" in truth else value >= from_hex(truth["lower"])


def allowed_error(profile, number, size):
    """Returns the error that the runner claims for a number."""
    return profile.get("distance_error", 0.0) * (number if profile.get("error_unit", "distance") == "distance" else size)


def number(truth, found, answer, profile, size):
    """Judges a number by the error that the runner claims, and its bounds, where it gives them, by themselves."""
    if not is_number(found):
        return Verdict(WRONG)
    lower, upper = from_hex(truth["lower"]), from_hex(truth["upper"])
    error = max(lower - found, found - upper, 0.0)
    relative = error / lower if lower else (0.0 if error == 0.0 else float("inf"))
    of_size = error / size if size else error
    bounds = [answer.get("lower"), answer.get("upper")]
    if bounds != [None, None]:
        if not all(is_number(b) for b in bounds) or not is_at_most(bounds[0], truth) or not is_at_least(bounds[1], truth):
            return Verdict(WRONG, relative if lower else None, of_size)
    is_right = error <= allowed_error(profile, lower, size)
    word = RIGHT if is_right else FALSE_NEGATIVE if upper == 0.0 < found else FALSE_POSITIVE if found == 0 else WRONG
    return Verdict(word, relative if lower else None, of_size)


def motion(truth, found, answer, grazing):
    """Judges whether a motion is free. Only where it grazes may the answer be null, undecided."""
    if found is None and "answer" in answer:
        return UNDECIDED if grazing else WRONG
    if found is not truth["free"]:
        return (FALSE_POSITIVE if truth["free"] else FALSE_NEGATIVE) if isinstance(found, bool) else WRONG
    if truth["free"]:
        return RIGHT
    lower, upper = from_hex(truth["lower"]), from_hex(truth["upper"])
    free_until, touching_at = answer.get("free_until", 0.0), answer.get("touching_at", 1.0)
    if not is_number(free_until) or not is_number(touching_at):
        return WRONG
    return RIGHT if free_until <= upper + TIME_SLACK and lower - TIME_SLACK <= touching_at <= 1.0 else WRONG


def penetration(truth, found, answer, profile, size):
    """Judges an estimate of a depth, or bounds in place of it. Bounds have to tell something: the upper one is at most twice the depth."""
    if found is not None:
        return number(truth, found, answer, profile, size)
    lower, upper = answer.get("lower"), answer.get("upper")
    if not is_number(lower) or not is_number(upper):
        return Verdict(WRONG)
    depth = from_hex(truth["lower"])
    excess = max(upper - depth, 0.0)
    errors = excess / depth if depth else None, excess / size
    if not is_at_least(upper, truth):
        return Verdict(FALSE_NEGATIVE, *errors)
    if not is_at_most(lower, truth):
        return Verdict(FALSE_POSITIVE, *errors)
    if upper > MAX_UPPER_PER_DEPTH * depth + allowed_error(profile, depth, size):
        return Verdict(WRONG if depth else FALSE_POSITIVE, *errors)
    return Verdict(RIGHT, *errors)
