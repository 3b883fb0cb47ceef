//! Puts the parts of a file together: every block is copied once, to where it stays.

use crate::encode::{Ends, PageParts};
use crate::report::BakeReport;
use bvh_format::checksum::checksum;
use bvh_format::header::{Section, SectionKind, write_header};
use bvh_format::ids::WORD;
use bvh_format::layout::ContentHasher;
use bvh_format::leaf::LINE;
use bvh_format::object::{ObjectRecord, write_objects};
use bvh_format::page::PAGE;
use rayon::prelude::*;
use std::ops::Range;

/// What goes into a file.
pub(crate) struct Contents<'a> {
    pub(crate) records: Vec<(String, ObjectRecord)>,
    pub(crate) pages: Vec<PageParts>,
    /// Where the pages' blocks end.
    pub(crate) ends: Ends,
    pub(crate) ids: bool,
    pub(crate) duplicates: Vec<[u32; 2]>,
    pub(crate) provenance: &'a str,
}

/// Lays the sections out page by page and writes the header.
pub(crate) fn assemble(contents: Contents<'_>, report: &mut BakeReport) -> Vec<u8> {
    let Contents { records, pages, ends, ids, mut duplicates, provenance } = contents;
    duplicates.sort_unstable();
    let duplicates: Vec<u8> = duplicates.iter().flatten().flat_map(|id| id.to_le_bytes()).collect();
    let objects = write_objects(&records);
    let mut sections = Sections::default();
    let objects_at = sections.add(SectionKind::Objects, objects.len());
    let nodes = sections.add(SectionKind::Nodes, ends.pages * PAGE);
    let leaves = sections.add(SectionKind::Leaves, ends.leaf_lines * LINE);
    let ids = if ids {
        sections.add(SectionKind::Ids, ends.id_words * WORD)
    } else {
        sections.end()..sections.end()
    };
    report.node_bytes = nodes.len() as u64;
    report.triangle_bytes = leaves.len() as u64;
    report.id_bytes = (ids.len() + duplicates.len()) as u64;
    let mut small = vec![(objects_at, objects)];
    if !duplicates.is_empty() {
        small.push((sections.add(SectionKind::Duplicates, duplicates.len()), duplicates));
    }
    if !provenance.is_empty() {
        let range = sections.add(SectionKind::Provenance, provenance.len());
        small.push((range, provenance.as_bytes().to_vec()));
    }
    let mut bytes = vec![0; sections.end()];
    report.file_bytes = bytes.len() as u64;
    copy_pages(&mut bytes, [nodes, leaves, ids], pages);
    small.iter().for_each(|(range, data)| bytes[range.clone()].copy_from_slice(data));
    let header = sections.header(&bytes);
    bytes[..header.len()].copy_from_slice(&header);
    bytes
}

/// Copies all pages and their blocks to the sections of nodes, leaves and ids.
fn copy_pages(bytes: &mut [u8], sections: [Range<usize>; 3], pages: Vec<PageParts>) {
    let mut rest = bytes;
    let mut at = 0;
    let mut take = |range: Range<usize>| {
        let (_, behind) = std::mem::take(&mut rest).split_at_mut(range.start - at);
        let (section, behind) = behind.split_at_mut(range.len());
        (rest, at) = (behind, range.end);
        section
    };
    let mut places = sections.map(&mut take);
    // The last page takes what is left of each section, and there is nothing more.
    let mut next = |section: usize, length: usize| {
        let (place, behind) = std::mem::take(&mut places[section]).split_at_mut(length);
        places[section] = behind;
        place
    };
    let copies: Vec<_> = pages
        .into_iter()
        .map(|part| {
            let places = [part.page.len(), part.leaf_block.len(), part.id_block.len()];
            ([next(0, places[0]), next(1, places[1]), next(2, places[2])], part)
        })
        .collect();
    copies.into_par_iter().for_each(|([page, leaf_block, id_block], part)| {
        page.copy_from_slice(&part.page);
        leaf_block.copy_from_slice(&part.leaf_block);
        id_block.copy_from_slice(&part.id_block);
    });
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
