//! A page: 4 KiB that decodes by itself. Header, anchors of its subtree roots, remote links, treelets.
//!
//! | lines of 64 bytes | what |
//! |---|---|
//! | 1 | `PageHeader` |
//! | 1 or 2 a root | anchors: the root's slabs in full f32 and where its parent is |
//! | 1 per 16 links | remote table: `u32` references of subtree roots in later pages |
//! | the rest | treelets |
//!
//! Treelet slots are numbered breadth-first: slot i below the number of roots is root i, then come
//! the children of slot 0, of slot 1 and so on. Leaf packets and remote links are numbered the same
//! way, so that each treelet's first child of a kind follows from those before it; `check_page`
//! demands it, and with it no slot, packet or link is reached twice.

use crate::checksum::checksum;
use crate::checksum::hex;
use crate::error::{FormatError, ensure, require};
use crate::kdop::Kdop;
use crate::object::Object;
use crate::profile::{Encoding, Profile};
use crate::quantize::F16_MAX_CODE;
use crate::rule::Rule;
use crate::slabs::NodeSlabs;
use crate::slabs::row;
use crate::treelet::{Links, read_codes, read_ends};
use zerocopy::byteorder::little_endian::{U16, U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// Bytes of a page.
pub const PAGE: usize = 4096;
/// Bytes of a page header.
pub const PAGE_HEADER_BYTES: usize = 64;
/// Most pages of a file: references hold 26 bits of page number.
pub const MAX_PAGES: u64 = 1 << 26;
/// Parent of an object's root.
pub const NO_PARENT: u32 = u32::MAX;
/// Remote links in one line.
const LINKS_A_LINE: usize = 16;

/// The first line of a page.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug)]
#[repr(C)]
pub struct PageHeader {
    /// XXH3 of the bytes of the page behind this field.
    pub checksum: U64,
    /// XXH3 of the page's leaf block.
    pub leaf_checksum: U64,
    /// XXH3 of the page's id block, 0 without ids.
    pub id_checksum: U64,
    /// First line of 64 bytes of the leaf block in the leaf section.
    pub leaf_line: U64,
    /// First word of 8 bytes of the id block in the id section.
    pub id_word: U64,
    /// Number of the page's first packet in the object.
    pub first_packet: U32,
    /// Number of the page in the node section.
    pub page_number: U32,
    /// Lines of the leaf block.
    pub leaf_lines: U32,
    /// Words of the id block, 0 without ids.
    pub id_words: U32,
    /// Leaf packets of the page.
    pub packets: U16,
    /// Subtree roots.
    pub roots: u8,
    /// Treelets.
    pub treelets: u8,
    /// Remote links.
    pub remotes: u8,
    /// Line in the page at which the treelets start.
    pub treelet_line: u8,
    /// Number of the object's `Profile`.
    pub profile: u8,
    /// Zero.
    pub reserved: u8,
}

const _: () = assert!(size_of::<PageHeader>() == PAGE_HEADER_BYTES);

/// A subtree root: page in the upper 26 bits, number among the page's roots in the lower 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RootRef(pub u32);

impl RootRef {
    /// Root `root` of page `page`.
    #[inline]
    pub fn new(page: u32, root: u8) -> Self {
        Self(page << 6 | u32::from(root & 63))
    }

    /// The page.
    #[inline]
    pub fn page(self) -> u32 {
        self.0 >> 6
    }

    /// The number among the page's roots, which is its treelet's slot.
    #[inline]
    pub fn root(self) -> u8 {
        (self.0 & 63) as u8
    }
}

/// A subtree root's slabs and the remote link that leads to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// The root's slabs.
    pub slabs: NodeSlabs,
    /// Page of its parent, `NO_PARENT` for the object's root.
    pub parent_page: u32,
    /// Remote link of that page that leads here, 0 for the object's root.
    pub parent_link: u8,
}

/// Line at which the treelets of a page start.
pub fn treelet_line(profile: Profile, roots: usize, remotes: usize) -> usize {
    1 + roots * (profile.anchor_bytes() / 64) + remotes.div_ceil(LINKS_A_LINE)
}

