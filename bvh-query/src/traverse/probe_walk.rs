//! The walk of one tree for a point or a line: nearest child first, four children in the lanes of a register.
//!
//! ```text
//! stack := [the root]
//! while level := top(stack):
//!     child := nearest child of the level that is left; if none or bound(child) > limit: pop, next
//!     decode the children of the child, and bound where the probe meets them
//!     visitor.leaves(leaf packets among them within the limit)
//!     push the others within the limit as a level, if there are any
//! ```
//!
//! A walk meets each node once, but most walks of a mesh meet the nodes near its root. These stay decoded from one walk to the
//! next, and the others are decoded into the levels of the stack. Lanes are slabs and children, so that one probe fills them
//! ([`crate::traverse::point_filter`], [`crate::traverse::line_filter`]). The walk ends because a file is a tree, and has
//! no more levels than that.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes, Task};
use crate::traverse::budget::Budget;
use crate::traverse::node_cache::{max_nodes, too_many};
use crate::traverse::open_child::{ClosedChild, Opened, leaf_at, leaf_lanes, open_child, spread};
use bvh_format::object::Object;
use bvh_format::slabs::Group;
use bvh_format::treelet::Links;

/// What a question does with the nodes and leaf packets that a walk meets.
pub(crate) trait ProbeVisitor {
    /// Returns lower bounds of what is to be least in four nodes: a distance, or the share of a line.
    fn bounds<I: Isa>(&self, isa: I, children: &Group) -> I::F32x4;

    /// Returns the limit: what has a larger bound is not visited.
    fn limit(&self) -> f32;

    /// Visits one to four leaf packets.
    fn leaves<I: Isa>(&mut self, isa: I, leaves: &[LeafPacket]) -> Result<(), QueryError>;
}

/// The children of an opened node.
#[derive(Clone)]
#[repr(C, align(64))]
struct OpenedNode {
    groups: [Group; 2],
    links: Links,
    page: u32,
    /// A bit for each child that is an inner node, and for each that is a leaf packet.
    inner: u8,
    leaves: u8,
    /// The numbers of the nodes of its children that are kept; `CLOSED` for others.
    kept: [u32; 8],
}

/// Stands for the number of a node that is not kept.
const CLOSED: u32 = u32::MAX;

impl OpenedNode {
    const EMPTY: Self = Self {
        groups: [Group::ZERO; 2],
        links: Links::NONE,
        page: 0,
        inner: 0,
        leaves: 0,
        kept: [CLOSED; 8],
    };

    /// Opens a child of another node. Returns whether it is an inner node.
    #[inline(always)]
    fn read<I: Isa>(
        &mut self,
        isa: I,
        (bvh, object): (&Bvh, &Object),
        parent: &Self,
        child: usize,
    ) -> Result<bool, QueryError> {
        let closed = ClosedChild {
            group: &parent.groups[(child / 4) & 1],
            column: child % 4,
            links: &parent.links,
            place: child,
            page: parent.page,
        };
        let Some(Opened { links, page, .. }) =
            open_child(isa, (bvh, object), &closed, self.groups.each_mut())?
        else {
            return Ok(false);
        };
        if bvh.is_worth_prefetching() {
            for treelets in page.treelets_ahead(&links) {
                isa.prefetch::<8>(treelets);
            }
        }
        let leaves = leaf_lanes(&links, 0) | leaf_lanes(&links, 1) << 4;
        let children = (1u16 << links.children().min(object.profile().width())) - 1;
        (self.links, self.page) = (links, page.header().page_number.get());
        self.kept = [CLOSED; 8];
        (self.inner, self.leaves) = ((children & !leaves) as u8, (children & leaves) as u8);
        Ok(true)
    }
}

/// What is left to visit of an opened node.
struct Level {
    /// Bounds of the inner children that are left; `GONE` for the others.
    bounds: [f32; 8],
    /// The number of the node.
    node: u32,
    /// The number of the level's own node, which it has unless the node is kept.
    own: u32,
}

/// The bound of a child that is not to be visited.
const GONE: f32 = f32::INFINITY;

