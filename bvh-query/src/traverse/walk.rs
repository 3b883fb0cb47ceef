//! The pair walk, on which queries about two meshes and motions stand: both trees, visited together.
//!
//! `PlainWalk::visit` below shows what it does, and tests compare both. This file adds what makes it fast: 16 pairs of children
//! are bounded at a time, along A's directions, turning slabs, and B's directions; both nodes are opened at once; the triangles
//! of a leaf packet much larger than the other node are bounded one by one; and entries wait in a list of its own rather than on
//! the stack of calls, so that the nearest can come first.
//!
//! Depth-first, the entries are a stack. Best-first, they are a list that is searched for the least bound, until the
//! visitor has seen enough leaves to go on depth-first, or until the list has its full length. Then the list becomes the
//! stack.
//!
//! The walk ends, for this reason. Each file is a tree (its rules say so, and `NodeCache` does not rely on it). An
//! entry stands for the leaf pairs below it, and its children divide these among themselves. So no pair of nodes is
//! visited twice, except those of the first dive, and there are at most (nodes of A) * (nodes of B) visits.
//!
//! Memory: each entry that is popped depth-first leaves at most four node tests on the stack, and those above it are
//! one level deeper in A or in B. So there are at most 4 * (depth of A + depth of B) tests. A tree is no deeper than
//! its number of treelets. Nothing recurses.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Task};
use crate::traverse::budget::Budget;
use crate::traverse::cached_node::ChildRef;
use crate::traverse::large_leaf::LargeLeaves;
use crate::traverse::leaf_pairs::LeafPairs;
use crate::traverse::node_cache::{NodeCache, Root, max_nodes};
use crate::traverse::node_filter::{Measure, NodeFilter, SeparatingDirection};
use crate::traverse::pending::{Entry, PendingTests};
use crate::traverse::per_node::PerWalk;
use crate::traverse::placement::ObjectPair;
use crate::traverse::slab_memory::{SlabMemory, TestSlabs};
#[cfg(feature = "__trace")]
use crate::traverse::trace;
use bvh_format::slabs::Group;
use std::ops::ControlFlow;

#[cfg(test)]
impl tests::PlainWalk<'_> {
    /// Visits all pairs of leaf packets below two nodes that may be within the limit.
    fn visit(&mut self, a: ChildRef, b: ChildRef) -> Result<(), QueryError> {
        if self.gap(a, b) > self.limit {
            return Ok(());
        }
        match (self.nodes.leaf(a), self.nodes.leaf(b)) {
            (Some(leaf_a), Some(leaf_b)) => self.leaf_pairs.push((leaf_a, leaf_b)),
            (None, _) => {
                for child in self.children_of_a(a)? {
                    self.visit(child, b)?;
                }
            }
            (Some(_), None) => {
                for child in self.children_of_b(b)? {
                    self.visit(a, child)?;
                }
            }
        }
        Ok(())
    }
}

/// The order in which pairs are visited.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// Depth-first, the pair of least bound first.
    Nearest,
    /// Depth-first, in whatever order is cheapest.
    Any,
    /// First straight down to one leaf pair, to get a limit; then the pair of least bound of all, until the visitor has
    /// seen `leaves` more leaf pairs; then as `Nearest`.
    Best { leaves: u32 },
}

/// What a query does with the pairs of leaf packets that a walk meets.
pub(crate) trait Visitor {
    const MEASURE: Measure;
    /// Whether bounds must hold for two placements of B at a time, `ObjectPair::placement` and `ObjectPair::end`. A
    /// bound is then one along a direction on which B is on the same side of A in both.
    const SWEEPS: bool = false;

    fn order(&self) -> Order;

    /// Returns the limit: pairs with a larger bound are not visited.
    fn limit(&self) -> f32;

