"""Checks the rules R01 to R52 of spec/format.md, section 16, in the order in which a reader reports them.

Each top-level function makes the checks of one time of 16.1. It raises `Broken` for the first broken rule. The
exception names the rule, the byte of the file, what was expected and what was found. Code after a check relies on it.
"""

from collections import namedtuple

import numpy as np

import cbvh
from cbvh import DUPLICATES, IDS, INSTANCES, LEAF, LEAVES, NEEDED, NODES, OBJECTS, PACKET, PAGE, REMOTE, SHORT, SORTS
from cbvh import TOPOLOGY, TREELET, sort_of
from xxh3 import xxh3_64

MAX_COORDINATE = 2.0**120  # R12, R30
MAX_BOX = 2.0**121  # R12
MAX_SLAB = 2.0**122  # R19, R38
MAX_WORLD = 2.0**cbvh.LOG2_MAX_WORLD  # R42
MAX_RIGID_ERROR = 2.0**-cbvh.RIGID_BITS  # R42
MAX_RADIUS = 2.0**cbvh.LOG2_MAX_RADIUS  # R12, R50
LARGEST_F16 = 0x7BFF


class Broken(Exception):
    """Raised for the first rule that a file breaks."""

    def __init__(self, rule, at, expected, found):
        super().__init__(f"R{rule:02} at byte {at}: expected {expected}, found {found}")
        self.rule, self.at, self.expected, self.found = rule, at, expected, found


def need(holds, rule, at, expected, found):
    if not holds:
        raise Broken(rule, at, expected, found)


def need_checksum(rule, at, stated, data):
    actual = xxh3_64(data)
    need(stated == actual, rule, at, f"checksum {stated:016x}", f"{actual:016x}")


def is_within(values, limit):
    """True if no number is NaN or exceeds `limit` in magnitude."""
    return bool((np.abs(values) <= limit).all())


# Open


