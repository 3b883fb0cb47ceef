//! Where the boundaries of two triangles pass through each other, with B moved by less than any number.
//!
//! Triangles that only touch have no place in the boundary of what two solids have in common, and those in one plane have too many.
//! Therefore B is treated as if it were moved by (-ε³, -ε, -ε²), for an ε smaller than any other number in question (H. Edelsbrunner,
//! E. P. Mücke, "Simulation of Simplicity", ACM Transactions on Graphics 9(1), 1990). The moved triangles do not touch: either they
//! have nothing in common, or a segment whose two ends are each inside one triangle and on an edge of the other.
//!
//! A sign that is 0 becomes that of its derivative along y or, where that is 0 as well, along z, else x. All signs are exact under the
//! precondition of [`narrow`](super). [`super::winding`] moves points in the same way.

use super::contact_region::meeting_of_plane;
use super::integers::{cross as cross_exactly, exponent, integer, minus};
use super::intersection::{area, heights, volume};
use super::{Point, Triangle, cross, subtract};
use crate::numerics::UNIT_ROUNDOFF;
use num_bigint::Sign;

/// The axes from that of the largest move to that of the least.
pub(super) const ORDER: [usize; 3] = [1, 2, 0];

/// A point where an edge of one triangle passes through the other one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeCrossing {
    /// Whether the edge is one of A's.
    pub(crate) is_of_a: bool,
    /// The edge from this corner to the next.
    pub(crate) edge: usize,
    /// Whether it leads from the front of the other triangle to its back.
    pub(crate) enters: bool,
    pub(crate) point: Point,
    /// No coordinate is farther than this from the exact one.
    pub(crate) error: f64,
}

/// Returns the start and the end of the segment that two triangles have in common; nothing if the moved triangles have nothing in
/// common. The segment has the direction of the cross product of A's normal and B's. Where an edge of a triangle without area passes
/// through the other triangle, another edge of it does so in the same place: start and end are one point.
pub(crate) fn edge_crossings(a: &Triangle, b: &Triangle) -> Option<[EdgeCrossing; 2]> {
    let (fronts_a, fronts_b) = (fronts(b, a, 1.0), fronts(a, b, -1.0));
    let is_apart = |fronts: Option<[bool; 3]>| fronts == Some([true; 3]) || fronts == Some([false; 3]);
    if is_apart(fronts_a) || is_apart(fronts_b) {
        return None;
    }
    let next = |corner: usize| (corner + 1) % 3;
    let passes = |i: usize, j: usize| passes(a[i], a[next(i)], b[j], b[next(j)]);
    let (mut start, mut end) = (None, None);
    for edge in 0..3 {
        for (is_of_a, fronts, corners, plane) in [(true, fronts_a, a, b), (false, fronts_b, b, a)] {
            // No edge passes through a triangle without area, but its own edges pass through the other one.
            let Some(fronts) = fronts.filter(|fronts| fronts[edge] != fronts[next(edge)]) else { continue };
            let enters = fronts[edge];
            let sides =
                [0, 1, 2].map(|other| if is_of_a { passes(edge, other) } else { passes(other, edge) });
            if sides[0] != sides[1] || sides[1] != sides[2] {
                continue;
            }
            let met = meeting_of_plane([corners[edge], corners[next(edge)]], plane);
            // The part of A inside B is on the left of the segment and on the left of A's edges.
            let of_end = if enters == is_of_a { &mut end } else { &mut start };
            *of_end = Some(EdgeCrossing { is_of_a, edge, enters, point: met.point, error: met.error });
        }
    }
    Some([start?, end?])
}

/// Returns whether points are in front of a triangle that moves against them by a sign; nothing if it has no area.
fn fronts(plane: &Triangle, points: &Triangle, sign: f64) -> Option<[bool; 3]> {
    let heights = heights(plane, points);
    let beside = if heights.contains(&0.0) { sign * moved_height(plane)? } else { 0.0 };
    Some(heights.map(|height| height > 0.0 || (height == 0.0 && beside > 0.0)))
}

/// Returns a number with the sign of the height that a point of a triangle gains over its plane when it moves along the first of the
/// ordered axes, by much less along the second, and by much less again along the third; nothing if the triangle has no area.
pub(super) fn moved_height([p, q, r]: &Triangle) -> Option<f64> {
    ORDER.into_iter().map(|axis| area(axis, *p, *q, *r)).find(|component| *component != 0.0)
}

/// Returns on which side an edge of A from p to q passes an edge of B from r to s.
fn passes(p: Point, q: Point, r: Point, s: Point) -> bool {
    let side = volume(p, q, r, s);
    // Parallel edges are in triangles that do not cross here.
    side > 0.0
        || (side == 0.0
            && ORDER.into_iter().map(|axis| turn(axis, [p, q], [r, s])).find(|turn| *turn != 0) == Some(1))
}

/// Returns the sign of a component of the cross product of two edges.
fn turn(axis: usize, a: [Point; 2], b: [Point; 2]) -> i8 {
    let (u, v) = (subtract(a[1], a[0]), subtract(b[1], b[0]));
    let component = cross(u, v)[axis];
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    // Two differences, two products and their difference are rounded.
    if component.abs() > 8.0 * UNIT_ROUNDOFF * ((u[i] * v[j]).abs() + (u[j] * v[i]).abs()) {
        return if component > 0.0 { 1 } else { -1 };
    }
    let numbers = a.iter().chain(&b).flatten();
    let unit = numbers.filter(|x| **x != 0.0).map(|x| exponent(*x)).min().unwrap_or(0);
    let exact = |edge: [Point; 2]| {
        let [from, to] = edge.map(|point| point.map(|x| integer(x, unit)));
        minus(&to, &from)
    };
    match cross_exactly(&exact(a), &exact(b))[axis].sign() {
        Sign::Plus => 1,
        Sign::NoSign => 0,
        Sign::Minus => -1,
    }
}
