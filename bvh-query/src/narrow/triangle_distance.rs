//! Measures the distance between two closed triangles, with witness points and certified bounds.
//!
//! # Method
//! Unless the triangles meet, the two closest points lie in the relative interiors of two features (corners,
//! edges or faces), and the line between them is perpendicular to both features. There are four kinds of pairs:
//! corner and corner, corner and edge, edge and edge, corner and face. So the distance is the least of
//! 9 + 18 + 9 + 6 candidates. A candidate counts only if its feet lie strictly inside both features. If rounding
//! rejects a foot near the border of a feature, a candidate of that border takes its place. The distance itself
//! never decides whether the triangles meet: a positive lower bound proves that they do not, and otherwise
//! [`triangles_intersect`] decides.
//!
//! # Why it is accurate
//! Only differences of two input points enter the computation, so a common offset of both triangles
//! costs no accuracy, and a gap between two corners has full relative accuracy. The least-squares problem of two
//! edges, or of a corner and a face, is solved by modified Gram-Schmidt orthogonalisation (Å. Björck, "Solving
//! Linear Least Squares Problems by Gram-Schmidt Orthogonalization", BIT 7, 1967), which is backward stable. The
//! first direction is projected out of the second one, which leaves `h`, and out of the gap, which leaves `r`;
//! the distance is that of `r` from the line along `h`. Both have an absolute error of a few roundings of the
//! lengths involved, and the weight on `h` is at most 1. So the error of the distance is a few roundings of these
//! lengths, however short `h` is (for a sliver, or for two nearly parallel edges). The textbook formula divides
//! by `|d|²|e|² - (d·e)²` and loses half the digits there. A formula that skips normals below an absolute length
//! misses the face altogether.
//!
//! # Units
//! Differences are scaled by a power of two, exactly, so that the largest coordinate is in [1, 2). Whatever
//! underflows after that is too small, relative to the lengths involved, to change the result.

use super::candidates::{Differences, Feet, Foot, Vectors, dot as dot_at_corners, everywhere, point};
use super::{
    Point, Triangle, add_scaled, cross, dot, largest_of, negated, reciprocal_exponent, triangles_intersect,
};
use crate::isa::Isa;
use crate::isa::corners::{Corners, Three};
use crate::isa::scalar::Scalar;
use crate::numerics::UNIT_ROUNDOFF;

/// How far two triangles are apart, and where; lengths in mesh units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closest {
    /// The distance between the closest points found; 0 if and only if the triangles intersect.
    pub(crate) distance: f64,
    /// A certified lower bound of the exact distance, at most `distance`; 0 if no positive bound is proven.
    pub(crate) lower: f64,
    /// A certified upper bound of the exact distance, at least `distance`.
    pub(crate) upper: f64,
    /// A point of the first triangle, up to the rounding of its coordinates.
    pub(crate) point_a: Point,
    /// A point of the second triangle, up to the rounding of its coordinates; `point_a` if they intersect.
    pub(crate) point_b: Point,
}

impl Closest {
    /// Of two triangles that meet in a point.
    pub(crate) fn meeting(point: Point) -> Self {
        Self { distance: 0.0, lower: 0.0, upper: 0.0, point_a: point, point_b: point }
    }
}

/// Returns the distance between two closed triangles, with bounds and a pair of closest points.
///
/// `distance` is 0 if and only if [`triangles_intersect`] returns true, and then both witness points are the same.
/// Otherwise it is positive. Its error is a few roundings (2^-53 each) of the size of the triangles and the gap, and
/// the exact value is in `lower..=upper`. For a gap near 2^-53 of the size, the bounds may not exclude zero; the
/// distance is still positive then, but may be as small as the smallest normal number. A triangle without area is
/// the segment or point that its corners span. The cost is constant.
///
/// The result has the same bits on every target: no operation is fused, and no operation combines lanes.
#[must_use]
pub(crate) fn triangle_distance(a: &Triangle, b: &Triangle) -> Closest {
    triangle_distance_with(Scalar, a, b)
}

