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
    /// From a word of rows.
    #[inline(always)]
    pub fn new(rows: u32, coefficients: [f32; 3]) -> Self {
        let [x, y, z, _] = rows.to_le_bytes();
        Self { rows: [x, y, z], coefficients }
    }

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

/// Slab of the cube diagonal with these signs, and whether it points the other way; bit i is set where
/// coordinate i is negative.
const CUBE_DIAGONALS: [(u8, bool); 8] =
    [(3, false), (6, false), (5, false), (4, true), (4, false), (5, true), (6, true), (3, true)];

/// Which cone around the directions of a set `d` is in: bits 0 to 2 tell the order of the magnitudes of its
/// coordinates, as in `ORDERS`, bits 3 to 5 their signs, set where negative. Signs are taken as bits, of
/// differences too, so that many directions go through vector registers.
#[inline(always)]
pub fn cone([x, y, z]: [f64; 3]) -> u64 {
    let negative = |value: f64| value.to_bits() >> 63;
    let less = |a: f64, b: f64| negative(a.abs() - b.abs());
    let order = less(x, y) | less(y, z) << 1 | less(x, z) << 2;
    order | negative(x) << 3 | negative(y) << 4 | negative(z) << 5
}

/// The rows of the three ends that make up the upper end along the directions of a cone. Coefficients are
/// negative for lower ends, which have rows below 16. In one word, a row a byte, the first lowest.
#[inline(always)]
pub fn rows_of_cone(cone: u64, set: DirectionSet) -> u32 {
    let rows = match set {
        DirectionSet::Dop6 => const { &rows_by_cone(DirectionSet::Dop6) },
        DirectionSet::Dop14 => const { &rows_by_cone(DirectionSet::Dop14) },
        DirectionSet::Dop26 => const { &rows_by_cone(DirectionSet::Dop26) },
    };
    rows[(cone & 63) as usize]
}

/// The magnitudes of the three coefficients along `d`.
#[inline(always)]
pub fn magnitudes(d: [f64; 3], set: DirectionSet) -> [f64; 3] {
    let [x, y, z] = [d[0].abs(), d[1].abs(), d[2].abs()];
    let (less, more) = if x < y { (x, y) } else { (y, x) };
    let largest = if more < z { z } else { more };
    let rest = if more < z { more } else { z };
    let (middle, least) = if less < rest { (rest, less) } else { (less, rest) };
    match set {
        DirectionSet::Dop6 => [largest, middle, least],
        DirectionSet::Dop14 => [largest - middle, (middle + least) / 2.0, (middle - least) / 2.0],
        DirectionSet::Dop26 => [largest - middle, middle - least, least],
    }
}

/// The coefficient of this magnitude for end `j` of a word of rows: negative for lower ends.
#[inline(always)]
pub fn signed(magnitude: f32, rows: u32, j: usize) -> f32 {
    f32::from_bits(magnitude.to_bits() ^ (!(rows >> (8 * j)) & 16) << 27)
}

/// The form of the upper end along `d` over the directions of a set.
#[inline(always)]
pub fn upper_form(d: [f64; 3], set: DirectionSet) -> Form {
    let (rows, magnitudes) = (rows_of_cone(cone(d), set), magnitudes(d, set));
    Form::new(rows, [0, 1, 2].map(|j| signed(magnitudes[j] as f32, rows, j)))
}

/// What `rows_of_cone` says of all 64 cones.
pub const fn rows_by_cone(set: DirectionSet) -> [u32; 64] {
    let mut rows = [0; 64];
    let mut cone = 0;
    while cone < 64 {
        let [p0, p1, p2] = ORDERS[cone & 7];
        let negative = (cone >> 3) as u8;
        let (near, far) = (negative as usize, (negative ^ 1 << p2) as usize);
        let terms = match set {
            DirectionSet::Dop6 => {
                [(p0, is_set(negative, p0)), (p1, is_set(negative, p1)), (p2, is_set(negative, p2))]
            }
            DirectionSet::Dop14 => [(p0, is_set(negative, p0)), CUBE_DIAGONALS[near], CUBE_DIAGONALS[far]],
            DirectionSet::Dop26 => {
                // The face diagonal in the plane of the two larger coordinates; it starts with +1.
                let differ = is_set(negative, p0) != is_set(negative, p1);
                let face = 9 - p2 + if differ { 3 } else { 0 };
                let first = if p0 < p1 { p0 } else { p1 };
                [(p0, is_set(negative, p0)), (face, is_set(negative, first)), CUBE_DIAGONALS[near]]
            }
        };
        let mut j = 0;
        while j < 3 {
            let (slab, against) = terms[j];
            rows[cone] |= (row(slab as usize) as u32 + if against { 0 } else { 16 }) << (8 * j);
            j += 1;
        }
        cone += 1;
    }
    rows
}

const fn is_set(bits: u8, bit: u8) -> bool {
    bits >> bit & 1 == 1
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
                    assert_eq!(form.rows[j] >= 16, coefficient.is_sign_positive());
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
