//! The node test of lines: where each of four segments enters each of four nodes, slab by slab.
//!
//! A segment leads from p to p + q, and its points are p + s q for s from 0 to 1. Along a direction n of a slab that is from
//! (lo - n p) / (n q) to (hi - n p) / (n q), and within a node where it is so along all directions (T. L. Kay, J. T. Kajiya,
//! "Ray Tracing Complex Scenes", SIGGRAPH 1986).
//!
//! Error, with u = 2^-24: n p and n q are rounded to f32, which moves a point along n by u |n p| + u |n q| at most; their own
//! error and that of the segment in f64 come on top. Slabs are moved outward by more than that. What is left is relative: a
//! rounded difference, a rounded inverse and a product make an end of the interval wrong by 3u of itself, for which entries are
//! made less by 8u and exits greater. (Their signs are right, so that making them less of themselves is not wrong before the
//! segment's start either, where they count as 0.)
//!
//! Where |n q| is less than half of what slabs are moved by, that is moved by |n q| more, and n q counts as just that half: the
//! quotients are then beyond 0 and 1 wherever p is within the slab by more than rounding.

use crate::isa::{Isa, Lanes};
use crate::traverse::align::{U, round_up};
use crate::traverse::probe_walk::PROBES;
use bvh_format::kdop::{DirectionSet, FACTORS};
use bvh_format::slabs::{Group, row};

/// A segment around an object's origin, in mesh units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) start: [f64; 3],
    pub(crate) vector: [f64; 3],
    /// The direction, of any length: the vector may be too short to tell. 0 for a point.
    pub(crate) direction: [f64; 3],
    /// A bound on the error of the coordinates of its points.
    pub(crate) error: f64,
}

impl Segment {
    pub(crate) const NONE: Self = Self { start: [0.0; 3], vector: [0.0; 3], direction: [0.0; 3], error: 0.0 };
}

/// Segments as node tests need them, by slab.
pub(crate) struct LineTest {
    set: DirectionSet,
    /// n p and what slabs are moved by: subtracted from their lower ends.
    above: [[f32; PROBES]; 13],
    /// n p less what slabs are moved by: subtracted from their upper ends.
    below: [[f32; PROBES]; 13],
    /// 1 / n q.
    inverse: [[f32; PROBES]; 13],
}

impl LineTest {
    pub(crate) fn new(segments: &[Segment; PROBES], set: DirectionSet) -> Self {
        let zero = [[0.0; PROBES]; 13];
        let mut test = Self { set, above: zero, below: zero, inverse: zero };
        for slab in 0..set.slabs() {
            for (number, segment) in segments.iter().enumerate() {
                let along = |v: &[f64; 3]| (0..3).map(|k| FACTORS[slab][k] * v[k]).sum::<f64>();
                let (p, mut q) = (along(&segment.start), along(&segment.vector));
                // Three times the error of a coordinate, and more than is rounded here.
                let mut outward =
                    2.0 * U * (p.abs() + q.abs()) + 4.0 * segment.error + f64::from(f32::MIN_POSITIVE);
                let least = outward / 2.0;
                if q.abs() < least {
                    outward += q.abs();
                    q = least;
                }
                test.above[slab][number] = round_up(p + outward);
                test.below[slab][number] = -round_up(outward - p);
                test.inverse[slab][number] = (1.0 / q) as f32;
            }
        }
        test
    }

    /// Returns where each segment enters each of four nodes, from 0 to 1; infinity where it does not. Element
    /// `4 * node + segment`.
    #[inline(always)]
    pub(crate) fn entries<I: Isa>(&self, isa: I, nodes: &Group) -> I::V {
        match self.set {
            DirectionSet::Dop6 => self.entries_of::<I, 3>(isa, nodes),
            DirectionSet::Dop14 => self.entries_of::<I, 7>(isa, nodes),
            DirectionSet::Dop26 => self.entries_of::<I, 13>(isa, nodes),
        }
    }

    #[inline(always)]
    fn entries_of<I: Isa, const SLABS: usize>(&self, isa: I, nodes: &Group) -> I::V {
        /// 8u.
        const SLACK: f32 = 1.0 / (1 << 21) as f32;
        let rows = nodes.rows();
        let (mut entry, mut exit) = (isa.splat(0.0), isa.splat(1.0));
        for slab in 0..SLABS {
            let inverse = isa.tile(&self.inverse[slab]);
            let lo = isa.repeat(&rows[row(slab)]).sub(isa.tile(&self.above[slab])).mul(inverse);
            let hi = isa.repeat(&rows[16 + row(slab)]).sub(isa.tile(&self.below[slab])).mul(inverse);
            entry = entry.max(lo.min(hi));
            exit = exit.min(lo.max(hi));
        }
        let entry = entry.mul(isa.splat(1.0 - SLACK));
        let is_met = entry.le(exit.mul(isa.splat(1.0 + SLACK)));
        I::V::select(is_met, entry, isa.splat(f32::INFINITY))
    }
}
