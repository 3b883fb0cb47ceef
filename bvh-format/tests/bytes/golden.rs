//! Checks the frozen files of `testdata/`: `ok-*.cbvh` are valid, and `bad-Rxx-*.cbvh` break rule xx and no earlier
//! one.
//!
//! The test makes the bad files from `ok-everything.cbvh`, each by one change, and corrects the checksums that are
//! checked before the broken rule. `CBVH_BLESS=1` writes the files that are missing; none is ever overwritten. To
//! keep the files small, they omit the sections that the rule does not need.

use bvh_format::checksum::checksum;
use bvh_format::header::version_name;
use bvh_format::instances::{Instance, write_instances};
use bvh_format::validate::validate;
use bvh_format::{FormatError, Layout, Rule};
use cbvh_testkit::seal::{
    put, put_together, seal, seal_header, seal_pages, seal_sections, section, take_apart,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

fn testdata() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../testdata")
}

/// Returns the names and bytes of the frozen files whose names start with `start`.
fn frozen(start: &str) -> Vec<(String, Vec<u8>)> {
    let names = std::fs::read_dir(testdata()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = names.filter(|n| n.starts_with(start) && n.ends_with(".cbvh")).collect();
    names.sort();
    let read = |name: String| (std::fs::read(testdata().join(&name)).unwrap(), name);
    names.into_iter().map(read).map(|(bytes, name)| (name, bytes)).collect()
}

/// Checks that a file of `testdata/` has these bytes. With `CBVH_BLESS=1`, a missing one is written.
fn check(name: &str, bytes: &[u8]) {
    let path = testdata().join(name);
    if !path.exists() && std::env::var_os("CBVH_BLESS").is_some() {
        std::fs::write(&path, bytes).unwrap();
    }
    assert!(std::fs::read(&path).unwrap() == *bytes, "{name} is not what was frozen");
}

/// A file of a later minor version: that of `ok-plain.cbvh`, with a section that no reader of version 1.0 knows.
fn later() -> Vec<u8> {
    let mut sections = take_apart(&std::fs::read(testdata().join("ok-plain.cbvh")).unwrap());
    sections.push((99, 0, b"a section of version 1.7".to_vec()));
    let mut bytes = put_together(&sections);
    put(&mut bytes, 10, &[7]);
    seal(&mut bytes);
    bytes
}

/// The cube of `ok-everything.cbvh` three times in the world: as it is, moved and turned, and without a name.
fn scene() -> Vec<u8> {
    let mut sections = take_apart(&std::fs::read(testdata().join("ok-everything.cbvh")).unwrap());
    let mut turned = Instance { name: "turned".to_owned(), ..Instance::of_object(0) };
    turned.rotation = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    turned.translation = [1.5, 0.0, -2.5];
    (turned.member, turned.meets, turned.margin) = (6, 1, 0.25);
    let first = Instance { name: "cube".to_owned(), ..Instance::of_object(0) };
    let instances = [first, turned, Instance::of_object(0)];
    sections.push((7, 0, write_instances(&instances)));
    put_together(&sections)
}

/// Makes a file of a cube and one or two instances of it, of which the last is changed.
fn instances(count: usize, edit: impl FnOnce(&mut Instance)) -> Vec<u8> {
    let mut sections = take_apart(&change(&LEAVES, |_| ()));
    let mut instances = vec![Instance { name: "cube".to_owned(), ..Instance::of_object(0) }; count];
    instances.last_mut().map(edit);
    sections.push((7, 0, write_instances(&instances)));
    put_together(&sections)
}

/// Makes a file of a cube with a topology section of these numbers, from the head on.
fn topology(numbers: &[u32]) -> Vec<u8> {
    let mut sections = take_apart(&change(&LEAVES, |_| ()));
    sections.push((8, 0, numbers.iter().flat_map(|number| number.to_le_bytes()).collect()));
    put_together(&sections)
}

/// A file of some sections of `ok-everything.cbvh`, under change.
struct Change {
    bytes: Vec<u8>,
}

/// Changes a file that has the sections of the given kinds, from 1 to 6. 0 stands for an empty section of leaves.
fn change(kinds: &[u32], edit: impl FnOnce(&mut Change)) -> Vec<u8> {
    let base = std::fs::read(testdata().join("ok-everything.cbvh")).unwrap();
    let mut sections = take_apart(&base);
    sections.retain(|(kind, _, _)| kinds.contains(kind) || *kind == 3 && kinds.contains(&0));
    sections.iter_mut().filter(|(kind, _, _)| *kind == 3 && kinds.contains(&0)).for_each(|s| s.2.clear());
    let mut change = Change { bytes: put_together(&sections) };
    // Without an id section, pages refer to no id blocks.
    if !kinds.contains(&4) && kinds.contains(&2) {
        change.page(52, &[0; 4]);
        change.page(32, &[0; 8]);
        seal(&mut change.bytes);
    }
    edit(&mut change);
    change.bytes
}

impl Change {
    fn header(&mut self, at: usize, value: &[u8]) {
        put(&mut self.bytes, at, value);
    }

    /// Writes into the record of the object, at an offset from the record's first byte.
    fn record(&mut self, at: usize, value: &[u8]) {
        let start = section(&self.bytes, 1).start;
        put(&mut self.bytes, start + 16 + at, value);
    }

    /// Writes into the only page.
    fn page(&mut self, at: usize, value: &[u8]) {
        let start = section(&self.bytes, 2).start;
        put(&mut self.bytes, start + at, value);
    }

    /// Writes into the root's treelet.
    fn treelet(&mut self, at: usize, value: &[u8]) {
        let line = usize::from(self.bytes[section(&self.bytes, 2).start + 61]);
        self.page(64 * line + at, value);
    }

    fn leaves(&mut self, at: usize, value: &[u8]) {
        let start = section(&self.bytes, 3).start;
        put(&mut self.bytes, start + at, value);
    }

    fn seal(&mut self) {
        seal(&mut self.bytes);
    }
}

/// Makes a file that is valid except for one change, and corrects its checksums.
fn sealed(kinds: &[u32], edit: impl FnOnce(&mut Change)) -> Vec<u8> {
    change(kinds, |file| {
        edit(file);
        file.seal();
    })
}

const NODES: [u32; 3] = [1, 2, 0];
const LEAVES: [u32; 3] = [1, 2, 3];
const IDS: [u32; 4] = [1, 2, 3, 4];

/// Changes to the header and the object table, which are refused when a file is opened.
fn bad_at_open() -> Vec<(u32, &'static str, Vec<u8>)> {
    let nan = f32::NAN.to_le_bytes();
    let header = |edit: fn(&mut Change)| sealed(&[], edit);
    let entry = |at: usize, kind: u32, required: u32, offset: u64, length: u64| {
        sealed(&[], |f| {
            f.bytes.resize(128, 0);
            f.header(12, &1u32.to_le_bytes());
            f.header(at, &[kind.to_le_bytes(), required.to_le_bytes()].concat());
            f.header(at + 8, &[offset.to_le_bytes(), length.to_le_bytes()].concat());
        })
    };
    vec![
        (1, "text", b"solid not a bounding volume hierarchy\n".to_vec()),
        (1, "line-ends", header(|f| f.header(5, b"\n\n"))),
        (2, "major-5", header(|f| f.header(8, &[5]))),
        (2, "candidate", header(|f| f.header(8, &[0, 0, 3]))),
        (3, "short", change(&[], |f| f.bytes.truncate(60))),
        (4, "flipped-bit", change(&[], |f| f.bytes[60] ^= 1)),
        (5, "truncated", change(&[1], |f| f.bytes.truncate(100))),
        (6, "65-sections", header(|f| f.header(12, &[65]))),
        (6, "table-beyond", change(&[1], |f| f.bytes.truncate(80))),
        (7, "unaligned", entry(64, 1, 1, 129, 0)),
        (7, "unaligned-nodes", entry(64, 2, 1, 128, 0)),
        (7, "in-the-table", entry(64, 1, 1, 64, 0)),
        (7, "beyond-the-end", entry(64, 1, 1, 128, 1)),
        (7, "wraps-around", entry(64, 99, 0, 128, u64::MAX)),
        (8, "unknown-required", entry(64, 99, 1, 128, 0)),
        (9, "no-sections", header(|_| ())),
        (9, "twice", {
            let objects = (1, 1, Vec::new());
            put_together(&[objects.clone(), objects])
        }),
        (11, "no-objects", put_together(&[(1, 1, vec![0; 16]), (2, 1, vec![]), (3, 1, vec![])])),
        (11, "name-beyond", sealed(&[1, 2, 0], |f| f.record(4, &[5]))),
        (12, "nan-radius", objects_alone(|f| f.record(148, &nan))),
        (12, "box-inverted", objects_alone(|f| f.record(44, &(-1e9f32).to_le_bytes()))),
        (13, "no-pages", objects_alone(|f| f.record(84, &[0]))),
        (13, "more-pages", objects_alone(|_| ())),
        (12, "negative-radius", objects_alone(|f| f.record(152, &(-1f64).to_le_bytes()))),
        (12, "solid-2", objects_alone(|f| f.record(160, &[2]))),
        (14, "profile-6", objects_alone(|f| f.record(132, &[6]))),
        (14, "encoding-3", objects_alone(|f| f.record(133, &[3]))),
    ]
}

/// Makes a file of an object table with empty sections of nodes and leaves, and changes it.
fn objects_alone(edit: impl FnOnce(&mut Change)) -> Vec<u8> {
    let objects = take_apart(&sealed(&[1], |_| ())).remove(0);
    let mut file = Change { bytes: put_together(&[objects, (2, 1, vec![]), (3, 1, vec![])]) };
    edit(&mut file);
    file.seal();
    file.bytes
}

/// Makes a file of one cube of `ok-profiles.cbvh`, without its leaves, and changes the treelet of its page.
fn cube_of_profile(number: usize, at: usize, value: &[u8]) -> Vec<u8> {
    let all = take_apart(&std::fs::read(testdata().join("ok-profiles.cbvh")).unwrap());
    let record = &all[0].2[16 + 192 * number..][..192];
    let mut objects = [&[1, 0, 0, 0][..], &[0; 12], record].concat();
    // The object has no name and starts at the first page of the file.
    put(&mut objects, 16, &[0; 8]);
    put(&mut objects, 16 + 80, &[0; 4]);
    let mut page = all[1].2[4096 * number..][..4096].to_vec();
    put(&mut page, 24, &[0; 8]);
    put(&mut page, 44, &[0; 4]);
    let mut file = Change { bytes: put_together(&[(1, 1, objects), (2, 1, page), (3, 1, vec![])]) };
    file.treelet(at, value);
    file.seal();
    file.bytes
}

/// Changes to pages, which are refused when a query touches the page. The cube's page has one root, at line 2.
fn bad_pages() -> Vec<(u32, &'static str, Vec<u8>)> {
    let page = |edit: fn(&mut Change)| sealed(&NODES, edit);
    vec![
        (10, "section", change(&NODES, |f| f.page(4000, &[1]))),
        (
            15,
            "flipped-bit",
            change(&NODES, |f| {
                f.page(0, &[1]);
                seal_sections(&mut f.bytes);
                seal_header(&mut f.bytes);
            }),
        ),
        (16, "page-number", page(|f| f.page(44, &[1]))),
        (17, "no-roots", page(|f| f.page(58, &[0]))),
        (17, "treelets-beyond", page(|f| f.page(59, &[63]))),
        (18, "another-profile", page(|f| f.page(62, &[1]))),
        (19, "nan", page(|f| f.page(64, &f32::NAN.to_le_bytes()))),
        (20, "root-with-parent", page(|f| f.page(120, &[0; 4]))),
        (21, "unknown-kind", page(|f| f.treelet(28, &[8, 0, 0, 0]))),
        (21, "no-children", page(|f| f.treelet(28, &[0; 4]))),
        (
            22,
            "loop",
            page(|f| {
                f.treelet(28, &[1, 0, 0, 0]);
                f.treelet(60, &[0]);
            }),
        ),
        (
            23,
            "link-not-there",
            page(|f| {
                f.treelet(28, &[2, 0, 0, 0]);
                f.treelet(61, &[0]);
            }),
        ),
        (24, "packet-numbers", page(|f| f.treelet(62, &[1 << 6, 0]))),
        (25, "short-root", page(|f| f.page(63, &[1]))),
        (38, "f16-negative", cube_of_profile(2, 1, &[0x80])),
        (38, "f16-infinite", cube_of_profile(2, 1, &[0x7c])),
        (38, "f32-nan", cube_of_profile(3, 0, &f32::NAN.to_le_bytes())),
        (49, "f32-beyond-its-treelet", cube_of_profile(3, 0, &(-2f32).to_le_bytes())),
    ]
}

/// Changes to leaf and id blocks, and those that only a check of the whole file finds.
fn bad_blocks() -> Vec<(u32, &'static str, Vec<u8>)> {
    let block = |edit: fn(&mut Change)| sealed(&LEAVES, edit);
    let infinite = (f32::INFINITY.to_bits() as i32).to_le_bytes();
    let ids = |edit: fn(&mut Change, usize)| {
        sealed(&IDS, |f| {
            let at = section(&f.bytes, 4).start;
            edit(f, at);
        })
    };
    let pairs = |file: &mut Change, pairs: [[u32; 2]; 2]| {
        let start = section(&file.bytes, 5).start;
        let ids: Vec<u8> = pairs.into_iter().flatten().flat_map(u32::to_le_bytes).collect();
        put(&mut file.bytes, start, &ids);
    };
    vec![
        (
            26,
            "a-line-more",
            sealed(&LEAVES, |f| {
                let start = section(&f.bytes, 2).start;
                let lines = f.bytes[start + 48] + 1;
                f.page(48, &[lines]);
                // The section table states a length that is longer by one line.
                let length = section(&f.bytes, 3).len() as u64 + 64;
                f.header(64 + 2 * 32 + 16, &length.to_le_bytes());
                f.bytes.extend([0; 64]);
            }),
        ),
        (
            27,
            "flipped-bit",
            change(&LEAVES, |f| {
                f.page(8, &[0; 8]);
                seal_pages(&mut f.bytes);
                seal_sections(&mut f.bytes);
                seal_header(&mut f.bytes);
            }),
        ),
        (28, "33-bits", block(|f| f.leaves(5, &[33]))),
        (28, "kind-3", block(|f| f.leaves(20, &[3]))),
        (28, "16-decimals", block(|f| f.leaves(20, &[2, 16]))),
        (28, "a-further-slot", block(|f| f.leaves(2, &[1]))),
        (28, "points", block(|f| f.leaves(20, &[f.bytes[section(&f.bytes, 3).start + 20] | 1 << 6]))),
        (
            29,
            "fewer-vertices",
            block(|f| {
                // One vertex of no bits, to which all slots but zeros do not lead.
                f.leaves(0, &[1, 0]);
                f.leaves(5, &[0; 3]);
                let pool_at = f.bytes[section(&f.bytes, 3).start + 28];
                f.page(48, &[(pool_at + 8).div_ceil(64)]);
            }),
        ),
        (29, "rotation-3", block(|f| f.leaves(32, &[f.bytes[section(&f.bytes, 3).start + 32] | 0xc0]))),
        // The pattern with most slots, of which the further ones start at the 15th of 12.
        (29, "beyond-further-slots", block(|f| f.leaves(32, &[63, 0, 0, 0, 15 << 2]))),
        (
            30,
            "infinite",
            sealed(&LEAVES, |f| {
                f.leaves(20, &[0; 4]);
                f.leaves(8, &infinite);
            }),
        ),
        (31, "without-section", block(|f| f.page(52, &[1]))),
        (31, "a-bit-later", ids(|f, at| f.bytes[at + 4] += 1)),
        (31, "33-bits", ids(|f, at| f.bytes[at + 6] = f.bytes[at + 6] & 0xc0 | 33)),
        (
            32,
            "flipped-bit",
            change(&IDS, |f| {
                f.page(16, &[0; 8]);
                seal_pages(&mut f.bytes);
                seal_sections(&mut f.bytes);
                seal_header(&mut f.bytes);
            }),
        ),
        (33, "id-beyond", sealed(&IDS, |f| f.record(104, &[13]))),
        (34, "treelets", block(|f| f.record(72, &[9]))),
        (36, "descending", sealed(&[1, 2, 3, 5], |f| pairs(f, [[3, 14], [0, 12]]))),
        (36, "dropped-first", sealed(&[1, 2, 3, 5], |f| pairs(f, [[12, 0], [14, 0]]))),
        // x is predicted, and z is a sum.
        (37, "left-out-0", block(|f| f.record(168, &[0; 4]))),
        (37, "origin-too-fine", block(|f| f.record(24, &2f64.powi(-149).to_le_bytes()))),
    ]
}

/// Makes a file of one object of `ok-exact.cbvh`, and changes it. The change gets the byte in the leaf section at which the
/// corrections of its only block start.
fn exact(number: usize, edit: impl FnOnce(&mut Change, usize)) -> Vec<u8> {
    let all = take_apart(&std::fs::read(testdata().join("ok-exact.cbvh")).unwrap());
    let mut record = all[0].2[16 + 192 * number..][..192].to_vec();
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(word(&record, 84), 1, "pages");
    let mut page = all[1].2[4096 * word(&record, 80)..][..4096].to_vec();
    let block = all[2].2[64 * word(&page, 24)..][..64 * word(&page, 48)].to_vec();
    // The object has no name and no ids, and starts at the first page of the file.
    put(&mut record, 0, &[0; 8]);
    put(&mut record, 80, &[0; 4]);
    put(&mut page, 24, &[0; 16]);
    put(&mut page, 44, &[0; 4]);
    put(&mut page, 16, &[0; 8]);
    put(&mut page, 52, &[0; 4]);
    let bits: usize = block[5..8].iter().map(|&bits| usize::from(bits)).sum();
    let vertices = usize::from(u16::from_le_bytes([block[0], block[1]]));
    let corrections = (word(&block, 28) + (vertices * bits).div_ceil(8) + 8).next_multiple_of(64);
    let objects = [&[1, 0, 0, 0][..], &[0; 12], &record].concat();
    let mut file = Change { bytes: put_together(&[(1, 1, objects), (2, 1, page), (3, 1, block)]) };
    edit(&mut file, corrections);
    file.seal();
    file.bytes
}

/// Changes to predictors and corrections. The object has `f32` numbers on x, corrections of all corners on y, and on z a list
/// of a few corners.
fn bad_vertices() -> Vec<(u32, &'static str, Vec<u8>)> {
    const MIXED: usize = 4;
    let record = |at: usize, value: &[u8]| exact(MIXED, |f, _| f.record(at, value));
    let head = |edit: fn(&mut Change, usize)| exact(MIXED, edit);
    let listed = |f: &Change, at: usize| {
        let bytes = &f.bytes[section(&f.bytes, 3).start + at..];
        let corner = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        assert!(bytes[0] == 0 && bytes[8] >= 2, "corrections");
        [corner(40), corner(42)]
    };
    vec![
        (0, "", head(|_, _| ())),
        (
            52,
            "descending",
            exact(MIXED, |f, at| {
                let [first, second] = listed(f, at);
                f.leaves(at + 40, &[second.to_le_bytes(), first.to_le_bytes()].concat());
            }),
        ),
        (
            52,
            "twice",
            exact(MIXED, |f, at| {
                let [first, _] = listed(f, at);
                f.leaves(at + 40, &[first.to_le_bytes(), first.to_le_bytes()].concat());
            }),
        ),
        (
            52,
            "corner-beyond",
            exact(MIXED, |f, at| {
                let vertices = f.bytes[section(&f.bytes, 3).start];
                f.leaves(at + 42, &[vertices, 0]);
            }),
        ),
        (52, "more-corners", head(|f, at| f.leaves(at + 8, &[255]))),
        (52, "of-x", head(|f, at| f.leaves(at, &[1]))),
        (52, "65-bits", head(|f, at| f.leaves(at + 14, &[65]))),
        (26, "a-bit-more", head(|f, at| f.leaves(at + 13, &[64]))),
        (
            26,
            "no-corrections",
            exact(MIXED, |f, at| {
                let lines = (at / 64) as u8;
                f.page(48, &[lines, 0, 0, 0]);
            }),
        ),
        (37, "far", head(|f, at| f.leaves(at + 16 + 8 + 7, &[0x20]))),
        (37, "nan", head(|f, at| f.leaves(at + 16 + 8, &(i64::MAX / 2).to_le_bytes()))),
        (12, "predictor-5", record(161, &[5])),
        (12, "digits-of-a-sum", record(164, &[1])),
        (12, "10-digits", record(166, &[10])),
        (12, "origin-of-significant", record(24, &1f64.to_le_bytes())),
        (12, "corrected-8", record(167, &[0xf])),
        (12, "left-out-of-a-sum", record(168, &1f32.to_le_bytes())),
        (12, "left-out-negative", record(172, &(-1f32).to_le_bytes())),
        (12, "scale-without-scaled", record(180, &1f64.to_le_bytes())),
        (12, "scaled-without-scale", record(161, &[4])),
        (12, "convex-2", record(188, &[2])),
    ]
}

/// Changes to the instances.
fn bad_instances() -> Vec<(u32, &'static str, Vec<u8>)> {
    let none = |instance: &mut Instance| instance.name.clear();
    let cut = {
        let mut sections = take_apart(&instances(1, |_| ()));
        sections.last_mut().unwrap().2.pop();
        put_together(&sections)
    };
    let unsealed = {
        let mut bytes = instances(1, |_| ());
        let start = section(&bytes, 7).start;
        bytes[start + 16 + 12] ^= 1;
        bytes
    };
    vec![
        (10, "instances", unsealed),
        (40, "no-instances", instances(0, none)),
        (40, "cut", cut),
        (41, "object-1", instances(1, |instance| instance.object = 1)),
        (42, "scaled", instances(1, |instance| instance.rotation[0][0] = 2.0)),
        (42, "mirrored", instances(2, |instance| instance.rotation[2][2] = -1.0)),
        (42, "nan", instances(1, |instance| instance.translation[2] = f64::NAN)),
        (43, "twice", instances(2, |_| ())),
        (50, "negative-margin", instances(2, |instance| instance.margin = -1.0)),
        (51, "open-solid", instances(1, |instance| instance.solid = true)),
    ]
}

/// Changes to the topology. The cube has 13 triangles in 4 packets, of which only the first is not full: it has one.
fn bad_topology() -> Vec<(u32, &'static str, Vec<u8>)> {
    let minus = |number: i32| number as u32;
    let bytes = topology(&[1, 1, 0, 0, 1, 1, 0, 0, 0]);
    let start = section(&bytes, 8).start;
    let mut unsealed = bytes.clone();
    unsealed[start + 16] ^= 1;
    let mut cut = take_apart(&bytes);
    cut.last_mut().unwrap().2.truncate(15);
    vec![
        (0, "topology", bytes),
        (0, "open", topology(&[1, 0, 0, 0, 0, 0, 0, 0])),
        (10, "topology", unsealed),
        (44, "two-objects", topology(&[2, 1, 0, 0, 1, 1, 0, 0, 0])),
        (44, "cut-head", put_together(&cut)),
        (44, "cut", topology(&[1, 1, 0, 0, 1, 1, 0, 0])),
        (44, "longer", topology(&[1, 1, 0, 0, 1, 1, 0, 0, 0, 0])),
        (44, "other-sum", topology(&[1, 2, 0, 0, 1, 1, 0, 0, 0, 1])),
        (45, "closed-2", topology(&[1, 1, 0, 0, 2, 1, 0, 0, 0])),
        (0, "open-with-net", topology(&[1, 1, 1, 0, 0, 1, 1, 0, 0, 0, 0])),
        (45, "too-many", topology(&[&[1, 14, 0, 0, 1, 14, 0, 0][..], &(0..14).collect::<Vec<_>>()].concat())),
        (46, "descending", topology(&[1, 2, 0, 0, 1, 2, 0, 0, 1, 0])),
        (46, "twice", topology(&[1, 0, 2, 0, 1, 0, 2, 0, 3, 2, 3, 2])),
        (46, "beyond", topology(&[1, 1, 0, 0, 1, 1, 0, 0, 16])),
        (46, "no-lane", topology(&[1, 1, 0, 0, 1, 1, 0, 0, 1])),
        (46, "no-lane-of-net", topology(&[1, 0, 1, 0, 1, 0, 1, 0, 3, 0])),
        (47, "net-1", topology(&[1, 1, 1, 0, 1, 1, 1, 0, 0, 5, 1])),
        (48, "net-2", topology(&[1, 1, 1, 0, 1, 1, 1, 0, 0, 5, 2])),
        (48, "net-minus-1", topology(&[1, 1, 1, 0, 1, 1, 1, 0, 0, 5, minus(-1)])),
    ]
}

fn number_of(error: Result<Layout, FormatError>) -> u32 {
    error.err().map_or(0, |error| error.rule.number())
}

#[test]
fn good_files_are_valid() {
    check("ok-scene.cbvh", &scene());
    check("ok-later.cbvh", &later());
    let files = frozen("ok-");
    assert!(files.len() >= 10);
    for (name, bytes) in files {
        validate(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// The list of `frozen.txt` names each file of the folder and its checksum. With `CBVH_BLESS=1`, files that it lacks are added.
#[test]
fn frozen_files_never_change() {
    let path = testdata().join("frozen.txt");
    let files: BTreeMap<String, String> =
        frozen("").into_iter().map(|(name, bytes)| (name, format!("{:016x}", checksum(&bytes)))).collect();
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    if std::env::var_os("CBVH_BLESS").is_some() {
        let new =
            files.iter().filter(|(name, _)| !lines.iter().any(|line| line.ends_with(&format!(" {name}"))));
        let new: Vec<String> = new.map(|(name, sum)| format!("{sum} {name}")).collect();
        lines.extend(new);
        std::fs::write(&path, lines.join("\n") + "\n").unwrap();
    }
    let stated: BTreeMap<String, String> = lines
        .iter()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_once(' ').map(|(sum, name)| (name.to_owned(), sum.to_owned())).unwrap())
        .collect();
    assert_eq!(stated, files);
    assert_eq!(stated.len() + 1, lines.len(), "a file is named twice");
}

/// Sections that this reader does not know are skipped, whatever the minor version, and the content is the same.
#[test]
fn a_later_minor_version_is_read() {
    let [plain, later] =
        ["ok-plain.cbvh", "ok-later.cbvh"].map(|name| std::fs::read(testdata().join(name)).unwrap());
    let [plain, found] = [&plain, &later].map(|bytes| validate(bytes).unwrap());
    assert_eq!((found.version, version_name(found.version)), ((1, 7), "1.7".to_owned()));
    assert_eq!(found.content_checksum, plain.content_checksum);
    assert_eq!(found.objects.len(), plain.objects.len());
    for minor in [0, 1, u16::MAX] {
        let mut bytes = later.clone();
        put(&mut bytes, 10, &minor.to_le_bytes());
        assert_eq!(number_of(validate(&bytes)), 4, "the checksum covers the version");
        seal(&mut bytes);
        assert_eq!(validate(&bytes).unwrap().version, (1, minor));
    }
    // The same section, if it is required, and the next major version.
    let mut sections = take_apart(&later);
    sections.last_mut().unwrap().1 = 1;
    assert_eq!(number_of(validate(&put_together(&sections))), 8);
    let mut next = later;
    put(&mut next, 8, &2u16.to_le_bytes());
    seal(&mut next);
    let error = validate(&next).unwrap_err();
    assert_eq!(error.rule.number(), 2);
    assert!(error.to_string().contains("expected version 1.x, found 2.7"), "{error}");
}

#[test]
fn bad_files_break_the_rule_in_their_name() {
    let bad =
        [bad_at_open(), bad_pages(), bad_blocks(), bad_vertices(), bad_instances(), bad_topology()].concat();
    for (rule, what, bytes) in &bad {
        let found = validate(bytes);
        assert_eq!(number_of(found.clone()), *rule, "{what}: {:?}", found.err());
    }
    // Only one file per rule is frozen, to keep the folder small.
    let mut frozen_rules = BTreeSet::new();
    for (rule, what, bytes) in bad.iter().filter(|(rule, _, _)| *rule > 0 && frozen_rules.insert(*rule)) {
        check(&format!("bad-R{rule:02}-{what}.cbvh"), bytes);
    }
    let files = frozen("bad-");
    for (name, bytes) in &files {
        let rule: u32 = name[5..7].parse().unwrap();
        let error = validate(bytes).unwrap_err();
        assert_eq!(error.rule.number(), rule, "{name}: {error}");
        assert!(error.offset <= bytes.len() as u64 && !error.to_string().contains('\n'), "{name}: {error}");
    }
    let covered: BTreeSet<u32> = bad.iter().map(|(rule, _, _)| *rule).filter(|rule| *rule > 0).collect();
    let missing: Vec<u32> = Rule::ALL.iter().map(|r| r.number()).filter(|r| !covered.contains(r)).collect();
    // `validate` does not check R35 and R39: see `bvh-bake/tests/baking/bake.rs`.
    assert_eq!(missing, [35, 39]);
}

#[test]
fn every_flipped_bit_that_means_something_is_found() {
    let topology = std::fs::read(testdata().join("ok-topology.cbvh")).unwrap();
    let points = std::fs::read(testdata().join("ok-points.cbvh")).unwrap();
    let exact =
        ["ok-exact.cbvh", "ok-exact-f32.cbvh"].map(|name| std::fs::read(testdata().join(name)).unwrap());
    let [packed, plain] = exact;
    for bytes in [scene(), topology, points, packed, plain] {
        let head = 64 + 32 * bytes[12] as usize;
        let sections: Vec<_> = (1..=8).map(|kind| section(&bytes, kind)).collect();
        for at in (0..bytes.len()).step_by(7) {
            let mut changed = bytes.clone();
            changed[at] ^= 1 << (at % 8);
            let covered = at < head || sections.iter().any(|section| section.contains(&at));
            assert_eq!(validate(&changed).is_err(), covered, "byte {at}");
        }
    }
    assert_eq!(checksum(&[]), 0x2d06_8005_38d3_94c2);
}

#[test]
fn every_truncation_is_found() {
    for (name, bytes) in frozen("ok-") {
        for length in (0..bytes.len()).step_by(61) {
            assert!(validate(&bytes[..length]).is_err(), "{name} cut to {length}");
        }
        let longer = [&bytes[..], &[0]].concat();
        assert_eq!(number_of(validate(&longer)), 5, "{name}");
    }
}
