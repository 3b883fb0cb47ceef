//! Re-aligns the k-DOPs of B to the directions of A under a pose.
//!
//! Along a direction `d` of A, seen from B as `d' = R^T d`, the ends of a node of B follow from three of
//! its slabs: see `traverse/forms`.
//!
//! Rounding: with u = 2^-24, all ends at most M in magnitude, three rounded coefficients, three
//! products and three sums, the computed end is within 8u (M sum |c_j| + |t|) of the exact one, where
//! t is the offset of the pose along d; rounding the offset itself to f32 adds u of it. The pose
//! itself, and the placed vertices it defines, are rounded in f64: that adds at most 2^-48 of the
//! magnitudes involved. Among subnormal numbers rounding is absolute: three products and the offset lose
//! 2^-150 each, and twice that is charged. All go into the offsets, outward, once a query; a node test costs
//! nothing for it.

use crate::isa::{Isa, Lanes, Part, Task};
use crate::numerics::{END_UNDERFLOW, U};
use crate::traverse::forms::{cone, magnitudes, rows_by_cone};
use crate::traverse::placement::Placement;
use bvh_format::kdop::{DirectionSet, FACTORS};
use bvh_format::slabs::{Group, row};

/// All directions of A for one pose: the three terms of B's upper ends along them, and what to add. The lower end
/// has the same coefficients over the other ends of the slabs.
///
/// Everything is laid out as the groups that it produces: four rows of four nodes to a register. Rows without a slab
/// have no meaning.
#[repr(C, align(64))]
pub(crate) struct Alignment {
    /// Where each term's end is taken from, `[term]`, as `Isa::pick` reads it.
    places: [[[u32; 16]; 4]; 3],
    coefficients: [[[f32; 16]; 4]; 3],
    offset_lo: [[f32; 16]; 4],
    offset_hi: [[f32; 16]; 4],
    /// The directions of B.
    set: DirectionSet,
}

/// `FACTORS` by axis and row.
pub(super) const FACTORS_BY_AXIS: [[f64; 16]; 3] = {
    let mut factors = [[0.0; 16]; 3];
    let mut slab = 0;
    while slab < 13 {
        let mut axis = 0;
        while axis < 3 {
            factors[axis][row(slab)] = FACTORS[slab][axis];
            axis += 1;
        }
        slab += 1;
    }
    factors
};

/// For each cone of a set, the three ends that make up the upper end, ten bits each: the row, and in the higher five the
/// place in its `Part`. Each of the terms of a set keeps to one part.
const fn ends_by_cone(set: DirectionSet) -> [u32; 64] {
    let rows = rows_by_cone(set);
    let mut ends = [0; 64];
    let mut cone = 0;
    while cone < 64 {
        let mut term = 0;
        while term < 3 {
            let end = rows[cone] >> (8 * term) & 31;
            let row = end & 15;
            let place = match row {
                0..3 => row,
                3..8 => row - 3,
                _ => (row & 3) + 2 * (row & 4),
            };
            ends[cone] |= (end | (place + end / 16 * 4) << 5) << (10 * term);
            term += 1;
        }
        cone += 1;
    }
    ends
}

impl Alignment {
    /// An empty alignment, before the first pose is prepared.
    pub(crate) const NONE: Self = Self {
        places: [[[0; 16]; 4]; 3],
        coefficients: [[[0.0; 16]; 4]; 3],
        offset_lo: [[0.0; 16]; 4],
        offset_hi: [[0.0; 16]; 4],
        set: DirectionSet::Dop6,
    };

    /// Prepares a pose in place, because an alignment takes 50 cache lines. `reach_b` bounds the slab ends of B's nodes.
    #[inline(always)]
    pub(crate) fn prepare<I: Isa>(
        &mut self,
        isa: I,
        placement: &Placement,
        set_b: DirectionSet,
        reach_b: f32,
    ) {
        match set_b {
            DirectionSet::Dop6 => self.prepare_set(isa, placement, DirectionSet::Dop6, reach_b),
            DirectionSet::Dop14 => self.prepare_set(isa, placement, DirectionSet::Dop14, reach_b),
            DirectionSet::Dop26 => self.prepare_set(isa, placement, DirectionSet::Dop26, reach_b),
        }
    }

