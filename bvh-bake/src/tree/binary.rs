//! A binary tree in one array: nodes need no allocation each, and nodes that are visited together are stored together.

use super::boxes::Aabb;
use crate::threads;

/// The place of a node in its tree's array.
pub(crate) type NodeIndex = u32;

/// Stands for no node, as the parent of the root does.
pub(super) const NONE: NodeIndex = NodeIndex::MAX;

/// A binary tree whose leaves are `L`. A tree that has just been built lists parents before children and the left
/// side before the right. Moves of subtrees (`reinsert`) change links only and leave nodes in their places.
pub(crate) struct Tree<L> {
    pub(super) nodes: Vec<TreeNode<L>>,
    pub(super) root: NodeIndex,
}

/// A node with the box of everything below it.
#[derive(Clone)]
pub(super) struct TreeNode<L> {
    pub(super) bounds: Aabb,
    pub(super) parent: NodeIndex,
    pub(super) content: Content<L>,
}

/// The content of a node.
#[derive(Clone, Copy)]
pub(super) enum Content<L> {
    Leaf(L),
    /// The left and the right child.
    Inner([NodeIndex; 2]),
}

impl<L> TreeNode<L> {
    /// Returns an estimate of how likely a traversal is to visit the node. Only comparisons of sizes have a meaning.
    #[inline(always)]
    pub(super) fn size(&self) -> f64 {
        self.bounds.squared_girth()
    }

    /// Returns the node as stored `places` further on in an array. The root still has no parent.
    fn shifted(mut self, places: NodeIndex) -> Self {
        if self.parent != NONE {
            self.parent += places;
        }
        if let Content::Inner(children) = &mut self.content {
            *children = children.map(|child| child + places);
        }
        self
    }
}

impl<L> Tree<L> {
    /// Makes a tree without nodes, to which a builder adds the root first.
    pub(super) fn with_capacity(nodes: usize) -> Self {
        Self { nodes: Vec::with_capacity(nodes), root: 0 }
    }

    /// Makes a tree of one leaf.
    pub(super) fn leaf(leaf: L) -> Self {
        let mut tree = Self::with_capacity(1);
        tree.add(Aabb::EMPTY, Content::Leaf(leaf));
        tree
    }

    /// Appends a node and returns its index. Its parent links to it later.
    pub(super) fn add(&mut self, bounds: Aabb, content: Content<L>) -> NodeIndex {
        self.nodes.push(TreeNode { bounds, parent: NONE, content });
        self.nodes.len() as NodeIndex - 1
    }

    /// Appends all nodes of another tree and returns the index of its root.
    pub(super) fn append(&mut self, other: Self) -> NodeIndex {
        let places = self.nodes.len() as NodeIndex;
        self.nodes.extend(other.nodes.into_iter().map(|node| node.shifted(places)));
        other.root + places
    }

    /// Links a node and its two children.
    pub(super) fn link(&mut self, parent: NodeIndex, children: [NodeIndex; 2]) {
        self.nodes[parent as usize].content = Content::Inner(children);
        children.iter().for_each(|&child| self.nodes[child as usize].parent = parent);
    }

    /// Adds two subtrees, and returns their roots. If the second one has many nodes, it is built apart at the same time, with room for so
    /// many.
    pub(super) fn add_both(
        &mut self,
        many: Option<usize>,
        first: impl FnOnce(&mut Self) -> NodeIndex + Send,
        second: impl FnOnce(&mut Self) -> NodeIndex + Send,
    ) -> [NodeIndex; 2]
    where
        L: Send,
    {
        let Some(nodes) = many else { return [first(self), second(self)] };
        let apart = || {
            let mut tree = Self::with_capacity(nodes);
            second(&mut tree);
            tree
        };
        let (first, second) = threads::join(|| first(self), apart);
        [first, self.append(second)]
    }

    /// Joins two trees under a new root. `bounds` is the box of both.
    pub(super) fn above(left: Self, right: Self, bounds: Aabb) -> Self {
        let mut tree = Self::with_capacity(1 + left.nodes.len() + right.nodes.len());
        let root = tree.add(bounds, Content::Inner([NONE; 2]));
        let children = [tree.append(left), tree.append(right)];
        tree.link(root, children);
        tree
    }

    /// Returns true if the tree is a single leaf.
    pub(crate) fn is_leaf(&self) -> bool {
        self.nodes.len() == 1
    }

    /// Returns the number of leaves.
    pub(super) fn leaves(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// Returns all leaves, in the order in which the tree was built.
    pub(super) fn leaves_mut(&mut self) -> impl Iterator<Item = &mut L> {
        self.nodes.iter_mut().filter_map(|node| match &mut node.content {
            Content::Leaf(leaf) => Some(leaf),
            Content::Inner(_) => None,
        })
    }

    pub(super) fn at(&self, index: NodeIndex) -> &TreeNode<L> {
        &self.nodes[index as usize]
    }

    pub(super) fn at_mut(&mut self, index: NodeIndex) -> &mut TreeNode<L> {
        &mut self.nodes[index as usize]
    }

    /// Returns the two children of an inner node.
    #[inline(always)]
    pub(super) fn children(&self, index: NodeIndex) -> Option<[NodeIndex; 2]> {
        match self.at(index).content {
            Content::Leaf(_) => None,
            Content::Inner(children) => Some(children),
        }
    }
}

impl<L: Copy> Tree<L> {
    /// Replaces each leaf by a tree, from left to right.
    pub(super) fn replace_leaves<M, E>(
        &self,
        tree_of: &mut impl FnMut(L) -> Result<Tree<M>, E>,
    ) -> Result<Tree<M>, E> {
        let mut tree = Tree::with_capacity(self.nodes.len());
        self.replace_below(self.root, &mut tree, tree_of)?;
        Ok(tree)
    }

    /// Adds a subtree with its leaves replaced to `tree` and returns the index of its root there.
    fn replace_below<M, E>(
        &self,
        index: NodeIndex,
        tree: &mut Tree<M>,
        tree_of: &mut impl FnMut(L) -> Result<Tree<M>, E>,
    ) -> Result<NodeIndex, E> {
        match self.at(index).content {
            Content::Leaf(leaf) => Ok(tree.append(tree_of(leaf)?)),
            Content::Inner([left, right]) => {
                let index = tree.add(self.at(index).bounds, Content::Inner([NONE; 2]));
                let left = self.replace_below(left, tree, tree_of)?;
                let right = self.replace_below(right, tree, tree_of)?;
                tree.link(index, [left, right]);
                Ok(index)
            }
        }
    }
}
