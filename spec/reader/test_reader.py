"""Tests the reader by itself: its tables are those of the specification, its arithmetic is right, and it judges each
golden file as the file's name states.

    python3 -m unittest discover -s spec/reader

runs these tests and those of test_against_cbvh.py.
"""

import glob
import os
import random
import re
import unittest
from contextlib import redirect_stderr, redirect_stdout
from fractions import Fraction

import numpy as np

import cbvh
import check
import musts
import query
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


class Tables(unittest.TestCase):
    def test_structures(self):
        structures = {
            "Header": cbvh.HEADER,
            "SectionEntry": cbvh.SECTION_ENTRY,
            "object-head": cbvh.OBJECT_HEAD,
            "ObjectRecord": cbvh.OBJECT_RECORD,
            "PageHeader": cbvh.PAGE_HEADER,
            "PackedHead": cbvh.PACKED_HEAD,
            "id-head": cbvh.ID_HEAD,
            "links": cbvh.LINKS,
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
            self.assertEqual(row[1:], [str(value) for value in ours])
            self.assertEqual(places, [str(value) for value in (profile.name, *profile[6:])])
        self.assertEqual([row[1] for row in table("triangle-encodings")], cbvh.ENCODINGS)
        kinds = {int(row[0]): (row[2] == "yes", row[3] == "yes") for row in table("sections")}
        self.assertEqual(kinds, {kind: (kind in cbvh.NEEDED, kind in cbvh.CONTENT) for kind in range(1, 7)})

    def test_constants(self):
        stated = {row[0]: int(row[1], 0) for row in table("constants")}
        self.assertEqual(rules.MAX_COORDINATE, 2.0 ** stated.pop("LOG2_MAX_COORDINATE"))
        self.assertEqual((stated.pop("MINOR"), stated.pop("PAGE_HEADER_BYTES")), (0, cbvh.PAGE_HEADER.itemsize))
        for name, parts in (("STEP_U8", 255), ("STEP_U4", 15)):
            self.assertEqual(getattr(cbvh, name).view(np.uint32), stated.pop(name))
            self.assertEqual(getattr(cbvh, name), np.float32(1) / np.float32(parts))
        for name, value in stated.items():
            self.assertEqual(getattr(cbvh, name), value, name)

    def test_example_of_decoding(self):
        treelet = np.array([bytes.fromhex("".join(row[1] for row in table("example-treelet")))], "S64").view("u1")
        profile, rows = cbvh.PROFILES[0], table("example-child")
        places = cbvh.places_of_codes(profile)[1]
        codes = treelet[places], treelet[places + profile.hi]
        self.assertEqual([[int(row[3]), int(row[4])] for row in rows], np.transpose(codes).tolist())

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

    def test_contacts_of_two_triangles(self):
        flat = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
        cases = [
            ([[1, 1, -1], [1, 1, 1], [5, 5, 1]], True),  # pierced
            ([[1, 1, 0], [1, 1, 1], [5, 5, 1]], True),  # touched by a corner
            ([[4, 0, 0], [9, 0, 1], [9, 1, 1]], True),  # corner to corner
            ([[2, 2, 0], [9, 9, 0], [9, 8, 0]], True),  # in the plane, corner on edge
            ([[3, 3, 0], [9, 9, 0], [9, 8, 0]], False),  # in the plane
            ([[1, 1, 0]] * 3, True),  # a point in the face
            ([[1, 1, 2.0**-400]] * 3, False),  # a point just above
            ([[-1, 1, 0], [9, 1, 0], [4, 1, 0]], True),  # a segment across
            ([[-1, -1, 0], [9, -1, 0], [4, -1, 0]], False),  # a segment beside
            ([[1, 1, 1], [2, 1, 1], [1, 2, 1]], False),  # parallel
        ]
        for other, expected in cases:
            pair = np.array([flat], np.float64), np.array([other], np.float64)
            self.assertEqual(len(query.contacts(*pair)[0]), expected, other)
            self.assertEqual(len(query.contacts(*pair[::-1])[0]), expected, other)
            self.assertEqual(query.have_common_point(pair[0][0], pair[1][0]), expected, other)
            self.assertEqual(query.least_distance(*pair) == 0, expected)

    def test_distances_of_two_triangles(self):
        flat = np.array([[[0, 0, 0], [4, 0, 0], [0, 4, 0]]], np.float64)
        for other, expected in (
            ([[1, 1, 2], [9, 9, 9], [9, 8, 9]], 2),  # corner to face
            ([[3, 3, 0], [9, 9, 0], [9, 8, 0]], 2**0.5),  # corner to edge
            ([[2, -3, -5], [2, -3, 5], [2, -9, 0]], 3),  # edge to edge
            ([[1, -3, 0], [3, -3, 0], [2, -9, 0]], 3),  # parallel edges
            ([[7, -4, 0]] * 3, 5),  # a point to a corner
        ):
            found = query.least_distance(flat, np.array([other], np.float64))
            self.assertAlmostEqual(found, expected, delta=1e-15 * expected)


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

    def test_invalid_files(self):
        seen = set()
        for name, data in golden("bad-*.cbvh"):
            with self.subTest(name):
                rule = int(re.match(r"bad-R(\d\d)-", name)[1])
                seen.add(rule)
                with self.assertRaises(rules.Broken) as broken:
                    rules.validate(data)
                self.assertEqual(broken.exception.rule, rule)
        self.assertEqual(seen, set(range(1, 39)) - {35})

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
                with self.assertRaises(rules.Broken) as broken:
                    rules.verify(file)
                self.assertEqual(broken.exception.rule, 35)

    def test_what_is_in_them(self):
        files = {name: rules.validate(data) for name, data in golden("ok-*.cbvh")}
        for name, file in files.items():
            for one in file.objects:
                corners = one.triangles_f32()
                cube = (corners - (one.box_lo + one.box_hi) / 2).reshape(-1, 3)
                self.assertTrue((np.abs(cube) == 1).all(), name)  # corners of a cube of side 2
        everything = files["ok-everything.cbvh"]
        self.assertEqual(sorted(everything.sections), list(range(1, 7)))
        self.assertEqual(everything.provenance(), {"generator": "a test", "input": "a cube"})
        self.assertEqual(query.weights(everything).sum(), everything.objects[0].input_triangles)
        names = [one.name for one in files["ok-profiles.cbvh"].objects]
        self.assertEqual(len(names), len(cbvh.PROFILES))

    def test_exit_codes(self):
        paths = {name: os.path.join(TESTDATA, name) for name, _ in golden("*.cbvh")}
        with open(os.devnull, "w") as nowhere:
            for arguments, code in (
                ([paths["ok-plain.cbvh"]], check.OK),
                ([paths["ok-plain.cbvh"], paths["bad-R01-text.cbvh"]], check.INVALID),
                ([paths["ok-plain.cbvh"] + ".missing"], check.SYSTEM),
                (["--query", "collide", paths["ok-plain.cbvh"]], check.USAGE),
            ):
                self.assertEqual(exit_code(arguments, nowhere), code, arguments)


if __name__ == "__main__":
    unittest.main()