def open_file(data):
    need(data[:8] == cbvh.MAGIC, 1, 0, cbvh.MAGIC.hex(" "), data[:8].hex(" "))
    whole = cbvh.HEADER.itemsize
    need(len(data) >= whole, 3, len(data), f"at least {whole} bytes", len(data))
    file = cbvh.File(data)
    file.read_header()
    header = file.header
    need(header.major == cbvh.MAJOR, 2, header.place("major"), f"version {cbvh.MAJOR}.x", f"{header.major}.{header.minor}")
    most, whole = cbvh.MAX_SECTIONS, file.head_bytes()
    need(header.sections <= most, 6, header.place("sections"), f"at most {most}", header.sections)
    need(len(data) >= whole, 6, len(data), f"at least {whole} bytes", len(data))
    file.read_entries()
    need(
        header.header_checksum == file.header_checksum,
        4,
        header.place("header_checksum"),
        f"checksum {header.header_checksum:016x}",
        f"{file.header_checksum:016x}",
    )
    need(header.file_length == len(data), 5, header.place("file_length"), f"{header.file_length} bytes", len(data))
    check_entries(file)
    check_section_checksum(file, file.sections[OBJECTS])
    nodes = file.sections[NODES]
    need(nodes.length % PAGE == 0, 13, nodes.place("length"), f"a multiple of {PAGE}", nodes.length)
    need(nodes.length // PAGE <= 1 << 26, 13, nodes.place("length"), "at most 2^26 pages", nodes.length // PAGE)
    check_objects(file)
    return file


def check_entries(file):
    end = file.head_bytes()
    for entry in file.entries:
        unit = cbvh.alignment_of(entry.kind)
        need(
            entry.offset % unit == 0 and entry.offset >= end,
            7,
            entry.place("offset"),
            f"a multiple of {unit}, at least {end}",
            entry.offset,
        )
        end = entry.offset + entry.length
        need(end <= file.header.file_length, 7, entry.place("length"), "an end within the file", end)
        if entry.kind in cbvh.KINDS:
            need(entry.kind not in file.sections, 9, entry.place("kind"), "each kind once", f"a second {entry.kind}")
            file.sections[entry.kind] = entry
        else:
            need(entry.required == 0, 8, entry.place("kind"), "a known kind", entry.kind)
    for kind in NEEDED:
        need(kind in file.sections, 9, file.header.place("sections"), f"a section of kind {kind}", "none")


def check_section_checksum(file, entry):
    need_checksum(10, entry.place("checksum"), entry.checksum, file.bytes_of(entry.kind))


def check_head(file, kind, rule):
    """Checks the head and the length of a section with named records (R11, R40), and returns the head."""
    entry, (dtype, record) = file.sections[kind], cbvh.TABLES[kind]
    need(entry.length >= dtype.itemsize, rule, entry.place("length"), "a head", f"{entry.length} bytes")
    head = cbvh.Record(dtype, file.data, entry.offset)
    count = cbvh.records_of(head)
    need(count >= 1, rule, head.place(dtype.names[0]), "at least 1", 0)
    length = dtype.itemsize + record.itemsize * count + head.names_length
    need(entry.length == length, rule, entry.place("length"), length, entry.length)
    return head


def check_name(one, rule, head, named):
    """Checks the name of a record (R11, R40). Earlier names have `named` bytes; returns the bytes with this name."""
    end = one.name_offset + one.name_length
    need(end <= head.names_length, rule, one.place("name_offset"), f"an end up to {head.names_length}", end)
    try:
        one.name = one.name_bytes.decode("utf-8")
    except UnicodeDecodeError as error:
        raise Broken(rule, one.name_at + error.start, "UTF-8", one.name_bytes.hex(" ")) from None
    named += one.name_length
    need(named <= head.names_length, rule, one.place("name_length"), f"a sum up to {head.names_length}", named)
    return named


def check_objects(file):
    head = check_head(file, OBJECTS, 11)
    first_page = named = 0
    for number in range(head.objects):
        one = cbvh.Object(file, number)
        check_numbers(one, file.objects[0] if file.objects else one)
        need(one.first_page == first_page, 13, one.place("first_page"), first_page, one.first_page)
        need(one.pages >= 1, 13, one.place("pages"), "at least 1", 0)
        first_page += one.pages
        named = check_name(one, 11, head, named)
        need(one.profile < len(cbvh.PROFILES), 14, one.place("profile"), "0 to 5", one.profile)
        need(
            one.triangle_encoding < len(cbvh.ENCODINGS),
            14,
            one.place("triangle_encoding"),
            "0 to 2",
            one.triangle_encoding,
        )
        check_predictors(one)
        file.objects.append(one)
    nodes = file.sections[NODES]
    need(first_page * PAGE == nodes.length, 13, nodes.place("length"), first_page * PAGE, nodes.length)


def check_numbers(one, first):
    """Checks R12 for an object record. `first` is that of object 0."""

    def need_field(field, holds, expected):
        need(holds, 12, one.place(field), expected, getattr(one, field))

    for field in ("origin", "sphere_centre"):
        need_field(field, is_within(getattr(one, field), MAX_COORDINATE), "at most 2^120 in magnitude")
    for field in ("box_lo", "box_hi"):
        need_field(field, is_within(getattr(one, field), MAX_BOX), "at most 2^121 in magnitude")
    need_field("origin", bool(are_on_unit(one.origin).all()), "multiples of 2^-180")
    need_field("box_lo", bool((one.box_lo <= one.box_hi).all()), "at most box_hi")
    need_field("max_vertex_rounding", 0 <= one.max_vertex_rounding <= MAX_COORDINATE, "0 to 2^120")
    need_field("max_quantization_error", 0 <= one.max_quantization_error <= MAX_COORDINATE, "0 to 2^120")
    need_field("sphere_radius", 0 <= one.sphere_radius < np.inf, "finite and at least 0")
    need_field("f16_exponent", -125 <= one.f16_exponent <= 112, "-125 to 112")
    need_field("triangles", 1 <= one.triangles <= PACKET * one.packets, "1 to 4 for each packet")
    need_field("packets", one.packets < 1 << 30, "below 2^30")
    need_field("input_triangles", one.input_triangles < 1 << 32, "below 2^32")
    need_field("radius", 0 <= one.radius <= MAX_RADIUS, "0 to 2^118")
    need_field("solid", one.solid <= 1, "0 or 1")
    need_field("radius", repr(one.radius) == repr(first.radius), "that of object 0")
    need_field("solid", one.solid == first.solid, "that of object 0")


def check_predictors(one):
    """Checks R12 for the fields of an object record that state how its vertices follow from offsets."""

    def need_field(field, holds, expected):
        need(holds, 12, one.place(field), expected, getattr(one, field))

    need_field("predictors", bool((one.predictors < len(cbvh.PREDICTORS)).all()), "0 to 4")
    need_field("corrected", one.corrected <= 7, "at most 7")
    for axis, predictor in enumerate(cbvh.PREDICTORS[number] for number in one.predictors.tolist()):
        digits, is_sum = int(one.digits[axis]), one.is_sum()[axis]
        need_field("digits", predictor.least <= digits <= predictor.most, f"those of {predictor.name}")
        need_field("origin", one.origin[axis] == 0 or not predictor.needs_no_origin, f"0 for {predictor.name}")
        need_field("left_out", bool(0 <= one.left_out[axis] <= MAX_COORDINATE), "0 to 2^120")
        need_field("left_out", one.left_out[axis] == 0 or not is_sum, "0 for sums")
    if cbvh.SCALED in one.predictors.tolist():
        need_field("scale", bool(2.0**-1022 <= abs(one.scale) < np.inf), "a normal number")
    else:
        need_field("scale", one.scale == 0, "0")
    need_field("convex", one.convex <= 1, "0 or 1")


def are_on_unit(numbers):
    """True for those numbers of at most 2^122 that are multiples of 2^-180 (R12, R37). The product is exact."""
    return np.modf(numbers * 2.0**cbvh.LEAST_UNIT_BITS)[0] == 0


# Touch


def touch(one, number):
    """Checks the bytes of a page of an object and returns the page."""
    at = one.file.sections[NODES].offset + PAGE * number
    page = cbvh.Page(one, number)
    need_checksum(15, at, page.checksum, page.data[at + 8 : at + PAGE])
    need(page.page_number == number, 16, page.place("page_number"), number, page.page_number)
    need(page.profile == one.profile, 18, page.place("profile"), one.profile, page.profile)
    most = max(0, page.treelets - page.roots) if page.layout.short else 0
    need(page.short <= most, 25, page.place("short"), f"at most {most}", page.short)
    need(1 <= page.roots <= page.treelets, 17, page.place("roots"), f"1 to {page.treelets}", page.roots)
    need(page.roots <= 63, 17, page.place("roots"), "at most 63", page.roots)
    line = cbvh.ceil_div(page.remote_at(page.remotes) - at, cbvh.LINE)
    need(page.treelet_line == line, 17, page.place("treelet_line"), line, page.treelet_line)
    end = page.treelet_at(page.treelets) - at
    need(end <= PAGE, 17, page.place("treelets"), f"an end within {PAGE} bytes", end)
    for root in range(page.roots):
        check_anchor(page, root)
    check_codes(page)
    check_numbering(page)
    last = one.first_page + one.pages
    for link in range(page.remotes):
        target, _ = page.remote(link)
        need(number < target < last, 23, page.remote_at(link), f"a page from {number + 1} to {last - 1}", target)
    if page.layout.encoding == "f32":
        check_stored_ends(page)
    return page


def check_anchor(page, root):
    lo, hi = page.anchor(root)
    bad = ~((-MAX_SLAB <= lo) & (lo <= hi) & (hi <= MAX_SLAB))
    if bad.any():
        slab = int(bad.argmax())
        raise Broken(19, page.anchor_at(root) + 4 * slab, "finite and ordered ends", f"{lo[slab]} and {hi[slab]}")
    parent_page, parent_link = page.parent(root)
    if page.number == page.owner.first_page and root == 0:
        holds, expected = (parent_page, parent_link) == (cbvh.NO_PARENT, 0), "no parent"
    else:
        holds, expected = page.owner.first_page <= parent_page < page.number, "an earlier page of the object"
    need(holds, 20, page.parent_at(root), expected, f"page {parent_page}, link {parent_link}")


def check_codes(page):
    encoding = page.layout.encoding
    if encoding not in ("f16", "f32"):
        return
    places, (code_lo, code_hi) = cbvh.places_of_codes(page.layout), page.codes()
    for slot in range(page.treelets):
        present = min(page.children(slot), page.layout.width)
        for codes, further in ((code_lo[slot, :present], 0), (code_hi[slot, :present], page.layout.hi)):
            good = codes <= LARGEST_F16 if encoding == "f16" else np.abs(codes) <= MAX_SLAB
            if not good.all():
                child, slab = np.argwhere(~good)[0]
                at = page.treelet_at(slot) + int(places[child, slab]) + further
                raise Broken(38, at, "a finite code, and for f16 none that is negative", codes[child, slab])


def check_stored_ends(page):
    """Checks R49 where slabs are stored as they are. Codes cannot lead out of the treelet's slabs."""
    own_lo, own_hi, lo, hi = page.decode()
    for slot in range(page.treelets):
        for child in range(page.children(slot)):
            need_nested(page.treelet_at(slot), (own_lo[slot], own_hi[slot]), (lo[slot, child], hi[slot, child]))


def need_nested(at, outer, inner):
    good = (outer[0] <= inner[0]) & (inner[1] <= outer[1])  # false for NaN
    if not good.all():
        slab = int((~good).argmax())
        expected = f"slab {slab} within [{outer[0][slab]}, {outer[1][slab]}]"
        raise Broken(49, at, expected, f"[{inner[0][slab]}, {inner[1][slab]}]")


def check_numbering(page):
    counters = {TREELET: page.roots, SHORT: page.first_short, REMOTE: 0, LEAF: 0}
    rules = {TREELET: 22, SHORT: 22, REMOTE: 23, LEAF: 24}
    for slot in range(page.treelets):
        count, at = page.children(slot), page.kinds_at(slot)
        need(1 <= count <= page.layout.width, 21, at, f"1 to {page.layout.width} children", count)
        kinds, least = page.kinds(slot)[:count], LEAF if page.is_short(slot) else TREELET
        for kind in kinds:
            need(least <= kind <= 7, 21, at, f"a kind from {least} to 7", kind)
        links, at = page.links(slot), page.links_at(slot)
        sorts = [sort_of(kind) for kind in kinds]
        for sort, field in SORTS.items():
            if sort in sorts:
                first, counter = links[sort], counters[sort]
                need(first == counter, rules[sort], at, f"{field} {counter}", first)
                need(sort != TREELET or first > slot, rules[sort], at, f"{field} above {slot}", first)
            counters[sort] += sorts.count(sort)
    for sort, field, stated in (
        (TREELET, "short", page.first_short),
        (SHORT, "treelets", page.treelets),
        (REMOTE, "remotes", page.remotes),
        (LEAF, "packets", page.packets),
    ):
        found = counters[sort]
        need(stated == found, rules[sort], page.place(field), f"an end of {SORTS[sort]} at {found}", stated)


# Cross


def cross(page, link, slabs, pages):
    """Checks that the root to which a remote link leads names that link, and lies within the slabs decoded for the child with
    the link. `pages` are the object's, all touched.
    """
    target, root = page.remote(link)
    other = pages[target - page.owner.first_page]
    need(root < other.roots, 20, page.remote_at(link), f"a root below {other.roots}", root)
    parent = other.parent(root)
    need(parent == (page.number, link), 20, other.parent_at(root), f"page {page.number}, link {link}", parent)
    need_nested(other.anchor_at(root), slabs, other.anchor(root))


# Block


def check_leaf_block(page):
    section = page.owner.file.sections[LEAVES]

    def check_place():
        end = cbvh.LINE * (page.leaf_line + page.leaf_lines) if page.leaf_lines else 0
        need(end <= section.length, 26, page.place("leaf_line"), f"an end within {section.length} bytes", end)
        lines = cbvh.ceil_div(page.leaf_bytes_needed(), cbvh.LINE)
        need(page.leaf_lines == lines, 26, page.place("leaf_lines"), lines, page.leaf_lines)

    block, is_corrected = page.leaf_block(), page.is_corrected()
    if is_corrected:
        length = cbvh.LINE * page.leaf_lines
        need(len(block) == length, 26, page.place("leaf_line"), f"an end within {section.length} bytes", "one beyond")
        most = cbvh.MAX_BLOCK_BYTES
        need(length <= most, 26, page.place("leaf_lines"), f"at most {most} bytes", length)
    elif not page.is_packed():
        check_place()
    need_checksum(27, page.place("leaf_checksum"), page.leaf_checksum, block)
    if page.is_packed() and page.packets:
        need(len(block) >= cbvh.PACKED_HEAD_BYTES, 28, page.place("leaf_lines"), "a head", f"{len(block)} bytes")
        head = page.packed_head()
        need(bool((head.bits <= 32).all()), 28, head.place("bits"), "at most 32", head.bits)
        need(head.index_bits <= 16, 28, head.place("index_bits"), "at most 16", head.index_bits)
        need(head.vertices >= 1, 28, head.place("vertices"), "at least 1", 0)
        kinds = cbvh.kinds_of_axes(head)
        need(head.kinds < 128 and max(kinds) <= cbvh.DECIMAL, 28, head.place("kinds"), "known kinds", head.kinds)
        for kind, exponent in zip(kinds, head.exponent.tolist()):
            least, most = {cbvh.ORDERED: (0, 0), cbvh.BINARY: (-128, 127), cbvh.DECIMAL: (0, 15)}[kind]
            need(least <= exponent <= most, 28, head.place("exponent"), f"{least} to {most}", exponent)
        if cbvh.has_points(head):
            for field, only in (("index_bits", 0), ("further", 0), ("vertices", PACKET * page.packets)):
                need(getattr(head, field) == only, 28, head.place(field), only, getattr(head, field))
        _, further_at, pool_at, _ = page.packed_places(head)
        need(head.further_at == further_at, 28, head.place("further_at"), further_at, head.further_at)
        need(head.pool_at == pool_at, 28, head.place("pool_at"), pool_at, head.pool_at)
        if not is_corrected:
            check_place()
    if is_corrected:
        end = page.corrections_at() - page.leaf_block_at() + cbvh.CORRECTIONS_HEAD_BYTES
        need(end <= len(block), 26, page.place("leaf_lines"), f"a head of corrections up to byte {end}", len(block))
        head, corners = page.corrections_head(), page.corner_count()
        for axis in range(3):
            most = corners if page.owner.corrected >> axis & 1 else 0
            need(head.counts[axis] <= most, 52, head.place("counts"), f"at most {most} of axis {axis}", head.counts)
        need(bool((head.bits <= 64).all()), 52, head.place("bits"), "at most 64", head.bits)
        check_place()


def check_id_block(page):
    section = page.owner.file.sections.get(IDS)
    if section is None or page.packets == 0:
        need(page.id_words == 0, 31, page.place("id_words"), 0, page.id_words)
        return
    end = cbvh.WORD * (page.id_word + page.id_words)
    need(end <= section.length, 31, page.place("id_word"), f"an end within {section.length} bytes", end)
    block, table, at = page.id_block(), page.id_table_bytes(), page.id_block_at()
    need(len(block) >= table, 31, page.place("id_words"), f"a table of {table} bytes", f"{len(block)} bytes")
    entries, widths, bits = page.id_groups()
    end = table
    for group, start in enumerate(entries["start"].tolist()):
        need(start == end, 31, at + cbvh.ID_ENTRY_BYTES * group + 4, f"a start at byte {end}", start)
        need(bool((widths[group] <= 32).all()), 31, at + start, "widths of at most 32", widths[group])
        end = cbvh.ceil_div(int(bits[group, -1]), 8)
    words = cbvh.ceil_div(page.id_bytes_needed(), cbvh.WORD)
    need(page.id_words == words, 31, page.place("id_words"), words, page.id_words)
    need_checksum(32, page.place("id_checksum"), page.id_checksum, block)


# Scene


def check_scene(file):
    """Checks the instances section, if there is one."""
    if INSTANCES not in file.sections:
        return
    check_section_checksum(file, file.sections[INSTANCES])
    head = check_head(file, INSTANCES, 40)
    named, names = 0, set()
    for number in range(head.instances):
        one = cbvh.Instance(file, number)
        named = check_name(one, 40, head, named)
        need(one.object < len(file.objects), 41, one.place("object"), f"below {len(file.objects)}", one.object)
        need(one.solid <= 1, 50, one.place("solid"), "0 or 1", one.solid)
        need(0 <= one.margin <= MAX_RADIUS, 50, one.place("margin"), "0 to 2^118", one.margin)
        check_pose(one)
        need(one.name not in names, 43, one.place("name_offset"), "no name twice", repr(one.name))
        if one.name:
            names.add(one.name)
        file.instances.append(one)


def check_pose(one):
    """Checks R42 for an instance. Each operation on Python's numbers is one of f64."""

    def dot(a, b):
        return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]

    def need_field(field, holds, expected):
        need(holds, 42, one.place(field), expected, getattr(one, field))

    need_field("rotation", bool(np.isfinite(one.rotation).all()), "finite numbers")
    need_field("translation", is_within(one.translation, MAX_WORLD), "at most 2^118 in magnitude")
    rows = one.rows()
    errors = [dot(rows[i], rows[j]) - (i == j) for i in range(3) for j in range(3)]
    need_field("rotation", is_within(errors, MAX_RIGID_ERROR), "rows that are orthonormal to within 2^-23")
    x, y, z = rows
    cross = (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])
    need_field("rotation", dot(cross, z) >= 0, "no reflection")


