//! Files that are read piece by piece: the errors are those of the same bytes in memory.

use bvh_bake::mesh::Mesh;
use bvh_bake::{FileError, Options, StoredFile, to_bytes, validate_in_parallel};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::validate::validate;
use bvh_format::{FormatError, Rule};
use cbvh_testkit::Random;
use cbvh_testkit::damage::mislead;
use cbvh_testkit::depth::rounds;
use cbvh_testkit::seal::{put, seal, section};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

struct Folder(cbvh_testkit::TempDir);

impl Folder {
    fn new() -> Self {
        Self(cbvh_testkit::folder())
    }

    /// Validates bytes in every way; returns what all of them say.
    #[track_caller]
    fn validate(&self, bytes: &[u8]) -> Result<(), FormatError> {
        let path = self.0.path().join("f.cbvh");
        fs::write(&path, bytes).unwrap();
        let told = validate(bytes).map(|_| ());
        assert_eq!(validate_in_parallel(bytes).map(|_| ()), told);
        match StoredFile::open(&path, Some(64 << 20)).and_then(|file| validate_in_parallel(&file)) {
            Ok(_) => assert_eq!(told, Ok(())),
            Err(FileError::Format(error)) => assert_eq!(told, Err(error)),
            Err(error) => panic!("{error}, not {told:?}"),
        }
        told
    }
}

#[test]
fn golden_and_damaged_files_are_told_alike() {
    let folder = Folder::new();
    let testdata = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata");
    let (mut rules, mut random) = (BTreeSet::new(), Random::new(0));
    let mut files = 0;
    for entry in fs::read_dir(testdata).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if !name.ends_with(".cbvh") {
            continue;
        }
        files += 1;
        let golden = fs::read(&path).unwrap();
        let told = folder.validate(&golden);
        assert_eq!(told.is_ok(), name.starts_with("ok-"), "{name}");
        rules.extend(told.err().map(|error| error.rule));
        for round in 0..if name.starts_with("ok-") { rounds(15) } else { 5 } {
            let mut bytes = golden.clone();
            mislead(&mut bytes, &golden, 1 + round % 4, &mut random);
            if round % 3 > 0 && bytes.len() >= 64 {
                seal(&mut bytes);
            }
            if round % 10 == 9 {
                bytes.truncate(random.below(bytes.len()));
            }
            rules.extend(folder.validate(&bytes).err().map(|error| error.rule));
        }
    }
    assert!(files > 35 && rules.len() > 30, "{files} files, {rules:?}");
}

/// A sheet of `2 * side * side` triangles.
fn sheet(side: u32) -> Mesh {
    let at = |i: u32| [i % (side + 1), i / (side + 1)].map(f64::from);
    let positions = (0..(side + 1).pow(2)).map(at).map(|[x, y]| [x, y, (x * 0.7).sin() * (y * 0.3).cos()]);
    let square = |i: u32| {
        let first = i / side * (side + 1) + i % side;
        [[first, first + 1, first + side + 2], [first, first + side + 2, first + side + 1]]
    };
    Mesh::from_triangles(positions.collect(), (0..side * side).flat_map(square).collect())
}

/// A block may be stated to be as long as its section, with the right checksum; it is not read at once.
#[test]
fn blocks_longer_than_any_are_told_alike() {
    let folder = Folder::new();
    for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
        let options = Options::default().triangles(encoding);
        let (golden, _) = to_bytes(&sheet(400), &options).unwrap();
        assert_eq!(folder.validate(&golden), Ok(()));
        let [nodes, leaves, ids] = [2, 3, 4].map(|kind| section(&golden, kind));
        let has_packets = |at: &usize| golden[at + 56..at + 58] != [0, 0];
        let page = nodes.clone().step_by(4096).find(has_packets).unwrap();
        assert!(leaves.len() > 1 << 20);
        // Lines from the first on.
        let mut bytes = golden.clone();
        put(&mut bytes, page + 24, &0u64.to_le_bytes());
        put(&mut bytes, page + 48, &(leaves.len() as u32 / 64).to_le_bytes());
        let unsealed = folder.validate(&bytes).unwrap_err();
        assert!([Rule::SectionChecksum, Rule::PageChecksum].contains(&unsealed.rule), "{unsealed}");
        seal(&mut bytes);
        let long = folder.validate(&bytes).unwrap_err();
        assert_eq!((long.rule, long.offset), (Rule::LeafPlace, page as u64 + 24), "{long}");
        // Packed blocks tell how long they are: the first is a page's own.
        assert!(long.found.contains(&(leaves.len() / 64).to_string()), "{long}");
        let mut bytes = golden.clone();
        put(&mut bytes, page + 32, &0u64.to_le_bytes());
        put(&mut bytes, page + 52, &(ids.len() as u32 / 8).to_le_bytes());
        seal(&mut bytes);
        assert_eq!(folder.validate(&bytes).unwrap_err().rule, Rule::IdPlace);
        // Beyond its section.
        let mut bytes = golden.clone();
        put(&mut bytes, page + 48, &(leaves.len() as u32 / 64 + 1).to_le_bytes());
        seal(&mut bytes);
        let beyond = folder.validate(&bytes).unwrap_err();
        assert!([Rule::LeafPlace, Rule::PackedHeader].contains(&beyond.rule), "{beyond}");
    }
}

