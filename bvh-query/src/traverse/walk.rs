//! The pair walk on which every query stands: both trees, visited together.
//!
//! ```text
//! entries := {(root a, root b)}
//! while entry := pop(entries):
//!     if its lower bound exceeds the visitor's limit: skip
//!     if both nodes are leaf packets: visitor.leaves(a, b)
//!     if one is a leaf packet much larger than the other node, and its triangles are beyond the limit: skip
//!     else open a, b or both; for each of the pairs of their children:
//!         bound := lower bound of their distance along A's directions, turning slabs, and B's directions
//!         if bound <= limit: push
//! ```
//!
//! Depth-first, the entries are a stack. Best-first, they are a list that is searched for the least bound, until the
//! visitor has seen enough leaves to go on depth-first, or until the list has its full length. Then the list becomes the
//! stack.
//!
//! The walk ends: each file is a tree (its rules say so, and `NodeCache` does not rely on it), an entry
//! stands for the leaf pairs below it, and its children divide these among them. So no pair of nodes is
//! visited twice, except those of the first dive, and there are at most (nodes of A) * (nodes of B).
//!
//! Memory: each entry that is popped depth-first leaves at most four frames on the stack, one per node test, and those
//! above it are one level deeper in A or in B. So there are at most 4 * (depth of A + depth of B) frames. A tree is no
//! deeper than its number of treelets. Nothing recurses.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Task};
use crate::traverse::frames::Entry;
use crate::traverse::node_cache::{CachedNode, ChildRef};
use crate::traverse::node_filter::{Measure, NodeFilter, Witness};
use crate::traverse::placement::ObjectPair;
use crate::traverse::slab_memory::TestSlabs;
use crate::traverse::walk_memory::WalkMemory;
use bvh_format::slabs::Group;
use std::ops::ControlFlow;

/// The order in which pairs are visited.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// Depth-first, the pair of least bound first.
    Nearest,
    /// Depth-first, in whatever order is cheapest.
    Any,
    /// First straight down to one leaf pair, for a limit; then the pair of least bound of all, until
    /// the visitor has seen so many more leaf pairs; then nearest.
    Best { leaves: u32 },
}

/// What a query does with the pairs of leaf packets that a walk meets.
pub(crate) trait Visitor {
    const MEASURE: Measure;
    /// Whether bounds are to hold for two placements of B at a time, `ObjectPair::placement` and `ObjectPair::end`: then a
    /// bound is one along a direction on which B is on the same side of A in both.
    const SWEEPS: bool = false;

    fn order(&self) -> Order;

    /// Returns the limit: pairs with a larger bound are not visited.
    fn limit(&self) -> f32;

    /// Returns a direction in A's frame, at most 1 long, along which A and B are likely apart.
    fn witness(&self) -> Option<[f32; 3]> {
        None
    }

    /// Visits two leaf packets. If `at_once` is set, the walk needs the limit that they lead to now, rather than later at
    /// a lower cost.
    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        leaves: (LeafPacket, LeafPacket),
        at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError>;

    /// Completes what is pending after the last pair.
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError>;
}

/// How the next pair is found.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Visits only the nearest of each pair's children.
    Dive,
    /// Takes the pair of least bound from a list.
    BestFirst,
    /// Takes the last pair from a stack.
    DepthFirst,
}

/// The most frames in the list before the walk goes on depth-first: as many as are searched in the time of a node test.
/// Answers do not depend on it.
const MAX_LISTED_TESTS: usize = 256;

/// How many pairs of leaf packets are visited together. Answers do not depend on it.
const LEAF_PAIRS_PER_BATCH: usize = 4;

/// A node this many times larger than its partner is opened alone, so that its children meet the partner at its size.
const EXTENT_RATIO_TO_OPEN_ONE: f32 = 2.0;

/// The number of node tests along A's directions alone before B's are prepared: most queries of separated meshes end
/// before. In CAD models, whose faces follow the axes of their own frame, B's directions separate up to half of the
/// pairs that A's leave, in scans an eighth.
const NODE_TESTS_BEFORE_B_DIRECTIONS: u64 = 16;

/// Node tests before the triangles of large leaf packets are bounded one by one. Most queries of meshes of similar size
/// end before; bounding four triangles takes as long as two or three visits.
const NODE_TESTS_BEFORE_TRIANGLE_BOUNDS: u64 = 128;

/// Visits all pairs of leaf packets that may be within the visitor's limit. Returns the number of node tests.
#[inline(always)]
pub(crate) fn traverse<I: Isa, W: Visitor>(
    isa: I,
    pair: ObjectPair<'_>,
    memory: &mut WalkMemory,
    visitor: &mut W,
) -> Result<u64, QueryError> {
    let mut node_filter = memory.node_filter.take().unwrap_or_else(|| Box::new(NodeFilter::NONE));
    let tests = walk(isa, pair, memory, &mut node_filter, visitor);
    memory.node_filter = Some(node_filter);
    tests
}