/// What makes the bounds of four children `GONE` whose bits are not set, by their maximum.
static HIDDEN: [[f32; 4]; 16] = {
    let mut hidden = [[f32::NEG_INFINITY; 4]; 16];
    let mut at = 0;
    while at < 64 {
        if (at / 4) >> (at % 4) & 1 == 0 {
            hidden[at / 4][at % 4] = GONE;
        }
        at += 1;
    }
    hidden
};

impl Level {
    /// Removes the nearest child that is left, the first of equally near ones, if its bound is at most `limit`. No branch
    /// could predict which one it is.
    #[inline(always)]
    fn take_nearest<I: Isa>(&mut self, isa: I, parts: usize, limit: f32) -> Option<usize> {
        let less = |x: f32, y: f32| if x < y { x } else { y };
        let least_of = |quad: &[f32; 4]| less(less(quad[0], quad[1]), less(quad[2], quad[3]));
        let [first, second] = self.bounds.as_chunks::<4>().0 else { return None };
        let is_wide = parts == 2;
        let least = if is_wide { less(least_of(first), least_of(second)) } else { least_of(first) };
        if !(least <= limit && least != GONE) {
            return None;
        }
        let equal = |quad: &[f32; 4]| u32::from(I::F32x4::bits(isa.load4(quad).le(isa.splat4(least))));
        let nearest = if is_wide { equal(first) | equal(second) << 4 } else { equal(first) };
        let child = nearest.trailing_zeros() as usize & 7;
        self.bounds[child] = GONE;
        Some(child)
    }
}

/// The stack of a walk, and the nodes near the root, which stay from one walk to the next.
#[derive(Default)]
pub(crate) struct ProbeStack {
    /// The first one has the root as the only child of its node.
    levels: Vec<Level>,
    nodes: Nodes,
    /// The file and the first page of the object whose nodes these are.
    of: Option<(u64, u32)>,
}

/// Levels made at once.
const LEVELS: usize = 16;

/// How many levels of nodes are kept, with the root's: of four children up to 341 nodes, of eight up to 585.
#[inline(always)]
fn kept_levels(parts: usize) -> usize {
    if parts == 1 { 5 } else { 4 }
}

impl ProbeStack {
    /// Puts the root of an object on an empty stack.
    #[inline(always)]
    fn start<I: Isa>(&mut self, isa: I, bvh: &Bvh, object: &Object) -> Result<(), QueryError> {
        let page = object.record().first_page.get();
        if self.of != Some((bvh.identity(), page)) {
            let slabs = bvh.page(object, page)?.anchor_slabs(0);
            self.levels.clear();
            self.nodes.used = 0;
            self.nodes.add_levels(&mut self.levels);
            let top = &mut self.nodes.nodes[0];
            top.groups[0] = spread(isa, &slabs);
            (top.links, top.page) = (Links { kinds: 1, ..Links::NONE }, page);
            top.kept = [CLOSED; 8];
            self.of = Some((bvh.identity(), page));
        }
        self.levels[0].bounds[0] = 0.0;
        Ok(())
    }
}

/// The nodes of the levels, and those near the root.
#[derive(Default)]
struct Nodes {
    nodes: Vec<OpenedNode>,
    used: usize,
}

impl Nodes {
    /// Makes room for more nodes.
    #[cold]
    fn grow(&mut self) {
        self.nodes.resize(self.used + 4 * LEVELS, OpenedNode::EMPTY);
    }

    /// Adds some levels to a stack.
    #[cold]
    fn add_levels(&mut self, levels: &mut Vec<Level>) {
        let first = self.used as u32;
        levels.extend((first..).take(LEVELS).map(|own| Level { bounds: [GONE; 8], node: own, own }));
        self.used += LEVELS;
        if self.used >= self.nodes.len() {
            self.grow();
        }
    }