#[test]
fn the_last_page_of_many_is_checked_as_the_first() {
    let folder = Folder::new();
    let (golden, _) = to_bytes(&sheet(250), &Options::default()).unwrap();
    let nodes = section(&golden, 2);
    for (at, rule) in [
        // The number of the first packet, and an anchor's parent: seen only when all pages have been.
        (nodes.end - 4096 + 40, Rule::Counts),
        (nodes.end - 4096 + 62, Rule::PageProfile),
    ] {
        let mut bytes = golden.clone();
        bytes[at] ^= 1;
        seal(&mut bytes);
        let told = folder.validate(&bytes).unwrap_err();
        assert_eq!((told.rule, told.offset), (rule, at as u64), "{told}");
    }
}

#[test]
fn what_is_no_file_is_refused() {
    let folder = Folder::new();
    let refused = StoredFile::open(folder.0.path(), None).unwrap_err();
    assert!(matches!(refused, FileError::Io { .. }), "{refused}");
    let path = folder.0.path().join("f.cbvh");
    assert!(matches!(StoredFile::open(&path, None), Err(FileError::Io { .. })));
    fs::write(&path, b"x").unwrap();
    let told = StoredFile::open(&path, Some(1 << 20)).unwrap_err();
    assert!(matches!(told, FileError::Memory { .. }), "{told}");
    assert!(told.to_string().ends_with("; raise the memory budget"), "{told}");
    let told = StoredFile::open(&path, None).and_then(|file| validate_in_parallel(&file)).unwrap_err();
    assert!(matches!(told, FileError::Format(error) if error.rule == Rule::Magic));
}

/// Names and records are in memory: a table that does not fit is refused before it is read.
#[test]
fn a_large_object_table_is_refused_within_a_small_budget() {
    let folder = Folder::new();
    let (mut bytes, _) = to_bytes(&sheet(5), &Options::default()).unwrap();
    // The table takes the rest of the file, which is not there but as zeros.
    let end = 1u64 << 30;
    let table = section(&bytes, 1);
    // Only the objects are left, so that nothing overlaps; the others begin behind them, and are empty.
    for entry in 1..u64::from(bytes[12]) {
        let at = 64 + 32 * entry as usize;
        put(&mut bytes, at + 8, &end.to_le_bytes());
        put(&mut bytes, at + 16, &0u64.to_le_bytes());
    }
    put(&mut bytes, 64 + 16, &(end - table.start as u64).to_le_bytes());
    put(&mut bytes, 16, &end.to_le_bytes());
    put(&mut bytes, 32, &[0; 8]);
    let sum = bvh_format::checksum::checksum(&bytes[..64 + 32 * bytes[12] as usize]);
    put(&mut bytes, 32, &sum.to_le_bytes());
    let path = folder.0.path().join("f.cbvh");
    fs::write(&path, &bytes[..table.end]).unwrap();
    fs::File::options().write(true).open(&path).unwrap().set_len(end).unwrap();
    let told = StoredFile::open(&path, Some(64 << 20)).and_then(|file| validate_in_parallel(&file));
    assert!(matches!(told, Err(FileError::Memory { needed, .. }) if needed > end), "{told:?}");
}
