//! Registers of `f64` for the three corners of a triangle.

/// A number for each of three corners. All operations are rounded to nearest, and none is fused, so that all backends compute
/// the same bits. Where a register has a fourth lane, it repeats the third.
pub(crate) trait Corners: Copy {
    /// A truth value per corner.
    type Mask: Copy;

    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// Returns the smaller number of each corner, neither of which is NaN.
    fn min(self, other: Self) -> Self;
    /// Returns the larger number of each corner, neither of which is NaN.
    fn max(self, other: Self) -> Self;
    /// `self < other`, false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    fn and(mask: Self::Mask, other: Self::Mask) -> Self::Mask;
    /// Returns `yes` for corners where the mask is set, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Returns the number of a corner.
    fn of(&self, corner: usize) -> f64;
    fn all(self) -> [f64; 3];
    /// Returns the largest number, if none is NaN.
    #[inline(always)]
    fn largest(self) -> f64 {
        let [x, y, z] = self.all();
        let larger = |x, y| if x > y { x } else { y };
        larger(larger(x, y), z)
    }
}

/// Three numbers, one after another.
#[derive(Clone, Copy)]
pub(crate) struct Three([f64; 3]);

/// Defines methods by what they do for a corner.
macro_rules! by_corner {
    ($($name:ident($x:ident, $y:ident) $result:ty { $each:expr })+) => {
        $(#[inline(always)]
        fn $name(self, other: Self) -> $result {
            let each = |$x: f64, $y: f64| $each;
            let ([a, b, c], [d, e, f]) = (self.0, other.0);
            <$result>::from([each(a, d), each(b, e), each(c, f)])
        })+
    };
}

impl From<[f64; 3]> for Three {
    #[inline(always)]
    fn from(values: [f64; 3]) -> Self {
        Self(values)
    }
}

impl Corners for Three {
    type Mask = [bool; 3];

    by_corner! {
        add(x, y) Self { x + y }
        sub(x, y) Self { x - y }
        mul(x, y) Self { x * y }
        div(x, y) Self { x / y }
        min(x, y) Self { if x < y { x } else { y } }
        max(x, y) Self { if x > y { x } else { y } }
        lt(x, y) [bool; 3] { x < y }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let [x, y, z] = self.0;
        Self([x.abs(), y.abs(), z.abs()])
    }
    #[inline(always)]
    fn and([a, b, c]: [bool; 3], [d, e, f]: [bool; 3]) -> [bool; 3] {
        [a & d, b & e, c & f]
    }
    #[inline(always)]
    fn select([a, b, c]: [bool; 3], yes: Self, no: Self) -> Self {
        use std::hint::select_unpredictable as select;
        let ([x, y, z], [u, v, w]) = (yes.0, no.0);
        Self([select(a, x, u), select(b, y, v), select(c, z, w)])
    }
    #[inline(always)]
    fn of(&self, corner: usize) -> f64 {
        self.0[corner % 3]
    }
    #[inline(always)]
    fn all(self) -> [f64; 3] {
        self.0
    }
}
