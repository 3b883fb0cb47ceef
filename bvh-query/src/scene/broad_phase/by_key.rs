//! The instances in the order of a key of their boxes, such as the distance from a point.

use super::tree::Child;
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

/// A part of a tree and its key.
#[derive(Clone, Copy, Debug)]
struct Keyed {
    key: f64,
    part: Child,
    tree: Which,
}

impl Ord for Keyed {
    /// The greatest has the least key; of equal keys, nodes come first and then the lowest place.
    fn cmp(&self, other: &Self) -> Ordering {
        let rest = |of: &Self| (of.part, of.tree);
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
            if let Some(whole) = broad.tree(which).whole() {
                order.push(broad, which, whole.child);
            }
        }
        order
    }

    fn push(&mut self, broad: &BroadPhase, tree: Which, part: Child) {
        let bounds = broad.tree(tree).bounds(part);
        let key = (self.key)(&bounds);
        // What has moved left an empty box in the tree of what stands still.
        if key < f64::INFINITY && !bounds.is_empty() {
            self.open.push(Keyed { key, part, tree });
        }
    }

    /// Returns the next place and the key of its box. `charge` is called for each box that is looked at.
    pub(in crate::scene) fn next(
        &mut self,
        broad: &BroadPhase,
        mut charge: impl FnMut() -> Result<(), QueryError>,
    ) -> Result<Option<(u32, f64)>, QueryError> {
        while let Some(Keyed { key, part, tree }) = self.open.pop() {
            charge()?;
            match part {
                Child::Place(place) => return Ok(Some((place, key))),
                Child::Node(node) => {
                    broad.tree(tree).parts(node).for_each(|part| self.push(broad, tree, part.child));
                }
            }
        }
        Ok(None)
    }
}