#[inline(always)]
fn walk<I: Isa, W: Visitor>(
    isa: I,
    pair: ObjectPair<'_>,
    memory: &mut WalkMemory,
    node_filter: &mut NodeFilter,
    visitor: &mut W,
) -> Result<u64, QueryError> {
    memory.stack.clear();
    memory.leaf_pairs.clear();
    memory.list.clear();
    memory.large_leaves.start();
    memory.aligned_a.start();
    memory.aligned_b.start();
    let reach_a = memory.nodes_a.start(isa, pair.bvh_a, pair.object_a)?;
    let reach_b = memory.nodes_b.start(isa, pair.bvh_b, pair.object_b)?;
    memory.slabs.start(&pair);
    node_filter.prepare(isa, &pair, (reach_a, reach_b));
    if W::SWEEPS {
        // What else bounds a pair knows of one placement only.
        node_filter.prepare_end(isa, pair.end);
        memory.slabs.stop();
    }
    let mut witness: Option<Witness> = None;
    node_filter.update_witness(&mut witness, visitor.witness());
    let (mut tests, mut leaves) = (0, 0);
    let order = visitor.order();
    let mut phase = if matches!(order, Order::Best { .. }) { Phase::Dive } else { Phase::DepthFirst };
    memory.stack.push_one(Entry::ROOTS);
    if phase == Phase::Dive {
        // What follows the dive starts at the roots again.
        memory.list.push_one(Entry::ROOTS);
    }
    loop {
        if memory.leaf_pairs.len() >= LEAF_PAIRS_PER_BATCH
            || memory.stack.is_empty() && memory.leaf_pairs.len() > 0
        {
            if memory.visit_leaf_pairs(isa, visitor)?.is_break() {
                return Ok(tests);
            }
            node_filter.update_witness(&mut witness, visitor.witness());
        }
        let next = match memory.stack.pop(isa) {
            Some(next) if next.bound > visitor.limit() => continue,
            Some(next) => next,
            None => {
                if phase == Phase::Dive {
                    // The dive has ended at a leaf pair, or at a node none of whose children is within the limit.
                    phase = Phase::BestFirst;
                }
                match memory.list.pop_least(isa) {
                    Some(least) if least.bound <= visitor.limit() => least,
                    // If there is one, it is the least bound of all.
                    _ => break,
                }
            }
        };
        memory.visit()?;
        if let Some(leaves_of_pair) = memory.leaf_pair(next) {
            let at_once = phase != Phase::DepthFirst;
            if isa.run(VisitLeaves { visitor, leaves: leaves_of_pair, at_once })?.is_break() {
                return Ok(tests);
            }
            node_filter.update_witness(&mut witness, visitor.witness());
            leaves += u32::from(phase == Phase::BestFirst);
            if matches!(order, Order::Best { leaves: enough } if phase == Phase::BestFirst && leaves >= enough)
            {
                phase = Phase::DepthFirst;
                memory.list_to_stack();
            }
            continue;
        }
        let WalkMemory { nodes_a, nodes_b, large_leaves, .. } = memory;
        if !W::SWEEPS
            && tests >= NODE_TESTS_BEFORE_TRIANGLE_BOUNDS
            && large_leaves.are_beyond(
                &pair,
                (nodes_a, nodes_b),
                node_filter.reaches(),
                next,
                visitor.limit(),
            )?
        {
            continue;
        }
        if !W::SWEEPS && tests >= NODE_TESTS_BEFORE_B_DIRECTIONS && !node_filter.looks_along_b() {
            node_filter.look_along_b(isa);
        }
        let sides = memory.open::<I, W>(isa, &pair, node_filter, next)?;
        tests += memory.push_children(
            isa,
            W::MEASURE,
            node_filter,
            &witness,
            &sides,
            visitor.limit(),
            (phase, order),
        );
        if phase == Phase::BestFirst && memory.list.len() > MAX_LISTED_TESTS {
            phase = Phase::DepthFirst;
            memory.list_to_stack();
        }
    }
    isa.run(Finish(visitor))?;
    Ok(tests)
}

/// Opened nodes of A and B whose children meet. If a node was not opened, its parent stands for it, and only this one child
/// of the parent is tested.
struct Sides {
    node_a: usize,
    only_a: Option<usize>,
    node_b: usize,
    only_b: Option<usize>,
}

/// Visits two leaf packets.
struct VisitLeaves<'a, W> {
    visitor: &'a mut W,
    leaves: (LeafPacket, LeafPacket),
    at_once: bool,
}

impl<W: Visitor> Task for VisitLeaves<'_, W> {
    type Output = Result<ControlFlow<()>, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.visitor.leaves(isa, self.leaves, self.at_once)
    }
}

