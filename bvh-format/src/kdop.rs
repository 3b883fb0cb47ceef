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

    /// The k-DOP of points: the nearest `f32` outside their exact projections.
    ///
    /// Projections add at most three `f32`. Sums are taken in `f64` with the error of each addition
    /// recovered exactly (Knuth's two-sum); where there is one, the sum takes a step of 2^-52 in its
    /// direction, which is more than the error and never passes an `f32`.
    pub fn of_points(points: impl IntoIterator<Item = [f32; 3]>) -> Self {
        let (mut lo, mut hi) = ([f64::INFINITY; 13], [f64::NEG_INFINITY; 13]);
        for point in points {
            let [x, y, z] = point.map(f64::from);
            for slab in 0..13 {
                let [a, b, c] = FACTORS[slab];
                let (sum_xy, error_xy) = two_sum(a * x, b * y);
                let (sum, error_z) = two_sum(sum_xy, c * z);
                let error = error_xy + error_z;
                let step = sum.abs() * f64::EPSILON;
                let below = sum - if error < 0.0 { step } else { 0.0 };
                let above = sum + if error > 0.0 { step } else { 0.0 };
                lo[slab] = if below < lo[slab] { below } else { lo[slab] };
                hi[slab] = if above > hi[slab] { above } else { hi[slab] };
            }
        }
        Self { lo: lo.map(round_down), hi: hi.map(|end| -round_down(-end)) }
    }

    /// Grows the first `slabs` slabs by another k-DOP.
    #[inline]
    pub fn join(&mut self, other: &Self, slabs: usize) {
        for slab in 0..slabs {
            // Not `min` and `max`: there is no NaN to care for.
            let (lo, hi) = (other.lo[slab], other.hi[slab]);
            self.lo[slab] = if lo < self.lo[slab] { lo } else { self.lo[slab] };
            self.hi[slab] = if hi > self.hi[slab] { hi } else { self.hi[slab] };
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

/// The directions as factors.
pub const FACTORS: [[f64; 3]; 13] = {
    let mut factors = [[0.0; 3]; 13];
    let mut slab = 0;
    while slab < 13 {
        let [x, y, z] = DIRECTIONS[slab];
        factors[slab] = [x as f64, y as f64, z as f64];
        slab += 1;
    }
    factors
};

/// The nearest `f32` at or below.
fn round_down(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) > value { nearest.next_down() } else { nearest }
}

/// `a + b` rounded, and the exact error of that rounding.
#[inline(always)]
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
                let kdop = Kdop::of_points([point]);
                let slab = DIRECTIONS.iter().position(|&d| d == direction).unwrap();
                let (lo, hi) = (kdop.lo[slab], kdop.hi[slab]);
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
