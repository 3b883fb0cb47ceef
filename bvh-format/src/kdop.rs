//! Fixed directions, and the k-DOPs over them that bound triangles.
//!
//! All direction sets are prefixes of one list of 13 integer vectors, so they nest: 3 axes, then 4 cube diagonals, then
//! 6 face diagonals give k = 6, 14 and 26. Directions are *not* normalised: a slab along `(1, 1, 1)` bounds
//! `x + y + z`. Projections therefore need no products.
//!
//! A k-DOP is a pair of `f32` ends per direction, rounded outward: along each direction, the true extent of the geometry
//! lies within `[lo, hi]`.

use crate::ordered::{from_ordered, to_ordered};

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

/// The directions along which a node is bounded; k counts both ends of each slab.
///
/// The list is part of the major version of the format. It is not marked as non-exhaustive: code that has a case for
/// each set does not compile until it has one for a new set.
///
/// ```
/// use bvh_format::kdop::{DIRECTIONS, DirectionSet};
///
/// assert_eq!(DirectionSet::Dop14.slabs(), 7);
/// assert_eq!(DIRECTIONS[..DirectionSet::Dop6.slabs()], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]);
/// assert_eq!(DirectionSet::Dop14.max(DirectionSet::Dop26), DirectionSet::Dop26);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DirectionSet {
    /// 3 slabs: an axis-aligned box.
    Dop6,
    /// 7 slabs: a box and the cube diagonals.
    Dop14,
    /// 13 slabs: a box, the cube diagonals and the face diagonals.
    Dop26,
}

impl DirectionSet {
    /// The number of slabs: k / 2.
    pub const fn slabs(self) -> usize {
        match self {
            Self::Dop6 => 3,
            Self::Dop14 => 7,
            Self::Dop26 => 13,
        }
    }

    /// Returns the larger of two sets, which contains the other.
    pub fn max(self, other: Self) -> Self {
        if self >= other { self } else { other }
    }
}

/// A k-DOP with slabs along all 13 directions. Code for a smaller set neither reads nor writes the others.
///
/// ```
/// use bvh_format::kdop::Kdop;
///
/// let kdop = Kdop::of_points([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]);
/// assert_eq!((kdop.lo[0], kdop.hi[0]), (0.0, 1.0)); // along x
/// assert_eq!((kdop.lo[3], kdop.hi[3]), (0.0, 6.0)); // x + y + z
/// assert_eq!((kdop.lo[10], kdop.hi[10]), (-1.0, 0.0)); // x - y
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kdop {
    /// Lower ends, rounded down.
    pub lo: [f32; 13],
    /// Upper ends, rounded up.
    pub hi: [f32; 13],
}

impl Kdop {
    /// The bound of nothing. Joined with another k-DOP it gives that k-DOP.
    pub const EMPTY: Self = Self { lo: [f32::INFINITY; 13], hi: [f32::NEG_INFINITY; 13] };

    /// The first `slabs` slabs of the k-DOP of four triangles, `[corner][axis][triangle]`, as
    /// [`of_points`](Self::of_points) finds them.
    pub(crate) fn of_lanes(corners: &[[[f32; 4]; 3]; 3], slabs: usize) -> Self {
        let [a, b, c] = corners;
        // Four points take a third of the time.
        if a == b && b == c {
            return Self::of_coordinates(a, slabs);
        }
        let coordinates: [[f32; 12]; 3] =
            [0, 1, 2].map(|axis| std::array::from_fn(|place| corners[place / 4][axis][place % 4]));
        Self::of_coordinates(&coordinates, slabs)
    }

    /// The first `slabs` slabs of the k-DOP of some points, a multiple of four, by axis.
    ///
    /// All points at a time along one direction after the other: compilers turn the loops into vector code.
    #[inline(always)]
    fn of_coordinates<const N: usize>(coordinates: &[[f32; N]; 3], slabs: usize) -> Self {
        if !all_sums_are_exact(coordinates) {
            let points = (0..N).map(|place| [0, 1, 2].map(|axis| coordinates[axis][place]));
            let (mut kdop, whole) = (Self::EMPTY, Self::of_points(points));
            kdop.join(&whole, slabs);
            return kdop;
        }
        let points = coordinates.map(|axis| axis.map(f64::from));
        let (mut lo, mut negated_hi) = ([f64::INFINITY; 13], [f64::INFINITY; 13]);
        let mut put = |first: usize, ends: &[(f64, f64)]| {
            for (slab, (least, largest)) in (first..).zip(ends) {
                (lo[slab], negated_hi[slab]) = (*least, -*largest);
            }
        };
        put(0, &ends_along(&points, |x, y, z| [x, y, z]));
        if slabs > 3 {
            put(3, &ends_along(&points, |x, y, z| [plus(plus(x, y), z), minus(plus(x, y), z)]));
            put(5, &ends_along(&points, |x, y, z| [plus(minus(x, y), z), minus(z, minus(x, y))]));
            if slabs > 7 {
                put(7, &ends_along(&points, |x, y, z| [plus(x, y), plus(x, z), plus(y, z)]));
                put(10, &ends_along(&points, |x, y, z| [minus(x, y), minus(x, z), minus(y, z)]));
            }
        }
        Self { lo: lo.map(round_down), hi: negated_hi.map(|end| -round_down(end)) }
    }