    /// Opens a child of a node. Returns the number of its own node, which is `own` unless it is kept; nothing if it is not
    /// an inner node.
    #[inline(always)]
    fn open<I: Isa>(
        &mut self,
        isa: I,
        of: (&Bvh, &Object),
        (node, child): (u32, usize),
        (own, is_kept): (u32, bool),
    ) -> Result<Option<u32>, QueryError> {
        let number = if is_kept { self.used as u32 } else { own };
        let places = [node as usize, number as usize];
        let Ok([parent, to]) = self.nodes.get_disjoint_mut(places) else {
            unreachable!("a node is opened into another one")
        };
        let known = parent.kept[child & 7];
        if known != CLOSED {
            return Ok(Some(known));
        }
        if !to.read(isa, of, parent, child)? {
            return Ok(None);
        }
        if is_kept {
            parent.kept[child & 7] = number;
            self.used += 1;
            if self.used == self.nodes.len() {
                self.grow();
            }
        }
        Ok(Some(number))
    }
}

/// A walk of an object.
pub(crate) struct ProbeWalk<'a, V> {
    pub(crate) bvh: &'a Bvh,
    pub(crate) object: &'a Object,
    pub(crate) stack: &'a mut ProbeStack,
    pub(crate) budget: &'a mut Budget,
    pub(crate) visitor: &'a mut V,
}

impl<V: ProbeVisitor> Task for ProbeWalk<'_, V> {
    /// The number of node tests.
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { bvh, object, stack, budget, visitor } = self;
        stack.start(isa, bvh, object)?;
        let (parts, max_nodes) = (object.profile().groups(), max_nodes(object));
        let (mut opened, mut depth) = (0, 1);
        let ProbeStack { levels, nodes, .. } = stack;
        while depth > 0 {
            if depth == levels.len() {
                nodes.add_levels(levels);
            }
            let (above, below) = levels.split_at_mut(depth);
            let (level, next) = (&mut above[depth - 1], &mut below[0]);
            let Some(child) = level.take_nearest(isa, parts, visitor.limit()) else {
                depth -= 1;
                continue;
            };
            opened += 1;
            if opened > max_nodes {
                return Err(too_many(bvh, object, max_nodes));
            }
            let is_kept = depth <= kept_levels(parts);
            let at = (level.node, child);
            let Some(number) = nodes.open(isa, (bvh, object), at, (next.own, is_kept))? else { continue };
            next.node = number;
            let node = &nodes.nodes[number as usize];
            if depth == kept_levels(parts) && bvh.is_worth_prefetching() {
                for treelets in bvh.page(object, node.page)?.treelets_ahead(&node.links) {
                    isa.prefetch::<8>(treelets);
                }
            }
            let (mut inner, mut leaves) = (0, 0u32);
            for part in 0..parts {
                let bounds = visitor.bounds(isa, &node.groups[part & 1]);
                let near = bounds.le(isa.splat4(visitor.limit()));
                let are_inner = node.inner >> (4 * part) & 0xf;
                let hidden = isa.load4(&HIDDEN[are_inner as usize]);
                let kept = I::F32x4::select(near, bounds, isa.splat4(GONE)).max(hidden);
                isa.store4(kept, &mut next.bounds.as_chunks_mut().0[part & 1]);
                let near = u32::from(I::F32x4::bits(near) as u8) << (4 * part);
                inner |= near & u32::from(node.inner);
                leaves |= near & u32::from(node.leaves);
            }
            budget.charge(1 + u64::from(leaves.count_ones()))?;
            let (links, page) = (node.links, node.page);
            while leaves != 0 {
                let (mut near, mut count) = ([LeafPacket { page, packet: 0, triangles: 0 }; 4], 0);
                while leaves != 0 && count < 4 {
                    if let Some(leaf) = leaf_at(&links, page, leaves.trailing_zeros() as usize) {
                        near[count & 3] = leaf;
                        count += 1;
                    }
                    leaves &= leaves - 1;
                }
                isa.run(VisitProbeLeaves { visitor: &mut *visitor, leaves: &near[..count] })?;
            }
            depth += usize::from(inner != 0);
        }
        Ok((opened * parts) as u64)
    }
}

/// Visits leaf packets.
struct VisitProbeLeaves<'a, V> {
    visitor: &'a mut V,
    leaves: &'a [LeafPacket],
}

impl<V: ProbeVisitor> Task for VisitProbeLeaves<'_, V> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.visitor.leaves(isa, self.leaves)
    }
}
