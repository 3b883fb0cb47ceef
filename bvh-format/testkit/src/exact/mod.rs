//! Exact arithmetic, and the oracles on it that say whether two triangles meet and how far apart they are.
//!
//! They share no code with the library. The code of an oracle serves several kinds of numbers: dyadic numbers and
//! integers, which are exact, and balls, whose sign may be uncertain. On balls an oracle is fast and says where it is not
//! certain; on exact numbers it is the last word.

mod ball;
mod decide;
mod dyadic;
mod features;
mod length;
mod meet;
mod separation;
#[cfg(test)]
mod tests;

pub use ball::Ball;
pub use decide::{Boxed, Decided, certainly_farther, intersect};
pub use dyadic::Dyadic;
pub use features::{Fraction, is_less, squared_distance};
pub use length::Length;
pub use meet::meet;

use ethnum::I256;
use std::cmp::Ordering;

/// A number with which the oracles compute.
pub trait Number: Clone {
    /// Returns the sum of two numbers.
    fn plus(&self, other: &Self) -> Self;
    /// Returns the difference of two numbers.
    fn minus(&self, other: &Self) -> Self;
    /// Returns the product of two numbers.
    fn times(&self, other: &Self) -> Self;
    /// Compares the number with 0, or returns `None` if the result is not certain.
    fn sign(&self) -> Option<Ordering>;
}

macro_rules! integer {
    ($type:ty, $zero:expr) => {
        impl Number for $type {
            fn plus(&self, other: &Self) -> Self {
                self.checked_add(*other).expect("a sum in range")
            }

            fn minus(&self, other: &Self) -> Self {
                self.checked_sub(*other).expect("a difference in range")
            }

            fn times(&self, other: &Self) -> Self {
                self.checked_mul(*other).expect("a product in range")
            }

            fn sign(&self) -> Option<Ordering> {
                Some(self.cmp(&$zero))
            }
        }
    };
}

integer!(i64, 0);
integer!(I256, I256::ZERO);

/// A vector or a point.
pub type Vector<N> = [N; 3];

/// The closed triangle of three points. Collinear points make a segment, equal ones a point.
pub type Corners<N> = [Vector<N>; 3];

/// Returns `p - q`.
pub fn subtract<N: Number>(p: &Vector<N>, q: &Vector<N>) -> Vector<N> {
    [p[0].minus(&q[0]), p[1].minus(&q[1]), p[2].minus(&q[2])]
}

/// Returns the scalar product.
pub fn dot<N: Number>(p: &Vector<N>, q: &Vector<N>) -> N {
    p[0].times(&q[0]).plus(&p[1].times(&q[1])).plus(&p[2].times(&q[2]))
}

/// Returns the vector product.
pub fn cross<N: Number>(p: &Vector<N>, q: &Vector<N>) -> Vector<N> {
    let minor = |i: usize, j: usize| p[i].times(&q[j]).minus(&p[j].times(&q[i]));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Returns whether a vector is zero, or `None` if that is not certain.
pub fn is_zero<N: Number>(p: &Vector<N>) -> Option<bool> {
    let signs = [p[0].sign(), p[1].sign(), p[2].sign()];
    if signs.iter().any(|sign| sign.is_some_and(Ordering::is_ne)) {
        return Some(false);
    }
    signs.iter().all(Option::is_some).then_some(true)
}

/// Returns the vectors from each corner to the next.
pub fn edges<N: Number>(t: &Corners<N>) -> Corners<N> {
    [subtract(&t[1], &t[0]), subtract(&t[2], &t[1]), subtract(&t[0], &t[2])]
}
