//! Decides exactly whether a ray comes within a radius of a triangle, and bounds where it first does.
//!
//! Along a ray, the distance from a triangle is a convex function f of the parameter, so that the points within the radius r
//! are an interval, and all that matters follows from values of f: if f(t) > r on one side of a point within, all farther out
//! on that side is outside, too. The least value is found by halving, with the sign of the slope, and the entry by halving
//! between a point outside and one inside. Each value comes with certified bounds, so the bounds of the entry are certified.
//! Where no value proves that the ray comes within r, integers decide. The entry is then only known to be between two points that
//! are certainly outside.

use super::within::ray_within;
use super::{
    Closest, Crossing, Point, Ray, Triangle, dot, point_distance, subtract, triangle_distance,
    triangles_within,
};
use crate::isa::scalar::Scalar;
use crate::numerics::UNIT_ROUNDOFF;

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

struct Along<'a> {
    ray: &'a Ray,
    triangle: &'a Triangle,
    /// The sum of the magnitudes of the triangle's coordinates.
    magnitude: f64,
    radius: f64,
}

impl Along<'_> {
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

    /// Returns whether the ray comes within the radius, exactly. The part up to `end` decides.
    fn is_hit(&self, until: f64, end: f64) -> bool {
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

    /// Returns the entry, given a parameter outside before it and one inside.
    fn entry(&self, outside: f64, inside: f64) -> Crossing {
        let (mut low, mut high) = (outside, inside);
        let (mut lower, mut upper) = (outside, inside);
        for _ in 0..HALVINGS {
            let middle = low + (high - low) / 2.0;
            if middle <= low || middle >= high {
                break;
            }
            let value = self.value(middle);
            if value.closest.distance > self.radius {
                low = middle;
                if value.lower > self.radius {
                    lower = middle;
                }
            } else {
                high = middle;
                if value.upper <= self.radius {
                    upper = middle;
                }
            }
        }
        Crossing::around(high, lower, upper)
    }
}

/// Returns where a ray, whose parameter goes up to `until`, first comes within a radius above 0 of a triangle. Whether it does is
/// exact.
pub(crate) fn rounded_crossing(ray: &Ray, until: f64, triangle: &Triangle, radius: f64) -> Option<Crossing> {
    let magnitude = triangle.as_flattened().iter().map(|x| x.abs()).sum();
    let along = Along { ray, triangle, magnitude, radius };
    let start = along.value(0.0);
    if triangles_within(triangle, &[ray.origin; 3], &start.closest, radius) {
        return Some(Crossing::around(0.0, 0.0, 0.0));
    }
    let end = along.end().min(until);
    if !along.is_hit(until, end) {
        return None;
    }
    if along.value(end).upper <= radius {
        return Some(along.entry(0.0, end));
    }
    // Either side of the least value, and the last parameters there at which the ray is certainly outside.
    let (mut low, mut high) = (0.0, end);
    let (mut before, mut behind) = (0.0, end);
    for _ in 0..HALVINGS {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            break;
        }
        let value = along.value(middle);
        if value.upper <= radius {
            return Some(along.entry(before, middle));
        }
        if value.lower > radius && value.slope < -value.slope_error {
            before = middle;
        }
        if value.lower > radius && value.slope > value.slope_error {
            behind = middle;
        }
        if value.slope < 0.0 { low = middle } else { high = middle }
    }
    Some(Crossing::around(high.clamp(before, behind), before, behind))
}
