//! Constructs where two triangles in contact meet: a point, a segment or a convex polygon.
//!
//! # Method
//! The common part of two triangles is convex, so it is the hull of its extreme points. Exact signs decide which these are,
//! and so of which kind the part is. An extreme point is a corner of one triangle, or the point where an edge of one meets
//! the plane of the other, or, in one plane, an edge of the other. Where the planes cross, each triangle cuts an interval out
//! of the common line, and four orientations of edges find the ends of what both have in common (P. Guigue and O. Devillers,
//! "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates", 2003).
//!
//! # Accuracy
//! A corner is returned as it is. On an edge from p to q, whose ends have heights x and -y over a plane, the exact point is
//! p + t (q - p) with t = x / (x + y). If x and y are off by at most e, then t is off by at most e / (x + y), with the
//! computed x + y. Where that is more than 2^-40, t is the rounded quotient of integers. So no point is off by more than 2^-40
//! of its edge and a few roundings, however flat the planes cross. The bound of each point's own error is returned.
//!
//! The ends of an edge are sorted first. So the two triangles at an edge give the same bits for the point where it meets a
//! third one.

use super::integers::{cross as cross_exactly, dot as dot_exactly, exponent, integer, minus, quotient};
use super::intersection::{Aligned, Hull, Plane, are_collinear, area, area_axis, heights, lexicographic};
use super::intersection::{triangle_contains, volume};
use super::triangle_distance::{longest, perpendicular_normal, times};
use super::{Point, Triangle, dot, negated, reciprocal_exponent, subtract};
use crate::numerics::UNIT_ROUNDOFF;
use num_bigint::BigInt;
use std::cmp::Ordering;

/// The largest number of extreme points that two triangles have in common.
pub(crate) const MAX_POINTS: usize = 6;

/// Where two triangles meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Region {
    /// The number of extreme points of the exact region: 1 of a point, 2 of a segment.
    pub(crate) corners: usize,
    /// The first `count` of these are the rounded points. A polygon has fewer than `corners` if rounding aligns some.
    pub(crate) points: [Point; MAX_POINTS],
    pub(crate) count: usize,
    /// No point is farther than this from the exact one, and so from either triangle.
    pub(crate) error: f64,
}

/// A constructed point, and how far it is at most from the exact one.
#[derive(Clone, Copy)]
pub(super) struct Constructed {
    pub(super) point: Point,
    pub(super) error: f64,
}

impl Constructed {
    fn exactly(point: Point) -> Self {
        Self { point, error: 0.0 }
    }
}

/// Returns the region that two triangles in contact have in common: [`triangles_intersect`](super::triangles_intersect) is
/// true for them.
///
/// The ends of a segment in which two planes cross follow the cross product of A's normal and B's; other segments are sorted.
/// The corners of a polygon are in order around it, counterclockwise as A is. Swapping the triangles gives the same points.
pub(crate) fn common_region(a: &Triangle, b: &Triangle) -> Region {
    let (sides_a, sides_b) = (heights(b, a), heights(a, b));
    // Triangles without area have no heights over them.
    if sides_a == [0.0; 3] || sides_b == [0.0; 3] {
        return flat_region(a, b);
    }
    let Aligned { a: edges_a, b: edges_b, is_reversed } = Aligned::new(a, sides_a, b, sides_b);
    let ([a0, a1, a2], [b0, b1, b2]) = (edges_a, edges_b);
    let common = |edge_a: [Point; 2], edge_b: [Point; 2]| meeting_of_edges(edge_a, edge_b, a, b);
    // What touches in one point: a lone corner in the other plane, or intervals that meet end to end.
    if height(b, a0) == 0.0 {
        return Region::of(&[Constructed::exactly(a0)]);
    }
    if height(a, b0) == 0.0 {
        return Region::of(&[Constructed::exactly(b0)]);
    }
    if volume(a0, a2, b0, b2) == 0.0 {
        return Region::of(&[common([a0, a2], [b0, b2])]);
    }
    if volume(a0, a1, b0, b1) == 0.0 {
        return Region::of(&[common([a0, a1], [b0, b1])]);
    }
    let between = |order: f64, edge_a: [Point; 2], edge_b: [Point; 2]| {
        if order < 0.0 {
            meeting_of_plane(edge_a, b)
        } else if order > 0.0 {
            meeting_of_plane(edge_b, a)
        } else {
            common(edge_a, edge_b)
        }
    };
    // The later start and the earlier end.
    let start = between(volume(a0, a2, b0, b1), [a0, a2], [b0, b1]);
    let end = between(-volume(a0, a1, b0, b2), [a0, a1], [b0, b2]);
    Region::of(&if is_reversed { [end, start] } else { [start, end] })
}

