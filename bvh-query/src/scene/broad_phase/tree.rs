//! A tree of boxes over instances, sixteen to a node, so that one comparison of registers tests them all.
//!
//! It is built at once, by splits along the longest side, and then changed leaf by leaf. Ends of boxes are in `f32`, rounded
//! outward: what they leave is tested again with the boxes of the instances. Each node also has the union of the groups
//! below it, so that parts of the scene whose groups do not meet are left out at once. The boxes above leaves that have
//! changed are computed once for all of them.

use crate::isa::{Isa, Lanes};
use crate::numerics::{MAX_STRETCH, round_up};
use crate::scene::broad_phase::Item;
use crate::scene::groups::Groups;
use crate::scene::world_box::WorldBox;

/// The most children of a node.
const WIDTH: usize = 16;
/// Stands for no lane of a node.
const NONE: u32 = u32::MAX;
/// A tree is built anew when the girths of its nodes have grown by this factor.
const MAX_GROWTH: f64 = 1.5;

/// A box that contains another one, or several, with ends in `f32`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct OuterBox {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl OuterBox {
    const EMPTY: Self = Self { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    /// Ends move outward by twice as much as `f32` may round them, without a branch, which nothing could predict.
    fn around(inner: &WorldBox) -> Self {
        if inner.is_empty() {
            return Self::EMPTY;
        }
        let outward = |end: f64| end.abs() * f64::from(f32::EPSILON) + f64::from(f32::MIN_POSITIVE);
        let mut outer = Self::EMPTY;
        for k in 0..3 {
            outer.lo[k] = (inner.lo[k] - outward(inner.lo[k])) as f32;
            outer.hi[k] = (inner.hi[k] + outward(inner.hi[k])) as f32;
        }
        outer
    }

    pub(super) fn girth(&self) -> f64 {
        self.to_world().girth()
    }

    #[inline(always)]
    fn to_world(self) -> WorldBox {
        let mut world = WorldBox::EMPTY;
        for k in 0..3 {
            (world.lo[k], world.hi[k]) = (self.lo[k].into(), self.hi[k].into());
        }
        world
    }
}

/// A child of a node: another node, or an instance.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Child {
    Node(u32),
    /// The instance in this place.
    Place(u32),
}

/// A part of a tree, as it is compared with others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subtree {
    pub(super) child: Child,
    pub(super) bounds: OuterBox,
    pub(super) groups: Groups,
}

/// Up to sixteen children side by side. Lanes from `count` on are empty.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    lo: [[f32; WIDTH]; 3],
    hi: [[f32; WIDTH]; 3],
    groups: [Groups; WIDTH],
    children: [Child; WIDTH],
    count: usize,
    /// The number of the parent, times sixteen, and the lane there; `NONE` for the root.
    at: u32,
    /// What is around all children.
    bounds: OuterBox,
    union: Groups,
}

impl Node {
    fn new(at: u32) -> Self {
        let OuterBox { lo, hi } = OuterBox::EMPTY;
        Self {
            lo: lo.map(|end| [end; WIDTH]),
            hi: hi.map(|end| [end; WIDTH]),
            groups: [Groups::NONE; WIDTH],
            children: [Child::Node(0); WIDTH],
            count: 0,
            at,
            bounds: OuterBox::EMPTY,
            union: Groups::NONE,
        }
    }

    fn set(&mut self, lane: usize, bounds: &OuterBox, groups: Groups) {
        for k in 0..3 {
            (self.lo[k][lane], self.hi[k][lane]) = (bounds.lo[k], bounds.hi[k]);
        }
        self.groups[lane] = groups;
    }

    #[inline(always)]
    fn part(&self, lane: usize) -> Subtree {
        let mut bounds = OuterBox::EMPTY;
        for k in 0..3 {
            (bounds.lo[k], bounds.hi[k]) = (self.lo[k][lane], self.hi[k][lane]);
        }
        Subtree { child: self.children[lane], bounds, groups: self.groups[lane] }
    }

    /// Computes what is around all children. Returns whether it has changed.
    fn unite(&mut self) -> bool {
        let (mut bounds, mut union) = (self.part(0).bounds, self.groups[0]);
        // Often just one instance moves.
        if self.count > 1 {
            for k in 0..3 {
                bounds.lo[k] = fold(self.lo[k], |x, y| if y < x { y } else { x });
                bounds.hi[k] = fold(self.hi[k], |x, y| if y > x { y } else { x });
            }
            union = self.groups[..self.count].iter().fold(union, |union, groups| union.union(*groups));
        }
        let is_new = (bounds, union) != (self.bounds, self.union);
        (self.bounds, self.union) = (bounds, union);
        is_new
    }
}

/// Combines all lanes, half of them with the other half at a time. Empty lanes change nothing.
// Pages load two copies, not six.
#[cfg_attr(not(all(target_arch = "wasm32", target_os = "unknown")), inline(always))]
fn fold(mut ends: [f32; WIDTH], less: impl Fn(f32, f32) -> f32) -> f32 {
    fold_half::<8>(&mut ends, &less);
    fold_half::<4>(&mut ends, &less);
    fold_half::<2>(&mut ends, &less);
    less(ends[0], ends[1])
}

