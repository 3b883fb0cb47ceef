"""Tests the reader by itself: its tables are those of the specification, its arithmetic is right, and it judges each
golden file as the file's name states.

    python3 -m unittest discover -s spec/reader

runs these tests and those of test_against_cbvh.py.
"""

import glob
import itertools
import os
import random
import re
import types
import unittest
from contextlib import redirect_stderr, redirect_stdout
from fractions import Fraction
from unittest import mock

import numpy as np

import cbvh
import check
import musts
import mutate
import rules
from xxh3 import xxh3_64

SPEC = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
TESTDATA = os.path.join(SPEC, "..", "testdata")


def table(name):
    """Returns the rows of a table of format.md, without the heading and without backquotes around cells."""
    with open(os.path.join(SPEC, "format.md"), encoding="utf-8") as stream:
        lines = stream.read().split(f"<!-- table: {name} -->\n")[1].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]


def golden(pattern):
    paths = sorted(glob.glob(os.path.join(TESTDATA, pattern)))
    for path in paths:
        with open(path, "rb") as stream:
            yield os.path.basename(path), stream.read()


def type_name(dtype):
    """Names a type as the tables do: u8[24], f32."""
    base, shape = dtype.subdtype or (dtype, ())
    return f"{base.kind}{8 * base.itemsize}" + "".join(f"[{n}]" for n in shape)


def exit_code(arguments, output):
    with redirect_stdout(output), redirect_stderr(output):
        try:
            return check.main(arguments)
        except SystemExit as end:
            return end.code


def exponent_of(exact):
    """The greatest e such that 2^e is at most the magnitude of a fraction that is not 0."""
    size = abs(exact)
    e = size.numerator.bit_length() - size.denominator.bit_length()
    return e if Fraction(2) ** e <= size else e - 1


def nearest_f32(exact):
    """The f32 number nearest to a fraction, ties to even, as a fraction."""
    unit = Fraction(2) ** max(exponent_of(exact) - 23, -149) if exact else 1
    return round(exact / unit) * unit


