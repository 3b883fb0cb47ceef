//! An opened `.cbvh` file: its bytes, its objects, and which of its pages have been checked.

use crate::error::{OpenError, QueryError};
use crate::leaf::decoded::Decoded;
use crate::mapped::{self, ReadAhead};
use crate::traverse::opened::Leaf;
use bvh_format::leaf::{F32_PACKET_BYTES, Packet, TriangleEncoding, decode_packet, decode_triangle};
use bvh_format::object::Object;
use bvh_format::page::{PAGE, Page, check_page};
use bvh_format::treelet::Links;
use bvh_format::{FormatError, Layout, Rule, ids};
use memmap2::Mmap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

/// A bounding volume hierarchy that can be queried. `Send` and `Sync`: share it between threads.
///
/// Opening reads the header page and the object table, whatever the file's size. A page is checked
/// when a query first touches it. Memory, whatever numbers the file holds: one byte a page, twice the
/// bytes of the object table, and some KiB.
pub struct Bvh {
    bytes: Bytes,
    layout: Layout,
    /// What has been checked of each page.
    checked: Box<[AtomicU8]>,
    duplicates_checked: AtomicBool,
    /// Whether the system is told to read each block at once.
    reads_blocks: bool,
    /// No other one of this process has it, open or closed.
    identity: u64,
}

enum Bytes {
    Mapped(Mmap),
    Owned(Vec<u8>),
    Static(&'static [u8]),
}

impl Bytes {
    #[inline(always)]
    fn get(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Owned(bytes) => bytes,
            Self::Static(bytes) => bytes,
        }
    }
}

/// Bytes of a file that no cache near a processor holds.
const LARGE: usize = 8 << 20;

/// The page's own bytes are right.
const PAGE_CHECKED: u8 = 1;
/// The page's leaf block is right.
const LEAVES_CHECKED: u8 = 2;
/// The page's id block is right.
const IDS_CHECKED: u8 = 4;

