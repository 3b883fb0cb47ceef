//! Vertices: the `f64` coordinates of a mesh, which queries are about, from the `f32` offsets that files store.
//!
//! Filters need no more than an offset. A coordinate follows from it by a predictor and a corrector, as slabs do. The
//! predictor of an axis is a rule that gives back what people write: numbers that are `f32`, decimals of a few digits, and
//! `f32` numbers times a scale. What it misses is corrected by integers beside the packets (`leaf/corrections`). A writer takes a
//! predictor only because the function here, [`Vertices::coordinate`], returns the bits of the coordinate.
//!
//! All operations are rounded to nearest, and none is fused, so that every machine finds the same bits. Section 15.1 of
//! `spec/format.md` defines them.

use crate::kdop::{FACTORS, Kdop, sum_of_three, two_sum};
use crate::ordered::{from_ordered, from_ordered_f64, to_ordered, to_ordered_f64};

/// The unit of coordinates and origins: all are multiples of 2^-180 mesh units, the finest that exact predicates bear.
pub const LEAST_UNIT: f64 = f64::from_bits((1023 - 180) << 52);

/// From here on, all `f64` are multiples of [`LEAST_UNIT`].
pub const NO_FINER: f64 = f64::from_bits((1023 - 180 + 52) << 52);

/// Returns true for multiples of [`LEAST_UNIT`] of at most 2^122.
pub(crate) fn is_multiple_of_least(value: f64) -> bool {
    // The product is below 2^302, and exact; without a fraction it is whole.
    value.abs() >= NO_FINER || (value * 2f64.powi(180)).fract() == 0.0
}

/// The most significant digits that a predictor may have: as many as tell all `f32` apart.
pub const MAX_SIGNIFICANT: u8 = 9;
/// The most digits after the point that a predictor may have: the powers of ten up to this one are `f64` numbers.
pub const MAX_DECIMALS: u8 = 22;
/// The fewest digits that [`Predictor::Shortest`] tries: numbers of six digits survive `f32`.
const LEAST_SHORTEST: u8 = 6;

/// How the coordinates of an axis follow from the sum s of the origin and an offset, unless they are corrected.
///
/// [`Vertices`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Predictor {
    /// s itself.
    Sum,
    /// The decimal number with this many significant digits, from 1 to 9, that is nearest to s. The origin is 0.
    Significant(u8),
    /// The decimal number with the fewest significant digits, but at least 6, that is nearest to s and becomes s in `f32`; with 9
    /// digits if none does. The origin is 0.
    Shortest,
    /// The decimal number with this many digits after the point, from 0 to 22, that is nearest to s.
    Decimals(u8),
    /// The scale times an `f32`: the one nearest to s / scale. A correction counts `f32` numbers from there. The origin is 0.
    Scaled,
}

impl Predictor {
    /// The number on disk, and that of digits.
    pub const fn parts(self) -> (u8, u8) {
        match self {
            Self::Sum => (0, 0),
            Self::Significant(digits) => (1, digits),
            Self::Shortest => (2, 0),
            Self::Decimals(digits) => (3, digits),
            Self::Scaled => (4, 0),
        }
    }

    /// Returns the predictor of a number on disk and a number of digits.
    pub fn from_parts(number: u8, digits: u8) -> Option<Self> {
        match (number, digits) {
            (0, 0) => Some(Self::Sum),
            (1, 1..=MAX_SIGNIFICANT) => Some(Self::Significant(digits)),
            (2, 0) => Some(Self::Shortest),
            (3, 0..=MAX_DECIMALS) => Some(Self::Decimals(digits)),
            (4, 0) => Some(Self::Scaled),
            _ => None,
        }
    }

    /// Whether the origin must be 0.
    pub const fn needs_no_origin(self) -> bool {
        !matches!(self, Self::Sum | Self::Decimals(_))
    }
}

/// How the vertices of an object follow from what is stored.
///
/// ```
/// use bvh_format::vertex::{Predictor, Vertices};
///
/// let decimals = Vertices { predictors: [Predictor::Decimals(2); 3], ..Vertices::around([100.0; 3]) };
/// let offset = (100.07_f64 - 100.0) as f32;
/// assert_eq!(decimals.coordinate(0, offset, 0), 100.07); // the f64 number, to the bit
/// assert_ne!(Vertices::around([100.0; 3]).coordinate(0, offset, 0), 100.07);
/// let correction = decimals.correction(0, offset, 100.070001).expect("a difference of f64 numbers");
/// assert_eq!(decimals.coordinate(0, offset, correction), 100.070001);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertices {
    /// The origin, in mesh units.
    pub origin: [f64; 3],
    /// The predictor of each axis.
    pub predictors: [Predictor; 3],
    /// The scale of [`Predictor::Scaled`]; 0 without it.
    pub scale: f64,
    /// Whether coordinates of an axis are corrected.
    pub corrected: [bool; 3],
    /// For each axis, the largest distance of a coordinate from the sum of the origin and its offset, in mesh units.
    pub left_out: [f32; 3],
}

