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
use bvh_format::support::{Form, cone, magnitudes, rows_of_cone, signed};

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1u64 << 24) as f64;
/// Absolute error charged to an end, mesh units: 2^-147, twice what four roundings of subnormal numbers give.
const UNDERFLOW: f64 = f64::from_bits((1023 - 147) << 52);
/// Relative error charged to all f64 work of a pose: 32 roundings, three times what there are at most.
pub(crate) const POSE_ERROR: f64 = 1.0 / (1u64 << 48) as f64;

/// All directions of A for one pose: the forms of B's upper ends along them and what to add. The lower end has
/// the same coefficients over the other ends. One array a quantity, so that all directions are prepared at
/// once in vector registers; three of the 16 elements are of no direction.
#[derive(Clone, Debug)]
pub(crate) struct Alignment {
    rows: [u32; 16],
    coefficients: [[f32; 16]; 3],
    pub(crate) offset_lo: [f32; 16],
    pub(crate) offset_hi: [f32; 16],
}

/// `FACTORS` by axis.
const FACTORS_BY_AXIS: [[f64; 16]; 3] = {
    let mut factors = [[0.0; 16]; 3];
    let mut slab = 0;
    while slab < 13 {
        let mut axis = 0;
        while axis < 3 {
            factors[axis][slab] = FACTORS[slab][axis];
            axis += 1;
        }
        slab += 1;
    }
    factors
};

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

    /// The placement of A in the frame of B.
    ///
    /// A rotation may be 2^-20 off, so this is the inverse, not the transpose. With v = 2^-53, its entries are
    /// within 16v of exact ones: 3v from a difference of products, 12v from the determinant's inverse, v from
    /// their product. Along a direction of up to three entries that moves a projection by 54v of the
    /// coordinates and 64v of the translation's, together less than 2^-45 of the magnitudes that `error`
    /// is 2^-48 of. Alignment charges three times the error; four times as much here covers all.
    pub(crate) fn inverse(&self) -> Self {
        let [x, y, z] = self.rotation;
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let columns = [cross(y, z), cross(z, x), cross(x, y)];
        let scale = 1.0 / (x[0] * columns[0][0] + x[1] * columns[0][1] + x[2] * columns[0][2]);
        let rotation = [0, 1, 2].map(|i| [0, 1, 2].map(|j| columns[j][i] * scale));
        let t = self.translation;
        let translation = rotation.map(|row: [f64; 3]| -(row[0] * t[0] + row[1] * t[1] + row[2] * t[2]));
        Self { rotation, translation, error: 4.0 * self.error }
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
    pub(crate) fn new(placement: &Placement, set_b: DirectionSet, reach_b: f32) -> Self {
        match set_b {
            DirectionSet::Dop6 => Self::along_all(placement, DirectionSet::Dop6, reach_b),
            DirectionSet::Dop14 => Self::along_all(placement, DirectionSet::Dop14, reach_b),
            DirectionSet::Dop26 => Self::along_all(placement, DirectionSet::Dop26, reach_b),
        }
    }

    #[inline(always)]
    fn along_all(placement: &Placement, set_b: DirectionSet, reach_b: f32) -> Self {
        let (r, t) = (&placement.rotation, &placement.translation);
        let mut cones = [0; 16];
        let mut coefficients = [[0.0f32; 16]; 3];
        let (mut offset_lo, mut offset_hi) = ([0.0; 16], [0.0; 16]);
        for slab in 0..16 {
            let [x, y, z] = [FACTORS_BY_AXIS[0][slab], FACTORS_BY_AXIS[1][slab], FACTORS_BY_AXIS[2][slab]];
            let seen = [
                r[0][0] * x + r[1][0] * y + r[2][0] * z,
                r[0][1] * x + r[1][1] * y + r[2][1] * z,
                r[0][2] * x + r[1][2] * y + r[2][2] * z,
            ];
            let offset = t[0] * x + t[1] * y + t[2] * z;
            let [c0, c1, c2] = magnitudes(seen, set_b);
            let rounded = [c0 as f32, c1 as f32, c2 as f32];
            let error = form_error(rounded, reach_b, offset) + 3.0 * placement.error;
            cones[slab] = cone(seen);
            (coefficients[0][slab], coefficients[1][slab], coefficients[2][slab]) =
                (rounded[0], rounded[1], rounded[2]);
            (offset_lo[slab], offset_hi[slab]) = ((offset - error) as f32, (offset + error) as f32);
        }
        let mut rows = [0; 16];
        for slab in 0..16 {
            rows[slab] = rows_of_cone(cones[slab], set_b);
        }
        for (j, coefficients) in coefficients.iter_mut().enumerate() {
            for slab in 0..16 {
                coefficients[slab] = signed(coefficients[slab], rows[slab], j);
            }
        }
        Self { rows, coefficients, offset_lo, offset_hi }
    }

    /// The form of the upper end along a slab's direction.
    #[inline(always)]
    pub(crate) fn upper(&self, slab: usize) -> Form {
        let c = &self.coefficients;
        Form::new(self.rows[slab], [c[0][slab], c[1][slab], c[2][slab]])
    }
}

