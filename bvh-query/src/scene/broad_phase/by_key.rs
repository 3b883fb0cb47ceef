//! The instances in the order of a key of their boxes, such as the distance from a point.

use super::{BroadPhase, Which};
use crate::error::QueryError;
use crate::scene::world_box::WorldBox;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Places in ascending order of a key of their boxes.
pub(in crate::scene) struct ByKey<K> {
    key: K,
    open: BinaryHeap<Keyed>,
}

/// A node and its key.
#[derive(Clone, Copy, Debug)]
struct Keyed {
    key: f64,
    tree: Which,
    node: u32,
    /// The place of a leaf; 0 for an inner node.
    place: u32,
}

impl Ord for Keyed {
    /// The greatest has the least key; of equal keys, inner nodes come first and then the lowest place.
    fn cmp(&self, other: &Self) -> Ordering {
        let rest = |of: &Self| (of.place, of.tree, of.node);
        other.key.total_cmp(&self.key).then_with(|| rest(other).cmp(&rest(self)))
    }
}

impl PartialOrd for Keyed {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Keyed {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Keyed {}

impl<K: Fn(&WorldBox) -> f64> ByKey<K> {
    pub(super) fn new(broad: &BroadPhase, key: K) -> Self {
        let mut order = Self { key, open: BinaryHeap::new() };
        for which in [Which::Still, Which::Moving] {
            if !broad.tree(which).nodes.is_empty() {
                order.push(broad, which, 0);
            }
        }
        order
    }

    fn push(&mut self, broad: &BroadPhase, tree: Which, number: u32) {
        let node = &broad.tree(tree).nodes[number as usize];
        let key = (self.key)(&node.bounds);
        // What has moved left an empty box in the tree of what stands still.
        if key < f64::INFINITY && !node.bounds.is_empty() {
            let place = if node.is_leaf() { node.children[1] } else { 0 };
            self.open.push(Keyed { key, tree, node: number, place });
        }
    }

    /// Returns the next place and the key of its box. `charge` is called for each box that is looked at.
    pub(in crate::scene) fn next(
        &mut self,
        broad: &BroadPhase,
        mut charge: impl FnMut() -> Result<(), QueryError>,
    ) -> Result<Option<(u32, f64)>, QueryError> {
        while let Some(Keyed { key, tree, node, place }) = self.open.pop() {
            charge()?;
            let node = &broad.tree(tree).nodes[node as usize];
            if node.is_leaf() {
                return Ok(Some((place, key)));
            }
            node.children.into_iter().for_each(|child| self.push(broad, tree, child));
        }
        Ok(None)
    }
}