/// Combines as many lanes with as many behind them. Compilers turn a loop of fixed length into vector code.
#[inline(always)]
fn fold_half<const HALF: usize>(ends: &mut [f32; WIDTH], less: &impl Fn(f32, f32) -> f32) {
    for lane in 0..HALF {
        ends[lane] = less(ends[lane], ends[lane + HALF]);
    }
}

/// A tree. Node 0 is the root, and children follow their parents.
#[derive(Default, Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// By place: the instance, and its node and lane as in `Node::at`.
    items: Vec<(Item, u32)>,
    /// The sum of the girths of the nodes below the root, now and after the build.
    girth: f64,
    built_girth: f64,
    /// The nodes of which a box or groups have changed, one bit per node, and how many they are.
    changed: Vec<u64>,
    changed_count: usize,
}

impl Tree {
    /// Returns whether its boxes have grown so much that it is worth building anew.
    pub(super) fn has_grown(&self) -> bool {
        self.girth > MAX_GROWTH * self.built_girth
    }

    /// Returns all of it as one part; nothing if it is empty.
    pub(super) fn whole(&self) -> Option<Subtree> {
        let root = self.nodes.first()?;
        Some(Subtree { child: Child::Node(0), bounds: root.bounds, groups: root.union })
    }

    /// Returns the groups of all instances.
    #[inline]
    pub(super) fn root_groups(&self) -> Groups {
        self.nodes.first().map_or(Groups::NONE, |root| root.union)
    }

    /// Returns the square of how far apart the boxes around two trees are at least; 0 if one is empty.
    #[inline]
    pub(super) fn root_gap(&self, other: &Self) -> f64 {
        let [Some(a), Some(b)] = [self, other].map(|tree| tree.nodes.first()) else { return 0.0 };
        a.bounds.to_world().squared_gap(&b.bounds.to_world())
    }

    /// Returns the numbers of the nodes in which pairs are to be found: those whose groups meet themselves.
    pub(super) fn nodes_with_pairs(&self) -> impl Iterator<Item = u32> + '_ {
        let meets_itself = |node: &Node| node.union.meet(node.union);
        let nodes = if self.nodes.first().is_some_and(meets_itself) { &self.nodes[..] } else { &[] };
        (0..).zip(nodes).filter(move |(_, node)| meets_itself(node)).map(|(number, _)| number)
    }

    /// Returns the children of a node.
    pub(super) fn parts(&self, node: u32) -> impl Iterator<Item = Subtree> + '_ {
        let node = &self.nodes[node as usize];
        (0..node.count).map(|lane| node.part(lane))
    }

    /// Returns the child in a lane of a node.
    #[inline(always)]
    pub(super) fn part(&self, node: u32, lane: usize) -> Subtree {
        self.nodes[node as usize].part(lane)
    }

    /// Returns the box of an instance, or one that contains those of all instances in a node.
    pub(super) fn bounds(&self, child: Child) -> WorldBox {
        match child {
            Child::Node(node) => self.nodes[node as usize].bounds.to_world(),
            Child::Place(place) => self.items[place as usize].0.bounds,
        }
    }

    /// Returns the groups of an instance, or of all instances in a node.
    pub(super) fn groups(&self, child: Child) -> Groups {
        match child {
            Child::Node(node) => self.nodes[node as usize].union,
            Child::Place(place) => self.items[place as usize].0.groups,
        }
    }

    /// Returns the lanes of a node whose boxes may be near another one: at most as far apart as `limit` allows, which
    /// [`squared_limit`] has made.
    #[inline(always)]
    pub(super) fn near<I: Isa>(&self, isa: I, node: u32, bounds: &OuterBox, limit: f32) -> u16 {
        let node = &self.nodes[node as usize];
        let mut sum = isa.splat(0.0);
        for k in 0..3 {
            let above = isa.load(&node.lo[k]).sub(isa.splat(bounds.hi[k]));
            let below = isa.splat(bounds.lo[k]).sub(isa.load(&node.hi[k]));
            let apart = above.max(below).max(isa.splat(0.0));
            // Not fused, so that all backends leave the same lanes.
            sum = sum.add(apart.mul(apart));
        }
        I::F32x16::bits(sum.le(isa.splat(limit))) & ((1u32 << node.count) - 1) as u16
    }

    /// Builds the tree. Places are below `places`.
    pub(super) fn build(&mut self, mut items: Vec<Item>, places: usize) {
        self.nodes.clear();
        self.items.clear();
        self.changed.clear();
        (self.girth, self.built_girth, self.changed_count) = (0.0, 0.0, 0);
        if items.is_empty() {
            return;
        }
        let none = Item { place: 0, bounds: WorldBox::EMPTY, groups: Groups::NONE };
        self.items.resize(places, (none, NONE));
        let mut open = vec![(0, items.len(), NONE)];
        while let Some((start, end, at)) = open.pop() {
            let number = self.nodes.len() as u32;
            if let Some(parent) = self.nodes.get_mut(at as usize / WIDTH) {
                parent.children[at as usize % WIDTH] = Child::Node(number);
            }
            let mut node = Node::new(at);
            node.count = children_of(end - start);
            let mut ranges = vec![(start, end, node.count)];
            let mut lane = 0;
            while let Some((start, end, parts)) = ranges.pop() {
                let of_lane = number * WIDTH as u32 + lane as u32;
                if parts > 1 {
                    let (first, middle) = (parts / 2, start + (end - start) * (parts / 2) / parts);
                    split(&mut items[start..end], middle - start);
                    ranges.extend([(middle, end, parts - first), (start, middle, first)]);
                    continue;
                }
                if let [item] = &items[start..end] {
                    node.children[lane] = Child::Place(item.place);
                    node.set(lane, &OuterBox::around(&item.bounds), item.groups);
                    self.items[item.place as usize] = (*item, of_lane);
                } else {
                    open.push((start, end, of_lane));
                }
                lane += 1;
            }
            self.nodes.push(node);
        }
        for number in (0..self.nodes.len()).rev() {
            self.recompute(number);
        }
        self.built_girth = self.girth;
        self.changed.resize(self.nodes.len().div_ceil(64), 0);
    }

    /// Sets the box and the groups of an instance. Those above it are out of date until `settle`.
    pub(super) fn set(&mut self, item: Item) {
        let Some((held, at)) = self.items.get_mut(item.place as usize).filter(|(_, at)| *at != NONE) else {
            return;
        };
        *held = item;
        let at = *at as usize;
        self.nodes[at / WIDTH].set(at % WIDTH, &OuterBox::around(&item.bounds), item.groups);
        self.mark(at / WIDTH);
    }

    /// Marks a node as out of date.
    fn mark(&mut self, number: usize) {
        let (word, bit) = (&mut self.changed[number / 64], 1 << (number % 64));
        self.changed_count += usize::from(*word & bit == 0);
        *word |= bit;
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
                if let Some(parent) = self.recompute(64 * word + bit as usize) {
                    self.mark(parent);
                }
            }
        }
    }

    /// Computes what is around a node from its children. Returns the parent, if that has changed.
    fn recompute(&mut self, number: usize) -> Option<usize> {
        let node = &mut self.nodes[number];
        let before = node.bounds;
        let is_new = node.unite();
        let Node { at, bounds, union, .. } = *node;
        if !is_new || at == NONE {
            return None;
        }
        self.girth += bounds.girth() - before.girth();
        let parent = at as usize / WIDTH;
        self.nodes[parent].set(at as usize % WIDTH, &bounds, union);
        Some(parent)
    }
}

