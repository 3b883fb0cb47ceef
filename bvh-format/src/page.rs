//! A page: 4 KiB that decode without any other page. Its parts are a header, the anchors of its subtree roots, remote
//! links and treelets.
//!
//! Section 6 of `spec/format.md` says where each byte of a page stands. [`Page`] reads pages, [`PageWriter`] writes
//! them, [`PagePatcher`] changes the numbers in pages that have been written, and [`check_page`] decides whether a page
//! may be read. They share the constants and the shape in this file.
//!
//! Treelet slots are numbered breadth-first. The slots of the roots come first, in the order of the anchors; then
//! follow the child treelets of slot 0, of slot 1, and so on. Leaf packets and remote links are numbered in the same
//! order, so a treelet stores only the number of its first child of each kind. Short treelets have the last slots, in
//! the same order. [`check_page`] requires this order, which ensures that no slot, packet or link can be reached twice.

mod check;
pub mod decode;
mod patcher;
mod reader;
mod writer;

pub use check::{check_crossing, check_named_link, check_nested, check_page, check_parent};
pub use patcher::PagePatcher;
pub use reader::Page;
pub use writer::{PageWriter, TightBound, WrittenPage};

use crate::checksum::checksum;
use crate::ids::WORD;
use crate::leaf::LINE;
use crate::profile::Profile;
use crate::slabs::NodeSlabs;
use crate::treelet::SHORT_TREELET_BYTES;
use std::ops::Range;
use zerocopy::byteorder::little_endian::{U16, U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// Bytes of a page.
pub const PAGE: usize = 4096;
/// Bytes of a page header.
pub const PAGE_HEADER_BYTES: usize = 64;
/// The most pages that a file can have: a root reference holds 26 bits of page number.
pub const MAX_PAGES: u64 = 1 << 26;
/// The parent page that the anchor of an object's root states.
pub const NO_PARENT: u32 = u32::MAX;

/// More leaf packets than a page has: links have ten bits for the number of the first of up to eight.
pub const MAX_PACKETS_PER_PAGE: usize = (1 << 10) + 8;

/// Bytes at the end of an anchor that say which remote link leads to the root.
const PARENT_BYTES: usize = 8;
/// Bytes of a remote link.
const LINK_BYTES: usize = 4;
/// The most subtree roots of a page: a root reference holds 6 bits of root number, and one value stays unused.
const MAX_ROOTS_PER_PAGE: usize = 63;
/// The most remote links of a page: the header counts them in a `u8`.
const MAX_REMOTES_PER_PAGE: usize = 255;

/// The first line of a page.
///
/// [`Page`] has an example.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug)]
#[repr(C)]
pub struct PageHeader {
    /// XXH3 of the page's bytes after this field.
    pub checksum: U64,
    /// XXH3 of the page's leaf block.
    pub leaf_checksum: U64,
    /// XXH3 of the page's id block, or 0 if there is none.
    pub id_checksum: U64,
    /// The leaf block's first line of 64 bytes in the leaf section.
    pub leaf_line: U64,
    /// The id block's first word of 8 bytes in the id section.
    pub id_word: U64,
    /// Number of the page's first packet in the object.
    pub first_packet: U32,
    /// Number of the page in the node section.
    pub page_number: U32,
    /// Lines of the leaf block.
    pub leaf_lines: U32,
    /// Words of the id block, or 0 if there is none.
    pub id_words: U32,
    /// Leaf packets of the page.
    pub packets: U16,
    /// Subtree roots.
    pub roots: u8,
    /// Treelets, short ones included.
    pub treelets: u8,
    /// Remote links.
    pub remotes: u8,
    /// The line of the page at which the treelets start.
    pub treelet_line: u8,
    /// Number of the object's `Profile`.
    pub profile: u8,
    /// How many of the treelets are short: those in the last slots.
    pub short: u8,
}

const _: () = assert!(size_of::<PageHeader>() == PAGE_HEADER_BYTES);

impl PageHeader {
    /// How many roots, remote links and treelets the header states.
    pub fn shape(&self) -> PageShape {
        let [roots, remotes, treelets, short] =
            [self.roots, self.remotes, self.treelets, self.short].map(usize::from);
        PageShape { roots, remotes, treelets, short }
    }

    /// The bytes of the leaf section that the header states as the page's leaf block.
    pub fn leaf_bytes(&self) -> Range<usize> {
        bytes_of_units(self.leaf_line.get(), self.leaf_lines.get(), LINE)
    }

    /// The bytes of the id section that the header states as the page's id block.
    pub fn id_bytes(&self) -> Range<usize> {
        bytes_of_units(self.id_word.get(), self.id_words.get(), WORD)
    }
}

/// The bytes of `count` units from unit `first` on. Places that no memory could hold saturate.
fn bytes_of_units(first: u64, count: u32, unit: usize) -> Range<usize> {
    let start = usize::try_from(first).unwrap_or(usize::MAX).saturating_mul(unit);
    start..start.saturating_add((count as usize).saturating_mul(unit))
}

/// A reference to a subtree root: the page in the upper 26 bits, the root's number within the page in the lower 6.
///
/// ```
/// use bvh_format::page::RootRef;
///
/// let root = RootRef::new(1000, 5);
/// assert_eq!((root.page(), root.root(), root.0), (1000, 5, 1000 << 6 | 5));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RootRef(pub u32);

impl RootRef {
    /// Refers to root `root` of page `page`.
    #[inline]
    pub fn new(page: u32, root: u8) -> Self {
        Self(page << 6 | u32::from(root & 63))
    }

    /// The number of the page.
    #[inline]
    pub fn page(self) -> u32 {
        self.0 >> 6
    }

    /// The number of the root within the page, which is also the slot of its treelet.
    #[inline]
    pub fn root(self) -> u8 {
        (self.0 & 63) as u8
    }
}

/// A subtree root's slabs, and the remote link that leads to it.
///
/// [`Page`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// The root's slabs.
    pub slabs: NodeSlabs,
    /// The page of its parent; `NO_PARENT` for the object's root.
    pub parent_page: u32,
    /// The remote link of that page that leads here; 0 for the object's root.
    pub parent_link: u8,
}

