//! Fixed directions and the k-DOPs over them: the shape that bounds triangles.
//!
//! A direction set is a prefix of one list of 13 integer vectors: 3 axes, then 4 cube diagonals,
//! then 6 face diagonals, so that the sets nest (6 in 14 in 26). Directions are *not* normalised:
//! a slab along `(1, 1, 1)` holds `x + y + z`. That keeps sums of coordinates free of products.
//!
//! A k-DOP here is a pair of `f32` bounds per direction, rounded outward: the true extent of the
//! geometry lies within `[lo, hi]` along each direction.

/// The list of directions. `DIRECTIONS[..3]` are a box's, `[..7]` dop14's, `[..13]` dop26's.
pub const DIRECTIONS: [[i8; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [-1, 1, 1],
    [1, 1, 0],
    [1, 0, 1],
    [0, 1, 1],
    [1, -1, 0],
    [1, 0, -1],
    [0, 1, -1],
];

/// How many directions a node is bounded along; k counts both ends of each slab.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DirectionSet {
    /// 3 slabs: the axis-aligned box.
    Dop6,
    /// 7 slabs: box and cube diagonals.
    Dop14,
    /// 13 slabs: box, cube diagonals and face diagonals.
    Dop26,
}

impl DirectionSet {
    /// Number of slabs: k / 2.
    pub const fn slabs(self) -> usize {
        match self {
            Self::Dop6 => 3,
            Self::Dop14 => 7,
            Self::Dop26 => 13,
        }
    }

    /// The larger of two sets; every other set is a part of it.
    pub fn max(self, other: Self) -> Self {
        if self >= other { self } else { other }
    }
}

/// A k-DOP over all 13 directions; code for a smaller set leaves the rest alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kdop {
    /// Lower ends, rounded down.
    pub lo: [f32; 13],
    /// Upper ends, rounded up.
    pub hi: [f32; 13],
}

impl Kdop {
    /// The bound of nothing: joins with any other to that other.
    pub const EMPTY: Self = Self { lo: [f32::INFINITY; 13], hi: [f32::NEG_INFINITY; 13] };

    /// The k-DOP of points: the nearest `f32` outside their exact projections.
    ///
    /// Projections add at most three `f32`. Sums are taken in `f64` with the error of each addition
    /// recovered exactly (Knuth's two-sum). Where no sum can have an error, as nearly everywhere, none is
    /// looked for.
    pub fn of_points(points: impl IntoIterator<Item = [f32; 3]>) -> Self {
        let (mut lo, mut hi) = ([f64::INFINITY; 13], [f64::NEG_INFINITY; 13]);
        for point in points {
            let [x, y, z] = point.map(f64::from);
            if sums_are_exact(point) {
                let sums = projections([x, y, z]);
                for slab in 0..13 {
                    let sum = sums[slab];
                    lo[slab] = if sum < lo[slab] { sum } else { lo[slab] };
                    hi[slab] = if sum > hi[slab] { sum } else { hi[slab] };
                }
                continue;
            }
            for slab in 0..13 {
                let [a, b, c] = FACTORS[slab];
                let (below, above) = sum_of_three(a * x, b * y, c * z);
                lo[slab] = if below < lo[slab] { below } else { lo[slab] };
                hi[slab] = if above > hi[slab] { above } else { hi[slab] };
            }
        }
        Self { lo: lo.map(round_down), hi: hi.map(|end| -round_down(-end)) }
    }

    /// Grows the first `slabs` slabs by another k-DOP.
    #[inline]
    pub fn join(&mut self, other: &Self, slabs: usize) {
        for slab in 0..slabs {
            // Not `min` and `max`: there is no NaN to care for.
            let (lo, hi) = (other.lo[slab], other.hi[slab]);
            self.lo[slab] = if lo < self.lo[slab] { lo } else { self.lo[slab] };
            self.hi[slab] = if hi > self.hi[slab] { hi } else { self.hi[slab] };
        }
    }