impl Region {
    fn of(points: &[Constructed]) -> Self {
        let mut region = Self { corners: 0, points: [[0.0; 3]; MAX_POINTS], count: 0, error: 0.0 };
        for Constructed { point, error } in points.iter().take(MAX_POINTS) {
            region.points[region.count] = *point;
            region.count += 1;
            region.error = region.error.max(*error);
        }
        Self { corners: region.count, ..region }
    }
}

fn height(plane: &Triangle, point: Point) -> f64 {
    let [height] = heights(plane, &[point]);
    height
}

fn sorted([p, q]: [Point; 2]) -> [Point; 2] {
    if lexicographic(p, q).is_le() { [p, q] } else { [q, p] }
}

/// Returns the point in which two edges meet whose triangles are in different planes: an end of one, if it is that, or the
/// point of the lesser edge.
fn meeting_of_edges(edge_a: [Point; 2], edge_b: [Point; 2], a: &Triangle, b: &Triangle) -> Constructed {
    let of_a = meeting_of_plane(edge_a, b);
    if of_a.error == 0.0 {
        return of_a;
    }
    let of_b = meeting_of_plane(edge_b, a);
    if of_b.error == 0.0 || sorted(edge_b) < sorted(edge_a) { of_b } else { of_a }
}

/// Returns the point in which an edge meets a plane that does not contain it and that its ends are not strictly on one side of.
pub(super) fn meeting_of_plane(edge: [Point; 2], plane: &Triangle) -> Constructed {
    let [p, q] = sorted(edge);
    let sides = heights(plane, &[p, q]);
    if sides[0] == 0.0 {
        return Constructed::exactly(p);
    }
    if sides[1] == 0.0 {
        return Constructed::exactly(q);
    }
    Share::new(p, q, plane).of([p, q])
}

/// Returns the point in which two edges in one plane meet that cross properly, in the projection along `axis`.
fn meeting_in_plane(edge_a: [Point; 2], edge_b: [Point; 2], axis: usize) -> Constructed {
    let (a, b) = (sorted(edge_a), sorted(edge_b));
    let (edge, [r, s]) = if a <= b { (a, b) } else { (b, a) };
    let project = |mut p: Point| {
        p[axis] = 0.0;
        p
    };
    // A wall on the other edge, along the axis.
    let mut above = project(r);
    above[axis] = 1.0;
    Share::new(project(edge[0]), project(edge[1]), &[project(r), project(s), above]).of(edge)
}

/// The share of the way from one point to another at which a plane is met that lies strictly between them.
struct Share {
    t: f64,
    error: f64,
}

/// The largest error of a share that f64 may leave: 2^-40.
const DOUBT: f64 = 1.0 / (1u64 << 40) as f64;