/// True if a page has room for so many roots, remote links and treelets.
pub fn fits(profile: Profile, roots: usize, remotes: usize, treelets: usize) -> bool {
    let lines = treelet_line(profile, roots, remotes) + treelets * (profile.treelet_bytes() / 64);
    lines <= PAGE / 64 && roots <= 63 && remotes <= 255
}

/// Writes an anchor: lower ends by slab, upper ends by slab, and in the last eight bytes the parent.
pub fn write_anchor(profile: Profile, slabs: &Kdop, parent: Option<(u32, u8)>, out: &mut [u8]) {
    let count = profile.directions().slabs();
    for slab in 0..count {
        out[slab * 4..slab * 4 + 4].copy_from_slice(&slabs.lo[slab].to_le_bytes());
        let at = (count + slab) * 4;
        out[at..at + 4].copy_from_slice(&slabs.hi[slab].to_le_bytes());
    }
    let (page, link) = parent.unwrap_or((NO_PARENT, 0));
    let end = profile.anchor_bytes();
    out[end - 8..end - 4].copy_from_slice(&page.to_le_bytes());
    out[end - 4] = link;
}

/// A page whose shape has been checked, or is being checked.
#[derive(Clone, Copy)]
pub struct Page<'a> {
    bytes: &'a [u8; PAGE],
    profile: Profile,
}

impl<'a> Page<'a> {
    /// A page of a checked file. Over unchecked bytes the accessors return nonsense, but no panic.
    #[inline]
    pub fn new(bytes: &'a [u8; PAGE], profile: Profile) -> Self {
        Self { bytes, profile }
    }

    /// The first line.
    #[inline]
    pub fn header(&self) -> &'a PageHeader {
        let head: &[u8; PAGE_HEADER_BYTES] = self.bytes.first_chunk().unwrap_or(&[0; 64]);
        zerocopy::transmute_ref!(head)
    }

    /// All its bytes.
    pub fn bytes(&self) -> &'a [u8; PAGE] {
        self.bytes
    }

    /// The profile that its treelets are read with.
    #[inline]
    pub fn profile(&self) -> Profile {
        self.profile
    }

    /// The treelet in a slot; slots wrap at the end of the page.
    #[inline]
    pub fn treelet(&self, slot: u8) -> &'a [u8] {
        let size = self.profile.treelet_bytes();
        let start = usize::from(self.header().treelet_line) * 64 + usize::from(slot) * size;
        self.bytes.get(start..start + size).unwrap_or(&self.bytes[..size])
    }

    /// The bytes of a treelet's children in this page, which stand together.
    #[inline]
    pub fn treelets_ahead(&self, links: &Links) -> &'a [u8] {
        let size = self.profile.treelet_bytes();
        let start = usize::from(self.header().treelet_line) * 64 + usize::from(links.first_treelet) * size;
        let end = start + links.treelets().count_ones() as usize * size;
        self.bytes.get(start..end).unwrap_or(&[])
    }

    /// The anchor of a root.
    #[inline]
    pub fn anchor(&self, root: u8) -> Anchor {
        let (parent_page, parent_link) = self.anchor_parent(root);
        Anchor { slabs: self.anchor_slabs(root), parent_page, parent_link }
    }

    /// The slabs of a root.
    #[inline]
    pub fn anchor_slabs(&self, root: u8) -> NodeSlabs {
        let bytes = self.anchor_bytes(root);
        let slabs = self.profile.directions().slabs();
        let mut node = NodeSlabs::default();
        let (lo, hi) = (bytes.as_chunks::<4>().0, bytes[4 * slabs..].as_chunks::<4>().0);
        // Slabs up to 6 stand in their own rows, the others one row further.
        for row in 0..slabs.min(7) {
            node.lo[row] = f32::from_le_bytes(lo[row]);
            node.hi[row] = f32::from_le_bytes(hi[row]);
        }
        for slab in 7..slabs {
            node.lo[row(slab)] = f32::from_le_bytes(lo[slab]);
            node.hi[row(slab)] = f32::from_le_bytes(hi[slab]);
        }
        node
    }

    /// The page and remote link that lead to a root.
    #[inline]
    pub fn anchor_parent(&self, root: u8) -> (u32, u8) {
        let bytes = self.anchor_bytes(root);
        let end = bytes.len();
        let page = [bytes[end - 8], bytes[end - 7], bytes[end - 6], bytes[end - 5]];
        (u32::from_le_bytes(page), bytes[end - 4])
    }

    #[inline]
    fn anchor_bytes(&self, root: u8) -> &'a [u8] {
        let size = self.profile.anchor_bytes();
        let start = PAGE_HEADER_BYTES + usize::from(root) * size;
        self.bytes.get(start..start + size).unwrap_or(&self.bytes[..size])
    }

    /// A remote link: the subtree root in another page.
    #[inline]
    pub fn remote(&self, link: u8) -> RootRef {
        let roots = usize::from(self.header().roots) * self.profile.anchor_bytes();
        let start = PAGE_HEADER_BYTES + roots + usize::from(link) * 4;
        let mut word = [0; 4];
        if let Some(bytes) = self.bytes.get(start..start + 4) {
            word.copy_from_slice(bytes);
        }
        RootRef(u32::from_le_bytes(word))
    }
}

