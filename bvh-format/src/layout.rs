//! Finds the sections, objects, pages and blocks of a file in its bytes, without copying any.

use crate::checksum::hex;
use crate::checksum::{Hasher, checksum};
use crate::error::{FormatError, ensure, require};
use crate::header::{Header, MAX_HEAD_BYTES, Section, SectionKind, read_header};
use crate::ids::{WORD, id_block_bytes};
use crate::instances::{Instance, read_instances};
use crate::leaf::{F32_PACKET_BYTES, LINE, PackedHead, TriangleEncoding, corrections_of};
use crate::object::{Object, read_objects};
use crate::page::{MAX_PAGES, PAGE, Page, PageHeader};
use crate::rule::Rule;
use crate::source::{Block, MAX_BLOCK_BYTES, PageBytes, Source, chunks};
use crate::topology::{ObjectTopology, check_lists, read_records};
use std::ops::Range;
use zerocopy::FromBytes;
use zerocopy::little_endian::U32;

/// Where everything is in a file. Reading it takes the head of the file and the object table, and nothing else.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::page::{Page, check_page};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// for object in &layout.objects {
///     for number in object.pages() {
///         let page = layout.page_bytes(&bytes, number).expect("a page of the file");
///         check_page(page, number, object, layout.page_offset(number))?;
///         let header = Page::new(page, object.profile()).header();
///         println!("page {number}: {} treelets, {} packets", header.treelets, header.packets);
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Layout {
    /// Major and minor version.
    pub version: (u16, u16),
    /// The content checksum that the header states.
    pub content_checksum: u64,
    /// The known sections in the order of the file.
    pub sections: Vec<Section>,
    /// The objects in the order of the table.
    pub objects: Vec<Object>,
    nodes: Range<usize>,
    leaves: Range<usize>,
    ids: Option<Range<usize>>,
    duplicates: Option<Range<usize>>,
    instances: Option<Section>,
    topology: Option<Section>,
}

impl Layout {
    /// Reads and checks the header, the section table and the object table of a file in memory. The cost grows
    /// with the number of objects, and not with the length of the file.
    ///
    /// # Errors
    /// The first of rules 1 to 9 and 11 to 14 that does not hold, or rule 10 for the object table.
    pub fn read(bytes: &[u8]) -> Result<Self, FormatError> {
        Self::read_from(bytes)
    }

    /// Does the same as [`Layout::read`] for a file whose bytes are read piece by piece: first its head, then the
    /// object section.
    ///
    /// # Errors
    /// The errors of [`Layout::read`], and those of the source.
    pub fn read_from<S: Source + ?Sized>(source: &S) -> Result<Self, S::Error> {
        let length = source.length();
        let head = source.read(0..length.min(MAX_HEAD_BYTES as u64) as usize)?;
        let (header, sections) = read_header(&head, length)?;
        let objects = sections.iter().find(|section| section.kind == SectionKind::Objects);
        let table = source.read(objects.map_or(0..0, |section| section.range.clone()))?;
        Ok(Self::from_tables(&header, sections, &table)?)
    }

    /// Makes the layout from checked sections and the bytes of the object section.
    fn from_tables(
        header: &Header,
        sections: Vec<Section>,
        object_table: &[u8],
    ) -> Result<Self, FormatError> {
        let section = |kind| sections.iter().find(|section: &&Section| section.kind == kind).cloned();
        let find = |kind| section(kind).map(|section| section.range);
        // `read_header` has made sure of the required sections.
        let needed = |kind| find(kind).unwrap_or(0..0);
        let (nodes, table) = (needed(SectionKind::Nodes), needed(SectionKind::Objects));
        // No page checksum guards origins and exponents, so the checksum of the section does.
        let stated = sections.iter().find(|section| section.kind == SectionKind::Objects);
        let stated = stated.map_or(0, |section| section.checksum);
        let found = checksum(object_table);
        require(Rule::SectionChecksum, table.start as u64, hex(stated), hex(found))?;
        ensure(nodes.len() % PAGE == 0, Rule::ObjectPages, nodes.start as u64, || {
            (format!("whole pages of {PAGE} bytes"), nodes.len().to_string())
        })?;
        let pages = (nodes.len() / PAGE) as u64;
        ensure(pages <= MAX_PAGES, Rule::ObjectPages, nodes.start as u64, || {
            (format!("at most {MAX_PAGES} pages"), pages.to_string())
        })?;
        let objects = read_objects(object_table, table.start as u64, pages)?;
        Ok(Self {
            version: (header.major.get(), header.minor.get()),
            content_checksum: header.content_checksum.get(),
            objects,
            nodes,
            leaves: needed(SectionKind::Leaves),
            ids: find(SectionKind::Ids),
            duplicates: find(SectionKind::Duplicates),
            instances: section(SectionKind::Instances),
            topology: section(SectionKind::Topology),
            sections,
        })
    }