impl Share {
    #[inline(always)]
    fn new(p: Point, q: Point, triangle: &Triangle) -> Self {
        let plane = Plane::new(triangle);
        let ((x, error_x), (y, error_y)) = (plane.height(p), plane.height(q));
        let (sum, error) = ((x - y).abs(), error_x.max(error_y));
        if sum > 0.0 && error <= DOUBT * sum {
            // The sum and both quotients are rounded.
            let error = (error / sum) * (1.0 + 8.0 * UNIT_ROUNDOFF) + 2.0 * UNIT_ROUNDOFF;
            return Self { t: (x / (x - y)).clamp(0.0, 1.0), error };
        }
        // A quotient within one unit in the last place of a number below 1.
        Self { t: exact_share(p, q, triangle).clamp(0.0, 1.0), error: 2.0 * UNIT_ROUNDOFF }
    }

    /// Returns the point at this share of an edge, within the edge's box.
    ///
    /// Along each axis, the difference of the ends is rounded and so is the product with the share, which both are at most the
    /// difference; then the sum. The bound has twice that much. It adds the errors of three axes.
    #[inline(always)]
    fn of(&self, [p, q]: [Point; 2]) -> Constructed {
        let mut error = f64::MIN_POSITIVE;
        let point = [0, 1, 2].map(|k| {
            let difference = q[k] - p[k];
            let x = (p[k] + self.t * difference).clamp(p[k].min(q[k]), p[k].max(q[k]));
            error += (self.error + 4.0 * UNIT_ROUNDOFF) * difference.abs() + 2.0 * UNIT_ROUNDOFF * x.abs();
            x
        });
        Constructed { point, error }
    }
}

/// Returns the share that integers give, rounded.
#[cold]
#[inline(never)]
fn exact_share(p: Point, q: Point, plane: &Triangle) -> f64 {
    let numbers = plane.as_flattened().iter().chain(&p).chain(&q);
    let unit = numbers.filter(|x| **x != 0.0).map(|x| exponent(*x)).min().unwrap_or(0);
    let exact = |point: &Point| point.map(|x| integer(x, unit));
    let [a, b, c] = plane.each_ref().map(exact);
    let normal = cross_exactly(&minus(&b, &a), &minus(&c, &a));
    let height = |point: &Point| dot_exactly(&minus(&exact(point), &a), &normal);
    let (x, y) = (height(&p), height(&q));
    let (part, whole) = (BigInt::from(x.magnitude().clone()), BigInt::from((x - y).magnitude().clone()));
    // Only a plane that does not separate the points has no such share.
    if part == BigInt::ZERO || whole == BigInt::ZERO { 0.0 } else { quotient(&part, &whole) }
}

/// Returns the region of triangles of which one is in the other's plane, or has no area.
#[cold]
#[inline(never)]
fn flat_region(a: &Triangle, b: &Triangle) -> Region {
    let (hull_a, hull_b) = (Hull::new(a), Hull::new(b));
    let mut points = Vec::with_capacity(MAX_POINTS);
    for (corners, other) in [(hull_a.corners(), &hull_b.corners), (hull_b.corners(), &hull_a.corners)] {
        for corner in corners {
            let is_known = |known: &Constructed| lexicographic(known.point, *corner).is_eq();
            if triangle_contains(other, *corner) && !points.iter().any(is_known) {
                points.push(Constructed::exactly(*corner));
            }
        }
    }
    let (larger, smaller) =
        if hull_a.count >= hull_b.count { (&hull_a, &hull_b) } else { (&hull_b, &hull_a) };
    if larger.count == 3 && heights(&larger.corners, &smaller.corners) != [0.0; 3] {
        // A segment that meets the face in one point.
        if points.is_empty() {
            points.push(meeting_of_plane([smaller.corners[0], smaller.last()], &larger.corners));
        }
        return Region::of(&points);
    }
    if let Some(axis) = common_axis(larger, smaller) {
        for edge_a in edges(&hull_a) {
            for edge_b in edges(&hull_b) {
                if cross_properly(edge_a, edge_b, axis) {
                    points.push(meeting_in_plane(edge_a, edge_b, axis));
                }
            }
        }
        if points.len() > 2 {
            return polygon(points, axis, area(axis, a[0], a[1], a[2]) < 0.0);
        }
    }
    sort_few(&mut points, |p, q| lexicographic(p.point, q.point));
    Region::of(&points)
}

