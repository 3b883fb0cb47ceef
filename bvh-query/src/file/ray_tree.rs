//! The tree of boxes that rays walk, which an open file keeps for each object after some rays.
//!
//! A node has the boxes of up to eight children side by side, in `f32` around the object's origin. Leaves are the leaf
//! packets of the file. All pages and leaf blocks of the object have been checked before there is a tree.
//!
//! It takes about 14 bytes per triangle, and never more than 16, or 16 KiB: an object whose tree would be larger has none. It is made
//! once rays have visited as many nodes as the object has, so that making it costs no more than they did.

use crate::file::memory;
use crate::file::place::LeafPacket;
use bytemuck::{Pod, Zeroable};
use bytes::Bytes;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The children of a node.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(32))]
pub(crate) struct RayNode {
    /// The lower ends along the three axes, then the upper ones, of eight boxes. A place without a child has an empty box.
    pub(crate) ends: [[f32; 8]; 6],
    pub(crate) children: [RayChild; 8],
}

impl RayNode {
    pub(crate) const EMPTY: Self = {
        let (lo, hi) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Self { ends: [lo, lo, lo, hi, hi, hi], children: [RayChild(0); 8] }
    };
}

/// A child of a node: another node or a leaf packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct RayChild(u32);

impl RayChild {
    const LEAF: u32 = 1 << 31;
    const TRIANGLES_BIT: u32 = 29;
    /// More than the place of any packet.
    pub(crate) const MAX_PLACES: u32 = 1 << Self::TRIANGLES_BIT;

    #[inline(always)]
    pub(crate) fn node(number: u32) -> Self {
        Self(number)
    }

    /// A leaf packet of 1 to 4 triangles.
    #[inline(always)]
    pub(crate) fn leaf(place: u32, triangles: u8) -> Self {
        Self(Self::LEAF | u32::from(triangles - 1) << Self::TRIANGLES_BIT | place)
    }

    #[inline(always)]
    pub(crate) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub(crate) fn bits(self) -> u32 {
        self.0
    }

    /// Returns the number of a node, or nothing for a leaf packet.
    #[inline(always)]
    pub(crate) fn as_node(self) -> Option<usize> {
        if self.0 & Self::LEAF == 0 { Some(self.0 as usize) } else { None }
    }

    /// Returns the place of a leaf packet, and the number of its triangles.
    #[inline(always)]
    pub(crate) fn as_leaf(self) -> (u32, u8) {
        (self.0 & (Self::MAX_PLACES - 1), (self.0 >> Self::TRIANGLES_BIT & 3) as u8 + 1)
    }
}

/// Where the leaf packets of an object are. The place of a plain packet is that of its bytes, in units of its alignment after those
/// of the first one; the place of another one is its number in the object.
#[derive(Default)]
pub(crate) struct LeafPlaces {
    /// The first byte of plain packets.
    pub(crate) plain: Option<usize>,
    /// The first place of each page, in ascending order, and the number of the page.
    pub(crate) pages: Vec<(u32, u32)>,
    /// For each run of 2^`run_bits` places, a page that does not start after it, as its place in `pages`.
    runs: Vec<u32>,
    run_bits: u32,
}

/// Places of plain packets are counted in this many bytes.
pub(crate) const PLACE_BYTES: usize = 16;
/// How many places a plain packet takes.
pub(crate) const PLACES_PER_PACKET: u32 = 9;

impl LeafPlaces {
    /// Makes the list of runs, of which there are about as many as pages.
    pub(crate) fn make_runs(&mut self) {
        let most = self.pages.last().map_or(0, |&(first, _)| first);
        self.run_bits = (u64::from(most) / self.pages.len().max(1) as u64).max(1).ilog2();
        let starts = (0..=most >> self.run_bits).map(|run| run << self.run_bits);
        self.runs = starts
            .map(|start| self.pages.partition_point(|&(first, _)| first <= start).saturating_sub(1) as u32)
            .collect();
    }

    /// Returns the leaf packet at a place.
    #[inline(always)]
    pub(crate) fn packet(&self, place: u32, triangles: u8) -> LeafPacket {
        let run = (place >> self.run_bits) as usize;
        let mut at = self.runs.get(run).or(self.runs.last()).map_or(0, |&page| page as usize);
        while self.pages.get(at + 1).is_some_and(|&(first, _)| first <= place) {
            at += 1;
        }
        let (first, page) = self.pages.get(at).copied().unwrap_or((0, 0));
        let from_first = place.wrapping_sub(first);
        let packet = if self.plain.is_some() { from_first / PLACES_PER_PACKET } else { from_first };
        LeafPacket { page, packet: packet as u16, triangles }
    }
}

/// The tree of an object.
pub(crate) struct RayTree {
    /// The bytes of the nodes. The first one is the root.
    nodes: Bytes,
    pub(crate) places: LeafPlaces,
    /// How many children a walk may have to remember.
    pub(crate) most_pending: usize,
}

impl RayTree {
    /// Makes a tree of its nodes. Large trees are moved to large memory pages, if the system has them: a ray touches a few cache lines
    /// of each of many pages.
    pub(crate) fn new(nodes: Vec<RayNode>, places: LeafPlaces, most_pending: usize) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(&nodes);
        let copy = (bytes.len() >= MIN_LARGE_BYTES).then(|| memory::copy(bytes).ok()).flatten();
        let nodes = copy.map_or_else(|| Bytes::from_owner(Nodes(nodes)), Bytes::from_owner);
        Self { nodes, places, most_pending }
    }

    #[inline(always)]
    pub(crate) fn nodes(&self) -> &[RayNode] {
        bytemuck::cast_slice(&self.nodes)
    }
}

/// Trees of this many bytes gain from large memory pages.
const MIN_LARGE_BYTES: usize = 2 << 20;

/// Keeps nodes alive behind `Bytes`.
struct Nodes(Vec<RayNode>);

impl AsRef<[u8]> for Nodes {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}

/// The tree of an object, once there is one, and what rays have spent without it.
#[derive(Default)]
pub(crate) struct RaySlot {
    spent: AtomicU64,
    /// In a box, because a file may have many objects that no ray ever meets.
    tree: OnceLock<Option<Box<RayTree>>>,
}

impl RaySlot {
    /// Returns the tree, if there is one. `cost` is how many nodes have to be read to make it, which `make` does.
    #[inline(always)]
    pub(crate) fn tree(&self, cost: u64, make: impl FnOnce() -> Option<RayTree>) -> Option<&RayTree> {
        match self.tree.get() {
            Some(known) => known.as_deref(),
            None if self.spent.load(Ordering::Relaxed) >= cost => self.make(make),
            None => None,
        }
    }

    #[cold]
    #[inline(never)]
    fn make(&self, make: impl FnOnce() -> Option<RayTree>) -> Option<&RayTree> {
        self.tree.get_or_init(|| make().map(Box::new)).as_deref()
    }

    /// Counts nodes that rays have visited without the tree, or will.
    pub(crate) fn spend(&self, nodes: u64) {
        if self.tree.get().is_none() {
            self.spent.fetch_add(nodes, Ordering::Relaxed);
        }
    }
}
