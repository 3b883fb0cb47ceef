//! The broad phase: binary trees of boxes over the instances, one for those that stand still and one for those that move.
//!
//! An instance counts as standing still until it moves. Then its leaf in the first tree becomes empty, and it is in the
//! second tree from the next question on. When it moves again, the boxes above it are computed again. When moves have
//! made the boxes of the second tree 1.5 times as large as after its build, the next question builds that tree anew.
//! The first tree therefore stays as tight as it was built, however far a few instances travel. Both trees are built
//! anew when an instance is added or removed.
//!
//! A tree is split at the median along the longest side. Each node also has the union of the groups below it, so that
//! parts of the scene whose groups do not meet are left out at once.
//!
//! A file may put all instances in one place, or give them groups of which only the unions meet. Then every pair must
//! be tested. Each step of a search is therefore charged to the budget of the question, and no search holds all pairs.

use crate::error::QueryError;
use crate::scene::groups::Groups;
use crate::scene::world_box::WorldBox;
use crate::traverse::budget::Budget;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

/// Stands for no node.
const NONE: u32 = u32::MAX;
/// A tree is built anew when the girths of its inner nodes have grown by this factor.
const MAX_GROWTH: f64 = 1.5;
/// A search for the nearest boxes is given up when more pairs than this wait: 2.5 MiB.
const MAX_OPEN_PAIRS: usize = 1 << 16;

/// An instance, as the broad phase knows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) place: u32,
    pub(super) bounds: WorldBox,
    pub(super) groups: Groups,
}

/// Both trees.
#[derive(Default, Clone, Debug)]
pub(super) struct BroadPhase {
    still: Tree,
    moving: Tree,
    /// Whether the instance in each place has moved since it was added.
    has_moved: Vec<bool>,
    /// Whether both trees are to be built by the next question, or the second one.
    is_stale: bool,
    is_moving_stale: bool,
}

impl BroadPhase {
    /// Records that an instance was added to a place, or removed from it.
    pub(super) fn replace(&mut self, place: u32) {
        self.is_stale = true;
        if let Some(has_moved) = self.has_moved.get_mut(place as usize) {
            *has_moved = false;
        }
    }

    /// Records that an instance has moved. The boxes above it are out of date until [`settle`](Self::settle).
    pub(super) fn set_box(&mut self, item: Item) {
        // A build takes all instances as they are then: poses set before it say nothing about which ones move.
        let Some(has_moved) = self.has_moved.get_mut(item.place as usize).filter(|_| !self.is_stale) else {
            return;
        };
        if std::mem::replace(has_moved, true) {
            self.moving.set(item);
        } else {
            self.still.set(Item { bounds: WorldBox::EMPTY, groups: Groups::NONE, ..item });
            self.is_moving_stale = true;
        }
    }

    /// Records that an instance has changed its groups.
    pub(super) fn set_groups(&mut self, item: Item) {
        match self.has_moved.get(item.place as usize) {
            _ if self.is_stale => {}
            Some(true) => self.moving.set(item),
            _ => self.still.set(item),
        }
        self.settle();
    }

    /// Computes the boxes above all instances that have moved.
    pub(super) fn settle(&mut self) {
        self.still.settle();
        self.moving.settle();
    }

    /// Returns whether a question has to build a tree first.
    pub(super) fn is_out_of_date(&self) -> bool {
        self.is_stale || self.is_moving_stale || self.moving.has_grown()
    }

    /// Builds the trees that are out of date. `items` lists them; places are below `places`.
    pub(super) fn refresh(&mut self, items: impl Iterator<Item = Item>, places: usize) {
        if !self.is_out_of_date() {
            return;
        }
        self.has_moved.resize(places, false);
        let (moving, still): (Vec<Item>, Vec<Item>) =
            items.partition(|item| self.has_moved.get(item.place as usize) == Some(&true));
        if self.is_stale {
            self.still.build(still, places);
        }
        self.moving.build(moving, places);
        (self.is_stale, self.is_moving_stale) = (false, false);
    }