/// Bound on the error of evaluating a form plus an offset in f32, the rounding of the offset less or
/// more this error included: 8u of the terms, and 2u of the offset and of all this; and what underflows.
#[inline(always)]
pub(crate) fn form_error([x, y, z]: [f32; 3], reach: f32, offset: f64) -> f64 {
    let terms = f64::from(reach) * f64::from(x.abs() + y.abs() + z.abs());
    10.0 * U * (terms + offset.abs()) + UNDERFLOW
}

/// The nearest f32 at or above.
pub(crate) fn round_up(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) < value { nearest.next_up() } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_format::kdop::Kdop;
    use bvh_format::slabs::NodeSlabs;

    /// An end of a form over a node's slabs, as the kernels evaluate it.
    fn end(form: &Form, node: &NodeSlabs, offset: f32) -> f32 {
        let rows = [node.lo, node.hi];
        (0..3).fold(offset, |sum, j| {
            let row = usize::from(form.rows[j]);
            rows[row / 16][row % 16].mul_add(form.coefficients[j], sum)
        })
    }

    /// A matrix as far from a rotation as a pose may be: its transpose as an inverse would be off by 2^-20 of the
    /// coordinates, many times what is charged.
    #[test]
    fn nodes_of_a_contain_their_points_along_directions_of_b() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        for round in 0..500 {
            let (sin, cos) = (3.0 * random()).sin_cos();
            let shear = if round % 2 == 0 { 0.9e-6 } else { -0.9e-6 };
            let rotation = [[cos, -sin, shear * cos], [sin, cos, shear * sin], [0.0, 0.0, 1.0]];
            let translation = [random(), random(), random()].map(|t| t * 10f64.powi(round % 5 - 4));
            let pose = Pose::new(rotation, translation).unwrap();
            let placement = Placement { rotation: *pose.rotation(), translation, error: 100.0 * POSE_ERROR };
            let inverse = placement.inverse();
            let points: Vec<[f32; 3]> =
                (0..20).map(|_| [random() as f32, random() as f32, random() as f32]).collect();
            for (set_a, set_b) in [
                (DirectionSet::Dop6, DirectionSet::Dop26),
                (DirectionSet::Dop14, DirectionSet::Dop14),
                (DirectionSet::Dop26, DirectionSet::Dop6),
            ] {
                let alignment = Alignment::new(&inverse, set_a, 3.0);
                for point in &points {
                    let node = NodeSlabs::from_kdop(&Kdop::of_points([*point]), set_a.slabs());
                    // Where B's frame has the point: solved by elimination, z first.
                    let [x, y, z] = [0, 1, 2].map(|axis| f64::from(point[axis]) - translation[axis]);
                    let seen = [cos * x + sin * y - shear * z, cos * y - sin * x, z];
                    for slab in 0..set_b.slabs() {
                        let form = alignment.upper(slab);
                        let lo = end(&form.mirrored(), &node, alignment.offset_lo[slab]);
                        let hi = end(&form, &node, alignment.offset_hi[slab]);
                        let along: f64 = (0..3).map(|axis| FACTORS[slab][axis] * seen[axis]).sum();
                        assert!(f64::from(lo) <= along && along <= f64::from(hi), "{lo} <= {along} <= {hi}");
                        // No looser than the forms are.
                        assert!(f64::from(hi) - f64::from(lo) < 1e-4, "{lo} to {hi}");
                    }
                }
            }
        }
    }
}