    /// The number of pages in the node section.
    pub fn page_count(&self) -> u32 {
        (self.nodes.len() / PAGE) as u32
    }

    /// The byte offset of a page in the file.
    pub fn page_offset(&self, page: u32) -> u64 {
        self.nodes.start as u64 + u64::from(page) * PAGE as u64
    }

    /// The bytes of the file that are a page; `None` beyond the last page.
    #[inline]
    pub(crate) fn page_range(&self, page: u32) -> Option<Range<usize>> {
        units_within(&self.nodes, page.into(), 1, PAGE)
    }

    /// The bytes of a page; `None` beyond the last page.
    #[inline]
    pub fn page_bytes<'a>(&self, bytes: &'a [u8], page: u32) -> Option<&'a [u8; PAGE]> {
        bytes.get(self.page_range(page)?)?.first_chunk()
    }

    /// Reads a page, without checking it.
    ///
    /// # Errors
    /// Rule 13 beyond the last page, and the errors of the source.
    pub fn read_page<'a, S: Source + ?Sized>(
        &self,
        source: &'a S,
        number: u32,
    ) -> Result<PageBytes<'a>, S::Error> {
        let at = self.page_offset(number);
        let range = self.page_range(number).ok_or_else(|| {
            FormatError::new(
                Rule::ObjectPages,
                at,
                "a page within the node section",
                format!("page {number}"),
            )
        })?;
        Ok(PageBytes::new(source.read(range)?))
    }

    /// The bytes of the file that are the leaf block of a page; `None` if the header leads out of the leaf section.
    #[inline]
    pub(crate) fn leaf_range(&self, header: &PageHeader) -> Option<Range<usize>> {
        units_within(&self.leaves, header.leaf_line.get(), header.leaf_lines.get(), LINE)
    }

    /// The leaf block of a page; empty if the header leads out of the leaf section.
    #[inline]
    pub fn leaf_block<'a>(&self, bytes: &'a [u8], header: &PageHeader) -> &'a [u8] {
        self.leaf_range(header).and_then(|range| bytes.get(range)).unwrap_or(&[])
    }

    /// Reads the leaf block of a page, without checking it. It is empty if the header leads out of the leaf section.
    ///
    /// # Errors
    /// The errors of the source.
    pub fn read_leaf_block<'a, S: Source + ?Sized>(
        &self,
        source: &'a S,
        header: &PageHeader,
    ) -> Result<Block<'a>, S::Error> {
        Block::read(source, self.leaf_range(header))
    }

    /// The bytes of the file that are the id block of a page; `None` if the header leads out of the id section.
    #[inline]
    pub(crate) fn id_range(&self, header: &PageHeader) -> Option<Range<usize>> {
        units_within(self.ids.as_ref()?, header.id_word.get(), header.id_words.get(), WORD)
    }

    /// The id block of a page; empty if there are no ids.
    #[inline]
    pub fn id_block<'a>(&self, bytes: &'a [u8], header: &PageHeader) -> &'a [u8] {
        self.id_range(header).and_then(|range| bytes.get(range)).unwrap_or(&[])
    }

    /// Reads the id block of a page, without checking it. It is empty if there are no ids.
    ///
    /// # Errors
    /// The errors of the source.
    pub fn read_id_block<'a, S: Source + ?Sized>(
        &self,
        source: &'a S,
        header: &PageHeader,
    ) -> Result<Block<'a>, S::Error> {
        Block::read(source, self.id_range(header))
    }

    /// Returns true if the file holds the ids of its triangles.
    pub fn has_ids(&self) -> bool {
        self.ids.is_some()
    }

    /// The ascending pairs of a kept id and the id of an exact duplicate that was left out.
    pub fn duplicate_ids<'a>(&self, bytes: &'a [u8]) -> &'a [[U32; 2]] {
        let section = self.duplicates.clone().and_then(|range| bytes.get(range)).unwrap_or(&[]);
        let whole = section.len() / 8 * 8;
        <[[U32; 2]]>::ref_from_bytes(&section[..whole]).unwrap_or(&[])
    }

    /// Returns true if the file is a scene, which says where its objects stand in the world.
    pub fn has_instances(&self) -> bool {
        self.instances.is_some()
    }

    /// Reads and checks the instances section. There are no instances without one. The cost grows with the section.
    ///
    /// # Errors
    /// Rule 10 for this section, and rules 40 to 43; and the errors of the source.
    pub fn read_instances<S: Source + ?Sized>(&self, source: &S) -> Result<Vec<Instance>, S::Error> {
        let Some(section) = &self.instances else { return Ok(Vec::new()) };
        let (bytes, at) = (source.read(section.range.clone())?, section.range.start as u64);
        require(Rule::SectionChecksum, at, hex(section.checksum), hex(checksum(&bytes)))?;
        Ok(read_instances(&bytes, at, self.objects.len())?)
    }

    /// Returns true if the file states which of its objects are closed.
    pub fn has_topology(&self) -> bool {
        self.topology.is_some()
    }

    /// Reads the records of the topology section, one per object, and checks them, but not the lists. Without the
    /// section there are no records. The cost grows with the number of objects.
    ///
    /// # Errors
    /// The first of rules 44 and 45 that does not hold, and the errors of the source.
    pub fn read_topology<S: Source + ?Sized>(&self, source: &S) -> Result<Vec<ObjectTopology>, S::Error> {
        let Some(section) = &self.topology else { return Ok(Vec::new()) };
        read_records(source, &section.range, &self.objects)
    }

    /// Reads the records of the topology section and checks all of the section, except against the pages. The cost grows
    /// with the section.
    ///
    /// # Errors
    /// Rule 10 for this section, and rules 44 to 47; and the errors of the source.
    pub fn check_topology<S: Source + ?Sized>(&self, source: &S) -> Result<Vec<ObjectTopology>, S::Error> {
        let Some(section) = &self.topology else { return Ok(Vec::new()) };
        let mut hasher = Hasher::default();
        for chunk in chunks(section.range.clone()) {
            hasher.update(&source.read(chunk)?);
        }
        let at = section.range.start as u64;
        require(Rule::SectionChecksum, at, hex(section.checksum), hex(hasher.finish()))?;
        let topology = read_records(source, &section.range, &self.objects)?;
        check_lists(source, &topology, &self.objects)?;
        Ok(topology)
    }

    /// Checks the section of duplicate ids: its checksum and its order.
    ///
    /// # Errors
    /// Rules 10 and 36.
    pub fn check_duplicates(&self, bytes: &[u8]) -> Result<(), FormatError> {
        let section = self.sections.iter().find(|section| section.kind == SectionKind::Duplicates);
        let Some(section) = section else { return Ok(()) };
        let at = section.range.start as u64;
        let data = &bytes[section.range.clone()];
        require(Rule::SectionChecksum, at, hex(section.checksum), hex(checksum(data)))?;
        let mut pairs = PairsInOrder::default();
        pairs.add(data);
        pairs.check(section)
    }

    /// Checks the place, size and checksum of a page's leaf block, in one pass over its bytes.
    ///
    /// # Errors
    /// Rules 26 to 28.
    pub fn check_leaf_block(&self, bytes: &[u8], page: &Page, object: &Object) -> Result<(), FormatError> {
        self.check_leaf_block_of(&Block::of_bytes(self.leaf_block(bytes, page.header())), page, object)
    }

    /// Does the same as [`Layout::check_leaf_block`] for a block that has been read.
    ///
    /// # Errors
    /// Rules 26 to 28 and 52.
    pub fn check_leaf_block_of(
        &self,
        block: &Block,
        page: &Page,
        object: &Object,
    ) -> Result<(), FormatError> {
        let header = page.header();
        let at = self.page_offset(header.page_number.get());
        let lines = header.leaf_lines.get() as usize;
        let packets = usize::from(header.packets.get());
        let there = |needed: usize| {
            // The stated number may be anything: multiplying it could overflow.
            let length = block.length();
            let holds = length / LINE == lines && length == needed.next_multiple_of(LINE);
            ensure(holds, Rule::LeafPlace, at + 24, || {
                (
                    format!("a block of {needed} bytes in whole lines"),
                    format!("{length} bytes, stated as {lines} lines"),
                )
            })
        };
        let is_corrected = object.vertices().are_corrected() && packets > 0;
        if is_corrected {
            let holds = block.length() / LINE == lines && block.length() <= MAX_BLOCK_BYTES;
            ensure(holds, Rule::LeafPlace, at + 24, || {
                let expected = format!("a block of at most {MAX_BLOCK_BYTES} bytes in whole lines");
                (expected, format!("{} bytes, stated as {lines} lines", block.length()))
            })?;
        } else if object.triangle_encoding == TriangleEncoding::F32 {
            there(packets * F32_PACKET_BYTES)?;
        }
        let sum = header.leaf_checksum.get();
        require(Rule::LeafChecksum, at + 8, hex(sum), hex(block.checksum()))?;
        if object.triangle_encoding != TriangleEncoding::F32 && packets > 0 {
            let head = PackedHead::read(block.bytes()).filter(|head| head.is_consistent(packets));
            let head = head.ok_or_else(|| {
                let found = format!("{:?}", PackedHead::read(block.bytes()));
                FormatError::new(Rule::PackedHeader, at + 24, "a consistent head", found)
            })?;
            if !is_corrected {
                there(head.block_bytes())?;
            }
        }
        if is_corrected {
            let corrections = corrections_of(object.triangle_encoding, block.bytes(), packets);
            let (head, bytes, corners) = corrections.ok_or_else(|| {
                let found = format!("{} bytes", block.length());
                FormatError::new(Rule::LeafPlace, at + 24, "a block with the head of its corrections", found)
            })?;
            ensure(
                head.is_consistent(corners, object.vertices().corrected),
                Rule::Corrections,
                at + 24,
                || {
                    (
                        format!("corrections of at most {corners} corners, of at most 64 bits each"),
                        format!("{head:?}"),
                    )
                },
            )?;
            there((block.length() - bytes.len()).saturating_add(head.bytes(corners)))?;
        }
        Ok(())
    }

    /// Checks the place, size and checksum of a page's id block.
    ///
    /// # Errors
    /// Rules 31 and 32.
    pub fn check_id_block(&self, bytes: &[u8], page: &Page) -> Result<(), FormatError> {
        self.check_id_block_of(&Block::of_bytes(self.id_block(bytes, page.header())), page)
    }

    /// Does the same as [`Layout::check_id_block`] for a block that has been read.
    ///
    /// # Errors
    /// Rules 31 and 32.
    pub(crate) fn check_id_block_of(&self, block: &Block, page: &Page) -> Result<(), FormatError> {
        let header = page.header();
        let at = self.page_offset(header.page_number.get());
        let words = header.id_words.get() as usize;
        if !self.has_ids() || header.packets.get() == 0 {
            return require(Rule::IdPlace, at + 52, 0, words);
        }
        let length = block.length();
        let needed = id_block_bytes(block.bytes(), usize::from(header.packets.get()));
        let holds = length / WORD == words && needed == Some(length);
        ensure(holds, Rule::IdPlace, at + 32, || {
            let groups = "whose groups follow each other".to_owned();
            let expected = needed.map_or(groups, |needed| format!("of {needed} bytes"));
            (format!("a block {expected}"), format!("{length} bytes, stated as {words} words"))
        })?;
        let sum = header.id_checksum.get();
        require(Rule::IdChecksum, at + 16, hex(sum), hex(block.checksum()))
    }
}