impl Vertices {
    /// The vertices of an object around an origin: each is the sum of the origin and its offsets.
    pub const fn around(origin: [f64; 3]) -> Self {
        Self {
            origin,
            predictors: [Predictor::Sum; 3],
            scale: 0.0,
            corrected: [false; 3],
            left_out: [0.0; 3],
        }
    }

    /// Whether each vertex is the sum of the origin and its offsets.
    #[inline(always)]
    pub fn are_sums(&self) -> bool {
        self.predictors == [Predictor::Sum; 3] && !self.are_corrected()
    }

    /// Whether coordinates of any axis are corrected.
    #[inline(always)]
    pub fn are_corrected(&self) -> bool {
        self.corrected != [false; 3]
    }

    /// Whether each coordinate of an axis is the sum of the origin and its offset.
    #[inline(always)]
    pub fn is_sum(&self, axis: usize) -> bool {
        self.predictors[axis] == Predictor::Sum && !self.corrected[axis]
    }

    /// Returns a coordinate, given its offset and its correction. It is never -0.
    #[inline(always)]
    pub fn coordinate(&self, axis: usize, offset: f32, correction: i64) -> f64 {
        let sum = self.origin[axis] + f64::from(offset);
        let predicted = match self.predictors[axis] {
            Predictor::Sum => sum,
            Predictor::Significant(digits) => significant(sum, digits),
            Predictor::Shortest => shortest(sum),
            Predictor::Decimals(digits) => {
                let units = POWERS[ZEROTH + usize::from(digits.min(MAX_DECIMALS))];
                whole(sum * units) / units
            }
            Predictor::Scaled => {
                let nearest = to_ordered((sum / self.scale) as f32);
                return f64::from(from_ordered(nearest.wrapping_add(correction as i32))) * self.scale + 0.0;
            }
        };
        // -0.0 + 0.0 is 0.0; every other number stays as it is.
        let predicted = predicted + 0.0;
        if correction == 0 {
            return predicted;
        }
        from_ordered_f64(to_ordered_f64(predicted).wrapping_add(correction)) + 0.0
    }

    /// Returns the correction that makes [`coordinate`](Self::coordinate) return a finite coordinate other than -0, if there is
    /// one.
    pub fn correction(&self, axis: usize, offset: f32, coordinate: f64) -> Option<i64> {
        let predicted = self.coordinate(axis, offset, 0);
        let correction = match self.predictors[axis] {
            Predictor::Scaled => {
                let ordered = |value: f64| i64::from(to_ordered((value / self.scale) as f32));
                ordered(coordinate) - ordered(predicted)
            }
            _ => to_ordered_f64(coordinate).wrapping_sub(to_ordered_f64(predicted)),
        };
        (self.coordinate(axis, offset, correction).to_bits() == coordinate.to_bits()).then_some(correction)
    }

    /// Returns some coordinates of an axis that need no correction. Compilers turn the loops into vector code.
    #[inline(always)]
    pub fn predicted<const N: usize>(&self, axis: usize, offsets: &[f32; N]) -> [f64; N] {
        let sums = offsets.map(|offset| self.origin[axis] + f64::from(offset));
        match self.predictors[axis] {
            Predictor::Sum => sums.map(|sum| sum + 0.0),
            Predictor::Significant(digits) => sums.map(|sum| significant(sum, digits) + 0.0),
            Predictor::Shortest | Predictor::Decimals(_) | Predictor::Scaled => {
                offsets.map(|offset| self.coordinate(axis, offset, 0))
            }
        }
    }

    /// Returns the vertices of a triangle, whose coordinates need no correction.
    #[inline(always)]
    pub fn predicted_triangle(&self, offsets: &[[f32; 3]; 3]) -> [[f64; 3]; 3] {
        let mut vertices = [[0.0; 3]; 3];
        for axis in 0..3 {
            let of_axis = self.predicted(axis, &[0, 1, 2].map(|corner| offsets[corner][axis]));
            for corner in 0..3 {
                vertices[corner][axis] = of_axis[corner];
            }
        }
        vertices
    }

