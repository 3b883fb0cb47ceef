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
//! Unlike a pair walk, it meets each node once, so it decodes nodes where it needs them, into the levels of its stack, and
//! keeps none. Lanes are slabs and children, so that one probe fills them ([`crate::traverse::point_filter`],
//! [`crate::traverse::line_filter`]). The walk ends because a file is a tree, and has no more levels than that.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes, Task};
use crate::traverse::budget::Budget;
use crate::traverse::node_cache::{Opened, leaf_at, leaf_lanes, max_nodes, open_child, spread, too_many};
use bvh_format::object::Object;
use bvh_format::slabs::Group;
use bvh_format::treelet::Links;

/// What a question does with the nodes and leaf packets that a walk meets.
pub(crate) trait ProbeVisitor {
    /// Returns lower bounds of what is to be least in four nodes: a distance, or the share of a line.
    fn bounds<I: Isa>(&self, isa: I, children: &Group) -> I::H;

    /// Returns the limit: what has a larger bound is not visited.
    fn limit(&self) -> f32;

    /// Visits one to four leaf packets.
    fn leaves<I: Isa>(&mut self, isa: I, leaves: &[LeafPacket]) -> Result<(), QueryError>;
}

/// The children of an opened node.
#[derive(Clone)]
#[repr(C, align(64))]
struct PendingChildren {
    groups: [Group; 2],
    /// Of the inner children that are left; `GONE` for the others.
    bounds: [f32; 8],
    links: Links,
    page: u32,
}

/// The bound of a child that is not to be visited.
const GONE: f32 = f32::INFINITY;

/// What makes the bounds of four children `GONE` whose bits are set, by their maximum.
static HIDDEN: [[f32; 4]; 16] = {
    let mut hidden = [[f32::NEG_INFINITY; 4]; 16];
    let mut at = 0;
    while at < 64 {
        if (at / 4) >> (at % 4) & 1 == 1 {
            hidden[at / 4][at % 4] = GONE;
        }
        at += 1;
    }
    hidden
};

impl PendingChildren {
    const EMPTY: Self = Self { groups: [Group::ZERO; 2], bounds: [GONE; 8], links: Links::NONE, page: 0 };

    /// Removes the nearest child that is left, if its bound is at most `limit`.
    #[inline(always)]
    fn take_nearest(&mut self, parts: usize, limit: f32) -> Option<usize> {
        let mut child = self.nearest_of(0);
        if parts == 2 {
            child = self.nearer(child, self.nearest_of(4));
        }
        let bound = std::mem::replace(&mut self.bounds[child & 7], GONE);
        (bound <= limit && bound != GONE).then_some(child)
    }

    /// Returns the nearest of four children.
    #[inline(always)]
    fn nearest_of(&self, first: usize) -> usize {
        self.nearer(self.nearer(first, first + 1), self.nearer(first + 2, first + 3))
    }

    /// Returns the nearer of two children, the first of equal ones. No branch could be predicted here.
    #[inline(always)]
    fn nearer(&self, first: usize, second: usize) -> usize {
        first + (second - first) * usize::from(self.bounds[second & 7] < self.bounds[first & 7])
    }
}

/// The stack of a walk, kept from one walk to the next.
#[derive(Default)]
pub(crate) struct ProbeStack {
    levels: Vec<PendingChildren>,
    /// The file and the first page of the object whose root the first level holds.
    of: Option<(u64, u32)>,
}

/// Levels made at once.
const LEVELS: usize = 16;

impl ProbeStack {
    /// Puts the root of an object on an empty stack.
    #[inline(always)]
    fn start<I: Isa>(&mut self, isa: I, bvh: &Bvh, object: &Object) -> Result<(), QueryError> {
        let page = object.record().first_page.get();
        if self.of != Some((bvh.identity(), page)) {
            let slabs = bvh.page(object, page)?.anchor_slabs(0);
            if self.levels.is_empty() {
                self.levels.resize(LEVELS, PendingChildren::EMPTY);
            }
            let root = &mut self.levels[0];
            root.groups[0] = spread(isa, &slabs);
            (root.links, root.page) = (Links { kinds: 1, ..Links::NONE }, page);
            self.of = Some((bvh.identity(), page));
        }
        self.levels[0].bounds[0] = 0.0;
        Ok(())
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
        while depth > 0 {
            if depth == stack.levels.len() {
                stack.levels.resize(depth + LEVELS, PendingChildren::EMPTY);
            }
            let (above, below) = stack.levels.split_at_mut(depth);
            let (level, next) = (&mut above[depth - 1], &mut below[0]);
            let Some(child) = level.take_nearest(parts, visitor.limit()) else {
                depth -= 1;
                continue;
            };
            opened += 1;
            if opened == max_nodes {
                return Err(too_many(bvh, object, max_nodes));
            }
            let from = (&level.groups, &level.links, level.page);
            let Some(Opened { links, page, .. }) =
                open_child(isa, (bvh, object), from, child, &mut next.groups)?
            else {
                continue;
            };
            if bvh.is_worth_prefetching() {
                for treelets in page.treelets_ahead(&links) {
                    prefetch_ahead(isa, treelets);
                }
            }
            let page = page.header().page_number.get();
            (next.links, next.page) = (links, page);
            let children = links.children().min(4 * parts);
            let mut inner = 0;
            let mut leaves = 0u32;
            for part in 0..parts {
                let bounds = visitor.bounds(isa, &next.groups[part & 1]);
                let exist = ((1u32 << children) - 1) >> (4 * part);
                let near = bounds.le(isa.splat4(visitor.limit()));
                let are_leaves = u32::from(leaf_lanes(&links, part));
                let hidden = isa.load4(&HIDDEN[((are_leaves | !exist) & 0xf) as usize]);
                let kept = I::H::select(near, bounds, isa.splat4(GONE)).max(hidden);
                isa.store4(kept, &mut next.bounds.as_chunks_mut().0[part & 1]);
                let near = u32::from(I::H::bits(near)) & exist & 0xf;
                inner |= near & !are_leaves;
                leaves |= (near & are_leaves) << (4 * part);
            }
            budget.charge(1 + u64::from(leaves.count_ones()))?;
            while leaves != 0 {
                let (mut near, mut count) = ([LeafPacket { page, packet: 0, triangles: 0 }; 4], 0);
                while leaves != 0 && count < 4 {
                    if let Some(leaf) = leaf_at(&links, page, leaves.trailing_zeros() as usize) {
                        near[count & 3] = leaf;
                        count += 1;
                    }
                    leaves &= leaves - 1;
                }
                isa.run(VisitLeaves { visitor: &mut *visitor, leaves: &near[..count] })?;
            }
            depth += usize::from(inner != 0);
        }
        Ok((opened * parts) as u64)
    }
}

/// Prefetches the treelets of up to four children, without a branch for each.
#[inline(always)]
fn prefetch_ahead<I: Isa>(isa: I, treelets: &[u8]) {
    let Some(last) = treelets.len().checked_sub(1) else { return };
    for line in 0..8 {
        isa.prefetch_line(&treelets[(64 * line).min(last)]);
    }
}

/// Visits leaf packets.
struct VisitLeaves<'a, V> {
    visitor: &'a mut V,
    leaves: &'a [LeafPacket],
}

impl<V: ProbeVisitor> Task for VisitLeaves<'_, V> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.visitor.leaves(isa, self.leaves)
    }
}
