//! Measures the distance of a point from a closed triangle, to the bits of [`super::triangle_distance`] for a triangle whose corners
//! are all that point.
//!
//! Of the 42 candidates there, those of edges and faces without length drop out. Of three equal ones the first stays.
//! This leaves 3 corners, 3 edges and the face. Each is computed by the same operations in the same order, and so are
//! the bounds. The general routine is only needed for the search for a better lower bound, which is rare.

use super::candidates::{self as vectors, Foot, Vectors, everywhere};
use super::intersection::triangle_contains;
use super::triangle_distance::{Closest, MAX_ERROR_ASYMMETRY, Placed, certified_gap, perpendicular_part};
use super::{Point, Triangle, add_scaled, dot, largest_of, negated, reciprocal_exponent, triangle_distance};
use crate::isa::Isa;
use crate::isa::corners::Corners;
use crate::numerics::UNIT_ROUNDOFF;

/// Returns the distance of a point from a closed triangle, with bounds and the closest point.
///
/// The result is that of `triangle_distance(triangle, &[point; 3])`, bit for bit.
#[must_use]
#[inline(always)]
pub(crate) fn point_distance<I: Isa>(isa: I, triangle: &Triangle, point: Point) -> Closest {
    let mut gaps = vectors::subtract(everywhere(isa, point), vectors::corners(isa, triangle, 0));
    let mut edges = vectors::edges(isa, triangle);
    let size = vectors::magnitude(gaps).max(vectors::magnitude(edges)).largest();
    if size == 0.0 {
        return Closest::meeting(triangle[0]);
    }
    let scale = reciprocal_exponent(size);
    let (unit, by) = (1.0 / scale, isa.corners([scale; 3]));
    for coordinate in gaps.iter_mut().chain(&mut edges) {
        *coordinate = coordinate.mul(by);
    }
    let foot = closest_foot(isa, &gaps, &edges);
    let placed = Placed::new(foot, &edges);
    let [along, across] = placed.offsets().map(negated);
    let gap = vectors::point(&gaps, foot.corner);
    let between = add_scaled(add_scaled(gap, 1.0, along), 1.0, across);
    let direction = if foot.across != 0.0 {
        placed.normal()
    } else if foot.along != 0.0 {
        perpendicular_part(placed.next, between)
    } else {
        between
    };
    let lower = certified_gap(isa, direction, &[gaps]);
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

/// Returns the closest point of the triangle, given what leads to the point from each corner. Ties go to the first of the
/// corners, then of the edges, then to the face.
#[inline(always)]
fn closest_foot<I: Isa>(isa: I, gaps: &Vectors<I::F64x3>, edges: &Vectors<I::F64x3>) -> Foot {
    let (none, one) = (isa.corners([0.0; 3]), isa.corners([1.0; 3]));
    let squares = vectors::dot(*edges, *edges);
    let is_short = squares.lt(isa.corners([f64::MIN_POSITIVE; 3]));
    let inverse = I::F64x3::select(is_short, none, one.div(squares));
    let along = vectors::dot(*gaps, *edges).mul(inverse);
    let perpendicular = vectors::less(*gaps, along, *edges);
    let inside = vectors::is_between(isa, along);
    let square = vectors::dot(perpendicular, perpendicular);
    let corners = vectors::dot(*gaps, *gaps).all();
    let sides = I::F64x3::select(inside, square, isa.corners([f64::INFINITY; 3])).all();
    let (mut least, mut foot) = (corners[0], Foot::corner(0));
    for i in 1..3 {
        if corners[i] < least {
            (least, foot) = (corners[i], Foot::corner(i));
        }
    }
    for i in 0..3 {
        if sides[i] < least {
            (least, foot) = (sides[i], Foot::edge(i, along.of(i)));
        }
    }
    // The longest edge is projected out first, as in `Differences::closest`.
    let base = largest_of(squares.all());
    let (edge, apex) = (vectors::point(edges, base), negated(vectors::point(edges, (base + 2) % 3)));
    let slope = dot(apex, edge) * inverse.of(base);
    let height = add_scaled(apex, -slope, edge);
    let whole = dot(height, height);
    if whole < f64::MIN_POSITIVE {
        return foot;
    }
    let to_point = vectors::point(&perpendicular, base);
    let across = dot(to_point, height) * (1.0 / whole);
    let along = along.of(base) - across * slope;
    if (across > 0.0) & (along > 0.0) & (across + along < 1.0) {
        let shortest = add_scaled(to_point, -across, height);
        if dot(shortest, shortest) < least {
            return Foot { corner: base, along, across };
        }
    }
    foot
}
