//! Boxes of triangles in two registers of four lanes, and the cost of splitting them.

use crate::triangles::Corners;
use bvh_format::leaf::PACKET;
use wide::f32x4;

/// The share of whole treelets in the weight of triangles; whole packets have the rest. At this share treelets are full
/// enough, and queries make no more tests than at 0.
const TREELET_SHARE: f32 = 0.4;

/// A box: the lower ends along three axes and the negated upper ends, each with a lane to spare, so that two boxes are
/// joined by taking the lesser of all lanes. The spare lanes mean nothing.
#[derive(Clone, Copy)]
pub(crate) struct Aabb {
    lo: f32x4,
    negated_hi: f32x4,
}

impl Aabb {
    pub(crate) const EMPTY: Self =
        Self { lo: f32x4::new([f32::INFINITY; 4]), negated_hi: f32x4::new([f32::INFINITY; 4]) };

    #[inline(always)]
    pub(crate) fn of_point(point: f32x4) -> Self {
        Self { lo: point, negated_hi: -point }
    }

    /// Returns the box of a triangle.
    #[inline(always)]
    pub(crate) fn of_triangle(corners: &Corners) -> Self {
        Reference::new(0, corners).aabb()
    }

    #[inline(always)]
    pub(crate) fn join(&mut self, other: &Self) {
        // This is `min` without its handling of NaN, which does not occur here. Of equal ends the box keeps its own.
        self.lo = other.lo.fast_min(self.lo);
        self.negated_hi = other.negated_hi.fast_min(self.negated_hi);
    }

    /// Returns the box, or an empty one if all bits of the condition are set.
    #[inline(always)]
    pub(super) fn unless(&self, condition: f32x4) -> Self {
        let chosen = |own: f32x4| condition.bitselect(f32x4::splat(f32::INFINITY), own);
        Self { lo: chosen(self.lo), negated_hi: chosen(self.negated_hi) }
    }

    #[inline(always)]
    pub(crate) fn lo(&self, axis: usize) -> f32 {
        self.lo.as_array()[axis]
    }

    #[inline(always)]
    pub(crate) fn hi(&self, axis: usize) -> f32 {
        // Files store positive zeros only.
        0.0 - self.negated_hi.as_array()[axis]
    }

    /// Returns the extent along an axis. It does not overflow for coordinates of at most 2^120, nor for twice as
    /// large ones.
    #[inline(always)]
    pub(super) fn extent(&self, axis: usize) -> f32 {
        self.extents().as_array()[axis]
    }

    #[inline(always)]
    fn extents(&self) -> f32x4 {
        -(self.lo + self.negated_hi)
    }

    /// Returns twice the centre. The spare lane of a triangle's box is 0.
    #[inline(always)]
    pub(crate) fn centre(&self) -> f32x4 {
        self.lo - self.negated_hi
    }

    /// Returns the axis of the largest extent, and the first of several that are equal.
    pub(super) fn longest(&self) -> usize {
        (1..3).fold(0, |best, axis| if self.extent(axis) > self.extent(best) { axis } else { best })
    }

    /// Returns the sum of the extents, which is at most 3 * 2^121.
    #[inline(always)]
    pub(super) fn girth(&self) -> f32 {
        let [x, y, z, _] = self.extents().to_array();
        x + y + z
    }

    /// Returns the square of the sum of the extents, an estimate of how likely a traversal is to visit the box. See
    /// `Cost`.
    #[inline(always)]
    pub(super) fn squared_girth(&self) -> f64 {
        f64::from(self.girth()).powi(2)
    }
}

/// The box of a triangle and the triangle's number, which stands in both spare lanes of the box: taking lesser lanes
/// costs the same whatever they hold, and their difference is 0.
#[derive(Clone, Copy)]
pub(super) struct Reference(Aabb);

impl Reference {
    /// A reference that does not matter.
    pub(super) const NONE: Self = Self(Aabb::EMPTY);

    #[inline(always)]
    pub(super) fn new(triangle: u32, corners: &Corners) -> Self {
        let lesser = |ends: [f32x4; 3]| ends[2].fast_min(ends[1].fast_min(ends[0]));
        let number = f32::from_bits(triangle);
        let lanes = corners.map(|[x, y, z]| f32x4::new([x, y, z, number]));
        let negated = corners.map(|[x, y, z]| f32x4::new([-x, -y, -z, number]));
        Self(Aabb { lo: lesser(lanes), negated_hi: lesser(negated) })
    }

