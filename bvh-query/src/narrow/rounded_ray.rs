//! Decides exactly whether a ray comes within a radius of a triangle, and bounds where it first and last does.
//!
//! Along a ray, the distance from a triangle is a convex function f of the parameter, so that the points within the radius r
//! are an interval, and all that matters follows from values of f: if f(t) > r on one side of a point within, all farther out
//! on that side is outside, too. The least value is found by halving, with the sign of the slope, and either end of the interval by
//! halving between a point outside and one inside. Each value comes with certified bounds, so the bounds of the ends are certified.
//! Where no value proves that the ray comes within r, integers decide. Both ends are then only known to be between two points that
//! are certainly outside.

use super::within::ray_within;
use super::{
    Closest, Crossing, Point, Ray, Triangle, cross, dot, point_distance, subtract, triangle_distance,
    triangles_within,
};
use crate::isa::scalar::Scalar;
use crate::numerics::{SLACK, UNIT_ROUNDOFF};

/// How often an interval of the parameter is halved: more often than an f64 has digits.
const HALVINGS: u32 = 64;

/// The distance from a triangle at a point of a ray.
struct Value {
    closest: Closest,
    /// Certified bounds of the distance at the exact point.
    lower: f64,
    upper: f64,
    /// The slope of the distance along the ray, times the distance, and how far it is off.
    slope: f64,
    slope_error: f64,
}

/// A ray and a triangle with a radius above 0.
pub(crate) struct RoundedRay<'a> {
    ray: &'a Ray,
    triangle: &'a Triangle,
    /// The sum of the magnitudes of the triangle's coordinates.
    magnitude: f64,
    radius: f64,
}

/// What is known of the interval in which a ray is within the radius, before its ends are sought.
#[derive(Clone, Copy)]
struct Found {
    /// In the interval, unless the ray only grazes: then it is where the ray comes nearest, as well as that is known.
    at: f64,
    is_graze: bool,
    /// The interval starts here or later, and ends here or earlier.
    before: f64,
    behind: f64,
}

impl<'a> RoundedRay<'a> {
    #[inline(always)]
    pub(crate) fn new(ray: &'a Ray, triangle: &'a Triangle, radius: f64) -> Self {
        let magnitude = triangle.as_flattened().iter().map(|x| x.abs()).sum();
        Self { ray, triangle, magnitude, radius }
    }

    /// Returns whether a ray, whose parameter goes up to `until`, comes within the radius, exactly.
    pub(crate) fn is_met(&self, until: f64) -> bool {
        self.nearest().is_some_and(|nearest| self.is_hit((until, self.end().min(until)), nearest))
    }

    /// Returns where a ray, whose parameter goes up to `until`, first comes within the radius. Whether it does is exact.
    pub(crate) fn entry(&self, until: f64) -> Option<Crossing> {
        self.find(until).map(|found| self.end_of(&found, found.before))
    }

    /// Returns where a ray, whose parameter goes up to `until`, first comes within the radius, and where it last is, which may be beyond
    /// `until`.
    pub(crate) fn stay(&self, until: f64) -> Option<[Crossing; 2]> {
        let found = self.find(until)?;
        let entry = self.end_of(&found, found.before);
        let whole = if until < self.end() { self.find(f64::INFINITY)? } else { found };
        let exit = self.end_of(&whole, whole.behind);
        // The exit is no earlier than the entry, whose bounds may be better.
        let t = exit.t.max(entry.t);
        Some([entry, Crossing::around(t, exit.lower.max(entry.lower), exit.upper.max(t))])
    }

    /// Returns whether all of the ray that is within the radius is certainly between two parameters, given that some of the ray is.
    pub(crate) fn is_between(&self, from: f64, to: f64) -> bool {
        let (first, last) = (self.value(from), self.value(to));
        self.is_before(&first) && self.is_behind(&last)
    }

    #[inline(always)]
    fn point(&self, t: f64) -> Point {
        [0, 1, 2].map(|k| self.ray.origin[k] + t * self.ray.direction[k])
    }

    #[inline(never)]
    fn value(&self, t: f64) -> Value {
        let point = self.point(t);
        let closest = point_distance(Scalar, self.triangle, point);
        let error = self.error(t, &point);
        Value {
            closest,
            lower: (closest.lower - error).next_down(),
            upper: (closest.upper + error).next_up(),
            slope: dot(subtract(point, closest.point_a), self.ray.direction),
            // Along each axis, the point of the ray is off by at most `error`, and that of the triangle by a few roundings of
            // the coordinates, edges and gaps that it is made of. Components of the direction are below 2.
            slope_error: 64.0 * (error + UNIT_ROUNDOFF * (self.magnitude + closest.distance)),
        }
    }

    /// Returns whether all of the ray up to a value is certainly outside, and the least one is farther on.
    #[inline(always)]
    fn is_before(&self, value: &Value) -> bool {
        value.lower > self.radius && value.slope < -value.slope_error
    }

    /// Returns whether all of the ray from a value on is certainly outside, and the least one is farther back.
    #[inline(always)]
    fn is_behind(&self, value: &Value) -> bool {
        value.lower > self.radius && value.slope > value.slope_error
    }