/// Does what [`triangle_distance`] does with the registers of a backend.
#[inline(always)]
pub(crate) fn triangle_distance_with<I: Isa>(isa: I, a: &Triangle, b: &Triangle) -> Closest {
    let differences = Differences::new(isa, a, b);
    if differences.size == 0.0 {
        return Closest { distance: 0.0, lower: 0.0, upper: 0.0, point_a: a[0], point_b: b[0] };
    }
    let link = Link::new(&differences, differences.closest(isa));
    let lower = certified_gap(isa, link.direction(), &differences.gaps);
    if lower == 0.0 && triangles_intersect(a, b) {
        return Closest::meeting(common_point(a, b, link.squared, link.at_a.place(a, differences.unit)));
    }
    let (distance, upper) = link.length();
    // If two pairs of features are about equally near, the chosen direction may be far from that of the gap.
    let lower = if distance - lower > MAX_ERROR_ASYMMETRY * (upper - distance) {
        widest(a, b, link.between()).max(lower)
    } else {
        lower
    };
    let unit = differences.unit;
    // The triangles do not meet, so the distance must not round to zero.
    let distance = (distance * unit).max(f64::MIN_POSITIVE);
    let lower = lower * unit;
    Closest {
        distance,
        // Multiplying by a power of two is exact down to the smallest normal number.
        lower: if lower < f64::MIN_POSITIVE { 0.0 } else { lower.min(distance) },
        upper: (upper * unit).max(distance),
        point_a: link.at_a.place(a, unit),
        point_b: link.at_b.place(b, unit),
    }
}

/// The largest accepted ratio of `distance - lower` to `upper - distance`; beyond it a better lower bound is sought.
pub(super) const MAX_ERROR_ASYMMETRY: f64 = 8.0;

/// A foot, and the edges at its corner.
pub(super) struct Placed {
    pub(super) foot: Foot,
    /// From the corner to the next one.
    pub(super) next: Point,
    /// To the corner from the one before.
    previous: Point,
}

impl Placed {
    #[inline(always)]
    pub(super) fn new<C: Corners>(foot: Foot, edges: &Vectors<C>) -> Self {
        let corner = foot.corner;
        Self { foot, next: point(edges, corner), previous: point(edges, (corner + 2) % 3) }
    }

    /// Returns the two terms that are added to the corner.
    #[inline(always)]
    pub(super) fn offsets(&self) -> [Point; 2] {
        [times(self.foot.along, self.next), times(-self.foot.across, self.previous)]
    }

    /// Returns the point in mesh units, given edges in multiples of `unit`.
    #[inline(always)]
    pub(super) fn place(&self, triangle: &Triangle, unit: f64) -> Point {
        let ([along, across], corner) = (self.offsets(), triangle[self.foot.corner]);
        [0, 1, 2].map(|k| corner[k] + (along[k] + across[k]) * unit)
    }

    /// Returns a normal of the face.
    #[inline(always)]
    pub(super) fn normal(&self) -> Point {
        perpendicular_normal(self.next, self.previous)
    }
}

/// The closest feet, and the way from one to the other.
struct Link {
    squared: f64,
    at_a: Placed,
    at_b: Placed,
    /// From the corner of A to that of B.
    gap: Point,
}

impl Link {
    #[inline(always)]
    fn new<C: Corners>(differences: &Differences<C>, feet: Feet) -> Self {
        let Feet { squared, foot_a, foot_b } = feet;
        let gap = point(&differences.gaps[foot_a.corner], foot_b.corner);
        let at_a = Placed::new(foot_a, &differences.edges_a);
        Self { squared, at_a, at_b: Placed::new(foot_b, &differences.edges_b), gap }
    }

    /// Returns the direction in which the triangles are most likely separated: the one between the closest points.
    ///
    /// For a face or two edges it returns the normal instead, which stays accurate however small the gap is.
    #[inline(always)]
    fn direction(&self) -> Point {
        let (a, b) = (&self.at_a, &self.at_b);
        if a.foot.across != 0.0 {
            a.normal()
        } else if b.foot.across != 0.0 {
            b.normal()
        } else if a.foot.along != 0.0 && b.foot.along != 0.0 {
            perpendicular_normal(a.next, b.next)
        } else {
            // Of a small gap little but noise may be left, so it is made perpendicular to the edge once more.
            let gap = self.between();
            let edge = if a.foot.along != 0.0 { a.next } else { b.next };
            if a.foot.along != 0.0 || b.foot.along != 0.0 { perpendicular_part(edge, gap) } else { gap }
        }
    }