    /// Returns true if no coordinate is farther from its offset than stated, on one axis.
    #[inline(always)]
    pub fn is_within(&self, axis: usize, offset: f32, coordinate: f64) -> bool {
        let most = f64::from(self.left_out[axis]);
        // Rounding to nearest keeps the order.
        if self.origin[axis] == 0.0 && (coordinate - f64::from(offset)).abs() < most {
            return true;
        }
        let (below, above) = sum_of_three(coordinate, -self.origin[axis], -f64::from(offset));
        -most <= below && above <= most
    }

    /// How far the slabs of offsets must be widened to contain the vertices, for each direction, in mesh units. Rounded up.
    pub fn margins(&self) -> [f64; 13] {
        FACTORS.map(|direction| margin_along(direction, self.left_out))
    }
}

/// How much farther vertices may reach along a direction than their offsets do, rounded up. Products of coordinates of the
/// direction and `f32` numbers must be exact.
pub(crate) fn margin_along(direction: [f64; 3], left_out: [f32; 3]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|axis| direction[axis].abs() * f64::from(left_out[axis]));
    sum_of_three(x, y, z).1
}

/// Slabs of offsets, widened to contain the vertices behind them.
impl Kdop {
    /// Returns the slabs, of which both ends are moved outward by a margin each, and rounded outward.
    #[inline]
    pub fn widened(mut self, margins: &[f64; 13]) -> Self {
        let below = |end: f32, margin: f64| {
            let (sum, rest) = two_sum(f64::from(end), -margin);
            let nearest = sum as f32;
            let wide = f64::from(nearest);
            // The next lower number, where the nearest is above the exact sum. Without a branch, several ends are moved at once.
            let is_above = (wide > sum) | (wide == sum) & (rest < 0.0);
            from_ordered(to_ordered(nearest) - i32::from(is_above))
        };
        for slab in 0..13 {
            // -0.0 + 0.0 is 0.0; every other number stays as it is.
            self.lo[slab] = below(self.lo[slab], margins[slab]) + 0.0;
            self.hi[slab] = 0.0 - below(-self.hi[slab], margins[slab]);
        }
        self
    }
}

/// Powers of ten from 10^-64 to 10^64, each rounded to nearest.
#[rustfmt::skip]
const POWERS: [f64; 129] = [
    1e-64, 1e-63, 1e-62, 1e-61, 1e-60, 1e-59, 1e-58, 1e-57, 1e-56, 1e-55, 1e-54, 1e-53,
    1e-52, 1e-51, 1e-50, 1e-49, 1e-48, 1e-47, 1e-46, 1e-45, 1e-44, 1e-43, 1e-42, 1e-41,
    1e-40, 1e-39, 1e-38, 1e-37, 1e-36, 1e-35, 1e-34, 1e-33, 1e-32, 1e-31, 1e-30, 1e-29,
    1e-28, 1e-27, 1e-26, 1e-25, 1e-24, 1e-23, 1e-22, 1e-21, 1e-20, 1e-19, 1e-18, 1e-17,
    1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5,
    1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7,
    1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19,
    1e20, 1e21, 1e22, 1e23, 1e24, 1e25, 1e26, 1e27, 1e28, 1e29, 1e30, 1e31,
    1e32, 1e33, 1e34, 1e35, 1e36, 1e37, 1e38, 1e39, 1e40, 1e41, 1e42, 1e43,
    1e44, 1e45, 1e46, 1e47, 1e48, 1e49, 1e50, 1e51, 1e52, 1e53, 1e54, 1e55,
    1e56, 1e57, 1e58, 1e59, 1e60, 1e61, 1e62, 1e63, 1e64,
];
/// The place of 10^0.
const ZEROTH: usize = 64;

/// The exponents of `f32` numbers, subnormal ones included.
const EXPONENTS: usize = 277;
/// The exponent of the smallest `f32`, as an `f64` has it in its bits.
const LEAST_EXPONENT: usize = 1023 - 149;

/// For each exponent e of an `f32`, the largest n for which 10^n, rounded, is at most 2^e, and 10^(n + 1).
static DECADES: [(f64, i32); EXPONENTS] = {
    let mut decades = [(0.0, 0); EXPONENTS];
    let (mut place, mut decade) = (0, -46);
    while place < EXPONENTS {
        let value = f64::from_bits(((LEAST_EXPONENT + place) as u64) << 52);
        while POWERS[(ZEROTH as i32 + decade + 1) as usize] <= value {
            decade += 1;
        }
        decades[place] = (POWERS[(ZEROTH as i32 + decade + 1) as usize], decade);
        place += 1;
    }
    decades
};

