//! Decides exactly whether two closed triangles share a point.
//!
//! The general case follows P. Guigue and O. Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using
//! Orientation Predicates", Journal of Graphics Tools 8(1), 2003. Three orientations place the first triangle
//! relative to the second one's plane, and three more place the second relative to the first one's. Both triangles
//! cut an interval out of the line in which the planes cross, and two more orientations decide whether these
//! intervals overlap. Most pairs that miss are decided by the first three orientations.
//!
//! Only signs of determinants of input points are used, never a constructed point, so there is no tolerance.
//! Coplanar pairs are decided in an axis-parallel projection, which is exact because it only drops a
//! coordinate. A triangle without area is replaced by the segment or point that its corners span.

use std::cmp::Ordering;

use robust::{Coord, Coord3D};

use super::{Point, Triangle, cross, dot, subtract};
use crate::numerics::ORIENTATION_ERROR;

/// Returns whether two closed triangles share at least one point.
///
/// The answer is exact under the precondition of [`narrow`](super). Touching in a vertex, along an edge or in a
/// plane counts. A triangle without area is the segment or point that its corners span. The answer depends neither
/// on the order of the triangles nor on that of their corners. The cost is constant: 3 to 8 orientations if the
/// planes differ, some tens if they are the same.
#[must_use]
pub(crate) fn triangles_intersect(a: &Triangle, b: &Triangle) -> bool {
    let sides_a = heights(b, a);
    if all_on_one_side(sides_a) {
        return false;
    }
    if sides_a == [0.0; 3] {
        return flat_intersect(a, b);
    }
    // Some corner of `a` has a nonzero height over the plane of `b`, so `b` has area.
    let sides_b = heights(a, b);
    if all_on_one_side(sides_b) {
        return false;
    }
    if sides_b == [0.0; 3] {
        return flat_intersect(a, b);
    }
    intervals_overlap(a, sides_a, b, sides_b)
}

/// Returns whether a closed triangle contains a point. The answer is that of `triangles_intersect` for the triangle and
/// one whose corners are all that point. It costs one orientation, unless the point is in the triangle's plane.
#[must_use]
pub(super) fn triangle_contains(triangle: &Triangle, point: Point) -> bool {
    // A triangle without area has no height over it.
    if heights(triangle, &[point]) != [0.0] {
        return false;
    }
    let hull = Hull::new(triangle);
    let point = Hull { corners: [point; 3], count: 1 };
    if hull.count == 3 {
        coplanar_intersect(triangle, point.corners(), area_axis(triangle))
    } else {
        segments_intersect(&hull, &point)
    }
}

/// Returns whether a closed triangle and the closed segment between two points share a point: the answer of
/// [`triangles_intersect`] about a triangle without area, in less time.
pub(crate) fn segment_intersects(triangle: &Triangle, p: Point, q: Point) -> bool {
    let [first, second] = heights(triangle, &[p, q]);
    if first == 0.0 && second == 0.0 {
        return triangles_intersect(triangle, &[p, q, q]);
    }
    let is_on_one_side = (first > 0.0 && second > 0.0) || (first < 0.0 && second < 0.0);
    !is_on_one_side && is_crossed(triangle, p, q)
}

/// Returns a number with the exact sign of the volume spanned by `p, q, r, s`: positive if `p, q, r` turn
/// counterclockwise as seen from `s`.
pub(super) fn volume(p: Point, q: Point, r: Point, s: Point) -> f64 {
    let [height] = heights(&[p, q, r], &[s]);
    height
}

/// Returns what [`volume`] does, where a filter cannot decide.
#[cold]
fn exact_volume(p: Point, q: Point, r: Point, s: Point) -> f64 {
    if let Some(volume) = integer_volume([p, q, r, s]) {
        return volume;
    }
    let coordinate = |p: Point| Coord3D { x: p[0], y: p[1], z: p[2] };
    // `robust` returns a positive number for a point below the plane.
    -robust::orient3d(coordinate(p), coordinate(q), coordinate(r), coordinate(s))
}

