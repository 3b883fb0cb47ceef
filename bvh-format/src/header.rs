//! The head of a file: magic bytes, version, length, checksums and the section table.

use crate::checksum::{Hasher, checksum, hex};
use crate::error::{FormatError, ensure, require};
use crate::leaf::LINE;
use crate::page::PAGE;
use crate::rule::Rule;
use std::ops::Range;
use zerocopy::byteorder::little_endian::{U16, U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// The first eight bytes of a file. A transfer in text mode changes the high bit or the line ends, and is so detected.
pub const MAGIC: [u8; 8] = [0x89, b'c', b'b', b'v', b'h', 0x0d, 0x0a, 0x1a];
/// The major version. Readers refuse any other, and 0 stands for the release candidates of version 1.0.
pub const MAJOR: u16 = 1;
/// The minor version that writers state. Readers take any: a later one only adds sections.
pub const MINOR: u16 = 0;
/// The most entries that the section table can have.
pub const MAX_SECTIONS: usize = 64;
/// The most bytes that the header and the section table can take together.
pub(crate) const MAX_HEAD_BYTES: usize = head_bytes(MAX_SECTIONS);

/// The number of bytes of the header and a section table together.
pub const fn head_bytes(sections: usize) -> usize {
    size_of::<Header>() + sections * size_of::<SectionEntry>()
}

/// Returns the name of a version that a header states as a major and a minor number: `1.0` for 1 and 0, and `1.0-rc3`
/// for 0 and 3, a release candidate.
pub fn version_name((major, minor): (u16, u16)) -> String {
    if major == 0 { format!("1.0-rc{minor}") } else { format!("{major}.{minor}") }
}

/// The first 64 bytes of a file.
///
/// ```
/// use bvh_format::header::{Header, SectionEntry, head_bytes, version_name};
/// use zerocopy::FromBytes;
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let (header, rest) = Header::ref_from_prefix(&bytes).expect("a header of 64 bytes");
/// assert_eq!(header.file_length.get(), bytes.len() as u64);
/// println!("version {}", version_name((header.major.get(), header.minor.get())));
/// let sections = header.sections.get() as usize;
/// let table = &rest[..head_bytes(sections) - size_of::<Header>()];
/// assert_eq!(<[SectionEntry]>::ref_from_bytes(table).map(<[_]>::len), Ok(sections));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug)]
#[repr(C)]
pub struct Header {
    /// `MAGIC`.
    pub magic: [u8; 8],
    /// Major version.
    pub major: U16,
    /// Minor version.
    pub minor: U16,
    /// The number of entries in the section table.
    pub sections: U32,
    /// Length of the file in bytes.
    pub file_length: U64,
    /// XXH3 of the sections that make up the content: see [`ContentHasher`](crate::layout::ContentHasher).
    pub content_checksum: U64,
    /// XXH3 of the header, in which this field counts as zero, and the section table.
    pub header_checksum: U64,
    /// Zero.
    pub reserved: [u8; 24],
}

/// An entry of the section table.
///
/// [`Header`] has an example.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug)]
#[repr(C)]
pub struct SectionEntry {
    /// The number of a `SectionKind`.
    pub kind: U32,
    /// 0 if a reader that does not know the kind skips the section; 1 if it refuses the file.
    pub required: U32,
    /// Byte offset in the file, a multiple of [`SectionKind::alignment`].
    pub offset: U64,
    /// Length in bytes.
    pub length: U64,
    /// XXH3 of the section's bytes.
    pub checksum: U64,
}

const _: () = assert!(size_of::<Header>() == 64 && size_of::<SectionEntry>() == 32);

/// The sections of version 1.0. Later minor versions of the format may add kinds.
///
/// [`Section`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(u32)]
pub enum SectionKind {
    /// The object table and the names of the objects. Required.
    Objects = 1,
    /// Pages of treelets. Required.
    Nodes = 2,
    /// Leaf blocks. Required.
    Leaves = 3,
    /// Id blocks: the numbers of the triangles in the input. Optional.
    Ids = 4,
    /// The ids of exact duplicates that were left out. Optional.
    Duplicates = 5,
    /// Where the mesh came from and how it was baked. Optional, and not part of the content.
    Provenance = 6,
    /// Where the objects stand in the world. Optional.
    Instances = 7,
    /// Which objects are closed, a triangle of each component, and how often duplicates count. Optional.
    Topology = 8,
}

impl SectionKind {
    /// All kinds in the order of their numbers on disk, which start at 1.
    pub const ALL: [Self; 8] = [
        Self::Objects,
        Self::Nodes,
        Self::Leaves,
        Self::Ids,
        Self::Duplicates,
        Self::Provenance,
        Self::Instances,
        Self::Topology,
    ];

    /// Returns the kind of a number on disk.
    pub(crate) fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|&kind| kind as u32 == number)
    }

    /// Returns true if each file has a section of this kind.
    pub fn required(self) -> bool {
        matches!(self, Self::Objects | Self::Nodes | Self::Leaves)
    }

    /// Returns true if the content checksum covers the section.
    pub fn is_content(self) -> bool {
        self != Self::Provenance
    }

    /// The alignment of sections of this kind, in bytes. Pages are mapped as they are. In other sections, vectors must
    /// not straddle lines.
    pub fn alignment(self) -> usize {
        if self == Self::Nodes { PAGE } else { LINE }
    }

    /// The name in listings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Objects => "objects",
            Self::Nodes => "nodes",
            Self::Leaves => "leaves",
            Self::Ids => "ids",
            Self::Duplicates => "duplicates",
            Self::Provenance => "provenance",
            Self::Instances => "instances",
            Self::Topology => "topology",
        }
    }
}

