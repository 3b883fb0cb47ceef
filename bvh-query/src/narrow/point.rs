//! Measures the distance of a point from a closed triangle, to the bits of [`super::triangle_distance`] for a triangle whose corners
//! are all that point.
//!
//! Of the 42 candidates there, those of edges and faces without length drop out. Of three equal ones the first stays.
//! This leaves 3 corners, 3 edges and the face. Each is computed by the same operations in the same order, and so are
//! the bounds. The general routine is only needed for the search for a better lower bound, which is rare.

use super::candidates::Foot;
use super::distance::{
    Closest, MAX_ERROR_ASYMMETRY, Placed, certified_gap, longest, negated, perpendicular_part,
    reciprocal_exponent, times,
};
use super::intersect::triangle_contains;
use super::{Point, Triangle, UNIT_ROUNDOFF, add_scaled, dot, subtract, triangle_distance};
use crate::isa::Isa;
use crate::isa::scalar::Scalar;

/// Returns the distance of a point from a closed triangle, with bounds and the closest point.
///
/// The result is that of `triangle_distance(triangle, &[point; 3])`, bit for bit.
#[must_use]
#[inline(always)]
pub(crate) fn point_distance(triangle: &Triangle, point: Point) -> Closest {
    let gaps = [subtract(point, triangle[0]), subtract(point, triangle[1]), subtract(point, triangle[2])];
    let edges = [
        subtract(triangle[1], triangle[0]),
        subtract(triangle[2], triangle[1]),
        subtract(triangle[0], triangle[2]),
    ];
    let size = largest(&gaps).max(largest(&edges));
    if size == 0.0 {
        return Closest::meeting(triangle[0]);
    }
    let scale = reciprocal_exponent(size);
    let unit = 1.0 / scale;
    let gaps = [times(scale, gaps[0]), times(scale, gaps[1]), times(scale, gaps[2])];
    let edges = [times(scale, edges[0]), times(scale, edges[1]), times(scale, edges[2])];
    let foot = closest_foot(&gaps, &edges);
    let by_axis = |t: &Triangle| [0, 1, 2].map(|axis| Scalar.corners([t[0][axis], t[1][axis], t[2][axis]]));
    let placed = Placed::new(foot, &by_axis(&edges));
    let [along, across] = placed.offsets().map(negated);
    let gap = gaps[foot.corner];
    let between = add_scaled(add_scaled(gap, 1.0, along), 1.0, across);
    let direction = if foot.across != 0.0 {
        placed.normal()
    } else if foot.along != 0.0 {
        perpendicular_part(edges[foot.corner], between)
    } else {
        between
    };
    let lower = certified_gap(Scalar, direction, &[by_axis(&gaps)]);
    if lower == 0.0 && triangle_contains(triangle, point) {
        return Closest::meeting(placed.place(triangle, unit));
    }
    let magnitude: f64 = [gap, along, across].iter().flatten().map(|x| x.abs()).sum();
    let length = dot(between, between).sqrt();
    let upper = length * (1.0 + 8.0 * UNIT_ROUNDOFF) + 8.0 * UNIT_ROUNDOFF * magnitude;
    if length - lower > MAX_ERROR_ASYMMETRY * (upper - length) {
        return triangle_distance(triangle, &[point; 3]);
    }
    let distance = (length * unit).max(f64::MIN_POSITIVE);
    let lower = lower * unit;
    Closest {
        distance,
        lower: if lower < f64::MIN_POSITIVE { 0.0 } else { lower.min(distance) },
        upper: (upper * unit).max(distance),
        point_a: placed.place(triangle, unit),
        point_b: point,
    }
}

#[inline(always)]
fn largest(vectors: &Triangle) -> f64 {
    vectors.as_flattened().iter().fold(0.0, |size: f64, x| size.max(x.abs()))
}

/// Returns the closest point of the triangle, given what leads to the point from each corner. Ties go to the first of the
/// corners, then of the edges, then to the face.
#[inline(always)]
fn closest_foot(gaps: &Triangle, edges: &Triangle) -> Foot {
    let (mut inverse, mut along, mut perpendicular) = ([0.0; 3], [0.0; 3], [[0.0; 3]; 3]);
    let (mut corners, mut sides) = ([0.0; 3], [0.0; 3]);
    for i in 0..3 {
        let (gap, edge) = (gaps[i], edges[i]);
        let squared = dot(edge, edge);
        inverse[i] = if squared >= f64::MIN_POSITIVE { 1.0 / squared } else { 0.0 };
        along[i] = dot(gap, edge) * inverse[i];
        perpendicular[i] = add_scaled(gap, -along[i], edge);
        let inside = (along[i] > 0.0) & (along[i] < 1.0);
        corners[i] = dot(gap, gap);
        sides[i] = if inside { dot(perpendicular[i], perpendicular[i]) } else { f64::INFINITY };
    }
    let (mut least, mut foot) = (corners[0], Foot::corner(0));
    for i in 1..3 {
        if corners[i] < least {
            (least, foot) = (corners[i], Foot::corner(i));
        }
    }
    for i in 0..3 {
        if sides[i] < least {
            (least, foot) = (sides[i], Foot::edge(i, along[i]));
        }
    }
    // The longest edge is projected out first, as in `Differences::face`.
    let base = longest(edges);
    let (edge, apex) = (edges[base], negated(edges[(base + 2) % 3]));
    let slope = dot(apex, edge) * inverse[base];
    let height = add_scaled(apex, -slope, edge);
    let whole = dot(height, height);
    if whole < f64::MIN_POSITIVE {
        return foot;
    }
    let across = dot(perpendicular[base], height) * (1.0 / whole);
    let along = along[base] - across * slope;
    if (across > 0.0) & (along > 0.0) & (across + along < 1.0) {
        let shortest = add_scaled(perpendicular[base], -across, height);
        if dot(shortest, shortest) < least {
            return Foot { corner: base, along, across };
        }
    }
    foot
}
