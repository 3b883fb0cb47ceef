//! Decides exactly whether a ray meets a closed triangle, and bounds where.
//!
//! # Method
//! Let A, B and C be the corners as seen from the ray's origin, and d its direction. The sign of d · (A × B) tells on
//! which side the ray's line passes the directed edge from A to B (A. Segura, F. Feito, "Algorithms to Test
//! Ray-Triangle Intersection", 2001). The line crosses the triangle if no two of the three signs are opposite. If all
//! are 0, ray and triangle lie in one plane, or the triangle has no area. Otherwise, with n = (B - A) × (C - A), the
//! three products add up to d · n, which therefore has the sign of those that are not 0. The line meets the plane at t
//! = (n · A) / (n · d).
//!
//! Signs are computed in f64 where a bound of the error allows it, and in integers elsewhere. The filter computes the
//! differences, products and sums of stage A of Shewchuk's `orient3d` in the same order, with the exact direction in
//! the place of a rounded difference, and so has at most the same error. The parameter t is a quotient of two such
//! determinants, each within its error. If that leaves more than 2^-44 of t in doubt, t is the rounded quotient of
//! integers.
//!
//! # Precondition
//! Origin and corners keep the precondition of [`narrow`](super). The largest component of the direction is in [1, 2), and
//! all are multiples of 2^-266: then nothing under- or overflows.

use super::integers::{
    Vector, cross as cross_exactly, dot as dot_exactly, exponent, integer, minus, quotient,
};
use super::{Point, Triangle, cross, dot, subtract};
use crate::numerics::{ORIENTATION_ERROR, UNIT_ROUNDOFF};
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// A ray, or the line that it is on: all points `origin + t * direction` with t ≥ 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: Point,
    pub(crate) direction: Point,
}

/// Where a ray first meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// The parameter; 0 if and only if the origin is on the triangle.
    pub(crate) t: f64,
    /// A certified lower bound of the exact parameter, at most `t`.
    pub(crate) lower: f64,
    /// A certified upper bound of the exact parameter, at least `t`.
    pub(crate) upper: f64,
    feature: Feature,
}

impl Crossing {
    /// A crossing of the surface around a triangle, which is on none of its features.
    pub(super) fn around(t: f64, lower: f64, upper: f64) -> Self {
        Self { t, lower, upper, feature: Feature::Face }
    }

    fn meets_same_feature(&self, other: &Self) -> bool {
        self.feature == other.feature && self.feature != Feature::Face
    }
}

/// The feature of a triangle that a line meets. Lines meet equal corners and equal edges at equal parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Feature {
    Corner(Point),
    /// The ends in lexicographic order.
    Edge(Point, Point),
    Face,
}

impl Feature {
    fn edge(p: Point, q: Point) -> Self {
        if p < q { Self::Edge(p, q) } else { Self::Edge(q, p) }
    }
}

/// How much of a parameter may be in doubt: 2^-44 of it.
const DOUBT: f64 = 1.0 / (1u64 << 44) as f64;

impl Ray {
    /// Returns where the ray first meets a triangle, if it does.
    ///
    /// The answer is exact. Touching in a vertex, along an edge or in a plane counts. A triangle without area is the segment
    /// or point that its corners span.
    #[inline(always)]
    pub(crate) fn crossing(&self, triangle: &Triangle) -> Option<Crossing> {
        self.crossing_within(triangle, DOUBT)
    }

    /// Returns whether the ray meets a triangle up to a limit of its parameter. The decision is that of [`Ray::crossing`] and
    /// [`Ray::is_within`], which need not know the parameter well.
    #[inline(always)]
    pub(crate) fn meets(&self, triangle: &Triangle, limit: f64) -> bool {
        let crossing = self.crossing_within(triangle, f64::INFINITY);
        crossing.is_some_and(|crossing| self.is_within(triangle, &crossing, limit))
    }

