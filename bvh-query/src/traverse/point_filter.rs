//! The node filter for a point: lower bounds of its distance from four nodes.
//!
//! A group has four children in columns and slabs in rows, four rows to a register. For a single point, one comparison
//! of a register tests sixteen slabs, whereas a pair of nodes takes one comparison per slab.
//!
//! Distances are in units of 2^k mesh units, which are no less than a fraction of the distance from the point to the
//! farthest corner of the object's box. So no square overflows.
//!
//! Error: the point's slabs hold its projections. A gap is one difference (u = 2^-24), times the inverse length of its
//! direction (2u, rounded down before); the root of the sum of squares adds three products, two sums and a root. Together
//! that is less than 2^-20, by which the result is scaled: see `gaps` in [`crate::traverse::node_filter`], which says as well
//! what becomes of squares that underflow.

use crate::isa::{Isa, Lanes};
use crate::numerics::{F32_SLACK, SUBNORMAL_LOSS};
use crate::traverse::align::FACTORS_BY_AXIS;
use crate::traverse::node_filter::INVERSE_LENGTHS;
use bvh_format::kdop::DirectionSet;
use bvh_format::slabs::Group;

/// A point's slabs, in all four columns, and what makes a distance of a gap.
pub(crate) struct PointFilter {
    slabs: Group,
    /// Inverse lengths of directions, in units of the test.
    inverse_lengths: [[f32; 16]; 4],
    set: DirectionSet,
}

impl PointFilter {
    /// Prepares the test of a point around the object's origin; `error` bounds that of its coordinates added up. `scale` is
    /// the inverse of the unit, a power of two.
    #[inline(always)]
    pub(crate) fn new<I: Isa>(isa: I, point: &[f64; 3], set: DirectionSet, error: f64, scale: f32) -> Self {
        let (mut lo, mut hi, mut inverse_lengths) = ([0.0; 16], [0.0; 16], [0.0; 16]);
        let [x, y, z] = &FACTORS_BY_AXIS;
        for row in 0..16 {
            let along = x[row] * point[0] + y[row] * point[1] + z[row] * point[2];
            // Rounding to `f32` moves an end by half as much or less.
            let outward = 2.0 * error + along.abs() * f64::from(f32::EPSILON) + SUBNORMAL_LOSS;
            lo[row] = (along - outward) as f32;
            hi[row] = (along + outward) as f32;
            inverse_lengths[row] = INVERSE_LENGTHS[row] * scale;
        }
        // Rows without a slab have the whole line: their gaps are -infinity.
        for &row in rows_without_slab(set) {
            (lo[row], hi[row]) = (f32::NEG_INFINITY, f32::INFINITY);
        }
        Self {
            slabs: Group { lo: in_all_columns(isa, &lo), hi: in_all_columns(isa, &hi) },
            inverse_lengths: in_all_columns(isa, &inverse_lengths),
            set,
        }
    }

    /// Returns lower bounds of the distances of four nodes, in units of the test. Where the point is in all slabs of a node,
    /// the bound is negative, and tells how deep.
    #[inline(always)]
    pub(crate) fn bounds<I: Isa>(&self, isa: I, children: &Group) -> I::F32x4 {
        match self.set {
            DirectionSet::Dop6 => self.bounds_in::<I, 1>(isa, children),
            DirectionSet::Dop14 => self.bounds_in::<I, 2>(isa, children),
            DirectionSet::Dop26 => self.bounds_in::<I, 4>(isa, children),
        }
    }

    #[inline(always)]
    fn bounds_in<I: Isa, const QUADS: usize>(&self, isa: I, children: &Group) -> I::F32x4 {
        let axes = self.gaps(isa, children, 0);
        // `max` returns its second operand for NaN, which rows without a slab may have: these come first.
        let mut largest = axes;
        if QUADS >= 2 {
            largest = self.gaps(isa, children, 1).max(largest);
        }
        if QUADS == 4 {
            largest = self.gaps(isa, children, 3).max(self.gaps(isa, children, 2)).max(largest);
        }
        let mut rows = [0.0; 16];
        isa.store(largest, &mut rows);
        let [first, second, third, fourth] = quads(isa, &rows);
        let largest = fourth.max(third).max(first.max(second));
        // Along the three axes gaps add up like the sides of a box.
        let sides = axes.max(isa.splat(0.0));
        isa.store(sides.mul(sides), &mut rows);
        let [x, y, z, _] = quads(isa, &rows);
        let sum = x.add(y).add(z);
        let normal = isa.splat4(f32::MIN_POSITIVE).le(sum);
        let apart = I::F32x4::select(normal, sum.sqrt(), largest);
        largest.max(apart).mul(isa.splat4(1.0 - F32_SLACK))
    }

    /// The gaps of four children along four slabs.
    #[inline(always)]
    fn gaps<I: Isa>(&self, isa: I, children: &Group, quad: usize) -> I::F32x16 {
        let (lo, hi) = (isa.load(&children.lo[quad]), isa.load(&children.hi[quad]));
        let gap = lo.sub(isa.load(&self.slabs.hi[quad])).max(isa.load(&self.slabs.lo[quad]).sub(hi));
        gap.mul(isa.load(&self.inverse_lengths[quad]))
    }
}

#[inline(always)]
pub(super) fn quads<I: Isa>(isa: I, rows: &[f32; 16]) -> [I::F32x4; 4] {
    let rows = rows.as_chunks::<4>().0;
    [isa.load4(&rows[0]), isa.load4(&rows[1]), isa.load4(&rows[2]), isa.load4(&rows[3])]
}

/// The rows without a slab among those that are tested.
pub(super) fn rows_without_slab(set: DirectionSet) -> &'static [usize] {
    match set {
        DirectionSet::Dop6 => &[3],
        DirectionSet::Dop14 => &[7],
        DirectionSet::Dop26 => &[7, 14, 15],
    }
}

/// Returns the numbers of sixteen rows, each in all four columns.
#[inline(always)]
pub(super) fn in_all_columns<I: Isa>(isa: I, rows: &[f32; 16]) -> [[f32; 16]; 4] {
    let mut quads = [[0.0; 16]; 4];
    for (quad, rows) in quads.iter_mut().zip(rows.as_chunks().0) {
        isa.store(isa.repeat(rows), quad);
    }
    quads
}
