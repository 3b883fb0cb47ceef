//! Vectors of integers of any length, where a filter in f64 cannot decide a sign.

use num_bigint::BigInt;

pub(super) type Vector = [BigInt; 3];

/// Returns the exponent of the power of two that the last bit of a number stands for.
pub(super) fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52 & 0x7ff) as i32).max(1) - 1075
}

/// Converts a number, which is a multiple of 2^`unit`, to that multiple.
pub(super) fn integer(x: f64, unit: i32) -> BigInt {
    let bits = x.to_bits();
    let implied = u64::from(bits >> 52 & 0x7ff != 0) << 52;
    let magnitude = BigInt::from(bits & ((1 << 52) - 1) | implied);
    // The exponent of zero does not matter.
    let magnitude = magnitude << (exponent(x) - unit).max(0);
    if x < 0.0 { -magnitude } else { magnitude }
}

pub(super) fn minus(p: &Vector, q: &Vector) -> Vector {
    [&p[0] - &q[0], &p[1] - &q[1], &p[2] - &q[2]]
}

pub(super) fn dot(p: &Vector, q: &Vector) -> BigInt {
    &p[0] * &q[0] + &p[1] * &q[1] + &p[2] * &q[2]
}

pub(super) fn cross(p: &Vector, q: &Vector) -> Vector {
    let component = |i: usize, j: usize| &p[i] * &q[j] - &p[j] * &q[i];
    [component(1, 2), component(2, 0), component(0, 1)]
}

/// Returns the quotient of two positive integers, to within one unit in the last place.
pub(super) fn quotient(numerator: &BigInt, denominator: &BigInt) -> f64 {
    // A quotient of 62 to 64 bits, rounded down, and then to the nearest f64.
    let shift = 63 + denominator.bits() as i64 - numerator.bits() as i64;
    let quotient = (numerator << shift.max(0)) / (denominator << (-shift).max(0));
    libm::ldexp(quotient.iter_u64_digits().next().unwrap_or(0) as f64, -shift as i32)
}