# Topology


def check_topology(file):
    """Checks the topology section, if there is one, without looking at pages."""
    if TOPOLOGY not in file.sections:
        return
    entry = file.sections[TOPOLOGY]
    check_section_checksum(file, entry)
    table = cbvh.TOPOLOGY_HEAD.itemsize
    need(entry.length >= table, 44, entry.place("length"), "a head", f"{entry.length} bytes")
    head = cbvh.Record(cbvh.TOPOLOGY_HEAD, file.data, entry.offset)
    need(head.objects == len(file.objects), 44, head.place("objects"), len(file.objects), head.objects)
    lists = table + cbvh.TOPOLOGY_RECORD.itemsize * head.objects
    length = lists + 4 * head.components + cbvh.NET.itemsize * head.nets
    need(entry.length == length, 44, entry.place("length"), length, entry.length)
    records = np.frombuffer(file.data, cbvh.TOPOLOGY_RECORD, head.objects, entry.offset + table)
    for field in ("components", "nets"):
        total = int(records[field].sum(dtype=np.uint64))
        need(getattr(head, field) == total, 44, head.place(field), total, getattr(head, field))
    file.topology = [cbvh.Topology(file, number) for number in range(head.objects)]
    for topology, one in zip(file.topology, file.objects):
        need(topology.closed <= 1, 45, topology.place("closed"), "0 or 1", topology.closed)
        for field in ("components", "nets"):
            count = getattr(topology, field)
            need(count <= one.triangles, 45, topology.place(field), f"at most {one.triangles}", count)
    for topology, one in zip(file.topology, file.objects):
        next_place = 0
        for number, place in enumerate(topology.component_places().tolist()):
            next_place = check_order(topology.places_at + 4 * number, place, next_place, one)
        next_place = 0
        for number, (place, net) in enumerate(topology.net_list().tolist()):
            at = topology.nets_at + cbvh.NET.itemsize * number
            next_place = check_order(at, place, next_place, one)
            need(net != 1, 47, at + 4, "a net that is not 1", net)


