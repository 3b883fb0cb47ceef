"""Checks the requirements of spec/format.md that have no rule: they bind writers, and readers do not check them.

`violations` yields one line for each violation in a validated file. Numbers in brackets are sections of the
specification.
"""

from fractions import Fraction

import numpy as np

import cbvh
from cbvh import LEAF, LINE, PAGE, REMOTE, SHORT, SORTS, TREELET, WORD, sort_of
from rules import exact_sum_outward, round_outward_to_f32


def violations(file):
    yield from of_header(file)
    yield from of_sections(file)
    yield from of_object_table(file)
    yield from of_instances(file)
    yield from of_topology(file)
    lines = words = 0
    for one in file.objects:
        yield from of_object(one)
        for page in one.pages_read:
            yield from of_page(page)
            yield from of_slabs(page)
            yield from of_leaf_block(page, lines)
            yield from of_id_block(page, words)
            lines += page.leaf_lines
            words += page.id_words
    if file.sections[cbvh.LEAVES].length != LINE * lines:
        yield "(10) the leaf section is longer than its blocks"
    if cbvh.IDS in file.sections and file.sections[cbvh.IDS].length != WORD * words:
        yield "(12) the id section is longer than its blocks"
    yield from of_ids(file)
    yield from of_provenance(file)


def of_header(file):
    if file.header.reserved.any():
        yield "(1.2) nonzero reserved bytes in the header"


def of_sections(file):
    end, kinds = file.head_bytes(), [entry.kind for entry in file.entries]
    for entry in file.entries:
        start = cbvh.aligned(end, cbvh.alignment_of(entry.kind))
        if entry.offset != start or any(file.data[end:start]):
            yield f"(2) section {entry.kind}: expected at byte {start} after zeros, found at {entry.offset}"
        if entry.required != (entry.kind in cbvh.NEEDED):
            yield f"(2.1) section {entry.kind}: required is {entry.required}"
        end = entry.offset + entry.length
    if len(file.data) != cbvh.aligned(end, LINE) or any(file.data[end:]):
        yield "(2) the last section is not followed by zeros up to the next line and then the end of the file"
    if kinds != sorted(kinds):
        yield f"(2.1) order of kinds {kinds}"
    if cbvh.DUPLICATES in kinds and (cbvh.IDS not in kinds or not file.sections[cbvh.DUPLICATES].length):
        yield "(13) a duplicates section that is empty, or without an id section"


def of_object_table(file):
    yield from of_names(file, cbvh.OBJECTS, file.objects, "(3) object")
    for one in file.objects:
        if one.reserved.any() or one.reserved_end.any():
            yield f"(1.2) object {one.number}: nonzero reserved bytes"
        if one.radius == 0 and np.signbit(one.radius):
            yield f"(3.3) object {one.number}: -0"


def of_instances(file):
    if cbvh.INSTANCES not in file.sections:
        return
    yield from of_names(file, cbvh.INSTANCES, file.instances, "(3.1) instance")
    for one in file.instances:
        numbers = np.concatenate([one.rotation, one.translation, [one.margin]])
        if ((numbers == 0) & np.signbit(numbers)).any():
            yield f"(3.1) instance {one.number}: -0"