/// The checksum that belongs in the page's first field.
pub fn page_checksum(bytes: &[u8; PAGE]) -> u64 {
    checksum(&bytes[8..])
}

/// Checks everything about a page that can be seen in the page itself: its checksum, shape, anchors
/// and links. `at` is the page's byte offset in the file.
///
/// # Errors
/// The first of rules 15 to 25 and 38 that does not hold. What a remote link leads to is checked when it
/// is followed (rule 20).
pub fn check_page(bytes: &[u8; PAGE], number: u32, object: &Object, at: u64) -> Result<(), FormatError> {
    let page = Page::new(bytes, object.profile);
    let header = page.header();
    require(Rule::PageChecksum, at, hex(header.checksum.get()), hex(page_checksum(bytes)))?;
    require(Rule::PageNumber, at + 44, number, header.page_number.get())?;
    require(Rule::PageProfile, at + 62, object.profile.number(), header.profile)?;
    let (roots, remotes) = (usize::from(header.roots), usize::from(header.remotes));
    let treelets = usize::from(header.treelets);
    let first_line = treelet_line(object.profile, roots, remotes);
    let shape = (1..=treelets).contains(&roots)
        && fits(object.profile, roots, remotes, treelets)
        && usize::from(header.treelet_line) == first_line;
    ensure(shape, Rule::PageShape, at + 56, || {
        let found = format!("{roots} roots, {remotes} links, {treelets} treelets");
        (format!("treelets at line {first_line} and all within {PAGE} bytes"), found)
    })?;
    ensure(header.reserved == 0, Rule::Reserved, at + 63, || ("0".into(), header.reserved.to_string()))?;
    check_anchors(&page, number, object, at)?;
    check_codes(&page, at)?;
    check_links(&page, at)?;
    check_remotes(&page, number, object, at)
}

/// The largest magnitude of a slab end, 2^122: three coordinates of at most 2^120.
const MAX_END: f32 = f32::from_bits((127 + 122) << 23);

fn check_anchors(page: &Page, number: u32, object: &Object, at: u64) -> Result<(), FormatError> {
    let slabs = object.profile.directions().slabs();
    for root in 0..page.header().roots {
        let at = at + (PAGE_HEADER_BYTES + usize::from(root) * object.profile.anchor_bytes()) as u64;
        let anchor = page.anchor(root);
        let ordered = (0..slabs).all(|slab| {
            let (lo, hi) = (anchor.slabs.lo[row(slab)], anchor.slabs.hi[row(slab)]);
            -MAX_END <= lo && lo <= hi && hi <= MAX_END
        });
        ensure(ordered, Rule::AnchorSlabs, at, || {
            ("lo <= hi, both within 2^122".into(), format!("{anchor:?}"))
        })?;
        let is_object_root = number == object.record.first_page.get() && root == 0;
        let parent = anchor.parent_page;
        let known = if is_object_root {
            parent == NO_PARENT && anchor.parent_link == 0
        } else {
            parent >= object.record.first_page.get() && parent < number
        };
        ensure(known, Rule::AnchorParent, at, || {
            ("a parent in an earlier page of the object".into(), parent.to_string())
        })?;
    }
    Ok(())
}

