//! Reads an f64 as an integer times a power of two. This turns triangles into integers on a common grid.

use super::number::Corners;
use dashu_int::IBig;
use std::cmp::Ordering;

/// Returns an odd mantissa, or 0, and the exponent. The exponent of 0 is so high that it is never the lowest.
pub(crate) fn parts(x: f64) -> (i64, i32) {
    assert!(x.is_finite(), "{x}");
    let bits = x.to_bits();
    let (field, fraction) = ((bits >> 52 & 0x7ff) as i32, (bits & ((1 << 52) - 1)) as i64);
    let mantissa = if field == 0 { fraction } else { fraction | 1 << 52 };
    if mantissa == 0 {
        return (0, i32::MAX / 4);
    }
    let zeros = mantissa.trailing_zeros() as i32;
    let signed = if x < 0.0 { -mantissa } else { mantissa };
    (signed >> zeros, field.max(1) - 1075 + zeros)
}

/// Returns the exponent of the coarsest grid that contains all numbers, or 0 if all of them are 0.
pub(crate) fn grid(numbers: impl Iterator<Item = f64>) -> i32 {
    let lowest = numbers.map(|x| parts(x).1).min().unwrap();
    if lowest == i32::MAX / 4 { 0 } else { lowest }
}

/// Returns a number on the grid of 2^`grid`, in units of that grid.
pub(crate) fn on_grid(x: f64, grid: i32) -> IBig {
    match parts(x) {
        (0, _) => IBig::ZERO,
        (mantissa, exponent) => IBig::from(mantissa) << usize::try_from(exponent - grid).unwrap(),
    }
}

/// Two triangles as integers in units of 2^`grid`.
pub(crate) struct Integers {
    pub(crate) a: Corners<IBig>,
    pub(crate) b: Corners<IBig>,
    pub(crate) grid: i32,
}

impl Integers {
    pub(crate) fn new(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> Self {
        let grid = grid(a.iter().chain(b).flatten().copied());
        let integers = |t: &[[f64; 3]; 3]| t.map(|p| p.map(|x| on_grid(x, grid)));
        Self { a: integers(a), b: integers(b), grid }
    }

    /// Returns the same triangles if each coordinate is less than 2^28. For these, `meet` stays below 2^127, as it
    /// has degree four in the differences and less than 2^8 terms.
    pub(crate) fn narrow(&self) -> Option<(Corners<i128>, Corners<i128>)> {
        let narrow = |t: &Corners<IBig>| {
            let mut narrowed = [[0; 3]; 3];
            for (to, from) in narrowed.as_flattened_mut().iter_mut().zip(t.as_flattened()) {
                *to = i128::try_from(from).ok().filter(|x| x.unsigned_abs() < 1 << 28)?;
            }
            Some(narrowed)
        };
        Some((narrow(&self.a)?, narrow(&self.b)?))
    }
}

/// Compares `p * 2^p_exponent` with `q * 2^q_exponent`.
pub(crate) fn compare(p: IBig, p_exponent: i32, q: IBig, q_exponent: i32) -> Ordering {
    let shift = p_exponent - q_exponent;
    if shift > 0 { (p << shift as usize).cmp(&q) } else { p.cmp(&(q << -shift as usize)) }
}