/// Returns the sign of a volume if the coordinates are integers below 2^40 in magnitude, in some power of two. Those of
/// neighbouring triangles in `f32` are, unless some are very near 0, and this takes a quarter of the time of expansions.
///
/// A difference is then below 2^41, a minor below 2^83, and the volume below 2^126.
fn integer_volume(points: [Point; 4]) -> Option<f64> {
    const BITS: i64 = 40;
    let largest = points.iter().flatten().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    // The exponent of the power of two that makes the largest one at least 2^39, in the bits of an `f64`.
    let exponent = 2 * 1023 + BITS - 1 - (largest.to_bits() >> 52) as i64;
    let scale = (1..2047).contains(&exponent).then(|| f64::from_bits((exponent as u64) << 52))?;
    let scaled = points.map(|point| point.map(|x| x * scale));
    let integers = scaled.map(|point| point.map(|x| x as i64));
    if integers.map(|point| point.map(|x| x as f64)) != scaled {
        return None;
    }
    let [p, q, r, s] = integers;
    let minus = |x: [i64; 3]| [0, 1, 2].map(|axis| i128::from(x[axis] - p[axis]));
    let (u, v, w) = (minus(q), minus(r), minus(s));
    let minor = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
    let volume = w[0] * minor(1, 2) + w[1] * minor(2, 0) + w[2] * minor(0, 1);
    Some(volume.signum() as f64)
}

/// Returns, for each corner of `points`, a number with the exact sign of its height over the plane of `plane`.
#[inline(always)]
pub(super) fn heights<const POINTS: usize>(plane: &Triangle, points: &[Point; POINTS]) -> [f64; POINTS] {
    let of_plane = Plane::new(plane);
    points.map(|point| {
        let (height, error) = of_plane.height(point);
        if height.abs() > error { height } else { exact_volume(plane[0], plane[1], plane[2], point) }
    })
}

/// The plane of a triangle: a corner, the normal, and the normal with all terms positive.
///
/// The filter is stage A of Shewchuk's `orient3d` (Adaptive Precision Floating-Point Arithmetic and Fast
/// Robust Geometric Predicates, 1997, section 4.3), but all points share the minors of the plane. It computes
/// the same differences, products and sums in the same order, with one vertex of the plane in the place of his
/// point `d`, so it has the same error bound.
pub(super) struct Plane {
    corner: Point,
    normal: Point,
    magnitude: Point,
}

impl Plane {
    #[inline(always)]
    pub(super) fn new(triangle: &Triangle) -> Self {
        let u = subtract(triangle[1], triangle[0]);
        let v = subtract(triangle[2], triangle[0]);
        let normal = cross(u, v);
        let (u, v) = (u.map(f64::abs), v.map(f64::abs));
        let magnitude = [u[1] * v[2] + u[2] * v[1], u[2] * v[0] + u[0] * v[2], u[0] * v[1] + u[1] * v[0]];
        Self { corner: triangle[0], normal, magnitude }
    }

    /// Returns the height of a point, times twice the triangle's area, and a bound of its error.
    #[inline(always)]
    pub(super) fn height(&self, point: Point) -> (f64, f64) {
        let w = subtract(point, self.corner);
        (dot(w, self.normal), ORIENTATION_ERROR * dot(w.map(f64::abs), self.magnitude))
    }
}

#[inline(always)]
fn all_on_one_side(sides: [f64; 3]) -> bool {
    (sides[0] > 0.0 && sides[1] > 0.0 && sides[2] > 0.0)
        || (sides[0] < 0.0 && sides[1] < 0.0 && sides[2] < 0.0)
}

