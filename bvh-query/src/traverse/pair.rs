//! The pair traversal on which every query stands.
//!
//! ```text
//! entries := {(root a, root b)}
//! while entry := pop(entries):
//!     if its lower bound exceeds the visitor's limit: skip
//!     if both nodes are leaf packets: visitor.leaves(a, b)
//!     else open a, b or both; for each of the pairs of their children:
//!         bound := lower bound of their distance along A's directions
//!         if bound <= limit: push
//! ```
//!
//! Depth-first, entries are a stack; best-first, a list that is searched for the least, until the visitor has
//! seen enough leaves to go on depth-first, or the list is as long as it may be.
//!
//! The walk ends: each file is a tree (its rules say so, and `OpenedNodes` does not rely on it), an entry
//! stands for the leaf pairs below it, and its children divide these among them. So no pair of nodes is
//! visited twice, but for those of the first dive, and there are at most (nodes of A) * (nodes of B).
//!
//! Memory: each entry that is popped depth-first leaves fewer than 64 on the stack, and those below it are
//! one level deeper in A or in B, so that there are fewer than 64 * (depth of A + depth of B) and those
//! that the list had. A tree is no deeper than it has treelets. Nothing recurses.

use crate::bvh::Bvh;
use crate::error::QueryError;
use crate::isa::Isa;
use crate::traverse::align::Placement;
use crate::traverse::node_test::{NodeTest, Witness};
use crate::traverse::opened::{Aligned, ChildRef, Leaf, OpenedNodes};
use bvh_format::object::Object;
use std::ops::ControlFlow;

/// What a bound is good for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measure {
    /// Sign only: positive if the nodes are apart.
    Overlap,
    /// A lower bound of the distance, mesh units.
    Distance,
}

/// The order in which pairs are visited.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// Depth-first, the pair of least bound first.
    Nearest,
    /// Depth-first in the order of the trees, whatever the bounds: what is found first does not
    /// depend on how bounds are rounded.
    Tree,
    /// First straight down to one leaf pair, for a limit; then the pair of least bound of all, until
    /// the visitor has seen so many more leaf pairs; then nearest.
    Best { leaves: u32 },
}

/// What a query does with the pairs of leaf packets that a traversal comes by.
pub(crate) trait Visitor {
    const MEASURE: Measure;

    fn order(&self) -> Order;

    /// Pairs with a larger bound are not visited.
    fn limit(&self) -> f32;

    /// A direction in A's frame, at most 1 long, along which A and B are likely apart.
    fn witness(&self) -> Option<[f32; 3]> {
        None
    }

    /// Two leaf packets. `at_once`: the limit that they lead to is wanted now, not later for less.
    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        leaves: (Leaf, Leaf),
        at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError>;

    /// After the last pair.
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError>;
}

/// Two objects in place.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) bvh_a: &'a Bvh,
    pub(crate) object_a: &'a Object,
    pub(crate) bvh_b: &'a Bvh,
    pub(crate) object_b: &'a Object,
    pub(crate) placement: &'a Placement,
}

/// Memory of a traversal, kept from one query to the next.
#[derive(Default)]
pub(crate) struct Stack {
    opened_a: OpenedNodes,
    opened_b: OpenedNodes,
    /// The groups of A's opened nodes along B's directions, where they were asked for.
    aligned_a: Vec<[Aligned; 2]>,
    /// The groups of B's opened nodes along A's directions.
    aligned_b: Vec<[Aligned; 2]>,
    /// Depth-first: the top is next.
    entries: Vec<Entry>,
    /// Best-first: the least is next.
    list: List,
    /// How many visits the query may make, and how many are left.
    budget: u64,
    left: u64,
}

/// A pair of nodes to visit. Sorts by bound.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    /// The bits of the bound, made monotone.
    key: u32,
    a: ChildRef,
    b: ChildRef,
}

impl Entry {
    /// The roots, at the least bound of all (that of minus infinity).
    const ROOTS: Self = Self { key: 0x007f_ffff, a: ChildRef::ROOT, b: ChildRef::ROOT };

    #[inline(always)]
    fn new(bound: f32, a: ChildRef, b: ChildRef) -> Self {
        let bits = bound.to_bits();
        let key = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
        Self { key, a, b }
    }