/// Completes what is pending after the last pair.
struct Finish<'a, W>(&'a mut W);

impl<W: Visitor> Task for Finish<'_, W> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.0.finish(isa)
    }
}

/// Aligns an opened node of A to B's directions.
struct AlignA<'a> {
    node_filter: &'a NodeFilter,
    node: &'a CachedNode,
    to: &'a mut [Group; 2],
}

impl Task for AlignA<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        for part in 0..self.node.count.div_ceil(4) {
            self.node_filter.align_a(isa, &self.node.groups[part & 1], &mut self.to[part & 1]);
        }
    }
}

/// Aligns an opened node of B to A's directions.
struct AlignB<'a> {
    node_filter: &'a NodeFilter,
    node: &'a CachedNode,
    to: &'a mut [Group; 2],
}

impl Task for AlignB<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        for part in 0..self.node.count.div_ceil(4) {
            self.node_filter.align_b(isa, &self.node.groups[part & 1], &mut self.to[part & 1]);
        }
    }
}

/// Aligns an opened node of B in both placements to A's directions, and joins the slabs.
struct AlignBothEnds<'a> {
    node_filter: &'a NodeFilter,
    node: &'a CachedNode,
    to: &'a mut [Group; 2],
}

impl Task for AlignBothEnds<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        for part in 0..self.node.count.div_ceil(4) {
            self.node_filter.align_b_at_both_ends(isa, &self.node.groups[part & 1], &mut self.to[part & 1]);
        }
    }
}

impl WalkMemory {
    /// Goes on depth-first with the frames of the list, the least bound next. The stack is empty.
    fn list_to_stack(&mut self) {
        self.list.nearest_last();
        std::mem::swap(&mut self.list, &mut self.stack);
    }

    /// Visits the pairs of leaf packets that have been collected.
    #[inline(always)]
    fn visit_leaf_pairs<I: Isa, W: Visitor>(
        &mut self,
        isa: I,
        visitor: &mut W,
    ) -> Result<ControlFlow<()>, QueryError> {
        for at in 0..self.leaf_pairs.len() {
            let next = self.leaf_pairs.get(at);
            if next.bound > visitor.limit() {
                continue;
            }
            self.visit()?;
            if let Some(leaves) = self.leaf_pair(next)
                && isa.run(VisitLeaves { visitor, leaves, at_once: false })?.is_break()
            {
                return Ok(ControlFlow::Break(()));
            }
        }
        self.leaf_pairs.clear();
        Ok(ControlFlow::Continue(()))
    }

    /// Returns both leaf packets, if the entry is a pair of them.
    #[inline(always)]
    fn leaf_pair(&self, entry: Entry) -> Option<(LeafPacket, LeafPacket)> {
        let a = self.nodes_a.get(entry.a.node()).leaf(entry.a.child())?;
        let b = self.nodes_b.get(entry.b.node()).leaf(entry.b.child())?;
        Some((a, b))
    }

    /// Opens both nodes of a pair, or the inner one against a leaf, or the much larger one.
    #[inline(always)]
    fn open<I: Isa, W: Visitor>(
        &mut self,
        isa: I,
        pair: &ObjectPair<'_>,
        node_filter: &NodeFilter,
        entry: Entry,
    ) -> Result<Sides, QueryError> {
        let (node_a, node_b) = (self.nodes_a.get(entry.a.node()), self.nodes_b.get(entry.b.node()));
        let (child_a, child_b) = (entry.a.child(), entry.b.child());
        let (leaf_a, leaf_b) = (node_a.is_leaf(child_a), node_b.is_leaf(child_b));
        let (extent_a, extent_b) = (node_a.extents[child_a], node_b.extents[child_b]);
        let mut sides = Sides {
            node_a: entry.a.node(),
            only_a: Some(child_a),
            node_b: entry.b.node(),
            only_b: Some(child_b),
        };
        let a_is_small = extent_b > EXTENT_RATIO_TO_OPEN_ONE * extent_a;
        // In a forged file both comparisons may hold: one node is opened in any case.
        let b_is_small = extent_a > EXTENT_RATIO_TO_OPEN_ONE * extent_b && !a_is_small;
        if !leaf_a && (leaf_b || !a_is_small) {
            let number = self.nodes_a.open(isa, pair.bvh_a, pair.object_a, entry.a)?;
            (sides.node_a, sides.only_a) = (number, None);
        }
        if !leaf_b && (leaf_a || !b_is_small) {
            let number = self.nodes_b.open(isa, pair.bvh_b, pair.object_b, entry.b)?;
            (sides.node_b, sides.only_b) = (number, None);
            let (to, is_aligned) = self.aligned_b.of(number);
            if !is_aligned {
                let node = self.nodes_b.get(number);
                if W::SWEEPS {
                    isa.run(AlignBothEnds { node_filter, node, to });
                } else {
                    isa.run(AlignB { node_filter, node, to });
                }
            }
        }
        Ok(sides)
    }

