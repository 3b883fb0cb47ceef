//! A real number that is known to within a radius, in f64.
//!
//! With u = 2^-53, a sum rounded to nearest is off by exactly what Knuth's two-sum returns (The Art of Computer
//! Programming 2, 4.2.2, theorem B). A product is off by at most u of the result or, if it underflows, by less than
//! the smallest normal number. A radius is computed in at most eight operations on numbers that are not negative,
//! each of which is off by a factor of at most 1 + u. To make up for that, it is finally enlarged by 16u.

use super::Number;
use std::cmp::Ordering;

const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

#[derive(Clone, Copy, Debug)]
/// A real number that is known to within a radius.
pub struct Ball {
    middle: f64,
    radius: f64,
}

impl Ball {
    /// Returns a number that is known exactly.
    pub fn exactly(middle: f64) -> Self {
        Self { middle, radius: 0.0 }
    }

    /// Returns `x` times a power of two, which is exact unless it underflows.
    pub fn scaled(x: f64, power: f64) -> Self {
        let middle = x * power;
        Self { middle, radius: if middle / power == x { 0.0 } else { f64::MIN_POSITIVE } }
    }

    /// Returns the middle, which need not be the number.
    pub fn middle(&self) -> f64 {
        self.middle
    }

    /// Returns a lower bound of the number.
    pub fn least(&self) -> f64 {
        (self.middle - self.radius).next_down()
    }

    /// Returns an upper bound of the number.
    pub fn most(&self) -> f64 {
        (self.middle + self.radius).next_up()
    }

    fn new(middle: f64, radius: f64) -> Self {
        Self { middle, radius: radius * (1.0 + 16.0 * UNIT_ROUNDOFF) }
    }

    fn sum(p: f64, q: f64, radius: f64) -> Self {
        let sum = p + q;
        let of_q = sum - p;
        let rounding = (p - (sum - of_q)) + (q - of_q);
        Self::new(sum, radius + rounding.abs())
    }
}

impl Number for Ball {
    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        Self::sum(self.middle, other.middle, self.radius + other.radius)
    }

    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        Self::sum(self.middle, -other.middle, self.radius + other.radius)
    }

    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        let is_zero = |ball: &Self| ball.middle == 0.0 && ball.radius == 0.0;
        if is_zero(self) || is_zero(other) {
            return Self::exactly(0.0);
        }
        let product = self.middle * other.middle;
        let inherited = self.middle.abs() * other.radius + self.radius * (other.middle.abs() + other.radius);
        Self::new(product, inherited + (UNIT_ROUNDOFF * product.abs() + 4.0 * f64::MIN_POSITIVE))
    }

    /// An overflow makes the radius infinite or NaN, and then no sign is certain.
    #[inline(always)]
    fn sign(&self) -> Option<Ordering> {
        if self.middle > self.radius {
            Some(Ordering::Greater)
        } else if self.middle < -self.radius {
            Some(Ordering::Less)
        } else {
            (self.middle == 0.0 && self.radius == 0.0).then_some(Ordering::Equal)
        }
    }
}
