//! Splits a brick top-down by planes between bins until each part has at most a few dozen triangles.

use super::binary::{Content, NONE, NodeIndex, Tree};
use super::boxes::{Aabb, Binning, Cost, Reference};
use super::swept;
use super::{Builder, PacketTriangles};
use wide::f32x4;

/// The number of bins along each axis of a node's box.
const BINS_PER_AXIS: usize = 16;
/// A node of more triangles is split by several threads. With fewer, threads cost more time than they save.
pub(super) const MAX_SEQUENTIAL_TRIANGLES: usize = 8192;
/// The number of levels below which only medians are used, which bounds the depth of any tree.
const MAX_COSTED_DEPTH: usize = 64;

impl Builder {
    /// Builds the tree of a brick. `scratch` is as long as `references`, and its contents do not matter.
    pub(super) fn brick(
        &self,
        references: &mut [Reference],
        scratch: &mut [Reference],
    ) -> Tree<PacketTriangles> {
        let mut centres = Aabb::EMPTY;
        references.iter().for_each(|reference| centres.join(&Aabb::of_point(reference.aabb().centre())));
        let mut tree = Tree::with_capacity(expected_nodes(references.len()));
        self.node(&mut tree, references, scratch, &centres, 0);
        tree
    }

    /// Adds the subtree of some references to `tree` and returns the index of its root. `centres` is the box of the
    /// references' centres.
    fn node(
        &self,
        tree: &mut Tree<PacketTriangles>,
        references: &mut [Reference],
        scratch: &mut [Reference],
        centres: &Aabb,
        depth: usize,
    ) -> NodeIndex {
        let count = references.len();
        if count <= self.sweep {
            return swept::add(self, tree, references);
        }
        let Split { middle, bounds, centres } = self.split(references, scratch, centres, depth);
        let (left, right) = references.split_at_mut(middle);
        let (left_scratch, right_scratch) = scratch.split_at_mut(middle);
        let index = tree.add(bounds, Content::Inner([NONE; 2]));
        let many = (count > MAX_SEQUENTIAL_TRIANGLES).then(|| expected_nodes(count - middle));
        let children = tree.add_both(
            many,
            |tree| self.node(tree, left, left_scratch, &centres[0], depth + 1),
            |tree| self.node(tree, right, right_scratch, &centres[1], depth + 1),
        );
        tree.link(index, children);
        index
    }

    /// Orders the references so that those of the first side come before those of the second.
    fn split(
        &self,
        references: &mut [Reference],
        scratch: &mut [Reference],
        centres: &Aabb,
        depth: usize,
    ) -> Split {
        let binning = Binning::<BINS_PER_AXIS>::new(centres);
        let bins = fill_bins(references, &binning);
        let mut bounds = Aabb::EMPTY;
        bins[0].iter().for_each(|(_, bin)| bounds.join(bin));
        let mut best: Option<(f32, usize, usize)> = None;
        if depth < MAX_COSTED_DEPTH {
            let cost = Cost::within(&bounds, self.treelet);
            for axis in 0..3 {
                if let Some((cost, plane)) = Self::best_of(&bins[axis], cost)
                    && best.is_none_or(|(least, ..)| cost < least)
                {
                    best = Some((cost, axis, plane));
                }
            }
        }
        if let Some((_, axis, plane)) = best {
            let is_left = |centre| binning.bins(centre)[axis] < plane;
            let (middle, centres) = partition(references, scratch, is_left);
            return Split { middle, bounds, centres };
        }
        // All centres are nearly equal, or the tree is deep: split into halves of whole treelets.
        let axis = centres.longest();
        let centre = |reference: &Reference| reference.aabb().centre().to_array();
        references.sort_unstable_by(|a, b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.triangle().cmp(&b.triangle()))
        });
        let middle = (references.len() / 2).next_multiple_of(self.treelet);
        let centres = [&references[..middle], &references[middle..]].map(|side| {
            let mut centres = Aabb::EMPTY;
            side.iter().for_each(|reference| centres.join(&Aabb::of_point(reference.aabb().centre())));
            centres
        });
        Split { middle, bounds, centres }
    }

    /// Returns the cost and the number of the best plane, or `None` if every plane leaves all triangles on one side.
    /// There is a plane before each bin but the first.
    pub(super) fn best_of<const N: usize>(bins: &[(usize, Aabb); N], cost: Cost) -> Option<(f32, usize)> {
        let mut right_cost = [0.0; N];
        let (mut bounds, mut right) = (Aabb::EMPTY, 0);
        for plane in (1..N).rev() {
            right += bins[plane].0;
            bounds.join(&bins[plane].1);
            right_cost[plane] = if right > 0 { cost.of(&bounds, right) } else { f32::INFINITY };
        }
        let mut best: Option<(f32, usize)> = None;
        let (mut bounds, mut left) = (Aabb::EMPTY, 0);
        for plane in 1..N {
            left += bins[plane - 1].0;
            bounds.join(&bins[plane - 1].1);
            if left == 0 || right_cost[plane] == f32::INFINITY {
                continue;
            }
            let cost = cost.of(&bounds, left) + right_cost[plane];
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, plane));
            }
        }
        best
    }
}

/// Estimates the nodes of a tree of `triangles` triangles. Packets hold more than three triangles on average.
pub(super) fn expected_nodes(triangles: usize) -> usize {
    triangles * 5 / 8 + 1
}

struct Split {
    /// The length of the first side.
    middle: usize,
    /// The box of both sides.
    bounds: Aabb,
    /// The boxes of the centres of each side.
    centres: [Aabb; 2],
}

/// By axis and bin, the number of triangles whose centre is in the bin, and their box.
type Bins = [[(usize, Aabb); BINS_PER_AXIS]; 3];

fn fill_bins(references: &[Reference], binning: &Binning<BINS_PER_AXIS>) -> Bins {
    let mut bins = [[(0, Aabb::EMPTY); BINS_PER_AXIS]; 3];
    for reference in references {
        let bounds = reference.aabb();
        let at = binning.bins(bounds.centre());
        for axis in 0..3 {
            let (count, bin) = &mut bins[axis][at[axis]];
            *count += 1;
            bin.join(&bounds);
        }
    }
    bins
}

/// Moves one side to the front; both sides keep their order. Returns the length of the first side and the boxes of
/// the centres of each side.
pub(super) fn partition(
    references: &mut [Reference],
    scratch: &mut [Reference],
    is_left: impl Fn(f32x4) -> bool,
) -> (usize, [Aabb; 2]) {
    let mut ends = [0; 2];
    let mut centres = [Aabb::EMPTY; 2];
    for index in 0..references.len() {
        let reference = references[index];
        let centre = reference.aabb().centre();
        let side = usize::from(!is_left(centre));
        // The reference is written to both sides and counted on one, so that there is no branch to mispredict.
        references[ends[0]] = reference;
        scratch[ends[1]] = reference;
        ends[side] += 1;
        // Both boxes stay in registers: the one that the centre is not in is joined with an empty box.
        let is_right = f32x4::splat(f32::from_bits((side as u32).wrapping_neg()));
        centres[0].join(&Aabb::of_point(centre).unless(is_right));
        centres[1].join(&Aabb::of_point(centre).unless(!is_right));
    }
    references[ends[0]..].copy_from_slice(&scratch[..ends[1]]);
    (ends[0], centres)
}