def check_order(at, place, least, one):
    end = PACKET * one.packets
    need(least <= place < end, 46, at, f"a place from {least} and below {end}", place)
    return place + 1


# Validate


def validate(data):
    """Returns the file if every rule except R35 and R39 holds."""
    file = open_file(data)
    for entry in file.entries:
        if entry.kind in file.sections:
            check_section_checksum(file, entry)
    stated, actual = file.header.content_checksum, file.content_checksum()
    need(stated == actual, 10, file.header.place("content_checksum"), f"content {stated:016x}", f"{actual:016x}")
    check_duplicates(file)
    check_scene(file)
    check_topology(file)
    for number in solids(file):
        closed = file.topology and file.topology[number].closed
        need(closed, 51, file.sections[OBJECTS].offset, "a closed object", f"object {number}, which is not")
    for one in file.objects:
        validate_object(one)
        if file.topology:
            check_surface(one, file.topology[one.number])
    return file


def solids(file):
    """The numbers of the objects that are solid, and of those of which an instance is."""
    yield from (one.number for one in file.objects if one.solid)
    yield from (one.object for one in file.instances if one.solid)


def check_surface(one, topology):
    """Checks R46 and R48 against the triangles."""
    places = one.places()
    for listed, at, size in (
        (topology.component_places(), topology.places_at, 4),
        (topology.net_list()["place"], topology.nets_at, cbvh.NET.itemsize),
    ):
        missing = ~np.isin(listed, places)
        if missing.any():
            first = int(missing.argmax())
            raise Broken(46, at + size * first, "the place of a triangle", listed[first])
    if topology.closed:
        triangle, edge, way = one.traversals()
        sums = np.zeros(edge.max(initial=-1) + 1, np.int64)
        np.add.at(sums, edge, way * topology.nets_of(places)[triangle])
        need(not sums.any(), 48, topology.place("closed"), "no boundary", f"{np.count_nonzero(sums)} edges")


