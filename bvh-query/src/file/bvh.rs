//! An opened `.cbvh` file: its bytes, its objects, and which of its pages have been checked.

use crate::error::{OpenError, QueryError};
use crate::file::memory;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::file::ray_tree::{PLACE_BYTES, RaySlot};
use crate::file::unpack::unpack;
use crate::isa::Isa;
use crate::narrow::Enclosed;
use bvh_format::leaf::{
    F32_PACKET_BYTES, PackedHead, Packet, TriangleEncoding, VertexBlock, decode_packet, decode_triangle,
};
use bvh_format::object::Object;
use bvh_format::open_edges::OpenEdges;
use bvh_format::page::{PAGE, Page, check_page};
use bvh_format::source::MAX_BLOCK_BYTES;
use bvh_format::topology::ObjectTopology;
use bvh_format::treelet::Links;
use bvh_format::{FormatError, Layout, Rule, ids};
use bytes::Bytes;
use memmap2::Mmap;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};

/// An open file, with all of its objects. Every program starts with one. Cloning it copies a pointer, and threads may
/// share it.
///
/// Opening a file reads only its head and its object table, whatever the size of the file. A page is checked when a
/// query first touches it. An open file needs one byte of memory per page, twice the bytes of the object table, and
/// some KiB, whatever numbers the file holds; from the first ray or segment on, 24 bytes per object more. Once these have visited as
/// many nodes of an object as it has, the file keeps a tree of boxes for them, of up to 16 bytes per triangle or 16 KiB. Making the tree
/// reads the whole object, also of a file that is mapped with [`ReadAhead::Sparse`](crate::ReadAhead::Sparse).
///
/// ```
/// use bvh_bake::{Options, shapes, to_bytes};
/// use bvh_query::Bvh;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (bytes, _report) = to_bytes(&shapes::block([2.0, 2.0, 2.0])?, &Options::default())?;
/// let block = Bvh::from_bytes(bytes)?; // Bvh::read and Bvh::map open a file on a disk
/// assert_eq!(block.objects().len(), 1);
/// assert_eq!(block.objects()[0].triangles(), 12);
/// assert!(block.is_closed(0)?);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Bvh(Arc<OpenFile>);

/// A file that is open as long as somebody else keeps it open.
#[derive(Debug, Default)]
pub(super) struct WeakBvh(Weak<OpenFile>);

impl WeakBvh {
    pub(super) fn upgrade(&self) -> Option<Bvh> {
        self.0.upgrade().map(Bvh)
    }
}

/// What all clones of a [`Bvh`] share.
struct OpenFile {
    bytes: Bytes,
    /// The map that the bytes are, if the system is to be told which blocks are needed next.
    advised: Option<Arc<Mmap>>,
    layout: Layout,
    /// What has been checked of each page.
    checked: Box<[AtomicU8]>,
    duplicates_checked: AtomicBool,
    /// What the file states about the topology of each object, or how it breaks a rule there, once it has been needed.
    topology: OnceLock<Result<Box<[ObjectTopology]>, FormatError>>,
    /// The open edges that have been counted, by the numbers of their objects.
    counted: Mutex<BTreeMap<usize, Arc<OpenEdges>>>,
    /// What objects enclose whose depth was queried, by their numbers.
    enclosed: Mutex<BTreeMap<usize, Enclosed>>,
    /// The trees of rays, by the numbers of objects, once a ray has been asked about.
    rays: OnceLock<Box<[RaySlot]>>,
    /// A number that no other open file of this process has or had.
    identity: u64,
}

/// From this size on, a file gains from large memory pages.
const MIN_LARGE_PAGES_BYTES: usize = 8 << 20;
/// From this size on, a file does not stay in the caches nearest to a processor.
const MIN_PREFETCH_BYTES: usize = 1 << 20;

/// Set once the bytes of the page itself have been checked.
const PAGE_CHECKED: u8 = 1;
/// Set once the leaf block of the page has been checked.
const LEAVES_CHECKED: u8 = 2;
/// Set once the id block of the page has been checked.
const IDS_CHECKED: u8 = 4;

/// Keeps a map alive behind `Bytes`.
struct MapOwner(Arc<Mmap>);

impl AsRef<[u8]> for MapOwner {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl Bvh {
    /// Opens a file that is mapped. If it is `sparse`, the system reads no more of it than it is asked for.
    pub(super) fn of_map(path: &Path, map: Mmap, sparse: bool) -> Result<Self, OpenError> {
        let map = Arc::new(map);
        let advised = sparse.then(|| map.clone());
        let opened = Self::new(Bytes::from_owner(MapOwner(map)), advised);
        opened.map_err(|source| OpenError::Format { path: path.to_owned(), source })
    }

