//! Cuts a binary tree into treelets of W children and fits the k-DOPs.
//!
//! A treelet starts at a binary node and opens, of its children so far, the one that traversals
//! enter most (the largest), until it has W. A subtree whose packets fit one treelet is left closed:
//! opened, its packets would end up under a treelet that is not full. So it goes with bricks, the leaves of the
//! tree above them.

use crate::build::{Node, PacketTriangles};
use crate::prepare::Corners;
use bvh_format::kdop::Kdop;
use rayon::prelude::*;

/// Below this many leaves, threads cost more than they bring.
const PARALLEL: usize = 2048;

/// A treelet over its children.
pub(crate) struct Treelet {
    pub(crate) children: Vec<Child>,
}

pub(crate) struct Child {
    /// The tight k-DOP of all triangles below.
    pub(crate) kdop: Kdop,
    pub(crate) kind: ChildKind,
}

pub(crate) enum ChildKind {
    Leaf(PacketTriangles),
    Treelet(Box<Treelet>),
    /// The first treelet of a brick, by the brick's number.
    Brick(u32),
}

impl Treelet {
    /// The k-DOP of all children.
    pub(crate) fn kdop(&self, slabs: usize) -> Kdop {
        let mut kdop = Kdop::EMPTY;
        self.children.iter().for_each(|child| kdop.join(&child.kdop, slabs));
        kdop
    }
}

/// What stays the same all over a tree.
pub(crate) struct Cutter<F> {
    /// Children in a full treelet.
    pub(crate) width: usize,
    /// The slabs that the profile stores.
    pub(crate) slabs: usize,
    /// Makes a child of a leaf.
    pub(crate) leaf: F,
}

impl<F> Cutter<F> {
    /// The treelet that starts at `node`, with all below it.
    pub(crate) fn cut<L: Send>(&self, node: Node<L>) -> Treelet
    where
        F: Fn(L) -> Child + Sync,
    {
        let leaves = node.leaves();
        let mut open = Vec::with_capacity(self.width);
        open.push(node);
        while open.len() < self.width {
            let Some(at) = self.next_to_open(&open) else { break };
            // The children take the place of their parent, so that the order of the tree is kept.
            if let Node::Inner(inner) = open.remove(at) {
                open.insert(at, inner.right);
                open.insert(at, inner.left);
            }
        }
        let children = if leaves > PARALLEL {
            open.into_par_iter().map(|node| self.child(node)).collect()
        } else {
            open.into_iter().map(|node| self.child(node)).collect()
        };
        Treelet { children }
    }

    /// The largest node that may be opened. At the start that is the treelet's own root.
    fn next_to_open<L>(&self, open: &[Node<L>]) -> Option<usize> {
        let alone = open.len() == 1;
        // Within a treelet of nothing but leaves every inner node is opened.
        let bottom: usize = open.iter().map(Node::leaves).sum();
        let all_fit = bottom <= self.width;
        let may = |node: &Node<L>| match node {
            Node::Leaf(_) => false,
            Node::Inner(inner) => alone || all_fit || inner.leaves > self.width,
        };
        let mut best: Option<usize> = None;
        for (index, node) in open.iter().enumerate().filter(|(_, node)| may(node)) {
            if best.is_none_or(|best| node.size() > open[best].size()) {
                best = Some(index);
            }
        }
        best
    }

    fn child<L: Send>(&self, node: Node<L>) -> Child
    where
        F: Fn(L) -> Child + Sync,
    {
        match node {
            Node::Leaf(leaf) => (self.leaf)(leaf),
            inner => {
                let treelet = self.cut(inner);
                Child { kdop: treelet.kdop(self.slabs), kind: ChildKind::Treelet(Box::new(treelet)) }
            }
        }
    }
}

/// The child that is a leaf packet.
pub(crate) fn packet(triangles: &[Corners], packet: PacketTriangles) -> Child {
    let corners = packet.numbers().iter().flat_map(|&triangle| triangles[triangle as usize]);
    Child { kdop: Kdop::of_points(corners), kind: ChildKind::Leaf(packet) }
}
