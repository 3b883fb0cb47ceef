//! Makes a tree of other branching and larger leaves out of a tree of treelets of two.
//!
//! A subtree with no more triangles than a leaf holds becomes a leaf. Treelets are cut as the baker cuts them: of
//! the nodes of a treelet so far the largest is opened until there are enough, and a subtree whose leaves fit
//! one treelet stays closed. The binary tree was built for leaves of four and treelets of two, so larger ones
//! are less full than those of a tree built for them: `triangles_per_leaf` says how full.

use super::tree::{Node, Tree};

/// A tree's shape.
#[derive(Debug, Clone, Copy)]
pub(in crate::report) struct Cut {
    /// Children of a treelet, at most.
    pub(in crate::report) branching: usize,
    /// Triangles of a leaf, at most.
    pub(in crate::report) leaf: u32,
}

impl Cut {
    /// The tree of this shape, of tight bounds.
    pub(in crate::report) fn of(self, binary: &Tree) -> Tree {
        let below = Below::new(binary, self.leaf);
        let mut tree = Tree { nodes: vec![below.node(0)], ..*binary };
        // Nodes to fill: number here, number in the binary tree.
        let mut stack = vec![(0, 0)];
        while let Some((here, there)) = stack.pop() {
            if tree.nodes[here].triangles > 0 {
                continue;
            }
            for open in self.children(&below, there) {
                let place = tree.nodes.len();
                tree.nodes.push(below.node(open));
                tree.nodes[here].children.push(place as u32);
                stack.push((place, open));
            }
        }
        tree
    }

    /// The children of a treelet, in the order of the tree.
    fn children(self, below: &Below<'_>, root: usize) -> Vec<usize> {
        let mut open = vec![root];
        while open.len() < self.branching {
            let alone = open.len() == 1;
            let all_fit = open.iter().map(|&node| below.leaves[node]).sum::<usize>() <= self.branching;
            let may = |node: usize| {
                !below.is_leaf(node) && (alone || all_fit || below.leaves[node] > self.branching)
            };
            let candidates = (0..open.len()).filter(|&place| may(open[place]));
            let size = |place: usize| below.tree.nodes[open[place]].tight.box_area();
            // The first of equals, as in the baker.
            let largest =
                candidates.reduce(|best, place| if size(place) > size(best) { place } else { best });
            let Some(place) = largest else { break };
            let children = below.tree.nodes[open[place]].children.iter().map(|&child| child as usize);
            open.splice(place..=place, children);
        }
        open
    }
}

/// What is below each node of the binary tree.
struct Below<'a> {
    tree: &'a Tree,
    triangles: Vec<u32>,
    leaves: Vec<usize>,
    leaf: u32,
}

impl<'a> Below<'a> {
    fn new(tree: &'a Tree, leaf: u32) -> Self {
        let count = tree.nodes.len();
        let mut below = Self { tree, triangles: vec![0; count], leaves: vec![0; count], leaf };
        for number in (0..count).rev() {
            let node = &tree.nodes[number];
            let children = node.children.iter().map(|&child| child as usize);
            below.triangles[number] =
                node.triangles + children.clone().map(|c| below.triangles[c]).sum::<u32>();
            let leaves = children.map(|child| below.leaves[child]).sum();
            below.leaves[number] = if below.is_leaf(number) { 1 } else { leaves };
        }
        below
    }

    fn is_leaf(&self, node: usize) -> bool {
        self.tree.nodes[node].triangles > 0 || self.triangles[node] <= self.leaf
    }

    /// The node without children.
    fn node(&self, number: usize) -> Node {
        let tight = self.tree.nodes[number].tight;
        let triangles = if self.is_leaf(number) { self.triangles[number] } else { 0 };
        Node { bound: tight, tight, children: Vec::new(), triangles }
    }
}
