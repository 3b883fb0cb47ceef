//! Cuts a binary tree into treelets of W children and fits the k-DOPs.
//!
//! The cut minimises the sum of the sizes of the nodes where treelets start, because these are the nodes that
//! traversals visit. From the leaves up, each node computes the least cost below it for each number of places that it
//! may take in the treelet above (dynamic programming). A treelet also has a fixed cost, so that files stay small where
//! the cut hardly matters. Of equal costs, the one with more opened nodes is taken. The tree above the bricks is cut in
//! the same way, with bricks as leaves.

use crate::threads;
use crate::tree::MAX_CHILDREN;
use crate::tree::PacketTriangles;
use crate::tree::arena::{Arena, Child, ChildKind, TreeletIndex};
use crate::tree::binary::{Content, NodeIndex, Tree};
use crate::tree::bricks::BrickIndex;
use crate::triangles::Triangle;
use bvh_format::kdop::Kdop;
use bvh_format::leaf::{PACKET, Packet};
use bvh_format::page::TightBound;
use bvh_format::vertex::Vertices;

/// The fixed cost of a treelet, in mean sizes of nodes with two leaves.
const TREELET_COST: f64 = 1.0;

/// Cuts the tree of a brick into treelets of up to `width` children and fits the first `slabs` slabs of each child, which contain
/// the vertices behind the offsets. Puts the triangles of packets in the order of lanes on request.
pub(crate) fn cut_brick(
    tree: &Tree<PacketTriangles>,
    triangles: &[Triangle],
    width: usize,
    slabs: usize,
    behind: &Vertices,
    in_order_of_lanes: bool,
) -> Arena {
    let leaf = |packet| Child { bound: TightBound::EMPTY, kind: ChildKind::Leaf(packet) };
    let (mut arena, margins) = (cut(tree, width, leaf), behind.margins());
    threads::change(arena.children_mut(), |_, child| {
        if let ChildKind::Leaf(packet) = &mut child.kind {
            if in_order_of_lanes {
                *packet = packet.in_order_of_lanes(triangles);
            }
            let kdop = packet_of(triangles, packet).kdop(packet.numbers().len(), slabs);
            child.bound.kdop = if behind.are_sums() { kdop } else { kdop.widened(&margins) };
        }
    });
    arena.join_kdops(slabs);
    arena
}

/// Cuts the tree above bricks, whose k-DOPs are given.
pub(crate) fn cut_top(
    tree: &Tree<BrickIndex>,
    kdop_of: impl Fn(BrickIndex) -> Kdop,
    width: usize,
    slabs: usize,
) -> Arena {
    let leaf = |brick| Child { bound: TightBound::of_kdop(kdop_of(brick)), kind: ChildKind::Brick(brick) };
    let mut arena = cut(tree, width, leaf);
    arena.join_kdops(slabs);
    arena
}

/// Returns the treelets of a tree. Children that are treelets have no k-DOP yet.
fn cut<L: Copy>(tree: &Tree<L>, width: usize, leaf: impl Fn(L) -> Child) -> Arena {
    let (mut sum, mut count) = (0.0, 0.0f64);
    add_pairs(tree, tree.root, &mut sum, &mut count);
    let treelet_cost = if count > 0.0 { TREELET_COST * sum / count } else { 0.0 };
    let mut cutter = Cutter { tree, width, treelet_cost, shares: vec![[0; MAX_CHILDREN]; tree.nodes.len()] };
    cutter.divide(tree.root);
    // Most nodes become children; nodes inside treelets do not.
    let mut arena = Arena::with_capacity(tree.nodes.len() / 4, tree.nodes.len());
    cutter.add_treelet(tree.root, &mut arena, &leaf);
    arena
}

