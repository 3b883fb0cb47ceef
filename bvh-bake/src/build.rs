//! Builds binary trees over triangle boxes: one in each brick, and one above the bricks.
//!
//! Bricks are divided by planes between the cells of a grid; within a brick, down to a few dozen triangles,
//! splits are found with bins; below, all positions along all three axes are tried. One cost serves all
//! three (`boxes::Cost`). Last, subtrees of a brick move to where they enlarge the tree least (`reinsert`).
//!
//! Nothing here depends on the order in which threads come by: counts and boxes are merged by sums of integers
//! and by minima, partitions are stable, and ties go to the lower axis and position.

mod binned;
mod boxes;
mod bricks;
mod reinsert;
mod swept;

use crate::ablation::SplitRule;
use crate::bake::Stage;
use crate::error::BakeError;
use crate::means::Means;
use crate::options::Effort;
use crate::progress::{Step, Tally, WHOLE};
use crate::scratch::Stream;
use crate::soup::{Kept, Triangle};
pub(crate) use boxes::Aabb;
use boxes::Reference;
use bricks::Division;
pub(crate) use bricks::Grid;
use reinsert::Pass;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Triangles in a leaf packet.
const PACKET: usize = bvh_format::leaf::PACKET;

/// What passes over the triangles are worth: dividing them into bricks, and building the bricks' trees. The rest is what
/// is made of these.
const DIVIDE: u64 = 2;
const TREES: u64 = 9;

/// Triangles in a brick, at most. The bytes of a file depend on it.
pub(crate) const BRICK: usize = 1 << 18;

/// Whether so many triangles are in one brick.
pub(crate) fn is_one_brick(triangles: u64) -> bool {
    triangles <= BRICK as u64
}

/// Most children of a treelet, in any profile.
pub(crate) const MOST_CHILDREN: usize = 8;

/// A binary tree.
pub(crate) enum Node<L> {
    Leaf(L),
    /// Two subtrees.
    Inner(Box<Inner<L>>),
}

pub(crate) struct Inner<L> {
    pub(crate) left: Node<L>,
    pub(crate) right: Node<L>,
    /// Leaves below.
    pub(crate) leaves: usize,
    /// How likely a traversal is to come by, in units that only compare.
    pub(crate) size: f64,
    /// For the cut into treelets: of the number of places, counted from 1, that both sides get, those of the
    /// left. 0 for not yet known.
    pub(crate) shares: [u8; MOST_CHILDREN],
}

impl<L> Node<L> {
    /// The node above two.
    fn above(left: Self, right: Self, size: f64) -> Self {
        let leaves = left.leaves() + right.leaves();
        Self::Inner(Box::new(Inner { left, right, leaves, size, shares: [0; MOST_CHILDREN] }))
    }

    /// Leaves below, 1 for a leaf.
    pub(crate) fn leaves(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Inner(inner) => inner.leaves,
        }
    }

    /// Puts a tree in the place of each leaf, from left to right.
    fn replace_leaves<M, E>(self, tree: &mut impl FnMut(L) -> Result<Node<M>, E>) -> Result<Node<M>, E> {
        match self {
            Self::Leaf(leaf) => tree(leaf),
            Self::Inner(inner) => {
                let left = inner.left.replace_leaves(tree)?;
                let right = inner.right.replace_leaves(tree)?;
                Ok(Node::above(left, right, inner.size))
            }
        }
    }
}

/// The triangles of a leaf packet, by number, ascending.
#[derive(Clone, Copy)]
pub(crate) struct PacketTriangles {
    numbers: [u32; PACKET],
    count: u8,
}

impl PacketTriangles {
    /// At most a packet of numbers.
    pub(crate) fn new(numbers: impl Iterator<Item = u32>) -> Self {
        let mut packet = Self { numbers: [0; PACKET], count: 0 };
        for (slot, number) in packet.numbers.iter_mut().zip(numbers) {
            *slot = number;
            packet.count += 1;
        }
        packet.numbers[..usize::from(packet.count)].sort_unstable();
        packet
    }

    pub(crate) fn numbers(&self) -> &[u32] {
        &self.numbers[..usize::from(self.count)]
    }
}

/// The bricks of an object and the tree above them.
pub(crate) struct Bricks {
    bricks: Vec<Stream<Triangle>>,
    top: Node<u32>,
    builder: Builder,
}

