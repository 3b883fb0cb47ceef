//! Puts the parts of a file together, section by section from the first to the last.

use crate::bake::Stage;
use crate::draft::{Drafts, Ends, Run};
use crate::error::BakeError;
use crate::progress::{Progress, Step, Tally, WHOLE};
use crate::scratch::Spill;
use crate::sorter::Sorter;
use crate::target::Target;
use bvh_format::checksum::Hasher;
use bvh_format::header::{Section, SectionKind, write_header};
use bvh_format::layout::ContentHasher;
use bvh_format::object::{ObjectRecord, write_objects};
use bvh_format::page::PAGE;
use rayon::prelude::*;
use std::borrow::Cow;

/// Pages that are in memory at a time, unless a single run has more.
const BATCH: usize = 1024;

/// What the objects of a file bring to it.
pub(crate) struct Contents {
    pub(crate) records: Vec<(String, ObjectRecord)>,
    /// The pages of each object.
    pub(crate) drafts: Vec<Drafts>,
    /// (kept id, id of an equal triangle left out).
    pub(crate) duplicates: Sorter<[u32; 2]>,
    /// For what the sorter does not hold in memory.
    pub(crate) spill: Spill,
}

impl Contents {
    /// Pages of all objects so far.
    pub(crate) fn page_count(&self) -> usize {
        self.drafts.iter().map(Drafts::page_count).sum()
    }
}

/// Lays the sections out page by page and writes the header.
pub(crate) fn assemble(
    contents: Contents,
    with_ids: bool,
    provenance: &str,
    target: &mut Target,
    progress: &Progress,
) -> Result<(), BakeError> {
    let Contents { records, drafts, duplicates, .. } = contents;
    let runs: Vec<Vec<Run>> = drafts.iter().map(Drafts::runs).collect();
    let sum = |bytes: fn(&Drafts) -> usize| drafts.iter().map(bytes).sum::<usize>();
    let objects = write_objects(&records);
    let lengths =
        [objects.len(), sum(|d| d.page_count() * PAGE), sum(Drafts::leaf_bytes), sum(Drafts::id_bytes)];
    let rest = duplicates.count() as usize * 8 + provenance.len() + 7 * PAGE;
    let expected = (lengths.iter().sum::<usize>() + rest) as u64;
    target.expect(expected);
    target.append(&[0; PAGE])?;
    let triangles = records.iter().map(|(_, record)| record.triangles.get()).sum();
    let tally = progress.tally(Step::Bake(Stage::Encode), WHOLE, triangles, expected);
    let mut file = Sections { target, table: Vec::new(), content: ContentHasher::default(), tally };
    file.section(SectionKind::Objects, lengths[0], |section| section.write(&objects))?;
    file.section(SectionKind::Nodes, lengths[1], |section| {
        let mut ends = Ends::default();
        for (drafts, runs) in drafts.iter().zip(&runs) {
            let numbering = drafts.numbering(ends.pages as u32);
            let mut ends_of_object = ends.of_next_object();
            for batch in batches(runs) {
                for pages in numbering.pages(batch, &mut ends_of_object)? {
                    section.write(&pages)?;
                }
            }
            ends = ends_of_object;
        }
        Ok(())
    })?;
    let blocks = |section: &mut OpenSection, read: Blocks| {
        for (drafts, runs) in drafts.iter().zip(&runs) {
            for batch in batches(runs) {
                let read = batch.par_iter().map(|run| read(drafts, run)).collect::<Result<Vec<_>, _>>()?;
                read.iter().try_for_each(|blocks| section.write(blocks))?;
            }
        }
        Ok(())
    };
    file.section(SectionKind::Leaves, lengths[2], |section| blocks(section, Drafts::leaves))?;
    if with_ids {
        file.section(SectionKind::Ids, lengths[3], |section| blocks(section, Drafts::ids))?;
    }
    drop(runs);
    if with_ids && duplicates.count() > 0 {
        file.section(SectionKind::Duplicates, duplicates.count() as usize * 8, |section| {
            let mut bytes = Vec::new();
            duplicates.visit(|pair| {
                pair.iter().for_each(|id| bytes.extend_from_slice(&id.to_le_bytes()));
                if bytes.len() >= 1 << 20 {
                    section.write(&bytes)?;
                    bytes.clear();
                }
                Ok(())
            })?;
            section.write(&bytes)
        })?;
    }
    if !provenance.is_empty() {
        let text = provenance.as_bytes();
        file.section(SectionKind::Provenance, text.len(), |section| section.write(text))?;
    }
    let Sections { table, content, .. } = file;
    let header = write_header(target.length(), content.finish(), &table);
    target.replace_first(&header)
}

/// Reads the blocks of a run.
type Blocks = for<'a> fn(&'a Drafts, &Run) -> Result<Cow<'a, [u8]>, BakeError>;

/// Runs by the batch.
fn batches(runs: &[Run]) -> impl Iterator<Item = &[Run]> {
    let mut pages = 0;
    runs.chunk_by(move |run, _| {
        pages += run.page_count();
        let goes_on = pages < BATCH;
        pages = if goes_on { pages } else { 0 };
        goes_on
    })
}

/// The sections of a file in ascending order.
struct Sections<'a> {
    target: &'a mut Target,
    table: Vec<Section>,
    content: ContentHasher,
    /// Over the bytes of the sections.
    tally: Tally<'a>,
}

impl Sections<'_> {
    /// Adds a section of so many bytes, which `write` writes, and fills its last page.
    fn section(
        &mut self,
        kind: SectionKind,
        length: usize,
        write: impl FnOnce(&mut OpenSection) -> Result<(), BakeError>,
    ) -> Result<(), BakeError> {
        let start = self.target.length() as usize;
        if kind.is_content() {
            self.content.begin(kind, length as u64);
        }
        let content = kind.is_content().then_some(&mut self.content);
        let (target, tally) = (&mut *self.target, &self.tally);
        let mut section = OpenSection { target, checksum: Hasher::default(), content, tally };
        write(&mut section)?;
        let checksum = section.checksum.finish();
        self.table.push(Section { kind, range: start..start + length, checksum });
        let end = self.target.length() as usize;
        self.target.append(&[0; PAGE][..end.next_multiple_of(PAGE) - end])
    }
}

/// The section that is being written.
struct OpenSection<'a> {
    target: &'a mut Target,
    checksum: Hasher,
    content: Option<&'a mut ContentHasher>,
    tally: &'a Tally<'a>,
}

impl OpenSection<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), BakeError> {
        let Self { target, checksum, content, tally } = self;
        tally.add(bytes.len() as u64);
        let hash_content = || {
            if let Some(content) = content {
                content.update(bytes);
            }
        };
        let hash = || rayon::join(|| checksum.update(bytes), hash_content);
        rayon::join(|| target.append(bytes), hash).0
    }
}