/// A section of a file: its kind and its place.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::checksum::checksum;
/// use bvh_format::header::{Section, SectionKind};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// for Section { kind, range, checksum: stated } in Layout::read(&bytes)?.sections {
///     assert_eq!(stated, checksum(&bytes[range.clone()]));
///     assert_eq!(range.start % kind.alignment(), 0);
///     assert!(kind == SectionKind::Provenance || kind.is_content());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// What the section holds.
    pub kind: SectionKind,
    /// The bytes of the file that belong to it.
    pub range: Range<usize>,
    /// The checksum that the section table states.
    pub checksum: u64,
}

/// Writes the header and the section table. `sections` must be in the order of the file.
pub fn write_header(file_length: u64, content_checksum: u64, sections: &[Section]) -> Vec<u8> {
    let header = Header {
        magic: MAGIC,
        major: MAJOR.into(),
        minor: MINOR.into(),
        sections: (sections.len() as u32).into(),
        file_length: file_length.into(),
        content_checksum: content_checksum.into(),
        header_checksum: 0.into(),
        reserved: [0; 24],
    };
    let mut head = header.as_bytes().to_vec();
    for section in sections {
        let entry = SectionEntry {
            kind: (section.kind as u32).into(),
            required: u32::from(section.kind.required()).into(),
            offset: (section.range.start as u64).into(),
            length: (section.range.len() as u64).into(),
            checksum: section.checksum.into(),
        };
        head.extend_from_slice(entry.as_bytes());
    }
    let sum = checksum(&head);
    head[32..40].copy_from_slice(&sum.to_le_bytes());
    head
}

