//! Re-aligns the k-DOPs of B to the directions of A under a pose.
//!
//! Along a direction `d` of A, seen from B as `d' = R^T d`, a k-DOP of B reaches at most
//! `sum c_j * end_j` where `d' = sum c_j n_j` over directions `n_j` of B, and `end_j` is the upper end of
//! slab j for a positive coefficient, the lower for a negative: linear programming duality. Of all
//! such sums, the three neighbours of `d'` among B's directions give the least one for a ball, and one
//! close to it for anything round: they follow in closed form from the order of the magnitudes of
//! the coordinates of `d'`. Method: Zachmann, VRAIS 1998; there, the three faces at the extreme
//! vertex.
//!
//! Rounding: with u = 2^-24, |end_j| <= M_j, three rounded coefficients, three products and three
//! sums, the computed end is within 8u (sum |c_j| M_j + |t|) of the exact one, where t is the offset
//! of the pose along d. The pose itself, and the placed vertices it defines, are rounded in f64:
//! that adds at most 2^-48 of the magnitudes involved. Both go into the offsets, outward, once a
//! query; a node test costs nothing for it.

use crate::pose::Pose;
use bvh_format::kdop::{DIRECTIONS, DirectionSet};
use bvh_format::object::Object;
use bvh_format::treelet::row;

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1u64 << 24) as f64;
/// Relative error charged to all f64 work of a pose: 16 times what the handful of roundings give.
pub(crate) const POSE_ERROR: f64 = 1.0 / (1u64 << 48) as f64;

/// A linear form over the rows of a group: three rows, three coefficients.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Form {
    pub(crate) rows: [u8; 3],
    pub(crate) coefficients: [f32; 3],
}

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
    pub(crate) count: usize,
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
            (0..3).fold(0.0f64, |m, i| m.max(record.box_lo[i].get().abs().max(record.box_hi[i].get().abs()).into()))
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
    pub(crate) fn to_b(&self, d: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        std::array::from_fn(|i| r[0][i] * d[0] + r[1][i] * d[1] + r[2][i] * d[2])
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
        let count = set_a.slabs();
        let mut axes = [Axis::default(); 13];
        for (axis, direction) in axes.iter_mut().zip(DIRECTIONS).take(count) {
            let direction = direction.map(f64::from);
            let hi = upper_form(placement.to_b(direction), set_b);
            let lo = mirrored(hi);
            let t = placement.translation;
            let offset = t[0] * direction[0] + t[1] * direction[1] + t[2] * direction[2];
            let error = form_error(&hi, reach_b, offset) + 3.0 * placement.error;
            *axis = Axis { lo, hi, offset_lo: round_down(offset - error), offset_hi: round_up(offset + error) };
        }
        Self { axes, count }
    }
}

/// Bound on the error of evaluating a form plus an offset in f32.
pub(crate) fn form_error(form: &Form, reach: &[f32; 16], offset: f64) -> f64 {
    let sum: f64 = (0..3)
        .map(|j| f64::from(form.coefficients[j].abs()) * f64::from(reach[usize::from(form.rows[j] & 15)]))
        .sum();
    8.0 * U * (sum + offset.abs())
}

/// The form of an upper end along `d` over the directions of a set.
pub(crate) fn upper_form(d: [f64; 3], set: DirectionSet) -> Form {
    let mut order = [0, 1, 2];
    // Three comparisons sort three magnitudes; equal ones may come in any order.
    let larger = |order: &mut [usize; 3], i: usize, j: usize| {
        if d[order[i]].abs() < d[order[j]].abs() {
            order.swap(i, j);
        }
    };
    larger(&mut order, 0, 1);
    larger(&mut order, 1, 2);
    larger(&mut order, 0, 1);
    let [p0, p1, p2] = order;
    let [m0, m1, m2] = order.map(|p| d[p].abs());
    let sign = d.map(|v| if v < 0.0 { -1 } else { 1 });
    let axis = |p: usize| (p, f64::from(sign[p]));
    let terms = match set {
        DirectionSet::Dop6 => {
            let scaled = |p: usize, m: f64| (axis(p).0, axis(p).1 * m);
            [scaled(p0, m0), scaled(p1, m1), scaled(p2, m2)]
        }
        DirectionSet::Dop14 => {
            let mut other = sign;
            other[p2] = -other[p2];
            let (near, near_sign) = diagonal(sign);
            let (far, far_sign) = diagonal(other);
            [
                (axis(p0).0, axis(p0).1 * (m0 - m1)),
                (near, near_sign * (m1 + m2) / 2.0),
                (far, far_sign * (m1 - m2) / 2.0),
            ]
        }
        DirectionSet::Dop26 => {
            let mut flat = sign;
            flat[p2] = 0;
            let (face, face_sign) = diagonal(flat);
            let (cube, cube_sign) = diagonal(sign);
            [(axis(p0).0, axis(p0).1 * (m0 - m1)), (face, face_sign * (m1 - m2)), (cube, cube_sign * m2)]
        }
    };
    let mut form = Form::default();
    for (j, (slab, coefficient)) in terms.into_iter().enumerate() {
        form.rows[j] = (row(slab) + if coefficient < 0.0 { 0 } else { 16 }) as u8;
        form.coefficients[j] = coefficient as f32;
    }
    form
}

/// The form of the lower end along the same direction: the other end of each slab.
pub(crate) fn mirrored(form: Form) -> Form {
    Form { rows: form.rows.map(|row| row ^ 16), coefficients: form.coefficients }
}

/// The slab along a diagonal with these signs, and +1 or -1 for its sense.
fn diagonal(signs: [i8; 3]) -> (usize, f64) {
    // Three quarters of the list never match; a search of 10 entries is short, but the code of the
    // signs is shorter.
    let slab = match signs {
        [1, 1, 1] | [-1, -1, -1] => 3,
        [1, 1, -1] | [-1, -1, 1] => 4,
        [1, -1, 1] | [-1, 1, -1] => 5,
        [-1, 1, 1] | [1, -1, -1] => 6,
        [1, 1, 0] | [-1, -1, 0] => 7,
        [1, 0, 1] | [-1, 0, -1] => 8,
        [0, 1, 1] | [0, -1, -1] => 9,
        [1, -1, 0] | [-1, 1, 0] => 10,
        [1, 0, -1] | [-1, 0, 1] => 11,
        _ => 12,
    };
    (slab, if signs == DIRECTIONS[slab] { 1.0 } else { -1.0 })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_represent_their_direction() {
        let mut state = 11u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        for round in 0..30_000 {
            let mut d = [random(), random(), random()];
            if round % 5 == 0 {
                d[round % 3] = 0.0;
            }
            if round % 7 == 0 {
                d[1] = -d[0];
            }
            for set in [DirectionSet::Dop6, DirectionSet::Dop14, DirectionSet::Dop26] {
                let form = upper_form(d, set);
                let mut sum = [0.0; 3];
                for j in 0..3 {
                    let held = usize::from(form.rows[j] & 15);
                    let slab = (0..set.slabs()).find(|&s| row(s) == held).expect("a slab of the set");
                    let coefficient = f64::from(form.coefficients[j]);
                    // A positive coefficient takes the upper end, a negative one the lower.
                    assert_eq!(form.rows[j] >= 16, coefficient >= 0.0);
                    for i in 0..3 {
                        sum[i] += coefficient * f64::from(DIRECTIONS[slab][i]);
                    }
                }
                for i in 0..3 {
                    assert!((sum[i] - d[i]).abs() < 4.0 * U, "{set:?} {d:?} {sum:?}");
                }
            }
        }
    }
}
