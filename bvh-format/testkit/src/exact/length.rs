//! The exact, proved distance of two triangles of f64, and comparisons with it.

use super::features::{Fraction, is_less, squared_distance};
use super::separation::widest;
use super::{Corners, Dyadic, Number};
use crate::Triangle;
use std::cmp::Ordering;

/// A distance, by its square.
#[derive(Clone, Debug)]
pub struct Length(Fraction<Dyadic>);

impl Length {
    /// Returns the distance of two triangles.
    ///
    /// # Panics
    ///
    /// Panics if the two oracles disagree.
    pub fn between(a: &Triangle, b: &Triangle) -> Self {
        let [a, b] = [a, b].map(|t| t.map(|corner| corner.map(Dyadic::of)));
        Self::of(&a, &b)
    }

    /// Returns the distance of two triangles whose corners need not be numbers of f64. Panics as `between` does.
    pub fn of(a: &Corners<Dyadic>, b: &Corners<Dyadic>) -> Self {
        let square = squared_distance(a, b, &[Dyadic::ZERO, Dyadic::ONE]).unwrap();
        let proof = widest(a, b, &Dyadic::ZERO).unwrap_or((Dyadic::ZERO, Dyadic::ONE));
        assert_eq!(square.0.times(&proof.1), proof.0.times(&square.1), "the oracles disagree: {a:?} {b:?}");
        Self(square)
    }

    /// Compares the distance with a number.
    pub fn compare(&self, x: f64) -> Ordering {
        let x = Dyadic::of(x);
        if x < Dyadic::ZERO { Ordering::Greater } else { self.0.0.cmp(&x.times(&x).times(&self.0.1)) }
    }

    /// Returns whether the distance is `x` to within `tolerance`.
    pub fn is(&self, x: f64, tolerance: f64) -> bool {
        self.compare(x - tolerance).is_ge() && self.compare(x + tolerance).is_le()
    }

    /// Returns whether the distance is less than another one.
    pub fn is_less(&self, other: &Self) -> bool {
        is_less(&self.0, &other.0).unwrap()
    }

    /// Returns the largest f64 that is not larger than the distance.
    pub fn floor(&self) -> f64 {
        // The bits of positive numbers are in the order of the numbers.
        let (mut low, mut high) = (0, f64::INFINITY.to_bits());
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if self.compare(f64::from_bits(middle)).is_ge() { low = middle } else { high = middle }
        }
        f64::from_bits(low)
    }
}