    /// Reads a whole file into memory and opens the copy. Later changes of the file have no effect: use this where
    /// others may write to the file, and [`Bvh::map`] where nobody does.
    ///
    /// Cost: that of reading the file, and its size in memory.
    ///
    /// # Errors
    /// [`OpenError::Io`] if the system refuses the file, [`OpenError::Format`] if the header or the object table
    /// break a rule of the format.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, OpenError> {
        let path = path.as_ref();
        // WebAssembly has no anonymous maps, into which `memory` reads.
        let bytes = if cfg!(target_family = "wasm") {
            std::fs::read(path).map(Bytes::from)
        } else {
            memory::read(path).map(Bytes::from_owner)
        };
        let bytes = bytes.map_err(|source| OpenError::Io { path: path.to_owned(), source })?;
        Self::new(bytes, None).map_err(|source| OpenError::Format { path: path.to_owned(), source })
    }

    /// Opens the bytes of a file in memory, such as those that `bvh_bake::to_bytes` returns.
    ///
    /// The bytes may have any owner: a `Vec<u8>`, an `Arc<[u8]>` that others share, a `&'static [u8]`. They are used in
    /// place, at any alignment; packets of plain `f32` triangles that are not aligned to 4 bytes are copied when they
    /// are tested. From 8 MiB on, the bytes are moved to large memory pages if the system has them. Queries then take a
    /// tenth less time, at the cost of one copy. [`Bvh::from_static`] never copies.
    ///
    /// # Errors
    /// The rule that the header or the object table breaks.
    pub fn from_bytes(bytes: impl AsRef<[u8]> + Send + 'static) -> Result<Self, FormatError> {
        let slice = bytes.as_ref();
        let copy = (slice.len() >= MIN_LARGE_PAGES_BYTES).then(|| memory::copy(slice).ok()).flatten();
        Self::new(copy.map_or_else(|| Bytes::from_owner(bytes), Bytes::from_owner), None)
    }

    /// Opens bytes that live as long as the program, without a copy: see [`include_cbvh!`](crate::include_cbvh).
    ///
    /// # Errors
    /// The rule that the header or the object table breaks.
    pub fn from_static(bytes: &'static [u8]) -> Result<Self, FormatError> {
        Self::new(Bytes::from_static(bytes), None)
    }

    fn new(bytes: Bytes, advised: Option<Arc<Mmap>>) -> Result<Self, FormatError> {
        let layout = Layout::read(&bytes)?;
        let checked = bytemuck::allocation::zeroed_slice_box(layout.page_count() as usize);
        static OPENED: AtomicU64 = AtomicU64::new(0);
        let identity = OPENED.fetch_add(1, Ordering::Relaxed);
        let duplicates_checked = AtomicBool::new(false);
        let (topology, counted, enclosed) = (OnceLock::new(), Mutex::default(), Mutex::default());
        Ok(Self(Arc::new(OpenFile {
            bytes,
            advised,
            layout,
            checked,
            duplicates_checked,
            topology,
            counted,
            enclosed,
            rays: OnceLock::new(),
            identity,
        })))
    }

    pub(super) fn downgrade(&self) -> WeakBvh {
        WeakBvh(Arc::downgrade(&self.0))
    }

    /// Returns where everything is in the file.
    pub fn layout(&self) -> &Layout {
        &self.0.layout
    }