    /// Tests all pairs of children and keeps those within the limit. Returns the number of tests.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "inlined at one place")]
    fn push_children<I: Isa>(
        &mut self,
        isa: I,
        measure: Measure,
        node_filter: &NodeFilter,
        witness: &Option<Witness>,
        sides: &Sides,
        limit: f32,
        (phase, order): (Phase, Order),
    ) -> u64 {
        let first_frame = self.stack.len();
        let (side_a, side_b) = (self.nodes_a.get(sides.node_a), self.nodes_b.get(sides.node_b));
        let (aligned_b, is_aligned) = self.aligned_b.of(sides.node_b);
        // It was when it was opened. Node 0 never is; both roots are opened at once, so it meets no other node.
        debug_assert!(is_aligned, "node {} of B was not aligned in this walk", sides.node_b);
        let mut tests = 0;
        let (mut part_a, end_a) = parts(sides.only_a, side_a.count);
        while part_a < end_a {
            let (mut part_b, end_b) = parts(sides.only_b, side_b.count);
            while part_b < end_b {
                let tested = if phase == Phase::BestFirst { self.list.room() } else { self.stack.room() };
                tested.a = ChildRef::new(sides.node_a, 4 * part_a);
                tested.b = ChildRef::new(sides.node_b, 4 * part_b);
                let groups = (&side_a.groups[part_a & 1], &side_b.groups[part_b & 1], &aligned_b[part_b & 1]);
                let mut mask = node_filter.run(isa, measure, groups, witness, limit, &mut tested.bounds);
                mask &= lanes_of_a(sides.only_a, side_a.count, part_a);
                mask &= lanes_of_b(sides.only_b, side_b.count, part_b);
                if mask != 0 && self.slabs.are_due() {
                    let memory = &mut self.slabs;
                    let nodes = ((&self.nodes_a, sides.node_a), (&self.nodes_b, sides.node_b));
                    mask = isa.run(TestSlabs { memory, node_filter, measure, nodes, limit, tested, mask });
                }
                if mask != 0 && node_filter.looks_along_b() {
                    let (to, is_aligned) = self.aligned_a.of(sides.node_a);
                    if !is_aligned {
                        isa.run(AlignA { node_filter, node: side_a, to });
                    }
                    let groups = (&to[part_a & 1], &side_b.groups[part_b & 1]);
                    mask &= node_filter.run_along_b(isa, measure, groups, limit, &mut tested.bounds);
                }
                if phase == Phase::DepthFirst {
                    let leaves = rows_of(side_a.leaves(part_a)) & (0x1111 * side_b.leaves(part_b));
                    self.leaf_pairs.append(isa, tested, mask & leaves);
                    mask &= !leaves;
                }
                let first = match order {
                    Order::Any => mask.trailing_zeros(),
                    _ => isa.least(&tested.bounds, mask),
                };
                match phase {
                    Phase::DepthFirst => self.stack.push(mask, first),
                    Phase::BestFirst => self.list.push(mask, first),
                    Phase::Dive => self.stack.push(mask & 1u16.unbounded_shl(first), first),
                }
                tests += 1;
                part_b += 1;
            }
            part_a += 1;
        }
        if phase == Phase::Dive {
            self.stack.keep_nearest(first_frame);
        }
        tests
    }
}

/// Spreads a mask of four children of A to the lanes of their rows.
#[inline(always)]
fn rows_of(children: u16) -> u16 {
    // Each bit to the first lane of its row; times 15 to all of them.
    15 * ((children | children << 3 | children << 6 | children << 9) & 0x1111)
}

/// Returns the groups of four children to test: all groups, or the group of the only child to test.
#[inline(always)]
fn parts(only: Option<usize>, count: usize) -> (usize, usize) {
    match only {
        Some(child) => (child / 4, child / 4 + 1),
        None => (0, count.div_ceil(4)),
    }
}

/// Returns the lanes whose child of A exists, or is the only child to test.
#[inline(always)]
fn lanes_of_a(only: Option<usize>, count: usize, part: usize) -> u16 {
    match only {
        Some(child) => 0xf << (4 * (child % 4)),
        None => ((1u32 << (4 * (count - 4 * part).min(4))) - 1) as u16,
    }
}

/// Returns the lanes whose child of B exists, or is the only child to test.
#[inline(always)]
fn lanes_of_b(only: Option<usize>, count: usize, part: usize) -> u16 {
    match only {
        Some(child) => 0x1111 << (child % 4),
        None => 0x1111 * ((1u16 << (count - 4 * part).min(4)) - 1),
    }
}
