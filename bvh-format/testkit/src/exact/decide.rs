//! Runs the oracles fast: boxes and balls settle the certain cases, and integers settle the rest.

use super::dyadic::on_common_grid;
use super::separation::{directions, gaps};
use super::{Ball, Corners, Dyadic, Number, dot, meet};
use crate::Triangle;

/// A triangle and its box.
#[derive(Clone, Copy)]
pub struct Boxed {
    /// The corners.
    pub corners: Triangle,
    low: [f64; 3],
    high: [f64; 3],
}

impl Boxed {
    /// Returns a triangle with its box.
    pub fn new(corners: Triangle) -> Self {
        let end = |pick: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|k| pick(corners[0][k], pick(corners[1][k], corners[2][k])))
        };
        Self { corners, low: end(f64::min), high: end(f64::max) }
    }

    /// Returns a stand-in for many triangles, or `None` for none: its box encloses all of theirs, and its corners mean nothing.
    pub fn around<'a>(all: impl Iterator<Item = &'a Self>) -> Option<Self> {
        let join = |p: Self, q: Self| Self {
            low: [0, 1, 2].map(|k| p.low[k].min(q.low[k])),
            high: [0, 1, 2].map(|k| p.high[k].max(q.high[k])),
            ..p
        };
        all.copied().reduce(join)
    }

    /// Returns the axis along which the box is longest.
    pub fn longest_axis(&self) -> usize {
        let side = |k: &usize| self.high[*k] - self.low[*k];
        (0..3).max_by(|i, j| side(i).total_cmp(&side(j))).unwrap()
    }

    /// Returns the middle of the box along an axis, rounded.
    pub fn middle(&self, axis: usize) -> f64 {
        self.low[axis] / 2.0 + self.high[axis] / 2.0
    }

    /// Returns whether the boxes share a point. The comparisons are exact.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// Returns a lower bound of the distance between the boxes. Each gap is off by a factor of at most 1 + u with u =
    /// 2^-53, and the square, two sums and the root add four more. Squares that underflow only lessen the bound.
    pub fn gap(&self, other: &Self) -> f64 {
        let along = |k: usize| (self.low[k] - other.high[k]).max(other.low[k] - self.high[k]).max(0.0);
        let [x, y, z] = [along(0), along(1), along(2)];
        (x * x + y * y + z * z).sqrt() * (1.0 - 8.0 * f64::EPSILON)
    }

    /// Returns the longest side of the box around both.
    pub fn span(&self, other: &Self) -> f64 {
        let side = |k: usize| self.high[k].max(other.high[k]) - self.low[k].min(other.low[k]);
        side(0).max(side(1)).max(side(2))
    }
}

/// Returns both triangles and the power of two by which they are multiplied. It brings the largest coordinate between
/// 1 and 2, so that products stay in range.
fn balls(a: &Triangle, b: &Triangle) -> (Corners<Ball>, Corners<Ball>, f64) {
    let largest = a.iter().chain(b).flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let exponent = (largest.to_bits() >> 52).clamp(23, 2023);
    let scale = f64::from_bits((2046 - exponent) << 52);
    let ball = |x: f64| Ball::scaled(x, scale);
    (a.map(|p| p.map(ball)), b.map(|p| p.map(ball)), scale)
}

/// The number of pairs that each way decided.
#[derive(Clone, Copy, Default)]
pub struct Decided {
    /// Pairs whose boxes are apart.
    pub by_boxes: u64,
    /// Pairs whose signs are certain in balls.
    pub by_balls: u64,
    /// Pairs that only exact numbers decide.
    pub by_integers: u64,
}

/// Returns whether two closed triangles share a point.
pub fn intersect(a: &Boxed, b: &Boxed, decided: &mut Decided) -> bool {
    if !a.overlaps(b) {
        decided.by_boxes += 1;
        return false;
    }
    let (of_a, of_b, _) = balls(&a.corners, &b.corners);
    if let Some(answer) = meet(&of_a, &of_b) {
        decided.by_balls += 1;
        return answer;
    }
    decided.by_integers += 1;
    match on_common_grid(&a.corners, &b.corners) {
        Some([a, b]) => meet(&a, &b).unwrap(),
        None => {
            let [a, b] = [a, b].map(|t| t.corners.map(|p| p.map(Dyadic::of)));
            meet(&a, &b).unwrap()
        }
    }
}

/// Returns whether a slab wider than `limit` certainly separates the triangles.
///
/// Any direction is valid, so for a direction of balls its middle is used.
pub fn certainly_farther(a: &Boxed, b: &Boxed, limit: f64) -> bool {
    if a.gap(b) > limit {
        return true;
    }
    let (a, b, scale) = balls(&a.corners, &b.corners);
    let limit = Ball::scaled(limit, scale);
    let gaps = gaps(&a, &b);
    let found = directions(&a, &b, |direction| {
        let direction = direction.map(|x| Ball::exactly(x.middle()));
        let (mut above, mut below) = (f64::INFINITY, f64::INFINITY);
        for gap in &gaps {
            let height = dot(&direction, gap);
            above = above.min(height.least());
            below = below.min(-height.most());
        }
        // A width beyond the limit means above * above > limit * limit * |direction|^2, with above > 0.
        let width = Ball::exactly(above.max(below));
        let square = limit.times(&limit).times(&dot(&direction, &direction));
        let wider = width.times(&width).minus(&square).sign();
        Some(width.middle() > 0.0 && wider.is_some_and(|sign| sign.is_gt()))
    });
    found == Some(true)
}
