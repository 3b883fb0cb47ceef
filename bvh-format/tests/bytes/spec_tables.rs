//! Checks that the tables of the specification say what the code does. Each is read from the Markdown and compared.
//!
//! A table is found by the comment `<!-- table: name -->` before it. Byte tables must name every field of their
//! structure, in order and without gaps.

use bvh_format::Rule;
use bvh_format::checksum::checksum;
use bvh_format::header::{
    Header, MAGIC, MAJOR, MAX_SECTIONS, MINOR, SectionEntry, SectionKind, version_name,
};
use bvh_format::ids::{ID_ENTRY_BYTES, ID_GROUP, ID_GROUP_HEAD_BITS, WORD, decode_id};
use bvh_format::instances::{Instance, InstanceRecord, MAX_RIGID_ERROR, MAX_WORLD, write_instances};
use bvh_format::kdop::{DIRECTIONS, Kdop};
use bvh_format::leaf::{
    CORRECTIONS_HEAD_BYTES, Corrections, F32_PACKET_BYTES, LINE, PACKED_HEAD_BYTES, PACKET, PATTERNS,
    PackedHead, RECORD_HEAD_BITS, TriangleEncoding, decode_packet,
};
use bvh_format::object::{MAX_COORDINATE, MAX_RADIUS, ObjectRecord, write_objects};
use bvh_format::page::decode::decode_child;
use bvh_format::page::{NO_PARENT, PAGE, PAGE_HEADER_BYTES, PageHeader, PageShape, PageWriter, TightBound};
use bvh_format::profile::{Encoding, Profile};
use bvh_format::quantize::{STEP_U4, STEP_U8, residual_unit};
use bvh_format::slabs::NodeSlabs;
use bvh_format::source::MAX_BLOCK_BYTES;
use bvh_format::topology::{Net, TopologyRecord, write_topology_head};
use bvh_format::treelet::{Child, Links, SHORT_CODES, SHORT_TREELET_BYTES};
use bvh_format::turning::{MAX_TRIANGLES, TurningDirection, decode_turning};
use bvh_format::vertex::{LEAST_UNIT, MAX_DECIMALS, MAX_SIGNIFICANT, Predictor, Vertices};
use std::any::type_name_of_val;
use std::mem::offset_of;
use zerocopy::FromZeros;