    /// Returns the tightest k-DOP of points: each end is the nearest `f32` outside their exact projections.
    ///
    /// A projection adds at most three `f32` numbers. Sums are taken in `f64`, and the error of each addition is
    /// recovered exactly (Knuth's two-sum). For nearly all points the sums are known to be exact, and this is skipped.
    /// Coordinates must be finite. Without points the result is [`Kdop::EMPTY`].
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

    /// Grows the first `slabs` slabs to contain those of another k-DOP.
    #[inline]
    pub fn join(&mut self, other: &Self, slabs: usize) {
        for slab in 0..slabs {
            // `min` and `max` would take extra instructions for NaN, which does not occur here.
            let (lo, hi) = (other.lo[slab], other.hi[slab]);
            self.lo[slab] = if lo < self.lo[slab] { lo } else { self.lo[slab] };
            self.hi[slab] = if hi > self.hi[slab] { hi } else { self.hi[slab] };
        }
    }

    /// Returns true if the first `slabs` slabs contain those of `inner`.
    pub fn contains(&self, inner: &Self, slabs: usize) -> bool {
        // Without a branch compilers compare several ends at once.
        (0..slabs).fold(true, |all, slab| {
            all & (self.lo[slab] <= inner.lo[slab]) & (self.hi[slab] >= inner.hi[slab])
        })
    }
}

/// The directions in `f64`, as factors of coordinates.
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

/// Returns true if all sums and differences of a point's coordinates are certainly exact in `f64`: the coordinates that
/// are not 0 differ in magnitude by less than a factor of 2^28. A sum of three then has at most the 53 bits from two
/// above the highest bit of the largest to the lowest bit of the smallest.
#[inline(always)]
fn sums_are_exact(point: [f32; 3]) -> bool {
    let magnitudes = point.map(|value| value.to_bits() & 0x7fff_ffff);
    let largest = magnitudes.map(|bits| bits >> 23);
    // 0 wraps around and exceeds all others; a power of two counts as half of itself.
    let smallest = magnitudes.map(|bits| bits.wrapping_sub(1) >> 23);
    let [largest, smallest] =
        [largest.into_iter().max(), smallest.into_iter().min()].map(Option::unwrap_or_default);
    largest <= smallest + 27
}

/// Projects a point onto all directions. Each projection is exact if all sums are.
#[inline(always)]
fn projections([x, y, z]: [f64; 3]) -> [f64; 13] {
    let (sum, difference) = (x + y, x - y);
    let (a, b, c, d) = (sum + z, sum - z, difference + z, z - difference);
    [x, y, z, a, b, c, d, sum, x + z, y + z, difference, x - z, y - z]
}

/// True if all sums of the coordinates of some points are surely exact, as [`sums_are_exact`] says of one point.
#[inline(always)]
fn all_sums_are_exact<const N: usize>(coordinates: &[[f32; N]; 3]) -> bool {
    // Nearly all points pass a simpler test: a factor of 2^26. Processors without instructions for the extremes of integers have
    // some for those of floats.
    let mut all_pass = true;
    for place in 0..N {
        let [x, y, z] = [0, 1, 2].map(|axis| coordinates[axis][place].abs());
        let more = |a: f32, b: f32| if a > b { a } else { b };
        let less = |a: f32, b: f32| if a < b { a } else { b };
        let of_sum = |value: f32| if value == 0.0 { f32::INFINITY } else { value };
        let largest = more(more(x, y), z);
        let smallest = less(less(of_sum(x), of_sum(y)), of_sum(z));
        all_pass &= largest < smallest * 67_108_864.0;
    }
    all_pass || all_sums_are_exact_by_bits(coordinates)
}

/// The exact form of the same test.
#[inline(never)]
fn all_sums_are_exact_by_bits<const N: usize>(coordinates: &[[f32; N]; 3]) -> bool {
    let (mut largest, mut smallest) = ([0; N], [u32::MAX; N]);
    for axis in coordinates {
        for place in 0..N {
            let bits = axis[place].to_bits() & 0x7fff_ffff;
            largest[place] = largest[place].max(bits >> 23);
            smallest[place] = smallest[place].min(bits.wrapping_sub(1) >> 23);
        }
    }
    (0..N).all(|place| largest[place] <= smallest[place] + 27)
}

/// One coordinate of four points.
type Four = [f64; 4];

#[inline(always)]
fn plus(a: Four, b: Four) -> Four {
    std::array::from_fn(|lane| a[lane] + b[lane])
}

#[inline(always)]
fn minus(a: Four, b: Four) -> Four {
    std::array::from_fn(|lane| a[lane] - b[lane])
}

