//! Puts the parts of a file together: every block is copied once, to where it stays.

use crate::encode::{Ends, PageParts};
use bvh_format::checksum::checksum;
use bvh_format::header::{Section, SectionKind, write_header};
use bvh_format::ids::WORD;
use bvh_format::layout::ContentHasher;
use bvh_format::leaf::LINE;
use bvh_format::object::{ObjectRecord, write_objects};
use bvh_format::page::PAGE;
use rayon::prelude::*;
use std::ops::Range;

/// What the objects of a file bring to it.
#[derive(Default)]
pub(crate) struct Contents {
    pub(crate) records: Vec<(String, ObjectRecord)>,
    pub(crate) pages: Vec<PageParts>,
    /// Where the pages' blocks end.
    pub(crate) ends: Ends,
    /// (kept id, id of an equal triangle left out).
    pub(crate) duplicates: Vec<[u32; 2]>,
}

/// Lays the sections out page by page and writes the header.
pub(crate) fn assemble(contents: Contents, with_ids: bool, provenance: &str) -> Vec<u8> {
    let Contents { records, pages, ends, mut duplicates } = contents;
    let objects = write_objects(&records);
    let mut sections = Sections::default();
    let mut small = vec![(sections.add(SectionKind::Objects, objects.len()), objects)];
    let nodes = sections.add(SectionKind::Nodes, ends.pages * PAGE);
    let leaves = sections.add(SectionKind::Leaves, ends.leaf_lines * LINE);
    let mut ids = leaves.end..leaves.end;
    if with_ids {
        ids = sections.add(SectionKind::Ids, ends.id_words * WORD);
        if !duplicates.is_empty() {
            duplicates.sort_unstable();
            let duplicates: Vec<u8> = duplicates.iter().flatten().flat_map(|id| id.to_le_bytes()).collect();
            small.push((sections.add(SectionKind::Duplicates, duplicates.len()), duplicates));
        }
    }
    if !provenance.is_empty() {
        let range = sections.add(SectionKind::Provenance, provenance.len());
        small.push((range, provenance.as_bytes().to_vec()));
    }
    let mut bytes = vec![0; sections.end()];
    copy_pages(&mut bytes, [nodes, leaves, ids], pages);
    small.iter().for_each(|(range, data)| bytes[range.clone()].copy_from_slice(data));
    let header = sections.header(&bytes);
    bytes[..header.len()].copy_from_slice(&header);
    bytes
}

/// Copies all pages and their blocks to the sections of nodes, leaves and ids, which follow each other.
fn copy_pages(bytes: &mut [u8], [nodes, leaves, ids]: [Range<usize>; 3], pages: Vec<PageParts>) {
    let (_, rest) = bytes.split_at_mut(nodes.start);
    let (mut nodes, rest) = rest.split_at_mut(leaves.start - nodes.start);
    let (mut leaves, mut ids) = rest.split_at_mut(ids.start - leaves.start);
    let mut copies = Vec::with_capacity(pages.len());
    for part in pages {
        let places = [
            take(&mut nodes, part.page.len()),
            take(&mut leaves, part.leaf_block.len()),
            take(&mut ids, part.id_block.len()),
        ];
        copies.push((places, part));
    }
    copies.into_par_iter().for_each(|([page, leaf_block, id_block], part)| {
        page.copy_from_slice(&part.page);
        leaf_block.copy_from_slice(&part.leaf_block);
        id_block.copy_from_slice(&part.id_block);
    });
}

/// Splits off the first bytes of a slice.
fn take<'a>(rest: &mut &'a mut [u8], length: usize) -> &'a mut [u8] {
    let (taken, behind) = std::mem::take(rest).split_at_mut(length);
    *rest = behind;
    taken
}

/// The sections of a file in ascending order.
#[derive(Default)]
struct Sections(Vec<(SectionKind, Range<usize>)>);

impl Sections {
    fn add(&mut self, kind: SectionKind, length: usize) -> Range<usize> {
        let start = self.end();
        self.0.push((kind, start..start + length));
        start..start + length
    }

    /// The page behind the last section, the first behind the header.
    fn end(&self) -> usize {
        self.0.last().map_or(PAGE, |(_, range)| range.end.next_multiple_of(PAGE))
    }

    /// The header of a file whose sections are in their places.
    fn header(&self, bytes: &[u8]) -> Vec<u8> {
        let table = || {
            let section = |(kind, range): &(SectionKind, Range<usize>)| {
                let checksum = checksum(&bytes[range.clone()]);
                Section { kind: *kind, range: range.clone(), checksum }
            };
            self.0.par_iter().map(section).collect::<Vec<_>>()
        };
        let content = || {
            let mut content = ContentHasher::default();
            for (kind, range) in self.0.iter().filter(|(kind, _)| kind.is_content()) {
                content.begin(*kind, range.len() as u64);
                content.update(&bytes[range.clone()]);
            }
            content.finish()
        };
        let (table, content) = rayon::join(table, content);
        write_header(bytes.len() as u64, content, &table)
    }
}