def of_topology(file):
    if cbvh.TOPOLOGY not in file.sections:
        return
    head = cbvh.Record(cbvh.TOPOLOGY_HEAD, file.data, file.sections[cbvh.TOPOLOGY].offset)
    if head.reserved.any():
        yield "(3.2) nonzero reserved bytes in the head of the topology"
    duplicates = dict(zip(*np.unique(file.duplicates()[:, 0], return_counts=True)))
    for one, topology in zip(file.objects, file.topology):
        where = f"(3.2) object {one.number}"
        if topology.reserved:
            yield f"{where}: nonzero reserved bytes"
        listed = set(topology.component_places().tolist())
        if len(listed) > max(64, one.triangles // 100):
            yield f"{where}: {len(listed)} components listed of {one.triangles} triangles"
        triangle, edge, way = one.traversals()
        least = least_of_components(one.places(), triangle, edge)
        if listed and not least <= listed:
            yield f"{where}: places {least - listed} start components, but are not listed"
        if listed and np.bincount(edge, minlength=1).max() <= 2 and listed != least:
            yield f"{where}: places {listed - least} are listed, but are not the least of components"
        if cbvh.IDS in file.sections:
            # Each duplicate adds 1 to the net or takes 1 away.
            for number, net in zip(one.ids().tolist(), topology.nets_of(one.places()).tolist()):
                count = int(duplicates.get(number, 0))
                if abs(net - 1) > count or (net - 1 - count) % 2:
                    yield f"{where}: triangle {number} with {count} duplicates has the net {net}"


def least_of_components(places, triangle, edge):
    """The least place of each component: all places that no chain of shared edges joins to a lesser one."""
    parent = list(range(len(places)))

    def first(number):
        while parent[number] != number:
            parent[number] = number = parent[parent[number]]
        return number

    order = np.argsort(edge, kind="stable")
    triangle, edge = triangle[order].tolist(), edge[order].tolist()
    for number in range(1, len(edge)):
        if edge[number] == edge[number - 1]:
            a, b = first(triangle[number]), first(triangle[number - 1])
            parent[max(a, b)] = min(a, b)
    return {int(places[number]) for number in range(len(places)) if parent[number] == number}


def of_names(file, kind, records, where):
    """Names are in the order of the records, without gaps, and reserved bytes of the head are zero."""
    head = cbvh.Record(cbvh.TABLES[kind][0], file.data, file.sections[kind].offset)
    end = 0
    for one in records:
        if one.name_offset != end:
            yield f"{where} {one.number}: name at {one.name_offset}, expected at {end}"
        end += one.name_length
    if end != head.names_length or head.reserved.any():
        yield f"{where}s: bytes after the names, or nonzero reserved bytes in the head"


def of_object(one):
    corners, vertices = one.offsets(), one.vertices()
    offsets = corners.reshape(-1, 3)
    where = f"object {one.number}"
    left_out = one.left_out.astype(np.float64)
    down, up = exact_sum_outward(vertices.reshape(-1, 3), -one.origin, -offsets.astype(np.float64))
    greatest = round_outward_to_f32(left_out, np.maximum(-down, up).max(0, initial=0))[1]
    if (one.left_out != greatest).any():
        yield f"(15.1) {where}: left_out {one.left_out}, found {greatest}"
    low, high = (offsets.min(0).astype(np.float64), offsets.max(0).astype(np.float64))
    zeros = np.zeros(3)
    low, high = round_outward_to_f32(
        exact_sum_outward(low, -left_out, zeros)[0], exact_sum_outward(high, left_out, zeros)[1]
    )
    if not np.array_equal(one.box_lo, low) or not np.array_equal(one.box_hi, high):
        yield f"(15.5) {where}: box {one.box_lo} to {one.box_hi}, vertices {low} to {high}"
    numbers = np.concatenate([offsets.ravel(), one.origin, one.box_lo, one.box_hi, one.left_out, [one.scale]])
    if ((numbers == 0) & np.signbit(numbers)).any():
        yield f"(15.1) {where}: -0"
    for axis in range(3):
        is_f32 = (vertices[..., axis].astype(np.float32) == vertices[..., axis]).all()
        if one.triangle_encoding != 2 and is_f32 and (one.origin[axis] or not one.is_sum()[axis]):
            yield f"(15.1) {where}: an origin, a predictor or corrections of f32 numbers on axis {axis}"
    if not sphere_holds(one, offsets):
        yield f"(3) {where}: vertices outside the sphere"
    found = sum(is_flat(triangle) for triangle in vertices[maybe_flat(vertices)])
    if found != one.degenerate:
        yield f"(15.3) {where}: degenerate is {one.degenerate}, found {found}"
    if one.triangle_encoding != 2 and one.max_quantization_error != 0:
        yield f"(15.2) {where}: max_quantization_error {one.max_quantization_error}"
    if one.triangle_encoding != 2 and one.max_vertex_rounding > 2.0**-180:
        yield f"(15.1) {where}: max_vertex_rounding {one.max_vertex_rounding}"
    if one.convex and not is_convex(one, vertices):
        yield f"(15.6) {where}: not closed, not in one component, or a vertex beyond a triangle of a convex object"


def is_convex(one, triangles):
    """Decides exactly whether an object is convex. Slow: for small objects."""
    triangle, edge, way = one.traversals()
    sums = np.zeros(edge.max(initial=-1) + 1, int)
    np.add.at(sums, edge, way)
    if sums.any() and not one.duplicates or len(least_of_components(one.places(), triangle, edge)) > 1:
        return False
    points = [[Fraction(value) for value in point] for point in np.unique(triangles.reshape(-1, 3), axis=0).tolist()]
    for p, q, r in triangles.tolist():
        u, v = ([Fraction(end) - Fraction(start) for end, start in zip(corner, p)] for corner in (q, r))
        normal = [u[i] * v[j] - u[j] * v[i] for i, j in ((1, 2), (2, 0), (0, 1))]
        height = sum(n * Fraction(c) for n, c in zip(normal, p))
        if any(sum(n * c for n, c in zip(normal, point)) > height for point in points):
            return False
    return True


def sphere_holds(one, offsets):
    """Decides exactly, for those offsets whose squared distance in f64 is within a millionth of the greatest."""
    squares = ((np.abs(offsets.astype(np.float64) - one.sphere_centre) + one.left_out) ** 2).sum(1)
    centre, radius = [Fraction(float(c)) for c in one.sphere_centre], Fraction(one.sphere_radius)
    left_out = [Fraction(float(most)) for most in one.left_out]
    far = np.unique(offsets[squares >= squares.max() * (1 - 1e-6)], axis=0)
    return all(
        sum((abs(Fraction(float(v[a])) - centre[a]) + left_out[a]) ** 2 for a in range(3)) <= radius**2 for v in far
    )


def maybe_flat(corners):
    """True for triangles whose normal may be 0, as far as f64 can tell.

    Differences are rounded once, products once, and a coordinate of the normal is one more difference. That
    makes 4 roundings of the magnitudes; a bound of 8 also covers the rounding of the magnitudes. The constant covers
    underflow.
    """
    u, v = (corners[:, i] - corners[:, 0] for i in (1, 2))
    sizes = np.abs(u[:, [1, 2, 0]] * v[:, [2, 0, 1]]) + np.abs(u[:, [2, 0, 1]] * v[:, [1, 2, 0]])
    return (np.abs(np.cross(u, v)) <= 8 * 2.0**-53 * sizes + 2.0**-1060).all(axis=1)


def is_flat(triangle):
    p, q, r = ([Fraction(float(value)) for value in corner] for corner in triangle)
    u, v = ([end - start for end, start in zip(corner, p)] for corner in (q, r))
    return all(u[i] * v[j] == u[j] * v[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def of_page(page):
    """Bytes to which no table gives a meaning are zero, and unused fields are as sections 6, 7.2 and 10 require."""
    layout, where = page.layout, f"page {page.number}"
    used = np.zeros(PAGE, bool)
    used[:LINE] = True
    for root in range(page.roots):
        at = page.anchor_at(root) - page.at
        used[at : at + 8 * layout.slabs] = True
        used[page.parent_at(root) - page.at :][:5] = True
    used[page.remote_at(0) - page.at :][: 4 * page.remotes] = True
    for slot in range(page.treelets):
        at = page.treelet_at(slot) - page.at
        used[at + places_of_code_bytes(page, slot)] = True
        for first in layout.turning:
            used[at + first :][: page.children(slot)] = True
        used[page.kinds_at(slot) - page.at :][:4] = True
        used[page.links_at(slot) - page.at :][:4] = True
    if np.frombuffer(page.data, "u1", PAGE, page.at)[~used].any():
        yield f"(1.2) {where}: bytes without meaning are not zero"
    counters = {TREELET: page.roots, SHORT: page.first_short, REMOTE: 0, LEAF: 0}
    for slot in range(page.treelets):
        links = page.links(slot)
        if any(first != counters[sort] for sort, first in links.items()):
            yield f"(7.2) {where}, slot {slot}: a link without children is not the counter"
        for kind, _ in page.targets(slot):
            counters[sort_of(kind)] += 1
        if page.is_short(slot) and bits_beside_first_leaf(page, slot):
            yield f"(7.5) {where}, slot {slot}: bits that belong neither to the kinds nor to first_leaf are not zero"
    if page.id_words == 0 and (page.id_word or page.id_checksum):
        yield f"(6) {where}: id fields without ids"
    if page.packets == 0 and page.leaf_lines:
        yield f"(10) {where}: leaf lines without packets"


def places_of_code_bytes(page, slot):
    """The offsets in a treelet of all bytes that hold codes of children."""
    layout, present = page.layout, page.children(slot)
    if page.is_short(slot):
        return cbvh.places_of_short_codes(layout)[:present].ravel()
    lo = cbvh.places_of_codes(layout)[:present].ravel()
    return np.concatenate([end + byte for end in (lo, lo + layout.hi) for byte in range(layout.code_bytes)])


def bits_beside_first_leaf(page, slot):
    """The bits of the number at *links at* of a short treelet that belong neither to the kinds nor to `first_leaf`."""
    at, short = page.links_at(slot), page.layout.short
    first = short.kinds_bits if short.kinds_at == short.links_at else 0
    return cbvh.bits_of(int.from_bytes(page.data[at : at + 4], "little"), first, cbvh.LINKS[SORTS[LEAF]][0])


def of_slabs(page):
    """(8) Decoded slabs are ordered and below 2^122, and those decoded from residuals lie within the treelet's. A
    turning slab's ends are ordered and below 2^122 too, and its direction has codes of at most 254 (7.4).
    """
    own_lo, own_hi, lo, hi = page.decode()
    codes = page.turning_codes()
    turning_lo, turning_hi = cbvh.decode_turning(codes, lo[..., :3], hi[..., :3])
    for slot in range(page.treelets):
        present = page.children(slot)
        child_lo, child_hi = lo[slot, :present], hi[slot, :present]
        good = (child_lo <= child_hi) & (-(2.0**122) < child_lo) & (child_hi < 2.0**122)
        if page.layout.encoding != "f32":
            good &= (own_lo[slot] <= child_lo) & (child_hi <= own_hi[slot])
        if not good.all():
            yield f"(8) page {page.number}, slot {slot}: slabs out of order, or outside those of the treelet"
        there = codes[slot, :present].any(axis=1)
        ends_lo, ends_hi = turning_lo[slot, :present][there], turning_hi[slot, :present][there]
        if not ((ends_lo <= ends_hi) & (-(2.0**122) < ends_lo) & (ends_hi < 2.0**122)).all():
            yield f"(8) page {page.number}, slot {slot}: a turning slab out of order, or not below 2^122"
        if (codes[slot, :present, 2:] > 254).any():
            yield f"(7.4) page {page.number}, slot {slot}: a code of a turning slab's direction above 254"


def of_leaf_block(page, lines):
    if page.packets == 0:
        return
    where = f"(11) page {page.number}"
    if page.leaf_line != lines:
        yield f"(10) page {page.number}: leaf block at line {page.leaf_line}, expected {lines}"
    used = page.lanes_used()
    # The bits of the offsets and the corrections of each corner
    lanes = page.offsets().view(np.uint32).astype(np.int64)
    if page.is_corrected():
        lanes = np.concatenate([lanes, page.corrections()], axis=3)
        yield from of_corrections(page)
    last = used.sum(axis=1) - 1
    if (lanes != lanes[np.arange(page.packets), last][:, None])[~used].any():
        yield f"(10) page {page.number}: lanes after the last triangle do not repeat it"
    block = page.leaf_block()
    block = block[: cbvh.aligned(page.packet_bytes(), LINE)]
    if not page.is_packed():
        if any(block[page.packet_bytes() :]):
            yield f"{where}: bytes after the packets are not zero"
        return
    head = page.packed_head()
    starts = [cbvh.PACKED_HEAD_BYTES, head.further_at, head.pool_at, len(block)]
    for start, end, bits in zip(starts, starts[1:], page.packed_arrays(head)):
        if int.from_bytes(block[start:end], "little") >> bits:
            yield f"{where}: bits after an array are not zero"
    points = (lanes == lanes[:, :, :1]).all()
    if points != cbvh.has_points(head):
        yield f"{where}: a block of points exactly where all triangles are points"
    pattern, _, held = page.packed_records(head)
    if not cbvh.has_points(head) and held[np.arange(cbvh.RECORD_SLOTS) >= cbvh.slots_of(pattern)[:, None]].any():
        yield f"{where}: slots of a record that its pattern lacks are not zero"
    for axis, kind in enumerate(cbvh.kinds_of_axes(head)):
        exact = page.packed_numbers(head)[:, axis] * 2.0 ** int(head.exponent[axis])
        if kind == cbvh.BINARY and (exact != page.packed_pool(head)[:, axis]).any():
            yield f"{where}: binary coordinates of axis {axis} are rounded"


def of_corrections(page):
    """Zeros in the head and behind lists and arrays of corrections (1.2, 11.3)."""
    head, where = page.corrections_head(), f"(11.3) page {page.number}"
    if head.reserved or (head.bits[head.counts == 0] != 0).any() or (head.base[head.counts == 0] != 0).any():
        yield f"{where}: nonzero bytes without meaning in the head of the corrections"
    block = page.leaf_block()[page.corrections_at() - page.leaf_block_at() :]
    places = page.correction_places(head)[3:]
    for count, width, start, end in zip(head.counts.tolist(), head.bits.tolist(), places, [*places[1:3], len(block)]):
        if int.from_bytes(block[start:end], "little") >> count * width:
            yield f"{where}: bits after an array of corrections are not zero"


def of_id_block(page, words):
    if page.id_words == 0:
        return
    where = f"(12) page {page.number}"
    if page.id_word != words:
        yield f"{where}: id block at word {page.id_word}, expected {words}"
    table, widths, bits = page.id_groups()
    block = page.id_block()
    for group, end in enumerate(bits[:, -1].tolist()):
        start = end // 8
        behind = block[start : [*table["start"].tolist(), len(block)][group + 1]]
        if int.from_bytes(behind, "little") >> end % 8:
            yield f"{where}: nonzero bits after group {group}"
    if widths[:, 1:].ravel()[page.packets :].any():
        yield f"{where}: nonzero widths of packets that the last group does not have"
    (least, lane, _), ids, used = page.id_packets(), page.ids(), page.lanes_used()
    if not used[np.arange(page.packets), lane].all():
        yield f"{where}: a least id of a lane after the last triangle"
    if (ids < least[:, None])[used].any():
        yield f"{where}: an id below the least id of its packet"
    if (ids != least[:, None])[~used].any():
        yield f"{where}: nonzero offsets of lanes after the last triangle"


def of_ids(file):
    if cbvh.IDS not in file.sections:
        return
    ids = np.concatenate([one.ids() for one in file.objects])
    kept, dropped = file.duplicates().T
    if len(np.unique(np.concatenate([ids, dropped]))) != len(ids) + len(dropped):
        yield "(12, 13) ids occur twice"
    if not np.isin(kept, ids).all():
        yield "(13) the first id of a pair is not stored"
    if len(dropped) != sum(one.duplicates for one in file.objects):
        yield f"(13) {len(dropped)} duplicates listed, but the records state a different number"
    inputs = {one.input_triangles for one in file.objects}
    if len(inputs) > 1 or (dropped >= min(inputs)).any():
        yield "(12, 13) an id that is not below the input's number of triangles, or objects of different inputs"


def of_provenance(file):
    text = file.bytes_of(cbvh.PROVENANCE)
    try:
        lines = text.decode("utf-8").split("\n")
    except UnicodeDecodeError:
        yield "(14) provenance is not UTF-8"
        return
    keys = [line.split("=", 1)[0] for line in lines[:-1]]
    if lines[-1] or len(set(keys)) != len(keys) or any("=" not in line for line in lines[:-1]):
        yield "(14) provenance: a line without a line feed or a key, or a key that occurs twice"
