//! Cuts a binary tree into treelets of W children and fits the k-DOPs.
//!
//! A treelet starts at a binary node and opens, of its children so far, the one that traversals
//! enter most (the largest), until it has W. A subtree whose packets fit one treelet is left closed:
//! opened, its packets would end up under a treelet that is not full.

use crate::build::Node;
use crate::prepare::Corners;
use bvh_format::kdop::Kdop;
use rayon::prelude::*;

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
    /// Triangles of a packet, by number, ascending.
    Leaf(Vec<u32>),
    Treelet(Box<Treelet>),
}

impl Treelet {
    /// The k-DOP of all children.
    pub(crate) fn kdop(&self, slabs: usize) -> Kdop {
        let mut kdop = Kdop::EMPTY;
        self.children.iter().for_each(|child| kdop.join(&child.kdop, slabs));
        kdop
    }
}

/// What stays the same all over the tree.
pub(crate) struct Cutter<'a> {
    pub(crate) triangles: &'a [Corners],
    pub(crate) width: usize,
    pub(crate) slabs: usize,
}

impl Cutter<'_> {
    /// The treelet that starts at `node`, with all below it.
    pub(crate) fn cut(&self, node: Node) -> Treelet {
        let packets = node.packets();
        let mut open = vec![node];
        while open.len() < self.width {
            let Some(at) = self.next_to_open(&open) else { break };
            // The children take the place of their parent, so that the order of the tree is kept.
            if let Node::Inner(inner) = open.remove(at) {
                open.insert(at, inner.right);
                open.insert(at, inner.left);
            }
        }
        let children = if packets > 2048 {
            open.into_par_iter().map(|node| self.child(node)).collect()
        } else {
            open.into_iter().map(|node| self.child(node)).collect()
        };
        Treelet { children }
    }

    /// The largest node that may be opened. At the start that is the treelet's own root.
    fn next_to_open(&self, open: &[Node]) -> Option<usize> {
        let alone = open.len() == 1;
        // Within a treelet of nothing but packets every inner node is opened.
        let bottom: usize = open.iter().map(Node::packets).sum();
        let all_fit = bottom <= self.width;
        let may = |node: &Node| match node {
            Node::Leaf(_) => false,
            Node::Inner(inner) => alone || all_fit || inner.packets > self.width,
        };
        let mut best: Option<usize> = None;
        for (index, node) in open.iter().enumerate().filter(|(_, node)| may(node)) {
            if best.is_none_or(|best| node.size() > open[best].size()) {
                best = Some(index);
            }
        }
        best
    }

    fn child(&self, node: Node) -> Child {
        match node {
            Node::Leaf(mut triangles) => {
                triangles.sort_unstable();
                let kdop = Kdop::of_points(triangles.iter().flat_map(|&t| self.triangles[t as usize]));
                Child { kdop, kind: ChildKind::Leaf(triangles) }
            }
            inner => {
                let treelet = self.cut(inner);
                Child { kdop: treelet.kdop(self.slabs), kind: ChildKind::Treelet(Box::new(treelet)) }
            }
        }
    }
}