impl Bricks {
    /// Divides triangles into bricks, for treelets of `width` children. `grid` is that of all of them, if they are more
    /// than a brick has.
    pub(crate) fn divide(
        triangles: &Kept,
        grid: Option<Grid>,
        width: usize,
        effort: Effort,
        splits: SplitRule,
        means: &Means,
    ) -> Result<Self, BakeError> {
        let builder = Builder::new(width, effort, splits);
        let spill = means.scratch.spill();
        let tally = tally(means, DIVIDE, triangles.count());
        let mut division =
            Division { builder: &builder, means, spill: &spill, tally: &tally, bricks: Vec::new() };
        let top = division.divide(triangles, triangles.count(), grid)?;
        let bricks = division.bricks;
        Ok(Self { bricks, top, builder })
    }

    /// Builds the tree of each brick and makes something of it, some bricks side by side; also returns the tree above.
    /// Packets number the triangles of their brick.
    pub(crate) fn build<T: Send>(
        self,
        means: &Means,
        make: impl Fn(Node<PacketTriangles>, &[Triangle]) -> Result<T, BakeError> + Sync,
    ) -> Result<(Vec<T>, Node<u32>), BakeError> {
        let Self { bricks, top, builder } = self;
        let count = bricks.len();
        let triangles = bricks.iter().map(Stream::count).sum();
        let (trees, rest) = (tally(means, TREES, triangles), tally(means, WHOLE - DIVIDE - TREES, triangles));
        let bricks: Vec<_> = bricks.into_iter().map(|brick| Mutex::new(Some(brick))).collect();
        let made: Vec<_> = (0..count).map(|_| Mutex::new(None)).collect();
        let lock = |mutex: &Mutex<Option<Stream<Triangle>>>| match mutex.lock() {
            Ok(mut brick) => brick.take(),
            Err(_) => None,
        };
        let next = AtomicUsize::new(0);
        let work = || {
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                let Some(brick) = bricks.get(number).and_then(lock) else { break };
                let result = brick.take().and_then(|triangles| {
                    let tree = builder.tree(&triangles);
                    trees.add(triangles.len() as u64);
                    let made = make(tree, &triangles)?;
                    rest.add(triangles.len() as u64);
                    Ok(made)
                });
                if result.is_err() {
                    // The others need not go on.
                    next.fetch_add(count, Ordering::Relaxed);
                }
                if let Ok(mut made) = made[number].lock() {
                    *made = Some(result);
                }
            }
        };
        // As many loops as bricks side by side: a thread that waits for another may take up a second loop, but nothing
        // starts a brick besides the loops.
        rayon::scope(|scope| (0..means.bricks.min(count)).for_each(|_| scope.spawn(|_| work())));
        let results = made.into_iter().filter_map(|made| made.into_inner().ok().flatten());
        Ok((results.collect::<Result<_, _>>()?, top))
    }
}

/// Counts a pass over so many triangles.
fn tally(means: &Means, weight: u64, triangles: u64) -> Tally<'_> {
    means.progress.tally(Step::Bake(Stage::Build), weight, triangles, triangles)
}

struct Builder {
    /// Triangles in a full treelet of leaves.
    treelet: usize,
    /// Triangles in a brick, at most.
    brick: usize,
    /// Nodes of at most this many triangles are swept.
    sweep: usize,
    /// What is moved once a brick's tree stands.
    passes: &'static [Pass],
    /// How nodes are split.
    splits: SplitRule,
}

impl Builder {
    fn new(width: usize, effort: Effort, splits: SplitRule) -> Self {
        let (sweep, passes): (_, &[_]) = match effort {
            Effort::Fast => (16, &[]),
            Effort::Default => (swept::MOST, &[Pass { one_in: 10 }]),
            Effort::High => (swept::MOST, &[Pass { one_in: 1 }; 3]),
        };
        Self { treelet: PACKET * width, brick: BRICK, sweep, passes, splits }
    }

    /// The tree of a brick.
    fn tree(&self, triangles: &[Triangle]) -> Node<PacketTriangles> {
        let references =
            triangles.iter().zip(0..).map(|(triangle, number)| Reference::new(number, &triangle.corners));
        let mut references: Vec<Reference> = references.collect();
        let mut scratch = references.clone();
        let tree = self.brick(&mut references, &mut scratch);
        drop((references, scratch));
        reinsert::optimise(tree, self.passes, triangles)
    }
}