    /// Does what `crossing` does, where so much of the parameter may be in doubt.
    // Pages load one copy for all questions.
    #[cfg_attr(not(all(target_arch = "wasm32", target_os = "unknown")), inline(always))]
    fn crossing_within(&self, triangle: &Triangle, doubt: f64) -> Option<Crossing> {
        let seen = self.seen(triangle);
        let mut sides = [0.0; 3];
        for i in 0..3 {
            sides[i] = self.side(triangle, &seen, i);
        }
        let (positive, negative) =
            (sides.iter().any(|side| *side > 0.0), sides.iter().any(|side| *side < 0.0));
        if positive && negative {
            return None;
        }
        if !positive && !negative {
            return self.crossing_in_plane(triangle);
        }
        self.crossing_of_plane(triangle, &seen, (positive, doubt), feature(triangle, sides))
    }

    /// Returns a triangle as the origin sees it, but for roundings.
    #[inline(always)]
    fn seen(&self, &[a, b, c]: &Triangle) -> Triangle {
        [subtract(a, self.origin), subtract(b, self.origin), subtract(c, self.origin)]
    }

    /// Returns a number with the exact sign of the side on which the line passes edge `i`.
    #[inline(always)]
    fn side(&self, triangle: &Triangle, seen: &Triangle, i: usize) -> f64 {
        let (u, v) = (seen[i], seen[(i + 1) % 3]);
        let side = dot(self.direction, cross(u, v));
        if side.abs() > ORIENTATION_ERROR * permanent(self.direction, u, v) {
            side
        } else {
            self.exact_side(triangle[i], triangle[(i + 1) % 3])
        }
    }

    #[cold]
    #[inline(never)]
    fn exact_side(&self, p: Point, q: Point) -> f64 {
        // Many directions lead to a point that is an f64.
        let ahead = [0, 1, 2].map(|k| self.origin[k] + self.direction[k]);
        if (0..3).all(|k| {
            ahead[k] - self.origin[k] == self.direction[k] && ahead[k] - self.direction[k] == self.origin[k]
        }) {
            return super::intersection::volume(self.origin, ahead, p, q);
        }
        let exact = Integers::new(self, &[p, q, q]);
        sign(&dot_exactly(&exact.direction, &cross_exactly(&exact.corners[0], &exact.corners[1])))
    }

    /// Returns where the line meets the plane of a triangle that it crosses, if that is on the ray. `forwards`: the normal
    /// has a positive product with the direction.
    #[inline(always)]
    fn crossing_of_plane(
        &self,
        triangle: &Triangle,
        seen: &Triangle,
        (forwards, doubt): (bool, f64),
        feature: Feature,
    ) -> Option<Crossing> {
        let (u, v) = (subtract(triangle[1], triangle[0]), subtract(triangle[2], triangle[0]));
        let normal = cross(u, v);
        let sign = if forwards { 1.0 } else { -1.0 };
        let (height, slope) = (sign * dot(seen[0], normal), sign * dot(self.direction, normal));
        let height_error = ORIENTATION_ERROR * permanent(seen[0], u, v);
        let slope_error = ORIENTATION_ERROR * permanent(self.direction, u, v);
        if height < -height_error {
            return None;
        }
        // Each quotient is within three roundings of what it bounds, and its product takes one more.
        let lower = (height - height_error) / (slope + slope_error) * (1.0 - 8.0 * UNIT_ROUNDOFF);
        let upper = (height + height_error) / (slope - slope_error) * (1.0 + 8.0 * UNIT_ROUNDOFF);
        if slope > slope_error && lower > 0.0 && upper - lower <= doubt * upper {
            let t = (height / slope).max(lower).min(upper);
            return Some(Crossing { t, lower, upper, feature });
        }
        self.exact_crossing_of_plane(triangle, feature)
    }

    #[cold]
    #[inline(never)]
    fn exact_crossing_of_plane(&self, triangle: &Triangle, feature: Feature) -> Option<Crossing> {
        let t = self.parameter_of_plane(triangle);
        // The denominator is 0 only if corners are not finite, as in a damaged file: finite ones have sides that add up to it.
        let is_number = t.denominator != BigInt::ZERO;
        (is_number && t.numerator.sign() != Sign::Minus).then(|| t.crossing(feature))
    }

