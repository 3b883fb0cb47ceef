//! The walk of one tree towards a point: nearest child first, four children in the lanes of a register.
//!
//! ```text
//! stack := [the root]
//! while frame := top(stack):
//!     child := nearest child of the frame that is left; if none or bound(child) > limit: pop, next
//!     decode the children of the child, and bound their distances
//!     visitor.leaves(leaf packets among them within the limit)
//!     push the others within the limit as a frame, if there are any
//! ```
//!
//! Unlike a pair walk, it meets each node once, so it decodes nodes where it needs them, into the frames of its stack, and
//! keeps none. Lanes are slabs and children, so that one point fills them ([`crate::traverse::point_test`]). The walk ends
//! because a file is a tree, and has at most one frame for each level.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes, Task};
use crate::traverse::node_cache::{Opened, leaf_at, leaf_lanes, max_nodes, open_child, spread, too_many};
use bvh_format::object::Object;
use bvh_format::slabs::Group;
use bvh_format::treelet::Links;

/// What a question does with the nodes and leaf packets that a walk meets.
pub(crate) trait PointVisitor {
    /// Returns lower bounds of the distances of four nodes.
    fn bounds<I: Isa>(&self, isa: I, children: &Group) -> I::H;

    /// Returns the limit: what has a larger bound is not visited.
    fn limit(&self) -> f32;

    /// Visits one to four leaf packets.
    fn leaves<I: Isa>(&mut self, isa: I, leaves: &[LeafPacket]) -> Result<(), QueryError>;
}

/// The children of an opened node.
#[derive(Clone)]
#[repr(C, align(64))]
struct PointFrame {
    groups: [Group; 2],
    /// The order of the inner children that are left: bound and number, see [`key`]. `GONE` for the others.
    keys: [i64; 8],
    links: Links,
    page: u32,
}

/// The key of a child that is not to be visited.
const GONE: i64 = i64::MAX;

/// Returns a number that is in the order of bounds, with the number of a child in its lowest bits.
#[inline(always)]
fn key(bound: f32, child: usize) -> i64 {
    let bits = bound.to_bits() as i32;
    // Negative numbers the other way round.
    let ordered = bits ^ ((bits >> 31) as u32 >> 1) as i32;
    i64::from(ordered) << 32 | child as i64
}

impl PointFrame {
    const EMPTY: Self = Self {
        groups: [Group::ZERO; 2],
        keys: [GONE; 8],
        links: Links { kinds: 0, first_treelet: 0, first_remote: 0, first_leaf: 0 },
        page: 0,
    };

    /// Removes the nearest child that is left, if its bound is at most `limit`.
    #[inline(always)]
    fn take_nearest(&mut self, parts: usize, limit: f32) -> Option<usize> {
        let [a, b, c, d, e, f, g, h] = self.keys;
        let mut nearest = a.min(b).min(c.min(d));
        if parts == 2 {
            nearest = nearest.min(e.min(f).min(g.min(h)));
        }
        let child = nearest as usize & 7;
        // A limit is not negative.
        if nearest > key(limit, u32::MAX as usize) {
            return None;
        }
        self.keys[child] = GONE;
        Some(child)
    }
}

/// The stack of a walk, kept from one walk to the next.
#[derive(Default)]
pub(crate) struct PointStack {
    frames: Vec<PointFrame>,
    /// The file and the first page of the object whose root the first frame holds.
    of: Option<(u64, u32)>,
}

/// Frames made at once.
const FRAMES: usize = 16;

impl PointStack {
    /// Puts the root of an object on an empty stack.
    #[inline(always)]
    fn start<I: Isa>(&mut self, isa: I, bvh: &Bvh, object: &Object) -> Result<(), QueryError> {
        let page = object.record().first_page.get();
        if self.of != Some((bvh.identity(), page)) {
            let slabs = bvh.page(object, page)?.anchor_slabs(0);
            if self.frames.is_empty() {
                self.frames.resize(FRAMES, PointFrame::EMPTY);
            }
            let root = &mut self.frames[0];
            root.groups[0] = spread(isa, &slabs);
            (root.links, root.page) = (Links { kinds: 1, ..Links::default() }, page);
            self.of = Some((bvh.identity(), page));
        }
        self.frames[0].keys[0] = key(0.0, 0);
        Ok(())
    }
}

/// A walk of an object.
pub(crate) struct PointWalk<'a, V> {
    pub(crate) bvh: &'a Bvh,
    pub(crate) object: &'a Object,
    pub(crate) stack: &'a mut PointStack,
    /// The visits that may still be made.
    pub(crate) left: &'a mut u64,
    pub(crate) budget: u64,
    pub(crate) visitor: &'a mut V,
}

impl<V: PointVisitor> Task for PointWalk<'_, V> {
    /// The number of node tests.
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { bvh, object, stack, left, budget, visitor } = self;
        stack.start(isa, bvh, object)?;
        let (parts, max_nodes) = (object.profile().groups(), max_nodes(object));
        let (mut opened, mut depth) = (0, 1);
        while depth > 0 {
            if depth == stack.frames.len() {
                stack.frames.resize(depth + FRAMES, PointFrame::EMPTY);
            }
            let (above, below) = stack.frames.split_at_mut(depth);
            let (frame, next) = (&mut above[depth - 1], &mut below[0]);
            let Some(child) = frame.take_nearest(parts, visitor.limit()) else {
                depth -= 1;
                continue;
            };
            opened += 1;
            if opened == max_nodes {
                return Err(too_many(bvh, object, max_nodes));
            }
            let from = (&frame.groups, &frame.links, frame.page);
            let Some(Opened { links, page, .. }) =
                open_child(isa, (bvh, object), from, child, &mut next.groups)?
            else {
                continue;
            };
            (next.links, next.page) = (links, page);
            let children = links.children().min(4 * parts);
            let mut inner = 0;
            let mut leaves = 0u32;
            for part in 0..parts {
                let bounds = visitor.bounds(isa, &next.groups[part & 1]);
                let exist = ((1u32 << children) - 1) >> (4 * part);
                let near = u32::from(I::H::bits(bounds.le(isa.splat4(visitor.limit())))) & exist & 0xf;
                let are_leaves = u32::from(leaf_lanes(&links, part));
                let mut values = [0.0; 4];
                isa.store4(bounds, &mut values);
                let inner_here = near & !are_leaves;
                for lane in 0..4 {
                    let key = key(values[lane], 4 * part + lane);
                    next.keys[(4 * part + lane) & 7] = if inner_here >> lane & 1 == 1 { key } else { GONE };
                }
                inner |= inner_here;
                leaves |= (near & are_leaves) << (4 * part);
            }
            let visits = 1 + u64::from(leaves.count_ones());
            *left = left.checked_sub(visits).ok_or(QueryError::Budget { visits: budget })?;
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

/// Visits leaf packets.
struct VisitLeaves<'a, V> {
    visitor: &'a mut V,
    leaves: &'a [LeafPacket],
}

impl<V: PointVisitor> Task for VisitLeaves<'_, V> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.visitor.leaves(isa, self.leaves)
    }
}
