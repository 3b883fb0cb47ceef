//! Fixed directions and the k-DOPs over them: the shape that bounds triangles.
//!
//! A direction set is a prefix of one list of 13 integer vectors: 3 axes, then 4 cube diagonals,
//! then 6 face diagonals, so that the sets nest (6 in 14 in 26). Directions are *not* normalised:
//! a slab along `(1, 1, 1)` holds `x + y + z`. That keeps sums of coordinates free of products.
//!
//! A k-DOP here is a pair of `f32` bounds per direction, rounded outward: the true extent of the
//! geometry lies within `[lo, hi]` along each direction.

/// The list of directions. `DIRECTIONS[..3]` are a box's, `[..7]` dop14's, `[..13]` dop26's.
pub const DIRECTIONS: [[i8; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [-1, 1, 1],
    [1, 1, 0],
    [1, 0, 1],
    [0, 1, 1],
    [1, -1, 0],
    [1, 0, -1],
    [0, 1, -1],
];

/// How many directions a node is bounded along; k counts both ends of each slab.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DirectionSet {
    /// 3 slabs: the axis-aligned box.
    Dop6,
    /// 7 slabs: box and cube diagonals.
    Dop14,
    /// 13 slabs: box, cube diagonals and face diagonals.
    Dop26,
}

impl DirectionSet {
    /// Number of slabs: k / 2.
    pub const fn slabs(self) -> usize {
        match self {
            Self::Dop6 => 3,
            Self::Dop14 => 7,
            Self::Dop26 => 13,
        }
    }

    /// The larger of two sets; every other set is a part of it.
    pub fn max(self, other: Self) -> Self {
        if self >= other { self } else { other }
    }
}

/// A k-DOP over all 13 directions; code for a smaller set leaves the rest alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kdop {
    /// Lower ends, rounded down.
    pub lo: [f32; 13],
    /// Upper ends, rounded up.
    pub hi: [f32; 13],
}

impl Kdop {
    /// The bound of nothing: joins with any other to that other.
    pub const EMPTY: Self = Self { lo: [f32::INFINITY; 13], hi: [f32::NEG_INFINITY; 13] };

    /// Grows the first `slabs` slabs by a point.
    #[inline]
    pub fn add_point(&mut self, point: [f32; 3], slabs: usize) {
        for axis in 0..3 {
            self.lo[axis] = self.lo[axis].min(point[axis]);
            self.hi[axis] = self.hi[axis].max(point[axis]);
        }
        for slab in 3..slabs {
            let (lo, hi) = project_outward(point, DIRECTIONS[slab]);
            self.lo[slab] = self.lo[slab].min(lo);
            self.hi[slab] = self.hi[slab].max(hi);
        }
    }

    /// Grows the first `slabs` slabs by another k-DOP.
    #[inline]
    pub fn join(&mut self, other: &Self, slabs: usize) {
        for slab in 0..slabs {
            self.lo[slab] = self.lo[slab].min(other.lo[slab]);
            self.hi[slab] = self.hi[slab].max(other.hi[slab]);
        }
    }

    /// True if the first `slabs` slabs of `self` contain those of `inner`.
    pub fn contains(&self, inner: &Self, slabs: usize) -> bool {
        (0..slabs).all(|slab| self.lo[slab] <= inner.lo[slab] && self.hi[slab] >= inner.hi[slab])
    }

    /// Surface area of the axis-aligned box in the first three slabs, in square mesh units.
    pub fn box_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|a| f64::from(self.hi[a]) - f64::from(self.lo[a]));
        2.0 * (x * y + y * z + z * x)
    }
}

/// The projection of `point` on `direction` as the nearest `f32` interval around the exact value.
///
/// At most three `f32` are added. The sum is taken in `f64` with the error of each addition
/// recovered exactly (Knuth's two-sum), so that the rounding to `f32` can go the right way.
#[inline]
pub fn project_outward(point: [f32; 3], direction: [i8; 3]) -> (f32, f32) {
    let [x, y, z] = [0, 1, 2].map(|a| f64::from(point[a]) * f64::from(direction[a]));
    let (xy, error_xy) = two_sum(x, y);
    let (sum, error_z) = two_sum(xy, z);
    // |error| is far below the spacing of `f32` at `sum`, so its sign decides alone.
    let error = error_xy + error_z;
    let nearest = sum as f32;
    let above = (sum - f64::from(nearest)) + error;
    let lo = if above < 0.0 { nearest.next_down() } else { nearest };
    let hi = if above > 0.0 { nearest.next_up() } else { nearest };
    (lo, hi)
}

/// `a + b` rounded, and the exact error of that rounding.
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact projection as an integer number of 2^-149, the smallest step of `f32`.
    fn exact(point: [f32; 3], direction: [i8; 3]) -> i128 {
        // Test points are small multiples of 2^-60, so that 2^66 is scale enough.
        (0..3).map(|a| (f64::from(point[a]) * 2f64.powi(66)) as i128 * i128::from(direction[a])).sum()
    }

    #[test]
    fn projections_round_outward_and_stay_tight() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let exponent = -((state >> 59) as i32);
            (((state >> 20) as u32 & 0xff_ffff) as f32 - 8388608.0) * 2f32.powi(exponent - 24)
        };
        for _ in 0..20_000 {
            let point = [random(), random(), random()];
            for direction in DIRECTIONS {
                let (lo, hi) = project_outward(point, direction);
                let true_value = exact(point, direction);
                let scaled = |v: f32| (f64::from(v) * 2f64.powi(66)) as i128;
                assert!(scaled(lo) <= true_value && true_value <= scaled(hi));
                assert!(hi == lo || hi == lo.next_up(), "not tight: {point:?} {direction:?}");
            }
        }
    }

    #[test]
    fn sets_nest() {
        assert_eq!(DirectionSet::Dop6.max(DirectionSet::Dop26).slabs(), 13);
        for (i, a) in DIRECTIONS.iter().enumerate() {
            for b in &DIRECTIONS[..i] {
                assert_ne!(*a, *b);
                assert_ne!(*a, b.map(|v| -v));
            }
        }
    }
}
