//! Treelets in one array: those of a brick, or the tree above bricks with what is left of them behind it.

use crate::build::{MOST_CHILDREN, PacketTriangles};
use crate::soup::Triangle;
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
    /// Nothing, for the tree above a single brick.
    pub(crate) fn empty() -> Self {
        Self { treelets: Vec::new(), children: Vec::new() }
    }

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

    /// A copy of the treelets that `taken` does not hold and of those directly below them, which have no children
    /// there. `moved` is told of each of these, its number here and there. Triangles are copied, too, behind `triangles`.
    pub(crate) fn rest(
        &mut self,
        taken: &[bool],
        all: &[Triangle],
        triangles: &mut Vec<Triangle>,
        mut moved: impl FnMut(TreeletIndex, TreeletIndex),
    ) -> Self {
        let mut rest = Self { treelets: Vec::new(), children: Vec::new() };
        let mut stack = vec![(0, None)];
        while let Some((from, above)) = stack.pop() {
            let index = rest.treelets.len();
            if let Some((parent, child)) = above {
                let links: &mut [Option<TreeletIndex>; MOST_CHILDREN] = &mut rest.children[parent];
                links[child] = Some(index as u32);
            }
            rest.children.push([None; MOST_CHILDREN]);
            if taken[from as usize] {
                rest.treelets.push(Treelet { children: Vec::new() });
                moved(from, index as u32);
                continue;
            }
            let below = self.children[from as usize].iter().enumerate();
            stack.extend(below.rev().filter_map(|(child, link)| Some(((*link)?, Some((index, child))))));
            let mut treelet =
                std::mem::replace(&mut self.treelets[from as usize], Treelet { children: Vec::new() });
            for child in &mut treelet.children {
                if let ChildKind::Leaf(packet) = &mut child.kind {
                    let first = triangles.len() as u32;
                    triangles.extend(packet.numbers().iter().map(|&number| all[number as usize]));
                    *packet = PacketTriangles::new(first..triangles.len() as u32);
                }
            }
            rest.treelets.push(treelet);
        }
        rest
    }

    /// Adds to the numbers of the triangles.
    pub(crate) fn renumber_triangles(&mut self, first: u32) {
        for child in self.treelets.iter_mut().flat_map(|treelet| &mut treelet.children) {
            if let ChildKind::Leaf(packet) = &mut child.kind {
                *packet = PacketTriangles::new(packet.numbers().iter().map(|number| number + first));
            }
        }
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

    /// The children of all treelets.
    pub(crate) fn children_in_all(&self) -> u64 {
        self.treelets.iter().map(|treelet| treelet.children.len() as u64).sum()
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