/// The constants of a cut, and the division of each node.
struct Cutter<'a, L> {
    tree: &'a Tree<L>,
    /// Children in a full treelet.
    width: usize,
    /// The fixed cost of a treelet.
    treelet_cost: f64,
    /// Per node and number of places, counted from 1, the places that the left side gets of those that both sides
    /// share; 0 means that the node stays closed, so that a treelet starts there.
    shares: Vec<[u8; MAX_CHILDREN]>,
}

impl<L: Copy> Cutter<'_, L> {
    /// Finds the best division of a treelet's places between the sides of each node. Returns the least cost below a
    /// node if the node takes at most 1, 2, ... places in a treelet.
    fn divide(&mut self, node: NodeIndex) -> [f64; MAX_CHILDREN] {
        let Some([left, right]) = self.tree.children(node) else { return [0.0; MAX_CHILDREN] };
        let (left, right) = (self.divide(left), self.divide(right));
        let mut costs = [f64::INFINITY; MAX_CHILDREN];
        let shares = &mut self.shares[node as usize];
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
        // The alternative is a treelet that starts here and takes one place.
        let closed = costs[self.width - 1] + self.tree.at(node).size() + self.treelet_cost;
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

    /// Adds the treelet that starts at a node and all treelets below it, and returns its index.
    fn add_treelet(&self, node: NodeIndex, arena: &mut Arena, leaf: &impl Fn(L) -> Child) -> TreeletIndex {
        let mut closed = Closed { nodes: [0; MAX_CHILDREN], count: 0 };
        match self.tree.children(node) {
            None => closed.push(node),
            Some(_) => self.open(node, self.shares[node as usize][0], self.width, &mut closed),
        }
        let nodes = closed.nodes[..closed.count].iter();
        let (treelet, first) = arena.add(nodes.map(|&node| match self.tree.at(node).content {
            Content::Leaf(content) => leaf(content),
            Content::Inner(_) => Child { bound: TightBound::EMPTY, kind: ChildKind::Treelet(0) },
        }));
        for (child, &node) in (first..).zip(&closed.nodes[..closed.count]) {
            if self.tree.children(node).is_some() {
                let below = self.add_treelet(node, arena, leaf);
                arena.children_mut()[child].kind = ChildKind::Treelet(below);
            }
        }
        treelet
    }

    /// Divides `places` between the sides of a node, of which the left gets `share`. Adds the nodes that then stay
    /// closed, in the order of the tree.
    fn open(&self, node: NodeIndex, share: u8, places: usize, closed: &mut Closed) {
        let Some([left, right]) = self.tree.children(node) else { return };
        let share = usize::from(share);
        for (side, places) in [(left, share), (right, places - share)] {
            let shares = &self.shares[side as usize];
            // Leaves have no shares.
            if places > 1 && shares[places - 1] > 0 {
                self.open(side, shares[places - 1], places, closed);
            } else {
                closed.push(side);
            }
        }
    }
}

/// The nodes that become the children of a treelet.
struct Closed {
    nodes: [NodeIndex; MAX_CHILDREN],
    count: usize,
}

impl Closed {
    fn push(&mut self, node: NodeIndex) {
        self.nodes[self.count] = node;
        self.count += 1;
    }
}

/// Sums the number and the sizes of the nodes with two leaves.
fn add_pairs<L>(tree: &Tree<L>, node: NodeIndex, sum: &mut f64, count: &mut f64) {
    let Some([left, right]) = tree.children(node) else { return };
    if tree.children(left).is_none() && tree.children(right).is_none() {
        *sum += tree.at(node).size();
        *count += 1.0;
    } else {
        add_pairs(tree, left, sum, count);
        add_pairs(tree, right, sum, count);
    }
}

/// Returns the packet of some triangles.
pub(crate) fn packet_of(triangles: &[Triangle], packet: &PacketTriangles) -> Packet {
    let mut corners = [[[0.0; 3]; 3]; PACKET];
    for (corners, &number) in corners.iter_mut().zip(packet.numbers()) {
        *corners = triangles[number as usize].corners;
    }
    Packet::new(&corners[..packet.numbers().len()])
}
