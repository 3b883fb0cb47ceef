//! Puts the parts of a file together, section by section from the first to the last.

use crate::error::BakeError;
use crate::pages::unnumbered::{Numbering, ObjectPages};
use crate::storage::external_sort::Sorter;
use crate::storage::output::Output;
use crate::storage::{Piece, Spill};
use crate::threads;
use crate::topology::TopologyLists;
use bvh_format::checksum::Hasher;
use bvh_format::header::{Section, SectionKind, head_bytes, write_header};
use bvh_format::instances::{Instance, write_instances};
use bvh_format::layout::ContentHasher;
use bvh_format::leaf::LINE;
use bvh_format::object::{ObjectRecord, write_objects};
use bvh_format::page::{PAGE, PagePlace};
use bvh_format::topology::write_topology_head;
use std::sync::Arc;

/// The most bytes of a section that are in memory at a time under a memory budget, unless a single brick has more.
const MAX_BATCH_BYTES: usize = 8 << 20;

/// The parts of a file.
pub(crate) struct Contents {
    pub(crate) records: Vec<(String, ObjectRecord)>,
    /// The pages of each object.
    pub(crate) objects: Vec<ObjectPages>,
    /// Where the objects stand, if the file is a scene.
    pub(crate) instances: Vec<Instance>,
    /// The pairs (kept id, id of an equal triangle that is left out).
    pub(crate) duplicates: Sorter<[u32; 2]>,
    /// Which objects are closed, and so on, if the file is to state it.
    pub(crate) topology: TopologyLists,
    /// The place for records that the sorter and the lists do not hold in memory.
    pub(crate) spill: Spill,
}

/// Writes the sections page by page, and then the header.
pub(crate) fn assemble(
    contents: Contents,
    with_ids: bool,
    provenance: &str,
    output: &mut Output,
) -> Result<(), BakeError> {
    let Contents { records, objects, instances, duplicates, topology, spill } = contents;
    let sum = |bytes: fn(&ObjectPages) -> usize| objects.iter().map(bytes).sum::<usize>();
    let table = write_objects(&records);
    let lengths = [
        table.len(),
        sum(|object| object.page_count() * PAGE),
        sum(ObjectPages::leaf_bytes),
        sum(ObjectPages::id_bytes),
    ];
    let instances = if instances.is_empty() { Vec::new() } else { write_instances(&instances) };
    let topology_bytes = if topology.records.is_empty() { 0 } else { topology.bytes() };
    let rest =
        duplicates.count() as usize * 8 + provenance.len() + instances.len() + topology_bytes + 2 * PAGE;
    let expected = (lengths.iter().sum::<usize>() + rest) as u64;
    output.expect(expected);
    let has_duplicates = with_ids && duplicates.count() > 0;
    let optional =
        [with_ids, has_duplicates, !provenance.is_empty(), !instances.is_empty(), topology_bytes > 0];
    let sections = 3 + optional.into_iter().filter(|&is_there| is_there).count();
    output.append(Arc::new(vec![0; head_bytes(sections)]))?;
    let mut file = Sections { output, table: Vec::new(), content: ContentHasher::default() };
    file.section(SectionKind::Objects, lengths[0], |section| section.write(table))?;
    let (mut leaves, mut ids) = (Vec::new(), Vec::new());
    file.section(SectionKind::Nodes, lengths[1], |section| {
        write_nodes(section, objects, &mut leaves, &mut ids)
    })?;
    file.section(SectionKind::Leaves, lengths[2], |section| write_blocks(section, leaves))?;
    if with_ids {
        file.section(SectionKind::Ids, lengths[3], |section| write_blocks(section, ids))?;
    }
    if has_duplicates {
        let length = duplicates.count() as usize * 8;
        file.section(SectionKind::Duplicates, length, |section| write_duplicates(section, duplicates))?;
    }
    if !provenance.is_empty() {
        let text = provenance.as_bytes();
        file.section(SectionKind::Provenance, text.len(), |section| section.write(text.to_vec()))?;
    }
    if !instances.is_empty() {
        file.section(SectionKind::Instances, instances.len(), |section| section.write(instances))?;
    }
    if topology_bytes > 0 {
        file.section(SectionKind::Topology, topology_bytes, |section| {
            write_topology(section, topology, &spill)
        })?;
    }
    file.align(LINE)?;
    let Sections { table, content, .. } = file;
    let header = write_header(output.length(), content.finish(), &table);
    output.replace_first(header)
}

/// Numbers the pages of all objects and writes them. Lists their leaf blocks and id blocks, which follow later in the file.
fn write_nodes(
    section: &mut OpenSection,
    objects: Vec<ObjectPages>,
    leaves: &mut Vec<Piece<u8>>,
    ids: &mut Vec<Piece<u8>>,
) -> Result<(), BakeError> {
    let mut place = PagePlace::default();
    for ObjectPages { profile, parts, parents } in objects {
        let numbering = Numbering { profile, parents, first: place.page };
        place = place.of_next_object();
        let mut pages = Vec::new();
        for part in parts {
            pages.push(part.pages);
            leaves.push(part.leaves);
            ids.push(part.ids);
        }
        in_batches(pages, |mut batch| {
            numbering.number(&mut batch, &mut place);
            batch.into_iter().try_for_each(|pages| section.write(pages))
        })?;
    }
    Ok(())
}

