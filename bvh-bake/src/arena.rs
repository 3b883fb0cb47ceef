//! The treelets of an object in one array, brick by brick behind the tree above them.

use crate::build::MOST_CHILDREN;
use crate::treelets::{ChildKind, Treelet};
use std::ops::Range;

/// A treelet by number in an arena; children have higher numbers than their parents.
pub(crate) type TreeletIndex = u32;

/// A tree of treelets, depth-first.
pub(crate) struct Arena {
    pub(crate) treelets: Vec<Treelet>,
    /// Per treelet and child the child treelet, if it is one.
    children: Vec<[Option<TreeletIndex>; MOST_CHILDREN]>,
}

impl Arena {
    /// Flattens a tree; links to bricks stay open.
    pub(crate) fn flatten(root: Treelet) -> Self {
        let mut arena = Self { treelets: Vec::new(), children: Vec::new() };
        // A stack, since trees may be deep: each treelet with the child it hangs from.
        let mut stack = vec![(root, None)];
        while let Some((mut treelet, from)) = stack.pop() {
            let index = arena.treelets.len();
            if let Some((parent, child)) = from {
                let links: &mut [Option<TreeletIndex>; MOST_CHILDREN] = &mut arena.children[parent];
                links[child] = Some(index as u32);
            }
            for (child, slot) in treelet.children.iter_mut().enumerate().rev() {
                if let ChildKind::Treelet(inner) = &mut slot.kind {
                    let inner = std::mem::replace(inner.as_mut(), Treelet { children: Vec::new() });
                    stack.push((inner, Some((index, child))));
                }
            }
            arena.treelets.push(treelet);
            arena.children.push([None; MOST_CHILDREN]);
        }
        arena
    }

    /// Puts bricks behind the tree above them; returns which treelets each brick has, the first its root.
    pub(crate) fn join(mut top: Self, bricks: Vec<Self>) -> (Self, Vec<Range<usize>>) {
        let mut ranges = Vec::with_capacity(bricks.len());
        for mut brick in bricks {
            let first = top.treelets.len();
            top.treelets.append(&mut brick.treelets);
            let shifted = |link: Option<TreeletIndex>| link.map(|link| link + first as u32);
            top.children.extend(brick.children.into_iter().map(|links| links.map(shifted)));
            ranges.push(first..top.treelets.len());
        }
        for (treelet, links) in top.treelets.iter().zip(&mut top.children) {
            for (child, link) in treelet.children.iter().zip(links) {
                if let ChildKind::Brick(brick) = child.kind {
                    *link = Some(ranges[brick as usize].start as u32);
                }
            }
        }
        (top, ranges)
    }

    /// The treelet that a child is, if it is one.
    pub(crate) fn child(&self, treelet: TreeletIndex, child: usize) -> Option<TreeletIndex> {
        self.children[treelet as usize][child]
    }

    /// The treelets among a treelet's children.
    pub(crate) fn children(&self, treelet: TreeletIndex) -> impl DoubleEndedIterator<Item = TreeletIndex> {
        self.children[treelet as usize].iter().flatten().copied()
    }
}
