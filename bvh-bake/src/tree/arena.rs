//! Treelets in one array: those of a brick, or the tree above the bricks followed by the rests of the bricks.

use crate::tree::PacketTriangles;
use crate::tree::bricks::BrickIndex;
use bvh_format::kdop::Kdop;
use bvh_format::page::TightBound;
use std::ops::Range;

/// A treelet by number in an arena; children have higher numbers than their parents.
pub(crate) type TreeletIndex = u32;

/// A child of a treelet.
#[derive(Clone, Copy)]
pub(crate) struct Child {
    /// The tight bound of all triangles below: the slabs that the profile stores.
    pub(crate) bound: TightBound,
    pub(crate) kind: ChildKind,
}

#[derive(Clone, Copy)]
pub(crate) enum ChildKind {
    Leaf(PacketTriangles),
    Treelet(TreeletIndex),
    /// The first treelet of a brick whose treelets are in an arena of their own.
    Brick(BrickIndex),
}

/// A tree of treelets, depth-first. The children of all treelets are in one array, treelet after treelet.
pub(crate) struct Arena {
    children: Vec<Child>,
    /// Per treelet, the position after its last child.
    ends: Vec<u32>,
}

impl Arena {
    pub(crate) fn with_capacity(treelets: usize, children: usize) -> Self {
        Self { children: Vec::with_capacity(children), ends: Vec::with_capacity(treelets) }
    }

    /// Makes an arena without treelets, for the tree above a single brick.
    pub(crate) fn empty() -> Self {
        Self::with_capacity(0, 0)
    }

    /// Adds a treelet with its children. Returns its index and the position of its first child among all children.
    pub(crate) fn add(&mut self, children: impl Iterator<Item = Child>) -> (TreeletIndex, usize) {
        let first = self.children.len();
        self.children.extend(children);
        self.ends.push(self.children.len() as u32);
        (self.ends.len() as u32 - 1, first)
    }

    /// Returns the number of treelets.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns the number of children of all treelets.
    pub(crate) fn child_count(&self) -> u64 {
        self.children.len() as u64
    }

    /// Returns the children of all treelets.
    pub(crate) fn children_mut(&mut self) -> &mut [Child] {
        &mut self.children
    }

    /// Returns a child by its place among all children.
    pub(crate) fn child(&self, place: usize) -> &Child {
        &self.children[place]
    }

    /// Returns the places of the children of a treelet among all children.
    pub(crate) fn range(&self, treelet: TreeletIndex) -> Range<usize> {
        let treelet = treelet as usize;
        let start = if treelet == 0 { 0 } else { self.ends[treelet - 1] };
        start as usize..self.ends[treelet] as usize
    }

    /// Returns the children of a treelet.
    pub(crate) fn children(&self, treelet: TreeletIndex) -> &[Child] {
        &self.children[self.range(treelet)]
    }

    /// Returns the children of a treelet that are treelets.
    pub(crate) fn treelets_below(
        &self,
        treelet: TreeletIndex,
    ) -> impl DoubleEndedIterator<Item = TreeletIndex> {
        self.children(treelet).iter().filter_map(|child| match child.kind {
            ChildKind::Treelet(below) => Some(below),
            _ => None,
        })
    }

    /// Returns true if all children of a treelet are leaf packets.
    pub(crate) fn has_only_packets(&self, treelet: TreeletIndex) -> bool {
        self.children(treelet).iter().all(|child| matches!(child.kind, ChildKind::Leaf(_)))
    }

    /// Returns the first `slabs` slabs of the k-DOP of all children of a treelet.
    pub(crate) fn kdop(&self, treelet: TreeletIndex, slabs: usize) -> Kdop {
        let mut kdop = Kdop::EMPTY;
        self.children(treelet).iter().for_each(|child| kdop.join(&child.bound.kdop, slabs));
        kdop
    }

    /// Fits the k-DOPs of the children that are treelets, once all other children have theirs.
    pub(crate) fn join_kdops(&mut self, slabs: usize) {
        // Goes from the last treelet to the first, so that everything below a child has its k-DOPs.
        for treelet in (0..self.len() as u32).rev() {
            for place in self.range(treelet) {
                if let ChildKind::Treelet(below) = self.children[place].kind {
                    self.children[place].bound.kdop = self.kdop(below, slabs);
                }
            }
        }
    }

    /// Copies the treelets that are not `taken`, and the treelets directly below them without their children. Calls
    /// `moved` with the number of each of the latter here and in the copy. Appends the numbers of the copy's triangles to
    /// `numbers`; packets of the copy hold the positions there.
    pub(crate) fn rest(
        &self,
        taken: &[bool],
        numbers: &mut Vec<u32>,
        mut moved: impl FnMut(TreeletIndex, TreeletIndex),
    ) -> Self {
        let mut rest = Self::empty();
        // Each entry is a treelet and the place of the child that it is.
        let mut stack = vec![(0, None)];
        while let Some((from, place)) = stack.pop() {
            let is_taken = taken[from as usize];
            let children = if is_taken { &[] } else { self.children(from) };
            let (index, first) = rest.add(children.iter().copied());
            if let Some(place) = place {
                let place: usize = place;
                rest.children[place].kind = ChildKind::Treelet(index);
            }
            if is_taken {
                moved(from, index);
                continue;
            }
            for child in &mut rest.children[first..] {
                if let ChildKind::Leaf(packet) = &mut child.kind {
                    let first = numbers.len() as u32;
                    numbers.extend_from_slice(packet.numbers());
                    *packet = PacketTriangles::new(first..numbers.len() as u32);
                }
            }
            stack.extend(children.iter().enumerate().rev().filter_map(|(number, child)| match child.kind {
                ChildKind::Treelet(below) => Some((below, Some(first + number))),
                _ => None,
            }));
        }
        rest
    }

    /// Adds `first` to the numbers of the triangles.
    pub(crate) fn renumber_triangles(&mut self, first: u32) {
        for child in &mut self.children {
            if let ChildKind::Leaf(packet) = &mut child.kind {
                *packet = PacketTriangles::new(packet.numbers().iter().map(|number| number + first));
            }
        }
    }

    /// Appends bricks to the tree above them and links them. Returns the treelets of each brick; the first is its root.
    pub(crate) fn join(mut top: Self, bricks: Vec<Self>) -> (Self, Vec<Range<usize>>) {
        let above = top.children.len();
        let mut ranges = Vec::with_capacity(bricks.len());
        for brick in bricks {
            let (first, first_child) = (top.len(), top.children.len() as u32);
            top.ends.extend(brick.ends.iter().map(|end| end + first_child));
            top.children.extend(brick.children.into_iter().map(|mut child| {
                if let ChildKind::Treelet(below) = &mut child.kind {
                    *below += first as u32;
                }
                child
            }));
            ranges.push(first..top.len());
        }
        for child in &mut top.children[..above] {
            if let ChildKind::Brick(brick) = child.kind {
                child.kind = ChildKind::Treelet(ranges[brick as usize].start as u32);
            }
        }
        (top, ranges)
    }
}