    /// Returns the direction along which B moves, of about unit length, for `Measure::Leaving`.
    fn direction(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// Whether `order` may be `Order::Best`.
    const MAY_BE_BEST_FIRST: bool = false;

    /// Whether `separating_direction` returns anything.
    const HAS_SEPARATING_DIRECTION: bool = false;

    /// Returns a direction in A's frame, at most 1 long, along which A and B are likely apart.
    fn separating_direction(&self) -> Option<[f32; 3]> {
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

/// The most tests in the list before the walk goes on depth-first: as many as are searched in the time of a node test.
/// Answers do not depend on it.
const MAX_LISTED_TESTS: usize = 256;

/// How many pairs of leaf packets are visited together. Answers do not depend on it.
const LEAF_PAIRS_PER_BATCH: u32 = 4;

/// A node this many times larger than its partner is opened alone, so that its children meet the partner at its size.
const EXTENT_RATIO_TO_OPEN_ONE: f32 = 2.0;

/// The number of node tests along A's directions alone before B's are prepared. Most queries of separated meshes end
/// before that. B's directions separate up to half of the pairs that A's leave in CAD models, whose faces follow the
/// axes of their own frame, and an eighth in scans.
const NODE_TESTS_BEFORE_B_DIRECTIONS: u64 = 16;

/// Node tests before the triangles of large leaf packets are bounded one by one. Most queries of meshes of similar size
/// end before; bounding four triangles takes as long as two or three visits.
const NODE_TESTS_BEFORE_TRIANGLE_BOUNDS: u64 = 128;

/// The memory of pair walks, kept from one to the next.
#[derive(Default)]
pub(crate) struct PairMemory {
    node_filter: Box<NodeFilter>,
    /// Of both sides.
    nodes: NodeCache,
    /// The roots of A and of B.
    roots: (Root, Root),
    /// How many nodes the walk may still add for A and for B.
    left: (usize, usize),
    /// The groups of A's opened nodes along B's directions, computed when they are first needed.
    aligned_a: PerWalk<Group>,
    /// The groups of B's opened nodes along A's directions.
    aligned_b: PerWalk<Group>,
    /// The test along turning slabs.
    slabs: SlabMemory,
    /// Depth-first: the pairs that node tests left.
    stack: PendingTests,
    /// Depth-first: pairs of leaf packets, visited several at a time in the order in which they came.
    leaf_pairs: LeafPairs,
    /// Best-first: the entry of least bound is next.
    list: PendingTests,
    large_leaves: LargeLeaves,
    /// The number of the walk under way, or of the last one.
    walk: u64,
}

/// Visits all pairs of leaf packets that may be within the visitor's limit. Returns the number of node tests.
#[inline(always)]
pub(crate) fn traverse<I: Isa, W: Visitor>(
    isa: I,
    pair: &ObjectPair<'_>,
    memory: &mut PairMemory,
    budget: &mut Budget,
    visitor: &mut W,
) -> Result<u64, QueryError> {
    memory.start(isa, pair, W::SWEEPS)?;
    if W::MEASURE == Measure::Leaving {
        memory.node_filter.prepare_ways(visitor.direction());
    }
    let order = visitor.order();
    let phase = if matches!(order, Order::Best { .. }) { Phase::Dive } else { Phase::DepthFirst };
    let mut walk =
        PairWalk { pair, memory, budget, visitor, limit: 0.0, separating: None, order, phase, tests: 0 };
    walk.follow_visitor();
    if walk.visit_all(isa)?.is_continue() {
        isa.run(Finish(&mut *walk.visitor))?;
    }
    Ok(walk.tests)
}

/// A walk of two objects.
struct PairWalk<'a, 'p, W> {
    pair: &'a ObjectPair<'p>,
    memory: &'a mut PairMemory,
    budget: &'a mut Budget,
    visitor: &'a mut W,
    /// What the visitor said last.
    limit: f32,
    separating: Option<SeparatingDirection>,
    order: Order,
    phase: Phase,
    /// The number of node tests.
    tests: u64,
}

/// An opened node whose children meet those of the other side. If a node was not opened, its parent stands for it, and only
/// this one child of the parent is tested.
struct OpenedSide {
    /// The first number of the node: of one child, the one that it is in.
    node: usize,
    /// Whether the children under the next number, if it has any of the same node, are tested, too.
    all: bool,
    /// The lanes of the children to test, of those that there are.
    lanes: u16,
}

impl OpenedSide {
    /// All children of an opened node.
    #[inline(always)]
    fn opened(number: usize) -> Self {
        Self { node: number, all: true, lanes: u16::MAX }
    }

    /// One child, whose lanes are those of `lanes_of_first` if it is the first, and one step further for each before it.
    #[inline(always)]
    fn only(child: ChildRef, (lanes_of_first, step): (u16, usize)) -> Self {
        Self { node: child.node(), all: false, lanes: lanes_of_first << (step * child.child()) }
    }
}

/// The lanes of the first child of four, as a child of A and of B, and the step to those of the next one.
const LANES_OF_A: (u16, usize) = (0xf, 4);
const LANES_OF_B: (u16, usize) = (0x1111, 1);

/// Visits two leaf packets.
pub(crate) struct VisitLeaves<'a, W> {
    pub(crate) visitor: &'a mut W,
    pub(crate) leaves: (LeafPacket, LeafPacket),
    pub(crate) at_once: bool,
}

impl<W: Visitor> Task for VisitLeaves<'_, W> {
    type Output = Result<ControlFlow<()>, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.visitor.leaves(isa, self.leaves, self.at_once)
    }
}

