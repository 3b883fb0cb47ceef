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
use crate::options::Effort;
use crate::prepare::Corners;
use boxes::Reference;
use rayon::prelude::*;
use reinsert::Pass;

/// Triangles in a leaf packet.
const PACKET: usize = bvh_format::leaf::PACKET;

/// Triangles in a brick, at most. The bytes of a file depend on it.
const BRICK: usize = 1 << 18;

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
    fn replace_leaves<M>(self, tree: &mut impl FnMut(L) -> Node<M>) -> Node<M> {
        match self {
            Self::Leaf(leaf) => tree(leaf),
            Self::Inner(inner) => {
                let left = inner.left.replace_leaves(tree);
                let right = inner.right.replace_leaves(tree);
                Node::above(left, right, inner.size)
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
    fn new(numbers: impl Iterator<Item = u32>) -> Self {
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
    bricks: Vec<Vec<Reference>>,
    pub(crate) top: Node<u32>,
    builder: Builder,
}

impl Bricks {
    /// Divides triangles into bricks, for treelets of `width` children.
    pub(crate) fn divide(triangles: &[Corners], width: usize, effort: Effort, splits: SplitRule) -> Self {
        let references = triangles.par_iter().enumerate();
        let references = references.map(|(index, corners)| Reference::new(index as u32, corners)).collect();
        let builder = Builder::new(width, effort, splits);
        let mut bricks = Vec::new();
        let top = bricks::divide(references, &builder, &mut bricks);
        Self { bricks, top, builder }
    }

    /// Builds the tree of each brick and makes something of it, in parallel; also returns the tree above.
    pub(crate) fn build<T: Send>(
        self,
        triangles: &[Corners],
        make: impl Fn(Node<PacketTriangles>) -> T + Sync,
    ) -> (Vec<T>, Node<u32>) {
        let build = |mut references: Vec<Reference>| {
            let mut scratch = references.clone();
            let tree = self.builder.brick(&mut references, &mut scratch);
            drop((references, scratch));
            make(reinsert::optimise(tree, self.builder.passes, triangles))
        };
        (self.bricks.into_par_iter().map(build).collect(), self.top)
    }
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
}