    /// True if the first `slabs` slabs of `self` contain those of `inner`.
    pub fn contains(&self, inner: &Self, slabs: usize) -> bool {
        (0..slabs).all(|slab| self.lo[slab] <= inner.lo[slab] && self.hi[slab] >= inner.hi[slab])
    }

    /// Surface area of the axis-aligned box in the first three slabs, in square mesh units.
    pub fn box_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|a| f64::from(self.hi[a]) - f64::from(self.lo[a]));
        2.0 * (x * y + y * z + z * x)
    }
}

/// The directions as factors.
pub const FACTORS: [[f64; 3]; 13] = {
    let mut factors = [[0.0; 3]; 13];
    let mut slab = 0;
    while slab < 13 {
        let [x, y, z] = DIRECTIONS[slab];
        factors[slab] = [x as f64, y as f64, z as f64];
        slab += 1;
    }
    factors
};

/// True if sums and differences of a point's coordinates are surely exact in `f64`: the coordinates that are
/// not 0 are less than 2^28 apart in magnitude. Sums of three then have no more than the 53 bits from two
/// above the largest to the last of the smallest.
#[inline(always)]
fn sums_are_exact(point: [f32; 3]) -> bool {
    let magnitudes = point.map(|value| value.to_bits() & 0x7fff_ffff);
    let largest = magnitudes.map(|bits| bits >> 23);
    // 0 wraps to more than any; a power of two counts as half of itself.
    let smallest = magnitudes.map(|bits| bits.wrapping_sub(1) >> 23);
    let [largest, smallest] =
        [largest.into_iter().max(), smallest.into_iter().min()].map(Option::unwrap_or_default);
    largest <= smallest + 27
}

/// The projections of a point onto all directions, each exact if all sums are.
#[inline(always)]
fn projections([x, y, z]: [f64; 3]) -> [f64; 13] {
    let (sum, difference) = (x + y, x - y);
    let (a, b, c, d) = (sum + z, sum - z, difference + z, z - difference);
    [x, y, z, a, b, c, d, sum, x + z, y + z, difference, x - z, y - z]
}

/// The nearest `f32` at or below.
fn round_down(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) > value { nearest.next_down() } else { nearest }
}

/// The nearest `f64` at or below and at or above `a + b + c`, for `f32` values.
fn sum_of_three(a: f64, b: f64, c: f64) -> (f64, f64) {
    let (sum_ab, error_ab) = two_sum(a, b);
    let (sum, error_c) = two_sum(sum_ab, c);
    // The errors may count for more than the sum, where c cancels a + b.
    let (error, error_of_error) = two_sum(error_ab, error_c);
    let (sum, rest) = two_sum(sum, error);
    // `rest` is half of the spacing of `sum` at most. There is an error of the error only if `error_c` is not 0;
    // then c has cancelled less than half of the sum (Sterbenz), `error` is below 2^-51 of it, and the error of
    // that far below half of the spacing. So the next number is beyond all that is left.
    let rest = rest + error_of_error;
    let below = if rest < 0.0 { sum.next_down() } else { sum };
    let above = if rest > 0.0 { sum.next_up() } else { sum };
    (below, above)
}

