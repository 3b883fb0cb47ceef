//! Decides exactly whether two triangles meet or are within a distance, and bounds how far apart they are.
//!
//! The other modules only filter: they pass each pair that a filter cannot decide to this one. No routine uses fused
//! multiply-add or any other operation that depends on the platform, even where it computes for three corners at a time in
//! the registers of a backend. So the answer is a function of the input numbers alone.
//!
//! # Precondition: the range in which nothing under- or overflows
//! Each coordinate is finite, at most 2^125 in magnitude and a multiple of 2^-296.
//!
//! `robust` computes signs of determinants with error-free transformations, which are exact as long as no
//! intermediate result underflows or overflows. A rounded difference of two multiples of 2^-296 is again a
//! multiple of 2^-296, and so is its rounding error. A product of up to three such numbers is a multiple of
//! 2^-888, and so is each partial product, rounding error and Dekker half. All of them lie on a grid coarser
//! than the smallest subnormal number, 2^-1074, so none is lost. The error bounds are at least 2^-110 times a
//! nonzero permanent, so they stay above 2^-998. At the upper end, a difference is at most 2^126 and a product
//! of three differences at most 2^378, and splitting multiplies by at most 2^27. Outside this range no routine
//! panics, but the answer is no longer proven.

mod candidates;
mod contact_region;
mod convex_solid;
mod edge_crossing;
mod integers;
mod intersection;
mod point_distance;
mod ray_crossing;
mod rounded_ray;
mod self_contact;
mod stretch;
mod triangle_distance;
mod winding;
mod within;

pub(crate) use contact_region::{MAX_POINTS, common_region, unit, unit_normal};
pub(crate) use convex_solid::{ConvexSolid, Enclosed, has_area};
pub(crate) use edge_crossing::{EdgeCrossing, edge_crossings};
pub(crate) use intersection::{segment_intersects, triangles_intersect};
pub(crate) use point_distance::point_distance;
pub(crate) use ray_crossing::{Crossing, Ray};
pub(crate) use rounded_ray::RoundedRay;
pub use self_contact::SelfContactKind;
pub(crate) use self_contact::self_contact;
pub(crate) use stretch::{Way, leaves_before, stretch};
pub(crate) use triangle_distance::{Closest, triangle_distance, triangle_distance_with};
pub(crate) use winding::{AxisRay, Passing};
pub(crate) use within::{triangles_below, triangles_within};

pub(crate) use bvh_format::vec3::{cross, dot, subtract};

#[cfg(test)]
mod tests;

/// A point in mesh units.
pub(crate) type Point = [f64; 3];

/// The closed triangle with three corners; three collinear corners make a segment, three equal ones a point.
pub(crate) type Triangle = [Point; 3];

/// Returns `p + factor * q`; each coordinate is rounded twice.
#[inline(always)]
fn add_scaled(p: Point, factor: f64, q: Point) -> Point {
    [p[0] + factor * q[0], p[1] + factor * q[1], p[2] + factor * q[2]]
}

#[inline(always)]
fn negated(p: Point) -> Point {
    [-p[0], -p[1], -p[2]]
}

/// Returns the index of the largest number; of equal ones, the first.
#[inline(always)]
pub(crate) fn largest_of([p, q, r]: [f64; 3]) -> usize {
    if p >= q && p >= r {
        0
    } else if q >= r {
        1
    } else {
        2
    }
}

/// Returns the power of two that scales a positive number into [1, 2); exact for normal numbers below 2^1023.
fn reciprocal_exponent(x: f64) -> f64 {
    let exponent = x.to_bits() >> 52 & 0x7ff;
    f64::from_bits(2046_u64.saturating_sub(exponent) << 52)
}
