//! The node filter for a line: where a segment enters each of four nodes.
//!
//! A segment leads from p to p + q, and its points are p + s q for s from 0 to 1. It is within a slab of direction n
//! for s from (lo - n p) / (n q) to (hi - n p) / (n q), and within a node where this holds for all directions (T. L.
//! Kay, J. T. Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986). As for a point ([`crate::traverse::point_filter`]),
//! a register holds four slabs of four nodes.
//!
//! Error, with u = 2^-24. The subtracted numbers and n q are rounded to f32, which moves a point along n by at most
//! 1.01 u (|n p| + |n q|). The segment's own error moves it by 3 E along a direction of three entries. Slabs are moved
//! outward by w = 3 u (|n p| + |n q|) + 8 E, more than twice as much. The remaining errors are relative: a rounded
//! difference, a rounded inverse and a product make an end of the interval wrong by 3u of itself. To cover this,
//! entries are made less, and exits greater, by 8u. The signs are right, so this also holds for ends before the
//! segment's start, which count as 0. Where shapes reach r around their triangles, slabs are first moved by 2 r, which is more than a
//! direction of three entries needs, and of which w has 3u more.
//!
//! If |n q| is less than w / 2, slabs are moved by |n q| more, and n q counts as w / 2. Wherever the segment meets the
//! slab, both ends are then at least w - w / 2 away, and the quotients are beyond 0 and 1.

use crate::isa::{Isa, Lanes};
use crate::numerics::U;
use crate::traverse::align::FACTORS_BY_AXIS;
use crate::traverse::point_filter::{in_all_columns, quads, rows_without_slab};
use bvh_format::kdop::DirectionSet;
use bvh_format::slabs::Group;

/// A segment around an object's origin, in mesh units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) start: [f64; 3],
    pub(crate) vector: [f64; 3],
    /// A bound on the error of the coordinates of its points.
    pub(crate) error: f64,
    /// How far around its triangles the object reaches.
    pub(crate) reach: f64,
}

/// A segment as node tests need it, by rows of slabs, in all four columns.
pub(crate) struct LineFilter {
    set: DirectionSet,
    /// n p and what slabs are moved by: subtracted from their lower ends.
    above: [[f32; 16]; 4],
    /// n p less what slabs are moved by: subtracted from their upper ends.
    below: [[f32; 16]; 4],
    /// 1 / n q.
    inverse: [[f32; 16]; 4],
}

impl LineFilter {
    #[inline(always)]
    pub(crate) fn new<I: Isa>(isa: I, segment: &Segment, set: DirectionSet) -> Self {
        let (mut above, mut below, mut inverse) = ([0.0; 16], [0.0; 16], [0.0; 16]);
        let [x, y, z] = &FACTORS_BY_AXIS;
        let (start, vector) = (&segment.start, &segment.vector);
        // A projection is off by up to three times the error of a coordinate, for which less than half is needed.
        let least = 8.0 * segment.error + f64::from(f32::MIN_POSITIVE);
        let reach = 2.0 * segment.reach;
        for row in 0..16 {
            let p = x[row] * start[0] + y[row] * start[1] + z[row] * start[2];
            let q = x[row] * vector[0] + y[row] * vector[1] + z[row] * vector[2];
            let outward = 3.0 * f64::from(U) * (p.abs() + q.abs() + reach) + least;
            let is_along = q.abs() < 0.5 * outward;
            let q_or_least = if is_along { 0.5 * outward } else { q };
            let outward = if is_along { outward + q.abs() } else { outward };
            above[row] = (p + (outward + reach)) as f32;
            below[row] = (p - (outward + reach)) as f32;
            inverse[row] = (1.0 / q_or_least) as f32;
        }
        // Segments are in rows without a slab from -infinity to infinity.
        for &row in rows_without_slab(set) {
            (above[row], below[row], inverse[row]) = (f32::INFINITY, f32::NEG_INFINITY, 1.0);
        }
        Self {
            set,
            above: in_all_columns(isa, &above),
            below: in_all_columns(isa, &below),
            inverse: in_all_columns(isa, &inverse),
        }
    }

    /// Returns where the segment enters four nodes, from 0 to 1; infinity where it does not.
    #[inline(always)]
    pub(crate) fn entries<I: Isa>(&self, isa: I, nodes: &Group) -> I::F32x4 {
        match self.set {
            DirectionSet::Dop6 => self.entries_in::<I, 1>(isa, nodes),
            DirectionSet::Dop14 => self.entries_in::<I, 2>(isa, nodes),
            DirectionSet::Dop26 => self.entries_in::<I, 4>(isa, nodes),
        }
    }

    #[inline(always)]
    fn entries_in<I: Isa, const QUADS: usize>(&self, isa: I, nodes: &Group) -> I::F32x4 {
        /// 8u.
        const SLACK: f32 = 1.0 / (1 << 21) as f32;
        let (mut entry, mut exit) = (isa.splat(0.0), isa.splat(1.0));
        for quad in 0..QUADS {
            let inverse = isa.load(&self.inverse[quad]);
            let lo = isa.load(&nodes.lo[quad]).sub(isa.load(&self.above[quad])).mul(inverse);
            let hi = isa.load(&nodes.hi[quad]).sub(isa.load(&self.below[quad])).mul(inverse);
            // In rows without a slab lo is -infinity or NaN, and hi infinity or NaN. `max` and `min` return their second
            // operand for NaN, so that in this order neither changes what was found.
            entry = hi.min(lo).max(entry);
            exit = lo.max(hi).min(exit);
        }
        let (mut entries, mut exits) = ([0.0; 16], [0.0; 16]);
        isa.store(entry, &mut entries);
        isa.store(exit, &mut exits);
        let ([a, b, c, d], [e, f, g, h]) = (quads(isa, &entries), quads(isa, &exits));
        let entry = a.max(b).max(c.max(d)).mul(isa.splat4(1.0 - SLACK));
        let exit = e.min(f).min(g.min(h)).mul(isa.splat4(1.0 + SLACK));
        I::F32x4::select(entry.le(exit), entry, isa.splat4(f32::INFINITY))
    }
}