    #[inline(always)]
    fn bound(self) -> f32 {
        f32::from_bits(if self.key >> 31 == 1 { self.key & !(1 << 31) } else { !self.key })
    }
}

/// Pairs in no order. Keys stand by themselves, so that the least is found in vector registers.
#[derive(Default)]
struct List {
    keys: Vec<u32>,
    pairs: Vec<(ChildRef, ChildRef)>,
}

impl List {
    fn clear(&mut self) {
        self.keys.clear();
        self.pairs.clear();
    }

    #[inline(always)]
    fn push(&mut self, Entry { key, a, b }: Entry) {
        self.keys.push(key);
        self.pairs.push((a, b));
    }

    /// Takes out the first of the least keys.
    #[inline(always)]
    fn pop_least(&mut self) -> Option<Entry> {
        let least = self.keys.iter().fold(u32::MAX, |least, &key| least.min(key));
        let place = self.keys.iter().position(|&key| key == least)?;
        let (key, (a, b)) = (self.keys.swap_remove(place), self.pairs.swap_remove(place));
        Some(Entry { key, a, b })
    }

    fn entries(&self) -> impl Iterator<Item = Entry> {
        self.keys.iter().zip(&self.pairs).map(|(&key, &(a, b))| Entry { key, a, b })
    }
}

/// How the next pair is found.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// From each pair on to the nearest of its children alone.
    Dive,
    /// From a list.
    BestFirst,
    /// From a stack.
    DepthFirst,
}

/// Entries that the list may hold before the walk goes on depth-first: what is searched in the time of a node
/// test. Answers do not depend on it.
const MOST_IN_LIST: usize = 1024;

/// Visits that cost less than to find out whether they pay.
const SOME: u64 = 8;

/// Nodes this many times larger than their partner are opened alone, to meet it at its size.
const MUCH_LARGER: f32 = 2.0;

/// Node tests along A's directions alone, before B's are prepared: most queries of meshes apart end before. In CAD
/// models, whose faces follow the axes of their own frame, B's directions set apart up to half of the pairs
/// that A's leave, in scans an eighth.
const TESTS_ALONG_A_ALONE: u64 = 16;

/// Visits all pairs of leaf packets that may be within the visitor's limit. Returns node tests.
#[inline(always)]
pub(crate) fn traverse<I: Isa, W: Visitor>(
    isa: I,
    pair: Pair<'_>,
    stack: &mut Stack,
    visitor: &mut W,
) -> Result<u64, QueryError> {
    stack.entries.clear();
    stack.list.clear();
    let root_a = stack.opened_a.start(isa, pair.bvh_a, pair.object_a)?;
    let root_b = stack.opened_b.start(isa, pair.bvh_b, pair.object_b)?;
    let mut node_test = NodeTest::new(&pair, &root_a, &root_b);
    let mut witness: Option<Witness> = None;
    node_test.update_witness(&mut witness, visitor.witness());
    let (mut tests, mut leaves) = (0, 0);
    let order = visitor.order();
    let mut phase = if matches!(order, Order::Best { .. }) { Phase::Dive } else { Phase::DepthFirst };
    stack.entries.push(Entry::ROOTS);
    loop {
        let next = match (stack.entries.pop(), phase) {
            (Some(top), _) => top,
            (None, Phase::DepthFirst) => break,
            (None, Phase::Dive) => {
                // At the end of the dive: a leaf pair, or a node none of whose children is in reach.
                phase = Phase::BestFirst;
                Entry::ROOTS
            }
            (None, Phase::BestFirst) => match stack.list.pop_least() {
                Some(least) => least,
                None => break,
            },
        };
        if next.bound() > visitor.limit() {
            if phase == Phase::BestFirst {
                // It is the least bound of all.
                break;
            }
            continue;
        }
        stack.visit()?;
        if let Some(leaves_of_pair) = stack.leaf_pair(next) {
            if visitor.leaves(isa, leaves_of_pair, phase != Phase::DepthFirst)?.is_break() {
                return Ok(tests);
            }
            node_test.update_witness(&mut witness, visitor.witness());
            leaves += u32::from(phase == Phase::BestFirst);
            if matches!(order, Order::Best { leaves: enough } if phase == Phase::BestFirst && leaves >= enough)
            {
                phase = Phase::DepthFirst;
                stack.list_to_stack(visitor.limit());
            }
            continue;
        }
        if tests >= TESTS_ALONG_A_ALONE && !node_test.looks_along_b() {
            node_test.look_along_b();
        }
        let sides = stack.open(isa, &pair, &node_test, next)?;
        let start = stack.entries.len();
        tests += stack.push_children(isa, W::MEASURE, &node_test, &witness, &sides, visitor.limit());
        let new = &mut stack.entries[start..];
        match (phase, order) {
            (Phase::BestFirst, _) => {
                stack.entries.drain(start..).for_each(|entry| stack.list.push(entry));
                if stack.list.keys.len() > MOST_IN_LIST {
                    phase = Phase::DepthFirst;
                    stack.list_to_stack(visitor.limit());
                }
            }
            (_, Order::Tree) => new.reverse(),
            (Phase::Dive, _) => {
                nearest_last(new);
                stack.entries.drain(..stack.entries.len().saturating_sub(1));
            }
            (Phase::DepthFirst, _) => nearest_last(new),
        }
    }
    visitor.finish(isa)?;
    Ok(tests)
}