/// Completes what is pending after the last pair.
pub(crate) struct Finish<'a, W>(pub(crate) &'a mut W);

impl<W: Visitor> Task for Finish<'_, W> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.0.finish(isa)
    }
}

/// Aligns children of A to B's directions.
struct AlignA<'a> {
    node_filter: &'a NodeFilter,
    group: &'a Group,
    to: &'a mut Group,
}

impl Task for AlignA<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        self.node_filter.align_a(isa, self.group, self.to);
    }
}

/// Aligns children of B to A's directions. Of sweeps, it joins the slabs in both placements.
struct AlignB<'a> {
    node_filter: &'a NodeFilter,
    group: &'a Group,
    to: &'a mut Group,
    sweeps: bool,
}

impl Task for AlignB<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        if self.sweeps {
            self.node_filter.align_b_at_both_ends(isa, self.group, self.to);
        } else {
            self.node_filter.align_b(isa, self.group, self.to);
        }
    }
}

impl PairMemory {
    /// Starts a walk.
    #[inline(always)]
    fn start<I: Isa>(&mut self, isa: I, pair: &ObjectPair<'_>, sweeps: bool) -> Result<(), QueryError> {
        self.walk += 1;
        self.stack.clear();
        self.leaf_pairs.clear();
        self.list.clear();
        self.large_leaves.start();
        self.nodes.start();
        let root_a = self.nodes.root(isa, pair.bvh_a, pair.object_a)?;
        // If it takes the place of A's, the node above A's is there as before.
        let root_b = self.nodes.root(isa, pair.bvh_b, pair.object_b)?;
        self.roots = (root_a, root_b);
        #[cfg(feature = "__trace")]
        trace::objects(pair, [root_a.node, root_b.node]);
        self.left = (max_nodes(pair.object_a), max_nodes(pair.object_b));
        self.aligned_a.start();
        self.aligned_b.start();
        // The node above B's root meets no other node, but has a place.
        self.aligned_b.of(root_b.node);
        self.slabs.start(self.walk, pair);
        self.node_filter.prepare(isa, pair, (root_a.reach, root_b.reach));
        if sweeps {
            // What else bounds a pair knows of one placement only.
            self.node_filter.prepare_end(isa, pair.end);
            self.slabs.stop();
        }
        Ok(())
    }

    /// Returns both leaf packets, if the entry is a pair of them.
    #[inline(always)]
    fn leaf_pair(&self, entry: Entry) -> Option<(LeafPacket, LeafPacket)> {
        Some((self.nodes.leaf(entry.a)?, self.nodes.leaf(entry.b)?))
    }
}

impl<W: Visitor> PairWalk<'_, '_, W> {
    #[inline(always)]
    fn phase(&self) -> Phase {
        if W::MAY_BE_BEST_FIRST { self.phase } else { Phase::DepthFirst }
    }