/// For each power q from -64 to 64, 10^q, or -10^-q where q is negative: both are whole numbers.
static UNITS: [f64; 129] = {
    let mut units = POWERS;
    let mut place = 0;
    while place < ZEROTH {
        units[place] = -POWERS[2 * ZEROTH - place];
        place += 1;
    }
    units
};

/// Returns the decimal number of some significant digits that is nearest to an `f32`.
#[inline(always)]
fn significant(value: f64, digits: u8) -> f64 {
    let exponent = (value.to_bits() >> 52 & 0x7ff) as usize;
    // 0 has the least exponent as well; it becomes 0.
    let (next, decade) = DECADES[exponent.saturating_sub(LEAST_EXPONENT).min(EXPONENTS - 1)];
    let power = i32::from(digits) - 1 - decade - i32::from(value.abs() >= next);
    let unit = UNITS[(ZEROTH as i32 + power) as usize % UNITS.len()];
    if unit < 0.0 {
        return whole(value / -unit) * -unit;
    }
    // Numbers of at most ten digits: see `whole`.
    let shift = WHOLE.copysign(value);
    ((value * unit + shift) - shift) / unit
}

/// Returns the shortest decimal number that becomes an `f32`.
#[inline(always)]
fn shortest(value: f64) -> f64 {
    let candidates = (LEAST_SHORTEST..MAX_SIGNIFICANT).map(|digits| significant(value, digits));
    let mut short = candidates.filter(|&candidate| f64::from(candidate as f32) == value);
    short.next().unwrap_or_else(|| significant(value, MAX_SIGNIFICANT))
}

/// From here on, `f64` have no fractions.
const WHOLE: f64 = (1u64 << 52) as f64;

