//! Builds a binary tree over triangle boxes, top-down, the same for any number of threads.
//!
//! Down to a few dozen triangles, splits are found with bins; below, all positions along all three
//! axes are tried. The cost of a side is its number of triangles, rounded up to whole packets and
//! treelets, times the product over the axes of its extent plus half of the parent's largest extent:
//! the volume in which the centre of a box of the parent's size, the likely partner in a pair
//! traversal, would overlap it. Rounding the counts fills packets and treelets: without it a third
//! of the children's places stay empty.
//!
//! Nothing here depends on the order in which threads come by: bins are merged by minima, maxima and
//! sums of integers, partitions are stable, and ties go to the lower axis and position.

use crate::prepare::Corners;
use bvh_format::leaf::to_ordered;
use rayon::prelude::*;

/// Triangles in a leaf packet.
const PACKET: usize = bvh_format::leaf::PACKET;
/// Nodes of at most this many triangles try every split.
const SWEEP: usize = 64;
const BINS: usize = 16;
/// Below this, threads cost more than they bring.
const PARALLEL: usize = 8192;
/// Beyond this depth only medians are taken, which bounds the depth of any tree at 96.
const MAX_COSTED_DEPTH: usize = 64;

/// A triangle's box and number.
#[derive(Clone, Copy)]
struct Reference {
    lo: [f32; 3],
    hi: [f32; 3],
    triangle: u32,
}

impl Reference {
    /// Twice the centre of the box, along an axis; coordinates of at most 2^120 do not overflow.
    #[inline]
    fn centre(&self, axis: usize) -> f32 {
        self.lo[axis] + self.hi[axis]
    }
}

#[derive(Clone, Copy)]
struct Aabb {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Aabb {
    const EMPTY: Self = Self { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    #[inline(always)]
    fn join(&mut self, lo: &[f32; 3], hi: &[f32; 3]) {
        for axis in 0..3 {
            self.lo[axis] = lesser(self.lo[axis], lo[axis]);
            self.hi[axis] = greater(self.hi[axis], hi[axis]);
        }
    }

    fn extents(&self) -> [f64; 3] {
        [0, 1, 2].map(|a| f64::from(self.hi[a]) - f64::from(self.lo[a]))
    }
}

/// `min` without its care for NaN, which there is none of here: one instruction instead of three.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `max` likewise.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A binary tree over the triangles.
pub(crate) enum Node {
    /// At most a packet of triangles, by number.
    Leaf(Vec<u32>),
    /// Two subtrees.
    Inner(Box<Inner>),
}

pub(crate) struct Inner {
    pub(crate) left: Node,
    pub(crate) right: Node,
    /// Leaf packets below.
    pub(crate) packets: usize,
    /// The split cost's measure of the node's size.
    pub(crate) size: f64,
}

impl Node {
    /// Leaf packets below, 1 for a leaf.
    pub(crate) fn packets(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Inner(inner) => inner.packets,
        }
    }

    /// How likely a traversal is to come by, in units that only compare.
    pub(crate) fn size(&self) -> f64 {
        match self {
            Self::Leaf(_) => 0.0,
            Self::Inner(inner) => inner.size,
        }
    }
}

/// Builds the tree for treelets of `width` children.
pub(crate) fn build(triangles: &[Corners], width: usize) -> Node {
    let mut references: Vec<Reference> = triangles
        .par_iter()
        .enumerate()
        .map(|(index, corners)| {
            let mut bounds = Aabb::EMPTY;
            corners.iter().for_each(|corner| bounds.join(corner, corner));
            Reference { lo: bounds.lo, hi: bounds.hi, triangle: index as u32 }
        })
        .collect();
    let mut scratch = references.clone();
    Builder { treelet: PACKET * width }.node(&mut references, &mut scratch, 0)
}

struct Builder {
    /// Triangles in a full treelet of leaves.
    treelet: usize,
}

impl Builder {
    /// `scratch` is as long as `references`; its contents do not matter.
    fn node(&self, references: &mut [Reference], scratch: &mut [Reference], depth: usize) -> Node {
        let count = references.len();
        if count <= PACKET {
            return Node::Leaf(references.iter().map(|r| r.triangle).collect());
        }
        let (bounds, centres) = bounds_of(references);
        let split = self.split(references, scratch, &bounds, &centres, depth);
        let (left, right) = references.split_at_mut(split);
        let (left_scratch, right_scratch) = scratch.split_at_mut(split);
        let (left, right) = if count > PARALLEL {
            rayon::join(
                || self.node(left, left_scratch, depth + 1),
                || self.node(right, right_scratch, depth + 1),
            )
        } else {
            (self.node(left, left_scratch, depth + 1), self.node(right, right_scratch, depth + 1))
        };
        let packets = left.packets() + right.packets();
        let size = side_size(&bounds, 0.0);
        Node::Inner(Box::new(Inner { left, right, packets, size }))
    }

