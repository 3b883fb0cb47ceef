//! Bounds how far a k-DOP reaches along any direction, in closed form. Queries use it to realign the k-DOPs of one mesh
//! with the directions of another.
//!
//! Let `d = sum c_j n_j` over directions `n_j` of the set. Then each point x of the k-DOP has `d . x <= sum c_j end_j`,
//! where `end_j` is the upper end of slab j if `c_j` is positive, and the lower end if it is negative (duality of
//! linear programs). Of all such sums over three directions, that over the three neighbours of `d` in the set is the
//! least for a ball, and close to the least for any round body. The neighbours follow from the order of the magnitudes
//! of the coordinates of `d`. The method is that of Zachmann (VRAIS 1998), who uses the three faces at the extreme
//! vertex.

use bvh_format::kdop::DirectionSet;
use bvh_format::slabs::row;

/// A linear form over the slab ends of a node: the rows of three ends, and their coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Form {
    /// Rows of a decoded group: 0 to 15 for lower ends, 16 to 31 for upper ends.
    pub(crate) rows: [u8; 3],
    /// The factors of the ends.
    pub(crate) coefficients: [f32; 3],
}

impl Form {
    /// Makes a form from a word of rows, as [`rows_by_cone`] has them.
    #[inline(always)]
    fn new(rows: u32, coefficients: [f32; 3]) -> Self {
        let [x, y, z, _] = rows.to_le_bytes();
        Self { rows: [x, y, z], coefficients }
    }

    /// Returns the form of the lower end along the same direction, which takes the other end of each slab.
    #[inline(always)]
    pub(crate) fn mirrored(self) -> Self {
        Self { rows: self.rows.map(|row| row ^ 16), ..self }
    }
}

/// The axes in the order of falling magnitude, for each outcome of three comparisons: |x| < |y|, |y| < |z|, |x| < |z|. The
/// fourth and the fifth of the eight outcomes are contradictions and cannot occur.
const ORDERS: [[u8; 3]; 8] =
    [[0, 1, 2], [1, 0, 2], [0, 2, 1], [0, 1, 2], [0, 1, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The slab of the cube diagonal with given signs, and whether its direction points the other way. Bit i of the index is
/// set if coordinate i is negative.
const CUBE_DIAGONALS: [(u8, bool); 8] =
    [(3, false), (6, false), (5, false), (4, true), (4, false), (5, true), (6, true), (3, true)];

/// Returns the number of the cone that contains `d`. Bits 0 to 2 tell the order of the magnitudes of its coordinates, as
/// in `ORDERS`; bits 3 to 5 are set for negative coordinates. Comparisons take the sign bits of differences, so that
/// compilers handle many directions in vector registers.
#[inline(always)]
pub(crate) fn cone([x, y, z]: [f64; 3]) -> u64 {
    let negative = |value: f64| value.to_bits() >> 63;
    let less = |a: f64, b: f64| negative(a.abs() - b.abs());
    let order = less(x, y) | less(y, z) << 1 | less(x, z) << 2;
    order | negative(x) << 3 | negative(y) << 4 | negative(z) << 5
}

/// Returns the rows of the three ends that make up the upper end along the directions of a cone. They are packed into
/// one word, one row per byte, the first one lowest. Rows below 16 are lower ends and have negative coefficients.
#[inline(always)]
fn rows_of_cone(cone: u64, set: DirectionSet) -> u32 {
    let rows = match set {
        DirectionSet::Dop6 => const { &rows_by_cone(DirectionSet::Dop6) },
        DirectionSet::Dop14 => const { &rows_by_cone(DirectionSet::Dop14) },
        DirectionSet::Dop26 => const { &rows_by_cone(DirectionSet::Dop26) },
    };
    rows[(cone & 63) as usize]
}

/// Returns the magnitudes of the three coefficients along `d`.
#[inline(always)]
pub(crate) fn magnitudes(d: [f64; 3], set: DirectionSet) -> [f64; 3] {
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

/// Returns the coefficient of end `j` of a word of rows, given its magnitude: negative for lower ends.
#[inline(always)]
fn signed(magnitude: f32, rows: u32, j: usize) -> f32 {
    f32::from_bits(magnitude.to_bits() ^ (!(rows >> (8 * j)) & 16) << 27)
}

/// Returns the form of the upper end along `d` over the directions of a set.
#[inline(always)]
pub(crate) fn upper_form(d: [f64; 3], set: DirectionSet) -> Form {
    let (rows, magnitudes) = (rows_of_cone(cone(d), set), magnitudes(d, set));
    Form::new(rows, [0, 1, 2].map(|j| signed(magnitudes[j] as f32, rows, j)))
}

/// Returns the words of rows of all 64 cones: for each, the three ends that make up the upper end, one row per byte.
pub(crate) const fn rows_by_cone(set: DirectionSet) -> [u32; 64] {
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
                // The face diagonal in the plane of the two larger coordinates. Its first coordinate is +1.
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
    use bvh_format::kdop::DIRECTIONS;
    use cbvh_testkit::Random;

    /// How far a form says that the k-DOP of a unit ball reaches: each end is the length of its direction.
    fn reach_of_ball(slabs: [usize; 3], coefficients: [f64; 3]) -> f64 {
        let length = |slab: usize| DIRECTIONS[slab].iter().map(|&v| f64::from(v * v)).sum::<f64>().sqrt();
        (0..3).map(|j| coefficients[j].abs() * length(slabs[j])).sum()
    }

    /// The least such reach over all triples of slabs, by Cramer's rule.
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
        let mut random = Random::new(5);
        let mut random = || random.signed();
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
        let mut random = Random::new(11);
        let mut random = || random.signed();
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
