//! Decides exactly whether two closed triangles, or a triangle and a ray, are at most `d` apart, where certified bounds cannot.
//!
//! All coordinates are multiples of one power of two, so they are converted to integers of any length. If two
//! triangles do not meet, their closest points are the feet of the shortest connection between the lines or planes
//! of two features (corners, edges or faces), and each foot lies inside its feature. Conversely, any two features
//! with feet inside them have points at that distance. So the triangles are at most `d` apart exactly if one of
//! these pairs of features is. Feet and squared distances are quotients of integers, so signs and comparisons of
//! products decide, and nothing is divided or rounded.
//!
//! The integers cost a few hundred microseconds and some memory, but only pairs whose distance is within a few
//! roundings of `d` need them.

use super::integers::{Vector, cross, dot, exponent, integer, minus};
use super::{Closest, Point, Ray, Triangle};
use num_bigint::BigInt;

/// Returns whether the exact distance between two triangles is at most `d`, which is not negative. `closest` is the
/// result of `triangle_distance` for them.
pub(crate) fn triangles_within(a: &Triangle, b: &Triangle, closest: &Closest, d: f64) -> bool {
    if closest.upper <= d {
        return true;
    }
    // Triangles that meet have an upper bound of 0.
    closest.lower <= d && any_feature_within(a, b, d, Compare::AtMost)
}

/// Returns whether the exact distance between two triangles is below `d`, which is above 0.
pub(crate) fn triangles_below(a: &Triangle, b: &Triangle, closest: &Closest, d: f64) -> bool {
    if closest.upper < d {
        return true;
    }
    closest.lower < d && any_feature_within(a, b, d, Compare::Below)
}

#[cold]
#[inline(never)]
fn any_feature_within(a: &Triangle, b: &Triangle, d: f64, compare: Compare) -> bool {
    let numbers = a.as_flattened().iter().chain(b.as_flattened()).chain([&d]);
    let unit = unit_of(numbers);
    let vector = |p: &Point| p.map(|x| integer(x, unit));
    let (a, b) = (a.each_ref().map(vector), b.each_ref().map(vector));
    let limit = Limit::new(d, unit, compare);
    let (edges_a, edges_b) = (edges_of(&a), edges_of(&b));
    corners(&a, &b, &limit)
        || corners_and_edges(&a, &edges_b, &limit)
        || corners_and_edges(&b, &edges_a, &limit)
        || edges(&edges_a, &edges_b, &limit)
        || corners_and_face(&a, &b, &limit)
        || corners_and_face(&b, &a, &limit)
}

/// Returns whether any point of a ray with a parameter of at most `until` is at most `d` from a triangle. The ray does not cross
/// the triangle.
#[cold]
#[inline(never)]
pub(crate) fn ray_within(ray: &Ray, until: f64, triangle: &Triangle, d: f64) -> bool {
    let is_endless = until == f64::INFINITY;
    // A product with the parameter is a multiple of the product of both units.
    let unit_of_t = if is_endless { 0 } else { exponent(until) };
    let numbers = triangle.as_flattened().iter().chain(&ray.origin).chain(&ray.direction).chain([&d]);
    let (unit, directions) = (unit_of(numbers), unit_of(&ray.direction));
    let unit = unit.min(directions + unit_of_t);
    let vector = |p: &Point| p.map(|x| integer(x, unit));
    let (t, origin) = (triangle.each_ref().map(vector), vector(&ray.origin));
    let along = if is_endless {
        vector(&ray.direction)
    } else {
        let t = integer(until, unit_of_t);
        ray.direction.map(|x| (integer(x, directions) * &t) << (directions + unit_of_t - unit))
    };
    let mut ends = vec![origin.clone()];
    if !is_endless {
        ends.push([&origin[0] + &along[0], &origin[1] + &along[1], &origin[2] + &along[2]]);
    }
    let line = [Edge { start: &origin, vector: along, is_endless }];
    let (limit, edges_of_t) = (Limit::new(d, unit, Compare::AtMost), edges_of(&t));
    corners(&ends, &t, &limit)
        || corners_and_edges(&ends, &edges_of_t, &limit)
        || corners_and_edges(&t, &line, &limit)
        || edges(&line, &edges_of_t, &limit)
        || corners_and_face(&ends, &t, &limit)
}

/// Returns the exponent of a power of two of which all numbers are multiples.
fn unit_of<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> i32 {
    numbers.into_iter().filter(|x| **x != 0.0).map(|x| exponent(*x)).min().unwrap_or(0)
}