/// Opened nodes of A and B whose children meet. A node that was not opened takes part as the only
/// child in question of its parent.
struct Sides {
    node_a: usize,
    only_a: Option<usize>,
    node_b: usize,
    only_b: Option<usize>,
}

impl Stack {
    /// Before a query that may visit so many pairs.
    pub(crate) fn start(&mut self, budget: u64) {
        (self.budget, self.left) = (budget, budget);
    }

    /// Lets what follows make as many visits as have been made since `start`, and some, but none beyond the budget.
    pub(crate) fn allow_as_much_again(&mut self) {
        self.left = self.left.min((self.budget - self.left).saturating_add(SOME));
    }

    /// Counts a visit.
    #[inline(always)]
    pub(crate) fn visit(&mut self) -> Result<(), QueryError> {
        self.left = self.left.checked_sub(1).ok_or(QueryError::Budget { visits: self.budget })?;
        Ok(())
    }

    /// Both leaf packets, if the entry is a pair of them.
    #[inline(always)]
    fn leaf_pair(&self, entry: Entry) -> Option<(Leaf, Leaf)> {
        let a = self.opened_a.get(entry.a.node()).leaf(entry.a.child())?;
        let b = self.opened_b.get(entry.b.node()).leaf(entry.b.child())?;
        Some((a, b))
    }

    /// Opens both nodes of a pair, or the inner one against a leaf, or the much larger one.
    #[inline(always)]
    fn open<I: Isa>(
        &mut self,
        isa: I,
        pair: &Pair<'_>,
        node_test: &NodeTest,
        entry: Entry,
    ) -> Result<Sides, QueryError> {
        let (node_a, node_b) = (self.opened_a.get(entry.a.node()), self.opened_b.get(entry.b.node()));
        let (child_a, child_b) = (entry.a.child(), entry.b.child());
        let (leaf_a, leaf_b) = (node_a.is_leaf(child_a), node_b.is_leaf(child_b));
        let (extent_a, extent_b) = (node_a.extents[child_a], node_b.extents[child_b]);
        let mut sides = Sides {
            node_a: entry.a.node(),
            only_a: Some(child_a),
            node_b: entry.b.node(),
            only_b: Some(child_b),
        };
        let a_is_small = extent_b > MUCH_LARGER * extent_a;
        // In a forged file both comparisons may hold: one node is opened in any case.
        let b_is_small = extent_a > MUCH_LARGER * extent_b && !a_is_small;
        if !leaf_a && (leaf_b || !a_is_small) {
            (sides.node_a, _) = self.opened_a.open(isa, pair.bvh_a, pair.object_a, entry.a)?;
            sides.only_a = None;
        }
        if !leaf_b && (leaf_a || !b_is_small) {
            let (number, new) = self.opened_b.open(isa, pair.bvh_b, pair.object_b, entry.b)?;
            (sides.node_b, sides.only_b) = (number, None);
            if self.aligned_b.len() <= number {
                self.aligned_b.resize(2 * number + 64, [[[[0.0; 4]; 2]; 13]; 2]);
            }
            if new {
                let opened = self.opened_b.get(number);
                for part in 0..opened.count.div_ceil(4) {
                    node_test.align_b(isa, &opened.groups[part & 1], &mut self.aligned_b[number][part & 1]);
                }
            }
        }
        if node_test.looks_along_b() {
            self.align_a(isa, node_test, sides.node_a);
        }
        Ok(sides)
    }