/// Reads and checks the header and the section table of a file of `length` bytes that starts with `bytes`: all of it or
/// [`MAX_HEAD_BYTES`].
///
/// # Errors
/// The first of rules 1 to 9 that does not hold.
pub(crate) fn read_header(bytes: &[u8], length: u64) -> Result<(Header, Vec<Section>), FormatError> {
    let start = &bytes[..bytes.len().min(MAGIC.len())];
    ensure(start == MAGIC, Rule::Magic, 0, || {
        let text = format!("\"{}\"", start.escape_ascii());
        let found = if start.is_empty() { "an empty file".into() } else { text };
        ("the magic bytes of a .cbvh file".into(), found)
    })?;
    let (header, rest) = Header::read_from_prefix(bytes).map_err(|_| {
        FormatError::new(Rule::HeaderSize, 0, format!("{} bytes or more", size_of::<Header>()), bytes.len())
    })?;
    ensure(header.major.get() == MAJOR, Rule::Version, 8, || {
        (format!("version {MAJOR}.x"), version_name((header.major.get(), header.minor.get())))
    })?;
    let count = header.sections.get() as usize;
    ensure(count <= MAX_SECTIONS, Rule::SectionCount, 12, || ("at most 64".into(), count.to_string()))?;
    let (entries, _) = <[SectionEntry]>::ref_from_prefix_with_elems(rest, count)
        .map_err(|_| FormatError::new(Rule::SectionCount, 12, "a table within the file", count))?;
    let sum = head_checksum(&header, entries);
    require(Rule::HeaderChecksum, 32, hex(header.header_checksum.get()), hex(sum))?;
    require(Rule::FileLength, 16, header.file_length.get(), length)?;
    let sections = read_entries(entries, usize::try_from(length).unwrap_or(usize::MAX))?;
    Ok((header, sections))
}

/// Returns the checksum of a head, which counts its own checksum as 0.
pub(crate) fn head_checksum(header: &Header, entries: &[SectionEntry]) -> u64 {
    let unsummed = Header { header_checksum: 0.into(), ..*header };
    let mut hasher = Hasher::default();
    hasher.update(unsummed.as_bytes());
    hasher.update(entries.as_bytes());
    hasher.finish()
}

/// Returns the header and the section table of a file to change them; `None` if it is shorter than they are.
pub(crate) fn head_mut(file: &mut [u8]) -> Option<(&mut Header, &mut [SectionEntry])> {
    let (header, rest) = Header::mut_from_prefix(file).ok()?;
    let (entries, _) =
        <[SectionEntry]>::mut_from_prefix_with_elems(rest, header.sections.get() as usize).ok()?;
    Some((header, entries))
}

fn read_entries(entries: &[SectionEntry], file_length: usize) -> Result<Vec<Section>, FormatError> {
    let mut sections: Vec<Section> = Vec::new();
    let mut free_from = head_bytes(entries.len());
    for (index, entry) in entries.iter().enumerate() {
        let at = (size_of::<Header>() + index * size_of::<SectionEntry>()) as u64;
        let (offset, length) = (entry.offset.get(), entry.length.get());
        let kind = SectionKind::from_number(entry.kind.get());
        let alignment = kind.map_or(LINE, SectionKind::alignment);
        let place = || (format!("a multiple of {alignment} from {free_from}"), format!("{offset}"));
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let fits = start % alignment == 0 && start >= free_from;
        ensure(fits, Rule::SectionPlace, at + 8, place)?;
        let end = usize::try_from(length).ok().and_then(|length| start.checked_add(length));
        let end = end.filter(|&end| end <= file_length).ok_or_else(|| {
            let expected = format!("at most {} bytes", file_length.saturating_sub(start));
            FormatError::new(Rule::SectionPlace, at + 16, expected, length)
        })?;
        free_from = end;
        match kind {
            Some(kind) => {
                let once = sections.iter().all(|section| section.kind != kind);
                ensure(once, Rule::SectionOnce, at, || {
                    (format!("one section of kind {}", kind.name()), "two".into())
                })?;
                sections.push(Section { kind, range: start..end, checksum: entry.checksum.get() });
            }
            None => {
                let skip = entry.required.get() == 0;
                let unknown = || ("a known kind of section".into(), format!("kind {}", entry.kind));
                ensure(skip, Rule::SectionKnown, at, unknown)?;
            }
        }
    }
    for kind in SectionKind::ALL.into_iter().filter(|kind| kind.required()) {
        let there = sections.iter().any(|section| section.kind == kind);
        let at = size_of::<Header>() as u64;
        ensure(there, Rule::SectionOnce, at, || {
            (format!("a section of kind {}", kind.name()), "none".into())
        })?;
    }
    Ok(sections)
}