impl Bvh {
    /// Maps a file.
    ///
    /// Cost: microseconds, whatever the file's size; memory as said at [`Bvh`].
    ///
    /// The file's bytes must stay as they are while it is open:
    ///
    /// - Replaced by renaming another over it, or removed: the old content stays, and so do answers. That is
    ///   how `cbvh bake` writes.
    /// - Truncated, by whatever process: on Unix the first access to what is gone ends this process with
    ///   SIGBUS. There is no error to catch.
    /// - Written into: answers are undefined, and so is behaviour as far as Rust is concerned, since a page
    ///   is checked at its first touch only. Walks still end.
    ///
    /// [`Bvh::read`] asks for none of this: use it where others may write to the file.
    ///
    /// # Errors
    /// If the system refuses the file, or its header or object table break the format.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, OpenError> {
        Self::open_with(path, ReadAhead::Usual)
    }

    /// Maps a file, and tells the system how to read it: see [`ReadAhead`]. Answers do not depend on it.
    ///
    /// # Errors
    /// As [`Bvh::open`].
    pub fn open_with(path: impl AsRef<Path>, read_ahead: ReadAhead) -> Result<Self, OpenError> {
        let path = path.as_ref();
        let map = mapped::map(path, read_ahead).map_err(|source| OpenError::io(path, source))?;
        let opened = Self::new(Bytes::Mapped(map)).map_err(|source| OpenError::format(path, source))?;
        Ok(Self { reads_blocks: read_ahead == ReadAhead::Sparse, ..opened })
    }

    /// Reads a whole file into memory: a copy, so that it does not matter what becomes of the file.
    ///
    /// Cost: that of reading the file, and its size in memory.
    ///
    /// # Errors
    /// As [`Bvh::open`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, OpenError> {
        let path = path.as_ref();
        let bytes = mapped::read(path).map_err(|source| OpenError::io(path, source))?;
        Self::new(Bytes::Mapped(bytes)).map_err(|source| OpenError::format(path, source))
    }

    /// Takes a file's bytes in memory, such as those that `bvh_bake::to_bytes` makes. Many of them are moved to
    /// large pages of memory, where the system has them: at the cost of a copy, queries take a tenth less.
    ///
    /// # Errors
    /// If the header or the object table break the format.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, FormatError> {
        let copy = (bytes.len() >= LARGE).then(|| mapped::copy(&bytes).ok()).flatten();
        Self::new(copy.map_or(Bytes::Owned(bytes), Bytes::Mapped))
    }

    /// Borrows bytes that live as long as the program: see `include_cbvh!`.
    ///
    /// # Errors
    /// If the header or the object table break the format.
    pub fn from_static(bytes: &'static [u8]) -> Result<Self, FormatError> {
        Self::new(Bytes::Static(bytes))
    }

    fn new(bytes: Bytes) -> Result<Self, FormatError> {
        let layout = Layout::read(bytes.get())?;
        let checked = bytemuck::allocation::zeroed_slice_box(layout.page_count() as usize);
        static OPENED: AtomicU64 = AtomicU64::new(0);
        let identity = OPENED.fetch_add(1, Ordering::Relaxed);
        let duplicates_checked = AtomicBool::new(false);
        Ok(Self { bytes, layout, checked, duplicates_checked, reads_blocks: false, identity })
    }

    /// Where everything is in the file.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get()
    }

    /// True if queries will mostly read what is in no cache.
    #[inline(always)]
    pub(crate) fn is_large(&self) -> bool {
        self.bytes.get().len() >= LARGE
    }

    /// The objects of the file, at least one.
    pub fn objects(&self) -> &[Object] {
        &self.layout.objects
    }

    /// The number of the object of this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.objects().iter().position(|object| object.name == name)
    }

    /// The whole file as one thing to query: all its objects.
    pub fn all(&self) -> Shape<'_> {
        Shape { bvh: self, first: 0, end: self.objects().len() }
    }

    /// One object of the file; `None` if there is none of this number.
    pub fn object(&self, number: usize) -> Option<Shape<'_>> {
        (number < self.objects().len()).then_some(Shape { bvh: self, first: number, end: number + 1 })
    }

    /// The ids of the input's triangles that are exact duplicates of triangle `id`, ascending. Cost:
    /// a binary search, and at the first call a pass over all duplicates to check them.
    ///
    /// # Errors
    /// If the section of duplicates is damaged.
    pub fn duplicates_of(&self, id: u32) -> Result<impl Iterator<Item = u32> + '_, QueryError> {
        if !self.duplicates_checked.load(Ordering::Acquire) {
            self.layout.check_duplicates(self.bytes())?;
            self.duplicates_checked.store(true, Ordering::Release);
        }
        let pairs = self.layout.duplicate_ids(self.bytes());
        let start = pairs.partition_point(|[kept, _]| kept.get() < id);
        let of_id = pairs[start..].iter().take_while(move |[kept, _]| kept.get() == id);
        Ok(of_id.map(|[_, dropped]| dropped.get()))
    }

    /// Checks every page, leaf block and id block now, so that no query has to: the first touch of a
    /// page costs some microseconds otherwise. Reads the whole file once.
    ///
    /// # Errors
    /// The first rule that does not hold.
    pub fn check_all(&self) -> Result<(), QueryError> {
        for object in self.objects() {
            let first = object.record.first_page.get();
            for number in first..first + object.record.pages.get() {
                let page = self.page(object, number)?;
                self.leaf_block(object, &page)?;
                self.id_block(&page)?;
            }
        }
        Ok(())
    }

    /// A page, checked if it never was.
    #[inline(always)]
    pub(crate) fn page(&self, object: &Object, number: u32) -> Result<Page<'_>, QueryError> {
        match self.checked.get(number as usize) {
            Some(flags) if flags.load(Ordering::Acquire) & PAGE_CHECKED != 0 => {}
            _ => self.check_page(object, number)?,
        }
        self.page_unchecked(object, number)
    }

    #[inline(always)]
    fn page_unchecked(&self, object: &Object, number: u32) -> Result<Page<'_>, QueryError> {
        match self.layout.page_bytes(self.bytes.get(), number) {
            Some(bytes) => Ok(Page::new(bytes, object.profile)),
            None => Err(self.no_page(number)),
        }
    }

    #[cold]
    fn no_page(&self, number: u32) -> QueryError {
        let at = self.layout.page_offset(number);
        FormatError::new(Rule::ObjectPages, at, "a page", "the end of the section").into()
    }

    #[cold]
    fn check_page(&self, object: &Object, number: u32) -> Result<(), QueryError> {
        let bytes: &[u8; PAGE] =
            self.layout.page_bytes(self.bytes(), number).ok_or_else(|| self.no_page(number))?;
        check_page(bytes, number, object, self.layout.page_offset(number))?;
        self.checked[number as usize].fetch_or(PAGE_CHECKED, Ordering::Release);
        Ok(())
    }

    /// The leaf block of a checked page, checked if it never was.
    #[inline(always)]
    pub(crate) fn leaf_block(&self, object: &Object, page: &Page) -> Result<&[u8], QueryError> {
        let number = page.header().page_number.get();
        match self.checked.get(number as usize) {
            Some(flags) if flags.load(Ordering::Acquire) & LEAVES_CHECKED != 0 => {}
            _ => self.check_leaves(object, page, number)?,
        }
        Ok(self.layout.leaf_block(self.bytes.get(), page.header()))
    }

    #[cold]
    fn check_leaves(&self, object: &Object, page: &Page, number: u32) -> Result<(), QueryError> {
        self.ahead(self.layout.leaf_block(self.bytes(), page.header()));
        self.layout.check_leaf_block(self.bytes(), page, object)?;
        self.checked[number as usize].fetch_or(LEAVES_CHECKED, Ordering::Release);
        Ok(())
    }

    /// Tells the system of a block that is about to be checked, if it asked to be told.
    fn ahead(&self, block: &[u8]) {
        if let Bytes::Mapped(map) = &self.bytes
            && self.reads_blocks
            && !block.is_empty()
        {
            let start = block.as_ptr() as usize - map.as_ptr() as usize;
            mapped::ahead(map, start..start + block.len());
        }
    }

    /// The id block of a checked page, checked if it never was; empty without ids.
    fn id_block(&self, page: &Page) -> Result<&[u8], QueryError> {
        let number = page.header().page_number.get();
        let flags = self.checked.get(number as usize).ok_or_else(|| self.no_page(number))?;
        if flags.load(Ordering::Acquire) & IDS_CHECKED == 0 {
            self.ahead(self.layout.id_block(self.bytes(), page.header()));
            self.layout.check_id_block(self.bytes(), page)?;
            flags.fetch_or(IDS_CHECKED, Ordering::Release);
        }
        Ok(self.layout.id_block(self.bytes(), page.header()))
    }

    /// A leaf packet for a walk that comes by it several times: where it stands in the file if it can be read there.
    #[inline(always)]
    pub(crate) fn packet_again<'a>(
        &'a self,
        object: &Object,
        leaf: Leaf,
        decoded: &'a mut Decoded,
    ) -> Result<&'a Packet, QueryError> {
        if object.triangle_encoding == TriangleEncoding::F32 {
            let page = self.page(object, leaf.page)?;
            let block = self.leaf_block(object, &page)?;
            if let Some(packet) = plain_packet(object, block, leaf.packet) {
                return Ok(packet);
            }
        }
        let (known, room) = decoded.place(leaf.page, leaf.packet);
        if !known {
            let page = self.page(object, leaf.page)?;
            let block = self.leaf_block(object, &page)?;
            *room = decode_packet(object.triangle_encoding, block, usize::from(leaf.packet));
        }
        Ok(room)
    }

    /// A triangle of a leaf packet.
    pub(crate) fn triangle(
        &self,
        object: &Object,
        leaf: Leaf,
        lane: u8,
    ) -> Result<[[f32; 3]; 3], QueryError> {
        let page = self.page(object, leaf.page)?;
        let block = self.leaf_block(object, &page)?;
        Ok(decode_triangle(object.triangle_encoding, block, usize::from(leaf.packet), usize::from(lane)))
    }

    /// The bytes of a treelet's leaf packets, where they stand together.
    #[inline(always)]
    pub(crate) fn packets_ahead(&self, object: &Object, page: &Page, links: &Links) -> &[u8] {
        if object.triangle_encoding != TriangleEncoding::F32 {
            return &[];
        }
        let block = self.layout.leaf_block(self.bytes.get(), page.header());
        let start = usize::from(links.first_leaf) * F32_PACKET_BYTES;
        let end = start + links.leaves().count_ones() as usize * F32_PACKET_BYTES;
        block.get(start..end).unwrap_or(&[])
    }

    /// The id of a triangle: its number in the input, or without ids its place in the order of the
    /// leaves.
    pub(crate) fn triangle_id(&self, object: &Object, place: TrianglePlace) -> Result<u32, QueryError> {
        let page = self.page(object, place.page)?;
        if !self.layout.has_ids() {
            let packet = page.header().first_packet.get().wrapping_add(u32::from(place.packet));
            return Ok(packet.wrapping_mul(4).wrapping_add(u32::from(place.lane)));
        }
        let block = self.id_block(&page)?;
        Ok(ids::decode_id(block, usize::from(place.packet), usize::from(place.lane)))
    }
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bvh")
            .field("bytes", &self.bytes().len())
            .field("objects", &self.objects().len())
            .finish()
    }
}