    #[inline(always)]
    fn prepare_set<I: Isa>(&mut self, isa: I, placement: &Placement, set: DirectionSet, reach_b: f32) {
        let (r, t) = (&placement.rotation, &placement.translation);
        // One array per quantity, so that all directions go through vector registers at once.
        let mut cones = [0; 16];
        let mut coefficients = [[0.0f32; 16]; 3];
        let (mut offset_lo, mut offset_hi) = ([0.0; 16], [0.0; 16]);
        for row in 0..16 {
            let [x, y, z] = [FACTORS_BY_AXIS[0][row], FACTORS_BY_AXIS[1][row], FACTORS_BY_AXIS[2][row]];
            let seen = [
                r[0][0] * x + r[1][0] * y + r[2][0] * z,
                r[0][1] * x + r[1][1] * y + r[2][1] * z,
                r[0][2] * x + r[1][2] * y + r[2][2] * z,
            ];
            let offset = t[0] * x + t[1] * y + t[2] * z;
            let [c0, c1, c2] = magnitudes(seen, set);
            let rounded = [c0 as f32, c1 as f32, c2 as f32];
            let error = form_error(rounded, reach_b, offset) + 3.0 * placement.error;
            cones[row] = cone(seen);
            (coefficients[0][row], coefficients[1][row], coefficients[2][row]) =
                (rounded[0], rounded[1], rounded[2]);
            (offset_lo[row], offset_hi[row]) = ((offset - error) as f32, (offset + error) as f32);
        }
        let ends = match set {
            DirectionSet::Dop6 => const { &ends_by_cone(DirectionSet::Dop6) },
            DirectionSet::Dop14 => const { &ends_by_cone(DirectionSet::Dop14) },
            DirectionSet::Dop26 => const { &ends_by_cone(DirectionSet::Dop26) },
        };
        let ends = cones.map(|cone| ends[(cone & 63) as usize]);
        for (term, coefficients) in coefficients.iter_mut().enumerate() {
            let ends = ends.map(|ends| ends >> (10 * term));
            for row in 0..16 {
                // The coefficients of lower ends, which have rows below 16, are negative.
                coefficients[row] = f32::from_bits(coefficients[row].to_bits() ^ (!ends[row] & 16) << 27);
            }
            isa.places(&ends, &mut self.places[term]);
            spread(isa, coefficients, &mut self.coefficients[term]);
        }
        spread(isa, &offset_lo, &mut self.offset_lo);
        spread(isa, &offset_hi, &mut self.offset_hi);
        self.set = set;
    }

    /// Computes the ends of four nodes of B along the directions `to` of A, outward.
    #[inline(always)]
    pub(crate) fn align<I: Isa>(&self, isa: I, to: DirectionSet, group: &Group, aligned: &mut Group) {
        match self.set {
            DirectionSet::Dop6 => self.align_terms(isa, [Part::Axes; 3], to, group, aligned),
            DirectionSet::Dop14 => {
                self.align_terms(isa, [Part::Axes, Part::Cube, Part::Cube], to, group, aligned)
            }
            DirectionSet::Dop26 => {
                self.align_terms(isa, [Part::Axes, Part::Faces, Part::Cube], to, group, aligned)
            }
        }
    }

    /// Aligns four nodes, given the part of a group that each term takes its ends from.
    #[inline(always)]
    fn align_terms<I: Isa>(
        &self,
        isa: I,
        parts: [Part; 3],
        to: DirectionSet,
        group: &Group,
        aligned: &mut Group,
    ) {
        match to {
            DirectionSet::Dop6 => self.align_rows::<I, 1>(isa, parts, group, aligned),
            DirectionSet::Dop14 => self.align_rows::<I, 2>(isa, parts, group, aligned),
            DirectionSet::Dop26 => self.align_rows::<I, 4>(isa, parts, group, aligned),
        }
    }