/// `a + b` rounded, and the exact error of that rounding.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A test's number in units of 2^-100: points are multiples of 2^-62, and so are sums, of which those that
    /// aren't 0 have neighbours that are multiples of 2^-86.
    fn units(value: f32) -> i128 {
        (f64::from(value) * 2f64.powi(100)) as i128
    }

    #[test]
    fn projections_round_outward_and_stay_tight() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let exponent = -((state >> 59) as i32);
            (((state >> 20) as u32 & 0xff_ffff) as f32 - 8388608.0) * 2f32.powi(exponent - 24)
        };
        let mut points: Vec<[f32; 3]> = (0..20_000).map(|_| [random(), random(), random()]).collect();
        // One coordinate cancels another; the third is below the last bit of either, or of their sum.
        for _ in 0..5_000 {
            let (x, tiny) = (random(), (random() * 32.0).round() * 2f32.powi(-62));
            let nearly = if random() > 0.0 { x } else { x.next_up() };
            let sum = random() + x;
            points.extend([[x, tiny, -nearly], [tiny, x, -nearly], [x, -nearly, tiny], [x - sum, tiny, sum]]);
        }
        points.push([1.0, 2f32.powi(-60), -1.0]);
        for point in points {
            for direction in DIRECTIONS {
                let kdop = Kdop::of_points([point]);
                let slab = DIRECTIONS.iter().position(|&d| d == direction).unwrap();
                let (lo, hi) = (kdop.lo[slab], kdop.hi[slab]);
                let truth: i128 = (0..3).map(|a| units(point[a]) * i128::from(direction[a])).sum();
                assert!(units(lo) <= truth && truth <= units(hi));
                let tight = (units(lo) == truth || units(lo.next_up()) > truth)
                    && (units(hi) == truth || units(hi.next_down()) < truth);
                assert!(tight, "{lo:e} to {hi:e}, not tight: {point:?} {direction:?}");
            }
        }
    }

    #[test]
    fn projections_are_those_of_the_directions() {
        let point = [3.0, 50.0, 700.0];
        let along = FACTORS.map(|factor| (0..3).map(|axis| factor[axis] * point[axis]).sum::<f64>());
        assert_eq!(projections(point), along);
    }

    #[test]
    fn sums_said_to_be_exact_are() {
        let odd = |exponent: i32| ((1 << 24) - 1) as f32 * 2f32.powi(exponent);
        let subnormal = f32::from_bits(3);
        for (point, exact) in [
            ([odd(0), odd(27), odd(27)], true),
            ([odd(0), -odd(28), odd(27)], false),
            ([0.0, odd(100), -0.0], true),
            ([0.0, 0.0, 0.0], true),
            ([subnormal, f32::MIN_POSITIVE, 0.0], true),
            ([subnormal, 1.0, 0.0], false),
        ] {
            assert_eq!(sums_are_exact(point), exact, "{point:?}");
            if exact {
                let [x, y, z] = point.map(f64::from);
                let errors = [x, -x].map(|x| {
                    [y, -y].map(|y| {
                        let (sum, error) = two_sum(x, y);
                        [error, two_sum(sum, z).1, two_sum(x, z).1, two_sum(y, z).1]
                    })
                });
                assert!(errors.as_flattened().as_flattened().iter().all(|&error| error == 0.0), "{point:?}");
            }
        }
    }

    #[test]
    fn containing_asks_for_both_ends_of_the_first_slabs() {
        let inner = Kdop { lo: [-1.0; 13], hi: [1.0; 13] };
        assert!(inner.contains(&inner, 13));
        for slab in 0..13 {
            let (mut above, mut below) = (inner, inner);
            (above.lo[slab], above.hi[slab]) = (-0.5, 2.0);
            (below.lo[slab], below.hi[slab]) = (-2.0, 0.5);
            for set in [DirectionSet::Dop6, DirectionSet::Dop14, DirectionSet::Dop26] {
                let expected = slab >= set.slabs();
                assert_eq!(above.contains(&inner, set.slabs()), expected, "{slab} {set:?}");
                assert_eq!(below.contains(&inner, set.slabs()), expected, "{slab} {set:?}");
            }
        }
    }

    #[test]
    fn the_area_of_a_box_is_that_of_its_six_faces() {
        let kdop = Kdop::of_points([[-1.0, 7.0, 10.0], [1.0, 4.0, 15.0]]);
        assert_eq!(kdop.box_area(), f64::from(2 * 2 * 3 + 2 * 3 * 5 + 2 * 5 * 2));
    }

    #[test]
    fn sets_nest() {
        assert_eq!(DirectionSet::Dop6.max(DirectionSet::Dop26).slabs(), 13);
        for (i, a) in DIRECTIONS.iter().enumerate() {
            for b in &DIRECTIONS[..i] {
                assert_ne!(*a, *b);
                assert_ne!(*a, b.map(|v| -v));
            }
        }
    }
}
