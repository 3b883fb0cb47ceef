//! Re-aligns the k-DOPs of B to the directions of A under a pose.
//!
//! Along a direction `d` of A, seen from B as `d' = R^T d`, the ends of a node of B follow from three of
//! its slabs: see `bvh_format::support`.
//!
//! Rounding: with u = 2^-24, all ends at most M in magnitude, three rounded coefficients, three
//! products and three sums, the computed end is within 8u (M sum |c_j| + |t|) of the exact one, where
//! t is the offset of the pose along d; rounding the offset itself to f32 adds u of it. The pose
//! itself, and the placed vertices it defines, are rounded in f64: that adds at most 2^-48 of the
//! magnitudes involved. Among subnormal numbers rounding is absolute: three products and the offset lose
//! 2^-150 each, and twice that is charged. All go into the offsets, outward, once a query; a node test costs
//! nothing for it.

use crate::pose::Pose;
use bvh_format::kdop::{DirectionSet, FACTORS};
use bvh_format::object::Object;
use bvh_format::support::{Form, upper_form};

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1u64 << 24) as f64;
/// Absolute error charged to an end, mesh units: 2^-147, twice what four roundings of subnormal numbers give.
const UNDERFLOW: f64 = f64::from_bits((1023 - 147) << 52);
/// Relative error charged to all f64 work of a pose: 32 roundings, three times what there are at most.
pub(crate) const POSE_ERROR: f64 = 1.0 / (1u64 << 48) as f64;

/// One direction of A: the forms of both ends and what to add.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Axis {
    pub(crate) lo: Form,
    pub(crate) hi: Form,
    pub(crate) offset_lo: f32,
    pub(crate) offset_hi: f32,
}

/// All directions of A for one pose.
#[derive(Clone, Debug)]
pub(crate) struct Alignment {
    pub(crate) axes: [Axis; 13],
}

/// The pose of object B in the frame of object A, both around their origins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) rotation: [[f64; 3]; 3],
    /// R origin_b + t - origin_a.
    pub(crate) translation: [f64; 3],
    /// Bound on the f64 error of translation and of placed vertices, mesh units.
    pub(crate) error: f64,
}

impl Placement {
    pub(crate) fn new(pose: &Pose, a: &Object, b: &Object) -> Self {
        let (record_a, record_b) = (&a.record, &b.record);
        let mut origin = [[0.0; 3]; 2];
        let mut magnitude = 0.0;
        for axis in 0..3 {
            origin[0][axis] = record_a.origin[axis].get();
            origin[1][axis] = record_b.origin[axis].get();
            magnitude += origin[0][axis].abs() + origin[1][axis].abs() + pose.translation()[axis].abs();
            // Three times the largest coordinate, and more: the sum over the axes of both ends.
            for record in [record_a, record_b] {
                let (lo, hi) = (record.box_lo[axis].get(), record.box_hi[axis].get());
                magnitude += 3.0 * f64::from(lo.abs() + hi.abs());
            }
        }
        let placed = pose.place(origin[1]);
        let [x, y, z] = origin[0];
        Self {
            rotation: *pose.rotation(),
            translation: [placed[0] - x, placed[1] - y, placed[2] - z],
            error: magnitude * POSE_ERROR,
        }
    }

    /// A direction of A's frame as B sees it.
    #[inline(always)]
    pub(crate) fn seen_from_b(&self, d: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        let along = |i: usize| r[0][i] * d[0] + r[1][i] * d[1] + r[2][i] * d[2];
        [along(0), along(1), along(2)]
    }
}

impl Alignment {
    /// Prepares a pose. `reach_b` bounds the slab ends of B's nodes.
    #[inline(always)]
    pub(crate) fn new(placement: &Placement, set_a: DirectionSet, set_b: DirectionSet, reach_b: f32) -> Self {
        let mut axes = [Axis::default(); 13];
        let t = placement.translation;
        for slab in 0..set_a.slabs() {
            let direction = FACTORS[slab];
            let hi = upper_form(placement.seen_from_b(direction), set_b);
            let lo = hi.mirrored();
            let offset = t[0] * direction[0] + t[1] * direction[1] + t[2] * direction[2];
            let error = form_error(&hi, reach_b, offset) + 3.0 * placement.error;
            let (offset_lo, offset_hi) = ((offset - error) as f32, (offset + error) as f32);
            axes[slab] = Axis { lo, hi, offset_lo, offset_hi };
        }
        Self { axes }
    }
}

/// Bound on the error of evaluating a form plus an offset in f32, the rounding of the offset less or
/// more this error included: 8u of the terms, and 2u of the offset and of all this; and what underflows.
#[inline(always)]
pub(crate) fn form_error(form: &Form, reach: f32, offset: f64) -> f64 {
    let [x, y, z] = form.coefficients;
    let terms = f64::from(reach) * f64::from(x.abs() + y.abs() + z.abs());
    10.0 * U * (terms + offset.abs()) + UNDERFLOW
}

/// The nearest f32 at or above.
pub(crate) fn round_up(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value { nearest.next_up() } else { nearest }
}