    /// Orders the references so that the two sides stand apart; returns the length of the first.
    fn split(
        &self,
        references: &mut [Reference],
        scratch: &mut [Reference],
        bounds: &Aabb,
        centres: &[[f32; 2]; 3],
        depth: usize,
    ) -> usize {
        let count = references.len();
        let spread = centres.iter().any(|[lo, hi]| lo < hi);
        let costed = spread && depth < MAX_COSTED_DEPTH;
        let margin = bounds.extents().into_iter().fold(0.0, f64::max) / 2.0;
        if costed
            && count > SWEEP
            && let Some(split) = self.binned(references, scratch, centres, margin)
        {
            return split;
        }
        if costed && count <= SWEEP {
            return self.swept(references, margin);
        }
        // All centres equal, or the tree is deep: halves, in whole treelets.
        let axis = longest(centres);
        references.sort_unstable_by(|a, b| {
            a.centre(axis).total_cmp(&b.centre(axis)).then(a.triangle.cmp(&b.triangle))
        });
        let unit = if count > self.treelet { self.treelet } else { PACKET };
        ((count / 2).next_multiple_of(unit)).clamp(1, count - 1)
    }

    /// The weight of `count` triangles: whole packets, and whole treelets beyond one.
    fn weight(&self, count: usize) -> f64 {
        let unit = if count > self.treelet / 2 { self.treelet } else { PACKET };
        count.next_multiple_of(unit) as f64
    }

    /// The best of 15 planes along each axis; `None` if all put everything on one side.
    fn binned(
        &self,
        references: &mut [Reference],
        scratch: &mut [Reference],
        centres: &[[f32; 2]; 3],
        margin: f64,
    ) -> Option<usize> {
        let scale = centres.map(|[lo, hi]| if hi > lo { BINS as f32 / (hi - lo) } else { 0.0 });
        let bin = |reference: &Reference, axis: usize| {
            (((reference.centre(axis) - centres[axis][0]) * scale[axis]) as usize).min(BINS - 1)
        };
        let bins = fill_bins(references, &bin);
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in (0..3).filter(|&axis| scale[axis] > 0.0) {
            let mut right_cost = [0.0; BINS];
            let (mut bounds, mut count) = (Aabb::EMPTY, 0);
            for plane in (1..BINS).rev() {
                let (more, box_) = &bins[axis][plane];
                count += more;
                bounds.join(&box_.lo, &box_.hi);
                right_cost[plane] = self.weight(count) * side_size(&bounds, margin);
            }
            let (mut bounds, mut left) = (Aabb::EMPTY, 0);
            for plane in 1..BINS {
                let (more, box_) = &bins[axis][plane - 1];
                left += more;
                bounds.join(&box_.lo, &box_.hi);
                if left == 0 || left == references.len() {
                    continue;
                }
                let cost = self.weight(left) * side_size(&bounds, margin) + right_cost[plane];
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, plane));
                }
            }
        }
        let (_, axis, plane) = best?;
        Some(partition(references, scratch, |reference| bin(reference, axis) < plane))
    }

    /// The best of all positions along all axes.
    fn swept(&self, references: &mut [Reference], margin: f64) -> usize {
        let count = references.len();
        let mut best: Option<(f64, usize, usize)> = None;
        let mut orders = [[0u8; SWEEP]; 3];
        for axis in 0..3 {
            // The place in the list below the centre: ties keep their order.
            let mut keys = [0u64; SWEEP];
            for (place, reference) in references.iter().enumerate() {
                let centre = to_ordered(reference.centre(axis)) as u32 ^ 1 << 31;
                keys[place] = u64::from(centre) << 32 | place as u64;
            }
            keys[..count].sort_unstable();
            let order = &mut orders[axis][..count];
            (0..count).for_each(|i| order[i] = keys[i] as u8);
            let mut right_cost = [0.0; SWEEP];
            let mut bounds = Aabb::EMPTY;
            for position in (1..count).rev() {
                let reference = &references[usize::from(order[position])];
                bounds.join(&reference.lo, &reference.hi);
                right_cost[position] = self.weight(count - position) * side_size(&bounds, margin);
            }
            let mut bounds = Aabb::EMPTY;
            for position in 1..count {
                let reference = &references[usize::from(order[position - 1])];
                bounds.join(&reference.lo, &reference.hi);
                // Below a treelet of leaves no packet more than needed is opened.
                let packets = position.div_ceil(PACKET) + (count - position).div_ceil(PACKET);
                if count <= self.treelet && packets > count.div_ceil(PACKET) {
                    continue;
                }
                let cost = self.weight(position) * side_size(&bounds, margin) + right_cost[position];
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, position));
                }
            }
        }
        // A position at a multiple of the packet is always allowed, so there is a best one.
        let (_, axis, split) = best.unwrap_or((0.0, 0, PACKET));
        let mut sorted = [references[0]; SWEEP];
        (0..count).for_each(|i| sorted[i] = references[usize::from(orders[axis][i])]);
        references.copy_from_slice(&sorted[..count]);
        split
    }
}