/// Rounds to a whole number, ties to even.
#[inline(always)]
fn whole(value: f64) -> f64 {
    let shift = WHOLE.copysign(value);
    if value.abs() < WHOLE { (value + shift) - shift } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    fn with(predictor: Predictor) -> Vertices {
        Vertices { predictors: [predictor; 3], scale: 0.001, ..Vertices::around([0.0; 3]) }
    }

    /// Random numbers of all magnitudes of `f32`, and those beside powers of ten.
    fn values() -> impl Iterator<Item = f32> {
        let mut random = Random::new(12);
        let any = move || f32::from_bits((random.bits() >> 32) as u32);
        let beside = (-44..39).flat_map(|power| {
            let value: f32 = format!("1e{power}").parse().unwrap();
            [value.next_down(), value, value.next_up(), -value, value * 9.999_999, value * 0.5]
        });
        let all = std::iter::repeat_with(any).take(60_000).chain(beside);
        all.filter(|value| value.abs() <= 1e36)
    }

    /// What a program prints of an `f32` is a decimal number, which a parser reads as an `f64`.
    #[test]
    fn printed_f32_come_back() {
        let mut missed = 0;
        for value in values() {
            for (predictor, text) in [
                (Predictor::Significant(9), format!("{:.8e}", f64::from(value))),
                (Predictor::Significant(7), format!("{:.6e}", f64::from(value))),
                (Predictor::Shortest, format!("{value:e}")),
            ] {
                let given: f64 = text.parse().unwrap();
                let offset = given as f32;
                let vertices = with(predictor);
                let correction = vertices.correction(0, offset, given + 0.0).unwrap();
                // Beyond 10^22, powers of ten are rounded. Shortest numbers may be halfway between two; programs differ in which they print.
                let most = if predictor == Predictor::Shortest { 1e3 } else { 1e22 };
                let is_near = (1e-13..most).contains(&value.abs()) || value == 0.0;
                assert!(correction == 0 || !is_near, "{predictor:?}: {text}, {correction}");
                missed += usize::from(correction != 0);
                assert_eq!(vertices.coordinate(0, offset, correction).to_bits(), (given + 0.0).to_bits());
            }
        }
        assert!(missed > 0);
    }

    #[test]
    fn digits_after_the_point_come_back() {
        let mut random = Random::new(3);
        for digits in 0..=15u8 {
            for _ in 0..4000 {
                // Seven digits of the extent, around an origin of up to eight more.
                let (middle, part) = (random.below(100_000_000) as i64, random.below(10_000_000) as i64);
                let middle = if digits < 9 { middle } else { 0 };
                let number = (middle * 10_000_000 + part - 5_000_000) * if digits % 2 == 0 { 1 } else { -1 };
                let text = format!("{number}e-{digits}");
                let given: f64 = text.parse().unwrap();
                let origin: f64 = format!("{}e-{digits}", middle as f64 * 1e7).parse().unwrap();
                let origin = if digits % 2 == 0 { origin } else { -origin };
                let vertices = Vertices {
                    predictors: [Predictor::Decimals(digits); 3],
                    ..Vertices::around([origin; 3])
                };
                let offset = (given - origin) as f32;
                assert_eq!(vertices.coordinate(1, offset, 0).to_bits(), (given + 0.0).to_bits(), "{text}");
            }
        }
    }

    #[test]
    fn products_with_a_scale_take_small_corrections() {
        for value in values().filter(|value| value.abs() > 1e-30) {
            let vertices = with(Predictor::Scaled);
            let given = f64::from(value) * vertices.scale;
            let correction = vertices.correction(2, given as f32, given).unwrap();
            assert!(correction.abs() <= 2, "{value}: {correction}");
            assert_eq!(vertices.coordinate(2, given as f32, correction).to_bits(), given.to_bits());
        }
    }

    /// Any `f64` can be corrected, whatever the predictor.
    #[test]
    fn any_number_comes_back() {
        let mut random = Random::new(5);
        for _ in 0..40_000 {
            let given = f64::from_bits(random.bits());
            if given.is_nan() || given.abs() > 2f64.powi(120) {
                continue;
            }
            for predictor in
                [Predictor::Sum, Predictor::Significant(6), Predictor::Shortest, Predictor::Decimals(3)]
            {
                let vertices = with(predictor);
                let correction = vertices.correction(0, given as f32, given + 0.0).unwrap();
                assert_eq!(
                    vertices.coordinate(0, given as f32, correction).to_bits(),
                    (given + 0.0).to_bits()
                );
            }
        }
        assert_eq!(with(Predictor::Sum).coordinate(0, -0.0, 0).to_bits(), 0);
        assert_eq!(with(Predictor::Decimals(3)).coordinate(0, -0.0001, 0).to_bits(), 0);
    }

    #[test]
    fn whole_numbers_round_ties_to_even() {
        let cases = [(0.5, 0.0), (1.5, 2.0), (2.5, 2.0), (-2.5, -2.0), (0.49999999999999994, 0.0)];
        for (value, expected) in cases {
            assert_eq!(whole(value), expected);
        }
        let mut random = Random::new(2);
        for _ in 0..100_000 {
            let value = f64::from_bits(random.bits());
            if !value.is_nan() {
                assert_eq!(whole(value), value.round_ties_even());
            }
        }
    }

    /// A margin that is rounded to nearest could be less than what two axes leave out together.
    #[test]
    fn margins_are_rounded_up() {
        let vertices = Vertices { left_out: [1.0, 2f32.powi(-60), 0.0], ..Vertices::around([0.0; 3]) };
        for (margin, [a, b, _]) in vertices.margins().into_iter().zip(FACTORS) {
            let expected = if a == 0.0 { b.abs() * 2f64.powi(-60) } else { 1.0 };
            assert_eq!(margin, if a * b != 0.0 { expected.next_up() } else { expected });
        }
    }

    #[test]
    fn widened_slabs_are_the_tightest() {
        let mut random = Random::new(9);
        let exact = |value: f64| (value * 2f64.powi(60)) as i128;
        for _ in 0..20_000 {
            let mut kdop = Kdop::EMPTY;
            let mut margins = [0.0; 13];
            for slab in 0..13 {
                let some = |random: &mut Random| {
                    (random.bits() >> 40) as f32 / (1 << 24) as f32 * 2f32.powi(random.below(30) as i32 - 20)
                };
                kdop.lo[slab] = some(&mut random) - some(&mut random);
                kdop.hi[slab] = kdop.lo[slab] + some(&mut random);
                margins[slab] = f64::from(some(&mut random)) * 2f64.powi(-(random.below(20) as i32));
            }
            let wide = kdop.widened(&margins);
            for slab in 0..13 {
                let wanted = exact(kdop.lo[slab].into()) - exact(margins[slab]);
                assert!(exact(wide.lo[slab].into()) <= wanted);
                assert!(margins[slab] == 0.0 || exact(wide.lo[slab].next_up().into()) > wanted);
                let wanted = exact(kdop.hi[slab].into()) + exact(margins[slab]);
                assert!(exact(wide.hi[slab].into()) >= wanted);
                assert!(margins[slab] == 0.0 || exact(wide.hi[slab].next_down().into()) < wanted);
            }
        }
    }
}
