"""Decodes the bytes of a .cbvh file to structures and numbers, as spec/format.md states.

This module checks nothing. `rules.py` checks in the order of the specification, and calls a function of this module
only after earlier checks have made the call safe. Numbers in comments are sections of the specification. Arithmetic
that the specification calls f32 uses numpy arrays of float32; each operation rounds by itself, and numpy fuses none.
"""

from collections import namedtuple

import numpy as np

from xxh3 import xxh3_64

# 1.1
PAGE, LINE, WORD = 4096, 64, 8
MAJOR, MINOR = 1, 0
MAX_SECTIONS = 64
SHORT_TREELET_BYTES = 32
NO_PARENT = 0xFFFFFFFF
PACKET = 4
F32_PACKET_BYTES = 144
PACKED_HEAD_BYTES = 32
RECORD_HEAD_BITS = 14
CORRECTIONS_HEAD_BYTES = 40
MAX_BLOCK_BYTES = 1 << 20
ID_GROUP = 8
ID_ENTRY_BYTES = 6
ID_GROUP_HEAD_BITS = 54
TURNING_TRIANGLES = 1024
LEAST_UNIT_BITS = 180
MAX_SIGNIFICANT, MAX_DECIMALS = 9, 22
LOG2_MAX_WORLD, LOG2_MAX_RADIUS, RIGID_BITS = 118, 118, 23
STEP_U8, STEP_U4 = np.array([0x3B808081, 0x3D888889], np.uint32).view(np.float32)

MAGIC = bytes.fromhex("89636276680d0a1a")

# 2: structures without padding, little-endian
HEADER = np.dtype(
    [
        ("magic", "u1", 8),
        ("major", "<u2"),
        ("minor", "<u2"),
        ("sections", "<u4"),
        ("file_length", "<u8"),
        ("content_checksum", "<u8"),
        ("header_checksum", "<u8"),
        ("reserved", "u1", 24),
    ]
)
SECTION_ENTRY = np.dtype(
    [("kind", "<u4"), ("required", "<u4"), ("offset", "<u8"), ("length", "<u8"), ("checksum", "<u8")]
)
OBJECT_HEAD = np.dtype([("objects", "<u4"), ("names_length", "<u4"), ("reserved", "u1", 8)])
OBJECT_RECORD = np.dtype(
    [
        ("name_offset", "<u4"),
        ("name_length", "<u4"),
        ("origin", "<f8", 3),
        ("box_lo", "<f4", 3),
        ("box_hi", "<f4", 3),
        ("triangles", "<u8"),
        ("packets", "<u8"),
        ("treelets", "<u8"),
        ("first_page", "<u4"),
        ("pages", "<u4"),
        ("max_vertex_rounding", "<f8"),
        ("max_quantization_error", "<f8"),
        ("input_triangles", "<u8"),
        ("degenerate", "<u8"),
        ("duplicates", "<u8"),
        ("f16_exponent", "<i4"),
        ("profile", "u1"),
        ("triangle_encoding", "u1"),
        ("reserved", "u1", 2),
        ("sphere_centre", "<f4", 3),
        ("sphere_radius", "<f4"),
        ("radius", "<f8"),
        ("solid", "u1"),
        ("predictors", "u1", 3),
        ("digits", "u1", 3),
        ("corrected", "u1"),
        ("left_out", "<f4", 3),
        ("scale", "<f8"),
        ("convex", "u1"),
        ("reserved_end", "u1", 3),
    ]
)
INSTANCE_HEAD = np.dtype([("instances", "<u4"), ("names_length", "<u4"), ("reserved", "u1", 8)])
INSTANCE_RECORD = np.dtype(
    [
        ("name_offset", "<u4"),
        ("name_length", "<u4"),
        ("object", "<u4"),
        ("member", "<u4"),
        ("meets", "<u4"),
        ("solid", "<u4"),
        ("margin", "<f8"),
        ("rotation", "<f8", 9),
        ("translation", "<f8", 3),
    ]
)
TOPOLOGY_HEAD = np.dtype([("objects", "<u4"), ("components", "<u4"), ("nets", "<u4"), ("reserved", "u1", 4)])
TOPOLOGY_RECORD = np.dtype([("closed", "<u4"), ("components", "<u4"), ("nets", "<u4"), ("reserved", "<u4")])
NET = np.dtype([("place", "<u4"), ("net", "<i4")])
PAGE_HEADER = np.dtype(
    [
        ("checksum", "<u8"),
        ("leaf_checksum", "<u8"),
        ("id_checksum", "<u8"),
        ("leaf_line", "<u8"),
        ("id_word", "<u8"),
        ("first_packet", "<u4"),
        ("page_number", "<u4"),
        ("leaf_lines", "<u4"),
        ("id_words", "<u4"),
        ("packets", "<u2"),
        ("roots", "u1"),
        ("treelets", "u1"),
        ("remotes", "u1"),
        ("treelet_line", "u1"),
        ("profile", "u1"),
        ("short", "u1"),
    ]
)
PACKED_HEAD = np.dtype(
    [
        ("vertices", "<u2"),
        ("further", "<u2"),
        ("index_bits", "u1"),
        ("bits", "u1", 3),
        ("base", "<i4", 3),
        ("kinds", "u1"),
        ("exponent", "i1", 3),
        ("further_at", "<u4"),
        ("pool_at", "<u4"),
    ]
)
CORRECTIONS = np.dtype([("counts", "<u4", 3), ("bits", "u1", 3), ("reserved", "u1"), ("base", "<i8", 3)])
ID_ENTRY = np.dtype([("base", "<u4"), ("start", "<u2")])