/// The volume of the box grown by `margin` on each axis.
fn side_size(bounds: &Aabb, margin: f64) -> f64 {
    let [x, y, z] = bounds.extents();
    if margin > 0.0 { (x + margin) * (y + margin) * (z + margin) } else { x * y + y * z + z * x }
}

fn longest(centres: &[[f32; 2]; 3]) -> usize {
    let extent = |axis: usize| centres[axis][1] - centres[axis][0];
    (1..3).fold(0, |best, axis| if extent(axis) > extent(best) { axis } else { best })
}

type Bounds = (Aabb, [[f32; 2]; 3]);

fn bounds_of(references: &[Reference]) -> Bounds {
    let empty = || (Aabb::EMPTY, [[f32::INFINITY, f32::NEG_INFINITY]; 3]);
    let add = |(mut bounds, mut centres): Bounds, reference: &Reference| {
        bounds.join(&reference.lo, &reference.hi);
        for axis in 0..3 {
            let centre = reference.centre(axis);
            centres[axis] = [lesser(centres[axis][0], centre), greater(centres[axis][1], centre)];
        }
        (bounds, centres)
    };
    if references.len() <= PARALLEL {
        return references.iter().fold(empty(), add);
    }
    references.par_chunks(PARALLEL).map(|chunk| chunk.iter().fold(empty(), add)).reduce(empty, |mut a, b| {
        a.0.join(&b.0.lo, &b.0.hi);
        for axis in 0..3 {
            a.1[axis] = [a.1[axis][0].min(b.1[axis][0]), a.1[axis][1].max(b.1[axis][1])];
        }
        a
    })
}

type Bins = [[(usize, Aabb); BINS]; 3];

fn fill_bins(references: &[Reference], bin: &(impl Fn(&Reference, usize) -> usize + Sync)) -> Bins {
    let empty = [[(0, Aabb::EMPTY); BINS]; 3];
    let fill = |chunk: &[Reference]| {
        let mut bins = empty;
        for reference in chunk {
            for axis in 0..3 {
                let (count, bounds) = &mut bins[axis][bin(reference, axis)];
                *count += 1;
                bounds.join(&reference.lo, &reference.hi);
            }
        }
        bins
    };
    if references.len() <= PARALLEL {
        return fill(references);
    }
    references.par_chunks(PARALLEL).map(fill).reduce(
        || empty,
        |mut a, b| {
            for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
                a.0 += b.0;
                a.1.join(&b.1.lo, &b.1.hi);
            }
            a
        },
    )
}

/// Stable: both sides keep their order. Returns the length of the first side.
fn partition(
    references: &mut [Reference],
    scratch: &mut [Reference],
    is_left: impl Fn(&Reference) -> bool,
) -> usize {
    let (mut left, mut right) = (0, 0);
    for index in 0..references.len() {
        let reference = references[index];
        if is_left(&reference) {
            references[left] = reference;
            left += 1;
        } else {
            scratch[right] = reference;
            right += 1;
        }
    }
    references[left..].copy_from_slice(&scratch[..right]);
    left
}
