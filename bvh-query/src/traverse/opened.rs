//! Opened nodes: treelets decoded once a query, however many partners their children meet.
//!
//! Each opened node remembers which of its children have been opened, so that finding one again is
//! one load. Nodes of B are re-aligned to A's directions when they are opened, too.

use crate::bvh::Bvh;
use crate::error::QueryError;
use crate::isa::Isa;
use crate::traverse::decode::decode_group;
use bvh_format::decode::{Group, NodeSlabs};
use bvh_format::object::Object;
use bvh_format::page::{Page, check_crossing};
use bvh_format::treelet::{Child, Links};

/// A node by the place where its own children or triangles are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Node {
    /// No node.
    Empty,
    /// A treelet.
    Treelet { page: u32, slot: u8 },
    /// A subtree root in another page: the link of this page that leads to it.
    Remote { page: u32, link: u8 },
    /// A leaf packet.
    Leaf(Leaf),
}

/// A leaf packet: its page, its number there and how many triangles it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leaf {
    pub(crate) page: u32,
    pub(crate) packet: u16,
    pub(crate) triangles: u8,
}

/// A child of an opened node: number of the node, and of the child in the lowest three bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ChildRef(u32);

impl ChildRef {
    #[inline(always)]
    pub(crate) fn new(node: usize, child: usize) -> Self {
        Self((node as u32) << 3 | child as u32)
    }

    #[inline(always)]
    pub(crate) fn node(self) -> usize {
        (self.0 >> 3) as usize
    }

    #[inline(always)]
    pub(crate) fn child(self) -> usize {
        (self.0 & 7) as usize
    }
}

/// Slab ends of four nodes of B along A's directions: `[slab][lo or hi]`.
pub(crate) type Aligned = [[[f32; 4]; 2]; 13];

/// The children of a node, decoded.
#[derive(Clone, Copy)]
pub(crate) struct Opened {
    pub(crate) groups: [Group; 2],
    pub(crate) nodes: [Node; 8],
    /// Largest extents of the children's boxes, mesh units.
    pub(crate) extents: [f32; 8],
    /// Numbers of the children's opened nodes, `CLOSED` if they are not.
    opened: [u32; 8],
    pub(crate) count: usize,
}

const CLOSED: u32 = u32::MAX;

impl Opened {
    const EMPTY: Self = Self {
        groups: [Group::ZERO; 2],
        nodes: [Node::Empty; 8],
        extents: [0.0; 8],
        opened: [CLOSED; 8],
        count: 0,
    };

    /// Reads links and extents after the slabs of `count` children have been decoded.
    #[inline(always)]
    fn finish(&mut self, page: u32, links: Links, width: usize) {
        self.count = links.children().min(width);
        self.opened = [CLOSED; 8];
        for child in 0..self.count {
            self.nodes[child & 7] = match links.child(child) {
                Child::Empty => Node::Empty,
                Child::Treelet(slot) => Node::Treelet { page, slot },
                Child::Remote(link) => Node::Remote { page, link },
                Child::Leaf { packet, triangles } => Node::Leaf(Leaf { page, packet, triangles }),
            };
            let rows = self.groups[(child / 4) & 1].rows();
            let width = |axis: usize| rows[16 + axis][child % 4] - rows[axis][child % 4];
            let larger = |a: f32, b: f32| if a > b { a } else { b };
            self.extents[child & 7] = larger(larger(width(0), width(1)), width(2));
        }
    }
}

/// The opened nodes of one side. Node 0 holds the object's root as its only child.
#[derive(Default)]
pub(crate) struct OpenedNodes {
    nodes: Vec<Opened>,
    used: usize,
}

impl OpenedNodes {
    /// Forgets all nodes and takes in the object's root.
    pub(crate) fn start(&mut self, bvh: &Bvh, object: &Object) -> Result<(), QueryError> {
        if self.nodes.is_empty() {
            self.nodes.resize(64, Opened::EMPTY);
        }
        let page = object.record.first_page.get();
        let root = &mut self.nodes[0];
        root.groups[0] = Group::of_one(&bvh.page(object, page)?.anchor_slabs(0));
        root.nodes[0] = Node::Treelet { page, slot: 0 };
        root.extents[0] = f32::INFINITY;
        root.opened = [CLOSED; 8];
        root.count = 1;
        self.used = 1;
        Ok(())
    }

    #[inline(always)]
    pub(crate) fn get(&self, node: usize) -> &Opened {
        &self.nodes[node]
    }

    /// The opened node of an inner child and whether it is new. A leaf is not opened: an empty node.
    #[inline(always)]
    pub(crate) fn open<I: Isa>(
        &mut self,
        isa: I,
        bvh: &Bvh,
        object: &Object,
        at: ChildRef,
    ) -> Result<(usize, bool), QueryError> {
        let known = self.nodes[at.node()].opened[at.child()];
        if known != CLOSED {
            return Ok((known as usize, false));
        }
        if self.used == self.nodes.len() {
            self.nodes.resize(2 * self.used, Opened::EMPTY);
        }
        let number = self.used;
        let (before, behind) = self.nodes.split_at_mut(number);
        let parent = &mut before[at.node()];
        decode_node(isa, bvh, object, parent, at.child(), &mut behind[0])?;
        parent.opened[at.child()] = number as u32;
        self.used += 1;
        Ok((number, true))
    }
}

#[inline(always)]
fn decode_node<I: Isa>(
    isa: I,
    bvh: &Bvh,
    object: &Object,
    parent: &Opened,
    child: usize,
    to: &mut Opened,
) -> Result<(), QueryError> {
    let (page, slot, anchor);
    let (slabs, column) = match parent.nodes[child] {
        Node::Treelet { page: number, slot: place } => {
            page = bvh.page(object, number)?;
            slot = place;
            (&parent.groups[child / 4], child % 4)
        }
        Node::Remote { page: number, link } => {
            page = cross(bvh, object, number, link)?;
            slot = bvh.page(object, number)?.remote(link).root();
            anchor = spread(isa, &page.anchor_slabs(slot));
            (&anchor, 0)
        }
        Node::Leaf(_) | Node::Empty => {
            to.count = 0;
            return Ok(());
        }
    };
    let profile = object.profile;
    let treelet = page.treelet(slot);
    for part in 0..profile.groups() {
        decode_group(isa, profile, object.f16_scale, treelet, part, slabs, column, &mut to.groups[part]);
    }
    to.finish(page.header().page_number.get(), Links::read(treelet), profile.width());
    Ok(())
}

/// The page that a remote link leads to, after checking that link and root name each other.
#[inline(always)]
fn cross<'a>(bvh: &'a Bvh, object: &Object, from: u32, link: u8) -> Result<Page<'a>, QueryError> {
    let to = bvh.page(object, from)?.remote(link);
    let page = bvh.page(object, to.page())?;
    check_crossing(&page, to, from, link, bvh.layout().page_offset(to.page()))?;
    Ok(page)
}

/// A group with the same node in all four columns.
#[inline(always)]
fn spread<I: Isa>(isa: I, node: &NodeSlabs) -> Group {
    let mut group = Group::ZERO;
    let (lo, hi) = (node.lo.as_chunks::<4>().0, node.hi.as_chunks::<4>().0);
    for q in 0..4 {
        isa.store(isa.repeat(&lo[q]), &mut group.lo[q]);
        isa.store(isa.repeat(&hi[q]), &mut group.hi[q]);
    }
    group
}
