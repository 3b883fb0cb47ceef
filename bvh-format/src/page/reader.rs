//! Reads a page: its header, anchors, remote links and treelets, without copying any.

use super::{
    Anchor, LINK_BYTES, PAGE, PAGE_HEADER_BYTES, PARENT_BYTES, PageHeader, RootRef, anchor_at, link_at,
};
use crate::leaf::LINE;
use crate::profile::Profile;
use crate::slabs::{NodeSlabs, row};
use crate::treelet::{Links, SHORT_TREELET_BYTES};

/// A view of a page that has passed [`check_page`](super::check_page), or is being checked.
///
/// Over bytes that have not been checked, the accessors may return nonsense, but they never panic.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::page::{Anchor, NO_PARENT, Page, PageHeader, check_page};
/// use bvh_format::treelet::{Child, Links};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// let object = &layout.objects[0];
/// let page = layout.page_bytes(&bytes, 0).expect("a page");
/// check_page(page, 0, object, layout.page_offset(0))?;
/// let page = Page::new(page, object.profile());
/// let header: &PageHeader = page.header();
/// let Anchor { parent_page, slabs, .. } = page.anchor(0);
/// assert_eq!((parent_page, slabs.lo[0], slabs.hi[0]), (NO_PARENT, -1.0, 1.0)); // x of the cube
/// let mut found = 0;
/// for slot in 0..header.treelets {
///     let links: Links = page.links(slot);
///     for child in (0..links.children()).map(|child| links.child(child)) {
///         found += if let Child::Leaf { triangles, .. } = child { triangles } else { 0 };
///     }
/// }
/// assert_eq!(found, 12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy)]
pub struct Page<'a> {
    bytes: &'a [u8; PAGE],
    profile: Profile,
}

impl<'a> Page<'a> {
    /// Views the bytes of a page as one of an object of this profile.
    #[inline]
    pub fn new(bytes: &'a [u8; PAGE], profile: Profile) -> Self {
        Self { bytes, profile }
    }

    /// The header: the first line.
    #[inline]
    pub fn header(&self) -> &'a PageHeader {
        let head: &[u8; PAGE_HEADER_BYTES] = self.bytes.first_chunk().unwrap_or(&[0; PAGE_HEADER_BYTES]);
        zerocopy::transmute_ref!(head)
    }

    /// All bytes of the page.
    pub fn bytes(&self) -> &'a [u8; PAGE] {
        self.bytes
    }

    /// The profile with which the treelets are read.
    #[inline]
    pub fn profile(&self) -> Profile {
        self.profile
    }

    /// The treelet in a slot. A slot that lies beyond the page reads the page's first bytes.
    #[inline]
    pub fn treelet(&self, slot: u8) -> &'a [u8] {
        let size = if self.is_short(slot) { SHORT_TREELET_BYTES } else { self.profile.treelet_bytes() };
        let start = self.treelet_at(slot);
        self.bytes.get(start..start + size).unwrap_or(&self.bytes[..size])
    }

    /// The links of the treelet in a slot.
    #[inline]
    pub fn links(&self, slot: u8) -> Links {
        Links::read(self.profile, self.treelet(slot))
    }

    /// The first slot of a short treelet.
    #[inline]
    fn first_short(&self) -> u8 {
        let header = self.header();
        header.treelets.saturating_sub(header.short)
    }

    /// Returns true if the treelet in a slot is short.
    #[inline]
    pub(super) fn is_short(&self, slot: u8) -> bool {
        slot >= self.first_short() && self.profile.has_short_treelets()
    }

    /// The byte of the page at which the treelet in a slot starts.
    #[inline]
    pub fn treelet_at(&self, slot: u8) -> usize {
        let short =
            if self.profile.has_short_treelets() { slot.saturating_sub(self.first_short()) } else { 0 };
        let others = usize::from(slot - short) * self.profile.treelet_bytes();
        usize::from(self.header().treelet_line) * LINE + others + usize::from(short) * SHORT_TREELET_BYTES
    }

    /// The bytes of a treelet's child treelets in this page: those of the short ones, and those of the others.
    #[inline]
    pub fn treelets_ahead(&self, links: &Links) -> [&'a [u8]; 2] {
        let of = |first: u8, children: u32, size: usize| {
            let start = self.treelet_at(first);
            self.bytes.get(start..start + children.count_ones() as usize * size).unwrap_or(&[])
        };
        [
            of(links.first_short, links.short_treelets(), SHORT_TREELET_BYTES),
            of(links.first_treelet, links.treelets(), self.profile.treelet_bytes()),
        ]
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

    /// The page and the remote link that lead to a root.
    #[inline]
    pub fn anchor_parent(&self, root: u8) -> (u32, u8) {
        let bytes = self.anchor_bytes(root);
        let at = bytes.len() - PARENT_BYTES;
        let page = [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        (u32::from_le_bytes(page), bytes[at + 4])
    }

    #[inline]
    fn anchor_bytes(&self, root: u8) -> &'a [u8] {
        let size = self.profile.anchor_bytes();
        let start = anchor_at(self.profile, root.into());
        self.bytes.get(start..start + size).unwrap_or(&self.bytes[..size])
    }

    /// A remote link: a reference to a subtree root in a later page.
    #[inline]
    pub fn remote(&self, link: u8) -> RootRef {
        let start = link_at(self.profile, self.header().roots, link);
        let mut word = [0; LINK_BYTES];
        if let Some(bytes) = self.bytes.get(start..start + LINK_BYTES) {
            word.copy_from_slice(bytes);
        }
        RootRef(u32::from_le_bytes(word))
    }
}