/// Returns the corner that the plane separates from the other two, and whether it is on the positive side or, if it
/// lies on the plane, the others are on the negative side.
///
/// Either the corner is strictly on one side and the others are on the other side or on the plane, or it lies on the
/// plane and the others are strictly on one side. So each edge from it meets the plane in exactly one point.
/// `sides` must be neither all zero nor all strictly on one side.
#[inline(always)]
fn lone_corner(sides: [f64; 3]) -> (usize, bool) {
    let is_lone =
        |p: f64, q: f64, r: f64| q <= 0.0 && r <= 0.0 && (p > 0.0 || (p == 0.0 && q < 0.0 && r < 0.0));
    let [p, q, r] = sides;
    if is_lone(p, q, r) {
        (0, true)
    } else if is_lone(-p, -q, -r) {
        (0, false)
    } else if is_lone(q, r, p) {
        (1, true)
    } else if is_lone(-q, -r, -p) {
        (1, false)
    } else {
        (2, is_lone(r, p, q))
    }
}

/// Decides the case of two planes that cross in a line which both triangles reach: each cuts an interval out of it.
fn intervals_overlap(a: &Triangle, sides_a: [f64; 3], b: &Triangle, sides_b: [f64; 3]) -> bool {
    let Aligned { a, b, .. } = Aligned::new(a, sides_a, b, sides_b);
    volume(a[0], a[1], b[0], b[1]) <= 0.0 && volume(a[0], a[2], b[2], b[0]) <= 0.0
}

/// Two triangles whose planes cross in a line which both reach, with corners renumbered as Guigue and Devillers do: the
/// lone corner is the first, and on the positive side of the other triangle's plane.
///
/// Then the line, directed along the cross product of A's normal and B's, enters `a` through the edge from 0 to 2 and
/// leaves it through the edge from 0 to 1. It enters `b` through the edge from 0 to 1 and leaves it through the edge from 0
/// to 2. Each end of an interval is the only point that its edge's line has in common with the other plane. An edge of `a`
/// and an edge of `b`, both from the lone corners, meet the line in the same point exactly if they are coplanar. Otherwise
/// the volume of their corners is negative if that of `b` comes first.
pub(super) struct Aligned {
    pub(super) a: Triangle,
    pub(super) b: Triangle,
    /// Whether the numbering reverses one of the two normals, and so the direction of the line.
    pub(super) is_reversed: bool,
}

impl Aligned {
    /// `sides` are heights over the other triangle's plane.
    #[inline(always)]
    pub(super) fn new(a: &Triangle, sides_a: [f64; 3], b: &Triangle, sides_b: [f64; 3]) -> Self {
        let (first_a, positive_a) = lone_corner(sides_a);
        let (first_b, positive_b) = lone_corner(sides_b);
        let renumber = |triangle: &Triangle, first: usize, flip: bool| {
            let (second, third) = if flip { (first + 2, first + 1) } else { (first + 1, first + 2) };
            [triangle[first], triangle[second % 3], triangle[third % 3]]
        };
        // Flipping a triangle reverses its normal, and so moves the other's lone corner to the positive side.
        Self {
            a: renumber(a, first_a, !positive_b),
            b: renumber(b, first_b, !positive_a),
            is_reversed: positive_a != positive_b,
        }
    }
}

/// The corners of a triangle's convex hull: three corners, or the two ends of a segment, or one point.
pub(super) struct Hull {
    pub(super) corners: Triangle,
    pub(super) count: usize,
}

impl Hull {
    pub(super) fn new(triangle: &Triangle) -> Self {
        let [p, q, r] = *triangle;
        if !are_collinear(p, q, r) {
            return Self { corners: *triangle, count: 3 };
        }
        // The lexicographic order of points on a line is their order along the line.
        let mut sorted = [p, q, r];
        sorted.sort_by(|p, q| lexicographic(*p, *q));
        let (first, last) = (sorted[0], sorted[2]);
        let count = if lexicographic(first, last).is_eq() { 1 } else { 2 };
        Self { corners: [first, last, last], count }
    }

    pub(super) fn corners(&self) -> &[Point] {
        &self.corners[..self.count]
    }

    /// Returns the end of the last edge; for a point, the point itself.
    pub(super) fn last(&self) -> Point {
        self.corners[self.count - 1]
    }
}

