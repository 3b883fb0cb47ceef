//! Decides exactly whether two triangles of one mesh meet where they should not.
//!
//! Neighbours in a mesh share corners. They should meet in the hull of these corners, which is a point or an edge, and
//! nowhere else. So the rule is the same for all pairs: they are in contact if they share a point that is not in the hull
//! of their common corners. Two triangles with the same corners are duplicates. This is the meaning that
//! `self_intersections` has in CGAL's package Polygon Mesh Processing, and it extends to triangles without area.
//!
//! Two triangles with one common corner lie in cones with this apex. A ray from the apex through another common point
//! leaves the nearer triangle through the edge opposite to the apex. So they are in contact if the opposite edge of one
//! meets the other. In general position, the signs of the heights of the other corners tell that: seen from the apex, the
//! opposite edges are arcs on a sphere, and either they cross or one crosses the antipode of the other.

use super::intersection::{are_collinear, area, area_axis, heights, lexicographic};
use super::{Point, Triangle, segment_intersects, triangles_intersect};

/// How two triangles of one mesh meet, by the corners that they have in common. The command and the bindings of other
/// languages use its numbers: `kind as u8`.
///
/// [`Querier::self_contacts`](crate::Querier::self_contacts) has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum SelfContactKind {
    /// They have no corner in common, and touch or cross.
    Crossing = 0,
    /// They have one corner in common, and another point.
    AtCorner = 1,
    /// They have two corners in common and overlap beyond that edge: both lie in one plane, on the same side of the edge.
    Folded = 2,
    /// They have the same corners, in any order.
    Duplicate = 3,
}

impl SelfContactKind {
    /// All kinds in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Crossing, Self::AtCorner, Self::Folded, Self::Duplicate];

    /// Returns the name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Crossing => "crossing",
            Self::AtCorner => "at_corner",
            Self::Folded => "folded",
            Self::Duplicate => "duplicate",
        }
    }
}

/// The bits of all three corners.
const ALL: u8 = 0b111;

/// Returns how two triangles of one mesh meet where they should not, or `None` if they do not.
///
/// Corners are the same if their coordinates are equal. The answer is exact under the precondition of
/// [`narrow`](super), and depends neither on the order of the triangles nor on that of their corners. Cost: nine
/// comparisons of corners, and for neighbours in general position one to four orientations.
#[must_use]
pub(crate) fn self_contact(a: &Triangle, b: &Triangle) -> Option<SelfContactKind> {
    match common_corners(a, b) {
        [0, _] => triangles_intersect(a, b).then_some(SelfContactKind::Crossing),
        [ALL, ALL] => Some(SelfContactKind::Duplicate),
        // One of them has no area, and is the hull of its common corners.
        [ALL, _] | [_, ALL] => None,
        [of_a, of_b] => match (edge_first(a, of_a), edge_first(b, of_b)) {
            (Some([p, q, r]), Some([_, _, s])) => are_folded(p, q, r, s).then_some(SelfContactKind::Folded),
            _ => meet_beyond_corner(&corner_first(a, of_a), &corner_first(b, of_b))
                .then_some(SelfContactKind::AtCorner),
        },
    }
}

/// Returns a bit for each corner of A that B has too, and for each of B that A has.
#[inline(always)]
fn common_corners(a: &Triangle, b: &Triangle) -> [u8; 2] {
    let mut common = [0; 2];
    for (i, p) in a.iter().enumerate() {
        for (j, q) in b.iter().enumerate() {
            let equal = u8::from(p == q);
            common[0] |= equal << i;
            common[1] |= equal << j;
        }
    }
    common
}

/// Returns two different common corners and the third corner. If one triangle has two, the other one has the same two,
/// because neither has three.
#[inline(always)]
fn edge_first(triangle: &Triangle, common: u8) -> Option<Triangle> {
    let third = match common {
        0b110 => 0,
        0b101 => 1,
        0b011 => 2,
        _ => return None,
    };
    let [p, q] = [triangle[(third + 1) % 3], triangle[(third + 2) % 3]];
    (p != q).then_some([p, q, triangle[third]])
}

/// Returns the common corner and the two others. A triangle that has the common corner twice has only one other.
#[inline(always)]
fn corner_first(triangle: &Triangle, common: u8) -> Triangle {
    let first = common.trailing_zeros() as usize % 3;
    let others = [(first + 1) % 3, (first + 2) % 3].map(|corner| (corner, common >> corner & 1 == 0));
    match others {
        [(x, true), (y, true)] => [triangle[first], triangle[x], triangle[y]],
        [(x, true), _] | [_, (x, _)] => [triangle[first], triangle[x], triangle[x]],
    }
}

