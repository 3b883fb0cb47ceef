//! How far a k-DOP reaches along any direction: three of its slabs, in closed form.
//!
//! If `d = sum c_j n_j` over directions `n_j` of the set, every point of the k-DOP has
//! `d . x <= sum c_j end_j`, where `end_j` is the upper end of slab j for a positive coefficient and the
//! lower for a negative: linear programming duality. Of all such sums, the three neighbours of `d`
//! among the set's directions give the least for a ball, and one close to it for anything round.
//! They follow from the order of the magnitudes of the coordinates of `d`. Method: Zachmann, VRAIS
//! 1998, where the three faces at the extreme vertex are used.

use crate::kdop::DirectionSet;
use crate::slabs::row;

/// A linear form over the slab ends of a node: three ends by row, three coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Form {
    /// Rows of a decoded group: lower ends 0 to 15, upper ends 16 to 31.
    pub rows: [u8; 3],
    /// Factors of the ends.
    pub coefficients: [f32; 3],
}

impl Form {
    /// The form of the lower end along the same direction: the other end of each slab.
    #[inline(always)]
    pub fn mirrored(self) -> Self {
        Self { rows: self.rows.map(|row| row ^ 16), ..self }
    }
}

/// Axes by falling magnitude, by the outcome of three comparisons: |x| < |y|, |y| < |z|, |x| < |z|. Of the
/// eight outcomes the fourth and the fifth contradict themselves.
const ORDERS: [[u8; 3]; 8] =
    [[0, 1, 2], [1, 0, 2], [0, 2, 1], [0, 1, 2], [0, 1, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Slab and sense of the cube diagonal with these signs; bit i is set where coordinate i is negative.
const CUBE_DIAGONALS: [(u8, f64); 8] =
    [(3, 1.0), (6, 1.0), (5, 1.0), (4, -1.0), (4, 1.0), (5, -1.0), (6, -1.0), (3, -1.0)];

/// The form of the upper end along `d` over the directions of a set.
#[inline(always)]
pub fn upper_form(d: [f64; 3], set: DirectionSet) -> Form {
    let m = [d[0].abs(), d[1].abs(), d[2].abs()];
    let order = usize::from(m[0] < m[1]) | usize::from(m[1] < m[2]) << 1 | usize::from(m[0] < m[2]) << 2;
    let [p0, p1, p2] = ORDERS[order];
    let (m0, m1, m2) = (m[usize::from(p0)], m[usize::from(p1)], m[usize::from(p2)]);
    let negative = u8::from(d[0] < 0.0) | u8::from(d[1] < 0.0) << 1 | u8::from(d[2] < 0.0) << 2;
    let sense = |axis: u8| 1.0 - 2.0 * f64::from(negative >> axis & 1);
    let terms = match set {
        DirectionSet::Dop6 => [(p0, sense(p0) * m0), (p1, sense(p1) * m1), (p2, sense(p2) * m2)],
        DirectionSet::Dop14 => {
            let (near, near_sense) = CUBE_DIAGONALS[usize::from(negative & 7)];
            let (far, far_sense) = CUBE_DIAGONALS[usize::from((negative ^ 1 << p2) & 7)];
            [
                (p0, sense(p0) * (m0 - m1)),
                (near, near_sense * (m1 + m2) / 2.0),
                (far, far_sense * (m1 - m2) / 2.0),
            ]
        }
        DirectionSet::Dop26 => {
            let (cube, cube_sense) = CUBE_DIAGONALS[usize::from(negative & 7)];
            // The face diagonal in the plane of the two larger coordinates; it starts with +1.
            let differ = (negative >> p0 ^ negative >> p1) & 1;
            let face = 9 - p2 + 3 * differ;
            [(p0, sense(p0) * (m0 - m1)), (face, sense(p0.min(p1)) * (m1 - m2)), (cube, cube_sense * m2)]
        }
    };
    let mut form = Form::default();
    for (j, (slab, coefficient)) in terms.into_iter().enumerate() {
        form.rows[j] = row(usize::from(slab)) as u8 + if coefficient < 0.0 { 0 } else { 16 };
        form.coefficients[j] = coefficient as f32;
    }
    form
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdop::DIRECTIONS;

    /// The reach of a unit ball's k-DOP by a form: each end is the length of its direction.
    fn reach_of_ball(slabs: [usize; 3], coefficients: [f64; 3]) -> f64 {
        let length = |slab: usize| DIRECTIONS[slab].iter().map(|&v| f64::from(v * v)).sum::<f64>().sqrt();
        (0..3).map(|j| coefficients[j].abs() * length(slabs[j])).sum()
    }

    /// The least reach of a unit ball over all triples of slabs, by Cramer's rule.
    fn least_reach(d: [f64; 3], set: DirectionSet) -> f64 {
        let column = |slab: usize| DIRECTIONS[slab].map(f64::from);
        let det = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        let mut least = f64::INFINITY;
        for i in 0..set.slabs() {
            for j in 0..i {
                for k in 0..j {
                    let (a, b, c) = (column(i), column(j), column(k));
                    let whole = det(a, b, c);
                    if whole != 0.0 {
                        let solved = [det(d, b, c) / whole, det(a, d, c) / whole, det(a, b, d) / whole];
                        least = least.min(reach_of_ball([i, j, k], solved));
                    }
                }
            }
        }
        least
    }

    #[test]
    fn forms_are_the_tightest_for_a_ball() {
        let mut state = 5u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        for _ in 0..2000 {
            let d = [random(), random(), random()];
            for set in [DirectionSet::Dop6, DirectionSet::Dop14, DirectionSet::Dop26] {
                let form = upper_form(d, set);
                let slab = |held: u8| (0..13).find(|&s| row(s) == usize::from(held & 15)).expect("a slab");
                let found = reach_of_ball(form.rows.map(slab), form.coefficients.map(f64::from));
                assert!((found - least_reach(d, set)).abs() < 1e-6, "{set:?} {d:?}");
            }
        }
    }

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
                    assert!((sum[i] - d[i]).abs() < 2f64.powi(-22), "{set:?} {d:?} {sum:?}");
                }
            }
        }
    }
}