    /// Aligns an opened node of A to B's directions, unless it has been.
    #[inline(always)]
    fn align_a<I: Isa>(&mut self, isa: I, node_test: &NodeTest, number: usize) {
        if self.aligned_a.len() <= number {
            self.aligned_a.resize(2 * number + 64, [[[[0.0; 4]; 2]; 13]; 2]);
        }
        let opened = self.opened_a.get_mut(number);
        if !std::mem::replace(&mut opened.aligned, true) {
            for part in 0..opened.count.div_ceil(4) {
                node_test.align_a(isa, &opened.groups[part & 1], &mut self.aligned_a[number][part & 1]);
            }
        }
    }

    /// Tests all pairs of children and pushes those within the limit. Returns the number of tests.
    #[inline(always)]
    fn push_children<I: Isa>(
        &mut self,
        isa: I,
        measure: Measure,
        node_test: &NodeTest,
        witness: &Option<Witness>,
        sides: &Sides,
        limit: f32,
    ) -> u64 {
        let (side_a, side_b) = (self.opened_a.get(sides.node_a), self.opened_b.get(sides.node_b));
        let aligned_b = &self.aligned_b[sides.node_b];
        let mut tests = 0;
        let (mut part_a, end_a) = parts(sides.only_a, side_a.count);
        while part_a < end_a {
            let (mut part_b, end_b) = parts(sides.only_b, side_b.count);
            while part_b < end_b {
                let mut bounds = [0.0; 16];
                let groups = (&side_a.groups[part_a & 1], &side_b.groups[part_b & 1], &aligned_b[part_b & 1]);
                let mut mask = node_test.run(isa, measure, groups, witness, limit, &mut bounds);
                mask &= lanes_of_a(sides.only_a, side_a.count, part_a);
                mask &= lanes_of_b(sides.only_b, side_b.count, part_b);
                if mask != 0 && node_test.looks_along_b() {
                    let aligned_a = &self.aligned_a[sides.node_a];
                    let groups = (&aligned_a[part_a & 1], &side_b.groups[part_b & 1]);
                    mask &= node_test.run_along_b(isa, measure, groups, limit, &mut bounds);
                }
                self.entries.reserve(16);
                while mask != 0 {
                    let bit = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    let a = ChildRef::new(sides.node_a, 4 * part_a + bit / 4);
                    let b = ChildRef::new(sides.node_b, 4 * part_b + bit % 4);
                    self.entries.push(Entry::new(bounds[bit & 15], a, b));
                }
                tests += 1;
                part_b += 1;
            }
            part_a += 1;
        }
        tests
    }

    /// Goes on depth-first with what the list holds, the least bound on top.
    fn list_to_stack(&mut self, limit: f32) {
        self.entries.extend(self.list.entries().filter(|entry| entry.bound() <= limit));
        self.list.clear();
        nearest_last(&mut self.entries);
    }
}

/// The groups of four children to test: all, or that of the only child in question.
#[inline(always)]
fn parts(only: Option<usize>, count: usize) -> (usize, usize) {
    match only {
        Some(child) => (child / 4, child / 4 + 1),
        None => (0, count.div_ceil(4)),
    }
}

/// The lanes whose child of A is there, or is the only one in question.
#[inline(always)]
fn lanes_of_a(only: Option<usize>, count: usize, part: usize) -> u16 {
    match only {
        Some(child) => 0xf << (4 * (child % 4)),
        None => ((1u32 << (4 * (count - 4 * part).min(4))) - 1) as u16,
    }
}

/// The same for B.
#[inline(always)]
fn lanes_of_b(only: Option<usize>, count: usize, part: usize) -> u16 {
    match only {
        Some(child) => 0x1111 << (child % 4),
        None => 0x1111 * ((1u16 << (count - 4 * part).min(4)) - 1),
    }
}

/// Moves the entry of least bound to the end, from where it is popped first. A full sort gains little
/// and costs several mispredicted branches.
#[inline(always)]
fn nearest_last(entries: &mut [Entry]) {
    let Some(last) = entries.len().checked_sub(1) else { return };
    let mut least = last;
    for index in 0..last {
        least = if entries[index].key < entries[least].key { index } else { least };
    }
    entries.swap(least, last);
}