    #[inline(always)]
    fn align_rows<I: Isa, const REGISTERS: usize>(
        &self,
        isa: I,
        parts: [Part; 3],
        group: &Group,
        aligned: &mut Group,
    ) {
        let rows = isa.rows(group);
        for q in 0..REGISTERS {
            let (mut lo, mut hi) = (isa.load(&self.offset_lo[q]), isa.load(&self.offset_hi[q]));
            for term in 0..3 {
                let (end, other) = isa.pick(&rows, parts[term], &self.places[term][q]);
                let coefficients = isa.load(&self.coefficients[term][q]);
                // Not fused, so that the ends, and with them the order of visits, are the same on every backend.
                hi = end.mul(coefficients).add(hi);
                lo = other.mul(coefficients).add(lo);
            }
            isa.store(lo, &mut aligned.lo[q]);
            isa.store(hi, &mut aligned.hi[q]);
        }
    }
}

/// Repeats each value four times, for the four nodes of its row.
#[inline(always)]
fn spread<I: Isa>(isa: I, values: &[f32; 16], to: &mut [[f32; 16]; 4]) {
    for (register, values) in to.iter_mut().zip(values.as_chunks::<4>().0) {
        isa.store(isa.repeat(values), register);
    }
}

/// Prepares a pose in a task, compiled once for all walks.
pub(crate) struct Prepare<'a> {
    pub(crate) alignment: &'a mut Alignment,
    pub(crate) placement: &'a Placement,
    pub(crate) set: DirectionSet,
    pub(crate) reach: f32,
}

impl Task for Prepare<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        self.alignment.prepare(isa, self.placement, self.set, self.reach);
    }
}

/// Bound on the error of evaluating a form plus an offset in f32, the rounding of the offset less or
/// more this error included: 8u of the terms, and 2u of the offset and of all this; and what underflows.
#[inline(always)]
pub(crate) fn form_error([x, y, z]: [f32; 3], reach: f32, offset: f64) -> f64 {
    let terms = f64::from(reach) * f64::from(x.abs() + y.abs() + z.abs());
    10.0 * f64::from(U) * (terms + offset.abs()) + END_UNDERFLOW
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::Backend;
    use crate::numerics::POSE_ERROR;
    use crate::pose::Pose;
    use bvh_format::kdop::Kdop;
    use bvh_format::slabs::NodeSlabs;
    use bvh_format::treelet::child_slabs;
    use cbvh_testkit::Random;

    /// The ends of a node along the directions of a set, as a backend aligns them.
    struct Aligned<'a>(&'a Placement, DirectionSet, DirectionSet, &'a NodeSlabs);

    impl Task for Aligned<'_> {
        type Output = NodeSlabs;

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) -> NodeSlabs {
            let Self(placement, of, to, node) = self;
            let (mut aligned, mut alignment) = (Group::ZERO, Alignment::NONE);
            alignment.prepare(isa, placement, of, 3.0);
            alignment.align(isa, to, &Group::of_one(node), &mut aligned);
            child_slabs(&aligned, 0)
        }
    }

    /// A matrix as far from a rotation as a pose may be: its transpose as an inverse would be off by 2^-20 of the
    /// coordinates, many times what is charged.
    #[test]
    fn nodes_of_a_contain_their_points_along_directions_of_b() {
        let mut random = Random::new(7);
        let mut random = || random.signed();
        let backends: Vec<Backend> =
            Backend::ALL.into_iter().filter(|backend| backend.is_available()).collect();
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
                let backend = backends[round as usize / 2 % backends.len()];
                for point in &points {
                    let node = NodeSlabs::from_kdop(&Kdop::of_points([*point]), set_a.slabs());
                    // Where B's frame has the point: solved by elimination, z first.
                    let [x, y, z] = [0, 1, 2].map(|axis| f64::from(point[axis]) - translation[axis]);
                    let seen = [cos * x + sin * y - shear * z, cos * y - sin * x, z];
                    let aligned = backend.run(Aligned(&inverse, set_a, set_b, &node));
                    for slab in 0..set_b.slabs() {
                        let (lo, hi) = (aligned.lo[row(slab)], aligned.hi[row(slab)]);
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
