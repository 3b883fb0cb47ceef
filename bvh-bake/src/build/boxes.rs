//! Boxes and references to triangles in eight lanes, which compilers join in two vector instructions.

use crate::ablation::SplitRule;
use crate::soup::Corners;
use bytemuck::{Pod, Zeroable};

/// A box: the lower ends and the negated upper ends of three axes, each with a spare lane, so that boxes are
/// joined by the lesser of all lanes.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Aabb([f32; 8]);

impl Aabb {
    pub(crate) const EMPTY: Self = Self([f32::INFINITY; 8]);

    pub(crate) fn of_point(point: [f32; 4]) -> Self {
        let [x, y, z, w] = point;
        Self([x, y, z, w, -x, -y, -z, -w])
    }

    /// The box of a triangle.
    #[inline(always)]
    pub(crate) fn of_triangle(corners: &Corners) -> Self {
        Reference::new(0, corners).aabb()
    }

    #[inline(always)]
    pub(crate) fn join(&mut self, other: &Self) {
        for lane in 0..8 {
            // `min` without its care for NaN, which there is none of here.
            let (mine, its) = (self.0[lane], other.0[lane]);
            self.0[lane] = if its < mine { its } else { mine };
        }
    }

    pub(crate) fn lo(&self, axis: usize) -> f32 {
        self.0[axis]
    }

    pub(crate) fn hi(&self, axis: usize) -> f32 {
        // Zeros are positive in files.
        0.0 - self.0[axis + 4]
    }

    /// The extent along an axis; coordinates of at most 2^120 do not overflow, nor do twice as large ones.
    #[inline(always)]
    pub(super) fn extent(&self, axis: usize) -> f32 {
        -(self.0[axis] + self.0[axis + 4])
    }

    /// Twice the centre, and a spare lane.
    #[inline(always)]
    pub(crate) fn centre(&self) -> [f32; 4] {
        std::array::from_fn(|axis| self.0[axis] - self.0[axis + 4])
    }

    /// The axis of the largest extent, the first of equals.
    pub(super) fn longest(&self) -> usize {
        (1..3).fold(0, |best, axis| if self.extent(axis) > self.extent(best) { axis } else { best })
    }

    /// The sum of the extents, at most 3 * 2^121.
    #[inline(always)]
    pub(super) fn girth(&self) -> f32 {
        self.extent(0) + self.extent(1) + self.extent(2)
    }

    /// The square of the sum of the extents: how likely a traversal is to come by. See `Cost`.
    pub(super) fn squared_girth(&self) -> f64 {
        f64::from(self.girth()).powi(2)
    }
}

/// A triangle's box and number.
#[derive(Clone, Copy, Pod, Zeroable)]
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
        // Masked rather than put together from six numbers: one load and one instruction.
        let lanes: &[u32; 8] = bytemuck::cast_ref(self);
        const AXES: [u32; 8] = [!0, !0, !0, 0, !0, !0, !0, 0];
        Aabb(std::array::from_fn(|lane| f32::from_bits(lanes[lane] & AXES[lane])))
    }
}

/// Puts centres into a number of bins along each axis, of which the first and the last are half as wide.
#[derive(Clone, Copy)]
pub(super) struct Binning<const BINS: usize> {
    from: [f32; 4],
    scale: [f32; 4],
}

impl<const BINS: usize> Binning<BINS> {
    /// For centres within the given box.
    pub(super) fn new(centres: &Aabb) -> Self {
        let scale = |axis: usize| {
            let extent = centres.extent(axis);
            if axis < 3 && extent > 0.0 { (BINS - 1) as f32 / extent } else { 0.0 }
        };
        let from = std::array::from_fn(|axis| if axis < 3 { centres.lo(axis) } else { 0.0 });
        Self { from, scale: std::array::from_fn(scale) }
    }

    /// The bins of a centre, each less than `BINS`, which is a power of two.
    #[inline(always)]
    pub(super) fn bins(&self, centre: [f32; 4]) -> [usize; 4] {
        // Adding 2^23 leaves the nearest whole number in the last bits. A scale that overflowed, as tiny extents
        // make it, puts all into one bin.
        std::array::from_fn(|axis| {
            let bin = (centre[axis] - self.from[axis]) * self.scale[axis] + 8388608.0;
            bin.to_bits() as usize & (BINS - 1)
        })
    }
}

/// The cost of a side of a split: its weight times the square of the sum of its extents and the parent's largest.
///
/// A pair traversal comes by where the bounds of a partner of about the parent's size overlap the side's. Of
/// convex shapes in all orientations, that is as often as the surface of their sum is large, where the shapes are
/// patches of surfaces; and widths of sums are sums of widths. Products of extents, as surfaces and volumes
/// are, think too well of flat boxes, which turned in space reach as far as others.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    /// One over the parent's largest extent: sums are then from 1 to 4, and `f32` is wide enough.
    scale: f32,
    rule: SplitRule,
}

impl Cost {
    pub(super) fn within(parent: &Aabb, rule: SplitRule) -> Self {
        let largest = parent.extent(parent.longest());
        Self { scale: (1.0 / largest).min(f32::MAX), rule }
    }

    #[inline(always)]
    pub(super) fn of(self, bounds: &Aabb, weight: f32) -> f32 {
        if self.rule == SplitRule::SurfaceArea {
            let [x, y, z] = [0, 1, 2].map(|axis| bounds.extent(axis) * self.scale);
            return weight * (x * y + y * z + z * x);
        }
        let girth = bounds.girth() * self.scale + 1.0;
        weight * (girth * girth)
    }
}
