//! Splits a brick top-down by planes between bins, down to a few dozen triangles or less.

use super::boxes::{Aabb, Binning, Cost, Reference};
use super::swept;
use super::{Builder, Node, PACKET, PacketTriangles};
use crate::ablation::SplitRule;

const BINS: usize = 16;
/// Below this, threads cost more than they bring.
const PARALLEL: usize = 8192;
/// Beyond this depth only medians are taken, which bounds the depth of any tree.
const MAX_COSTED_DEPTH: usize = 64;

impl Builder {
    /// The tree of a brick. `scratch` is as long as `references`; its contents do not matter.
    pub(super) fn brick(
        &self,
        references: &mut [Reference],
        scratch: &mut [Reference],
    ) -> Node<PacketTriangles> {
        let mut centres = Aabb::EMPTY;
        references.iter().for_each(|reference| centres.join(&Aabb::of_point(reference.aabb().centre())));
        self.node(references, scratch, &centres, 0)
    }

    /// `centres` is the box of the references' centres.
    fn node(
        &self,
        references: &mut [Reference],
        scratch: &mut [Reference],
        centres: &Aabb,
        depth: usize,
    ) -> Node<PacketTriangles> {
        let count = references.len();
        if count <= self.sweep {
            return swept::tree(self, references);
        }
        let Split { middle, bounds, centres } = self.split(references, scratch, centres, depth);
        let (left, right) = references.split_at_mut(middle);
        let (left_scratch, right_scratch) = scratch.split_at_mut(middle);
        let mut left = || self.node(left, left_scratch, &centres[0], depth + 1);
        let mut right = || self.node(right, right_scratch, &centres[1], depth + 1);
        let (left, right) = if count > PARALLEL { rayon::join(left, right) } else { (left(), right()) };
        Node::above(left, right, bounds.squared_girth())
    }

    /// Orders the references so that the two sides stand apart.
    fn split(
        &self,
        references: &mut [Reference],
        scratch: &mut [Reference],
        centres: &Aabb,
        depth: usize,
    ) -> Split {
        let binning = Binning::<BINS>::new(centres);
        let bins = fill_bins(references, &binning);
        let mut bounds = Aabb::EMPTY;
        bins[0].iter().for_each(|(_, bin)| bounds.join(bin));
        let mut best: Option<(f32, usize, usize)> = None;
        if depth < MAX_COSTED_DEPTH && self.splits != SplitRule::Median {
            let cost = Cost::within(&bounds, self.splits);
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
        // All centres are nearly equal, or the tree is deep: halves, in whole treelets.
        let axis = centres.longest();
        let centre = |reference: &Reference| reference.aabb().centre();
        references.sort_unstable_by(|a, b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.triangle.cmp(&b.triangle))
        });
        let middle = (references.len() / 2).next_multiple_of(self.treelet);
        let centres = [&references[..middle], &references[middle..]].map(|side| {
            let mut centres = Aabb::EMPTY;
            side.iter().for_each(|reference| centres.join(&Aabb::of_point(centre(reference))));
            centres
        });
        Split { middle, bounds, centres }
    }

    /// The cost and number of the best of the planes before each bin but the first; `None` if all put everything
    /// on one side.
    pub(super) fn best_of<const N: usize>(bins: &[(usize, Aabb); N], cost: Cost) -> Option<(f32, usize)> {
        let mut right_cost = [0.0; N];
        let (mut bounds, mut right) = (Aabb::EMPTY, 0);
        for plane in (1..N).rev() {
            right += bins[plane].0;
            bounds.join(&bins[plane].1);
            right_cost[plane] = if right > 0 { cost.of(&bounds, weight(right)) } else { f32::INFINITY };
        }
        let mut best: Option<(f32, usize)> = None;
        let (mut bounds, mut left) = (Aabb::EMPTY, 0);
        for plane in 1..N {
            left += bins[plane - 1].0;
            bounds.join(&bins[plane - 1].1);
            if left == 0 || right_cost[plane] == f32::INFINITY {
                continue;
            }
            let cost = cost.of(&bounds, weight(left)) + right_cost[plane];
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, plane));
            }
        }
        best
    }
}

/// The weight of `count` triangles: whole packets. That fills packets; without it a fifth of their places stay
/// empty.
#[inline(always)]
pub(super) fn weight(count: usize) -> f32 {
    count.next_multiple_of(PACKET) as f32
}

struct Split {
    /// Length of the first side.
    middle: usize,
    /// The box of both sides.
    bounds: Aabb,
    /// The boxes of the sides' centres.
    centres: [Aabb; 2],
}

fn fill_bins(references: &[Reference], binning: &Binning<BINS>) -> [[(usize, Aabb); BINS]; 3] {
    let mut bins = [[(0, Aabb::EMPTY); BINS]; 3];
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

/// Both sides keep their order. Returns the length of the first side and the boxes of the sides' centres.
fn partition(
    references: &mut [Reference],
    scratch: &mut [Reference],
    is_left: impl Fn([f32; 4]) -> bool,
) -> (usize, [Aabb; 2]) {
    let mut ends = [0; 2];
    let mut centres = [Aabb::EMPTY; 2];
    for index in 0..references.len() {
        let reference = references[index];
        let centre = reference.aabb().centre();
        let side = usize::from(!is_left(centre));
        // Written to both, counted on one: no branch to mispredict.
        references[ends[0]] = reference;
        scratch[ends[1]] = reference;
        ends[side] += 1;
        centres[side].join(&Aabb::of_point(centre));
    }
    references[ends[0]..].copy_from_slice(&scratch[..ends[1]]);
    (ends[0], centres)
}