/// Returns a limit for [`Tree::near`] that leaves all boxes whose squared gap is at most `squared`.
pub(super) fn squared_limit(squared: f64) -> f32 {
    // More than the roundings of `near`, and than `WorldBox::squared_gap` takes off.
    round_up(squared * MAX_STRETCH)
}

/// Returns the number of children of a node of so many instances: as few as have room for them, if all but the last are
/// full.
fn children_of(instances: usize) -> usize {
    let mut room = 1;
    while room * WIDTH < instances {
        room *= WIDTH;
    }
    instances.div_ceil(room)
}

/// Orders items so that the first `middle` are on one side of the longest side of their centres' box.
fn split(items: &mut [Item], middle: usize) {
    let centre = |item: &Item, k: usize| item.bounds.lo[k] + item.bounds.hi[k];
    let extent = |k: usize| {
        let ends = items.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), item| {
            (lo.min(centre(item, k)), hi.max(centre(item, k)))
        });
        ends.1 - ends.0
    };
    let extents = [extent(0), extent(1), extent(2)];
    let axis = (0..3).max_by(|&i, &j| extents[i].total_cmp(&extents[j])).unwrap_or(0);
    items.select_nth_unstable_by(middle, |x, y| {
        centre(x, axis).total_cmp(&centre(y, axis)).then(x.place.cmp(&y.place))
    });
}

#[cfg(test)]
impl Tree {
    /// Checks the boxes and groups of all nodes, and the sum of girths.
    pub(super) fn check(&self) {
        let mut girth = 0.0;
        for (number, node) in self.nodes.iter().enumerate() {
            let mut whole = WorldBox::EMPTY;
            let mut union = Groups::NONE;
            for part in self.parts(number as u32) {
                let inner = self.bounds(part.child);
                match part.child {
                    Child::Node(_) => assert_eq!(part.bounds.to_world(), inner),
                    Child::Place(_) => {
                        assert_eq!(part.bounds.to_world().union(&inner), part.bounds.to_world())
                    }
                }
                assert_eq!(part.groups, self.groups(part.child));
                (whole, union) = (whole.union(&part.bounds.to_world()), union.union(part.groups));
            }
            assert_eq!((node.bounds.to_world(), node.union), (whole, union));
            girth += if number > 0 { node.bounds.girth() } else { 0.0 };
        }
        assert!((girth - self.girth).abs() <= 1e-9 * (girth + 1.0), "{girth} {}", self.girth);
    }
}