/// The bytes of `count` units from unit `first` of a section; `None` if they do not all lie within it.
#[inline]
fn units_within(section: &Range<usize>, first: u64, count: u32, unit: usize) -> Option<Range<usize>> {
    let start = usize::try_from(first).ok()?.checked_mul(unit)?.checked_add(section.start)?;
    let end = (count as usize).checked_mul(unit)?.checked_add(start)?;
    (end <= section.end).then_some(start..end)
}

/// Checks that the pairs of duplicate ids ascend. Bytes come in pieces, of which all but the last hold whole pairs.
#[derive(Default)]
pub(crate) struct PairsInOrder {
    last: Option<[u32; 2]>,
    descending: bool,
    /// Bytes that make no whole pair.
    left: usize,
}

impl PairsInOrder {
    /// Adds the next bytes of the section.
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        let (pairs, left) = bytes.as_chunks::<8>();
        self.left += left.len();
        for pair in pairs {
            let [kept, dropped]: [U32; 2] = zerocopy::transmute!(*pair);
            let pair = [kept.get(), dropped.get()];
            self.descending |= pair[0] >= pair[1] || self.last >= Some(pair);
            self.last = Some(pair);
        }
    }

    /// Returns the outcome, after the last bytes of the section.
    ///
    /// # Errors
    /// Rule 36.
    pub(crate) fn check(&self, section: &Section) -> Result<(), FormatError> {
        let at = section.range.start as u64;
        require(Rule::DuplicateIds, at, 0, self.left)?;
        ensure(!self.descending, Rule::DuplicateIds, at, || {
            ("ascending pairs".into(), "pairs that do not ascend".into())
        })
    }
}

/// Computes the content checksum: XXH3 of the kind (`u32`), the length (`u64`) and the bytes of each content section, in
/// the order of the file. Equal meshes that are baked with equal options have equal content checksums.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::layout::ContentHasher;
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// let mut hasher = ContentHasher::default();
/// for section in layout.sections.iter().filter(|section| section.kind.is_content()) {
///     hasher.begin(section.kind, section.range.len() as u64);
///     hasher.update(&bytes[section.range.clone()]);
/// }
/// assert_eq!(hasher.finish(), layout.content_checksum);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Default)]
pub struct ContentHasher(Hasher);

impl ContentHasher {
    /// Starts a section.
    pub fn begin(&mut self, kind: SectionKind, length: u64) {
        self.0.update(&(kind as u32).to_le_bytes());
        self.0.update(&length.to_le_bytes());
    }

    /// Adds bytes of the section.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Returns the checksum.
    pub fn finish(&self) -> u64 {
        self.0.finish()
    }
}
