//! Takes files apart, puts them together, and corrects the checksums of changed files, so that a reader reaches the
//! change. All functions accept any bytes; those that write checksums need a header.

use bvh_format::checksum::checksum;
use std::ops::Range;

const PAGE: usize = 4096;
const LINE: usize = 64;

/// A section: its kind, a 1 if readers must know it, and its bytes.
pub type Section = (u32, u32, Vec<u8>);

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

fn u64_at(bytes: &[u8], at: usize) -> usize {
    let [low, high] = [at, at + 4].map(|at| u64::from(u32_at(bytes, at)));
    usize::try_from(low | high << 32).unwrap_or(usize::MAX)
}

/// Replaces the bytes from `at` on by `value`.
pub fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    bytes[at..at + value.len()].copy_from_slice(value);
}

/// Returns the entries of the section table that the file has: the offset of each entry, the kind, and the range of the section if the
/// file contains it.
fn entries(bytes: &[u8]) -> Vec<(usize, u32, Option<Range<usize>>)> {
    let places = (0..u32_at(bytes, 12).min(64) as usize).map(head).filter(|at| at + 32 <= bytes.len());
    let entry = |at: usize| {
        let start = u64_at(bytes, at + 8);
        let end = start.saturating_add(u64_at(bytes, at + 16));
        (at, u32_at(bytes, at), (start <= end && end <= bytes.len()).then_some(start..end))
    };
    places.map(entry).collect()
}

/// Returns the range of the first section of a kind, or an empty range if there is none.
pub fn section(bytes: &[u8], kind: u32) -> Range<usize> {
    entries(bytes).into_iter().find(|entry| entry.1 == kind).and_then(|entry| entry.2).unwrap_or(0..0)
}

/// Returns the sections of a file, which must contain everything that its table names.
pub fn take_apart(bytes: &[u8]) -> Vec<Section> {
    let all = entries(bytes).into_iter();
    all.map(|(at, kind, range)| (kind, u32_at(bytes, at + 4), bytes[range.unwrap()].to_vec())).collect()
}

/// The bytes of the header and of a section table of so many entries.
fn head(sections: usize) -> usize {
    64 + 32 * sections
}

/// Returns a file of these sections with correct checksums.
pub fn put_together(sections: &[Section]) -> Vec<u8> {
    let mut bytes = vec![0; head(sections.len())];
    put(&mut bytes, 0, &[0x89, b'c', b'b', b'v', b'h', 13, 10, 26, 1, 0, 0, 0]);
    put(&mut bytes, 12, &(sections.len() as u32).to_le_bytes());
    for (index, (kind, required, data)) in sections.iter().enumerate() {
        let at = head(index);
        // Nodes, kind 2, start at pages, the others at lines.
        bytes.resize(bytes.len().next_multiple_of(if *kind == 2 { PAGE } else { LINE }), 0);
        let (offset, length) = (bytes.len() as u64, data.len() as u64);
        put(&mut bytes, at, &kind.to_le_bytes());
        put(&mut bytes, at + 4, &required.to_le_bytes());
        put(&mut bytes, at + 8, &offset.to_le_bytes());
        put(&mut bytes, at + 16, &length.to_le_bytes());
        bytes.extend_from_slice(data);
    }
    bytes.resize(bytes.len().next_multiple_of(LINE), 0);
    seal(&mut bytes);
    bytes
}

/// Corrects all checksums and the length.
pub fn seal(bytes: &mut [u8]) {
    seal_blocks(bytes);
    seal_pages(bytes);
    seal_sections(bytes);
    seal_header(bytes);
}

/// The checksums that are corrected in a damaged file, more from each to the next but for those of the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Seal {
    /// None.
    None,
    /// That of the header and the section table only.
    Header,
    /// Those of blocks and pages.
    Pages,
    /// Those of sections and the content as well.
    Sections,
    /// All.
    All,
}

impl Seal {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::None, Self::Header, Self::Pages, Self::Sections, Self::All];

    /// Corrects these checksums. What is too short for a header stays as it is.
    pub fn apply(self, bytes: &mut [u8]) {
        if bytes.len() < 64 {
            return;
        }
        if self >= Self::Pages {
            seal_blocks(bytes);
            seal_pages(bytes);
        }
        if self >= Self::Sections {
            seal_sections(bytes);
        }
        if self == Self::Header || self == Self::All {
            seal_header(bytes);
        }
    }
}

/// Corrects the checksums of leaf and id blocks, which are stored in the page headers.
pub fn seal_blocks(bytes: &mut [u8]) {
    let (leaves, ids) = (section(bytes, 3), section(bytes, 4));
    for at in section(bytes, 2).step_by(PAGE) {
        for (whole, place, count, sum, unit) in [(&leaves, 24, 48, 8, 64), (&ids, 32, 52, 16, 8)] {
            let start = whole.start.saturating_add(u64_at(bytes, at + place).saturating_mul(unit));
            let end = start.saturating_add((u32_at(bytes, at + count) as usize).saturating_mul(unit));
            let block = if end <= whole.end { &bytes[start..end] } else { &[] };
            // Without an id block, the field is 0.
            let value = if sum == 16 && block.is_empty() { 0 } else { checksum(block) };
            if at + 64 <= bytes.len() {
                put(bytes, at + sum, &value.to_le_bytes());
            }
        }
    }
}

/// Corrects the checksums of pages.
pub fn seal_pages(bytes: &mut [u8]) {
    for at in section(bytes, 2).step_by(PAGE) {
        if let Some(page) = bytes.get(at + 8..at + PAGE) {
            let sum = checksum(page);
            put(bytes, at, &sum.to_le_bytes());
        }
    }
}

/// Corrects the checksums in the section table and the checksum of the content.
pub fn seal_sections(bytes: &mut [u8]) {
    let mut content = Vec::new();
    for (at, kind, range) in entries(bytes) {
        let Some(range) = range else { continue };
        let sum = checksum(&bytes[range.clone()]);
        put(bytes, at + 24, &sum.to_le_bytes());
        // All kinds of content; 6 is the provenance.
        if matches!(kind, 1..=5 | 7 | 8) {
            content.extend(kind.to_le_bytes());
            content.extend((range.len() as u64).to_le_bytes());
            content.extend_from_slice(&bytes[range]);
        }
    }
    put(bytes, 24, &checksum(&content).to_le_bytes());
}

/// Corrects the length and the checksum of the header and the section table.
pub fn seal_header(bytes: &mut [u8]) {
    let length = bytes.len() as u64;
    put(bytes, 16, &length.to_le_bytes());
    put(bytes, 32, &[0; 8]);
    let end = head(u32_at(bytes, 12).min(64) as usize).min(bytes.len());
    let sum = checksum(&bytes[..end]);
    put(bytes, 32, &sum.to_le_bytes());
}