/// Decides the cases in which one triangle lies in the other's plane, or one has no area.
#[cold]
fn flat_intersect(a: &Triangle, b: &Triangle) -> bool {
    let (a, b) = (Hull::new(a), Hull::new(b));
    let (larger, smaller) = if a.count >= b.count { (a, b) } else { (b, a) };
    if larger.count == 3 {
        triangle_meets(&larger.corners, &smaller)
    } else {
        segments_intersect(&larger, &smaller)
    }
}

/// Returns whether a triangle with area meets a segment, a point, or a triangle in the same plane.
fn triangle_meets(triangle: &Triangle, other: &Hull) -> bool {
    let sides = heights(triangle, &other.corners);
    if all_on_one_side(sides) {
        return false;
    }
    if sides == [0.0; 3] {
        return coplanar_intersect(triangle, other.corners(), area_axis(triangle));
    }
    is_crossed(triangle, other.corners[0], other.last())
}

/// Returns whether a triangle with area meets a segment that meets its plane in one point: whether the segment's line does
/// not pass two edges on different sides.
fn is_crossed(triangle: &Triangle, p: Point, q: Point) -> bool {
    let passes = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| volume(p, q, triangle[i], triangle[j]));
    passes.iter().all(|side| *side >= 0.0) || passes.iter().all(|side| *side <= 0.0)
}

/// Returns whether two segments meet; the second, or both, may be points.
fn segments_intersect(a: &Hull, b: &Hull) -> bool {
    let (p, q) = (a.corners[0], a.last());
    let (r, s) = (b.corners[0], b.last());
    if volume(p, q, r, s) != 0.0 {
        return false;
    }
    for axis in 0..3 {
        if area(axis, p, q, r) != 0.0 || area(axis, p, q, s) != 0.0 {
            // The projection maps the plane of the four points one to one.
            return coplanar_intersect(a.corners(), b.corners(), axis);
        }
    }
    lexicographic(p, s).is_le() && lexicographic(r, q).is_le()
}

/// Returns whether two convex hulls in one plane meet, decided in the projection along `axis`, which must map that
/// plane one to one; the hulls must not all lie on one line.
///
/// If the hulls are disjoint, their difference is a convex polygon with area that does not contain the origin. Then
/// the line of one of its edges separates it from the origin, and its edges are parallel to edges of the hulls.
fn coplanar_intersect(a: &[Point], b: &[Point], axis: usize) -> bool {
    !has_separating_edge(a, b, axis) && !has_separating_edge(b, a, axis)
}

/// Returns whether the line of an edge of `a` has all of `b` strictly on one side and `a` on the other, closed side.
fn has_separating_edge(a: &[Point], b: &[Point], axis: usize) -> bool {
    let edges = match a.len() {
        1 => 0,
        2 => 1,
        corners => corners,
    };
    (0..edges).any(|i| {
        let (p, q) = (a[i], a[(i + 1) % a.len()]);
        let inner = area(axis, p, q, a[(i + 2) % a.len()]);
        let left = b.iter().all(|r| area(axis, p, q, *r) > 0.0);
        let right = b.iter().all(|r| area(axis, p, q, *r) < 0.0);
        (left && inner <= 0.0) || (right && inner >= 0.0)
    })
}

/// Returns an axis along which the triangle projects to one with area; the triangle must have area itself.
pub(crate) fn area_axis(triangle: &Triangle) -> usize {
    (0..2).find(|axis| area(*axis, triangle[0], triangle[1], triangle[2]) != 0.0).unwrap_or(2)
}

pub(super) fn are_collinear(p: Point, q: Point, r: Point) -> bool {
    (0..3).all(|axis| area(axis, p, q, r) == 0.0)
}

/// Returns a number with the exact sign of the area of `p, q, r` projected along `axis`.
pub(super) fn area(axis: usize, p: Point, q: Point, r: Point) -> f64 {
    let project = |p: Point| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] };
    robust::orient2d(project(p), project(q), project(r))
}

pub(super) fn lexicographic(p: Point, q: Point) -> Ordering {
    // The partial order treats -0 and 0 as equal; coordinates are never NaN.
    p.partial_cmp(&q).unwrap_or(Ordering::Equal)
}