# 7.2: the bits of each field of a treelet's links, the first one and the one behind the last
LINKS = {"first_treelet": (0, 7), "first_short": (7, 14), "first_remote": (14, 22), "first_leaf": (22, 32)}

# 2.1
OBJECTS, NODES, LEAVES, IDS, DUPLICATES, PROVENANCE, INSTANCES, TOPOLOGY = KINDS = range(1, 9)
NEEDED = (OBJECTS, NODES, LEAVES)
CONTENT = (OBJECTS, NODES, LEAVES, IDS, DUPLICATES, INSTANCES, TOPOLOGY)

# 3: the head and the records of sections with named records
TABLES = {OBJECTS: (OBJECT_HEAD, OBJECT_RECORD), INSTANCES: (INSTANCE_HEAD, INSTANCE_RECORD)}

# 4
DIRECTIONS = np.array(
    [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
        [1, 1, 1],
        [1, 1, -1],
        [1, -1, 1],
        [-1, 1, 1],
        [1, 1, 0],
        [1, 0, 1],
        [0, 1, 1],
        [1, -1, 0],
        [1, 0, -1],
        [0, 1, -1],
    ]
)

# 5, 7.1, 7.4 and 7.5: `turning` has the offsets of lower, upper, A and B of child 0; child c has its own c bytes
# further. `short` has the places in short treelets, if the profile has them.
Profile = namedtuple(
    "Profile",
    "name slabs encoding width treelet_bytes anchor_bytes "
    "code_bytes block row child hi kinds_at links_at turning short",
    defaults=[(), None],
)
Short = namedtuple("Short", "block kinds_at kinds_bits links_at")
PROFILES = [
    Profile("dop14-u8", 7, "u8", 4, 64, 64, 1, 0, 4, 1, 32, 28, 60, short=Short(0, 28, 16, 28)),
    Profile("dop6-u8", 3, "u8", 8, 64, 32, 1, 32, 4, 1, 16, 28, 60, short=Short(16, 12, 32, 28)),
    Profile("dop6-f16", 3, "f16", 4, 64, 32, 2, 0, 8, 2, 32, 28, 60),
    Profile("dop14-f32", 7, "f32", 4, 256, 64, 4, 0, 16, 4, 128, 124, 252),
    Profile("dop26-u4", 13, "u4", 4, 64, 128, 1, 0, 4, 1, 0, 28, 60),
    Profile("dop26-u8-wide", 13, "u8", 4, 128, 128, 1, 0, 4, 1, 64, 60, 124, (28, 92, 56, 120)),
]
ENCODINGS = ["f32", "packed", "quantized"]

# 7.2: kinds of children; 4 to 7 are packets of 1 to 4 triangles
TREELET, REMOTE, SHORT, LEAF = 1, 2, 3, 4
SORTS = {TREELET: "first_treelet", SHORT: "first_short", REMOTE: "first_remote", LEAF: "first_leaf"}

# 7.5: the code of u8 for which a nibble of a short treelet stands
SHORT_CODES = np.array([0, 10, 21, 32, 44, 55, 67, 78, 90, 103, 116, 129, 142, 157, 176, 208], np.uint8)

# 11.2: kinds of axes, and the slots that patterns state [pattern, lane, corner]
ORDERED, BINARY, DECIMAL = range(3)
PATTERNS = """
    012012012012 012013024034 012013024035 012013024043
    012013024045 012013024152 012013024153 012013024156
    012013024254 012013024256 012013024567 012013142153
    012013142154 012013142245 012013142253 012013142456
    012013142567 012023023023 012023031132 012023031134
    012023034034 012023034041 012023034045 012023034056
    012023034145 012023034152 012023034156 012023034253
    012023034254 012023034256 012023034354 012023034356
    012023034456 012023034567 012023045045 012023045056
    012023045067 012023045156 012023045167 012023045267
    012023045364 012023045367 012023045465 012023045467
    012023045567 012023045678 012023145145 012023145167
    012023145354 012023145367 012023145465 012023145467
    012023145567 012023145678 012023456456 012023456467
    012023456478 012023456789 012034034034 012034567589
    01203456789a 012345345345 012345678678 0123456789ab
""".split()
PATTERNS = np.array([[int(digit, 16) for digit in pattern] for pattern in PATTERNS]).reshape(-1, PACKET, 3)
RECORD_SLOTS = 6

# 15.1: predictors, with the digits that each allows, and whether the origin must be 0
SUM, SIGNIFICANT, SHORTEST, DECIMALS, SCALED = range(5)
Predictor = namedtuple("Predictor", "name least most needs_no_origin")
PREDICTORS = [
    Predictor("sum", 0, 0, False),
    Predictor("significant", 1, MAX_SIGNIFICANT, True),
    Predictor("shortest", 0, 0, True),
    Predictor("decimals", 0, MAX_DECIMALS, False),
    Predictor("scaled", 0, 0, True),
]
# P(k) for k from -MAX_POWER to MAX_POWER. Parsing a number rounds to nearest, but 10.0**k need not.
MAX_POWER = 64
POWERS = np.array([float(f"1e{k}") for k in range(-MAX_POWER, MAX_POWER + 1)])