def validate_object(one):
    for number in one.page_numbers():
        page = touch(one, number)
        check_leaf_block(page)
        check_id_block(page)
        check_lists(page)
        check_packets(page)
        one.pages_read.append(page)
    for page in one.pages_read:
        if page.remotes:
            _, _, lo, hi = page.decode()
            for slot in range(page.treelets):
                for child, (kind, target) in enumerate(page.targets(slot)):
                    if kind == REMOTE:
                        cross(page, target, (lo[slot, child], hi[slot, child]), one.pages_read)
    check_counts(one)


def check_lists(page):
    """Checks R52 for the lists of corrections of a page."""
    if not page.is_corrected():
        return
    head = page.corrections_head()
    for axis, listed in enumerate(page.correction_lists(head)):
        holds = (np.diff(listed) > 0).all() and listed.max(initial=-1) < page.corner_count()
        need(bool(holds), 52, page.corrections_at(), f"ascending corners of axis {axis}", listed)


def check_packets(page):
    """Checks each packet of a page in turn: its record (R29), each offset (R30, and R37 on axes that are sums), each
    coordinate on other axes (R37), and ids (R33).
    """
    bad_record = np.zeros(page.packets, bool)
    if page.is_packed() and page.packets and not cbvh.has_points(page.packed_head()):
        head = page.packed_head()
        _, rotation, _ = page.packed_records(head)
        slots, number = page.packed_slots(head)
        bad_record = ((slots >= head.vertices) | (number >= head.further)).any(axis=1) | (rotation > 2).any(axis=1)
    offsets, sums = page.offsets(), np.array(page.owner.is_sum())
    values = offsets.transpose(0, 2, 3, 1)  # packet, corner, axis, lane: the order of the block
    origin = np.broadcast_to(page.owner.origin[:, None], values.shape)
    too_large = ~(np.abs(values) <= MAX_COORDINATE)
    with np.errstate(invalid="ignore"):  # infinities are found by `too_large`
        bad_value = too_large | (error_of_sum(origin, values.astype(np.float64)) != 0) & sums[:, None]
    bad_vertex = np.zeros(page.packets, bool)
    if not sums.all():
        bad_vertex = ~(are_near(page.owner, offsets, page.vertices()) | sums).all(axis=(1, 2, 3))
    ids = page.ids()
    bad_id = (ids >= page.owner.input_triangles) & page.lanes_used() & (page.id_words > 0)

    bad = bad_record | bad_value.any(axis=(1, 2, 3)) | bad_vertex | bad_id.any(axis=1)
    if not bad.any():
        return
    packet = int(bad.argmax())
    block = page.leaf_block_at()
    if bad_record[packet]:
        expected = f"rotations up to 2, slots below {head.vertices} and further ones below {head.further}"
        found = f"{rotation[packet]}, {slots[packet]} and {number[packet].max()} in packet {packet}"
        raise Broken(29, block, expected, found)
    if bad_value[packet].any():
        place = (packet, *np.argwhere(bad_value[packet])[0])
        need(not too_large[place], 30, block, "a finite offset of at most 2^120", values[place])
        raise Broken(37, block, f"{origin[place]} + an offset to be an f64 number", values[place])
    if bad_vertex[packet]:
        expected = f"multiples of 2^-180 within {page.owner.left_out} of their offsets in packet {packet}"
        raise Broken(37, block, expected, page.vertices()[packet].tolist())
    found = ids[packet][bad_id[packet]][0]
    raise Broken(33, page.id_block_at(), f"an id below {page.owner.input_triangles}", found)