fn edges(hull: &Hull) -> impl Iterator<Item = [Point; 2]> {
    let count = [0, 0, 1, 3][hull.count];
    (0..count).map(|i| [hull.corners[i], hull.corners[(i + 1) % 3]])
}

/// Returns an axis along which the plane of two hulls is projected one to one, or `None` if they are on one line.
fn common_axis(larger: &Hull, smaller: &Hull) -> Option<usize> {
    if larger.count == 3 {
        return Some(area_axis(&larger.corners));
    }
    let (p, q) = (larger.corners[0], larger.last());
    (0..3).find(|&axis| smaller.corners.iter().any(|r| area(axis, p, q, *r) != 0.0))
}

/// Returns whether each edge has its ends strictly on both sides of the other.
fn cross_properly([p, q]: [Point; 2], [r, s]: [Point; 2], axis: usize) -> bool {
    let separates = |p, q, r, s| {
        let (first, second) = (area(axis, p, q, r), area(axis, p, q, s));
        first < 0.0 && second > 0.0 || first > 0.0 && second < 0.0
    };
    separates(p, q, r, s) && separates(r, s, p, q)
}

/// Returns the convex hull of rounded points, exactly, in a projection (A. M. Andrew, "Another Efficient Algorithm for Convex
/// Hulls in Two Dimensions", 1979).
fn polygon(mut points: Vec<Constructed>, axis: usize, is_clockwise: bool) -> Region {
    let corners = points.len().min(MAX_POINTS);
    let order = |p: &Constructed, q: &Constructed| {
        let projected = |p: &Constructed| [p.point[(axis + 1) % 3], p.point[(axis + 2) % 3], 0.0];
        lexicographic(projected(p), projected(q))
    };
    sort_few(&mut points, order);
    points.dedup_by(|p, q| order(p, q).is_eq());
    let half = |points: &mut dyn Iterator<Item = &Constructed>| {
        let mut chain: Vec<Constructed> = Vec::with_capacity(MAX_POINTS);
        for next in points {
            while let [.., p, q] = &chain[..]
                && area(axis, p.point, q.point, next.point) <= 0.0
            {
                chain.pop();
            }
            chain.push(*next);
        }
        // The last point is the first one of the other half.
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    if hull.is_empty() {
        hull = points;
    }
    if is_clockwise {
        hull[1..].reverse();
    }
    Region { corners, ..Region::of(&hull) }
}

/// Sorts a few values, in less code than sorts of many take. Equal ones keep their order.
fn sort_few<T>(values: &mut [T], order: impl Fn(&T, &T) -> Ordering) {
    for end in 1..values.len() {
        let mut at = end;
        while at > 0 && order(&values[at - 1], &values[at]).is_gt() {
            values.swap(at - 1, at);
            at -= 1;
        }
    }
}

/// Returns the unit normal of a triangle in the orientation of its corners, or zero if it has no area.
///
/// Its error is a few roundings, divided by the sine of the triangle's angle beside the longest edge.
pub(crate) fn unit_normal(triangle: &Triangle) -> Point {
    let [p, q, r] = *triangle;
    if are_collinear(p, q, r) {
        return [0.0; 3];
    }
    let edges = [subtract(q, p), subtract(r, q), subtract(p, r)];
    let size = edges.as_flattened().iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    let edges = edges.map(|edge| times(reciprocal_exponent(size), edge));
    let base = longest(&edges);
    unit(perpendicular_normal(edges[base], negated(edges[(base + 2) % 3])))
}

/// Returns a vector at length 1, or zero if it has no direction.
pub(crate) fn unit(v: Point) -> Point {
    let size = v.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    if !(f64::MIN_POSITIVE..=f64::MAX).contains(&size) {
        return [0.0; 3];
    }
    let scaled = times(reciprocal_exponent(size), v);
    times(1.0 / dot(scaled, scaled).sqrt(), scaled)
}