    /// Returns the bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        &self.0.bytes
    }

    /// Returns whether queries will mostly read bytes that the nearest caches do not hold.
    #[inline(always)]
    pub(crate) fn is_worth_prefetching(&self) -> bool {
        self.0.bytes.len() >= MIN_PREFETCH_BYTES
    }

    /// Returns what the file states about the topology of its objects, once it has been needed.
    pub(super) fn known_topology(&self) -> &OnceLock<Result<Box<[ObjectTopology]>, FormatError>> {
        &self.0.topology
    }

    /// Returns the open edges that have been counted.
    pub(super) fn counted(&self) -> &Mutex<BTreeMap<usize, Arc<OpenEdges>>> {
        &self.0.counted
    }

    /// Returns what objects are known to enclose.
    pub(super) fn known_enclosed(&self) -> &Mutex<BTreeMap<usize, Enclosed>> {
        &self.0.enclosed
    }

    /// Returns the place of the tree that rays walk, by the number of an object.
    #[inline(always)]
    pub(crate) fn ray_slot(&self, object: usize) -> &RaySlot {
        let make = || self.objects().iter().map(|_| RaySlot::default()).collect();
        &self.0.rays.get_or_init(make)[object]
    }

    /// Returns the plain packet at a place after the first byte of packets. Its leaf block has been checked.
    #[inline(always)]
    pub(crate) fn packet_at(&self, first: usize, place: u32) -> Option<&Packet> {
        let start = first + PLACE_BYTES * place as usize;
        let bytes: &[u8; F32_PACKET_BYTES] = self.0.bytes.get(start..)?.first_chunk()?;
        bytemuck::try_from_bytes(bytes).ok()
    }

    /// Returns a number that no other open file of this process has or had.
    pub(crate) fn identity(&self) -> u64 {
        self.0.identity
    }

    /// Returns the objects of the file, of which there is at least one.
    pub fn objects(&self) -> &[Object] {
        &self.0.layout.objects
    }

    /// Returns the ids of the input's triangles that are exact duplicates of triangle `id`, in ascending order.
    ///
    /// Cost: a binary search, and at the first call a pass over all duplicates to check them.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if the section of duplicates breaks a rule.
    pub fn duplicates_of(&self, id: u32) -> Result<impl Iterator<Item = u32> + '_, QueryError> {
        if !self.0.duplicates_checked.load(Ordering::Acquire) {
            self.0.layout.check_duplicates(self.bytes())?;
            self.0.duplicates_checked.store(true, Ordering::Release);
        }
        let pairs = self.0.layout.duplicate_ids(self.bytes());
        let start = pairs.partition_point(|[kept, _]| kept.get() < id);
        let of_id = pairs[start..].iter().take_while(move |[kept, _]| kept.get() == id);
        Ok(of_id.map(|[_, dropped]| dropped.get()))
    }

    /// Checks all rules and checksums of the whole file now, so that no query has to check a page. Otherwise the first touch
    /// of a page costs some microseconds.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] with the first rule that does not hold.
    pub fn validate(&self) -> Result<(), QueryError> {
        // The checksum of a page locates damage better than that of its section.
        for object in self.objects() {
            let first = object.record().first_page.get();
            for number in first..first + object.record().pages.get() {
                let page = self.page(object, number)?;
                self.leaf_block(object, &page)?;
                self.id_block(&page)?;
            }
        }
        bvh_format::validate::validate(self.bytes())?;
        Ok(())
    }

    /// Returns a page, after checking it if this is its first touch.
    #[inline(always)]
    pub(crate) fn page(&self, object: &Object, number: u32) -> Result<Page<'_>, QueryError> {
        match self.0.checked.get(number as usize) {
            Some(flags) if flags.load(Ordering::Acquire) & PAGE_CHECKED != 0 => {}
            _ => self.check_page(object, number)?,
        }
        self.page_unchecked(object, number)
    }

    #[inline(always)]
    fn page_unchecked(&self, object: &Object, number: u32) -> Result<Page<'_>, QueryError> {
        match self.0.layout.page_bytes(&self.0.bytes, number) {
            Some(bytes) => Ok(Page::new(bytes, object.profile())),
            None => Err(self.no_page(number)),
        }
    }

    #[cold]
    fn no_page(&self, number: u32) -> QueryError {
        let at = self.0.layout.page_offset(number);
        FormatError::new(Rule::ObjectPages, at, "a page", "the end of the section").into()
    }

    #[cold]
    fn check_page(&self, object: &Object, number: u32) -> Result<(), QueryError> {
        let bytes: &[u8; PAGE] =
            self.0.layout.page_bytes(self.bytes(), number).ok_or_else(|| self.no_page(number))?;
        check_page(bytes, number, object, self.0.layout.page_offset(number))?;
        self.0.checked[number as usize].fetch_or(PAGE_CHECKED, Ordering::Release);
        Ok(())
    }

    /// Returns the leaf block of a checked page, after checking the block if this is its first touch.
    #[inline(always)]
    pub(crate) fn leaf_block(&self, object: &Object, page: &Page) -> Result<&[u8], QueryError> {
        let number = page.header().page_number.get();
        match self.0.checked.get(number as usize) {
            Some(flags) if flags.load(Ordering::Acquire) & LEAVES_CHECKED != 0 => {}
            _ => self.check_leaves(object, page, number)?,
        }
        Ok(self.0.layout.leaf_block(&self.0.bytes, page.header()))
    }

    #[cold]
    fn check_leaves(&self, object: &Object, page: &Page, number: u32) -> Result<(), QueryError> {
        let block = self.0.layout.leaf_block(self.bytes(), page.header());
        // A page may state any length, and be met again by each pair of a scene: what is too long for any page is not read.
        if block.len() > MAX_BLOCK_BYTES {
            let (at, expected) =
                (self.0.layout.page_offset(number), format!("at most {MAX_BLOCK_BYTES} bytes"));
            let found = format!("{} bytes", block.len());
            return Err(FormatError::new(Rule::LeafPlace, at + 24, expected, found).into());
        }
        self.will_need(block);
        self.0.layout.check_leaf_block(self.bytes(), page, object)?;
        self.0.checked[number as usize].fetch_or(LEAVES_CHECKED, Ordering::Release);
        Ok(())
    }

    /// Tells the system which block is about to be checked, if the file was opened with `ReadAhead::Sparse`.
    fn will_need(&self, block: &[u8]) {
        if let Some(map) = &self.0.advised
            && !block.is_empty()
        {
            let start = block.as_ptr() as usize - map.as_ptr() as usize;
            memory::will_need(map, start..start + block.len());
        }
    }

    /// Returns the id block of a checked page, after checking the block if this is its first touch. It is empty in a file
    /// without ids.
    pub(super) fn id_block(&self, page: &Page) -> Result<&[u8], QueryError> {
        let number = page.header().page_number.get();
        let flags = self.0.checked.get(number as usize).ok_or_else(|| self.no_page(number))?;
        if flags.load(Ordering::Acquire) & IDS_CHECKED == 0 {
            self.will_need(self.0.layout.id_block(self.bytes(), page.header()));
            self.0.layout.check_id_block(self.bytes(), page)?;
            flags.fetch_or(IDS_CHECKED, Ordering::Release);
        }
        Ok(self.0.layout.id_block(self.bytes(), page.header()))
    }

    /// Returns a leaf packet: in place or, if it is encoded, decoded into `room`.
    #[inline(always)]
    pub(crate) fn packet<'a, I: Isa>(
        &'a self,
        isa: I,
        object: &Object,
        leaf: LeafPacket,
        room: &'a mut Packet,
    ) -> Result<&'a Packet, QueryError> {
        let page = self.page(object, leaf.page)?;
        let block = self.leaf_block(object, &page)?;
        if let Some(packet) = plain_packet(object, block, leaf.packet) {
            return Ok(packet);
        }
        match object.triangle_encoding() {
            TriangleEncoding::F32 => {
                *room = decode_packet(TriangleEncoding::F32, block, usize::from(leaf.packet))
            }
            TriangleEncoding::Packed | TriangleEncoding::Quantized => {
                unpack(isa, block, usize::from(leaf.packet), room);
            }
        }
        Ok(room)
    }

    /// Returns up to four leaf packets, and a bit for each triangle that they have: bit `4 * packet + triangle`. Packets are
    /// in place or, if they are encoded, decoded into `rooms`.
    #[inline(always)]
    pub(crate) fn packets<'a, I: Isa>(
        &'a self,
        isa: I,
        object: &Object,
        leaves: &[LeafPacket],
        rooms: &'a mut [Packet; 4],
    ) -> Result<([&'a Packet; 4], u16), QueryError> {
        let (mut packets, mut triangles) = ([&Packet::NONE; 4], 0);
        for (place, (leaf, room)) in leaves.iter().zip(rooms).enumerate() {
            packets[place] = self.packet(isa, object, *leaf, room)?;
            triangles |= ((1 << leaf.triangles) - 1) << (4 * place);
        }
        Ok((packets, triangles))
    }

    /// Returns the vertices of a triangle of a leaf packet.
    pub(crate) fn vertices(
        &self,
        object: &Object,
        leaf: LeafPacket,
        lane: u8,
    ) -> Result<[[f64; 3]; 3], QueryError> {
        let page = self.page(object, leaf.page)?;
        let block = self.leaf_block(object, &page)?;
        let (packet, lane) = (usize::from(leaf.packet), usize::from(lane));
        let offsets = decode_triangle(object.triangle_encoding(), block, packet, lane);
        let vertices = object.vertices();
        if vertices.are_sums() {
            let mut sums = [vertices.origin; 3];
            for (sum, offset) in sums.as_flattened_mut().iter_mut().zip(offsets.as_flattened()) {
                *sum += f64::from(*offset);
            }
            return Ok(sums);
        }
        Ok(behind(object, block, page.header().packets.get().into(), (packet, lane), offsets))
    }

    /// Returns the offsets of a triangle of a leaf packet.
    pub(crate) fn triangle(
        &self,
        object: &Object,
        leaf: LeafPacket,
        lane: u8,
    ) -> Result<[[f32; 3]; 3], QueryError> {
        let page = self.page(object, leaf.page)?;
        let block = self.leaf_block(object, &page)?;
        Ok(decode_triangle(object.triangle_encoding(), block, usize::from(leaf.packet), usize::from(lane)))
    }

    /// Returns the bytes of a treelet's leaf packets, which are adjacent; none if the packets are encoded.
    #[inline(always)]
    pub(crate) fn packets_to_prefetch(&self, object: &Object, page: &Page, links: &Links) -> &[u8] {
        let count = links.leaves().count_ones() as usize;
        if count == 0 {
            return &[];
        }
        let block = self.0.layout.leaf_block(&self.0.bytes, page.header());
        let first = usize::from(links.first_leaf);
        let range = match object.triangle_encoding() {
            TriangleEncoding::F32 => first * F32_PACKET_BYTES..(first + count) * F32_PACKET_BYTES,
            TriangleEncoding::Packed | TriangleEncoding::Quantized => match PackedHead::read(block) {
                Some(head) => head.records(first..first + count),
                None => 0..0,
            },
        };
        block.get(range).unwrap_or(&[])
    }

    /// Returns the id of a triangle: its number in the input or, in a file without ids, its place in the order of the
    /// leaves.
    pub(crate) fn triangle_id(&self, object: &Object, place: TrianglePlace) -> Result<u32, QueryError> {
        let page = self.page(object, place.page)?;
        if !self.0.layout.has_ids() {
            let packet = page.header().first_packet.get().wrapping_add(u32::from(place.packet));
            return Ok(packet.wrapping_mul(4).wrapping_add(u32::from(place.lane)));
        }
        let block = self.id_block(&page)?;
        Ok(ids::decode_id(block, usize::from(place.packet), usize::from(place.lane)))
    }
}