    /// Makes a reference to something with a box.
    pub(super) fn of_box(number: u32, bounds: &Aabb) -> Self {
        let with_number = |ends: f32x4| {
            let [x, y, z, _] = ends.to_array();
            f32x4::new([x, y, z, f32::from_bits(number)])
        };
        Self(Aabb { lo: with_number(bounds.lo), negated_hi: with_number(bounds.negated_hi) })
    }

    #[inline(always)]
    pub(super) fn triangle(&self) -> u32 {
        self.0.lo.as_array()[3].to_bits()
    }

    #[inline(always)]
    pub(super) fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Sorts centres into bins along each axis. The first and the last bin are half as wide as the others.
#[derive(Clone, Copy)]
pub(super) struct Binning<const BINS: usize> {
    from: f32x4,
    scale: f32x4,
}

impl<const BINS: usize> Binning<BINS> {
    /// Makes bins for centres within the given box.
    pub(super) fn new(centres: &Aabb) -> Self {
        let scale = |axis: usize| {
            let extent = centres.extent(axis);
            if extent > 0.0 { (BINS - 1) as f32 / extent } else { 0.0 }
        };
        let axes = |value: &dyn Fn(usize) -> f32| f32x4::new([value(0), value(1), value(2), 0.0]);
        Self { from: axes(&|axis| centres.lo(axis)), scale: axes(&scale) }
    }

    /// Makes bins that are as wide along all axes.
    pub(super) fn of_cubes(centres: &Aabb) -> Self {
        let extent = centres.extent(centres.longest());
        let scale = if extent > 0.0 { (BINS - 1) as f32 / extent } else { 0.0 };
        Self { scale: f32x4::new([scale, scale, scale, 0.0]), ..Self::new(centres) }
    }

    /// Returns the bins of a centre, each less than `BINS`, which is a power of two.
    #[inline(always)]
    pub(super) fn bins(&self, centre: f32x4) -> [usize; 3] {
        // Adding 2^23 leaves the nearest whole number in the last bits. A scale that overflowed, as it does for tiny
        // extents, puts all centres into one bin.
        let [x, y, z, _] = ((centre - self.from) * self.scale + f32x4::splat(8388608.0)).to_array();
        [x, y, z].map(|bin| bin.to_bits() as usize & (BINS - 1))
    }
}

/// Estimates the cost of one side of a split: its weight, times the square of the sum of its extents and of the
/// parent's largest extent.
///
/// A pair traversal visits the side if its bounds overlap those of a partner of about the parent's size. For convex
/// shapes that are patches of surfaces, averaged over all orientations, the probability is proportional to the
/// surface of their Minkowski sum, and the widths of such a sum are the sums of the widths. Products of extents, such
/// as surface and volume, underestimate flat boxes, which reach as far as others once they are rotated in space.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    /// One over the parent's largest extent. Scaled sums are then from 1 to 4, for which `f32` is wide enough.
    scale: f32,
    /// The triangles in a full treelet of leaves, a power of two.
    treelet: usize,
}

impl Cost {
    pub(super) fn within(parent: &Aabb, treelet: usize) -> Self {
        let largest = parent.extent(parent.longest());
        Self { scale: (1.0 / largest).min(f32::MAX), treelet }
    }

    #[inline(always)]
    pub(super) fn of(self, bounds: &Aabb, triangles: usize) -> f32 {
        self.of_girth(bounds.girth(), triangles)
    }

    /// Returns the cost of a side whose extents add up to `girth`.
    #[inline(always)]
    pub(super) fn of_girth(self, girth: f32, triangles: usize) -> f32 {
        let girth = girth * self.scale + 1.0;
        self.weight(triangles) * (girth * girth)
    }

    /// Returns the weight of `count` triangles, which counts whole packets and whole treelets of leaves. Either fills
    /// what it counts; otherwise a fifth of the places there stay empty.
    #[inline(always)]
    fn weight(self, count: usize) -> f32 {
        let whole = |unit: usize| ((count + unit - 1) & !(unit - 1)) as f32;
        (1.0 - TREELET_SHARE) * whole(PACKET) + TREELET_SHARE * whole(self.treelet)
    }
}