def up(exact):
    """The function `up` of section 8 for an f32 number of at least 0."""
    unit = Fraction(2) ** max(exponent_of(exact) - 15, -141) if exact else 1
    return -(-exact // unit) * unit


def turning_direction(codes):
    a, b = (code - 127 for code in codes[2:])
    return [Fraction(c, 256) for c in (a + b, a - b, 254 - 2 * max(abs(a), abs(b)))]


def turning_slab(codes, lo, hi):
    """Decodes a turning slab from its four bytes and the box of its child, one number at a time (8.1)."""
    least = greatest = 0
    for axis, n in enumerate(turning_direction(codes)):
        p, q = (nearest_f32(n * Fraction(float(ends[axis]))) for ends in (lo, hi))
        lower, upper = (q, p) if n < 0 else (p, q)
        least, greatest = nearest_f32(least + lower), nearest_f32(greatest + upper)
    unit = up(nearest_f32(nearest_f32(greatest - least) * Fraction(float(cbvh.STEP_U8))))
    return nearest_f32(least + nearest_f32(codes[0] * unit)), nearest_f32(greatest - nearest_f32(codes[1] * unit))


def ordered_number(value, bits):
    """The ordered number of an f32 or f64 number, given as its bits, or the bits of an ordered number (1.1)."""
    return value if value < 1 << bits - 1 else value ^ (1 << bits - 1) - 1


def moved(value, steps, dtype):
    """The number whose ordered number is that of a number plus some steps."""
    bits = 8 * np.dtype(dtype).itemsize
    number = ordered_number(int(np.array(value, dtype).view(f"u{bits // 8}")), bits) + steps
    return np.array(ordered_number(number % (1 << bits), bits), f"u{bits // 8}").view(dtype)[()]


def power_of_ten(k):
    return Fraction(float(Fraction(10) ** k))


def significant(s, digits):
    """S of 15.1 for a fraction. Python converts fractions to the nearest f64, and rounds ties to even."""
    if s == 0:
        return 0.0
    least = next(n for n in range(60, -60, -1) if power_of_ten(n) <= abs(s))
    k = digits - 1 - least
    if k >= 0:
        return float(Fraction(round(Fraction(float(s * power_of_ten(k))))) / power_of_ten(k))
    return float(round(Fraction(float(s / power_of_ten(-k)))) * power_of_ten(-k))


def coordinate(predictor, digits, origin, scale, offset, correction):
    """A coordinate, computed one number and one step at a time (15.1)."""
    s = Fraction(float(Fraction(origin) + Fraction(float(offset))))
    if predictor == cbvh.SCALED:
        in_f64 = float(s / Fraction(scale)) or float(s) / scale  # 0 has a sign
        f = moved(np.float32(in_f64), correction, np.float32)
        return float(f) * scale + 0.0
    if predictor == cbvh.SUM:
        p = float(s)
    elif predictor == cbvh.SIGNIFICANT:
        p = significant(s, digits)
    elif predictor == cbvh.SHORTEST:
        candidates = [significant(s, digits) for digits in (6, 7, 8)]
        p = next((c for c in candidates if nearest_f32(Fraction(c)) == s), significant(s, 9))
    else:
        u = power_of_ten(digits)
        p = float(Fraction(round(Fraction(float(s * u)))) / u)
    return float(moved(p + 0.0, correction, np.float64)) + 0.0


def instances(*changes, count=None, names=None, **head):
    """Returns the bytes of an instances section with one record per dictionary of fields.

    Fields that a dictionary leaves out are those of object 0 where it is, without a name and in all groups. `text` is a
    name, stored after those of earlier records. `count` and `names` replace the number of instances and the names.
    """
    records, texts = np.zeros(len(changes), cbvh.INSTANCE_RECORD), b""
    records["member"] = records["meets"] = 0xFFFFFFFF
    records["rotation"] = np.eye(3).ravel()
    for record, fields in zip(records, changes):
        text = fields.get("text", b"")
        record["name_offset"], record["name_length"] = len(texts), len(text)
        texts += text
        for field in fields.keys() - {"text"}:
            record[field] = np.ravel(fields[field]) if field == "rotation" else fields[field]
    texts = texts if names is None else names
    first = np.zeros((), cbvh.INSTANCE_HEAD)
    first["instances"], first["names_length"] = len(changes) if count is None else count, len(texts)
    for field, value in head.items():
        first[field] = value
    return first.tobytes() + records.tobytes() + texts


def sections_of(file):
    """The kind, `required` and bytes of each section."""
    return [
        (entry.kind, entry.required, bytes(file.data[entry.offset : entry.offset + entry.length]))
        for entry in file.entries
    ]


def file_of(sections):
    """Returns a file of these sections, given as by `sections_of`, placed as writers place them (2)."""
    sections = list(sections)
    end, table, body = cbvh.head_bytes(len(sections)), [], b""
    first = end
    for kind, required, content in sections:
        start = cbvh.aligned(end, cbvh.alignment_of(kind))
        table.append((kind, required, start, len(content), 0))
        body = body.ljust(start - first, b"\0") + content
        end = start + len(content)
    length = cbvh.aligned(end, cbvh.LINE)
    header = np.zeros((), cbvh.HEADER)
    header["magic"] = np.frombuffer(cbvh.MAGIC, "u1")
    header["major"], header["minor"] = cbvh.MAJOR, cbvh.MINOR
    header["sections"], header["file_length"] = len(sections), length
    head = header.tobytes() + np.array(table, cbvh.SECTION_ENTRY).tobytes()
    data = bytearray((head + body).ljust(length, b"\0"))
    mutate.seal(data)
    return bytes(data)


def with_section(data, section, required=0, before=0, kind=cbvh.INSTANCES):
    """Returns a file with a section of these bytes, behind all sections but the last `before` ones."""
    sections = sections_of(rules.open_file(data))
    sections.insert(len(sections) - before, (kind, required, section))
    return file_of(sections)


def after(number, towards=np.inf):
    """The f64 next to a number, in the direction of another."""
    return float(np.nextafter(number, towards))


class Tables(unittest.TestCase):
    def test_structures(self):
        structures = {
            "Header": cbvh.HEADER,
            "SectionEntry": cbvh.SECTION_ENTRY,
            "object-head": cbvh.OBJECT_HEAD,
            "ObjectRecord": cbvh.OBJECT_RECORD,
            "instance-head": cbvh.INSTANCE_HEAD,
            "InstanceRecord": cbvh.INSTANCE_RECORD,
            "topology-head": cbvh.TOPOLOGY_HEAD,
            "TopologyRecord": cbvh.TOPOLOGY_RECORD,
            "Net": cbvh.NET,
            "PageHeader": cbvh.PAGE_HEADER,
            "PackedHead": cbvh.PACKED_HEAD,
            "Corrections": cbvh.CORRECTIONS,
            "id-entry": cbvh.ID_ENTRY,
        }
        for name, dtype in structures.items():
            fields = [(dtype.fields[field][1], dtype.fields[field][0], field) for field in dtype.names]
            ours = [[str(at), str(kind.itemsize), type_name(kind), field] for at, kind, field in fields]
            self.assertEqual([row[:4] for row in table(name)], ours, name)

    def test_lists(self):
        self.assertEqual([[int(c) for c in row[2:]] for row in table("directions")], cbvh.DIRECTIONS.tolist())
        self.assertEqual([int(row[1]) for row in table("directions")], [cbvh.row_of(slab) for slab in range(13)])
        for row, places, profile in zip(table("profiles"), table("places"), cbvh.PROFILES, strict=True):
            ours = [profile.name, 2 * profile.slabs, *profile[1:6]]
            ours += ["yes" if part else "no" for part in (profile.turning, profile.short)]
            self.assertEqual(row[1:], [str(value) for value in ours])
            self.assertEqual(places, [str(value) for value in (profile.name, *profile[6:-2])])
        short = [[profile.name, *map(str, profile.short)] for profile in cbvh.PROFILES if profile.short]
        self.assertEqual(table("short-places"), short)
        codes = [[str(nibble), str(code)] for nibble, code in enumerate(cbvh.SHORT_CODES)]
        self.assertEqual(table("short-codes"), codes)
        ours = [[f"{first}..{end}", field] for field, (first, end) in cbvh.LINKS.items()]
        self.assertEqual([row[:2] for row in table("links")], ours)
        self.assertEqual(list(cbvh.LINKS), list(cbvh.SORTS.values()))
        turning = [[profile.name, *profile.turning] for profile in cbvh.PROFILES if profile.turning]
        self.assertEqual(table("turning"), [[row[0], *(f"{first} + c" for first in row[1:])] for row in turning])
        self.assertEqual([row[1] for row in table("triangle-encodings")], cbvh.ENCODINGS)
        for number, (row, predictor) in enumerate(zip(table("predictors"), cbvh.PREDICTORS, strict=True)):
            digits = sorted({str(predictor.least), str(predictor.most)})
            origin = "0" if predictor.needs_no_origin else "any"
            self.assertEqual(row[:4], [str(number), predictor.name, " to ".join(digits), origin])
        self.assertEqual([int(row[0]) for row in table("patterns")], list(range(0, len(cbvh.PATTERNS), 4)))
        ours = ["".join(f"{slot:x}" for slot in pattern) for pattern in cbvh.PATTERNS.reshape(-1, 12).tolist()]
        self.assertEqual(" ".join(row[1] for row in table("patterns")).split(), ours)
        kinds = {int(row[0]): (row[2] == "yes", row[3] == "yes") for row in table("sections")}
        self.assertEqual(kinds, {kind: (kind in cbvh.NEEDED, kind in cbvh.CONTENT) for kind in cbvh.KINDS})

    def test_constants(self):
        stated = {row[0]: int(row[1], 0) for row in table("constants")}
        self.assertEqual(rules.MAX_COORDINATE, 2.0 ** stated.pop("LOG2_MAX_COORDINATE"))
        self.assertEqual(rules.MAX_WORLD, 2.0 ** stated["LOG2_MAX_WORLD"])
        self.assertEqual(rules.MAX_RADIUS, 2.0 ** stated["LOG2_MAX_RADIUS"])
        self.assertEqual(rules.MAX_RIGID_ERROR, 2.0 ** -stated["RIGID_BITS"])
        self.assertEqual(stated.pop("PAGE_HEADER_BYTES"), cbvh.PAGE_HEADER.itemsize)
        self.assertEqual(stated.pop("PATTERNS"), len(cbvh.PATTERNS))
        for name, parts in (("STEP_U8", 255), ("STEP_U4", 15)):
            self.assertEqual(getattr(cbvh, name).view(np.uint32), stated.pop(name))
            self.assertEqual(getattr(cbvh, name), np.float32(1) / np.float32(parts))
        for name, value in stated.items():
            self.assertEqual(getattr(cbvh, name), value, name)

    def test_rows_of_turning_slabs(self):
        for profile in cbvh.PROFILES:
            if profile.turning:
                starts = [profile.row * row + hi for row in (7, 14) for hi in (0, profile.hi)]
                self.assertEqual(list(profile.turning), starts)

    def test_example_of_decoding(self):
        treelet = np.array([bytes.fromhex("".join(row[1] for row in table("example-treelet")))], "S64").view("u1")
        profile, rows = cbvh.PROFILES[0], table("example-child")
        places = cbvh.places_of_codes(profile)[1]
        codes = treelet[places], treelet[places + profile.hi]
        self.assertEqual([[int(row[3]), int(row[4])] for row in rows], np.transpose(codes).tolist())
        kinds, links = (int.from_bytes(treelet[at : at + 4].tobytes(), "little") for at in (28, 60))
        self.assertEqual((kinds, links), (0x261, 0x4B008A05))
        found = {field: cbvh.bits_of(links, *bits) for field, bits in cbvh.LINKS.items()}
        self.assertEqual(found, {"first_treelet": 5, "first_short": 20, "first_remote": 2, "first_leaf": 300})

        def bits(column):
            return np.array([int(row[column].split()[0], 0) for row in rows], np.uint32).view(np.float32)

        lo, hi = cbvh.decode_slabs(profile, 0, bits(1), bits(2), *codes)
        self.assertEqual(lo.tobytes(), bits(6).tobytes())
        self.assertEqual(hi.tobytes(), bits(7).tobytes())


class Arithmetic(unittest.TestCase):
    def test_checksum(self):
        """Tests lengths on both sides of each change of method, with the input of xxHash's own sanity check."""
        state, data = 2654435761, bytearray()
        for _ in range(2367):
            data.append(state >> 56)
            state = state * 11400714785074694797 % (1 << 64)
        vectors = {
            0: 0x2D06800538D394C2,
            1: 0xC44BDFF4074EECDB,
            6: 0x27B56A84CD2D7325,
            12: 0xA713DAF0DFBB77E7,
            24: 0xA3FE70BF9D3510EB,
            48: 0x397DA259ECBA1F11,
            80: 0xBCDEFBBB2C47C90A,
            195: 0xCD94217EE362EC3A,
            403: 0xCDEB804D65C6DEA4,
            512: 0x617E49599013CB6B,
            2048: 0xDD59E2C3A5F038E0,
            2240: 0x6E73A90539CF2948,
            2367: 0xCB37AEB9E5D361ED,
        }
        for length, checksum in vectors.items():
            self.assertEqual(xxh3_64(data[:length]), checksum, length)

    def test_bit_arrays(self):
        chance = random.Random(1)
        for width in range(33):
            data = chance.randbytes(200)
            whole = int.from_bytes(data[3:], "little")
            expected = [whole >> 5 + (width + 7) * i & (1 << width) - 1 for i in range(30)]
            self.assertEqual(cbvh.bit_values(data, 3, 5, width + 7, width, 30).tolist(), expected)

    def test_rounding_of_steps(self):
        bits = np.array([0, 1, 0x100, 0x101, 0x3F8000FF, 0x3F800100, 0x3FFFFF01, 0x80000001], np.uint32)
        up = cbvh.round_up_to_16_bits(bits.view(np.float32)).view(np.uint32)
        expected = [0, 0x100, 0x100, 0x200, 0x3F800100, 0x3F800100, 0x40000000, 0x80000100]
        self.assertEqual(up.tolist(), expected)

    def test_coordinates_one_number_at_a_time(self):
        chance = random.Random(6)
        for predictor, what in enumerate(cbvh.PREDICTORS):
            for _ in range(60):
                digits = chance.randint(what.least, what.most)
                size = chance.choice((0, 0, 1e6, 2.0**-149, 1e-30, 1e36))
                origin = 0.0 if what.needs_no_origin else chance.choice((0.0, -0.0, chance.uniform(-1, 1) * size))
                scale = chance.choice((0.001, -0.0254, 3e5, 2.0**-300))
                values = [chance.uniform(-1, 1) * 10.0 ** chance.choice((0, 3, -3, 36, -38, -44)) for _ in range(20)]
                offsets = list(map(np.float32, (*values, 0, -0.0, 1, -10, 9.999999e9, 1e-5, 0.1, 123456.7)))
                steps = [chance.choice((0, 0, 1, -1, chance.randint(-(1 << 40), 1 << 40))) for _ in offsets]
                rule = predictor, digits, origin, scale
                with np.errstate(over="ignore"):
                    found = cbvh.coordinates(*rule, np.array(offsets), np.array(steps))
                    expected = [coordinate(*rule, offset, step) for offset, step in zip(offsets, steps)]
                self.assertEqual(found.dtype, np.float64)
                # Steps may lead to NaN, of which the bits are not specified.
                same = found.view(np.uint64) == np.array(expected).view(np.uint64)
                same |= np.isnan(found) & np.isnan(expected)
                self.assertTrue(same.all(), (rule, np.array(offsets)[~same], np.array(steps)[~same], found[~same]))

    def test_printed_numbers_come_back(self):
        """What programs print of f32 numbers, read as f64, is what predictors give, with few exceptions."""
        chance = np.random.default_rng(3)
        values = (chance.uniform(-1, 1, 3000) * 10.0 ** chance.integers(-6, 7, 3000)).astype(np.float32)
        values = np.concatenate([values, np.float32([0, 1, -1, 0.1, 1e-3, 1e6])])
        none = np.zeros(len(values), np.int64)
        for texts, rule in (
            ([f"{value:.8e}" for value in values.tolist()], (cbvh.SIGNIFICANT, 9)),
            ([f"{value:.5e}" for value in values.tolist()], (cbvh.SIGNIFICANT, 6)),
            ([str(value) for value in values], (cbvh.SHORTEST, 0)),
        ):
            given = np.array([float(text) for text in texts]) + 0.0
            found = cbvh.coordinates(*rule, 0.0, 0.0, given.astype(np.float32), none)
            self.assertLessEqual((found != given).mean(), 0.002, rule)
        for digits in (0, 3, 7):
            given = np.array([float(f"{1e5 + value:.{digits}f}") for value in np.clip(values, -9, 9).tolist()])
            found = cbvh.coordinates(cbvh.DECIMALS, digits, 1e5, 0.0, (given - 1e5).astype(np.float32), none)
            self.assertTrue((found == given).all())

    def test_ordered_numbers(self):
        for dtype in (np.float32, np.float64):
            values = np.array([-np.inf, -1e30, -1, -(2.0**-126), -0.0, 0, 2.0**-126, 0.5, np.inf], dtype)
            numbers = cbvh.ordered(values)
            self.assertEqual(numbers[4:6].tolist(), [-1, 0])
            self.assertTrue((np.diff(numbers) > 0).all())
            self.assertEqual(cbvh.ordered(numbers).tobytes(), values.tobytes())

    def test_sums_are_rounded_outward(self):
        chance = random.Random(2)
        rows = []
        for _ in range(5000):
            x, y, z = (
                np.float32(chance.uniform(-1, 1) * 2.0 ** chance.choice((0, 0, -30, -60, -120))) for _ in range(3)
            )
            rows.append((x, y, chance.choice((z, -x, -y, np.float32(-x - y)))))
        rows = np.array(rows, np.float64)
        down, up = rules.exact_sum_outward(*rows.T)
        for (x, y, z), low, high in zip(rows, down, up):
            exact = Fraction(x) + Fraction(y) + Fraction(z)
            self.assertTrue(Fraction(low) <= exact <= Fraction(high))
            self.assertEqual(high, low if Fraction(low) == exact else np.nextafter(low, np.inf))

    def test_turning_directions(self):
        """Tests what 7.4 states about directions, for all codes."""
        codes = np.zeros((256, 256, 4), np.uint8)
        codes[..., 2], codes[..., 3] = np.arange(256)[:, None], np.arange(256)
        n = cbvh.turning_directions(codes)
        self.assertTrue((np.abs(n) <= 256).all() and n.any(axis=-1).all())
        lengths = np.sqrt((n[:255, :255] ** 2).sum(axis=-1)) / 256
        self.assertTrue(0.57 <= lengths.min() and lengths.max() <= 1)
        for a, b in ((0, 0), (127, 127), (211, 127), (3, 250), (255, 255), (0, 255)):
            self.assertEqual([Fraction(int(c), 256) for c in n[a, b]], turning_direction((0, 0, a, b)))

    def test_decoding_of_turning_slabs(self):
        chance, rows = random.Random(3), []
        for _ in range(4000):
            size = chance.choice((0, 0, 0, -30, 115, -130, -149))
            ends = np.array([chance.uniform(-1, 1) * 2.0 ** (size - chance.choice((0, 0, 8, 40))) for _ in range(6)])
            lo, hi = np.sort(ends.astype(np.float32).reshape(2, 3), axis=0)
            if chance.random() < 0.1:
                hi = lo
            rows.append((list(chance.randbytes(4)), lo, hi))
        codes, lo, hi = map(np.array, zip(*rows))
        found = cbvh.decode_turning(codes.astype(np.uint8), lo, hi)
        self.assertEqual([ends.dtype for ends in found], [np.float32, np.float32])
        for row, ends in zip(rows, zip(*found)):
            self.assertEqual(tuple(Fraction(float(end)) for end in ends), turning_slab(*row), row)

    def test_turning_slabs_are_compared_exactly(self):
        """Slabs without width around one point. The sum 84 + 86 2^-60 - 84 is 0 in f64 and in f32, but not exactly."""
        for a, b, n, corner, holds in (
            (212, 126, [84, 86, 84], (1, 0, -1), True),
            (212, 126, [84, 86, 84], (1, 2.0**-60, -1), False),
            (212, 126, [84, 86, 84], (1, -(2.0**-60), -1), False),
            (212, 126, [84, 86, 84], (2.0**120, 2.0**-149, -(2.0**120)), False),
            (255, 255, [256, 0, -2], (2.0**120, 0, -(2.0**120)), True),  # 256 times the ends is no f32 number
        ):
            codes = np.array([[[0, 0, a, b]]], np.uint8)
            self.assertEqual(cbvh.turning_directions(codes).tolist(), [[n]])
            owner = types.SimpleNamespace(left_out=np.zeros(3, np.float32))
            page = types.SimpleNamespace(treelets=1, owner=owner, turning_codes=lambda codes=codes: codes)
            points = np.array([corner] * 3)
            slabs = points[:1, None].astype(np.float32)
            children = [[rules.Subtree(None, None, 1, points)]]
            found = rules.turning_slabs_that_hold(page, slabs, slabs, children)
            self.assertEqual(found, {(0, 0): holds}, corner)


def bit_array(fields):
    """The bytes of a bit array of values, given as pairs of a value and its width (1.4)."""
    whole = at = 0
    for value, width in fields:
        whole |= value << at
        at += width
    return whole.to_bytes(cbvh.ceil_div(at, 8), "little")


def set_bits(data, at, word):
    """Sets the bits of a number in the u32 at a place."""
    data[at : at + 4] = (int.from_bytes(data[at : at + 4], "little") | word).to_bytes(4, "little")


class Tree:
    """One page of an object, whose treelets are lists of kinds. The last `last` of them are short, and the first
    `roots` are roots. The page is number `number`, and there is one more.

    Numbers, links and the header are as sections 6 and 7 require. `links` replaces links, given by slot and field, and
    `fields` replaces fields of the header. Short treelets have the bytes `codes`, but for kinds and links. What does
    not fit in a page is left out.
    """

    def __init__(self, profile, kinds, last=0, roots=1, number=0, links=None, codes=bytes(32), **fields):
        layout, full = cbvh.PROFILES[profile], len(kinds) - last
        remotes, packets = (sum(cbvh.sort_of(kind) == sort for row in kinds for kind in row) for sort in (2, 4))
        data = bytearray(64)
        for root in range(roots):
            ends = np.array([-1, 2], "<f4").repeat(layout.slabs).tobytes()
            parent = number - 1 if number else cbvh.NO_PARENT
            data += ends.ljust(layout.anchor_bytes - 8, b"\0") + parent.to_bytes(4, "little") + bytes([root, 0, 0, 0])
        for link in range(remotes):
            data += (64 * (number + 1) + link).to_bytes(4, "little")
        data += bytes(-len(data) % 64)
        header = np.zeros((), cbvh.PAGE_HEADER)
        fields = {
            **{"page_number": number, "packets": packets, "roots": roots, "treelets": len(kinds), "remotes": remotes},
            **{"treelet_line": len(data) // 64, "profile": profile, "short": last},
            **fields,
        }
        for field, value in fields.items():
            header[field] = value
        counters = {1: roots, 3: full, 2: 0, 4: 0}
        for slot, row in enumerate(kinds):
            is_short, at = slot >= full, len(data)
            data += codes if is_short else bytes(layout.treelet_bytes)
            places = layout.short if is_short else layout
            for place in (places.kinds_at, places.links_at):
                data[at + place : at + place + 4] = bytes(4)
            set_bits(data, at + places.kinds_at, sum(kind << 4 * child for child, kind in enumerate(row)))
            for sort, (field, (first, end)) in zip(counters, cbvh.LINKS.items()):
                value = (links or {}).get((slot, field), counters[sort]) & (1 << end - first) - 1
                if sort == cbvh.LEAF or not is_short:
                    set_bits(data, at + places.links_at, value << first)
                counters[sort] += sum(cbvh.sort_of(kind) == sort for kind in row)
        data[:64] = header.tobytes()
        self.data, self.number, self.profile = data[:4096].ljust(4096, b"\0"), number, profile

    def touch(self):
        page = self.data[8:]
        data = bytes(4096 * self.number) + xxh3_64(bytes(page)).to_bytes(8, "little") + page
        file = types.SimpleNamespace(data=bytes(data), sections={cbvh.NODES: types.SimpleNamespace(offset=0)})
        owner = types.SimpleNamespace(file=file, layout=cbvh.PROFILES[self.profile], profile=self.profile)
        owner.first_page, owner.pages, owner.f16_exponent = 0, self.number + 2, 0
        return rules.touch(owner, self.number)

    def verdict(self):
        return mutate.broken_by(self.touch)


class Treelets(unittest.TestCase):
    # The last three treelets are short. Slot 2 could be short, too.
    NARROW = [1, 3, 4], [2, 3, 1, 3], [7, 5], [7, 6, 5, 4], [4], [7, 7, 7]
    WIDE = [1, 3, 4, 2, 3, 2, 3, 7], [7] * 8, [4, 5, 6, 7, 7, 6, 5, 4], [4], [7, 7, 7, 7, 5]

    def test_places_and_targets(self):
        page = Tree(0, self.NARROW, 3).touch()
        starts = [192, 256, 320, 384, 416, 448, 480]  # after a header, an anchor and a link
        self.assertEqual([page.treelet_at(slot) for slot in range(7)], starts)
        self.assertEqual([page.kinds_at(slot) for slot in (2, 3)], [320 + 28, 384 + 28])
        expected = [
            [(1, 1), (3, 3), (4, 0)],
            [(2, 0), (3, 4), (1, 2), (3, 5)],
            [(7, 1), (5, 2)],
            [(7, 3), (6, 4), (5, 5), (4, 6)],
            [(4, 7)],
            [(7, 8), (7, 9), (7, 10)],
        ]
        self.assertEqual([page.targets(slot) for slot in range(6)], expected)
        self.assertEqual(page.lanes_used().sum(axis=1).tolist(), [1, 4, 2, 4, 3, 2, 1, 1, 4, 4, 4])
        page = Tree(1, self.WIDE, 3).touch()
        starts = [128, 192, 256, 288, 320, 352]  # header, anchor and links take 104 bytes
        self.assertEqual([page.treelet_at(slot) for slot in range(6)], starts)
        self.assertEqual([page.kinds_at(slot) for slot in (1, 2)], [192 + 28, 256 + 12])
        self.assertEqual(page.targets(2), [(kind, 10 + child) for child, kind in enumerate(self.WIDE[2])])

    def test_decoding_one_number_at_a_time(self):
        chance, codes = random.Random(8), {int(nibble): int(code) for nibble, code in table("short-codes")}
        for profile, kinds in ((0, self.NARROW), (1, self.WIDE)) * 10:
            stored = chance.randbytes(32)
            page = Tree(profile, kinds, 3, codes=stored).touch()
            own_lo, own_hi, lo, hi = page.decode()
            self.assertEqual((lo.dtype, hi.dtype), (np.float32, np.float32))
            of_slot = {
                target: (slot, child)
                for slot in range(page.treelets)
                for child, (kind, target) in enumerate(page.targets(slot))
                if kind == 3
            }
            self.assertEqual(sorted(of_slot), list(range(page.treelets - 3, page.treelets)))
            for slot, place in of_slot.items():
                self.assertEqual(own_lo[slot].tobytes(), lo[place].tobytes())
                self.assertEqual(own_hi[slot].tobytes(), hi[place].tobytes())
                for child, slab in np.ndindex(len(kinds[slot]), page.layout.slabs):
                    byte = stored[(16 if profile == 1 else 0) * (child // 4) + 4 * slab + child % 4]
                    p, q = (Fraction(float(ends[slot, slab])) for ends in (own_lo, own_hi))
                    unit = up(nearest_f32(nearest_f32(q - p) * Fraction(float(cbvh.STEP_U8))))
                    expected = nearest_f32(p + codes[byte % 16] * unit), nearest_f32(q - codes[byte // 16] * unit)
                    found = lo[slot, child, slab], hi[slot, child, slab]
                    self.assertEqual(tuple(Fraction(float(end)) for end in found), expected)

    def test_kinds(self):
        def verdict(number, *row):
            kinds = list(self.NARROW)
            kinds[number] = row
            return Tree(0, kinds, 3).verdict()

        for kind in range(16):
            self.assertEqual(verdict(3, kind), 0 if 4 <= kind <= 7 else 21, kind)
            self.assertEqual(verdict(3, 4, kind, 7), 0 if 4 <= kind <= 7 else 21, kind)
            self.assertEqual(verdict(2, 4, kind, 7), {1: 22, 2: 0, 3: 22}.get(kind, 0 if 4 <= kind <= 7 else 21), kind)
        self.assertEqual(verdict(3), 21)
        self.assertEqual(verdict(2, 7, 7, 7, 7, 7), 21)
        self.assertEqual(Tree(0, ([3, 3], [7]), 1).verdict(), 22)
        self.assertEqual(Tree(0, ([3, 7], [7], [7]), 2).verdict(), 22)
        self.assertEqual(Tree(0, ([3, 1], [7], [7]), 1).verdict(), 0)
        for profile in range(6):  # a page without short treelets
            self.assertEqual(Tree(profile, ([3, 7],)).verdict(), 22, profile)

    def test_numbering(self):
        for rule, slot, field, value in (
            (22, 0, "treelet", 2),
            (22, 1, "treelet", 1),
            (22, 0, "short", 4),
            (22, 1, "short", 3),
            (22, 1, "short", 127),
            (23, 1, "remote", 1),
            (24, 0, "leaf", 1),
            (24, 3, "leaf", 2),
            (24, 5, "leaf", 1023),
            (0, 0, "remote", 9),  # it has no children of that sort
            (0, 2, "treelet", 0),
            (0, 2, "short", 127),
        ):
            tree = Tree(0, self.NARROW, 3, links={(slot, "first_" + field): value})
            self.assertEqual(tree.verdict(), rule, (slot, field, value))
        for rule, fields in (
            (24, {"packets": 12}),
            (23, {"remotes": 2}),
            (22, {"short": 2}),
            (22, {"short": 4}),
            (22, {"treelets": 5, "short": 2}),
            (21, {"treelets": 7, "short": 4}),  # the last one has no children
        ):
            self.assertEqual(Tree(0, self.NARROW, 3, **fields).verdict(), rule, fields)

    def test_order_of_links(self):
        """The links of a treelet come one sort after the other, and before the kinds of the next treelet."""
        for rule, kinds, links in (
            (22, self.NARROW, {(1, "first_remote"): 5, (1, "first_short"): 9}),
            (23, self.NARROW, {(1, "first_remote"): 5, (2, "first_leaf"): 9}),
            (24, self.NARROW, {(0, "first_leaf"): 5, (1, "first_treelet"): 9}),
            (24, ([3, 4], [1]), {(0, "first_leaf"): 1}),
            (21, ([3, 4], [1]), {}),
        ):
            self.assertEqual(Tree(0, kinds, 3 if kinds is self.NARROW else 1, links=links).verdict(), rule)

    def test_counts_of_short_treelets(self):
        for rule, fields in (
            (25, {"short": 6}),
            (25, {"short": 255}),
            (25, {"treelets": 3}),
            (25, {"roots": 4}),
            (25, {"roots": 0, "short": 7}),
            (25, {"short": 6, "treelet_line": 0}),
            (17, {"roots": 0}),
            (17, {"roots": 0, "short": 6}),
            (17, {"short": 0, "roots": 7}),
            (16, {"short": 6, "page_number": 1}),
        ):
            self.assertEqual(Tree(0, self.NARROW, 3, **fields).verdict(), rule, fields)
        for profile, layout in enumerate(cbvh.PROFILES):
            kinds = [1, 1], [7], [7]
            self.assertEqual(Tree(profile, kinds).verdict(), 0)
            tree = Tree(profile, kinds, short=3)
            self.assertEqual(tree.verdict(), 25)
            tree.data[62] ^= 1  # another profile
            self.assertEqual(tree.verdict(), 18)
            if not layout.short:
                self.assertEqual(Tree(profile, kinds, short=1).verdict(), 25)
                self.assertEqual(Tree(profile, kinds, short=1, roots=0, treelets=0).verdict(), 25)

    def test_what_fits_in_a_page(self):
        """The most treelets of a page, and the most roots, are as in section 17."""

        def widest(full, short, roots=1):
            """Treelets with as many children as possible: treelets that are not short, short ones, and packets."""
            children = [1] * (full - roots) + [3] * short
            children += [7] * (8 * full - len(children))
            kinds = [children[first : first + 8] for first in range(0, 8 * full, 8)] + [[7] * 8] * short
            return Tree(1, kinds, short, roots, number=1)

        for roots, packets in ((1, 771), (2, 772)):
            tree = widest(14, 96, roots)
            self.assertEqual(tree.verdict(), 0)
            self.assertEqual((tree.touch().treelets, tree.touch().packets), (110, packets))
        self.assertEqual(widest(14, 97).verdict(), 17)
        self.assertEqual(widest(15, 95).verdict(), 17)
        self.assertEqual(widest(14, 96, 3).verdict(), 17)
        self.assertEqual(Tree(1, [[7]] * 42, roots=42, number=1).verdict(), 0)
        self.assertEqual(Tree(1, [[7]] * 43, roots=43, number=1).verdict(), 17)

    def test_lines_before_treelets(self):
        """In dop6, two anchors share a line, and anchors and links do, too."""
        for profile, roots, remotes, line in (
            *((profile, *row) for profile in (1, 2) for row in ((1, 0, 2), (1, 8, 2), (1, 9, 3), (2, 0, 2), (2, 1, 3))),
            *((profile, *row) for profile in (0, 3) for row in ((1, 0, 2), (1, 1, 3), (2, 16, 4), (2, 17, 5))),
            *((profile, *row) for profile in (4, 5) for row in ((1, 0, 3), (1, 16, 4), (2, 17, 7))),
        ):
            for stated in range(line - 2, line + 3):
                fields = {"remotes": remotes, "treelet_line": stated}
                verdict = Tree(profile, [[7]] * roots, roots=roots, number=1, **fields).verdict()
                self.assertEqual(verdict == 17, stated != line, (profile, roots, remotes, stated))

    def test_what_binds_writers(self):
        def count(tree):
            return len(list(musts.of_page(tree.touch())))

        for profile, kinds in ((0, self.NARROW), (1, self.WIDE)):
            page = Tree(profile, kinds, 3).touch()
            at, end = (page.treelet_at(slot) - page.at for slot in (page.treelets - 2, page.treelets))
            self.assertEqual(count(Tree(profile, kinds, 3)), 0)
            # The short treelet in this slot has one child, with codes in every fourth byte.
            codes = [at + 4 * row for row in range(page.layout.slabs)]
            spare = range(16 if profile == 0 else 0, 22)  # bits beside those of kinds and of the link
            bits = [(at + 28 + bit // 8, bit % 8) for bit in spare]
            bits += [(byte, 4) for byte in {*range(at, at + 28), end} - {*range(at + 12, at + 16)}]
            for byte, bit in bits:
                tree = Tree(profile, kinds, 3)
                tree.data[byte] |= 1 << bit
                self.assertEqual(count(tree), byte not in codes, (byte - at, bit))
        for slot, field, value in ((0, "remote", 1), (2, "treelet", 0), (2, "short", 0)):
            self.assertEqual(count(Tree(0, self.NARROW, 3, links={(slot, "first_" + field): value})), 1)


class Block(cbvh.Page):
    """A page of which there is only a packed leaf block (11.2), with four triangles in each packet.

    Records are (pattern, rotations, slots), and the pool has the offsets of each vertex. `fields` are further fields of
    the head, or replace some. A block of points has no records and this many packets. `more` are bytes at the end, and bit 7 of the byte at `filled` is set.
    """

    def __init__(self, records, further, pool, index_bits, bits, more=b"", filled=None, points=0, **fields):
        arrays = [
            bit_array(
                field
                for pattern, rotations, slots in records
                for field in [(pattern, 6), *((turn, 2) for turn in rotations), *((slot, index_bits) for slot in slots)]
            ),
            bit_array((slot, index_bits) for slot in further),
            bit_array(field for vertex in pool for field in zip(vertex, bits)),
        ]
        head = np.zeros((), cbvh.PACKED_HEAD)
        fields = {
            **{"vertices": len(pool), "further": len(further), "index_bits": index_bits, "bits": bits},
            **{"further_at": 32 + len(arrays[0]), "pool_at": 32 + len(arrays[0]) + len(arrays[1])},
            **fields,
        }
        for field, value in fields.items():
            head[field] = value
        data = bytearray(head.tobytes() + b"".join(arrays) + bytes(8))
        data += bytes(-len(data) % 64) + more
        if filled is not None:
            data[filled] |= 0x80
        section = types.SimpleNamespace(offset=0, length=len(data))
        file = types.SimpleNamespace(sections={cbvh.LEAVES: section})
        self.owner = types.SimpleNamespace(file=file, triangle_encoding=1, origin=np.zeros(3), input_triangles=1)
        self.owner.corrected, self.owner.is_sum = 0, lambda: [True] * 3
        self.data, self.packets, self.number, self.id_words = bytes(data), points or len(records), 0, 0
        self.leaf_line, self.leaf_lines, self.leaf_checksum = 0, len(data) // 64, xxh3_64(bytes(data))

    def place(self, field):
        return 0

    def lanes_used(self):
        return np.ones((self.packets, 4), bool)

    def verdict(self):
        """The rule that the block breaks, or 0. Coordinates are read even if a rule about slots is broken."""

        def check():
            rules.check_leaf_block(self)
            self.offsets()
            rules.check_packets(self)

        return mutate.broken_by(check)


class LeafBlocks(unittest.TestCase):
    TURNS = 0, 1, 2, 0
    LAST = 0, TURNS, (5, 6, 7, 0, 0, 0)  # pattern 0 has 3 slots
    GOOD = {
        "records": [(63, TURNS, (0, 1, 2, 3, 4, 2)), LAST],  # pattern 63 has 12 slots, of which 7 are further slots
        "further": [12, 12, 5, 6, 7, 8, 9, 10, 11],
        "pool": [(v, 0, v % 2) for v in range(13)],
        "index_bits": 4,
        "bits": (7, 0, 2),
    }

    def test_reading_one_number_at_a_time(self):
        chance, seen = random.Random(5), set()
        patterns = " ".join(row[1] for row in table("patterns")).split()
        for _ in range(300):
            index_bits = chance.choice((0, 1, 4, 7, 16))
            vertices = chance.randint(1, min(40, 1 << index_bits))
            bits = [chance.choice((0, 1, 8, 17, 32)) for _ in range(3)]
            pool = [[chance.getrandbits(width) for width in bits] for _ in range(vertices)]
            further = [chance.randrange(vertices) for _ in range(chance.randrange(7, 20))]
            kinds = [chance.randrange(3) for _ in range(3)]
            bounds = {cbvh.ORDERED: (0, 0), cbvh.BINARY: (-128, 80), cbvh.DECIMAL: (0, 15)}
            exponents = [chance.randint(*bounds[kind]) for kind in kinds]
            base = [chance.choice((0, -3, chance.randrange(-(1 << 31), 1 << 31))) for _ in range(3)]
            records, corners = [], []
            for pattern in (chance.randrange(64) for _ in range(chance.randint(1, 9))):
                digits = [int(digit, 16) for digit in patterns[pattern]]
                count, turns = 1 + max(digits), [chance.randrange(3) for _ in range(4)]
                slots = [chance.randrange(vertices) for _ in range(min(count, 6))]
                held = slots + [0] * (6 - len(slots))
                if count > 6:
                    held[5] = chance.randint(0, min(len(further) - (count - 5), (1 << index_bits) - 1))
                    slots = slots[:5] + further[held[5] : held[5] + count - 5]
                records.append((pattern, turns, held))
                corners.append([[slots[digits[3 * i + (k + turns[i]) % 3]] for k in range(3)] for i in range(4)])
                seen.add(pattern)
            packed = sum(kind << 2 * axis for axis, kind in enumerate(kinds))
            page = Block(records, further, pool, index_bits, bits, base=base, kinds=packed, exponent=exponents)
            self.assertIn(page.verdict(), (0, 30))  # an ordered coordinate may be infinite or NaN
            self.assertEqual(page.packed_corners(page.packed_head()).tolist(), corners)
            found = page.packed_pool(page.packed_head())
            for offsets, vertex in zip(pool, found):
                for axis in range(3):
                    n = (base[axis] + offsets[axis] + (1 << 31)) % (1 << 32) - (1 << 31)
                    if kinds[axis] == cbvh.ORDERED:
                        expected = (n if n >= 0 else n ^ 0x7FFFFFFF) % (1 << 32)
                        self.assertEqual(int(vertex[axis].view(np.uint32)), expected)
                    else:
                        power = (Fraction(2) if kinds[axis] == cbvh.BINARY else Fraction(1, 10)) ** exponents[axis]
                        in_f64 = Fraction(float(n * power))
                        self.assertEqual(Fraction(float(vertex[axis])), nearest_f32(in_f64), (n, exponents[axis]))
            self.assertTrue((page.offsets().view(np.uint32) == found[np.array(corners)].view(np.uint32)).all())
        self.assertEqual(len(seen), 64)

    def test_rules(self):
        def axes(kinds, *exponents):
            return {"kinds": kinds, "exponent": exponents, "base": (1, 1, 1)}

        def record(pattern, *slots, turns=self.TURNS, **fields):
            return {"records": [(pattern, turns, slots), self.LAST], **fields}

        for rule, fields in (
            (0, {}),
            (0, axes(0b100100, 0, -128, 15)),
            (0, axes(0b000110, 0, 100, 0)),
            (30, axes(0b010101, 0, 127, 0)),
            (28, axes(0b100001, 0, 1, 0)),  # of an ordered axis
            (28, axes(0b000110, -1, 0, 0)),  # of a decimal one
            (28, axes(0b100001, 0, 0, 16)),
            (28, axes(0b001100, 0, 0, 0)),
            (28, axes(1 << 7, 0, 0, 0)),
            (28, {"vertices": 0}),
            (28, {"index_bits": 17}),
            (28, {"bits": (7, 0, 33)}),
            (28, {"further_at": 41}),
            (28, {"pool_at": 1 << 31}),
            (26, {"more": bytes(64)}),
            (29, record(63, 0, 1, 2, 3, 4, 2, turns=(0, 3, 0, 0))),
            (29, record(63, 0, 1, 2, 3, 4, 3)),
            (29, record(63, 0, 1, 2, 3, 4, 15)),
            (29, record(63, 0, 1, 2, 3, 13, 2)),
            (29, {"further": [12] * 8 + [13]}),
            (0, {"further": [13] + [12] * 8}),  # no packet has the slot
            (0, record(40, 0, 1, 2, 3, 4, 0, further=[12, 12])),  # 7 slots
            (29, record(40, 0, 1, 2, 3, 4, 0, further=[12])),
            (29, record(40, 0, 1, 2, 3, 4, 0, further=[])),
            (0, record(22, 0, 1, 2, 3, 4, 12, further=[])),  # 6 slots
            (29, record(22, 0, 1, 2, 3, 4, 13, further=[])),
            (0, record(20, 0, 1, 2, 3, 4, 13, further=[])),  # 5 slots
        ):
            self.assertEqual(Block(**self.GOOD | fields).verdict(), rule, fields)

    def test_points(self):
        good = {"records": [], "further": [], "pool": [(v, 0, v % 3) for v in range(8)], "index_bits": 0, "bits": (7, 0, 2)}
        good |= {"points": 2, "kinds": 1 << 6}
        page = Block(**good)
        self.assertEqual(page.verdict(), 0)
        places = np.arange(8).reshape(2, 4)
        self.assertEqual(page.packed_corners(page.packed_head()).tolist(), np.stack([places] * 3, axis=2).tolist())
        self.assertEqual(len(list(musts.of_leaf_block(page, 0))), 0)
        for fields in ({"points": 1}, {"points": 3}, {"vertices": 7}, {"index_bits": 1}, {"further": [0]}, {"pool_at": 33}):
            self.assertEqual(Block(**good | fields).verdict(), 28, fields)
        self.assertEqual(Block(**good | {"kinds": 3 << 6}).verdict(), 28)
        # Points that are not written as such
        records = [(63, (0,) * 4, (0,) * 5 + (7 * number,)) for number in range(2)]
        page = Block(records, [0] * 14, [(1, 0, 1)], 4, (7, 0, 2))
        self.assertEqual(page.verdict(), 0)
        self.assertEqual(len(list(musts.of_leaf_block(page, 0))), 1)

    def test_what_binds_writers(self):
        def count(**fields):
            page = Block(**self.GOOD | fields)
            self.assertEqual(page.verdict(), 0)
            return len(list(musts.of_leaf_block(page, 0)))

        self.assertEqual(count(), 0)
        self.assertEqual(count(records=[self.LAST, (0, self.TURNS, (5, 6, 7, 0, 0, 1))]), 1)
        self.assertEqual(count(records=[(0, self.TURNS, (5, 6, 7, 1, 0, 0)), self.LAST]), 1)
        page = Block(**self.GOOD)
        for end in (*page.packed_places(page.packed_head())[1:], len(page.data)):
            self.assertEqual(count(filled=end - 1), 1, end)
        for n, found in ((1 << 24, 0), ((1 << 24) + 1, 1), ((1 << 24) + 2, 0)):
            pool = {"pool": [(0, 0, v % 2) for v in range(13)], "base": (n, 0, 0)}
            self.assertEqual(count(**pool, kinds=1, exponent=(3, 0, 0)), found, n)
            self.assertEqual(count(**pool, kinds=2, exponent=(3, 0, 0)), 0, n)


class Corrected(Block):
    """A leaf block of two packets with corrections of axes x and z, of which the first has a list. Values are random.
    `gap` are bytes before the corrections, and `end` bytes behind them; `head` replaces fields of the head.
    """

    def __init__(self, encoding=1, counts=(3, 0, 13), listed=(1, 4, 12), bits=(5, 0, 64), gap=b"", end=b"", **head):
        super().__init__(**LeafBlocks.GOOD)
        packets = self.data if encoding else np.zeros(72, "<f4").tobytes()
        packets += bytes(-len(packets) % 64)
        first = np.zeros((), cbvh.CORRECTIONS)
        fields = {"counts": counts, "bits": bits, "base": (-3, 0, 1 << 62), **head}
        for field, value in fields.items():
            first[field] = value
        chance = random.Random(8)
        self.values = [[chance.getrandbits(width) for _ in range(count)] for count, width in zip(counts, bits)]
        arrays = [bit_array((value, width) for value in part) for part, width in zip(self.values, bits)]
        data = packets + gap + first.tobytes() + np.array(listed, "<u2").tobytes() + b"".join(arrays) + bytes(8)
        data += bytes(-len(data) % 64) + end
        self.listed, self.data = listed, bytes(data)
        self.owner.file.sections[cbvh.LEAVES].length = len(data)
        self.leaf_lines, self.leaf_checksum = len(data) // 64, xxh3_64(data)
        self.owner.triangle_encoding, self.owner.corrected = encoding, 5
        self.owner.is_sum = lambda: [False, True, False]
        self.owner.predictors, self.owner.digits, self.owner.scale = np.zeros(3, int), np.zeros(3, int), 0.0
        self.owner.left_out = np.full(3, np.inf, np.float32)

    def verdict(self):
        def check():
            rules.check_leaf_block(self)
            rules.check_lists(self)

        return mutate.broken_by(check)


class Corrections(unittest.TestCase):
    PLAIN = {"encoding": 0, "counts": (3, 0, 24), "listed": (0, 5, 23)}

    def test_values(self):
        for page in (Corrected(), Corrected(**self.PLAIN)):
            self.assertEqual(page.verdict(), 0)
            corners = np.zeros((page.corner_count(), 3), object)
            for corner, value in zip(page.listed, page.values[0]):
                corners[corner, 0] = value - 3
            for corner, value in enumerate(page.values[2]):
                corners[corner, 2] = (value + (1 << 62) + (1 << 63)) % (1 << 64) - (1 << 63)
            found = page.corrections()
            if page.is_packed():
                places = page.packed_corners(page.packed_head())
            else:
                packet, lane, corner = np.indices((2, 4, 3))
                places = 12 * packet + 4 * corner + lane
            self.assertEqual(found.tolist(), corners[places].tolist())
            self.assertEqual(page.vertices().shape, (2, 4, 3, 3))
            self.assertEqual(list(musts.of_corrections(page)), [])

    def test_rules(self):
        for rule, fields in (
            (0, {"listed": (0, 1, 2)}),
            (0, {"counts": (0, 0, 0), "listed": (), "bits": (0, 0, 0)}),
            (0, {"counts": (0, 0, 0), "listed": (), "bits": (64, 64, 64)}),
            (0, {"counts": (13, 0, 0), "listed": ()}),
            (0, {"counts": (1, 0, 12), "listed": (12, *range(12))}),
            (52, {"listed": (1, 1, 2)}),
            (52, {"listed": (2, 1, 3)}),
            (52, {"listed": (1, 2, 13)}),
            (52, {"counts": (0, 1, 0), "listed": (1,)}),
            (52, {"counts": (14, 0, 0), "listed": range(14)}),
            (52, {"bits": (65, 0, 1)}),
            (52, {"bits": (1, 255, 1)}),
            (26, {"end": bytes(64)}),
            (26, {"end": bytes(1 << 20)}),
            (52, {"gap": b"\xff" * 64}),
        ):
            self.assertEqual(Corrected(**fields).verdict(), rule, fields)
        for rule, fields in (
            (0, {"listed": (0, 1, 23)}),
            (52, {"listed": (1, 1, 2)}),
            (52, {"listed": (1, 2, 24)}),
            (52, {"counts": (25, 0, 0), "listed": range(25)}),
            (52, {"bits": (65, 0, 1)}),
            (26, {"end": bytes(64)}),
        ):
            self.assertEqual(Corrected(**self.PLAIN | fields).verdict(), rule, fields)

    def test_what_is_cut(self):
        """A block that ends before the head of its corrections, or behind it."""
        page = Corrected()
        for lines in range(page.leaf_lines):
            page.leaf_lines, page.leaf_checksum = lines, xxh3_64(page.data[: 64 * lines])
            self.assertEqual(page.verdict(), 26 if lines else 28)

    def test_what_binds_writers(self):
        def count(**fields):
            page = Corrected(**fields)
            self.assertEqual(page.verdict(), 0)
            return len(list(musts.of_corrections(page)))

        self.assertEqual(count(reserved=1), 1)
        self.assertEqual(count(base=(0, 1, 0)), 1)
        self.assertEqual(count(bits=(5, 1, 64)), 1)
        page = Corrected()
        page.data = page.data[:-1] + b"\x80"
        self.assertEqual(len(list(musts.of_corrections(page))), 1)


class IdBlock(cbvh.Page):
    """A page of which there is only an id block (12), between bytes 0xff.

    Groups are (base, v, packets), and packets (triangles, w, m, lane, three offsets). `absent` is the w of packets that
    the last group does not have. `moved` are numbers to add to the starts of groups, `more` are bytes to add at the
    end, or -8, and `filled` is a group and a bit to set, counted from the end of that group.
    """

    def __init__(self, groups, absent=0, moved=(), more=0, filled=None):
        self.packets = sum(len(packets) for _, _, packets in groups)
        self.triangles_of = [packet[0] for _, _, packets in groups for packet in packets]
        data, table, start, self.ends = b"", b"", 6 * len(groups), []
        for number, (base, v, packets) in enumerate(groups):
            here = [(v, 6), *((w, 6) for _, w, *_ in packets), *[(absent, 6)] * (8 - len(packets))]
            for _, w, m, lane, offsets in packets:
                here += [(m, v), (lane, 2), *((value, w) for value in offsets)]
            stated = start + dict(enumerate(moved)).get(number, 0)
            table += base.to_bytes(4, "little") + stated.to_bytes(2, "little")
            self.ends.append(8 * start + sum(size for _, size in here))
            data += bit_array(here)
            start += len(bit_array(here))
        block = int.from_bytes(table + data, "little")
        if filled is not None:
            block |= 1 << self.ends[filled[0]] + filled[1]
        size = cbvh.WORD * cbvh.ceil_div(start + 8, cbvh.WORD)
        block = (block.to_bytes(size, "little") + b"\xff" * 8)[: size + more]
        data = b"\xff" * 80 + block + b"\xff" * 8
        section = types.SimpleNamespace(offset=72, length=len(data) - 72)
        self.owner = types.SimpleNamespace(file=types.SimpleNamespace(sections={cbvh.IDS: section}))
        self.data, self.number, self.id_word, self.id_words = data, 0, 1, len(block) // 8
        self.id_checksum = xxh3_64(block)

    def place(self, field):
        return 0

    def lanes_used(self):
        return np.arange(4) < np.array(self.triangles_of)[:, None]

    def verdict(self):
        return mutate.broken_by(rules.check_id_block, self)


class IdBlocks(unittest.TestCase):
    FULL = 7, 3, [(4, 4, p % 8, p % 4, (p, 1, 15)) for p in range(8)]
    LAST = 90, 0, [(2, 5, 0, 1, (31, 0, 0)), (1, 0, 0, 0, (0, 0, 0))]

    def test_reading_one_number_at_a_time(self):
        chance, seen = random.Random(6), set()
        for _ in range(200):
            groups, expected = [], []
            sizes = [8] * chance.choice((0, 0, 1, 3, 20)) + [chance.randint(1, 8)]
            for size in sizes:
                base, width, packets = chance.choice((0, 9, chance.getrandbits(32))), chance.randint(0, 32), []
                for _ in range(size):
                    w, lane, least = chance.randrange(33), chance.randrange(4), chance.getrandbits(width)
                    offsets = [chance.getrandbits(w) for _ in range(3)]
                    packets.append((4, w, least, lane, offsets))
                    ids = [base + least + offset for offset in offsets]
                    ids.insert(lane, base + least)
                    expected.append([number % (1 << 32) for number in ids])
                    seen.add(w)
                groups.append((base, width, packets))
            page = IdBlock(groups, absent=chance.randrange(33))
            self.assertEqual(page.verdict(), 0)
            self.assertEqual(page.ids().dtype, np.uint32)
            self.assertEqual(page.ids().tolist(), expected)
        self.assertEqual(len(seen), 33)

    def test_rules(self):
        two = [self.FULL, self.LAST]
        for rule, groups, fields in (
            (0, two, {}),
            (0, [(0, 32, [(4, 32, 5, 3, (0, 1, 2))])], {}),
            (31, [(0, 33, [(4, 32, 5, 3, (0, 1, 2))])], {}),
            (31, [(0, 32, [(4, 33, 5, 3, (0, 1, 2))])], {}),
            (31, [(0, 32, [*self.FULL[2][:7], (4, 63, 5, 3, (0, 1, 2))])], {}),
            (31, [(0, 63, self.FULL[2])] * 9, {}),
            (0, two, {"absent": 32}),
            (31, two, {"absent": 33}),
            (31, two, {"moved": (1,)}),
            (31, two, {"moved": (0, -1)}),
            (31, two, {"moved": (-12, 0)}),
            (31, two, {"moved": (0, 60000)}),
            (31, two, {"moved": (0, 8)}),
            (31, two, {"moved": (7 * 12, 7 * 36)}),  # in bits
            (31, two, {"more": 8}),
            (31, two, {"more": -8}),
            (31, two, {"more": -1000}),  # no bytes
            (0, two, {"filled": (0, 0)}),
            (0, two, {"filled": (1, 0)}),
        ):
            page = IdBlock(groups, **fields)
            self.assertEqual(page.verdict(), rule, (groups, fields))
        page = IdBlock(two)
        for id_word, id_words in ((1, 0), (1, 1), (1, 1 << 31), (1 << 63, page.id_words), (2, page.id_words + 1)):
            page.id_word, page.id_words = id_word, id_words
            self.assertEqual(page.verdict(), 31)
        page = IdBlock(two)
        page.id_checksum ^= 1
        self.assertEqual(page.verdict(), 32)

    def test_what_binds_writers(self):
        def count(last, **fields):
            page = IdBlock([self.FULL, (90, 3, last)], **fields)
            self.assertEqual(page.verdict(), 0)
            return len(list(musts.of_id_block(page, 1)))

        good = (2, 5, 7, 1, (31, 0, 0))
        self.assertEqual(count([good]), 0)
        self.assertEqual(count([good], absent=1), 1)
        first, last = IdBlock([self.FULL, (90, 3, [good])]).ends
        self.assertEqual((-first % 8, -last % 8), (2, 6))
        for filled in ((0, 0), (0, 1), (1, 0), (1, 5), (1, 6), (1, 85)):
            self.assertEqual(count([good], filled=filled), 1, filled)
        self.assertEqual(count([good, (2, 5, 7, 0, (1, 1, 0))]), 1)  # an offset of lane 2
        self.assertEqual(count([good, (2, 5, 7, 0, (1, 0, 1))]), 1)
        self.assertEqual(count([(2, 5, 7, 2, (0, 3, 0))]), 1)  # lane 2 has no triangle
        self.assertEqual(count([(2, 32, 7, 1, ((1 << 32) - 1, 0, 0))]), 1)  # an id less than the least
        self.assertEqual(count([(2, 32, 7, 1, ((1 << 32) - 97, 0, 0))]), 1)  # id 0
        page = IdBlock([self.FULL])
        self.assertEqual(len(list(musts.of_id_block(page, 0))), 1)


class Head(unittest.TestCase):
    """Where the head and the sections may be (R03 to R07)."""

    UNKNOWN = 99

    def setUp(self):
        ((_, self.plain),) = golden("ok-plain.cbvh")
        self.file = rules.open_file(self.plain)
        self.sections = sections_of(self.file)

    def placed(self, *sections, length=None):
        """A file of sections that are given by kind, `required`, offset and length, and hold zeros."""
        header = np.zeros((), cbvh.HEADER)
        head = cbvh.head_bytes(len(sections))
        header["magic"] = np.frombuffer(cbvh.MAGIC, "u1")
        header["major"], header["minor"] = cbvh.MAJOR, cbvh.MINOR
        header["sections"], header["file_length"] = len(sections), head if length is None else length
        table = np.array([(*section, 0) for section in sections], cbvh.SECTION_ENTRY).tobytes()
        data = bytearray((header.tobytes() + table).ljust(int(header["file_length"]), b"\0"))
        mutate.seal(data)
        return data

    def test_files_are_made_as_writers_make_them(self):
        for name, data in golden("ok-*.cbvh"):
            file = rules.open_file(data)
            if file.header.minor == cbvh.MINOR:
                self.assertEqual(file_of(sections_of(file)), data)
            else:
                self.assertEqual(name, "ok-later.cbvh")

    def test_short_files(self):
        """The magic comes first, then the length of the header, and the version before that of the table."""
        for length in range(8):
            self.assertEqual(mutate.verdict(self.plain[:length]), 1)
        for length in (8, 10, 63):
            self.assertEqual(mutate.verdict(self.plain[:length]), 3)
        head = self.file.head_bytes()
        for length in (64, 65, head - 1):
            self.assertEqual(mutate.verdict(self.plain[:length]), 6)
        for length in (head, head + 1, len(self.plain) - 1):
            self.assertEqual(mutate.verdict(self.plain[:length]), 5)
        self.assertEqual(mutate.verdict(self.plain + b"\0"), 5)
        older = bytearray(self.plain)
        older[8] = 4
        for length, rule in ((63, 3), (64, 2), (head, 2), (len(older), 2)):
            self.assertEqual(mutate.verdict(older[:length]), rule)

    def test_numbers_of_sections(self):
        """Before the checksum, since it depends on the number."""
        data = bytearray(self.plain)
        for count, rule in ((2, 4), (4, 4), (64, 4), (65, 6), (1 << 31, 6), ((1 << 32) - 1, 6)):
            data[12:16] = count.to_bytes(4, "little")
            self.assertEqual(mutate.verdict(data), rule, count)
        empty = [(self.UNKNOWN, 0, b"")] * 62
        self.assertEqual(mutate.verdict(file_of(self.sections + empty[:61])), 0)
        self.assertEqual(mutate.verdict(file_of(self.sections + empty)), 6)
        self.assertEqual(mutate.verdict(file_of([])), 9)

    def test_what_the_checksum_covers(self):
        head = self.file.head_bytes()
        for at in range(head):
            data = bytearray(self.plain)
            data[at] ^= 1
            early = dict.fromkeys(range(8), 1) | dict.fromkeys((8, 9), 2) | dict.fromkeys((13, 14, 15), 6)
            self.assertEqual(mutate.verdict(data), early.get(at, 4), at)
        data[head - 1] ^= 1
        for at in range(head, self.file.entries[0].offset):
            data[at] ^= 1
            self.assertEqual(mutate.verdict(data), 0)
            self.assertEqual(len(list(musts.violations(rules.validate(bytes(data))))), 1)

    def test_alignment(self):
        for kind, unit in ((cbvh.NODES, 4096), *((kind, 64) for kind in (cbvh.OBJECTS, cbvh.LEAVES, self.UNKNOWN))):
            for offset in (96, 100, 127, 128, 160, 192, 4032, 4096, 4128, 4160, 6144, 8192):
                rule = 7 if offset % unit else 9  # needed sections are missing
                data = self.placed((kind, 0, offset, 0), length=8192)
                self.assertEqual(mutate.verdict(data), rule, (kind, offset))

    def test_sections_and_the_head(self):
        """A section may start where the head ends, and no earlier, even if it is empty."""
        self.assertEqual(mutate.verdict(self.placed((1, 1, 64, 0), length=256)), 7)
        self.assertEqual(mutate.verdict(self.placed((1, 1, 0, 0), length=256)), 7)
        self.assertEqual(mutate.verdict(self.placed((2, 1, 0, 0), length=256)), 7)
        two = [(1, 1, 128, 0), (3, 1, 128, 0)]
        self.assertEqual(mutate.verdict(self.placed(*two)), 9)
        self.assertEqual(mutate.verdict(self.placed((1, 1, 128, 0), (3, 1, 64, 0))), 7)
        self.assertEqual(mutate.verdict(self.placed(*two, (4, 0, 192, 0), length=192)), 7)  # of 160 bytes
        two = [(1, 1, 128, 65), (3, 1, 192, 0)]
        self.assertEqual(mutate.verdict(self.placed(*two, length=256)), 7)  # overlap
        two[0] = (1, 1, 128, 64)
        self.assertEqual(mutate.verdict(self.placed(*two, length=256)), 9)
        self.assertEqual(mutate.verdict(self.placed(*two, length=192)), 9)
        two[1] = (3, 1, 192, 1)
        self.assertEqual(mutate.verdict(self.placed(*two, length=193)), 9)
        self.assertEqual(mutate.verdict(self.placed(*two, length=192)), 7)
        for length in (1 << 63, (1 << 64) - 128, (1 << 64) - 1):  # ends beyond 64 bits
            self.assertEqual(mutate.verdict(self.placed((1, 1, 128, length), length=192)), 7)
            self.assertEqual(mutate.verdict(self.placed((1, 1, length & -64, 192), length=192)), 7)

    def test_ends(self):
        """A file may end anywhere behind the last section. Writers end it at the next line, and leave no gaps."""

        def violations(data):
            return len(list(musts.violations(rules.validate(bytes(data)))))

        def with_length(data, length):
            data = bytearray(data[:length].ljust(length, b"\0"))
            data[16:24] = length.to_bytes(8, "little")
            mutate.seal(data)
            return data

        data = file_of([*self.sections, (cbvh.PROVENANCE, 0, b"a=b\n")])
        used = len(data) - 60
        self.assertEqual(violations(data), 0)
        for length in (used, used + 1, len(data) + 1, len(data) + 64, len(data) + 4096):
            self.assertEqual(violations(with_length(data, length)), 1, length)
        self.assertEqual(mutate.verdict(with_length(data, used - 1)), 7)
        changed = bytearray(data)
        changed[-1] = 1
        self.assertEqual(violations(changed), 1)
        moved = bytearray(with_length(data, len(data) + 64))
        entry = rules.open_file(data).entries[-1]
        moved[entry.offset : entry.offset + 128] = bytes(64) + data[entry.offset :]
        moved[entry.place("offset") : entry.place("length")] = (entry.offset + 64).to_bytes(8, "little")
        mutate.seal(moved)
        self.assertEqual(violations(moved), 1)

    def test_order_of_rules(self):
        two = [(self.UNKNOWN, 1, 128, 0), (1, 1, 100, 0)]
        self.assertEqual(mutate.verdict(self.placed(*two)), 8)
        self.assertEqual(mutate.verdict(self.placed(*reversed(two))), 7)
        data = self.placed(*two)
        data += b"\0"
        self.assertEqual(mutate.verdict(data), 5)
        data[33] ^= 1
        self.assertEqual(mutate.verdict(data), 4)
        data[12] = 4
        self.assertEqual(mutate.verdict(data), 6)
        data[8] = 4
        self.assertEqual(mutate.verdict(data), 2)
        self.assertEqual(mutate.verdict(data[:63]), 3)
        data[0] = 0
        self.assertEqual(mutate.verdict(data[:63]), 1)


class Instances(unittest.TestCase):
    def setUp(self):
        ((_, self.everything),) = golden("ok-everything.cbvh")
        ((_, self.profiles),) = golden("ok-profiles.cbvh")

    def verdict(self, *changes, data=None, **head):
        """The rule that a file breaks to which these instances are added, or 0."""
        return mutate.verdict(with_section(data or self.everything, instances(*changes, **head)))

    def assert_rotations(self, rule, *rotations):
        for rotation in rotations:
            self.assertEqual(self.verdict({"rotation": rotation}), rule, rotation)

    def test_what_is_in_a_scene(self):
        turn, names = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], ["Tür", "", "x", "", "tür", "x "]
        changes = [{"text": name.encode()} for name in names]
        changes[1] |= {"object": 5, "member": 1, "meets": 1 << 31, "rotation": turn, "translation": [1.5, -2, 3]}
        changes[2] |= {"object": 5, "member": 0, "meets": 0}
        file = rules.validate(with_section(self.profiles, instances(*changes)))
        rules.verify(file)
        self.assertEqual(list(musts.violations(file)), [])
        self.assertEqual([one.name for one in file.instances], names)
        self.assertEqual([one.number for one in file.instances], list(range(6)))
        self.assertEqual([one.object for one in file.instances], [0, 5, 5, 0, 0, 0])
        first, second = file.instances[:2]
        self.assertEqual((first.member, first.meets), (0xFFFFFFFF, 0xFFFFFFFF))
        self.assertEqual((first.rows(), first.translation.tolist()), (np.eye(3).tolist(), [0, 0, 0]))
        self.assertEqual((second.member, second.meets), (1, 1 << 31))
        self.assertEqual((second.rows(), second.translation.tolist()), (turn, [1.5, -2, 3]))
        self.assertEqual(rules.validate(self.profiles).instances, [])

    def test_checksums(self):
        """The section is content. R10 comes before the rules of the section, and also holds for its bytes."""
        scene = with_section(self.everything, instances({}))
        file = rules.validate(scene)
        moved = rules.validate(with_section(self.everything, instances({"translation": [0, 0, 1]})))
        contents = {one.header.content_checksum for one in (file, moved, rules.validate(self.everything))}
        self.assertEqual(len(contents), 3)
        at = file.sections[cbvh.INSTANCES].offset
        damaged = bytearray(scene)
        damaged[at] = 0
        self.assertEqual(mutate.verdict(damaged), 10)
        mutate.seal(damaged)
        self.assertEqual(mutate.verdict(damaged), 40)

    def test_lengths(self):
        two = {"text": b"ab"}, {"text": b"c"}
        self.assertEqual(self.verdict(*two), 0)
        self.assertEqual(self.verdict(), 40)
        self.assertEqual(self.verdict(count=1), 40)
        self.assertEqual(self.verdict({}, count=0), 40)
        self.assertEqual(self.verdict({}, count=0, names=bytes(128)), 40)
        for count in (1, 3, 1 << 25, (1 << 32) - 1):
            self.assertEqual(self.verdict(*two, count=count), 40, count)
        for names_length in (0, 2, 4, (1 << 32) - 1):
            self.assertEqual(self.verdict(*two, names_length=names_length), 40, names_length)
        self.assertEqual(self.verdict(*two, names_length=3 + 128, count=1), 0)  # the second record counts as names
        section = instances({})
        for length in (0, 1, 15, 16, len(section) - 1):
            self.assertEqual(mutate.verdict(with_section(self.everything, section[:length])), 40, length)
        self.assertEqual(mutate.verdict(with_section(self.everything, section + b"\0")), 40)

    def test_names(self):
        def verdict(names, *spans):
            changes = [{"name_offset": first, "name_length": length} for first, length in spans]
            return self.verdict(*changes, names=names)

        for rule, names, *spans in (
            (0, b"abcd", (0, 4)),
            (0, b"abcd", (4, 0)),
            (40, b"abcd", (5, 0)),
            (40, b"abcd", (0, 5)),
            (40, b"abcd", (3, 2)),
            (40, b"abcd", ((1 << 32) - 1, 1)),
            (40, b"abcd", (1, (1 << 32) - 1)),
            (40, b"", (0, 1)),
            (0, "ü€".encode(), (0, 2), (2, 3)),
            (40, "ü€".encode(), (0, 1), (2, 3)),  # ends within a character
            (40, "ü€".encode(), (0, 2), (3, 2)),  # starts within one
            (40, b"a\xff", (0, 2)),
            (40, b"\xc0\x80", (0, 2)),  # longer than needed
            (40, b"\xed\xa0\x80", (0, 3)),  # half of a pair of UTF-16
            (0, b"a\xff", (0, 1)),  # no name has that byte
            (0, b"a\0b", (0, 3)),
            (0, b"abcd", (0, 2), (1, 2)),  # overlap, and are short enough
            (0, b"abcd", (2, 2), (0, 2)),
            (40, b"abcd", (0, 3), (1, 2)),
            (40, b"abcd", (0, 4), (4, 0), (3, 1)),
        ):
            self.assertEqual(verdict(names, *spans), rule, (names, spans))

    def test_same_names(self):
        for rule, *texts in (
            (0, b"", b"", b""),
            (0, b"a", b"", b"A", b"", b"aa", b"a ", b"a\0"),
            (0, "é".encode(), "e\u0301".encode()),  # they look the same, and are different bytes
            (43, b"a", b"a"),
            (43, b"", b"a", b"", b"b", b"a"),
            (43, "é".encode(), "é".encode()),
        ):
            self.assertEqual(self.verdict(*({"text": text} for text in texts)), rule, texts)
        twice = {"name_offset": 1, "name_length": 1}
        self.assertEqual(self.verdict(twice, twice, names=b"abc"), 43)
        self.assertEqual(self.verdict({}, {"object": 0, "translation": [0, 0, 0]}), 0)  # the same in all but number

    def test_objects(self):
        for data, count in ((self.everything, 1), (self.profiles, 6)):
            self.assertEqual(self.verdict({"object": count - 1}, data=data), 0)
            for number in (count, (1 << 32) - 1):
                self.assertEqual(self.verdict({"object": number}, data=data), 41, number)
                self.assertEqual(self.verdict({}, {}, {"object": number}, data=data), 41, number)

    def test_translations(self):
        for axis in range(3):
            for value, rule in (
                (2.0**118, 0),
                (-(2.0**118), 0),
                (-0.0, 0),
                (2.0**-1074, 0),
                (after(2.0**118), 42),
                (-after(2.0**118), 42),
                (np.inf, 42),
                (-np.inf, 42),
                (np.nan, 42),
            ):
                translation = np.zeros(3)
                translation[axis] = value
                self.assertEqual(self.verdict({"translation": translation}), rule, translation)
        self.assertEqual(self.verdict({"translation": [2.0**118, -(2.0**118), 2.0**118]}), 0)

    def test_margins(self):
        for margin, rule in ((2.0**118, 0), (5e-324, 0), (after(2.0**118), 50), (-5e-324, 50), (np.nan, 50), (np.inf, 50)):
            self.assertEqual(self.verdict({"margin": margin}), rule, margin)
        # R50 comes before the pose, and what is solid must be closed.
        for solid, rule in ((0, 0), (1, 51), (2, 50), ((1 << 32) - 1, 50)):
            self.assertEqual(self.verdict({}, {"solid": solid}), rule, solid)
        self.assertEqual(self.verdict({"margin": -1.0, "rotation": np.zeros(9)}), 50)

    def test_rotations(self):
        for place in range(9):
            for value in (np.nan, np.inf, -np.inf, 1e200, -1e200, 0.5):
                rotation = np.eye(3)
                rotation.flat[place] = value
                self.assert_rotations(42, rotation)
        self.assert_rotations(42, np.zeros((3, 3)), 2 * np.eye(3), 0.5 * np.eye(3), np.full((3, 3), 1e200))
        angle = 0.3
        sin, cos = np.sin(angle), np.cos(angle)
        rounded = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]).astype(np.float32).astype(np.float64)
        self.assert_rotations(0, [[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]], rounded)

    def test_reflections(self):
        for order, signs in itertools.product(itertools.permutations(range(3)), itertools.product((1, -1), repeat=3)):
            rotation = np.eye(3)[list(order)] * signs
            self.assert_rotations(0 if np.linalg.det(rotation) > 0 else 42, rotation)

    def test_rotations_at_the_limit(self):
        limit = 2.0**-23
        for row, column in itertools.permutations(range(3), 2):
            for sign in (1, -1):
                rotation = np.eye(3)
                rotation[row, column] = sign * limit
                self.assert_rotations(0, rotation)
                rotation[row, column] = sign * after(limit)
                self.assert_rotations(42, rotation)
        # Squares of these, rounded, are 1 + 2^-23 and 1 - 2^-23; those of their neighbours are beyond.
        most, least = 1 + 2.0**-24 - 2.0**-49, 1 - 2.0**-24 - 2.0**-49
        self.assertEqual((most * most, least * least), (1 + limit, 1 - limit))
        for row in range(3):
            for scale, rule in ((most, 0), (after(most), 42), (least, 0), (after(least, 0), 42)):
                rotation = np.eye(3)
                rotation[row, row] = scale
                self.assert_rotations(rule, rotation)

    def test_rotations_that_depend_on_rounding(self):
        """The sum is beyond the limit, but two squares below 2^-53 are lost one by one after 1, and not before it."""
        large, small = 1 + 2.0**-24 - 2.0**-49, 1e-8
        for row, rule in (([large, small, small], 0), ([small, large, small], 0), ([small, small, large], 42)):
            self.assertGreater(sum(Fraction(value) ** 2 for value in row), 1 + Fraction(1, 1 << 23))
            rotation = np.eye(3)
            rotation[row.index(large)] = row
            self.assert_rotations(rule, rotation)

    def test_order_of_rules(self):
        name, one = {"name_length": 9}, {"object": 1}
        pose, same = {"translation": [np.nan] * 3}, {"name_offset": 0, "name_length": 1}
        for rule, *changes in (
            (40, {}, name | one | pose),
            (41, same, same | one | pose),
            (42, same, same | pose),
            (43, same, same, one),
            (42, pose, one, name),
            (41, one, name),
        ):
            self.assertEqual(self.verdict(*changes, names=b"abc"), rule, changes)
        # R36 comes before the scene, and the pages of objects after it.
        file = rules.validate(self.everything)
        for kind, offset, alone, with_scene in ((cbvh.DUPLICATES, 3, 36, 36), (cbvh.NODES, 44, 16, 41)):
            data = bytearray(self.everything)
            data[file.sections[kind].offset + offset] = 0xFF
            mutate.seal(data)
            self.assertEqual(mutate.verdict(data), alone)
            self.assertEqual(self.verdict(one, data=bytes(data)), with_scene)

    def test_opening(self):
        """A file with a broken scene can be opened, and the section is known: `required` and R09 are as for others."""
        broken = instances({"object": 1})
        self.assertEqual(rules.open_file(with_section(self.everything, broken)).instances, [])
        scene = with_section(self.everything, instances({}), required=1)
        self.assertEqual(len(rules.validate(scene).instances), 1)
        self.assertEqual(mutate.verdict(with_section(scene, instances({}))), 9)

    def test_what_binds_writers(self):
        good = {"text": b"ab"}, {"text": b"c"}

        def count(*changes, required=0, before=0, **head):
            file = rules.validate(with_section(self.everything, instances(*changes, **head), required, before))
            return len(list(musts.violations(file)))

        self.assertEqual(count(*good), 0)
        self.assertEqual(count(*good, required=1), 1)
        self.assertEqual(count(*good, before=1), 1)
        for byte in range(8):
            self.assertEqual(count(*good, reserved=np.arange(8) == byte), 1)
        self.assertEqual(count(*good, names=b"abcd"), 1)  # a byte after the names
        self.assertEqual(count(good[0], good[1] | {"name_offset": 3}, names=b"ab-c"), 2)  # one between them
        self.assertEqual(count(good[0] | {"name_offset": 1}, good[1] | {"name_offset": 0}, names=b"cab"), 2)
        self.assertEqual(count(good[0], good[1] | {"name_offset": 1}, names=b"abc"), 1)  # overlap
        self.assertEqual(count(good[0], {"name_offset": 0}), 1)  # an empty name has a place, too
        self.assertEqual(count(good[0], {"translation": [1, -0.0, 2]}), 1)
        self.assertEqual(count({"rotation": [[1, 0, 0], [0, 1, 0], [0, -0.0, 1]]}, good[1]), 1)
        self.assertEqual(count({"member": 0, "meets": 7, "rotation": [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]}), 0)


class Topology(unittest.TestCase):
    """The cube has 13 triangles, one of them without area, at the places 0 and 4 to 15."""

    def setUp(self):
        ((_, self.everything),) = golden("ok-everything.cbvh")
        file = rules.validate(self.everything)
        one = file.objects[0]
        ids = dict(zip(one.ids().tolist(), one.places().tolist()))
        self.flat, self.doubled = ids[13], ids[0]  # two duplicates of triangle 0 are left out

    def with_topology(self, closed=1, components=(0,), nets=None, head=None, more=b"", **fields):
        nets = nets or []
        record = np.zeros((), cbvh.TOPOLOGY_RECORD)
        record["closed"], record["components"], record["nets"] = closed, len(components), len(nets)
        for field, value in fields.items():
            record[field] = value
        first = np.array((1, len(components), len(nets), [0] * 4), cbvh.TOPOLOGY_HEAD)
        for field, value in (head or {}).items():
            first[field] = value
        lists = np.array(components, "<u4").tobytes() + np.array(nets, cbvh.NET).tobytes()
        section = first.tobytes() + record.tobytes() + lists + more
        return with_section(self.everything, section, kind=cbvh.TOPOLOGY)

    def verdict(self, *arguments, **fields):
        return mutate.verdict(self.with_topology(*arguments, **fields))

    def test_lengths(self):
        self.assertEqual(self.verdict(), 0)
        self.assertEqual(self.verdict(0, ()), 0)
        for field in ("objects", "components", "nets"):
            for value in (0, 2, (1 << 32) - 1):
                if (field, value) != ("nets", 0):
                    self.assertEqual(self.verdict(head={field: value}), 44, (field, value))
        self.assertEqual(self.verdict(more=bytes(4)), 44)
        self.assertEqual(self.verdict(more=bytes(4), components=[0], head={"components": 2}), 44)
        self.assertEqual(mutate.verdict(with_section(self.everything, bytes(12), kind=cbvh.TOPOLOGY)), 44)

    def test_records(self):
        self.assertEqual(self.verdict(2), 45)
        self.assertEqual(self.verdict(0, (), [(self.doubled, 3)]), 0)
        self.assertEqual(self.verdict(0, (), [(self.doubled, 1)]), 47)
        self.assertEqual(self.verdict(components=range(4, 17)), 46)
        self.assertEqual(self.verdict(components=range(4, 18)), 45)

    def test_places(self):
        for places, rule in (([0, 4, 15], 0), ([4, 4], 46), ([5, 4], 46), ([16], 46), ([1], 46), ([0, 3], 46)):
            self.assertEqual(self.verdict(components=places), rule, places)
            self.assertEqual(self.verdict(0, places), rule, places)
            nets = [(place, 0) for place in places]
            self.assertEqual(self.verdict(nets=nets), rule or 48, places)

    def test_nets_and_boundaries(self):
        self.assertEqual(self.verdict(nets=[(self.flat, 1)]), 47)
        everywhere = [0, *range(4, 16)]
        for net in (0, 2, 7, -1, 1 - (1 << 31)):
            self.assertEqual(self.verdict(nets=[(self.flat, net)]), 0)
            self.assertEqual(self.verdict(nets=[(self.doubled, net)]), 48)
            self.assertEqual(self.verdict(nets=[(place, net) for place in everywhere]), 0)
            self.assertEqual(self.verdict(nets=[(place, net) for place in everywhere if place != self.flat]), 0)
            self.assertEqual(self.verdict(nets=[(place, net) for place in everywhere if place != self.doubled]), 48)

    def test_order_of_rules(self):
        self.assertEqual(self.verdict(2, [5, 4], head={"objects": 2}), 44)
        self.assertEqual(self.verdict(2, [5, 4]), 45)
        self.assertEqual(self.verdict(components=[5, 4], nets=[(4, 1)]), 46)
        self.assertEqual(self.verdict(nets=[(4, 1), (3, 0)]), 47)
        self.assertEqual(self.verdict(components=[1], nets=[(self.doubled, 3)]), 46)
        file = rules.validate(self.everything)
        for kind, offset, rule in ((cbvh.DUPLICATES, 3, 36), (cbvh.NODES, 44, 16)):
            data = bytearray(self.with_topology(components=[1]))
            data[rules.open_file(data).sections[kind].offset + offset] = 0xFF
            mutate.seal(data)
            self.assertEqual(mutate.verdict(data), rule)

    def test_what_binds_writers(self):
        def count(*arguments, **fields):
            return len(list(musts.violations(rules.validate(self.with_topology(*arguments, **fields)))))

        least = sorted((self.flat, min({0, *range(4, 16)} - {self.flat})))
        self.assertEqual(count(0, least), 0)
        self.assertEqual(count(0, least, reserved=1), 1)
        self.assertEqual(count(0, least, head={"reserved": [0, 0, 0, 1]}), 1)
        self.assertEqual(count(0, least[1:]), 2)  # one is missing, and the others are not all
        self.assertEqual(count(0, sorted({*least, 9})), 1)
        # The two duplicates of triangle 0 make its net 3, 1 or -1. The other triangles have none.
        others = [(place, -1) for place in (0, *range(4, 16))]
        self.assertEqual(count(1, least, others), 12)
        self.assertEqual(count(1, least, [(place, -2) for place, _ in others]), 13)


class Golden(unittest.TestCase):
    def test_valid_files(self):
        count = 0
        for name, data in golden("ok-*.cbvh"):
            with self.subTest(name):
                file = rules.validate(data)
                rules.verify(file)
                self.assertEqual(list(musts.violations(file)), [])
                count += 1
        self.assertGreater(count, 0)

    def test_frozen_files(self):
        """Each file is the one that its version published."""
        with open(os.path.join(TESTDATA, "frozen.txt"), encoding="utf-8") as lines:
            stated = [line.split() for line in lines if not line.startswith("#")]
        found = {name: f"{xxh3_64(data):016x}" for name, data in golden("*.cbvh")}
        self.assertEqual({name: sum for sum, name in stated}, found)

    def test_versions(self):
        """Later minor versions are read without their new sections, and other major versions are refused."""
        ((_, data),) = golden("ok-later.cbvh")
        file = rules.validate(data)
        self.assertEqual((file.header.major, file.header.minor, file.entries[-1].kind), (1, 7, 99))
        for major, minor, rule in ((1, 0, 0), (1, 65535, 0), (2, 0, 2), (2, 7, 2), (0, 3, 2), (65535, 0, 2)):
            changed = bytearray(data)
            changed[8:12] = np.array([major, minor], "<u2").tobytes()
            mutate.seal(changed)
            self.assertEqual(mutate.verdict(bytes(changed)), rule, (major, minor))

    def test_invalid_files(self):
        seen = set()
        for name, data in golden("bad-*.cbvh"):
            with self.subTest(name):
                rule = int(re.match(r"bad-R(\d\d)-", name)[1])
                seen.add(rule)
                self.assertEqual(mutate.verdict(data), rule)
        self.assertEqual([row[0] for row in table("rules")], [f"R{rule:02}" for rule in range(1, 53)])
        self.assertEqual(seen, set(range(1, 53)) - {35, 39})

    def test_bounds_that_cut(self):
        """R35 has no golden file. Here, codes of ok-plain are raised so that bounds cut, without new checksums."""
        (_, data) = next(golden("ok-plain.cbvh"))
        file = rules.validate(data)
        page = file.objects[0].pages_read[0]
        places = cbvh.places_of_codes(page.layout)[: page.children(0)].ravel()
        for place in np.concatenate([places, places + page.layout.hi]):
            at = page.treelet_at(0) + int(place)
            if data[at] < 250:
                file.data = page.data = data[:at] + bytes([data[at] + 5]) + data[at + 1 :]
                self.assert_cuts(file, 35)

    def forged(self, slabs):
        """Returns ok-profiles with the bytes of turning slabs, by child, in the root of its dop26-u8-wide object."""
        (_, data) = next(golden("ok-profiles.cbvh"))
        page = next(one for one in rules.validate(data).objects if one.layout.turning).pages_read[0]
        data = bytearray(data)
        for child, codes in slabs.items():
            for first, code in zip(page.layout.turning, codes):
                data[page.treelet_at(0) + first + child] = code
        mutate.seal(data)
        file = rules.validate(bytes(data))
        return file, file.objects[page.owner.number].pages_read[0]

    def assert_cuts(self, file, rule):
        self.assertEqual(mutate.broken_by(rules.verify, file), rule)

    def test_turning_slabs(self):
        """R35 holds for the greatest codes that leave the triangles inside, and fails if one of them is raised."""
        chance = random.Random(4)
        for _ in range(4):
            slabs = {}
            a, b = chance.randrange(255), chance.randrange(255)
            file, page = self.forged({child: (0, 1, a, b) for child in range(3)})
            _, _, lo, hi = page.decode()
            lanes = page.offsets()
            n = turning_direction((0, 0, a, b))
            for child, (kind, packet) in enumerate(page.targets(0)):
                corners = lanes[packet, : kind - 3].reshape(-1, 3).tolist()
                reach = [sum(c * Fraction(v) for c, v in zip(n, corner)) for corner in corners]
                box = lo[0, child, :3], hi[0, child, :3]
                lower = max(code for code in range(256) if turning_slab((code, 0, a, b), *box)[0] <= min(reach))
                upper = max(code for code in range(256) if turning_slab((0, code, a, b), *box)[1] >= max(reach))
                slabs[child] = (lower, upper, a, b)
            file, _ = self.forged(slabs)
            rules.verify(file)
            self.assertEqual(list(musts.violations(file)), [])
            for child, (lower, upper, a, b) in slabs.items():
                for raised in ((lower + 1, upper, a, b), (lower, upper + 1, a, b)):
                    if max(raised) < 256:
                        self.assert_cuts(self.forged(slabs | {child: raised})[0], 35)

    def test_turning_slabs_with_many_triangles_below(self):
        """R39 has no golden file. It comes before R35 for the turning slab, and after R35 for the child's slabs."""
        holds, _ = self.forged({1: (0, 0, 127, 127)})
        cuts, page = self.forged({1: (255, 255, 127, 127)})
        count = page.targets(0)[1][0] - 3
        with mock.patch("cbvh.TURNING_TRIANGLES", count):
            rules.verify(holds)
            self.assert_cuts(cuts, 35)
        with mock.patch("cbvh.TURNING_TRIANGLES", count - 1):
            self.assert_cuts(holds, 39)
            self.assert_cuts(cuts, 39)
            at = page.treelet_at(0) + int(cbvh.places_of_codes(page.layout)[1, 0])
            cuts.data = page.data = page.data[:at] + b"\xff" + page.data[at + 1 :]
            self.assert_cuts(cuts, 35)

    def test_bytes_of_turning_slabs_that_writers_leave(self):
        """Writers use direction codes of at most 254, and absent children have no turning slab."""
        for slabs, found in (
            ({0: (0, 0, 254, 254)}, 0),
            ({0: (0, 0, 255, 127)}, 1),
            ({0: (0, 0, 127, 255)}, 1),
            ({3: (0, 0, 127, 127)}, 1),
        ):
            file, page = self.forged(slabs)
            self.assertEqual(page.children(0), 3)
            rules.verify(file)
            self.assertEqual(len(list(musts.violations(file))), found, slabs)

    def test_what_is_in_them(self):
        files = {name: rules.validate(data) for name, data in golden("ok-*.cbvh")}
        ball = files["ok-turning.cbvh"]
        page = ball.objects[0].pages_read[0]
        self.assertTrue(all(page.turning_codes()[slot, : page.children(slot)].any() for slot in range(page.treelets)))
        rules.verify(ball)
        cloud = files["ok-points.cbvh"]
        one = cloud.objects[0]
        self.assertTrue(all(cbvh.has_points(page.packed_head()) for page in one.pages_read))
        at = np.arange(150)
        points = np.stack([at % 7, at // 7 % 5, at % 3], axis=1) / 10.0
        order = np.concatenate([page.ids()[page.lanes_used()] for page in one.pages_read])
        stored = np.concatenate([page.offsets()[page.lanes_used()] for page in one.pages_read])
        self.assertTrue((stored == points[order].astype(np.float32)[:, None]).all())
        self.assertEqual((one.radius, one.solid, one.degenerate, len(order)), (0.05, 0, 150, 150))
        self.assertEqual([(one.closed, one.components) for one in cloud.topology], [(1, 0)])
        rules.verify(cloud)
        others = {"ok-turning.cbvh", "ok-topology.cbvh", "ok-points.cbvh", "ok-exact.cbvh", "ok-exact-f32.cbvh"}
        for name, file in files.items():
            for one in file.objects if name not in others else ():
                # Vertices less the origin are f32 numbers or, in predicted objects, within an f32 of the box.
                cube = (one.offsets() - (one.box_lo + one.box_hi) / 2).reshape(-1, 3)
                self.assertTrue((np.abs(cube) == 1).all(), name)  # corners of a cube of side 2
        everything = files["ok-everything.cbvh"]
        self.assertEqual(sorted(everything.sections), list(range(1, 7)))
        self.assertEqual([name for name, file in files.items() if file.instances], ["ok-scene.cbvh"])
        with_topology = [name for name, file in files.items() if file.topology]
        self.assertEqual(with_topology, ["ok-exact.cbvh", "ok-points.cbvh", "ok-topology.cbvh"])
        surfaces = [(one.closed, one.components, one.nets) for one in files["ok-topology.cbvh"].topology]
        self.assertEqual(surfaces, [(1, 1, 0), (0, 1, 0), (1, 2, 12), (0, 0, 0)])
        self.assertTrue((files["ok-topology.cbvh"].topology[2].net_list()["net"] == 3).all())
        self.assertEqual(everything.provenance(), {"generator": "a test", "input": "a cube"})
        self.assertEqual(everything.weights().sum(), everything.objects[0].input_triangles)
        names = [one.name for one in files["ok-profiles.cbvh"].objects]
        self.assertEqual(len(names), len(cbvh.PROFILES))

    def test_exact_vertices(self):
        """What is in the golden files of exact vertices: the numbers that were given."""
        files = {name: rules.validate(data) for name, data in golden("ok-exact*.cbvh")}
        self.assertEqual(len(files), 2)
        for name, file in files.items():
            objects = {one.name: one for one in file.objects}
            vertices = {name: np.unique(one.vertices().reshape(-1, 3), axis=0) for name, one in objects.items()}
            found = sorted({number for one in file.objects for number in one.predictors.tolist()})
            self.assertEqual(found, list(range(len(cbvh.PREDICTORS))))
            whole = vertices["decimals"] - (1000000.1, -2000000.3, 0)
            self.assertLess(np.abs(whole - np.rint(whole)).max(), 1e-9)
            for value in vertices["decimals"].ravel().tolist():
                self.assertEqual(value, round(value, 1))
            for value in vertices["significant"].ravel().tolist():
                self.assertEqual(float(f"{value:.5e}"), value)
            for value in vertices["shortest"].ravel().tolist():
                self.assertEqual(float(str(np.float32(value))), value)
            for value in vertices["scaled"].ravel():
                nearest = np.float32(value / 0.0254)
                near = [nearest, np.nextafter(nearest, np.float32(9)), np.nextafter(nearest, np.float32(-9))]
                self.assertIn(value, [float(v) * 0.0254 for v in near])
            twins = vertices["twins"]
            self.assertEqual(len(twins), 2 * len(vertices["scaled"]))
            rounded = set(map(tuple, twins.astype(np.float32).tolist()))
            self.assertLess(len(rounded), len(twins))
            mixed = objects["mixed"]
            pages = [page for page in mixed.pages_read if page.packets]
            stated = [(page.corrections_head().counts.tolist(), page.corner_count()) for page in pages]
            for counts, corners in stated:
                self.assertEqual(counts[:2], [0, corners])
                self.assertTrue(0 < counts[2] < corners)
            self.assertEqual([one.is_sum() for one in (mixed, objects["twins"])], [[True, False, False], [False] * 3])

    def test_convex_objects(self):
        """Objects that state to be convex: a cube is, and what is open, in two parts or has dents is not."""
        for name, convex in (("ok-topology", [True, False, False, False]), ("ok-exact", [False] * 6)):
            ((_, data),) = golden(f"{name}.cbvh")
            data = bytearray(data)
            for one in rules.open_file(data).objects:
                data[one.place("convex")] = 1
            mutate.seal(data)
            file = rules.validate(bytes(data))
            found = [not any("(15.6)" in violation for violation in musts.of_object(one)) for one in file.objects]
            self.assertEqual(found, convex, name)

    def test_vertices_that_are_not_as_stated(self):
        (_, data) = next(golden("ok-exact.cbvh"))
        file = rules.validate(data)
        one = next(one for one in file.objects if one.name == "mixed")

        def verdict(field, values):
            changed, at = bytearray(data), one.place(field)
            changed[at : at + len(values)] = values
            mutate.seal(changed)
            return mutate.verdict(changed, bounds=True)

        less = np.nextafter(one.left_out, np.float32(0))
        more = one.left_out * np.float32(1e6) * (one.left_out > 0)
        self.assertEqual(verdict("left_out", one.left_out.tobytes()), 0)
        self.assertEqual(verdict("left_out", np.float32(1e-30).tobytes()), 12)  # x is a sum
        self.assertEqual(verdict("left_out", np.array([0, less[1], one.left_out[2]], "<f4").tobytes()), 37)
        self.assertEqual(verdict("left_out", np.array([0, one.left_out[1], less[2]], "<f4").tobytes()), 37)
        self.assertEqual(verdict("left_out", more.astype("<f4").tobytes()), 35)
        self.assertEqual(verdict("origin", np.array([2.0**-149, *one.origin[1:]]).tobytes()), 37)
        self.assertEqual(verdict("origin", np.array([0, 2.0**-241, 0]).tobytes()), 12)
        for field, values, rule in (
            ("predictors", (5, 0, 1), 12),
            ("predictors", (0, 0, 4), 12),
            ("digits", (1, 0, 9), 12),
            ("digits", (0, 0, 0), 12),
            ("digits", (0, 0, 10), 12),
            ("digits", (0, 0, 8), 37),
            ("corrected", (8 + 6,), 12),
            ("corrected", (2,), 52),
            ("corrected", (7,), 0),
            ("convex", (1,), 0),
            ("convex", (2,), 12),
            ("triangle_encoding", (2,), 0),
        ):
            self.assertEqual(verdict(field, bytes(values)), rule, (field, values))

    def test_exit_codes(self):
        paths = {name: os.path.join(TESTDATA, name) for name, _ in golden("*.cbvh")}
        with open(os.devnull, "w") as nowhere:
            for arguments, code in (
                ([paths["ok-plain.cbvh"]], check.OK),
                ([paths["ok-plain.cbvh"], paths["bad-R01-text.cbvh"]], check.INVALID),
                ([paths["ok-plain.cbvh"] + ".missing"], check.SYSTEM),
                (["--query", paths["ok-plain.cbvh"]], check.USAGE),
            ):
                self.assertEqual(exit_code(arguments, nowhere), code, arguments)


if __name__ == "__main__":
    unittest.main()