impl std::fmt::Debug for OpenFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OpenFile")
            .field("bytes", &self.bytes.len())
            .field("objects", &self.layout.objects.len())
            .finish()
    }
}

/// Returns the vertices behind the offsets of a triangle, in a block of some packets, by its packet and lane. Apart from the code
/// of plain sums, which most objects need.
#[inline(never)]
fn behind(
    object: &Object,
    block: &[u8],
    packets: usize,
    (packet, lane): (usize, usize),
    offsets: [[f32; 3]; 3],
) -> [[f64; 3]; 3] {
    VertexBlock::new(object.triangle_encoding(), object.vertices(), block, packets)
        .behind(packet, lane, offsets)
}

/// Returns a packet of plain `f32` in place, if its alignment allows that.
#[inline(always)]
fn plain_packet<'a>(object: &Object, block: &'a [u8], packet: u16) -> Option<&'a Packet> {
    if object.triangle_encoding() != TriangleEncoding::F32 {
        return None;
    }
    let bytes: &[u8; F32_PACKET_BYTES] =
        block.get(usize::from(packet) * F32_PACKET_BYTES..)?.first_chunk()?;
    bytemuck::try_from_bytes(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::include_cbvh;

    /// The type is what aligns them: linkers may do so by chance.
    #[test]
    fn embedded_files_are_aligned_and_lend_their_packets() {
        assert_eq!(align_of::<crate::Embedded<[u8; 1]>>(), 64);
        let files = [
            include_cbvh!("../../../testdata/ok-everything.cbvh").unwrap(),
            include_cbvh!("../../../testdata/ok-plain.cbvh").unwrap(),
            include_cbvh!("../../../testdata/ok-profiles.cbvh").unwrap(),
            include_cbvh!("../../../testdata/ok-scene.cbvh").unwrap(),
            include_cbvh!("../../../testdata/ok-topology.cbvh").unwrap(),
            include_cbvh!("../../../testdata/ok-turning.cbvh").unwrap(),
        ];
        let mut lent = 0;
        for bvh in &files {
            assert_eq!(bvh.bytes().as_ptr() as usize % 64, 0);
            let plain = |object: &&Object| object.triangle_encoding() == TriangleEncoding::F32;
            for object in bvh.objects().iter().filter(plain) {
                for number in object.pages() {
                    let page = bvh.page(object, number).unwrap();
                    let block = bvh.layout().leaf_block(bvh.bytes(), page.header());
                    for packet in 0..page.header().packets.get() {
                        assert!(plain_packet(object, block, packet).is_some());
                        lent += 1;
                    }
                }
            }
        }
        assert!(lent > 10, "{lent}");
    }
}
