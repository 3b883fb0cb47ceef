//! The numbers with which the oracles compute: integers, which are exact, or balls, whose sign may be uncertain.
//!
//! The code of an oracle serves all of them. On balls it is fast and says where it is not certain; on integers it is
//! the last word. The test profile checks integers of fixed width for overflow.

use dashu_int::IBig;
use std::cmp::Ordering;

pub(crate) trait Number: Clone {
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;
    /// Compares the number with 0, or returns `None` if the result is not certain.
    fn sign(&self) -> Option<Ordering>;
}

macro_rules! integer {
    ($type:ty, $zero:expr) => {
        impl Number for $type {
            fn plus(&self, other: &Self) -> Self {
                self + other
            }

            fn minus(&self, other: &Self) -> Self {
                self - other
            }

            fn times(&self, other: &Self) -> Self {
                self * other
            }

            fn sign(&self) -> Option<Ordering> {
                Some(self.cmp(&$zero))
            }
        }
    };
}

integer!(i64, 0);
integer!(i128, 0);
integer!(IBig, IBig::ZERO);

pub(crate) type Vector<N> = [N; 3];

/// The closed triangle of three points. Collinear points make a segment, equal ones a point.
pub(crate) type Corners<N> = [Vector<N>; 3];

pub(crate) fn subtract<N: Number>(p: &Vector<N>, q: &Vector<N>) -> Vector<N> {
    [p[0].minus(&q[0]), p[1].minus(&q[1]), p[2].minus(&q[2])]
}

pub(crate) fn dot<N: Number>(p: &Vector<N>, q: &Vector<N>) -> N {
    p[0].times(&q[0]).plus(&p[1].times(&q[1])).plus(&p[2].times(&q[2]))
}

pub(crate) fn cross<N: Number>(p: &Vector<N>, q: &Vector<N>) -> Vector<N> {
    let minor = |i: usize, j: usize| p[i].times(&q[j]).minus(&p[j].times(&q[i]));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Returns whether a vector is zero, or `None` if that is not certain.
pub(crate) fn is_zero<N: Number>(p: &Vector<N>) -> Option<bool> {
    let signs = [p[0].sign(), p[1].sign(), p[2].sign()];
    if signs.iter().any(|sign| sign.is_some_and(Ordering::is_ne)) {
        return Some(false);
    }
    signs.iter().all(Option::is_some).then_some(true)
}

/// Returns the vectors from each corner to the next.
pub(crate) fn edges<N: Number>(t: &Corners<N>) -> Corners<N> {
    [subtract(&t[1], &t[0]), subtract(&t[2], &t[1]), subtract(&t[0], &t[2])]
}
