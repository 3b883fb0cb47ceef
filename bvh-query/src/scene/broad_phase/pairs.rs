//! The pairs of instances that are near each other: all within a distance, or one after another, the nearest first.

use super::tree::Tree;
use super::{BroadPhase, Which};
use crate::error::QueryError;
use crate::traverse::budget::Budget;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

/// A search for the nearest boxes is given up when more pairs than this wait: 2.5 MiB.
const MAX_OPEN_PAIRS: usize = 1 << 16;

/// Visits the near pairs of two trees, or of one tree with itself, until `visit` breaks. `open` is empty at first.
pub(super) fn near_pairs(
    (a, b): (&Tree, &Tree),
    limit: f64,
    budget: &mut Budget,
    open: &mut Vec<(u32, u32)>,
    visit: &mut impl FnMut(u32, u32, f64) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, QueryError> {
    if a.nodes.is_empty() || b.nodes.is_empty() {
        return Ok(ControlFlow::Continue(()));
    }
    let is_one = std::ptr::eq(a, b);
    let squared_limit = limit * limit;
    // Where nothing is near, the roots are all that a search looks at, and then it allocates nothing.
    let mut next = Some((0, 0));
    while let Some((first, second)) = next.take().or_else(|| open.pop()) {
        budget.visit()?;
        let (node_a, node_b) = (&a.nodes[first as usize], &b.nodes[second as usize]);
        if !node_a.groups.meet(node_b.groups) {
            continue;
        }
        if is_one && first == second {
            if !node_a.is_leaf() {
                let [left, right] = node_a.children;
                push(open, [(left, right), (right, right), (left, left)]);
            }
            continue;
        }
        let squared_gap = node_a.bounds.squared_gap(&node_b.bounds);
        if squared_gap > squared_limit {
            continue;
        }
        match (node_a.is_leaf(), node_b.is_leaf()) {
            (true, true) => {
                if visit(node_a.children[1], node_b.children[1], squared_gap).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
            (false, is_leaf) if is_leaf || node_a.bounds.girth() >= node_b.bounds.girth() => {
                push(open, node_a.children.map(|child| (child, second)));
            }
            _ => push(open, node_b.children.map(|child| (first, child))),
        }
    }
    Ok(ControlFlow::Continue(()))
}

/// Adds pairs of nodes to those that a search has yet to look at, with room for most searches at the first.
fn push<const N: usize>(open: &mut Vec<(u32, u32)>, pairs: [(u32, u32); N]) {
    if open.capacity() == 0 {
        open.reserve(64);
    }
    open.extend(pairs);
}

/// The pairs of places whose groups meet, those with the nearest boxes first: a search of the trees by the least gap.
pub(in crate::scene) struct NearestFirst {
    open: BinaryHeap<Open>,
}

/// Two nodes of two trees, and the square of their gap.
#[derive(Clone, Copy, Debug)]
struct Open {
    squared_gap: f64,
    trees: [Which; 2],
    nodes: [u32; 2],
}

impl Ord for Open {
    /// The greatest is the nearest. Of equally near pairs the order is any, but always the same.
    fn cmp(&self, other: &Self) -> Ordering {
        let rest = |open: &Self| (open.trees, open.nodes);
        other.squared_gap.total_cmp(&self.squared_gap).then_with(|| rest(self).cmp(&rest(other)))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

impl NearestFirst {
    pub(in crate::scene) fn new(broad: &BroadPhase) -> Self {
        let mut open = BinaryHeap::new();
        for trees in
            [[Which::Still, Which::Still], [Which::Moving, Which::Still], [Which::Moving, Which::Moving]]
        {
            let [a, b] = trees.map(|which| broad.tree(which).nodes.first());
            if let Some((a, b)) = a.zip(b).filter(|(a, b)| a.groups.meet(b.groups)) {
                let squared_gap = if trees[0] == trees[1] { 0.0 } else { a.bounds.squared_gap(&b.bounds) };
                open.push(Open { squared_gap, trees, nodes: [0, 0] });
            }
        }
        Self { open }
    }

    /// Returns the next pair of places and the square of the gap of their boxes; nothing either if too many pairs wait to be
    /// looked at.
    pub(in crate::scene) fn next(
        &mut self,
        broad: &BroadPhase,
        budget: &mut Budget,
    ) -> Result<Option<(u32, u32, f64)>, QueryError> {
        while self.open.len() <= MAX_OPEN_PAIRS {
            let Some(Open { squared_gap, trees, nodes }) = self.open.pop() else { break };
            budget.visit()?;
            let (a, b) = (broad.tree(trees[0]), broad.tree(trees[1]));
            let (node_a, node_b) = (&a.nodes[nodes[0] as usize], &b.nodes[nodes[1] as usize]);
            let is_one = trees[0] == trees[1] && nodes[0] == nodes[1];
            if node_a.is_leaf() && node_b.is_leaf() {
                if !is_one {
                    return Ok(Some((node_a.children[1], node_b.children[1], squared_gap)));
                }
                continue;
            }
            let mut add = |first: u32, second: u32| {
                let (x, y) = (&a.nodes[first as usize], &b.nodes[second as usize]);
                let is_one = trees[0] == trees[1] && first == second;
                let squared_gap = if is_one { 0.0 } else { x.bounds.squared_gap(&y.bounds) };
                if x.groups.meet(y.groups) {
                    self.open.push(Open { squared_gap, trees, nodes: [first, second] });
                }
            };
            if is_one {
                let [left, right] = node_a.children;
                add(left, right);
                add(left, left);
                add(right, right);
            } else if node_b.is_leaf() || !node_a.is_leaf() && node_a.bounds.girth() >= node_b.bounds.girth()
            {
                node_a.children.into_iter().for_each(|child| add(child, nodes[1]));
            } else {
                node_b.children.into_iter().for_each(|child| add(nodes[0], child));
            }
        }
        Ok(None)
    }
}
