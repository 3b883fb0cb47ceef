//! Decides exactly whether two closed triangles are at most `d` apart, where certified bounds cannot.
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
use super::{Closest, Point, Triangle};
use num_bigint::BigInt;

/// Returns whether the exact distance between two triangles is at most `d`, which is not negative. `closest` is the
/// result of `triangle_distance` for them.
pub(crate) fn triangles_within(a: &Triangle, b: &Triangle, closest: &Closest, d: f64) -> bool {
    if closest.upper <= d {
        return true;
    }
    // Triangles that meet have an upper bound of 0.
    closest.lower <= d && any_feature_within(a, b, d)
}

#[cold]
#[inline(never)]
fn any_feature_within(a: &Triangle, b: &Triangle, d: f64) -> bool {
    let numbers = || a.as_flattened().iter().chain(b.as_flattened()).chain([&d]);
    let unit = numbers().filter(|x| **x != 0.0).map(|x| exponent(*x)).min().unwrap_or(0);
    let vector = |p: &Point| p.map(|x| integer(x, unit));
    let (a, b) = (a.each_ref().map(vector), b.each_ref().map(vector));
    let d = integer(d, unit);
    let limit = &d * &d;
    corners(&a, &b, &limit)
        || corners_and_edges(&a, &b, &limit)
        || corners_and_edges(&b, &a, &limit)
        || edges(&a, &b, &limit)
        || corners_and_face(&a, &b, &limit)
        || corners_and_face(&b, &a, &limit)
}

/// Returns whether a number is from 0 to `most`.
fn is_up_to(x: &BigInt, most: &BigInt) -> bool {
    *x >= BigInt::ZERO && x <= most
}

/// Returns the start and the vector of each edge.
fn edges_of(t: &[Vector; 3]) -> [(&Vector, Vector); 3] {
    [0, 1, 2].map(|i: usize| (&t[i], minus(&t[(i + 1) % 3], &t[i])))
}

fn corners(a: &[Vector; 3], b: &[Vector; 3], limit: &BigInt) -> bool {
    let pairs = a.iter().flat_map(|p| b.iter().map(move |q| minus(p, q)));
    pairs.into_iter().any(|gap| dot(&gap, &gap) <= *limit)
}

/// Returns whether a corner is within the limit of an edge, with its foot inside the edge.
///
/// The foot is at (v e) / (e e) along the edge, and the squared distance is |v|² - (v e)² / (e e). An edge without
/// length is skipped, because its corners are tested.
fn corners_and_edges(corners: &[Vector; 3], t: &[Vector; 3], limit: &BigInt) -> bool {
    edges_of(t).iter().any(|(start, edge)| {
        let squared = dot(edge, edge);
        corners.iter().any(|corner| {
            let v = minus(corner, start);
            let along = dot(&v, edge);
            squared != BigInt::ZERO
                && is_up_to(&along, &squared)
                && (dot(&v, &v) - limit) * &squared <= &along * &along
        })
    })
}

/// Returns whether two edges are within the limit of each other, with both feet inside them.
///
/// With n = e × f perpendicular to both edges and w from start to start, the feet are at (w × f) n / (n n) and
/// (w × e) n / (n n), and the squared distance is (w n)² / (n n). Parallel edges are skipped, because a corner of one
/// is as near to the other.
fn edges(a: &[Vector; 3], b: &[Vector; 3], limit: &BigInt) -> bool {
    let edges_b = edges_of(b);
    edges_of(a).iter().any(|(start_a, e)| {
        edges_b.iter().any(|(start_b, f)| {
            let normal = cross(e, f);
            let squared = dot(&normal, &normal);
            let w = minus(start_b, start_a);
            let height = dot(&w, &normal);
            squared != BigInt::ZERO
                && is_up_to(&dot(&cross(&w, f), &normal), &squared)
                && is_up_to(&dot(&cross(&w, e), &normal), &squared)
                && &height * &height <= limit * &squared
        })
    })
}

/// Returns whether a corner is within the limit of a face, with its foot inside the face.
///
/// With the normal n = e × f of the face, the foot of a corner at v has the weights (v × f) n / (n n) on e and
/// (e × v) n / (n n) on f, and the squared distance is (v n)² / (n n). A face without area is skipped, because its
/// edges are tested.
fn corners_and_face(corners: &[Vector; 3], t: &[Vector; 3], limit: &BigInt) -> bool {
    let (e, f) = (minus(&t[1], &t[0]), minus(&t[2], &t[0]));
    let normal = cross(&e, &f);
    let squared = dot(&normal, &normal);
    squared != BigInt::ZERO
        && corners.iter().any(|corner| {
            let v = minus(corner, &t[0]);
            let (along_e, along_f) = (dot(&cross(&v, &f), &normal), dot(&cross(&e, &v), &normal));
            let height = dot(&v, &normal);
            is_up_to(&along_e, &squared)
                && is_up_to(&along_f, &squared)
                && &along_e + &along_f <= squared
                && &height * &height <= limit * &squared
        })
}