/// Returns whether two triangles with the edge from `p` to `q` and other third corners overlap beyond that edge.
#[inline(always)]
fn are_folded(p: Point, q: Point, r: Point, s: Point) -> bool {
    heights(&[p, q, r], &[s]) == [0.0] && are_folded_in_plane(p, q, r, s)
}

/// Decides the case of four points in one plane.
#[cold]
fn are_folded_in_plane(p: Point, q: Point, r: Point, s: Point) -> bool {
    let sides = (0..3).map(|axis| (area(axis, p, q, r), area(axis, p, q, s)));
    match sides.into_iter().find(|sides| *sides != (0.0, 0.0)) {
        // If only one of them has area, it meets the line of the edge in the edge alone.
        Some((r, s)) => (r > 0.0 && s > 0.0) || (r < 0.0 && s < 0.0),
        // Both are segments on one line, on which the lexicographic order is the order of points.
        None => {
            let [low, high] = if lexicographic(p, q).is_lt() { [p, q] } else { [q, p] };
            let both = |is_beyond: &dyn Fn(Point) -> bool| is_beyond(r) && is_beyond(s);
            both(&|point| lexicographic(point, low).is_lt())
                || both(&|point| lexicographic(point, high).is_gt())
        }
    }
}

/// Returns whether two triangles whose first corner is their only common one have another point in common.
#[inline(always)]
fn meet_beyond_corner(a: &Triangle, b: &Triangle) -> bool {
    let sides_b = heights(a, &[b[1], b[2]]);
    if are_on_one_side(sides_b) {
        return false;
    }
    if sides_b == [0.0; 2] {
        return meet_beyond_corner_in_special_position(a, b, true);
    }
    let sides_a = heights(b, &[a[1], a[2]]);
    if are_on_one_side(sides_a) {
        return false;
    }
    if sides_a.iter().chain(&sides_b).all(|side| *side != 0.0) {
        return (sides_a[0] > 0.0) == (sides_b[1] > 0.0);
    }
    meet_beyond_corner_in_special_position(a, b, false)
}

#[inline(always)]
fn are_on_one_side(sides: [f64; 2]) -> bool {
    (sides[0] > 0.0 && sides[1] > 0.0) || (sides[0] < 0.0 && sides[1] < 0.0)
}

/// Decides the case that a corner of one triangle is in the plane of the other: if `is_in_plane`, all corners of B are in A's.
#[cold]
fn meet_beyond_corner_in_special_position(a: &Triangle, b: &Triangle, is_in_plane: bool) -> bool {
    let [[p, r, s], [_, t, u]] = [*a, *b];
    let (has_area_a, has_area_b) = (!are_collinear(p, r, s), !are_collinear(p, t, u));
    if is_in_plane && has_area_a && has_area_b {
        return sectors_meet(area_axis(a), p, [r, s], [t, u]);
    }
    // A triangle without area is one or two segments from the corner.
    let (segments_a, segments_b) = ([[p, r, r], [p, s, s]], [[p, t, t], [p, u, u]]);
    let parts_a = if has_area_a { std::slice::from_ref(a) } else { &segments_a };
    let parts_b = if has_area_b { std::slice::from_ref(b) } else { &segments_b };
    let meet =
        |a: &Triangle, b: &Triangle| segment_intersects(b, a[1], a[2]) || segment_intersects(a, b[1], b[2]);
    parts_a.iter().any(|a| parts_b.iter().any(|b| meet(a, b)))
}

/// Returns whether two sectors of a plane with one apex, each between two points and less than half a turn, have a ray in
/// common, in the projection along `axis`, which must map the plane one to one.
fn sectors_meet(axis: usize, apex: Point, a: [Point; 2], b: [Point; 2]) -> bool {
    let turn = |p: Point, q: Point| area(axis, apex, p, q);
    let contains = |[p, q]: [Point; 2], point: Point| {
        let [p, q] = if turn(p, q) > 0.0 { [p, q] } else { [q, p] };
        turn(p, point) >= 0.0 && turn(point, q) >= 0.0
    };
    // If they do, an end of one is in the other.
    a.iter().any(|point| contains(b, *point)) || b.iter().any(|point| contains(a, *point))
}
