//! Re-aligns the k-DOPs of B to the directions of A under a pose.
//!
//! Along a direction `d` of A, seen from B as `d' = R^T d`, the ends of a node of B follow from three of
//! its slabs: see `bvh_format::support`.
//!
//! Rounding: with u = 2^-24, |end_j| <= M_j, three rounded coefficients, three products and three
//! sums, the computed end is within 8u (sum |c_j| M_j + |t|) of the exact one, where t is the offset
//! of the pose along d. The pose itself, and the placed vertices it defines, are rounded in f64:
//! that adds at most 2^-48 of the magnitudes involved. Both go into the offsets, outward, once a
//! query; a node test costs nothing for it.

use crate::pose::Pose;
use bvh_format::kdop::{DIRECTIONS, DirectionSet};
use bvh_format::object::Object;
use bvh_format::support::{Form, upper_form};

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1u64 << 24) as f64;
/// Relative error charged to all f64 work of a pose: 16 times what the handful of roundings give.
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
        let origin = |object: &Object| object.record.origin.map(|o| o.get());
        let (origin_a, origin_b) = (origin(a), origin(b));
        let placed = pose.place(origin_b);
        let reach = |object: &Object| {
            let record = &object.record;
            (0..3).fold(0.0f64, |m, i| {
                m.max(record.box_lo[i].get().abs().max(record.box_hi[i].get().abs()).into())
            })
        };
        let sum = |v: [f64; 3]| v.iter().map(|c| c.abs()).sum::<f64>();
        let magnitude = sum(origin_a) + sum(origin_b) + sum(pose.translation()) + 3.0 * (reach(a) + reach(b));
        Self {
            rotation: *pose.rotation(),
            translation: [0, 1, 2].map(|i| placed[i] - origin_a[i]),
            error: magnitude * POSE_ERROR,
        }
    }

    /// A direction of A's frame as B sees it.
    #[inline]
    pub(crate) fn seen_from_b(&self, d: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        let along = |i: usize| r[0][i] * d[0] + r[1][i] * d[1] + r[2][i] * d[2];
        [along(0), along(1), along(2)]
    }
}

impl Alignment {
    /// Prepares a pose. `reach_b` bounds the slab ends of B's nodes by row.
    pub(crate) fn new(
        placement: &Placement,
        set_a: DirectionSet,
        set_b: DirectionSet,
        reach_b: &[f32; 16],
    ) -> Self {
        let mut axes = [Axis::default(); 13];
        for (axis, direction) in axes.iter_mut().zip(DIRECTIONS).take(set_a.slabs()) {
            let direction = direction.map(f64::from);
            let hi = upper_form(placement.seen_from_b(direction), set_b);
            let lo = hi.mirrored();
            let t = placement.translation;
            let offset = t[0] * direction[0] + t[1] * direction[1] + t[2] * direction[2];
            let error = form_error(&hi, reach_b, offset) + 3.0 * placement.error;
            *axis =
                Axis { lo, hi, offset_lo: round_down(offset - error), offset_hi: round_up(offset + error) };
        }
        Self { axes }
    }
}

/// Bound on the error of evaluating a form plus an offset in f32.
#[inline]
pub(crate) fn form_error(form: &Form, reach: &[f32; 16], offset: f64) -> f64 {
    let mut sum = offset.abs();
    for j in 0..3 {
        sum += f64::from(form.coefficients[j].abs()) * f64::from(reach[usize::from(form.rows[j] & 15)]);
    }
    8.0 * U * sum
}

/// The nearest f32 at or above.
pub(crate) fn round_up(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value { nearest.next_up() } else { nearest }
}

/// The nearest f32 at or below.
pub(crate) fn round_down(value: f64) -> f32 {
    -round_up(-value)
}