    /// Returns the exact parameter at which the line meets the plane of a triangle with area that is not parallel to it.
    fn parameter_of_plane(&self, triangle: &Triangle) -> Quotient {
        let exact = Integers::new(self, triangle);
        let [a, b, c] = &exact.corners;
        let normal = cross_exactly(&minus(b, a), &minus(c, a));
        exact.parameter(dot_exactly(a, &normal), dot_exactly(&exact.direction, &normal))
    }

    /// Returns where the ray meets a triangle that is in a plane with it, or has no area.
    #[cold]
    #[inline(never)]
    fn crossing_in_plane(&self, triangle: &Triangle) -> Option<Crossing> {
        let meetings = self.meetings_in_plane(triangle);
        let (first, feature) = meetings.iter().min_by(|(s, _), (t, _)| s.compare(t))?;
        if first.numerator.sign() != Sign::Minus {
            return Some(first.crossing(*feature));
        }
        // What the line and the triangle have in common reaches from the first to the last of these.
        let reaches = meetings.iter().any(|(t, _)| t.numerator.sign() != Sign::Minus);
        reaches.then_some(Crossing { t: 0.0, lower: 0.0, upper: 0.0, feature: Feature::Face })
    }

    /// Returns the parameters at which the line meets a corner, or crosses an edge, of a triangle in a plane with it.
    fn meetings_in_plane(&self, triangle: &Triangle) -> Vec<(Quotient, Feature)> {
        let exact = Integers::new(self, triangle);
        let (corners, d) = (&exact.corners, &exact.direction);
        let offsets = corners.each_ref().map(|corner| cross_exactly(d, corner));
        // All offsets from the line are multiples of one vector: one of its components tells them apart.
        let told = (0..3).find(|&k| offsets.iter().any(|offset| offset[k] != BigInt::ZERO)).unwrap_or(0);
        let offsets = offsets.each_ref().map(|offset| &offset[told]);
        let axis = (0..3).find(|&k| d[k] != BigInt::ZERO).unwrap_or(0);
        let mut meetings = Vec::new();
        for i in 0..3 {
            let j = (i + 1) % 3;
            if *offsets[i] == BigInt::ZERO {
                let t = exact.parameter(corners[i][axis].clone(), d[axis].clone());
                meetings.push((t, Feature::Corner(triangle[i])));
            } else if offsets[i].sign() == -offsets[j].sign() {
                let along = &corners[i][axis] * offsets[j] - &corners[j][axis] * offsets[i];
                let t = exact.parameter(along, (offsets[j] - offsets[i]) * &d[axis]);
                meetings.push((t, Feature::edge(triangle[i], triangle[j])));
            }
        }
        meetings
    }

    /// Compares exactly where the ray meets two triangles.
    #[inline(always)]
    pub(crate) fn compare(&self, a: (&Triangle, &Crossing), b: (&Triangle, &Crossing)) -> Ordering {
        if a.1.upper < b.1.lower {
            Ordering::Less
        } else if b.1.upper < a.1.lower {
            Ordering::Greater
        } else if a.1.meets_same_feature(b.1) || a.1.upper == 0.0 && b.1.upper == 0.0 {
            Ordering::Equal
        } else {
            self.exact_parameter(a.0, a.1).compare(&self.exact_parameter(b.0, b.1))
        }
    }

    /// Returns whether a triangle is met at a parameter of at most `limit`, which is not negative.
    #[inline(always)]
    pub(crate) fn is_within(&self, triangle: &Triangle, crossing: &Crossing, limit: f64) -> bool {
        crossing.upper <= limit
            || crossing.lower <= limit && self.exact_parameter(triangle, crossing).is_at_most(limit)
    }

    /// Returns the exact parameter of a crossing.
    #[cold]
    #[inline(never)]
    fn exact_parameter(&self, triangle: &Triangle, crossing: &Crossing) -> Quotient {
        if crossing.upper == 0.0 {
            return Quotient { numerator: BigInt::ZERO, denominator: 1.into() };
        }
        let seen = self.seen(triangle);
        if (0..3).any(|i| self.side(triangle, &seen, i) != 0.0) {
            return self.parameter_of_plane(triangle);
        }
        // A crossing in the plane whose parameter is not 0 is the first of all.
        let meetings = self.meetings_in_plane(triangle).into_iter().map(|(t, _)| t);
        let first = meetings.min_by(|s, t| s.compare(t));
        first.expect("a line that meets a triangle in a plane with it meets an edge or a corner")
    }
}

