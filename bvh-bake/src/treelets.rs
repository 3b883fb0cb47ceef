//! Cuts a binary tree into treelets of W children and fits the k-DOPs.
//!
//! Of all ways to cut, the one is taken in which the sizes of the nodes where treelets start have the least sum: those
//! are what traversals meet. From the leaves up, each node finds the least cost of what is below it for each
//! number of places that it may take in the treelet above (dynamic programming). A treelet costs some more
//! wherever it is, so that files stay small where it hardly matters. Of equal costs, that of more opened nodes
//! is taken. The tree above bricks is cut in the same way, with bricks for leaves.

use crate::build::{Inner, MOST_CHILDREN, Node, PacketTriangles};
use crate::soup::Triangle;
use bvh_format::kdop::Kdop;
use rayon::prelude::*;

/// Below this many leaves, threads cost more than they bring.
const PARALLEL: usize = 2048;

/// What a treelet costs wherever it is, in mean sizes of nodes with two leaves.
const ROOM: f64 = 0.5;

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
    pub(crate) fn cut<L: Send>(&self, mut node: Node<L>) -> Treelet
    where
        F: Fn(L) -> Child + Sync,
    {
        let (mut sum, mut count) = (0.0, 0.0f64);
        add_pairs(&node, &mut sum, &mut count);
        let room = if count > 0.0 { ROOM * sum / count } else { 0.0 };
        self.divide(&mut node, room);
        self.treelet(node)
    }

    /// Finds how the places of treelets are best divided between the sides of each node. Returns the least cost
    /// of what is below `node` if that takes at most 1, 2, ... places in a treelet. `room` is the cost of a
    /// treelet wherever it is.
    fn divide<L: Send>(&self, node: &mut Node<L>, room: f64) -> [f64; MOST_CHILDREN]
    where
        F: Sync,
    {
        let Node::Inner(inner) = node else { return [0.0; MOST_CHILDREN] };
        let Inner { left, right, leaves, size, shares } = inner.as_mut();
        let (left, right) = if *leaves > PARALLEL {
            rayon::join(|| self.divide(left, room), || self.divide(right, room))
        } else {
            (self.divide(left, room), self.divide(right, room))
        };
        let mut costs = [f64::INFINITY; MOST_CHILDREN];
        for places in 2..=self.width {
            costs[places - 1] = costs[places - 2];
            shares[places - 1] = shares[places - 2];
            for share in 1..places {
                let cost = left[share - 1] + right[places - share - 1];
                if cost < costs[places - 1] {
                    costs[places - 1] = cost;
                    shares[places - 1] = share as u8;
                }
            }
        }
        // Or a treelet of its own starts here, in one place.
        let closed = costs[self.width - 1] + *size + room;
        shares[0] = shares[self.width - 1];
        costs[0] = closed;
        for places in 2..=self.width {
            if closed < costs[places - 1] {
                costs[places - 1] = closed;
                shares[places - 1] = 0;
            }
        }
        costs
    }

    /// The treelet that starts at a node whose places have been divided.
    fn treelet<L: Send>(&self, node: Node<L>) -> Treelet
    where
        F: Fn(L) -> Child + Sync,
    {
        let leaves = node.leaves();
        let mut closed = Vec::with_capacity(self.width);
        match node {
            Node::Leaf(_) => closed.push(node),
            Node::Inner(inner) => {
                let share = inner.shares[0];
                open(*inner, share, self.width, &mut closed);
            }
        }
        let children = if leaves > PARALLEL {
            closed.into_par_iter().map(|node| self.child(node)).collect()
        } else {
            closed.into_iter().map(|node| self.child(node)).collect()
        };
        Treelet { children }
    }

    fn child<L: Send>(&self, node: Node<L>) -> Child
    where
        F: Fn(L) -> Child + Sync,
    {
        match node {
            Node::Leaf(leaf) => (self.leaf)(leaf),
            inner => {
                let treelet = self.treelet(inner);
                Child { kdop: treelet.kdop(self.slabs), kind: ChildKind::Treelet(Box::new(treelet)) }
            }
        }
    }
}

/// Adds up number and sizes of the nodes with two leaves.
fn add_pairs<L>(node: &Node<L>, sum: &mut f64, count: &mut f64) {
    if let Node::Inner(inner) = node {
        if inner.leaves == 2 {
            *sum += inner.size;
            *count += 1.0;
        } else {
            add_pairs(&inner.left, sum, count);
            add_pairs(&inner.right, sum, count);
        }
    }
}

/// Divides `places` between the sides of a node, of which the left gets `share`, and adds what then stays closed
/// in the order of the tree.
fn open<L>(inner: Inner<L>, share: u8, places: usize, closed: &mut Vec<Node<L>>) {
    let share = usize::from(share);
    for (side, places) in [(inner.left, share), (inner.right, places - share)] {
        match side {
            Node::Inner(inner) if places > 1 && inner.shares[places - 1] > 0 => {
                let share = inner.shares[places - 1];
                open(*inner, share, places, closed);
            }
            side => closed.push(side),
        }
    }
}

/// The child that is a leaf packet.
pub(crate) fn packet(triangles: &[Triangle], packet: PacketTriangles) -> Child {
    let corners = packet.numbers().iter().flat_map(|&triangle| triangles[triangle as usize].corners);
    Child { kdop: Kdop::of_points(corners), kind: ChildKind::Leaf(packet) }
}
