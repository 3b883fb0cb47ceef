//! A binary tree of boxes over instances: built at once, then changed leaf by leaf.
//!
//! It is split at the median along the longest side. Each node also has the union of the groups below it, so that parts
//! of the scene whose groups do not meet are left out at once. The boxes above leaves that have changed are computed once
//! for all of them.

use crate::scene::broad_phase::Item;
use crate::scene::groups::Groups;
use crate::scene::world_box::WorldBox;

/// Stands for no node.
const NONE: u32 = u32::MAX;
/// A tree is built anew when the girths of its inner nodes have grown by this factor.
const MAX_GROWTH: f64 = 1.5;

#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) bounds: WorldBox,
    pub(super) groups: Groups,
    parent: u32,
    /// Both children of an inner node, or `NONE` and the place of an instance.
    pub(super) children: [u32; 2],
}

impl Node {
    pub(super) fn is_leaf(&self) -> bool {
        self.children[0] == NONE
    }
}

/// A tree. Node 0 is the root, and children follow their parents.
#[derive(Default, Clone, Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// The leaf of each place, or `NONE`.
    leaves: Vec<u32>,
    /// The sum of the girths of the inner nodes, now and after the build.
    pub(super) girth: f64,
    built_girth: f64,
    /// The inner nodes below which a box or groups have changed, one bit per node, and how many they are.
    changed: Vec<u64>,
    changed_count: usize,
}

impl Tree {
    /// Returns whether its boxes have grown so much that it is worth building anew.
    pub(super) fn has_grown(&self) -> bool {
        self.girth > MAX_GROWTH * self.built_girth
    }

    /// Builds the tree. Places are below `places`.
    pub(super) fn build(&mut self, mut items: Vec<Item>, places: usize) {
        self.nodes.clear();
        self.leaves.clear();
        self.leaves.resize(places, NONE);
        self.girth = 0.0;
        let mut open = vec![(0, items.len(), NONE, 0)];
        open.retain(|(start, end, ..)| start < end);
        while let Some((start, end, parent, side)) = open.pop() {
            let number = self.nodes.len() as u32;
            if let Some(above) = self.nodes.get_mut(parent as usize) {
                above.children[side] = number;
            }
            let part = &mut items[start..end];
            if let [item] = part {
                self.leaves[item.place as usize] = number;
                let children = [NONE, item.place];
                self.nodes.push(Node { bounds: item.bounds, groups: item.groups, parent, children });
                continue;
            }
            let middle = split(part);
            let (bounds, groups) = (WorldBox::EMPTY, Groups::NONE);
            self.nodes.push(Node { bounds, groups, parent, children: [0, 0] });
            open.push((start + middle, end, number, 1));
            open.push((start, start + middle, number, 0));
        }
        for number in (0..self.nodes.len()).rev() {
            if !self.nodes[number].is_leaf() {
                self.recompute(number);
            }
        }
        self.built_girth = self.girth;
        self.changed.clear();
        self.changed.resize(self.nodes.len().div_ceil(64), 0);
        self.changed_count = 0;
    }

    /// Sets the box and the groups of a leaf. Those above it are out of date until `settle`.
    pub(super) fn set(&mut self, Item { place, bounds, groups }: Item) {
        let Some(&leaf) = self.leaves.get(place as usize).filter(|&&leaf| leaf != NONE) else { return };
        let node = &mut self.nodes[leaf as usize];
        (node.bounds, node.groups) = (bounds, groups);
        let parent = node.parent;
        self.mark(parent);
    }

    /// Marks a node as out of date, if it is one.
    fn mark(&mut self, number: u32) {
        if number != NONE {
            let (word, bit) = (&mut self.changed[number as usize / 64], 1 << (number % 64));
            self.changed_count += usize::from(*word & bit == 0);
            *word |= bit;
        }
    }

    /// Computes all nodes that are out of date, each once: from the last to the first, since children follow their parents.
    pub(super) fn settle(&mut self) {
        let mut word = self.changed.len();
        while self.changed_count > 0 {
            word -= 1;
            while self.changed[word] != 0 {
                let bit = self.changed[word].ilog2();
                self.changed[word] ^= 1 << bit;
                self.changed_count -= 1;
                let number = 64 * word + bit as usize;
                if self.recompute(number) {
                    self.mark(self.nodes[number].parent);
                }
            }
        }
    }

    /// Computes an inner node from its children. Returns whether it has changed.
    fn recompute(&mut self, number: usize) -> bool {
        let Node { bounds, groups, children, .. } = self.nodes[number];
        let [first, second] = children.map(|child| &self.nodes[child as usize]);
        let (new_bounds, new_groups) =
            (first.bounds.union(&second.bounds), first.groups.union(second.groups));
        if (new_bounds, new_groups) == (bounds, groups) {
            return false;
        }
        self.girth += new_bounds.girth() - bounds.girth();
        (self.nodes[number].bounds, self.nodes[number].groups) = (new_bounds, new_groups);
        true
    }
}

/// Orders items so that those before the returned number are on one side of the longest side of their centres' box.
fn split(items: &mut [Item]) -> usize {
    let centre = |item: &Item, k: usize| item.bounds.lo[k] + item.bounds.hi[k];
    let extent = |k: usize| {
        let ends = items.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), item| {
            (lo.min(centre(item, k)), hi.max(centre(item, k)))
        });
        ends.1 - ends.0
    };
    let extents = [extent(0), extent(1), extent(2)];
    let axis = (0..3).max_by(|&i, &j| extents[i].total_cmp(&extents[j])).unwrap_or(0);
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |x, y| {
        centre(x, axis).total_cmp(&centre(y, axis)).then(x.place.cmp(&y.place))
    });
    middle
}