    /// Calls `visit` with each pair of places whose groups meet and whose boxes are at most `limit` apart, and with the square
    /// of their gap, until it breaks.
    pub(super) fn pairs(
        &self,
        limit: f64,
        budget: &mut Budget,
        mut visit: impl FnMut(u32, u32, f64) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, QueryError> {
        let mut open = Vec::new();
        for trees in [(&self.still, &self.still), (&self.moving, &self.still), (&self.moving, &self.moving)] {
            if pairs(trees, limit, budget, &mut open, &mut visit)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Calls `visit` with each place whose groups meet those given and whose box is near another box, and with the
    /// square of their gap. `limit` returns how far apart they may be, for a box or for one that contains it.
    pub(super) fn near(
        &self,
        bounds: &WorldBox,
        groups: Groups,
        limit: impl Fn(&WorldBox) -> f64,
        budget: &mut Budget,
        mut visit: impl FnMut(u32, f64),
    ) -> Result<(), QueryError> {
        for tree in [&self.still, &self.moving] {
            let mut open: Vec<u32> = if tree.nodes.is_empty() { vec![] } else { vec![0] };
            while let Some(number) = open.pop() {
                budget.visit()?;
                let node = &tree.nodes[number as usize];
                if !node.groups.meet(groups) {
                    continue;
                }
                let squared_gap = bounds.squared_gap(&node.bounds);
                if squared_gap > limit(&node.bounds).powi(2) {
                    continue;
                }
                if node.is_leaf() {
                    visit(node.children[1], squared_gap);
                } else {
                    open.extend(node.children);
                }
            }
        }
        Ok(())
    }

    /// Returns the places whose boxes have a finite key, in ascending order of the keys. The key of a box is at most that of any
    /// box in it.
    pub(super) fn by_key<K: Fn(&WorldBox) -> f64>(&self, key: K) -> ByKey<K> {
        let mut order = ByKey { key, open: BinaryHeap::new() };
        for which in [Which::Still, Which::Moving] {
            if !self.tree(which).nodes.is_empty() {
                order.push(self, which, 0);
            }
        }
        order
    }

    fn tree(&self, which: Which) -> &Tree {
        match which {
            Which::Still => &self.still,
            Which::Moving => &self.moving,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: WorldBox,
    groups: Groups,
    parent: u32,
    /// Both children of an inner node, or `NONE` and the place of an instance.
    children: [u32; 2],
}

impl Node {
    fn is_leaf(&self) -> bool {
        self.children[0] == NONE
    }
}

/// A tree. Node 0 is the root, and children follow their parents.
#[derive(Default, Clone, Debug)]
struct Tree {
    nodes: Vec<Node>,
    /// The leaf of each place, or `NONE`.
    leaves: Vec<u32>,
    /// The sum of the girths of the inner nodes, now and after the build.
    girth: f64,
    built_girth: f64,
    /// The inner nodes below which a box or groups have changed, one bit per node, and how many they are.
    changed: Vec<u64>,
    changed_count: usize,
}

impl Tree {
    /// Returns whether its boxes have grown so much that it is worth building anew.
    fn has_grown(&self) -> bool {
        self.girth > MAX_GROWTH * self.built_girth
    }

    /// Builds the tree. Places are below `places`.
    fn build(&mut self, mut items: Vec<Item>, places: usize) {
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
    fn set(&mut self, Item { place, bounds, groups }: Item) {
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
    fn settle(&mut self) {
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

/// Visits the near pairs of two trees, or of one tree with itself, until `visit` breaks. `open` is empty at first.
fn pairs(
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
pub(super) struct NearestFirst {
    open: BinaryHeap<Open>,
}

/// Two nodes of two trees, and the square of their gap.
#[derive(Clone, Copy, Debug)]
struct Open {
    squared_gap: f64,
    trees: [Which; 2],
    nodes: [u32; 2],
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Which {
    Still,
    Moving,
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
    pub(super) fn new(broad: &BroadPhase) -> Self {
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
    pub(super) fn next(
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

/// Places in ascending order of a key of their boxes.
pub(super) struct ByKey<K> {
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
    pub(super) fn next(
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

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    fn item(random: &mut Random, place: u32) -> Item {
        let lo = [(); 3].map(|()| 10.0 * random.signed());
        let bounds = WorldBox { lo, hi: lo.map(|end| end + 1.0 + random.signed()) };
        Item { place, bounds, groups: Groups { member: 1 << random.below(3), meets: 1 << random.below(3) } }
    }

    /// Checks the boxes, groups and the sum of girths of a tree.
    fn check(tree: &Tree) {
        let mut girth = 0.0;
        for node in tree.nodes.iter().filter(|node| !node.is_leaf()) {
            let [first, second] = node.children.map(|child| &tree.nodes[child as usize]);
            assert_eq!(node.bounds, first.bounds.union(&second.bounds));
            assert_eq!(node.groups, first.groups.union(second.groups));
            girth += node.bounds.girth();
        }
        assert!((girth - tree.girth).abs() <= 1e-9 * (girth + 1.0), "{girth} {}", tree.girth);
    }

    #[test]
    fn all_near_pairs_are_visited_once_after_any_moves() {
        let random = &mut Random::new(5);
        let (mut seen, mut grown) = (0, 0);
        for count in [0, 1, 2, 3, 4, 7, 40] {
            // Places in between are empty.
            let mut items: Vec<Item> = (0..count).map(|number| item(random, 2 * number)).collect();
            let mut broad = BroadPhase::default();
            items.iter().for_each(|item| broad.replace(item.place));
            for step in 0..200 {
                if count > 0 {
                    let number = random.below(count as usize);
                    let place = 2 * number as u32;
                    let (bounds, has_moved) =
                        (items[number].bounds, broad.has_moved.get(place as usize).copied());
                    items[number] = item(random, place);
                    if step % 40 == 39 {
                        broad.replace(place);
                    } else if step % 8 == 3 {
                        items[number].bounds = bounds;
                        broad.set_groups(items[number]);
                        assert_eq!(broad.has_moved.get(place as usize).copied(), has_moved);
                    } else {
                        broad.set_box(items[number]);
                        broad.settle();
                    }
                }
                grown += usize::from(broad.moving.has_grown());
                broad.refresh(items.iter().copied(), 2 * count as usize);
                check(&broad.still);
                check(&broad.moving);
                let limit = [0.0, 1.5, f64::INFINITY][step % 3];
                let mut found = Vec::new();
                let mut budget = Budget::new(u64::MAX);
                let visited = broad.pairs(limit, &mut budget, |a, b, squared_gap| {
                    found.push((a.min(b), a.max(b), squared_gap));
                    ControlFlow::Continue(())
                });
                assert_eq!(visited, Ok(ControlFlow::Continue(())));
                found.sort_unstable_by_key(|&(a, b, _)| (a, b));
                let mut expected = Vec::new();
                for (number, a) in items.iter().enumerate() {
                    for b in &items[number + 1..] {
                        let gap = a.bounds.squared_gap(&b.bounds);
                        if a.groups.meet(b.groups) && gap <= limit * limit {
                            expected.push((a.place, b.place, gap));
                        }
                    }
                }
                seen += expected.len();
                assert_eq!(found, expected, "{count} {step}");
                // The same pairs and gaps, place by place.
                found.clear();
                for item in &items {
                    let visit = |place, gap| {
                        if place > item.place {
                            found.push((item.place, place, gap));
                        }
                    };
                    broad.near(&item.bounds, item.groups, |_| limit, &mut budget, visit).unwrap();
                }
                found.sort_unstable_by_key(|&(a, b, _)| (a, b));
                assert_eq!(found, expected, "{count} {step}");
                let expected: Vec<_> = expected.into_iter().map(|(a, b, _)| (a, b)).collect();
                let (mut found, mut last) = (Vec::new(), 0.0);
                let mut nearest = NearestFirst::new(&broad);
                while let Some((a, b, squared_gap)) = nearest.next(&broad, &mut budget).unwrap() {
                    assert!(squared_gap >= last);
                    last = squared_gap;
                    if squared_gap <= limit * limit {
                        found.push((a.min(b), a.max(b)));
                    }
                }
                found.sort_unstable();
                assert_eq!(found, expected, "{count} {step}");
            }
        }
        assert!(seen > 1000 && grown > 0, "{seen} {grown}");
    }
}