    /// Visits pairs until none is left or the visitor breaks.
    #[inline(always)]
    fn visit_all<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        let mut best_first_leaves = 0;
        let (root_a, root_b) = &self.memory.roots;
        let roots = Entry::of_roots(root_a.child(), root_b.child());
        self.memory.stack.push_one(roots);
        if self.phase() == Phase::Dive {
            // What follows the dive starts at the roots again.
            self.memory.list.push_one(roots);
        }
        loop {
            if W::MAY_BE_BEST_FIRST && self.order != Order::Any {
                self.memory.stack.drop_beyond(self.limit);
            }
            let waiting = self.memory.leaf_pairs.len();
            if (waiting >= LEAF_PAIRS_PER_BATCH || waiting > 0 && self.memory.stack.is_empty())
                && self.visit_leaf_pairs(isa)?.is_break()
            {
                return Ok(ControlFlow::Break(()));
            }
            let next = match self.memory.stack.pop(isa) {
                Some(next) if next.bound > self.limit => continue,
                Some(next) => next,
                None => match self.least_listed(isa) {
                    Some(least) => least,
                    None => return Ok(ControlFlow::Continue(())),
                },
            };
            self.budget.visit()?;
            // Depth-first, pairs of leaf packets never come on the stack.
            if W::MAY_BE_BEST_FIRST
                && let Some(leaves) = self.memory.leaf_pair(next)
            {
                if self.visit_leaves(isa, leaves, self.phase() != Phase::DepthFirst)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
                if self.phase() == Phase::BestFirst {
                    best_first_leaves += 1;
                    if matches!(self.order, Order::Best { leaves } if best_first_leaves >= leaves) {
                        self.go_on_depth_first();
                    }
                }
                continue;
            }
            if self.is_beyond_large_leaf(next)? {
                continue;
            }
            let sides = self.open(isa, next)?;
            self.push_children(isa, sides);
            if self.phase() == Phase::BestFirst && self.memory.list.len() > MAX_LISTED_TESTS {
                self.go_on_depth_first();
            }
        }
    }

    /// Takes the pair of least bound from the list, if it is within the limit. The stack is empty.
    #[inline(always)]
    fn least_listed<I: Isa>(&mut self, isa: I) -> Option<Entry> {
        if self.phase() == Phase::Dive {
            // The dive has ended at a leaf pair, or at a node none of whose children is within the limit.
            self.phase = Phase::BestFirst;
        }
        // If there is one, it is the least bound of all.
        self.memory.list.pop_least(isa).filter(|least| least.bound <= self.limit)
    }

    /// Goes on depth-first with the tests of the list, the least bound next. The stack is empty.
    fn go_on_depth_first(&mut self) {
        self.phase = Phase::DepthFirst;
        let PairMemory { stack, list, .. } = &mut *self.memory;
        list.nearest_last();
        std::mem::swap(list, stack);
    }

    /// Adopts what the visitor says now.
    #[inline(always)]
    fn follow_visitor(&mut self) {
        self.limit = self.visitor.limit();
        if W::HAS_SEPARATING_DIRECTION {
            self.memory
                .node_filter
                .update_separating(&mut self.separating, self.visitor.separating_direction());
        }
    }

    /// Visits two leaf packets.
    #[inline(always)]
    fn visit_leaves<I: Isa>(
        &mut self,
        isa: I,
        leaves: (LeafPacket, LeafPacket),
        at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        #[cfg(feature = "__trace")]
        trace::packets(leaves);
        let flow = isa.run(VisitLeaves { visitor: &mut *self.visitor, leaves, at_once })?;
        self.follow_visitor();
        Ok(flow)
    }

    /// Visits the pairs of leaf packets that have been collected.
    #[inline(always)]
    fn visit_leaf_pairs<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        while let Some(next) = self.memory.leaf_pairs.take() {
            if next.bound > self.limit {
                continue;
            }
            self.budget.visit()?;
            if let Some(leaves) = self.memory.leaf_pair(next)
                && self.visit_leaves(isa, leaves, false)?.is_break()
            {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Returns whether an entry is a leaf packet whose triangles are beyond the limit of a much smaller node.
    #[inline(always)]
    fn is_beyond_large_leaf(&mut self, entry: Entry) -> Result<bool, QueryError> {
        if W::SWEEPS || self.tests < NODE_TESTS_BEFORE_TRIANGLE_BOUNDS {
            return Ok(false);
        }
        let PairMemory { node_filter, nodes, large_leaves, .. } = &mut *self.memory;
        large_leaves.are_beyond(self.pair, nodes, node_filter.reaches(), entry, gap_limit::<W>(self.limit))
    }

    /// Opens both nodes of a pair, or the inner one against a leaf, or the much larger one.
    #[inline(always)]
    fn open<I: Isa>(&mut self, isa: I, entry: Entry) -> Result<[OpenedSide; 2], QueryError> {
        let (pair, tests) = (self.pair, self.tests);
        let PairMemory { node_filter, nodes, left, .. } = &mut *self.memory;
        if !W::SWEEPS && tests >= NODE_TESTS_BEFORE_B_DIRECTIONS && !node_filter.looks_along_b() {
            node_filter.look_along_b(isa);
        }
        let (a, b) = (nodes.child(entry.a), nodes.child(entry.b));
        let mut side_a = OpenedSide::only(entry.a, LANES_OF_A);
        let mut side_b = OpenedSide::only(entry.b, LANES_OF_B);
        let a_is_small = b.extent > EXTENT_RATIO_TO_OPEN_ONE * a.extent;
        // In a forged file both comparisons may hold: one node is opened in any case.
        let b_is_small = (a.extent > EXTENT_RATIO_TO_OPEN_ONE * b.extent) & !a_is_small;
        // One branch each, as far as a processor can predict any.
        if !a.is_leaf() & (b.is_leaf() | !a_is_small) {
            let number = nodes.open(isa, pair.bvh_a, pair.object_a, entry.a, &mut left.0)?;
            #[cfg(feature = "__trace")]
            trace::opened(0, nodes.place_in_treelet(entry.a), number);
            side_a = OpenedSide::opened(number);
        }
        if !b.is_leaf() & (a.is_leaf() | !b_is_small) {
            let number = nodes.open(isa, pair.bvh_b, pair.object_b, entry.b, &mut left.1)?;
            #[cfg(feature = "__trace")]
            trace::opened(1, nodes.place_in_treelet(entry.b), number);
            side_b = OpenedSide::opened(number);
        }
        Ok([side_a, side_b])
    }

    /// Tests all pairs of children and keeps those within the limit.
    #[inline(always)]
    fn push_children<I: Isa>(&mut self, isa: I, [of_a, of_b]: [OpenedSide; 2]) {
        let (measure, phase, order) = (W::MEASURE, self.phase(), self.order);
        let (limit, leaving_limit) = (gap_limit::<W>(self.limit), self.limit);
        let separating = if W::HAS_SEPARATING_DIRECTION { &self.separating } else { &None };
        let PairMemory { node_filter, nodes, aligned_a, aligned_b, slabs, stack, leaf_pairs, list, .. } =
            &mut *self.memory;
        let node_filter = &**node_filter;
        let first_new = stack.len();
        let (mut number_a, mut number_b) = (of_a.node, of_b.node);
        loop {
            let (node_a, node_b) = (nodes.get(number_a), nodes.get(number_b));
            // The node above the root of B is not aligned, but meets nothing: both roots are opened at once.
            let (aligned, is_aligned) = aligned_b.of(number_b);
            if !is_aligned {
                isa.run(AlignB { node_filter, group: &node_b.group, to: aligned, sweeps: W::SWEEPS });
            }
            let tested = if phase == Phase::BestFirst { list.room() } else { stack.room() };
            tested.a = ChildRef::new(number_a, 0);
            tested.b = ChildRef::new(number_b, 0);
            let groups = (&node_a.group, &node_b.group, &*aligned);
            let (lanes_a, lanes_b) = (node_a.lanes, node_b.lanes);
            let mut mask = node_filter.run(isa, measure, groups, separating, limit, &mut tested.bounds);
            mask &= lanes_a.all[0] & of_a.lanes & lanes_b.all[1] & of_b.lanes;
            if mask != 0 {
                if slabs.are_due() {
                    let numbers = (number_a, number_b);
                    let memory = &mut *slabs;
                    mask = isa.run(TestSlabs {
                        memory,
                        node_filter,
                        measure,
                        nodes,
                        numbers,
                        limit,
                        tested,
                        mask,
                    });
                }
                if mask != 0 && node_filter.looks_along_b() {
                    let (to, is_aligned) = aligned_a.of(number_a);
                    if !is_aligned {
                        isa.run(AlignA { node_filter, group: &node_a.group, to });
                    }
                    let groups = (&*to, &node_b.group);
                    mask &= node_filter.run_along_b(isa, measure, groups, limit, &mut tested.bounds);
                }
                if measure == Measure::Leaving && mask != 0 {
                    let groups = (&node_a.group, &*aligned);
                    mask &= node_filter.leaving(isa, groups, leaving_limit, &mut tested.bounds);
                }
                if phase == Phase::DepthFirst {
                    let leaves = lanes_a.leaves[0] & lanes_b.leaves[1];
                    leaf_pairs.append(tested, mask & leaves);
                    mask &= !leaves;
                }
                if mask != 0 {
                    let first = match order {
                        Order::Any => mask.trailing_zeros() as i32,
                        _ => isa.nearest(&tested.bounds, mask),
                    };
                    match phase {
                        Phase::DepthFirst => stack.push(mask, first),
                        Phase::BestFirst => list.push(mask, first),
                        Phase::Dive => stack.push(mask & 1u16 << (first & 15), first),
                    }
                }
            }
            self.tests += 1;
            if node_b.continues & of_b.all {
                number_b += 1;
            } else if node_a.continues & of_a.all {
                (number_a, number_b) = (number_a + 1, of_b.node);
            } else {
                break;
            }
        }
        if phase == Phase::Dive {
            stack.keep_nearest(first_new);
        }
    }
}

/// Returns how far apart nodes may be.
#[inline(always)]
fn gap_limit<W: Visitor>(limit: f32) -> f32 {
    if W::MEASURE == Measure::Leaving { 0.0 } else { limit }
}

#[cfg(test)]
mod tests;
