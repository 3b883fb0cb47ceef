//! The instances in the order of a key of their boxes, such as the distance from a point.

use super::least_first::LeastFirst;
use super::tree::Child;
use super::{BroadPhase, Which};
use crate::error::QueryError;
use crate::scene::world_box::WorldBox;
use std::collections::BinaryHeap;

/// Places in ascending order of a key of their boxes.
pub(in crate::scene) struct ByKey<K> {
    key: K,
    /// Parts of the trees by their keys. Of equal keys, nodes come first and then the lowest place.
    open: BinaryHeap<LeastFirst<(Child, Which)>>,
}

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
            self.open.push(LeastFirst { number: key, of: (part, tree) });
        }
    }

    /// Returns the next place and the key of its box. `charge` is called for each box that is looked at.
    pub(in crate::scene) fn next(
        &mut self,
        broad: &BroadPhase,
        mut charge: impl FnMut() -> Result<(), QueryError>,
    ) -> Result<Option<(u32, f64)>, QueryError> {
        while let Some(LeastFirst { number: key, of: (part, tree) }) = self.open.pop() {
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