/// How a distance is compared with the limit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Compare {
    AtMost,
    Below,
}

/// The square of the distance to compare with.
struct Limit {
    square: BigInt,
    compare: Compare,
}

impl Limit {
    fn new(d: f64, unit: i32, compare: Compare) -> Self {
        let d = integer(d, unit);
        Self { square: &d * &d, compare }
    }

    /// Compares both sides of an inequality.
    fn holds(&self, left: &BigInt, right: &BigInt) -> bool {
        if self.compare == Compare::AtMost { left <= right } else { left < right }
    }
}

/// An edge of a triangle, or a ray.
struct Edge<'a> {
    start: &'a Vector,
    vector: Vector,
    is_endless: bool,
}

impl Edge<'_> {
    /// Returns whether a foot is inside, given its place along the edge in units of which the edge has `whole`.
    fn contains(&self, along: &BigInt, whole: &BigInt) -> bool {
        *along >= BigInt::ZERO && (self.is_endless || along <= whole)
    }
}

fn edges_of(t: &[Vector; 3]) -> [Edge<'_>; 3] {
    [0, 1, 2].map(|i: usize| Edge { start: &t[i], vector: minus(&t[(i + 1) % 3], &t[i]), is_endless: false })
}

fn corners(a: &[Vector], b: &[Vector], limit: &Limit) -> bool {
    let pairs = a.iter().flat_map(|p| b.iter().map(move |q| minus(p, q)));
    pairs.into_iter().any(|gap| limit.holds(&dot(&gap, &gap), &limit.square))
}

/// Returns whether a corner is within the limit of an edge, with its foot inside the edge.
///
/// The foot is at (v e) / (e e) along the edge, and the squared distance is |v|² - (v e)² / (e e). An edge without
/// length is skipped, because its corners are tested.
fn corners_and_edges(corners: &[Vector], edges: &[Edge<'_>], limit: &Limit) -> bool {
    edges.iter().any(|edge| {
        let squared = dot(&edge.vector, &edge.vector);
        corners.iter().any(|corner| {
            let v = minus(corner, edge.start);
            let along = dot(&v, &edge.vector);
            squared != BigInt::ZERO
                && edge.contains(&along, &squared)
                && limit.holds(&((dot(&v, &v) - &limit.square) * &squared), &(&along * &along))
        })
    })
}

/// Returns whether two edges are within the limit of each other, with both feet inside them.
///
/// With n = e × f perpendicular to both edges and w from start to start, the feet are at (w × f) n / (n n) and
/// (w × e) n / (n n), and the squared distance is (w n)² / (n n). Parallel edges are skipped, because a corner of one
/// is as near to the other.
fn edges(edges_a: &[Edge<'_>], edges_b: &[Edge<'_>], limit: &Limit) -> bool {
    edges_a.iter().any(|a| {
        edges_b.iter().any(|b| {
            let normal = cross(&a.vector, &b.vector);
            let squared = dot(&normal, &normal);
            let w = minus(b.start, a.start);
            let height = dot(&w, &normal);
            squared != BigInt::ZERO
                && a.contains(&dot(&cross(&w, &b.vector), &normal), &squared)
                && b.contains(&dot(&cross(&w, &a.vector), &normal), &squared)
                && limit.holds(&(&height * &height), &(&limit.square * &squared))
        })
    })
}

/// Returns whether a corner is within the limit of a face, with its foot inside the face.
///
/// With the normal n = e × f of the face, the foot of a corner at v has the weights (v × f) n / (n n) on e and
/// (e × v) n / (n n) on f, and the squared distance is (v n)² / (n n). A face without area is skipped, because its
/// edges are tested.
fn corners_and_face(corners: &[Vector], t: &[Vector; 3], limit: &Limit) -> bool {
    let (e, f) = (minus(&t[1], &t[0]), minus(&t[2], &t[0]));
    let normal = cross(&e, &f);
    let squared = dot(&normal, &normal);
    squared != BigInt::ZERO
        && corners.iter().any(|corner| {
            let v = minus(corner, &t[0]);
            let (along_e, along_f) = (dot(&cross(&v, &f), &normal), dot(&cross(&e, &v), &normal));
            let height = dot(&v, &normal);
            along_e >= BigInt::ZERO
                && along_f >= BigInt::ZERO
                && &along_e + &along_f <= squared
                && limit.holds(&(&height * &height), &(&limit.square * &squared))
        })
}