def are_near(one, offsets, vertices):
    """True for coordinates that are as near to their offsets as an object states, and multiples of 2^-180 (R37)."""
    with np.errstate(all="ignore"):  # comparisons are false for NaN
        down, up = exact_sum_outward(vertices, -one.origin, -offsets.astype(np.float64))
        left_out = one.left_out.astype(np.float64)
        near = (-left_out <= down) & (up <= left_out)
        return near & are_on_unit(np.where(near, vertices, 0))


def check_counts(one):
    """Checks R34: the sums over an object's pages."""
    packets = 0
    for page in one.pages_read:
        need(page.first_packet == packets, 34, page.place("first_packet"), packets, page.first_packet)
        packets += page.packets
    roots, remotes = (sum(getattr(page, field) for page in one.pages_read) for field in ("roots", "remotes"))
    need(roots == remotes + 1, 34, one.place("pages"), f"{remotes + 1} roots", roots)
    treelets = sum(page.treelets for page in one.pages_read)
    triangles = sum(int(page.lanes_used().sum()) for page in one.pages_read)
    for field, total in (("treelets", treelets), ("packets", packets), ("triangles", triangles)):
        need(getattr(one, field) == total, 34, one.place(field), total, getattr(one, field))


def error_of_sum(a, b):
    """The exact sum of f64 numbers minus their rounded sum, by Knuth's two-sum. Exact unless it overflows."""
    total = a + b
    part = total - a
    return (a - (total - part)) + (b - part)


