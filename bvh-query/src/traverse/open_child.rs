//! Opens a child of a node: follows its link, to another page if need be, and decodes its treelet.
//!
//! Both walks open nodes in this way, that of two trees and that of one. A link to another page is checked when it is followed.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes};
use crate::traverse::decode::{Coding, Parent, decode_group};
use bvh_format::kdop::DirectionSet;
use bvh_format::object::Object;
use bvh_format::page::{Page, RootRef, check_crossing, check_parent};
use bvh_format::slabs::{Group, NodeSlabs};
use bvh_format::treelet::{Child, Links, child_slabs};

/// What an opened node has besides slabs.
pub(super) struct Opened<'a> {
    pub(super) links: Links,
    pub(super) page: Page<'a>,
    pub(super) treelet: &'a [u8],
}

/// A child of an opened node.
pub(super) struct ClosedChild<'a> {
    /// The slabs of the child and of up to three siblings, and its column of them.
    pub(super) group: &'a Group,
    pub(super) column: usize,
    /// The links of all siblings, and its place among them.
    pub(super) links: &'a Links,
    pub(super) place: usize,
    /// The page of the node.
    pub(super) page: u32,
}

/// Decodes the slabs of the children of an inner child. A leaf or an empty place has nothing to open.
#[inline(always)]
pub(super) fn open_child<'a, I: Isa>(
    isa: I,
    (bvh, object): (&'a Bvh, &Object),
    child: &ClosedChild<'_>,
    to: [&mut Group; 2],
) -> Result<Option<Opened<'a>>, QueryError> {
    let (at, slot, anchor);
    let &ClosedChild { group, column, links, place, page } = child;
    let decoded = (group, column);
    let parent = match links.child(place) {
        Child::Treelet(place) => {
            at = bvh.page(object, page)?;
            slot = place;
            Parent::Node(group, column)
        }
        Child::Remote(link) => {
            (at, slot) = cross(bvh, object, page, link)?;
            anchor = at.anchor_slabs(slot);
            if !is_nested(isa, object.profile().directions(), decoded, &anchor) {
                refuse(bvh, (page, link), decoded, &at, slot)?;
            }
            Parent::Anchor(&anchor)
        }
        Child::Leaf { .. } | Child::Empty => return Ok(None),
    };
    let profile = object.profile();
    let treelet = at.treelet(slot);
    let links = Links::read(profile, treelet);
    for (part, to) in to.into_iter().enumerate().take(profile.groups()) {
        let coding = Coding { profile, f16_scale: object.f16_scale() };
        decode_group(isa, coding, (treelet, part), parent, to);
    }
    Ok(Some(Opened { links, page: at, treelet }))
}

/// Returns the page and the root that a remote link leads to, after checking that link and root name each other.
#[inline(always)]
fn cross<'a>(bvh: &'a Bvh, object: &Object, from: u32, link: u8) -> Result<(Page<'a>, u8), QueryError> {
    let to = bvh.page(object, from)?.remote(link);
    let page = bvh.page(object, to.page())?;
    check_parent(&page, to, (from, link), bvh.layout().page_offset(to.page()))?;
    Ok((page, to.root()))
}

/// Returns whether the slabs of an anchor lie within those of a column: rule 49. Roundings in all nodes are charged by the
/// magnitudes of the object's root, which bound those of all nodes only because of this rule.
#[inline(always)]
fn is_nested<I: Isa>(
    isa: I,
    set: DirectionSet,
    (group, column): (&Group, usize),
    anchor: &NodeSlabs,
) -> bool {
    // A bit for each lane of a row with a slab, by register.
    let rows_with_slabs: &[u16] = match set {
        DirectionSet::Dop6 => &[0x0fff],
        DirectionSet::Dop14 => &[0xffff, 0x0fff],
        DirectionSet::Dop26 => &[0xffff, 0x0fff, 0xffff, 0x00ff],
    };
    let mut beyond = 0;
    for (q, &rows) in rows_with_slabs.iter().enumerate() {
        let (lo, hi) = Parent::Node(group, column).ends(isa, q);
        let (anchor_lo, anchor_hi) = Parent::Anchor(anchor).ends(isa, q);
        // False for NaN, which a forged file may decode to.
        beyond |= !(I::F32x16::bits(lo.le(anchor_lo)) & I::F32x16::bits(anchor_hi.le(hi))) & rows;
    }
    beyond == 0
}

/// Returns the error of the reference check, which names what the anchor of a forged file breaks.
#[cold]
fn refuse(
    bvh: &Bvh,
    link: (u32, u8),
    (decoded, column): (&Group, usize),
    page: &Page,
    root: u8,
) -> Result<(), QueryError> {
    let number = page.header().page_number.get();
    let (to, slabs) = (RootRef::new(number, root), child_slabs(decoded, column));
    Ok(check_crossing(page, to, link, &slabs, bvh.layout().page_offset(number))?)
}

/// Returns a group with the same node in all four columns.
#[inline(always)]
pub(super) fn spread<I: Isa>(isa: I, node: &NodeSlabs) -> Group {
    let mut group = Group::ZERO;
    let (lo, hi) = (node.lo.as_chunks::<4>().0, node.hi.as_chunks::<4>().0);
    for q in 0..4 {
        isa.store(isa.repeat(&lo[q]), &mut group.lo[q]);
        isa.store(isa.repeat(&hi[q]), &mut group.hi[q]);
    }
    group
}

/// Returns a child, if it is a leaf packet.
#[inline(always)]
pub(super) fn leaf_at(links: &Links, page: u32, child: usize) -> Option<LeafPacket> {
    match links.child(child) {
        Child::Leaf { packet, triangles } => Some(LeafPacket { page, packet, triangles }),
        _ => None,
    }
}

/// Returns a bit for each of four children, set for leaf packets.
#[inline(always)]
pub(super) fn leaf_lanes(links: &Links, part: usize) -> u16 {
    // Every fourth bit, brought together: the product has them side by side, from the twelfth on.
    let kinds = links.kinds >> (16 * (part & 1) + 2) & 0x1111;
    ((kinds * 0x1248) >> 12 & 0xf) as u16
}