/// Returns what of a triangle a line meets that crosses it and is not in its plane, from the sides of its edges.
#[inline(always)]
fn feature(triangle: &Triangle, sides: [f64; 3]) -> Feature {
    match sides.map(|side| side == 0.0) {
        [true, true, _] => Feature::Corner(triangle[1]),
        [_, true, true] => Feature::Corner(triangle[2]),
        [true, _, true] => Feature::Corner(triangle[0]),
        [true, ..] => Feature::edge(triangle[0], triangle[1]),
        [_, true, _] => Feature::edge(triangle[1], triangle[2]),
        [.., true] => Feature::edge(triangle[2], triangle[0]),
        _ => Feature::Face,
    }
}

/// Returns the permanent of three vectors: the product of the first with the minors of the others, all terms positive.
#[inline(always)]
fn permanent(w: Point, u: Point, v: Point) -> f64 {
    let magnitudes = |[x, y, z]: Point| [x.abs(), y.abs(), z.abs()];
    let (w, u, v) = (magnitudes(w), magnitudes(u), magnitudes(v));
    dot(w, [u[1] * v[2] + u[2] * v[1], u[2] * v[0] + u[0] * v[2], u[0] * v[1] + u[1] * v[0]])
}

/// A ray and a triangle seen from its origin, as integers: lengths are multiples of one power of two, and the direction's
/// components of another.
struct Integers {
    direction: Vector,
    corners: [Vector; 3],
    /// The binary logarithms of the two units.
    unit: i32,
    direction_unit: i32,
}

impl Integers {
    fn new(ray: &Ray, triangle: &Triangle) -> Self {
        let least = |numbers: &mut dyn Iterator<Item = &f64>| {
            numbers.filter(|x| **x != 0.0).map(|x| exponent(*x)).min().unwrap_or(0)
        };
        let unit = least(&mut triangle.as_flattened().iter().chain(&ray.origin));
        let direction_unit = least(&mut ray.direction.iter());
        let origin = ray.origin.map(|x| integer(x, unit));
        Self {
            direction: ray.direction.map(|x| integer(x, direction_unit)),
            corners: triangle.each_ref().map(|corner| minus(&corner.map(|x| integer(x, unit)), &origin)),
            unit,
            direction_unit,
        }
    }

    /// Returns the parameter that is the quotient of a length along the direction and the direction's own.
    fn parameter(&self, length: BigInt, direction: BigInt) -> Quotient {
        let shift = self.unit - self.direction_unit;
        let (mut numerator, mut denominator) = (length << shift.max(0), direction << (-shift).max(0));
        if denominator.sign() == Sign::Minus {
            (numerator, denominator) = (-numerator, -denominator);
        }
        Quotient { numerator, denominator }
    }
}

/// A rational number; the denominator is positive.
struct Quotient {
    numerator: BigInt,
    denominator: BigInt,
}

impl Quotient {
    fn compare(&self, other: &Self) -> Ordering {
        (&self.numerator * &other.denominator).cmp(&(&other.numerator * &self.denominator))
    }

    fn is_at_most(&self, limit: f64) -> bool {
        let unit = exponent(limit);
        let limit = integer(limit, unit);
        &self.numerator << (-unit).max(0) <= (limit * &self.denominator) << unit.max(0)
    }

    /// Returns the crossing with this parameter, which is not negative.
    fn crossing(&self, feature: Feature) -> Crossing {
        if self.numerator == BigInt::ZERO {
            return Crossing { t: 0.0, lower: 0.0, upper: 0.0, feature };
        }
        let t = quotient(&self.numerator, &self.denominator);
        let lower = if t > f64::MIN_POSITIVE { t.next_down() } else { 0.0 };
        let t = t.max(f64::MIN_POSITIVE);
        Crossing { t, lower, upper: t.next_up(), feature }
    }
}

/// Returns a number with the sign of an integer.
fn sign(x: &BigInt) -> f64 {
    match x.sign() {
        Sign::Plus => 1.0,
        Sign::NoSign => 0.0,
        Sign::Minus => -1.0,
    }
}