def check_duplicates(file):
    entry = file.sections.get(DUPLICATES)
    if entry is None:
        return
    need(entry.length % 8 == 0, 36, entry.place("length"), "a multiple of 8", entry.length)
    before = (-1, -1)
    for number, pair in enumerate(map(tuple, file.duplicates().tolist())):
        at = entry.offset + 8 * number
        need(pair[0] < pair[1], 36, at, "the first id below the second", pair)
        need(before < pair, 36, at, f"a pair after {before}", pair)
        before = pair


# Verify

# What lies below a node: the range of the projections on each direction of the profile, and the number of triangles.
# `points` are the triangles' corners [point, axis], for up to TURNING_TRIANGLES triangles; they are for turning slabs.
Subtree = namedtuple("Subtree", "lo hi triangles points")


def verify(file):
    """Checks R35 and R39 for a validated file. Slabs contain the triangles below them in exact arithmetic."""
    for one in file.objects:
        below = {}  # the subtrees of roots to which no link was met yet, by page and root
        for page in reversed(one.pages_read):
            own, children = subtrees_of(page, below)
            below.update({(page.number, root): own[root] for root in range(page.roots)})
            verify_page(page, own, children)
        whole = below[one.first_page, 0]
        margins = margins_along(cbvh.DIRECTIONS[:3], one.left_out)
        if not are_wide_enough(one.box_lo, one.box_hi, whole.lo[:3], whole.hi[:3], margins).all():
            raise Broken(35, one.place("box_lo"), f"a box around {whole.lo[:3]} to {whole.hi[:3]}", one.box_lo)


def margins_along(directions, left_out):
    """The m of directions [..., axis] with integer coordinates (15.5). Products are exact."""
    x, y, z = np.moveaxis(np.abs(directions) * left_out.astype(np.float64), -1, 0)
    return exact_sum_outward(x, y, z)[1]


def are_wide_enough(lo, hi, low, high, margins):
    """True for slabs [lo, hi] that contain f32 numbers from `low` to `high` and what margins add. False for NaN.

    An end is an f64 number. It is therefore at most the exact difference if and only if it is at most the difference
    rounded down.
    """
    zeros = np.zeros_like(margins)
    down, up = exact_sum_outward(low, -margins, zeros)[0], exact_sum_outward(high, margins, zeros)[1]
    return (lo <= down) & (up <= hi)


def round_outward_to_f32(low, high):
    """The greatest f32 that are at most `low`, and the least that are at least `high`, as f64."""
    down, up = low.astype(np.float32), high.astype(np.float32)
    down = np.where(down > low, np.nextafter(down, np.float32(-np.inf)), down)
    up = np.where(up < high, np.nextafter(up, np.float32(np.inf)), up)
    return down.astype(np.float64), up.astype(np.float64)


def verify_page(page, own, children):
    _, _, lo, hi = page.decode()
    margins = margins_along(cbvh.DIRECTIONS[: page.layout.slabs], page.owner.left_out)
    for root in range(page.roots):
        need_contained(page.anchor_at(root), "anchor", *page.anchor(root), own[root], margins)
    turning = turning_slabs_that_hold(page, lo, hi, children)
    in_sphere = packets_in_sphere(page)
    for slot in range(page.treelets):
        at = page.treelet_at(slot)
        for child, (subtree, (kind, target)) in enumerate(zip(children[slot], page.targets(slot))):
            need_contained(at, f"child {child}", lo[slot, child], hi[slot, child], subtree, margins)
            holds = kind < LEAF or in_sphere[target]
            need(holds, 35, page.owner.place("sphere_radius"), f"a sphere around packet {target}", "one that cuts")
            if (slot, child) in turning:
                place, count, most = at + page.layout.turning[0] + child, subtree.triangles, cbvh.TURNING_TRIANGLES
                need(count <= most, 39, place, f"at most {most} triangles", count)
                need(turning[slot, child], 35, place, f"a turning slab around child {child}", "one that cuts")


def packets_in_sphere(page):
    """Whether the sphere of the record contains the triangles of each packet, in the arithmetic of 15.5."""
    centre, radius = page.owner.sphere_centre.astype(np.float64), np.float64(page.owner.sphere_radius)
    corners, used = page.offsets().astype(np.float64), page.lanes_used()
    x, y, z = np.moveaxis(np.abs(corners - centre) + page.owner.left_out.astype(np.float64), -1, 0)
    inside = (x * x + y * y) + z * z <= radius * radius
    return (inside | ~used[..., None]).all(axis=(1, 2))