/// The least and the largest projection of some points, a multiple of four, along each of a few directions.
///
/// Four points at a time, which compilers turn into vector code. The ends of at most three directions fit in the registers of
/// processors that have sixteen of two numbers, if no other directions are computed in the same function.
#[inline(never)]
fn ends_along<const N: usize, const D: usize>(
    points: &[[f64; N]; 3],
    projected: impl Fn(Four, Four, Four) -> [Four; D],
) -> [(f64, f64); D] {
    let [x, y, z] = points.each_ref().map(|axis| axis.as_chunks::<4>().0);
    let mut lo = projected(x[0], y[0], z[0]);
    let mut hi = lo;
    for four in 1..N / 4 {
        let values = projected(x[four], y[four], z[four]);
        for direction in 0..D {
            let (values, lo, hi) = (&values[direction], &mut lo[direction], &mut hi[direction]);
            // `min` and `max` would take extra instructions for NaN, which does not occur here.
            for lane in 0..4 {
                lo[lane] = if values[lane] < lo[lane] { values[lane] } else { lo[lane] };
            }
            for lane in 0..4 {
                hi[lane] = if values[lane] > hi[lane] { values[lane] } else { hi[lane] };
            }
        }
    }
    let less = |a: f64, b: f64| if b < a { b } else { a };
    let more = |a: f64, b: f64| if b > a { b } else { a };
    std::array::from_fn(|direction| {
        let (lo, hi) = (lo[direction], hi[direction]);
        (less(less(lo[0], lo[1]), less(lo[2], lo[3])), more(more(hi[0], hi[1]), more(hi[2], hi[3])))
    })
}

/// Returns the nearest `f32` at or below a value.
#[inline(always)]
pub(crate) fn round_down(value: f64) -> f32 {
    let nearest = value as f32;
    // The ordered integer below is that of the next number below, but for 0.0. No value is rounded up to that: negative ones
    // that are tiny become -0.0. Without a branch compilers round several ends at once.
    from_ordered(to_ordered(nearest) - i32::from(f64::from(nearest) > value))
}

/// Returns the nearest `f64` at or below, and at or above, the exact sum of three numbers.
pub(crate) fn sum_of_three(a: f64, b: f64, c: f64) -> (f64, f64) {
    let (sum_ab, error_ab) = two_sum(a, b);
    let (sum, error_c) = two_sum(sum_ab, c);
    // Where c cancels a + b, the errors may be larger than the sum.
    let (error, error_of_error) = two_sum(error_ab, error_c);
    let (sum, rest) = two_sum(sum, error);
    // `rest` is at most half of the spacing of numbers at `sum`. `error_of_error` is 0 unless `error_c` is not 0. In that
    // case c has cancelled less than half of the sum (Sterbenz), `error` is below 2^-51 of the sum, and its own error is
    // far below half of the spacing. So the next number lies beyond all that is left.
    let rest = rest + error_of_error;
    let below = if rest < 0.0 { sum.next_down() } else { sum };
    let above = if rest > 0.0 { sum.next_up() } else { sum };
    (below, above)
}

/// Returns `a + b` rounded, and the exact error of that rounding.
#[inline(always)]
pub(crate) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf::Packet;
    use cbvh_testkit::Random;

    /// A number of the test in units of 2^-100. Points and sums are multiples of 2^-62, and the neighbours of sums that
    /// are not 0 are multiples of 2^-86.
    fn units(value: f32) -> i128 {
        (f64::from(value) * 2f64.powi(100)) as i128
    }

    #[test]
    fn projections_round_outward_and_stay_tight() {
        let mut random = Random::new(1);
        let mut random = || {
            let bits = random.bits();
            let exponent = -((bits >> 59) as i32);
            (((bits >> 20) as u32 & 0xff_ffff) as f32 - 8388608.0) * 2f32.powi(exponent - 24)
        };
        let mut points: Vec<[f32; 3]> = (0..20_000).map(|_| [random(), random(), random()]).collect();
        // One coordinate cancels another, and the third lies below the last bit of either or of their sum.
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
    fn the_kdop_of_lanes_is_that_of_their_points() {
        let mut random = Random::new(3);
        let mut random = || random.bits() >> 33;
        for round in 0..20_000 {
            // Coordinates close to each other in magnitude, far apart, and some of them 0.
            let spread = [1, 8, 60][round % 3];
            let mut coordinate = || match random() % 5 {
                0 => 0.0,
                _ => (random() as f32 - 2f32.powi(30)) * 2f32.powi((random() % spread) as i32 - 60),
            };
            let triangles: Vec<[[f32; 3]; 3]> =
                (0..1 + round % 4).map(|_| [(); 3].map(|()| [(); 3].map(|()| coordinate()))).collect();
            // Points go another way.
            let points_alone = round % 7 == 0;
            let triangles: Vec<_> =
                triangles.iter().map(|&[a, b, c]| if points_alone { [a; 3] } else { [a, b, c] }).collect();
            let points = Kdop::of_points(triangles.as_flattened().iter().copied());
            for slabs in [3, 7, 13] {
                let mut expected = Kdop::EMPTY;
                expected.join(&points, slabs);
                let lanes = Packet::new(&triangles).kdop(triangles.len(), slabs);
                let bits = |kdop: Kdop| (kdop.lo.map(f32::to_bits), kdop.hi.map(f32::to_bits));
                assert_eq!(bits(lanes), bits(expected), "{triangles:?}");
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