    /// The vectors whose sum leads from the first foot to the second.
    #[inline(always)]
    fn terms(&self) -> [Point; 5] {
        let ([along_a, across_a], [along_b, across_b]) = (self.at_a.offsets(), self.at_b.offsets());
        [self.gap, negated(along_a), negated(across_a), along_b, across_b]
    }

    /// The vector from the first foot to the second.
    #[inline(always)]
    fn between(&self) -> Point {
        self.terms().into_iter().fold([0.0; 3], |sum, term| add_scaled(sum, 1.0, term))
    }

    /// The distance of the feet, and a certified upper bound of the triangles' exact distance, both scaled.
    ///
    /// The exact points with the weights of the feet are in the triangles, so their exact distance is an
    /// upper bound. In each coordinate the sum differs from theirs by at most one rounding of the gap, two of
    /// each other term (edge and product) and one for each of the two additions of terms that aren't zero:
    /// less than five roundings of the sum of magnitudes. Square, sum and root add less than four, relative.
    #[inline(always)]
    fn length(&self) -> (f64, f64) {
        let sum = self.between();
        let magnitude: f64 = self.terms().iter().flatten().map(|x| x.abs()).sum();
        let length = dot(sum, sum).sqrt();
        (length, length * (1.0 + 8.0 * UNIT_ROUNDOFF) + 8.0 * UNIT_ROUNDOFF * magnitude)
    }
}

/// A certified lower bound of the distance, scaled, given the gaps between all corners: the width of the slab across
/// `direction` between the triangles, on either side, or 0.
///
/// Any direction gives a bound, so an error of the direction does no harm. The error of a computed product
/// `direction · gap` is at most four roundings (one of the gap, one of the product, two of the additions),
/// relative to the sum of the magnitudes of its three terms. Subtracting the bound from it rounds once more.
/// Eight roundings also cover the rounding of the bound itself. The largest coordinate of `direction` is
/// scaled to [1, 2). So all underflow together is less than the smallest normal number, and the relative
/// error of the norm, the division and the last product is less than eight roundings.
#[inline(always)]
pub(super) fn certified_gap<I: Isa>(isa: I, direction: Point, gaps: &[Vectors<I::F64x3>]) -> f64 {
    let size = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
    // An edge without length leaves no direction.
    if size == 0.0 || !direction.iter().all(|x| x.is_finite()) {
        return 0.0;
    }
    let direction = times(reciprocal_exponent(size), direction);
    let (along, magnitude) = (everywhere(isa, direction), everywhere(isa, direction.map(f64::abs)));
    let rounding = isa.corners([8.0 * UNIT_ROUNDOFF; 3]);
    let mut ahead = isa.corners([f64::INFINITY; 3]);
    // The negative of what is behind.
    let mut beyond = isa.corners([f64::NEG_INFINITY; 3]);
    for gap in gaps {
        let height = dot_at_corners(along, *gap);
        let error = rounding.mul(dot_at_corners(magnitude, [gap[0].abs(), gap[1].abs(), gap[2].abs()]));
        ahead = ahead.min(height.sub(error));
        beyond = beyond.max(height.add(error));
    }
    let [x, y, z] = ahead.all();
    let width = x.min(y).min(z).max(-beyond.largest()) - f64::MIN_POSITIVE;
    if width > 0.0 { width / dot(direction, direction).sqrt() * (1.0 - 8.0 * UNIT_ROUNDOFF) } else { 0.0 }
}

/// Returns the best lower bound of eighteen directions: both normals, all cross products of an edge of each
/// triangle, the gap, and the gap's component perpendicular to each edge.
#[cold]
#[inline(never)]
fn widest(a: &Triangle, b: &Triangle, gap: Point) -> f64 {
    let differences = Differences::new(Scalar, a, b);
    let [a, b] = [differences.edges_a, differences.edges_b].map(|edges| [0, 1, 2].map(|i| point(&edges, i)));
    let mut widest: f64 = 0.0;
    let mut look_along = |direction| widest = certified_gap(Scalar, direction, &differences.gaps).max(widest);
    look_along(gap);
    look_along(perpendicular_normal(a[0], a[2]));
    look_along(perpendicular_normal(b[0], b[2]));
    for edge_a in a {
        b.iter().for_each(|&edge_b| look_along(perpendicular_normal(edge_a, edge_b)));
    }
    a.iter().chain(&b).for_each(|&edge| look_along(perpendicular_part(edge, gap)));
    widest
}