def subtrees_of(page, below):
    """The subtree of each slot, and those of its children. Takes out of `below` the roots to which the page links."""
    packets = subtrees_of_packets(page)
    own, children = {}, {}
    for slot in reversed(range(page.treelets)):
        children[slot] = []
        for kind, target in page.targets(slot):
            if kind in (TREELET, SHORT):
                subtree = own[target]
            elif kind == REMOTE:
                subtree = below.pop(page.remote(target))
            else:
                subtree = packets[target]
            children[slot].append(subtree)
        own[slot] = join(children[slot])
    return own, children


def join(parts):
    lows, highs, counts, points = zip(*parts)
    count = sum(counts)
    kept = np.concatenate(points) if count <= cbvh.TURNING_TRIANGLES else None
    return Subtree(np.min(lows, axis=0), np.max(highs, axis=0), count, kept)


def need_contained(at, what, lo, hi, subtree, margins):
    good = are_wide_enough(lo, hi, subtree.lo, subtree.hi, margins)
    if not good.all():
        slab = int((~good).argmax())
        expected = f"slab {slab} of {what} {margins[slab]} around [{subtree.lo[slab]}, {subtree.hi[slab]}]"
        raise Broken(35, at, expected, f"[{lo[slab]}, {hi[slab]}]")


def turning_slabs_that_hold(page, lo, hi, children):
    """Whether the turning slab of each child that has one contains the triangles below, by slot and child.

    256 n has integer coordinates of at most 9 bits, so its products with f32 numbers are exact in f64. An end is at
    most the exact projection if and only if it is at most the projection rounded down, since ends are f64 numbers. The
    value for a child with too many triangles (R39) has no meaning.
    """
    codes = page.turning_codes()
    ends_lo, ends_hi = (256 * ends.astype(np.float64) for ends in cbvh.decode_turning(codes, lo[..., :3], hi[..., :3]))
    margins = margins_along(cbvh.turning_directions(codes), page.owner.left_out)
    with np.errstate(invalid="ignore"):  # a damaged treelet may decode to anything
        _, ends_lo = exact_sum_outward(ends_lo, margins, np.zeros_like(margins))
        ends_hi, _ = exact_sum_outward(ends_hi, -margins, np.zeros_like(margins))
    found = ((slot, child) for slot in range(page.treelets) for child in range(len(children[slot])))
    holds = {place: False for place in found if codes[place].any()}
    small = [(slot, child) for slot, child in holds if children[slot][child].points is not None]
    if small:
        points = [children[slot][child].points for slot, child in small]
        sizes = [len(part) for part in points]
        places = tuple(np.transpose(small))
        n = np.repeat(cbvh.turning_directions(codes[places]), sizes, axis=0).astype(np.float64)
        down, up = exact_sum_outward(*(n * np.concatenate(points)).T)
        starts = np.cumsum([0, *sizes[:-1]])
        reach_lo, reach_hi = np.minimum.reduceat(down, starts), np.maximum.reduceat(up, starts)
        good = (ends_lo[places] <= reach_lo) & (reach_hi <= ends_hi[places])  # false for NaN
        holds.update(zip(small, good.tolist()))
    return holds


def subtrees_of_packets(page):
    """The subtree of each packet, with projections of offsets rounded outward to f32 (15.5)."""
    corners, used = page.offsets().astype(np.float64), page.lanes_used()
    corners = np.where(used[..., None, None], corners, corners[:, :1])  # the other lanes hold no triangles
    lows, highs = [], []
    for direction in cbvh.DIRECTIONS[: page.layout.slabs]:
        low, high = exact_sum_outward(*(corners[..., axis] * float(direction[axis]) for axis in range(3)))
        lows.append(low.min(axis=(1, 2)))
        highs.append(high.max(axis=(1, 2)))
    lows, highs = round_outward_to_f32(np.stack(lows, axis=1), np.stack(highs, axis=1))
    counts = used.sum(axis=1).tolist()
    if page.layout.turning:
        points = [lanes[:count].reshape(-1, 3) for lanes, count in zip(corners, counts)]
    else:
        points = [np.empty((0, 3))] * page.packets
    return list(map(Subtree, lows, highs, counts, points))


def exact_sum_outward(x, y, z):
    """Returns x + y + z rounded down to f64, and rounded up.

    Two-sums give the sum as three numbers. Each is the rounded sum of itself and the numbers after it. The sign of the
    error of the first one is therefore the sign of the first of the others that is not 0.
    """
    s, e = x + y, error_of_sum(x, y)
    total, f = s + z, error_of_sum(s, z)
    rest, tail = e + f, error_of_sum(e, f)
    first, second = total + rest, error_of_sum(total, rest)
    second, third = second + tail, error_of_sum(second, tail)
    lack = np.where(second != 0, second, third)
    down = np.where(lack < 0, np.nextafter(first, -np.inf), first)
    up = np.where(lack > 0, np.nextafter(first, np.inf), first)
    return down, up
