//! The pairs of instances that are near each other: all within a distance, or one after another, the nearest first.

use super::least_first::LeastFirst;
use super::tree::{Child, Subtree, Tree, squared_limit};
use super::{BroadPhase, Which};
use crate::error::QueryError;
use crate::isa::{Isa, Task};
use crate::traverse::budget::Budget;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

/// A search for the nearest boxes is given up when more pairs than this wait: 2 MiB.
const MAX_OPEN_PAIRS: usize = 1 << 16;

/// A search for the near pairs of two trees, or of one tree with itself. `V` takes the places of a pair and the square of its
/// gap, and breaks where no more are wanted.
pub(super) struct NearPairs<'a, V> {
    trees: [&'a Tree; 2],
    /// The square of how far apart boxes may be, exactly and as nodes are tested.
    limits: (f64, f32),
    budget: &'a mut Budget,
    visit: &'a mut V,
    open: Vec<Facing>,
}

/// A part of one tree, to be compared with the children of a node of the other tree.
#[derive(Clone, Copy)]
struct Facing {
    part: Subtree,
    node: u32,
    /// Whether the part is of the second tree.
    is_swapped: bool,
}

impl<'a, V: FnMut(u32, u32, f64) -> ControlFlow<()>> NearPairs<'a, V> {
    pub(super) fn new(trees: [&'a Tree; 2], limit: f64, budget: &'a mut Budget, visit: &'a mut V) -> Self {
        let squared = limit * limit;
        Self { trees, limits: (squared, squared_limit(squared)), budget, visit, open: Vec::new() }
    }

    /// Returns whether there may be any, which often ends a search before it begins.
    #[inline]
    pub(super) fn may_find(&self) -> bool {
        let [a, b] = self.trees;
        a.root_groups().meet(b.root_groups()) && (std::ptr::eq(a, b) || a.root_gap(b) <= self.limits.0)
    }

    /// Compares a part with the children of a node from a lane on, and then what is in those that are near.
    #[inline(always)]
    fn search<I: Isa>(
        &mut self,
        isa: I,
        first: Facing,
        from_lane: usize,
    ) -> Result<ControlFlow<()>, QueryError> {
        // Where nothing is near, this is all that a search looks at, and then it allocates nothing.
        let mut next = Some((first, from_lane));
        while let Some((Facing { part, node, is_swapped }, from_lane)) =
            next.take().or_else(|| Some((self.open.pop()?, 0)))
        {
            let [own, other] = if is_swapped { [self.trees[1], self.trees[0]] } else { self.trees };
            let mut near = u32::from(other.near(isa, node, &part.bounds, self.limits.1));
            near &= u32::MAX << from_lane;
            self.budget.charge(1 + u64::from(near.count_ones()))?;
            while near != 0 {
                let met = other.part(node, near.trailing_zeros() as usize);
                near &= near - 1;
                if !met.groups.meet(part.groups) {
                    continue;
                }
                self.open.push(match (part.child, met.child) {
                    (Child::Place(x), Child::Place(y)) => {
                        let squared_gap = own.bounds(part.child).squared_gap(&other.bounds(met.child));
                        if squared_gap <= self.limits.0 && (self.visit)(x, y, squared_gap).is_break() {
                            return Ok(ControlFlow::Break(()));
                        }
                        continue;
                    }
                    // The larger of two nodes is opened.
                    (Child::Node(larger), Child::Node(_)) if part.bounds.girth() > met.bounds.girth() => {
                        Facing { part: met, node: larger, is_swapped: !is_swapped }
                    }
                    (_, Child::Node(node)) => Facing { part, node, is_swapped },
                    (Child::Node(node), _) => Facing { part: met, node, is_swapped: !is_swapped },
                });
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

impl<V: FnMut(u32, u32, f64) -> ControlFlow<()>> Task for NearPairs<'_, V> {
    type Output = Result<ControlFlow<()>, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(mut self, isa: I) -> Self::Output {
        let [a, b] = self.trees;
        if !std::ptr::eq(a, b) {
            let Some(part) = a.whole() else { return Ok(ControlFlow::Continue(())) };
            return self.search(isa, Facing { part, node: 0, is_swapped: false }, 0);
        }
        for node in a.nodes_with_pairs() {
            for (lane, part) in a.parts(node).enumerate() {
                // With the children behind it, so that each pair comes once.
                if self.search(isa, Facing { part, node, is_swapped: false }, lane + 1)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// The pairs of places whose groups meet, those with the nearest boxes first: a search of the trees by the least gap.
pub(in crate::scene) struct NearestFirst {
    /// Parts of two trees by the squares of their gaps.
    open: BinaryHeap<LeastFirst<Parts>>,
}

/// A part of a tree, and a part of the same tree or of the other one.
type Parts = ([Which; 2], [Child; 2]);

impl NearestFirst {
    pub(in crate::scene) fn new(broad: &BroadPhase) -> Self {
        let mut first = Self { open: BinaryHeap::new() };
        for trees in
            [[Which::Still, Which::Still], [Which::Moving, Which::Still], [Which::Moving, Which::Moving]]
        {
            if trees.iter().all(|which| broad.tree(*which).whole().is_some()) {
                first.add(broad, trees, [Child::Node(0); 2]);
            }
        }
        first
    }

    /// Adds two parts to those that wait, if their groups meet.
    fn add(&mut self, broad: &BroadPhase, trees: [Which; 2], parts: [Child; 2]) {
        let [a, b] = [0, 1].map(|side| (broad.tree(trees[side]), parts[side]));
        if a.0.groups(a.1).meet(b.0.groups(b.1)) {
            let is_one = trees[0] == trees[1] && parts[0] == parts[1];
            let squared_gap = if is_one { 0.0 } else { a.0.bounds(a.1).squared_gap(&b.0.bounds(b.1)) };
            self.open.push(LeastFirst { number: squared_gap, of: (trees, parts) });
        }
    }

    /// Returns the next pair of places and the square of the gap of their boxes; nothing either if too many pairs wait to be
    /// looked at.
    pub(in crate::scene) fn next(
        &mut self,
        broad: &BroadPhase,
        budget: &mut Budget,
    ) -> Result<Option<(u32, u32, f64)>, QueryError> {
        while self.open.len() <= MAX_OPEN_PAIRS {
            let Some(LeastFirst { number: squared_gap, of: (trees, parts) }) = self.open.pop() else { break };
            budget.visit()?;
            let [tree_a, tree_b] = trees.map(|which| broad.tree(which));
            let girth = |tree: &Tree, child| tree.bounds(child).girth();
            match parts {
                [Child::Place(x), Child::Place(y)] => {
                    if trees[0] != trees[1] || x != y {
                        return Ok(Some((x, y, squared_gap)));
                    }
                }
                [Child::Node(a), Child::Node(b)] if trees[0] == trees[1] && a == b => {
                    for (lane, first) in tree_a.parts(a).enumerate() {
                        for second in tree_a.parts(a).skip(lane) {
                            self.add(broad, trees, [first.child, second.child]);
                        }
                    }
                }
                [Child::Node(a), b]
                    if matches!(b, Child::Place(_)) || girth(tree_a, parts[0]) >= girth(tree_b, b) =>
                {
                    for part in tree_a.parts(a) {
                        self.add(broad, trees, [part.child, b]);
                    }
                }
                [a, Child::Node(b)] => {
                    for part in tree_b.parts(b) {
                        self.add(broad, trees, [a, part.child]);
                    }
                }
                [Child::Node(_), Child::Place(_)] => {}
            }
        }
        Ok(None)
    }
}