/// The numbers of roots, remote links and treelets of a page, which determine the places of its parts.
///
/// ```
/// use bvh_format::page::PageShape;
/// use bvh_format::profile::Profile;
///
/// let shape = PageShape { roots: 1, remotes: 10, treelets: 40, short: 8 };
/// assert!(shape.fits(Profile::Dop14U8));
/// assert!(!shape.fits(Profile::Dop14F32)); // whose treelets are four times as large
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PageShape {
    /// Subtree roots, which are among the treelets.
    pub roots: usize,
    /// Remote links.
    pub remotes: usize,
    /// Treelets, short ones included.
    pub treelets: usize,
    /// How many of the treelets are short.
    pub short: usize,
}

impl PageShape {
    /// The line of the page at which the treelets start.
    pub fn treelet_line(self, profile: Profile) -> usize {
        (anchor_at(profile, self.roots) + self.remotes * LINK_BYTES).div_ceil(LINE)
    }

    /// The lines of the page that are in use.
    pub fn lines(self, profile: Profile) -> usize {
        let treelets = self.treelets.saturating_sub(self.short) * profile.treelet_bytes();
        self.treelet_line(profile) + (treelets + self.short * SHORT_TREELET_BYTES).div_ceil(LINE)
    }

    /// Returns true if a page has room for all parts and its header can count them.
    pub fn fits(self, profile: Profile) -> bool {
        let counted = self.roots <= MAX_ROOTS_PER_PAGE && self.remotes <= MAX_REMOTES_PER_PAGE;
        self.lines(profile) <= PAGE / LINE && counted
    }
}

/// The byte of the page at which the anchor of root `root` starts.
#[inline]
fn anchor_at(profile: Profile, root: usize) -> usize {
    PAGE_HEADER_BYTES + root * profile.anchor_bytes()
}

/// The byte of a page of `roots` roots at which remote link `link` starts: the links follow the anchors.
#[inline]
fn link_at(profile: Profile, roots: u8, link: u8) -> usize {
    anchor_at(profile, roots.into()) + usize::from(link) * LINK_BYTES
}

/// The numbers in a page header that depend on the pages before it.
///
/// [`PagePatcher`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PagePlace {
    /// Number of the page in the node section.
    pub page: u32,
    /// The leaf block's first line in the leaf section.
    pub leaf_line: u64,
    /// The id block's first word in the id section.
    pub id_word: u64,
    /// Number of the page's first packet in the object.
    pub first_packet: u32,
}

impl PagePlace {
    /// The place of the page that follows a page with this header at this place.
    pub fn behind(self, header: &PageHeader) -> Self {
        Self {
            page: self.page + 1,
            leaf_line: self.leaf_line + u64::from(header.leaf_lines.get()),
            id_word: self.id_word + u64::from(header.id_words.get()),
            first_packet: self.first_packet + u32::from(header.packets.get()),
        }
    }

    /// The same place for the first page of another object: packets are numbered within their object.
    pub fn of_next_object(self) -> Self {
        Self { first_packet: 0, ..self }
    }
}

/// The checksum that belongs in the page's first field.
pub(crate) fn page_checksum(bytes: &[u8; PAGE]) -> u64 {
    checksum(&bytes[size_of::<U64>()..])
}
