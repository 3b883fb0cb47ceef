//! Registers of four `f64`, for the four triangles of a packet.

/// Four numbers. All operations are rounded to nearest, and none is fused.
pub(crate) trait Doubles: Copy {
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// Returns the smaller number of each lane; the second one if either is NaN.
    fn min(self, other: Self) -> Self;
    /// Returns the larger number of each lane; the second one if either is NaN.
    fn max(self, other: Self) -> Self;
    /// Returns a bit for each lane, set where `self < other`; bit i is lane i.
    fn bits_below(self, other: Self) -> u16;
}

/// Four numbers, one after another.
#[derive(Clone, Copy)]
pub(crate) struct FourDoubles(pub(crate) [f64; 4]);

/// Defines methods by what they do for a lane.
macro_rules! by_lane {
    ($($name:ident($x:ident, $y:ident) $each:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, other: Self) -> Self {
            let each = |$x: f64, $y: f64| $each;
            let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
            Self([each(a, e), each(b, f), each(c, g), each(d, h)])
        })+
    };
}

impl Doubles for FourDoubles {
    by_lane! {
        sub(x, y) x - y;
        mul(x, y) x * y;
        min(x, y) if x < y { x } else { y };
        max(x, y) if x > y { x } else { y };
    }
    #[inline(always)]
    fn bits_below(self, other: Self) -> u16 {
        (0..4).fold(0, |bits, lane| bits | u16::from(self.0[lane] < other.0[lane]) << lane)
    }
}