/// A packet of plain floats where it stands.
#[inline(always)]
fn plain_packet<'a>(object: &Object, block: &'a [u8], packet: u16) -> Option<&'a Packet> {
    if cfg!(target_endian = "big") || object.triangle_encoding != TriangleEncoding::F32 {
        return None;
    }
    let bytes: &[u8; F32_PACKET_BYTES] =
        block.get(usize::from(packet) * F32_PACKET_BYTES..)?.first_chunk()?;
    bytemuck::try_from_bytes(bytes).ok()
}

/// Where a triangle is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TrianglePlace {
    pub(crate) page: u32,
    pub(crate) packet: u16,
    pub(crate) lane: u8,
}

/// One side of a query: one object of a file, or all of them as one.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'a> {
    bvh: &'a Bvh,
    first: usize,
    end: usize,
}

impl<'a> Shape<'a> {
    /// The file.
    pub fn bvh(&self) -> &'a Bvh {
        self.bvh
    }

    /// The objects of this side.
    pub fn objects(&self) -> &'a [Object] {
        &self.bvh.objects()[self.first..self.end]
    }

    /// Tells it from every other shape of this process, those of closed files included.
    pub(crate) fn identity(&self) -> (u64, usize, usize) {
        (self.bvh.identity, self.first, self.end)
    }

    /// Number of its first object in the file.
    pub(crate) fn first(&self) -> usize {
        self.first
    }

    /// The object of this number in the file, if it belongs to this side.
    pub(crate) fn numbered(&self, number: u32) -> Option<&'a Object> {
        self.objects().get((number as usize).checked_sub(self.first)?)
    }

    /// Triangles of all its objects.
    pub fn triangles(&self) -> u64 {
        self.objects().iter().map(|object| object.record.triangles.get()).sum()
    }
}

impl<'a> From<&'a Bvh> for Shape<'a> {
    fn from(bvh: &'a Bvh) -> Self {
        bvh.all()
    }
}
