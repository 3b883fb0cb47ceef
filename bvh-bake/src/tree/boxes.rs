//! Boxes of triangles in eight lanes, which compilers join with two vector instructions, and the cost of splitting
//! them.

use crate::triangles::Corners;
use bytemuck::{Pod, Zeroable};

/// A box. It holds the lower ends of three axes and the negated upper ends, each with a spare lane, so that two boxes
/// are joined by taking the lesser of all lanes.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Aabb([f32; 8]);

impl Aabb {
    pub(crate) const EMPTY: Self = Self([f32::INFINITY; 8]);

    pub(crate) fn of_point(point: [f32; 4]) -> Self {
        let [x, y, z, w] = point;
        Self([x, y, z, w, -x, -y, -z, -w])
    }

    /// Returns the box of a triangle.
    #[inline(always)]
    pub(crate) fn of_triangle(corners: &Corners) -> Self {
        Reference::new(0, corners).aabb()
    }

    #[inline(always)]
    pub(crate) fn join(&mut self, other: &Self) {
        for lane in 0..8 {
            // This is `min` without its handling of NaN, which does not occur here.
            let (mine, its) = (self.0[lane], other.0[lane]);
            self.0[lane] = if its < mine { its } else { mine };
        }
    }

    pub(crate) fn lo(&self, axis: usize) -> f32 {
        self.0[axis]
    }

    pub(crate) fn hi(&self, axis: usize) -> f32 {
        // Files store positive zeros only.
        0.0 - self.0[axis + 4]
    }

    /// Returns the extent along an axis. It does not overflow for coordinates of at most 2^120, nor for twice as
    /// large ones.
    #[inline(always)]
    pub(super) fn extent(&self, axis: usize) -> f32 {
        -(self.0[axis] + self.0[axis + 4])
    }

    /// Returns twice the centre, and a spare lane.
    #[inline(always)]
    pub(crate) fn centre(&self) -> [f32; 4] {
        std::array::from_fn(|axis| self.0[axis] - self.0[axis + 4])
    }

    /// Returns the axis of the largest extent, and the first of several that are equal.
    pub(super) fn longest(&self) -> usize {
        (1..3).fold(0, |best, axis| if self.extent(axis) > self.extent(best) { axis } else { best })
    }

    /// Returns the sum of the extents, which is at most 3 * 2^121.
    #[inline(always)]
    pub(super) fn girth(&self) -> f32 {
        self.extent(0) + self.extent(1) + self.extent(2)
    }

    /// Returns the square of the sum of the extents, an estimate of how likely a traversal is to visit the box. See
    /// `Cost`.
    #[inline(always)]
    pub(super) fn squared_girth(&self) -> f64 {
        f64::from(self.girth()).powi(2)
    }
}

/// The box of a triangle and the triangle's number.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C, align(32))]
pub(super) struct Reference {
    lo: [f32; 3],
    pub(super) triangle: u32,
    negated_hi: [f32; 3],
    spare: u32,
}

impl Reference {
    #[inline(always)]
    pub(super) fn new(triangle: u32, corners: &Corners) -> Self {
        let end = |lesser: fn(f32, f32) -> f32, axis: usize| {
            lesser(lesser(corners[0][axis], corners[1][axis]), corners[2][axis])
        };
        let lo = [0, 1, 2].map(|axis| end(f32::min, axis));
        let negated_hi = [0, 1, 2].map(|axis| -end(f32::max, axis));
        Self { lo, triangle, negated_hi, spare: 0 }
    }

    #[inline(always)]
    pub(super) fn aabb(&self) -> Aabb {
        // Masking takes one load and one instruction, less than putting the box together from six numbers.
        let lanes: &[u32; 8] = bytemuck::cast_ref(self);
        /// Bit masks of the lanes: all bits for an end of the box, none for another number.
        const AXES: [u32; 8] = [!0, !0, !0, 0, !0, !0, !0, 0];
        Aabb(std::array::from_fn(|lane| f32::from_bits(lanes[lane] & AXES[lane])))
    }
}

/// Sorts centres into bins along each axis. The first and the last bin are half as wide as the others.
#[derive(Clone, Copy)]
pub(super) struct Binning<const BINS: usize> {
    from: [f32; 4],
    scale: [f32; 4],
}

impl<const BINS: usize> Binning<BINS> {
    /// Makes bins for centres within the given box.
    pub(super) fn new(centres: &Aabb) -> Self {
        let scale = |axis: usize| {
            let extent = centres.extent(axis);
            if axis < 3 && extent > 0.0 { (BINS - 1) as f32 / extent } else { 0.0 }
        };
        let from = std::array::from_fn(|axis| if axis < 3 { centres.lo(axis) } else { 0.0 });
        Self { from, scale: std::array::from_fn(scale) }
    }

    /// Returns the bins of a centre, each less than `BINS`, which is a power of two.
    #[inline(always)]
    pub(super) fn bins(&self, centre: [f32; 4]) -> [usize; 4] {
        // Adding 2^23 leaves the nearest whole number in the last bits. A scale that overflowed, as it does for tiny
        // extents, puts all centres into one bin.
        std::array::from_fn(|axis| {
            let bin = (centre[axis] - self.from[axis]) * self.scale[axis] + 8388608.0;
            bin.to_bits() as usize & (BINS - 1)
        })
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
}

impl Cost {
    pub(super) fn within(parent: &Aabb) -> Self {
        let largest = parent.extent(parent.longest());
        Self { scale: (1.0 / largest).min(f32::MAX) }
    }

    #[inline(always)]
    pub(super) fn of(self, bounds: &Aabb, weight: f32) -> f32 {
        let girth = bounds.girth() * self.scale + 1.0;
        weight * (girth * girth)
    }
}