/// Returns a point that two intersecting triangles have in common, as accurately as f64 allows.
///
/// Where the triangles touch or overlap in a plane, the closest feet are such a point. Where an edge pierces a face,
/// the closest feet are apart, and the crossing is computed. The result is the point closest to the other triangle.
#[cold]
#[inline(never)]
fn common_point(a: &Triangle, b: &Triangle, squared: f64, closest: Point) -> Point {
    let (mut best, mut point) = (squared, closest);
    for (a, b) in [(a, b), (b, a)] {
        let differences = Differences::new(Scalar, a, b);
        if let Some((squared, foot)) = differences.crossing()
            && squared < best
        {
            best = squared;
            point = Placed::new(foot, &differences.edges_a).place(a, differences.unit);
        }
    }
    point
}

impl Differences<Three> {
    /// Returns the point, among those where the edges of `a` pass through the plane of `b`, that is closest to `b`,
    /// with its squared distance.
    ///
    /// The plane of a sliver is accurate only near the sliver. So each crossing starts at the plane and is improved by
    /// Newton's method: each step measures the remaining height from the closest point of `b`. The height shrinks by
    /// about seven digits per step, even where rounding tilts the plane that much.
    fn crossing(&self) -> Option<(f64, Foot)> {
        /// The number of Newton steps per edge.
        const STEPS: usize = 3;
        /// The squared distance at which the search ends, in squared multiples of `unit`: four roundings of the size,
        /// which is at least 1, so no step improves on it.
        const ENOUGH: f64 = (4.0 * UNIT_ROUNDOFF) * (4.0 * UNIT_ROUNDOFF);
        let [edges_a, edges_b] =
            [&self.edges_a, &self.edges_b].map(|edges| [0, 1, 2].map(|i| point(edges, i)));
        let base = longest(&edges_b);
        let normal = perpendicular_normal(edges_b[base], edges_b[(base + 2) % 3]);
        let heights = [0, 1, 2].map(|i| -dot(normal, point(&self.gaps[i], base)));
        let mut best: Option<(f64, Foot)> = None;
        for i in 0..3 {
            let (p, q) = (heights[i], heights[(i + 1) % 3]);
            if !((p < 0.0 && q > 0.0) || (p > 0.0 && q < 0.0)) {
                continue;
            }
            let mut along = p / (p - q);
            for _ in 0..STEPS {
                let from_foot = self.with_point_as_a(
                    [0, 1, 2].map(|j| add_scaled(point(&self.gaps[i], j), -along, edges_a[i])),
                );
                let link = Link::new(&from_foot, from_foot.closest(Scalar));
                if best.is_none_or(|(least, _)| link.squared < least) {
                    best = Some((link.squared, Foot::edge(i, along)));
                    if link.squared <= ENOUGH {
                        return best;
                    }
                }
                along = (along + dot(normal, link.between()) / (q - p)).clamp(0.0, 1.0);
            }
        }
        best
    }
}

/// Returns the index of the longest edge, which is projected out first.
pub(super) fn longest(edges: &Triangle) -> usize {
    largest_of(edges.map(|edge| dot(edge, edge)))
}

/// Returns a normal of `d` and `e`, where `d` is not too short to be squared. The normal is perpendicular to `d` up to
/// one rounding, however small the angle between `d` and `e`.
pub(super) fn perpendicular_normal(d: Point, e: Point) -> Point {
    cross(d, perpendicular_part(d, e))
}

/// Returns `e` without its component along `d`, where `d` is not too short to be squared.
#[inline(always)]
pub(super) fn perpendicular_part(d: Point, e: Point) -> Point {
    add_scaled(e, -dot(d, e) / dot(d, d), d)
}

#[inline(always)]
pub(super) fn times(factor: f64, p: Point) -> Point {
    [factor * p[0], factor * p[1], factor * p[2]]
}