    /// Returns whether the ray enters after a parameter, by so much that the halving of an interval would not find it earlier either.
    /// So it does not matter whether it is left out, nor in which order others were found.
    ///
    /// Before a parameter at which the distance decreases, it is larger, and decreases faster. Its bounds there are off by at most three
    /// times as much, as the magnitudes that they are proportional to are at most twice as large, plus the triangle's.
    pub(crate) fn enters_after(&self, t: f64) -> bool {
        let value = self.value(t);
        value.lower - 4.0 * (value.upper - value.lower) > self.radius
            && value.slope < -4.0 * value.slope_error
    }

    /// Returns whether the line of the ray certainly passes by a ball around the triangle and its radius; and else a parameter near the
    /// middle of the triangle.
    ///
    /// The vector from the origin to the middle is rounded by a few units of the magnitudes, and so is the gap from the line.
    fn nearest(&self) -> Option<f64> {
        let Ray { origin, direction } = self.ray;
        let [a, b, c] = self.triangle;
        let middle = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        let from = subtract(middle, *origin);
        let squared = |v: Point| dot(v, v);
        let ball = self.triangle.iter().map(|corner| squared(subtract(*corner, middle))).fold(0.0, f64::max);
        let magnitude = self.magnitude + origin.iter().map(|x| x.abs()).sum::<f64>();
        let reach = (ball.sqrt() + self.radius) * (1.0 + SLACK) + SLACK * magnitude;
        let along = squared(*direction);
        let is_past = squared(cross(from, *direction)) > along * reach * reach * (1.0 + SLACK);
        (!is_past).then(|| dot(from, *direction) / along)
    }

    fn starts_inside(&self) -> bool {
        triangles_within(self.triangle, &[self.ray.origin; 3], &self.value(0.0).closest, self.radius)
    }

    /// Returns whether the ray comes within the radius, exactly. The part up to `end` decides.
    fn is_hit(&self, (until, end): (f64, f64), nearest: f64) -> bool {
        if self.value(nearest.clamp(0.0, end)).upper <= self.radius {
            return true;
        }
        let last = self.point(end);
        let closest = triangle_distance(self.triangle, &[self.ray.origin, last, last]);
        let error = self.error(end, &last);
        if closest.lower - error > self.radius * (1.0 + 4.0 * UNIT_ROUNDOFF) {
            return false;
        }
        closest.upper + error <= self.radius * (1.0 - 4.0 * UNIT_ROUNDOFF)
            || self
                .ray
                .crossing(self.triangle)
                .is_some_and(|at| self.ray.is_within(self.triangle, &at, until))
            || ray_within(self.ray, until, self.triangle, self.radius)
    }

    /// Bounds how far a rounded point of the ray is from the exact one. Each coordinate takes two roundings.
    #[inline(always)]
    fn error(&self, t: f64, point: &Point) -> f64 {
        let Ray { origin, direction } = self.ray;
        let magnitude: f64 =
            (0..3).map(|k| origin[k].abs() + (t * direction[k]).abs() + point[k].abs()).sum();
        2.0 * UNIT_ROUNDOFF * magnitude
    }

    /// Returns a parameter beyond which the ray is certainly outside.
    fn end(&self) -> f64 {
        let origin = self.ray.origin;
        // The largest component of the direction is at least 1, so that a parameter is at most as large as a length.
        let far = |corner: &Point| (0..3).map(|k| (corner[k] - origin[k]).abs()).sum::<f64>();
        let farthest = self.triangle.iter().map(far).fold(0.0, f64::max);
        2.0 * (farthest + self.radius) + f64::MIN_POSITIVE
    }

    /// Finds some of the ray that is within the radius, up to a parameter `until`.
    fn find(&self, until: f64) -> Option<Found> {
        let end = self.end().min(until);
        let nearest = self.nearest()?;
        if self.starts_inside() {
            return Some(Found { at: 0.0, is_graze: false, before: 0.0, behind: end });
        }
        if !self.is_hit((until, end), nearest) {
            return None;
        }
        if self.value(end).upper <= self.radius {
            return Some(Found { at: end, is_graze: false, before: 0.0, behind: end });
        }
        // Either side of the least value, and the last parameters there at which the ray is certainly outside.
        let (mut low, mut high) = (0.0, end);
        let (mut before, mut behind) = (0.0, end);
        for _ in 0..HALVINGS {
            let middle = low + (high - low) / 2.0;
            if middle <= low || middle >= high {
                break;
            }
            let value = self.value(middle);
            if value.upper <= self.radius {
                return Some(Found { at: middle, is_graze: false, before, behind });
            }
            if self.is_before(&value) {
                before = middle;
            }
            if self.is_behind(&value) {
                behind = middle;
            }
            if value.slope < 0.0 { low = middle } else { high = middle }
        }
        Some(Found { at: high.clamp(before, behind), is_graze: true, before, behind })
    }

    /// Returns an end of the interval, given a parameter outside on its side.
    #[inline(never)]
    fn end_of(&self, found: &Found, outside: f64) -> Crossing {
        if found.is_graze {
            return Crossing::around(found.at, found.before, found.behind);
        }
        let (mut out, mut inside) = (outside, found.at);
        let mut certain = [out, inside];
        for _ in 0..HALVINGS {
            let middle = out + (inside - out) / 2.0;
            if middle == out || middle == inside {
                break;
            }
            let value = self.value(middle);
            if value.closest.distance > self.radius {
                out = middle;
                if value.lower > self.radius {
                    certain[0] = middle;
                }
            } else {
                inside = middle;
                if value.upper <= self.radius {
                    certain[1] = middle;
                }
            }
        }
        Crossing::around(inside, certain[0].min(certain[1]), certain[0].max(certain[1]))
    }
}