def ceil_div(a, b):
    return -(-a // b)


def head_bytes(sections):
    """The length of the head of a file with this number of sections (2)."""
    return HEADER.itemsize + SECTION_ENTRY.itemsize * sections


def alignment_of(kind):
    """What divides the offsets of sections of a kind, known or not (2)."""
    return PAGE if kind == NODES else LINE


def aligned(at, unit):
    """The first multiple of `unit` from `at` on."""
    return unit * ceil_div(at, unit)


def records_of(head):
    """The number of records that the head of a section with named records states, in its first field."""
    return getattr(head, head.dtype.names[0])


def has_points(head):
    """Whether a packed leaf block is one of points (11.2)."""
    return bool(head.kinds & 1 << 6)


def kinds_of_axes(head):
    """The kinds of the axes of a packed leaf block; each of them is 0 to 3 (11.2)."""
    return [head.kinds >> 2 * axis & 3 for axis in range(3)]


def slots_of(pattern):
    """The number of slots of each pattern."""
    return 1 + PATTERNS[pattern].max(axis=(1, 2))


def row_of(slab):
    return slab if slab < 7 else slab + 1


def sort_of(kind):
    """The sort of a kind of children: those of a sort are numbered together (7.2)."""
    return min(kind, LEAF)


def bits_of(number, first, end):
    return number >> first & (1 << end - first) - 1


def places_with_strides(profile, block, row, child):
    """The offsets [child, slab] that strides lead to (7.1)."""
    number = np.arange(profile.width)[:, None]
    rows = np.array([row_of(slab) for slab in range(profile.slabs)])
    return block * (number // 4) + row * rows + child * (number % 4)


def places_of_codes(profile):
    """Offsets in a treelet of the codes of lower ends [child, slab]; those of upper ends are `hi` bytes further."""
    return places_with_strides(profile, profile.block, profile.row, profile.child)


def places_of_short_codes(profile):
    """Offsets in a short treelet of the bytes with both codes [child, slab] (7.5)."""
    return places_with_strides(profile, profile.short.block, 4, 1)


def decode_short_codes(stored):
    """The codes of u8 of lower and upper ends for which bytes of short treelets stand."""
    return SHORT_CODES[stored & 15], SHORT_CODES[stored >> 4]


def bit_values(data, at, first_bit, stride, width, count):
    """Reads `count` values of `width` bits, `stride` bits apart, from the little-endian number at byte `at` (1.4)."""
    if width == 0 or count == 0:
        return np.zeros(count, np.uint64)
    return bits_at(data, at, first_bit + stride * np.arange(count), width)


def bits_at(data, at, bits, widths):
    """Reads values of up to 57 bits at any places: bit 0 is the lowest of byte `at`. Bits beyond `data` are 0."""
    bits, widths = np.asarray(bits, np.uint64), np.asarray(widths, np.uint64)
    size = int(bits.max(initial=0)) // 8 + 8
    words = np.ndarray(size - 7, "<u8", bytes(data[at : at + size]).ljust(size, b"\0"), strides=(1,))
    masks = (np.uint64(1) << widths) - np.uint64(1)
    return words[(bits >> np.uint64(3)).astype(np.intp)] >> (bits & np.uint64(7)) & masks


def ordered(numbers):
    """The ordered numbers of f32 or f64 numbers, or the numbers of ordered numbers (1.1)."""
    kind, mask = {
        "float32": (np.int32, 0x7FFFFFFF),
        "float64": (np.int64, (1 << 63) - 1),
        "int32": (np.float32, 0x7FFFFFFF),
        "int64": (np.float64, (1 << 63) - 1),
    }[numbers.dtype.name]
    bits = np.ascontiguousarray(numbers).view(f"i{numbers.dtype.itemsize}")
    return np.where(bits >= 0, bits, bits ^ bits.dtype.type(mask)).view(kind)


def power_of_ten(k):
    """P(k) of 15.1. Beyond the table the result has no meaning; only numbers that break R30 lead there."""
    return POWERS[np.clip(k, -MAX_POWER, MAX_POWER) + MAX_POWER]


def significant(s, digits):
    """S(s, digits) of 15.1, for an array of f64."""
    least = np.searchsorted(POWERS, np.abs(s), side="right") - 1 - MAX_POWER
    k = digits - 1 - least
    power = power_of_ten(np.abs(k))
    found = np.where(k >= 0, np.rint(s * power) / power, np.rint(s / power) * power)
    return np.where(s == 0, 0.0, found)


def shortest(s):
    found = significant(s, 9)
    for digits in (8, 7, 6):
        candidate = significant(s, digits)
        found = np.where(candidate.astype(np.float32).astype(np.float64) == s, candidate, found)
    return found


def coordinates(predictor, digits, origin, scale, offsets, corrections):
    """The coordinates of an axis from its offsets, an array of f32, and their corrections, an array of i64 (15.1)."""
    with np.errstate(all="ignore"):  # R30 and R37 find what is not finite
        s = np.float64(origin) + offsets.astype(np.float64)
        if predictor == SCALED:
            number = ordered((s / np.float64(scale)).astype(np.float32))
            number = number + corrections.astype(np.int32)  # both wrap around
            return ordered(number).astype(np.float64) * np.float64(scale) + 0.0  # -0 + 0 is 0
        if predictor == SUM:
            p = s
        elif predictor == SIGNIFICANT:
            p = significant(s, digits)
        elif predictor == SHORTEST:
            p = shortest(s)
        else:
            p = np.rint(s * power_of_ten(digits)) / power_of_ten(digits)
        p = p + 0.0
        return np.where(corrections == 0, p, ordered(ordered(p) + corrections)) + 0.0


class Record:
    """One structure: its fields as attributes, and the place of each field in the file."""

    def __init__(self, dtype, data, at):
        self.dtype, self.at = dtype, at
        row = np.frombuffer(data, dtype, 1, at)[0]
        for name in dtype.names:
            value = row[name]
            setattr(self, name, value if value.ndim else value.item())

    def place(self, field):
        return self.at + self.dtype.fields[field][1]


class File:
    """The contents of a file. The caller (`rules.open_file`) decides when each part is safe to read."""

    def __init__(self, data):
        self.data = data
        self.sections = {}  # entries of known kinds
        self.objects = []
        self.instances = []
        self.topology = []

    def read_header(self):
        self.header = Record(HEADER, self.data, 0)

    def head_bytes(self):
        return head_bytes(self.header.sections)

    def read_entries(self):
        """Reads the section table, and computes the checksum of the whole head."""
        head = bytearray(self.data[: self.head_bytes()])
        head[32:40] = bytes(8)
        self.header_checksum = xxh3_64(head)
        self.entries = [Record(SECTION_ENTRY, self.data, head_bytes(i)) for i in range(self.header.sections)]

    def bytes_of(self, kind):
        entry = self.sections.get(kind)
        return self.data[entry.offset : entry.offset + entry.length] if entry else b""

    def content_checksum(self):
        parts = []
        for entry in self.entries:
            if entry.kind in CONTENT:
                parts += [entry.kind.to_bytes(4, "little"), entry.length.to_bytes(8, "little")]
                parts += [self.bytes_of(entry.kind)]
        return xxh3_64(b"".join(parts))

    def duplicates(self):
        """Pairs of ids: the triangle that is stored, and its duplicate that is not (13)."""
        return np.frombuffer(self.bytes_of(DUPLICATES), "<u4").reshape(-1, 2)

    def weights(self):
        """How many triangles of the input each stored one represents: itself and its listed duplicates (13)."""
        ids = np.concatenate([one.ids() for one in self.objects])
        kept, counts = np.unique(self.duplicates()[:, 0], return_counts=True)
        weights = np.ones(len(ids), int)
        weights[np.isin(ids, kept)] += counts[np.searchsorted(kept, ids[np.isin(ids, kept)])]
        return weights

    def provenance(self):
        """The keys and values of the provenance (14)."""
        lines = self.bytes_of(PROVENANCE).decode("utf-8", "replace").split("\n")
        return dict(line.split("=", 1) for line in lines if "=" in line)


class NamedRecord(Record):
    """A record of a section that consists of a head, records and their names (3, 3.1)."""

    def __init__(self, file, kind, number):
        head, dtype = TABLES[kind]
        start = file.sections[kind].offset
        super().__init__(dtype, file.data, start + head.itemsize + dtype.itemsize * number)
        self.file, self.number = file, number
        count = records_of(Record(head, file.data, start))
        self.name_at = start + head.itemsize + dtype.itemsize * count + self.name_offset
        self.name_bytes = file.data[self.name_at : self.name_at + self.name_length]


class Object(NamedRecord):
    """One mesh and its tree (3)."""

    def __init__(self, file, number):
        super().__init__(file, OBJECTS, number)
        self.pages_read = []

    @property
    def layout(self):
        return PROFILES[self.profile]

    def is_sum(self):
        """For each axis, whether its coordinates are sums of the origin and offsets (15.1)."""
        return [self.predictors[axis] == SUM and not self.corrected >> axis & 1 for axis in range(3)]

    def page_numbers(self):
        return range(self.first_page, self.first_page + self.pages)

    def lanes_of(self, decode):
        """Joins a result per lane over all pages: one row for each stored triangle."""
        rows = [decode(page)[page.lanes_used()] for page in self.pages_read]
        return np.concatenate(rows)

    def offsets(self):
        """The offsets of all triangles: [triangle, corner, axis] in f32, in the order of places."""
        return self.lanes_of(Page.offsets)

    def vertices(self):
        """The vertices of all triangles: [triangle, corner, axis] in f64, in the order of places."""
        return self.lanes_of(Page.vertices)

    def ids(self):
        return self.lanes_of(Page.ids)

    def places(self):
        """The places of all triangles (12), in ascending order."""
        return self.lanes_of(Page.places)

    def traversals(self):
        """The edges that the triangles traverse (3.2): of each the place in `vertices` of its triangle, a number of
        the edge, and 1 if it is traversed from the lesser vertex to the greater one, else -1.
        """
        bits = self.vertices().reshape(-1, 3).view(np.uint64)  # no coordinate is -0
        vertices = np.unique(bits, axis=0, return_inverse=True)[1].reshape(-1, 3)
        start, end = vertices.ravel(), np.roll(vertices, -1, axis=1).ravel()
        triangle = np.arange(len(start)) // 3
        between = start != end
        start, end, triangle = start[between], end[between], triangle[between]
        edges = np.stack([np.minimum(start, end), np.maximum(start, end)], axis=1)
        number = np.unique(edges, axis=0, return_inverse=True)[1].ravel() if len(edges) else start
        return triangle, number, np.where(start < end, 1, -1)


class Instance(NamedRecord):
    """An object with a pose, groups and a name (3.1)."""

    def __init__(self, file, number):
        super().__init__(file, INSTANCES, number)

    def rows(self):
        """The three rows of the rotation."""
        return self.rotation.reshape(3, 3).tolist()


class Topology(Record):
    """What a file states about the surface of an object (3.2): the record, and its part of the lists."""

    def __init__(self, file, number):
        start = file.sections[TOPOLOGY].offset
        super().__init__(TOPOLOGY_RECORD, file.data, start + TOPOLOGY_HEAD.itemsize + TOPOLOGY_RECORD.itemsize * number)
        head = Record(TOPOLOGY_HEAD, file.data, start)
        table = start + TOPOLOGY_HEAD.itemsize
        records = np.frombuffer(file.data, TOPOLOGY_RECORD, head.objects, table)
        before = {field: records[field][:number].sum(dtype=int) for field in ("components", "nets")}
        lists = table + TOPOLOGY_RECORD.itemsize * head.objects
        self.places_at = lists + 4 * int(before["components"])
        self.nets_at = lists + 4 * head.components + NET.itemsize * int(before["nets"])
        self.number, self.data = number, file.data

    def component_places(self):
        return np.frombuffer(self.data, "<u4", self.components, self.places_at)

    def net_list(self):
        return np.frombuffer(self.data, NET, self.nets, self.nets_at)

    def nets_of(self, places):
        """The net of each triangle at the given places, all of which have triangles."""
        nets = np.ones(len(places), np.int64)
        listed = self.net_list()
        nets[np.searchsorted(places, listed["place"])] = listed["net"]
        return nets


class Page(Record):
    """A page of 4096 bytes of the node section, with the leaf and id blocks that it names (6)."""

    def __init__(self, owner, number):
        self.owner, self.number, self.layout = owner, number, owner.layout
        self.data = owner.file.data
        super().__init__(PAGE_HEADER, self.data, owner.file.sections[NODES].offset + PAGE * number)

    # Anchors and links (6.1, 6.2)

    def anchor_at(self, root):
        return self.at + LINE + root * self.layout.anchor_bytes

    def anchor(self, root):
        """The lower and upper ends of all slabs, in f32."""
        slabs = self.layout.slabs
        ends = np.frombuffer(self.data, "<f4", 2 * slabs, self.anchor_at(root))
        return ends[:slabs], ends[slabs:]

    def parent_at(self, root):
        return self.anchor_at(root) + self.layout.anchor_bytes - 8

    def parent(self, root):
        """The page and number of the remote link that leads to the root."""
        at = self.parent_at(root)
        return int.from_bytes(self.data[at : at + 4], "little"), self.data[at + 4]

    def remote_at(self, link):
        return self.anchor_at(self.roots) + 4 * link

    def remote(self, link):
        """The page and root to which a remote link leads."""
        at = self.remote_at(link)
        reference = int.from_bytes(self.data[at : at + 4], "little")
        return reference >> 6, reference & 63

    # Treelets (7)

    @property
    def first_short(self):
        """The slot of the first short treelet, which is also the number of those that are not short."""
        return self.treelets - self.short

    def is_short(self, slot):
        return slot >= self.first_short

    def treelet_at(self, slot):
        full = min(slot, self.first_short)
        at = self.at + LINE * self.treelet_line
        return at + full * self.layout.treelet_bytes + (slot - full) * SHORT_TREELET_BYTES

    def treelet_bytes(self):
        """The bytes of the treelets that are not short [slot, byte]."""
        size = self.layout.treelet_bytes
        return np.frombuffer(self.data, "u1", self.first_short * size, self.treelet_at(0)).reshape(-1, size)

    def short_bytes(self):
        """The bytes of the short treelets [slot less the first short one, byte]."""
        size = SHORT_TREELET_BYTES
        at = self.treelet_at(self.first_short)
        return np.frombuffer(self.data, "u1", self.short * size, at).reshape(-1, size)

    def layout_of(self, slot):
        """What has the places of kinds and links in a treelet."""
        return self.layout.short if self.is_short(slot) else self.layout

    def kinds_at(self, slot):
        return self.treelet_at(slot) + self.layout_of(slot).kinds_at

    def links_at(self, slot):
        return self.treelet_at(slot) + self.layout_of(slot).links_at

    def kinds(self, slot):
        """All nibbles, whatever the treelet's width: eight, or as many as a short treelet has."""
        at, bits = self.kinds_at(slot), self.layout.short.kinds_bits if self.is_short(slot) else 32
        word = int.from_bytes(self.data[at : at + 4], "little")
        return [word >> first & 15 for first in range(0, bits, 4)]

    def children(self, slot):
        """The number of children: one more than the index of the highest nibble that is not 0."""
        return max((child + 1 for child, kind in enumerate(self.kinds(slot)) if kind), default=0)

    def links(self, slot):
        """The number of the first child of each sort. Short treelets have only that of leaf packets (7.5)."""
        at = self.links_at(slot)
        word = int.from_bytes(self.data[at : at + 4], "little")
        sorts = (LEAF,) if self.is_short(slot) else SORTS
        return {sort: bits_of(word, *LINKS[SORTS[sort]]) for sort in sorts}

    def targets(self, slot):
        """For each child, its kind and the number of the slot, remote link or packet to which it leads."""
        following = self.links(slot)
        found = []
        for kind in self.kinds(slot)[: self.children(slot)]:
            found.append((kind, following[sort_of(kind)]))
            following[sort_of(kind)] += 1
        return found

    def lanes_used(self):
        """Which lanes of each packet hold triangles: [packet, lane]."""
        counts = [kind - 3 for slot in range(self.treelets) for kind in self.kinds(slot) if kind >= LEAF]
        return np.arange(PACKET) < np.array(counts, int).reshape(-1, 1)

    def places(self):
        """The place of each lane: [packet, lane]."""
        return PACKET * self.first_packet + np.arange(PACKET * self.packets).reshape(-1, PACKET)

    def codes(self):
        """The codes of lower and upper ends, each [slot, child, slab]. Those of short treelets are the codes of u8 for
        which nibbles stand.
        """
        profile = self.layout
        places, size = places_of_codes(profile), profile.code_bytes
        stored = np.ascontiguousarray(self.treelet_bytes()).view({1: "u1", 2: "<u2", 4: "<f4"}[size])
        lo, hi = stored[:, places // size], stored[:, (places + profile.hi) // size]
        if profile.encoding == "u4":
            return lo & 15, hi >> 4
        if not self.short:
            return lo, hi
        short_lo, short_hi = decode_short_codes(self.short_bytes()[:, places_of_short_codes(profile)])
        return np.concatenate([lo, short_lo]), np.concatenate([hi, short_hi])

    def decode(self):
        """Lower and upper ends of the slabs of treelets [slot, slab] and of their children [slot, child, slab] (8)."""
        profile = self.layout
        code_lo, code_hi = self.codes()
        own_lo = np.empty((self.treelets, profile.slabs), np.float32)
        own_hi = np.empty_like(own_lo)
        lo, hi = np.empty_like(code_lo, np.float32), np.empty_like(code_hi, np.float32)
        for root in range(self.roots):
            own_lo[root], own_hi[root] = self.anchor(root)
        for slot in range(self.treelets):
            lo[slot], hi[slot] = decode_slabs(
                profile, self.owner.f16_exponent, own_lo[slot], own_hi[slot], code_lo[slot], code_hi[slot]
            )
            for child, (kind, target) in enumerate(self.targets(slot)):
                if kind in (TREELET, SHORT):
                    own_lo[target], own_hi[target] = lo[slot, child], hi[slot, child]
        return own_lo, own_hi, lo, hi

    def turning_codes(self):
        """The bytes lower, upper, A and B of turning slabs: [slot, child, 4]. All are 0 where there is none (7.4)."""
        layout = self.layout
        if not layout.turning:
            return np.zeros((self.treelets, layout.width, 4), np.uint8)
        return self.treelet_bytes()[:, np.array(layout.turning) + np.arange(layout.width)[:, None]]

    # Leaf block (10, 11)

    def is_packed(self):
        return self.owner.triangle_encoding != 0

    def leaf_block_at(self):
        return self.owner.file.sections[LEAVES].offset + LINE * self.leaf_line

    def leaf_block(self):
        """The whole lines of the block; no bytes if the block does not lie within the section."""
        entry = self.owner.file.sections[LEAVES]
        inside = LINE * (self.leaf_line + self.leaf_lines) <= entry.length
        at = self.leaf_block_at()
        return self.data[at : at + LINE * self.leaf_lines] if inside else b""

    def packed_head(self):
        return Record(PACKED_HEAD, self.data, self.leaf_block_at())

    def packed_arrays(self, head):
        """The bits that the three bit arrays of the block take: records, further slots and pool (11.2)."""
        record = 0 if has_points(head) else RECORD_HEAD_BITS + RECORD_SLOTS * head.index_bits
        return self.packets * record, head.further * head.index_bits, head.vertices * int(head.bits.sum(dtype=int))

    def packed_places(self, head):
        """The offsets in the block at which the three arrays must start, and that at which the last one ends."""
        return np.cumsum([PACKED_HEAD_BYTES, *(ceil_div(bits, 8) for bits in self.packed_arrays(head))]).tolist()

    def packet_bytes(self):
        """The bytes that the packets take (11.1, 11.2)."""
        if not self.is_packed():
            return F32_PACKET_BYTES * self.packets
        return self.packed_places(self.packed_head())[-1] + 8

    def leaf_bytes_needed(self):
        """The bytes of the block before zeros fill its last line."""
        if not self.is_corrected():
            return self.packet_bytes()
        return self.corrections_at() - self.leaf_block_at() + self.correction_places(self.corrections_head())[-1] + 8

    def packed_records(self, head):
        """The patterns [packet], the rotations of lanes [packet, lane], and the slots of records [packet, slot]."""
        width, at = head.index_bits, self.leaf_block_at() + PACKED_HEAD_BYTES
        stride = RECORD_HEAD_BITS + RECORD_SLOTS * width
        fields = [(0, 6), *((6 + 2 * lane, 2) for lane in range(PACKET))]
        fields += [(RECORD_HEAD_BITS + width * slot, width) for slot in range(RECORD_SLOTS)]
        values = [bit_values(self.data, at, first, stride, bits, self.packets) for first, bits in fields]
        values = np.stack(values, axis=1).astype(np.intp)
        return values[:, 0], values[:, 1 : 1 + PACKET], values[:, 1 + PACKET :]

    def packed_slots(self, head):
        """The slots of each packet [packet, slot], and the numbers of those that are further slots, -1 for others.
        Slots that the pattern lacks are 0, and so are those beyond the further ones (R29).
        """
        pattern, _, held = self.packed_records(head)
        slot, last, count = np.arange(3 * PACKET), RECORD_SLOTS - 1, slots_of(pattern)[:, None]
        is_further = (count > RECORD_SLOTS) & (last <= slot) & (slot < count)
        number = np.where(is_further, held[:, last:] + slot - last, -1)
        at = self.leaf_block_at() + head.further_at
        further = bit_values(self.data, at, 0, head.index_bits, head.index_bits, head.further).astype(np.intp)
        held = np.pad(held, ((0, 0), (0, len(slot) - RECORD_SLOTS)))
        slots = np.where(is_further, np.append(further, 0).take(number, mode="clip"), held)
        return np.where(slot < count, slots, 0), number

    def packed_corners(self, head):
        """The place in the pool of each corner: [packet, lane, corner]."""
        if has_points(head):
            return np.arange(PACKET * self.packets).repeat(3).reshape(-1, PACKET, 3)
        pattern, rotation, _ = self.packed_records(head)
        turned = (np.arange(3) + rotation[..., None]) % 3
        places = np.take_along_axis(PATTERNS[pattern], turned, axis=2).reshape(-1, 3 * PACKET)
        return np.take_along_axis(self.packed_slots(head)[0], places, axis=1).reshape(-1, PACKET, 3)

    def packed_numbers(self, head):
        """The number n of each vertex and axis, as i32 (11.2)."""
        at = self.leaf_block_at() + head.pool_at
        first_bit, stride = 0, int(head.bits.sum(dtype=int))
        numbers = np.empty((head.vertices, 3), np.int32)
        for axis, width in enumerate(head.bits.tolist()):
            offsets = bit_values(self.data, at, first_bit, stride, width, head.vertices).astype(np.uint32)
            numbers[:, axis] = (offsets + head.base[axis].astype(np.uint32)).view(np.int32)
            first_bit += width
        return numbers

    def packed_pool(self, head):
        """The vertices of the block [vertex, axis], in f32."""
        numbers = self.packed_numbers(head)
        pool = np.empty(numbers.shape, np.float32)
        for axis, (kind, exponent) in enumerate(zip(kinds_of_axes(head), head.exponent.tolist())):
            n = numbers[:, axis]
            with np.errstate(over="ignore"):  # R30 finds what overflows
                if kind == ORDERED:
                    pool[:, axis] = ordered(n)
                elif kind == BINARY:
                    pool[:, axis] = (n * np.float64(2.0**exponent)).astype(np.float32)
                else:
                    pool[:, axis] = (n / power_of_ten(exponent)).astype(np.float32)
        return pool

    def offsets(self):
        """The offsets in all lanes of all packets: [packet, lane, corner, axis], in f32."""
        if self.packets == 0:
            return np.empty((0, PACKET, 3, 3), np.float32)
        if self.is_packed():
            head = self.packed_head()
            corners = self.packed_corners(head)
            return self.packed_pool(head).take(corners, axis=0, mode="clip")  # also safe before R29 is checked
        rows = np.frombuffer(self.data, "<f4", 36 * self.packets, self.leaf_block_at())
        return rows.reshape(-1, 3, 3, PACKET).transpose(0, 3, 1, 2)

    # Corrections (11.3) and vertices (15.1)

    def is_corrected(self):
        """Whether the block has corrections."""
        return self.owner.corrected > 0 and self.packets > 0

    def corrections_at(self):
        return self.leaf_block_at() + aligned(self.packet_bytes(), LINE)

    def corrections_head(self):
        return Record(CORRECTIONS, self.data, self.corrections_at())

    def corner_count(self):
        return int(self.packed_head().vertices) if self.is_packed() else 3 * PACKET * self.packets

    def correction_places(self, head):
        """The offsets, from the start of the corrections, at which the lists of the three axes and then their arrays
        start, and the one at which the last array ends.
        """
        counts, corners = head.counts.tolist(), self.corner_count()
        lists = [2 * count if count < corners else 0 for count in counts]
        arrays = [ceil_div(count * width, 8) for count, width in zip(counts, head.bits.tolist())]
        return np.cumsum([CORRECTIONS_HEAD_BYTES, *lists, *arrays]).tolist()

    def correction_lists(self, head):
        """For each axis, the numbers of the corners that have a correction."""
        corners, places = self.corner_count(), self.correction_places(head)
        return [
            np.frombuffer(self.data, "<u2", count, self.corrections_at() + at).astype(np.intp)
            if count < corners
            else np.arange(count)
            for count, at in zip(head.counts.tolist(), places)
        ]

    def correction_values(self, head):
        """For each axis, the corrections that are stated, as i64."""
        found = []
        for axis, at in enumerate(self.correction_places(head)[3:6]):
            width, count, start = int(head.bits[axis]), int(head.counts[axis]), self.corrections_at() + at
            # In two parts, since a value may have more than 57 bits.
            low = bit_values(self.data, start, 0, width, min(width, 32), count)
            high = bit_values(self.data, start, 32, width, max(width - 32, 0), count)
            values = low | high << np.uint64(32)
            found.append((values + head.base[axis].astype(np.uint64)).view(np.int64))
        return found

    def corrections(self):
        """The corrections in all lanes of all packets: [packet, lane, corner, axis], as i64. The lists are in order."""
        corners = np.zeros((self.corner_count(), 3), np.int64)
        head = self.corrections_head()
        for axis, (listed, values) in enumerate(zip(self.correction_lists(head), self.correction_values(head))):
            corners[listed, axis] = values
        if self.is_packed():
            return corners.take(self.packed_corners(self.packed_head()), axis=0, mode="clip")
        return corners.reshape(-1, 3, PACKET, 3).transpose(0, 2, 1, 3)

    def vertices(self):
        """The vertices in all lanes of all packets: [packet, lane, corner, axis], in f64."""
        offsets, one = self.offsets(), self.owner
        corrections = self.corrections() if self.is_corrected() else np.zeros(offsets.shape, np.int64)
        found = np.empty(offsets.shape)
        for axis in range(3):
            rule = int(one.predictors[axis]), int(one.digits[axis]), one.origin[axis], one.scale
            found[..., axis] = coordinates(*rule, offsets[..., axis], corrections[..., axis])
        return found

    # Id block (12)

    def id_block_at(self):
        entry = self.owner.file.sections.get(IDS)
        return entry.offset + WORD * self.id_word if entry else None

    def id_block(self):
        at = self.id_block_at()
        return self.data[at : at + WORD * self.id_words]

    def id_table_bytes(self):
        return ID_ENTRY_BYTES * ceil_div(self.packets, ID_GROUP)

    def id_groups(self):
        """The entry of each group, the widths in its head [group, 9] with v as the first, and the bits of the block at
        which its packets start and the last of them ends [group, packet + 1]. The block holds the table, but groups may
        start anywhere (R31): bits beyond the block are 0. Packets that a group does not have take no bits.
        """
        block = self.id_block()
        table = np.frombuffer(block[: self.id_table_bytes()], ID_ENTRY)
        start = 8 * table["start"].astype(np.intp)[:, None]
        widths = bits_at(block, 0, start + np.arange(0, ID_GROUP_HEAD_BITS, 6), 6).astype(np.intp)
        present = np.arange(ID_GROUP * len(table)).reshape(-1, ID_GROUP) < self.packets
        sizes = np.where(present, widths[:, :1] + 2 + 3 * widths[:, 1:], 0)
        ends = start + ID_GROUP_HEAD_BITS + np.cumsum(sizes, axis=1)
        return table, widths, np.concatenate([start + ID_GROUP_HEAD_BITS, ends], axis=1)

    def id_bytes_needed(self):
        return ceil_div(int(self.id_groups()[2][-1, -1]), 8) + 8

    def id_packets(self):
        """The least id of each packet, the lane stated [packet], and the offsets of the other three lanes."""
        block, (table, widths, bits) = self.id_block(), self.id_groups()
        base, width = (np.repeat(column, ID_GROUP)[: self.packets] for column in (table["base"], widths[:, 0]))
        offset = widths[:, 1:].reshape(-1, 1)[: self.packets]
        at = bits[:, :-1].ravel()[: self.packets]
        least = base + bits_at(block, 0, at, width).astype(np.uint32)
        lane = bits_at(block, 0, at + width, 2).astype(np.intp)
        offsets = bits_at(block, 0, (at + width + 2)[:, None] + offset * np.arange(PACKET - 1), offset)
        return least, lane, offsets.astype(np.uint32)

    def ids(self):
        """The ids in all lanes of all packets: [packet, lane]. Without an id section they are all 0."""
        if self.id_words == 0:
            return np.zeros((self.packets, PACKET), np.uint32)
        least, lane, offsets = self.id_packets()
        lanes, lane = np.arange(PACKET), lane[:, None]
        # The lane stated has the offset 0. Those before it have offsets 0, 1, ..., and those after it are one behind.
        number = np.where(lanes == lane, 0, lanes + (lanes < lane))
        return least[:, None] + np.take_along_axis(np.pad(offsets, ((0, 0), (1, 0))), number, axis=1)


def round_up_to_16_bits(t):
    """Rounds f32 numbers to 16 significant bits, away from zero: the function `up` of section 8."""
    bits = np.asarray(t, np.float32).view(np.uint32)
    return (bits + np.uint32(0xFF) & np.uint32(0xFFFFFF00)).view(np.float32)


def turning_directions(codes):
    """256 times the directions of turning slabs, as integers [..., axis], from their bytes [..., 4] (7.4)."""
    a, b = codes[..., 2].astype(int) - 127, codes[..., 3].astype(int) - 127
    return np.stack([a + b, a - b, 254 - 2 * np.maximum(np.abs(a), np.abs(b))], axis=-1)


def decode_turning(codes, box_lo, box_hi):
    """Decodes the ends of turning slabs from their bytes [..., 4] and the boxes [..., axis] of their children (8.1)."""
    n = turning_directions(codes)
    direction = n.astype(np.float32) / np.float32(256)
    with np.errstate(all="ignore"):  # a damaged treelet may decode to anything
        of_lo, of_hi = direction * box_lo, direction * box_hi
        lower, upper = np.where(n < 0, of_hi, of_lo), np.where(n < 0, of_lo, of_hi)
        least, greatest = ((reach[..., 0] + reach[..., 1]) + reach[..., 2] for reach in (lower, upper))
        unit = round_up_to_16_bits((greatest - least) * STEP_U8)
        a, b = codes[..., 0].astype(np.float32), codes[..., 1].astype(np.float32)
        return least + a * unit, greatest - b * unit


def decode_slabs(profile, f16_exponent, own_lo, own_hi, code_lo, code_hi):
    """Decodes children's slabs [child, slab] from their codes and the slabs [slab] of their treelet (8)."""
    if profile.encoding == "f32":
        return code_lo, code_hi
    with np.errstate(all="ignore"):  # a damaged treelet may decode to anything
        if profile.encoding == "f16":
            unit = np.ldexp(np.float32(1), f16_exponent)
            a, b = (code.view(np.float16).astype(np.float32) for code in (code_lo, code_hi))
        else:
            unit = round_up_to_16_bits((own_hi - own_lo) * (STEP_U8 if profile.encoding == "u8" else STEP_U4))
            a, b = code_lo.astype(np.float32), code_hi.astype(np.float32)
        return own_lo + a * unit, own_hi - b * unit