fn write_blocks(section: &mut OpenSection, pieces: Vec<Piece<u8>>) -> Result<(), BakeError> {
    in_batches(pieces, |batch| batch.into_iter().try_for_each(|blocks| section.write(blocks)))
}

fn write_duplicates(section: &mut OpenSection, duplicates: Sorter<[u32; 2]>) -> Result<(), BakeError> {
    let mut bytes = Vec::new();
    duplicates.visit(|pair| {
        pair.iter().for_each(|id| bytes.extend_from_slice(&id.to_le_bytes()));
        if bytes.len() >= 1 << 20 {
            section.write(std::mem::take(&mut bytes))?;
        }
        Ok(())
    })?;
    section.write(bytes)
}

fn write_topology(
    section: &mut OpenSection,
    mut topology: TopologyLists,
    spill: &Spill,
) -> Result<(), BakeError> {
    topology.components.finish(spill)?;
    topology.nets.finish(spill)?;
    section.write(write_topology_head(&topology.records))?;
    for piece in topology.components.pieces() {
        section.write(little_endian(&piece.all()?))?;
    }
    let nets = topology.nets.pieces();
    nets.iter().try_for_each(|piece| section.write(little_endian(piece.all()?.as_flattened())))
}

fn little_endian(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Takes pieces out of their storage, a batch at a time, and visits the batches in order.
fn in_batches(
    pieces: Vec<Piece<u8>>,
    mut visit: impl FnMut(Vec<Vec<u8>>) -> Result<(), BakeError>,
) -> Result<(), BakeError> {
    let mut pieces = pieces.into_iter().peekable();
    while pieces.peek().is_some() {
        let (mut batch, mut bytes) = (Vec::new(), 0);
        // Pieces in memory need no further memory.
        while let Some(piece) = pieces.next_if(|piece| {
            batch.is_empty() || piece.in_memory().is_some() || bytes + piece.len() <= MAX_BATCH_BYTES
        }) {
            bytes += if piece.in_memory().is_some() { 0 } else { piece.len() };
            batch.push(piece);
        }
        visit(threads::map(batch, Piece::take).into_iter().collect::<Result<_, _>>()?)?;
    }
    Ok(())
}

/// The sections of a file in ascending order.
struct Sections<'a> {
    output: &'a mut Output,
    table: Vec<Section>,
    /// The hasher over the bytes of all sections.
    content: ContentHasher,
}

impl Sections<'_> {
    /// Fills the file with zeros up to a multiple of `bytes`.
    fn align(&mut self, bytes: usize) -> Result<(), BakeError> {
        let end = self.output.length() as usize;
        self.output.append(Arc::new(vec![0; end.next_multiple_of(bytes) - end]))
    }

    /// Adds a section of `length` bytes, which `write` writes.
    fn section(
        &mut self,
        kind: SectionKind,
        length: usize,
        write: impl FnOnce(&mut OpenSection) -> Result<(), BakeError>,
    ) -> Result<(), BakeError> {
        self.align(kind.alignment())?;
        let start = self.output.length() as usize;
        if kind.is_content() {
            self.content.begin(kind, length as u64);
        }
        let content = kind.is_content().then_some(&mut self.content);
        let output = &mut *self.output;
        let mut section = OpenSection { output, checksum: Hasher::default(), content, waiting: Vec::new() };
        write(&mut section)?;
        section.flush()?;
        let checksum = section.checksum.finish();
        self.table.push(Section { kind, range: start..start + length, checksum });
        Ok(())
    }
}

/// The least number of bytes that are written and hashed at once, and side by side, because each time waits for other
/// threads.
const MIN_WRITE_BYTES: usize = 1 << 18;

/// The section that is being written.
struct OpenSection<'a> {
    output: &'a mut Output,
    checksum: Hasher,
    content: Option<&'a mut ContentHasher>,
    /// Bytes that are too few to be written yet.
    waiting: Vec<u8>,
}

impl OpenSection<'_> {
    fn write(&mut self, bytes: Vec<u8>) -> Result<(), BakeError> {
        if self.waiting.is_empty() {
            self.waiting = bytes;
        } else {
            self.waiting.extend_from_slice(&bytes);
        }
        if self.waiting.len() >= MIN_WRITE_BYTES { self.flush() } else { Ok(()) }
    }

    /// Writes the bytes that wait.
    fn flush(&mut self) -> Result<(), BakeError> {
        let Self { output, checksum, content, waiting } = self;
        let bytes = Arc::new(std::mem::take(waiting));
        let hash_content = || {
            if let Some(content) = content {
                content.update(&bytes);
            }
        };
        let pays = bytes.len() >= MIN_WRITE_BYTES;
        let hash = || threads::join_if(pays, || checksum.update(&bytes), hash_content);
        threads::join_if(pays, || output.append(bytes.clone()), hash).0
    }
}
