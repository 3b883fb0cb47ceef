//! The exact, proved distance of two triangles of f64, and comparisons with it.

use super::dyadic::{Integers, compare, parts};
use super::features::{Fraction, squared_distance};
use super::separation::widest;
use dashu_int::IBig;
use std::cmp::Ordering;

/// A distance, by its square in units of 4^`exponent`.
#[derive(Clone, Debug)]
pub(crate) struct Length {
    square: Fraction<IBig>,
    exponent: i32,
}

impl Length {
    /// Returns the distance according to both oracles, which must agree.
    pub(crate) fn between(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> Self {
        let integers = Integers::new(a, b);
        let square = squared_distance(&integers.a, &integers.b, &[IBig::ZERO, IBig::ONE]).unwrap();
        let proof = widest(&integers.a, &integers.b, &IBig::ZERO).unwrap_or((IBig::ZERO, IBig::ONE));
        assert_eq!(&square.0 * &proof.1, &proof.0 * &square.1, "the oracles disagree: {a:?} {b:?}");
        Self { square, exponent: integers.grid }
    }

    pub(crate) fn compare(&self, x: f64) -> Ordering {
        let (mantissa, exponent) = parts(x);
        if mantissa <= 0 {
            return if mantissa < 0 { Ordering::Greater } else { self.square.0.cmp(&IBig::ZERO) };
        }
        let of_x = IBig::from(mantissa) * IBig::from(mantissa) * &self.square.1;
        compare(self.square.0.clone(), 2 * self.exponent, of_x, 2 * exponent)
    }

    pub(crate) fn is_less(&self, other: &Self) -> bool {
        let (one, two) = (&self.square.0 * &other.square.1, &other.square.0 * &self.square.1);
        compare(one, 2 * self.exponent, two, 2 * other.exponent).is_lt()
    }

    /// Returns the largest f64 that is not larger than the distance.
    pub(crate) fn floor(&self) -> f64 {
        // The bits of positive numbers are in the order of the numbers.
        let (mut low, mut high) = (0, f64::INFINITY.to_bits());
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if self.compare(f64::from_bits(middle)).is_ge() { low = middle } else { high = middle }
        }
        f64::from_bits(low)
    }
}