fn specification(file: &str) -> String {
    let path = format!("{}/../spec/{file}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Returns the rows of a table without its heading. Cells lose the backquotes around them.
fn table(file: &str, name: &str) -> Vec<Vec<String>> {
    let text = specification(file);
    let marker = format!("<!-- table: {name} -->");
    assert_eq!(text.matches(&marker).count(), 1, "{marker}");
    let lines = text.lines().skip_while(|line| *line != marker).skip(1);
    let cells = |line: &str| -> Vec<String> {
        let line = line.trim().trim_start_matches('|').trim_end_matches('|');
        line.split('|').map(|cell| cell.trim().trim_matches('`').to_owned()).collect()
    };
    let rows: Vec<_> = lines.take_while(|line| line.starts_with('|')).map(cells).collect();
    assert!(rows.len() > 2 && rows.iter().all(|row| row.len() == rows[0].len()), "{marker}: ragged");
    rows[2..].to_vec()
}

/// Reads a number such as `12` or `0xff`. Text after a space is for people and is ignored.
fn number(cell: &str) -> u64 {
    let cell = cell.split(' ').next().unwrap_or_default();
    let (digits, radix) = cell.strip_prefix("0x").map_or((cell, 10), |hex| (hex, 16));
    u64::from_str_radix(digits, radix).unwrap_or_else(|_| panic!("not a number: {cell}"))
}

/// Returns a byte table as (offset, size, type, field), after checking that it has no gaps and that each size is that
/// of its type.
fn byte_table(name: &str, total: usize) -> Vec<(usize, usize, String, String)> {
    let mut next = 0;
    let rows = table("format.md", name).into_iter().map(|row| {
        let (offset, size) = (number(&row[0]) as usize, number(&row[1]) as usize);
        let (base, count) = match row[2].split_once('[') {
            Some((base, count)) => (base, number(count.trim_end_matches(']')) as usize),
            None => (row[2].as_str(), 1),
        };
        assert!(
            ["u8", "u16", "u32", "u64", "i8", "i32", "i64", "f32", "f64"].contains(&base),
            "{name}: type {base}"
        );
        assert_eq!(offset, next, "{name}: gap or overlap before {}", row[3]);
        assert_eq!(size, count * number(&base[1..]) as usize / 8, "{name}: size of {}", row[3]);
        next += size;
        (offset, size, base.to_owned(), row[3].clone())
    });
    let rows = rows.collect();
    assert_eq!(next, total, "{name}: size");
    rows
}

/// Compares a byte table with a structure. If the list leaves out a field, the test does not compile.
macro_rules! compare {
    ($structure:ident: $($field:ident),*) => {{
        let $structure { $($field),* } = &$structure::new_zeroed();
        let fields = [$((
            offset_of!($structure, $field), size_of_val($field), type_name_of_val($field), stringify!($field)
        )),*];
        let rows = byte_table(stringify!($structure), size_of::<$structure>());
        assert_eq!(rows.len(), fields.len(), "fields of {}", stringify!($structure));
        for (row, field) in rows.iter().zip(fields) {
            assert_eq!((row.0, row.1, row.3.as_str()), (field.0, field.1, field.3));
            let kind = field.2.to_lowercase();
            assert!(kind.contains(&row.2), "type of {}: {} is not {}", field.3, kind, row.2);
        }
    }};
}

#[test]
fn structures() {
    compare!(Header: magic, major, minor, sections, file_length, content_checksum, header_checksum, reserved);
    compare!(SectionEntry: kind, required, offset, length, checksum);
    compare!(ObjectRecord: name_offset, name_length, origin, box_lo, box_hi, triangles, packets, treelets,
        first_page, pages, max_vertex_rounding, max_quantization_error, input_triangles, degenerate,
        duplicates, f16_exponent, profile, triangle_encoding, reserved, sphere_centre, sphere_radius,
        radius, solid, predictors, digits, corrected, left_out, scale, convex, reserved_end);
    compare!(InstanceRecord: name_offset, name_length, object, member, meets, solid, margin, rotation,
        translation);
    compare!(TopologyRecord: closed, components, nets, reserved);
    compare!(Net: place, net);
    compare!(PageHeader: checksum, leaf_checksum, id_checksum, leaf_line, id_word, first_packet,
        page_number, leaf_lines, id_words, packets, roots, treelets, remotes, treelet_line, profile,
        short);
}

#[test]
fn heads_of_blocks() {
    let offset = |rows: &[(usize, usize, String, String)], field: &str| {
        rows.iter().find(|row| row.3 == field).unwrap_or_else(|| panic!("no field {field}")).0
    };

    let rows = byte_table("object-head", write_objects(&[]).len());
    let section = write_objects(&[("name".into(), ObjectRecord::new_zeroed())]);
    assert_eq!([section[offset(&rows, "objects")], section[offset(&rows, "names_length")]], [1, 4]);

    let rows = byte_table("instance-head", write_instances(&[]).len());
    let section = write_instances(&[Instance { name: "name".into(), ..Instance::of_object(0) }]);
    assert_eq!([section[offset(&rows, "instances")], section[offset(&rows, "names_length")]], [1, 4]);

    let rows = byte_table("topology-head", write_topology_head(&[]).len());
    let record = TopologyRecord { components: 2.into(), nets: 3.into(), ..TopologyRecord::new_zeroed() };
    let section = write_topology_head(&[record]);
    assert_eq!(["objects", "components", "nets"].map(|field| section[offset(&rows, field)]), [1, 2, 3]);

    // All bytes differ, so that each value is known by its first byte.
    let bytes: Vec<u8> = (1..=PACKED_HEAD_BYTES as u8).collect();
    let head = PackedHead::read(&bytes).unwrap();
    macro_rules! fields {
        ($($field:ident $first:expr),*) => {
            [$((stringify!($field), type_name_of_val(&head.$field), $first as u8)),*]
        };
    }
    let fields = fields![vertices head.vertices, further head.further, index_bits head.index_bits,
        bits head.bits[0], base head.base[0], kinds head.kinds, exponent head.exponent[0],
        further_at head.further_at, pool_at head.pool_at];
    let rows = byte_table("PackedHead", PACKED_HEAD_BYTES);
    let named: Vec<_> = rows.iter().filter(|row| !row.3.starts_with("reserved")).collect();
    assert_eq!(named.len(), fields.len());
    for (row, (name, kind, first)) in named.into_iter().zip(fields) {
        assert_eq!((row.3.as_str(), bytes[row.0]), (name, first));
        assert!(kind.contains(&row.2), "type of {name}: {kind} is not {}", row.2);
    }

    let bytes: Vec<u8> = (1..=CORRECTIONS_HEAD_BYTES as u8).collect();
    let head = Corrections::read(&bytes).unwrap();
    let rows = byte_table("Corrections", CORRECTIONS_HEAD_BYTES);
    let fields = [("counts", head.counts[0] as u8), ("bits", head.bits[0]), ("base", head.base[0] as u8)];
    let named: Vec<_> = rows.iter().filter(|row| row.3 != "reserved").collect();
    assert_eq!(named.len(), fields.len());
    for (row, (name, first)) in named.into_iter().zip(fields) {
        assert_eq!((row.3.as_str(), bytes[row.0]), (name, first));
    }

    // One group of two packets, whose widths are 6 for least ids and 9 for the offsets of the second packet.
    let rows = byte_table("id-entry", ID_ENTRY_BYTES);
    let mut block = vec![0; ID_ENTRY_BYTES];
    (block[offset(&rows, "base")], block[offset(&rows, "start")]) = (100, ID_ENTRY_BYTES as u8);
    let second = ID_GROUP_HEAD_BITS + 6 + 2;
    let group = 6 | 9 << (6 + 6) | 40 << second | 2 << (second + 6) | 511u128 << (second + 8 + 9);
    block.extend(group.to_le_bytes());
    let ids = |packet: usize| [0, 1, 2, 3].map(|lane| decode_id(&block, packet, lane));
    assert_eq!((ids(0), ids(1)), ([100; 4], [140, 651, 140, 140]));

    let links = Links { kinds: 0, first_treelet: 101, first_short: 102, first_remote: 203, first_leaf: 904 };
    let mut treelet = [0; 64];
    links.write(Profile::Dop14U8, &mut treelet);
    let (word, mut next) = (u32::from_le_bytes(*treelet.last_chunk().unwrap()), 0);
    for row in table("format.md", "links") {
        let (start, end) = row[0].split_once("..").unwrap();
        let (start, end) = (number(start), number(end));
        assert_eq!(start, next, "{}", row[1]);
        next = end;
        let held = match row[1].as_str() {
            "first_treelet" => links.first_treelet.into(),
            "first_short" => links.first_short.into(),
            "first_remote" => links.first_remote.into(),
            "first_leaf" => links.first_leaf,
            other => panic!("no field {other} in the links"),
        };
        assert_eq!(u64::from(word) >> start & ((1 << (end - start)) - 1), held.into(), "{}", row[1]);
    }
    assert_eq!(next, 32);
}

#[test]
fn anchors() {
    let slabs = Kdop { lo: [1; 13].map(f32::from_bits), hi: [2; 13].map(f32::from_bits) };
    for (column, profile) in [(2, Profile::Dop6U8), (3, Profile::Dop14U8), (4, Profile::Dop26U8Wide)] {
        let mut writer =
            PageWriter::new(profile, 1.0, PageShape { roots: 1, treelets: 1, ..PageShape::default() });
        writer.root(&slabs, Some((3, 4)));
        writer.begin_treelet();
        writer.leaf(&TightBound::of_kdop(slabs), std::iter::once(([[0.0; 3]; 3], 0)));
        let page = writer.finish(TriangleEncoding::F32, &Vertices::around([0.0; 3]), false).bytes;
        let anchor = &page[PAGE_HEADER_BYTES..PAGE_HEADER_BYTES + profile.anchor_bytes()];
        let mut next = 0;
        for row in table("format.md", "anchor") {
            let (start, end) = row[column].split_once("..").unwrap();
            let (start, end) = (number(start) as usize, number(end) as usize);
            assert_eq!(start, next, "{}", row[0]);
            next = end;
            let place = &anchor[start..end];
            match row[0].as_str() {
                "lo" | "hi" => {
                    let value = if row[0] == "lo" { 1u32 } else { 2 };
                    assert_eq!(place, value.to_le_bytes().repeat(profile.directions().slabs()));
                }
                "parent_page" => assert_eq!(place, 3u32.to_le_bytes()),
                "parent_link" => assert_eq!(place, [4]),
                "gap" | "reserved" => assert!(place.iter().all(|&byte| byte == 0)),
                other => panic!("no field {other} in an anchor"),
            }
        }
        assert_eq!(next, anchor.len());
    }
}

#[test]
fn lists() {
    let rows = |name: &str, columns: usize| -> Vec<String> {
        table("format.md", name).iter().map(|row| row[..columns].join("|")).collect()
    };
    let yes = |yes| if yes { "yes" } else { "no" };
    let sections = SectionKind::ALL.map(|kind| {
        format!("{}|{}|{}|{}", kind as u32, kind.name(), yes(kind.required()), yes(kind.is_content()))
    });
    assert_eq!(rows("sections", 4), sections);

    let profiles = Profile::ALL.map(|p| {
        let (slabs, encoding) = (p.directions().slabs(), format!("{:?}", p.encoding()).to_lowercase());
        let head = format!("{}|{}|{}|{slabs}|{encoding}", p.number(), p.name(), 2 * slabs);
        let tail = [p.has_turning_slabs(), p.has_short_treelets()].map(yes).join("|");
        format!("{head}|{}|{}|{}|{tail}", p.width(), p.treelet_bytes(), p.anchor_bytes())
    });
    assert_eq!(rows("profiles", 10), profiles);
    let codes = (0..).zip(SHORT_CODES).map(|(nibble, code)| format!("{nibble}|{code}"));
    assert_eq!(rows("short-codes", 2), codes.collect::<Vec<_>>());

    let numbered = (0..).zip(DIRECTIONS);
    let directions =
        numbered.map(|(slab, [x, y, z])| format!("{slab}|{}|{x}|{y}|{z}", bvh_format::slabs::row(slab)));
    assert_eq!(rows("directions", 5), directions.collect::<Vec<_>>());

    let rules = Rule::ALL.iter().map(|rule| format!("R{:02}|{}", rule.number(), rule.text()));
    assert_eq!(rows("rules", 2), rules.collect::<Vec<_>>());

    let encodings = TriangleEncoding::ALL.map(|encoding| format!("{}|{}", encoding as u8, encoding.name()));
    assert_eq!(rows("triangle-encodings", 2), encodings);

    for row in table("format.md", "predictors") {
        let (least, most) = row[2].split_once(" to ").unwrap_or((&row[2], &row[2]));
        let (number, stated) = (number(&row[0]) as u8, number(least) as u8..=number(most) as u8);
        for digits in 0..=u8::MAX {
            let found = Predictor::from_parts(number, digits);
            assert_eq!(found.is_some(), stated.contains(&digits), "{}: {digits}", row[1]);
            let Some(found) = found else { continue };
            assert!(format!("{found:?}").to_lowercase().starts_with(&row[1]));
            assert_eq!((found.parts(), found.needs_no_origin()), ((number, digits), row[3] == "0"));
        }
    }
    assert!(Predictor::from_parts(table("format.md", "predictors").len() as u8, 0).is_none());

    assert_eq!(table("versions.md", "versions").pop().unwrap()[0], version_name((MAJOR, MINOR)));
}

macro_rules! named {
    ($($constant:ident),*) => { [$((stringify!($constant), $constant as u64)),*] };
}

#[test]
fn constants() {
    const LOG2_MAX_COORDINATE: i32 = 120;
    const TURNING_TRIANGLES: usize = MAX_TRIANGLES;
    const LOG2_MAX_WORLD: i32 = 118;
    const LOG2_MAX_RADIUS: i32 = 118;
    const RIGID_BITS: i32 = 23;
    const LEAST_UNIT_BITS: i32 = 180;
    assert_eq!(2f64.powi(-LEAST_UNIT_BITS), LEAST_UNIT);
    assert_eq!(2f64.powi(LOG2_MAX_COORDINATE), MAX_COORDINATE);
    assert_eq!(2f64.powi(LOG2_MAX_RADIUS), MAX_RADIUS);
    assert_eq!((2f64.powi(LOG2_MAX_WORLD), 2f64.powi(-RIGID_BITS)), (MAX_WORLD, MAX_RIGID_ERROR));
    let mut expected = named![
        PAGE,
        LINE,
        WORD,
        MAJOR,
        MINOR,
        MAX_SECTIONS,
        PAGE_HEADER_BYTES,
        SHORT_TREELET_BYTES,
        NO_PARENT,
        PACKET,
        F32_PACKET_BYTES,
        PACKED_HEAD_BYTES,
        RECORD_HEAD_BITS,
        PATTERNS,
        CORRECTIONS_HEAD_BYTES,
        MAX_BLOCK_BYTES,
        ID_GROUP,
        ID_ENTRY_BYTES,
        ID_GROUP_HEAD_BITS,
        LOG2_MAX_COORDINATE,
        LEAST_UNIT_BITS,
        MAX_SIGNIFICANT,
        MAX_DECIMALS,
        TURNING_TRIANGLES,
        LOG2_MAX_WORLD,
        LOG2_MAX_RADIUS,
        RIGID_BITS
    ]
    .to_vec();
    let steps = [("STEP_U8", STEP_U8), ("STEP_U4", STEP_U4)];
    expected.extend(steps.map(|(name, step)| (name, step.to_bits().into())));
    let rows = table("format.md", "constants");
    let found: Vec<_> = rows.iter().map(|row| (row[0].as_str(), number(&row[1]))).collect();
    assert_eq!(found, expected);

    let text = specification("format.md");
    let magic = MAGIC.map(|byte| format!("{byte:02x}")).join(" ");
    assert_eq!(text.matches(&magic).count(), 2);
    assert!(text.contains(&format!("`{:#018x}`", checksum(&[]))));
}

/// Decodes a packet of each pattern, in a block whose slots are the vertices of their numbers.
#[test]
fn patterns() {
    let rows = table("format.md", "patterns");
    for (first, row) in (0..).step_by(4).zip(&rows) {
        assert_eq!(number(&row[0]), first);
    }
    let patterns: Vec<&str> = rows.iter().flat_map(|row| row[1].split(' ')).collect();
    assert_eq!(patterns.len(), PATTERNS);
    for (number, pattern) in patterns.into_iter().enumerate() {
        let digits: Vec<u8> = pattern.chars().map(|digit| digit.to_digit(16).unwrap() as u8).collect();
        let slots = usize::from(*digits.iter().max().unwrap()) + 1;
        // Vertex v is (v, 0, 0). The record takes 14 + 6 * 4 bits, and the seven further slots 28.
        let mut record = number as u64;
        for slot in 0..6 {
            // The number of the first further slot is 0, if there are any.
            let held = if slot < slots.min(5) || slots == 6 { slot as u64 } else { 0 };
            record |= held << (RECORD_HEAD_BITS + 4 * slot);
        }
        let further = (0..7).fold(0u32, |bits, slot| bits | (5 + slot) << (4 * slot));
        let pool = (0..12).fold(0u64, |bits, vertex| bits | vertex << (4 * vertex));
        let mut block = vec![12, 0, 7, 0, 4, 4, 0, 0];
        block.extend([0; 12]);
        block.extend([0b01_01_01, 0, 0, 0, 37, 0, 0, 0, 41, 0, 0, 0]);
        block.extend(&record.to_le_bytes()[..5]);
        block.extend(further.to_le_bytes());
        block.extend(&pool.to_le_bytes()[..6]);
        block.extend([0; 8]);
        let packet = decode_packet(TriangleEncoding::Packed, &block, 0);
        for (place, digit) in digits.into_iter().enumerate() {
            let corner = packet.triangle(place / 3)[place % 3];
            assert_eq!(corner, [f32::from(digit), 0.0, 0.0], "{pattern}");
        }
    }
}

/// Writes one code at the place that the table states, and expects that exactly one end of one child changes.
#[test]
fn places_of_codes() {
    let rows = table("format.md", "places");
    assert_eq!(rows.len(), Profile::ALL.len());
    for row in rows {
        let profile = Profile::from_name(&row[0]).unwrap_or_else(|| panic!("no profile {}", row[0]));
        let strides = [1, 2, 3, 4, 5, 6, 7].map(|column| number(&row[column]) as usize);
        let [bytes, block, row_stride, child_stride, hi, kinds, links] = strides;
        let (slabs, width) = (profile.directions().slabs(), profile.width());
        let parent = NodeSlabs { lo: [-1.0; 16], hi: [2.0; 16] };
        let decode = |treelet: &[u8]| -> Vec<f32> {
            let child = |c| decode_child(profile, 1.0, treelet, c, &parent).to_kdop(slabs);
            let ends = |kdop: Kdop| (0..slabs).flat_map(move |slab| [kdop.lo[slab], kdop.hi[slab]]);
            (0..width).flat_map(|c| ends(child(c))).collect()
        };
        let code: [&[u8]; 2] = match profile.encoding() {
            Encoding::U4 => [&[1], &[0x10]],
            Encoding::U8 => [&[1]; 2],
            Encoding::F16 => [&[0, 0x3c]; 2],
            Encoding::F32 => [&[0, 0, 0x80, 0x3f]; 2],
        };
        assert_eq!(code[0].len(), bytes, "{}: code bytes", profile.name());
        let zero = vec![0; profile.treelet_bytes()];
        let before = decode(&zero);
        for place in 0..width * slabs * 2 {
            let (child, slab, end) = (place / 2 / slabs, place / 2 % slabs, place % 2);
            let at =
                block * (child / 4) + row_stride * bvh_format::slabs::row(slab) + child_stride * (child % 4);
            let mut treelet = zero.clone();
            treelet[at + end * hi..][..bytes].copy_from_slice(code[end]);
            let after = decode(&treelet);
            let changed: Vec<_> = (0..before.len()).filter(|&i| after[i] != before[i]).collect();
            assert_eq!(changed, [place], "{}: child {child}, slab {slab}", profile.name());
        }
        let mut treelet = zero.clone();
        (treelet[kinds], treelet[links]) = (1, 9);
        assert_eq!(Links::read(profile, &treelet).child(0), Child::Treelet(9), "{}", profile.name());
    }
}

/// Writes each code of a short treelet at the place that the table states, and expects that end and no other to move.
#[test]
fn places_in_short_treelets() {
    let rows = table("format.md", "short-places");
    let with = Profile::ALL.into_iter().filter(|profile| profile.has_short_treelets());
    assert!(rows.iter().map(|row| row[0].as_str()).eq(with.map(Profile::name)));
    for row in rows {
        let profile = Profile::from_name(&row[0]).unwrap();
        let [block, kinds, kinds_bits, links] = [1, 2, 3, 4].map(|column| number(&row[column]) as usize);
        let (slabs, width) = (profile.directions().slabs(), profile.width());
        let parent = NodeSlabs { lo: [0.0; 16], hi: [255.0; 16] };
        for (child, slab, end) in
            (0..width).flat_map(|c| (0..slabs).flat_map(move |s| [(c, s, 0), (c, s, 1)]))
        {
            let mut treelet = [0; SHORT_TREELET_BYTES];
            treelet[block * (child / 4) + 4 * slab + child % 4] = 3 << (4 * end);
            for other in 0..width {
                let kdop = decode_child(profile, 1.0, &treelet, other, &parent).to_kdop(slabs);
                for at in 0..slabs {
                    // The step is a little more than 1.
                    let moved = [kdop.lo[at], 255.0 - kdop.hi[at]].map(f32::floor);
                    let code = |of: usize| if (other, at, of) == (child, slab, end) { 32.0 } else { 0.0 };
                    assert_eq!(moved, [code(0), code(1)], "{}: child {child}, slab {slab}", profile.name());
                }
            }
        }
        let mut treelet = [0; SHORT_TREELET_BYTES];
        treelet[kinds + kinds_bits / 8 - 1] = 5 << 4;
        treelet[links + 3] = 200;
        let found = Links::read(profile, &treelet).child(width - 1);
        assert_eq!(found, Child::Leaf { packet: 800, triangles: 2 }, "{}", profile.name());
    }
}

/// Writes the four bytes of one child at the places that the table states, and expects its turning slab and no other.
#[test]
fn places_of_turning_slabs() {
    let rows = table("format.md", "turning");
    let with = Profile::ALL.into_iter().filter(|profile| profile.has_turning_slabs());
    assert!(rows.iter().map(|row| row[0].as_str()).eq(with.map(Profile::name)));
    for row in rows {
        let profile = Profile::from_name(&row[0]).unwrap();
        for child in 0..profile.width() {
            let mut treelet = vec![0; profile.treelet_bytes()];
            let node = NodeSlabs { lo: [-1.0; 16], hi: [1.0; 16] };
            for (column, code) in (1..).zip([51, 102, 127 + 20, 127 - 100]) {
                let (at, c) = row[column].split_once(" + ").unwrap();
                assert_eq!(c, "c");
                treelet[number(at) as usize + child] = code;
            }
            for other in 0..profile.width() {
                let slab = decode_turning(profile, &treelet, other, &node);
                assert_eq!(slab.is_some(), other == child, "child {other}");
                let Some(slab) = slab else { continue };
                assert_eq!(slab.direction, TurningDirection { a: 147, b: 27 });
                let n = [-80.0, 120.0, 54.0].map(|c| c / 256.0);
                assert_eq!(slab.direction.vector(), n);
                // The box reaches 254/256 both ways; 51 and 102 of 255 steps are a fifth and two fifths of that twice.
                let reach = 254.0 / 256.0;
                assert!(
                    (slab.lo - -reach * 0.6).abs() < 1e-4 && (slab.hi - reach * 0.2).abs() < 1e-4,
                    "{slab:?}"
                );
            }
        }
    }
}

#[test]
fn example() {
    let rows = table("format.md", "example-treelet");
    let mut treelet = Vec::new();
    for row in rows {
        assert_eq!(number(&row[0]) as usize, treelet.len());
        treelet.extend(row[1].split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()));
    }
    assert_eq!(treelet.len(), Profile::Dop14U8.treelet_bytes());
    let links = Links::read(Profile::Dop14U8, &treelet);
    let children = [0, 1, 2, 3].map(|child| links.child(child));
    let leaf = Child::Leaf { packet: 300, triangles: 3 };
    assert_eq!(children, [Child::Treelet(5), leaf, Child::Remote(2), Child::Empty]);

    let rows = table("format.md", "example-child");
    let value = |cell: &String| f32::from_bits(number(cell) as u32);
    let mut parent = NodeSlabs::default();
    for (slab, row) in rows.iter().enumerate() {
        (parent.lo[slab], parent.hi[slab]) = (value(&row[1]), value(&row[2]));
    }
    let child = decode_child(Profile::Dop14U8, 0.0, &treelet, 1, &parent);
    for (slab, row) in rows.iter().enumerate() {
        assert_eq!(
            [number(&row[0]), number(&row[3]), number(&row[4])],
            [slab as u64, treelet[4 * slab + 1].into(), treelet[32 + 4 * slab + 1].into()]
        );
        let unit = residual_unit(Encoding::U8, parent.lo[slab], parent.hi[slab], 0.0);
        let found = [unit, child.lo[slab], child.hi[slab]].map(f32::to_bits);
        assert_eq!(found, [5, 6, 7].map(|column| value(&row[column]).to_bits()), "slab {slab}");
        for cell in [&row[1], &row[2], &row[6], &row[7]] {
            let (_, decimal) = cell.split_once(" (").unwrap();
            assert_eq!(decimal.trim_end_matches(')').parse(), Ok(value(cell)), "slab {slab}");
        }
    }
    assert_eq!(rows.len(), 7);
}
