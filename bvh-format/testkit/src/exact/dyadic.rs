//! An integer times a power of two: every finite f64 is one, and sums and products of them are exact.

use super::{Corners, Number};
use crate::Triangle;
use dashu_int::IBig;
use ethnum::I256;
use std::cmp::Ordering;

/// An integer times a power of two.
#[derive(Clone, Debug)]
pub struct Dyadic {
    integer: IBig,
    exponent: i32,
}

impl Dyadic {
    /// The number 0.
    pub const ZERO: Self = Self { integer: IBig::ZERO, exponent: 0 };
    /// The number 1.
    pub const ONE: Self = Self { integer: IBig::ONE, exponent: 0 };

    /// Returns the exact value of a finite number.
    pub fn of(x: f64) -> Self {
        let (integer, exponent) = parts(x);
        Self { integer: integer.into(), exponent }
    }

    /// Returns the magnitude.
    pub fn abs(&self) -> Self {
        if *self < Self::ZERO { Self::ZERO.minus(self) } else { self.clone() }
    }

    /// Adds or subtracts on the coarser of the two grids.
    fn on_one_grid(&self, other: &Self, join: impl FnOnce(&IBig, &IBig) -> IBig) -> Self {
        let integer = match self.exponent.cmp(&other.exponent) {
            Ordering::Equal => join(&self.integer, &other.integer),
            Ordering::Less => {
                join(&self.integer, &(&other.integer << (other.exponent - self.exponent) as usize))
            }
            Ordering::Greater => {
                join(&(&self.integer << (self.exponent - other.exponent) as usize), &other.integer)
            }
        };
        Self { integer, exponent: self.exponent.min(other.exponent) }
    }
}

impl Number for Dyadic {
    fn plus(&self, other: &Self) -> Self {
        self.on_one_grid(other, |p, q| p + q)
    }

    fn minus(&self, other: &Self) -> Self {
        self.on_one_grid(other, |p, q| p - q)
    }

    fn times(&self, other: &Self) -> Self {
        Self { integer: &self.integer * &other.integer, exponent: self.exponent + other.exponent }
    }

    fn sign(&self) -> Option<Ordering> {
        Some(self.integer.cmp(&IBig::ZERO))
    }
}

impl Ord for Dyadic {
    fn cmp(&self, other: &Self) -> Ordering {
        self.minus(other).integer.cmp(&IBig::ZERO)
    }
}

impl PartialOrd for Dyadic {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Dyadic {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Dyadic {}

/// Returns an odd integer, or 0, and the exponent of a finite number.
fn parts(x: f64) -> (i64, i32) {
    assert!(x.is_finite(), "{x}");
    let bits = x.to_bits();
    let (field, fraction) = ((bits >> 52 & 0x7ff) as i32, (bits & ((1 << 52) - 1)) as i64);
    let integer = if field == 0 { fraction } else { fraction | 1 << 52 };
    match integer.trailing_zeros() as i32 {
        64 => (0, 0),
        zeros => ((integer >> zeros) * if x < 0.0 { -1 } else { 1 }, field.max(1) - 1075 + zeros),
    }
}

/// Returns both triangles as integers on a common grid if each coordinate is less than 2^60 there. For these, `meet` stays
/// below 2^255, as it has degree four in the differences and less than 2^8 terms.
pub(super) fn on_common_grid(a: &Triangle, b: &Triangle) -> Option<[Corners<I256>; 2]> {
    let all = a.iter().chain(b).flatten().map(|&x| parts(x)).filter(|part| part.0 != 0);
    let grid = all.map(|part| part.1).min().unwrap_or(0);
    let mut integers = [[[I256::ZERO; 3]; 3]; 2];
    for (to, &x) in integers.as_flattened_mut().as_flattened_mut().iter_mut().zip(a.iter().chain(b).flatten())
    {
        let (integer, exponent) = parts(x);
        let bits = 64 - integer.unsigned_abs().leading_zeros() as i32;
        if integer != 0 {
            let shift = exponent - grid;
            if shift + bits > 60 {
                return None;
            }
            *to = I256::from(integer << shift);
        }
    }
    Some(integers)
}