/// Checks that codes which are floats decode to finite numbers, inward from the parent.
fn check_codes(page: &Page, at: u64) -> Result<(), FormatError> {
    let profile = page.profile;
    if !matches!(profile.encoding(), Encoding::F16 | Encoding::F32) {
        return Ok(());
    }
    let start = usize::from(page.header().treelet_line) * 64;
    for slot in 0..page.header().treelets {
        let treelet = page.treelet(slot);
        let at = at + (start + usize::from(slot) * profile.treelet_bytes()) as u64;
        for child in 0..Links::read(treelet).children().min(profile.width()) {
            for slab in 0..profile.directions().slabs() {
                let (code_lo, code_hi) = read_codes(profile, treelet, child, slab);
                let (lo, hi) = read_ends(profile, treelet, child, slab);
                let finite = match profile.encoding() {
                    Encoding::F16 => code_lo <= F16_MAX_CODE && code_hi <= F16_MAX_CODE,
                    _ => lo.abs() <= MAX_END && hi.abs() <= MAX_END,
                };
                ensure(finite, Rule::Codes, at, || {
                    (
                        format!("finite codes for child {child}, slab {slab}"),
                        format!("{code_lo:#06x}, {code_hi:#06x}, {lo}, {hi}"),
                    )
                })?;
            }
        }
    }
    Ok(())
}

/// Checks kinds and numbering: every slot but the roots', every remote link and every packet is
/// reached exactly once.
fn check_links(page: &Page, at: u64) -> Result<(), FormatError> {
    let header = page.header();
    let width = page.profile.width();
    let (mut treelets, mut remotes, mut packets) = (u32::from(header.roots), 0u32, 0u32);
    for slot in 0..header.treelets {
        let size = page.profile.treelet_bytes();
        let at = at + (usize::from(header.treelet_line) * 64 + usize::from(slot) * size) as u64;
        let links = Links::read(page.treelet(slot));
        let children = links.children();
        let kinds = (1..=width).contains(&children)
            && (0..children).all(|c| matches!(links.kinds >> (4 * c) & 15, 1 | 2 | 4..=7));
        ensure(kinds, Rule::ChildKinds, at, || {
            (format!("1 to {width} children, no gaps"), format!("kinds {:08x}", links.kinds))
        })?;
        let numbered = |rule, bits: u32, first: u32, expected: &mut u32| {
            let count = bits.count_ones();
            let found = first;
            let right = count == 0 || found == *expected;
            ensure(right, rule, at, || (format!("the first numbered {expected}"), found.to_string()))?;
            *expected += count;
            Ok::<(), FormatError>(())
        };
        let first = u32::from(links.first_treelet);
        ensure(links.treelets() == 0 || first > u32::from(slot), Rule::TreeletLinks, at, || {
            (format!("children behind slot {slot}"), first.to_string())
        })?;
        numbered(Rule::TreeletLinks, links.treelets(), first, &mut treelets)?;
        numbered(Rule::RemoteLinks, links.remotes(), links.first_remote.into(), &mut remotes)?;
        numbered(Rule::LeafLinks, links.leaves(), links.first_leaf.into(), &mut packets)?;
    }
    require(Rule::TreeletLinks, at + 59, u32::from(header.treelets), treelets)?;
    require(Rule::RemoteLinks, at + 60, u32::from(header.remotes), remotes)?;
    require(Rule::LeafLinks, at + 56, u32::from(header.packets.get()), packets)
}

fn check_remotes(page: &Page, number: u32, object: &Object, at: u64) -> Result<(), FormatError> {
    let end = u64::from(object.record.first_page.get()) + u64::from(object.record.pages.get());
    for link in 0..page.header().remotes {
        let target = page.remote(link).page();
        ensure(target > number && u64::from(target) < end, Rule::RemoteLinks, at, || {
            (format!("a page between {number} and {end}"), target.to_string())
        })?;
    }
    Ok(())
}

/// Checks that the remote link `link` of page `from` and the root it leads to name each other.
///
/// # Errors
/// Rule 20.
#[inline]
pub fn check_crossing(target: &Page, to: RootRef, from: u32, link: u8, at: u64) -> Result<(), FormatError> {
    let found =
        if to.root() < target.header().roots { target.anchor_parent(to.root()) } else { (NO_PARENT, 0) };
    ensure(found == (from, link), Rule::AnchorParent, at, || {
        (format!("root {} with parent {from}, link {link}", to.root()), format!("{found:?}"))
    })
}
