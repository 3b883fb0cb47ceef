//! Bounds on the distances of a point from the triangles of up to four packets.
//!
//! As for pairs of triangles ([`crate::leaf::pair_bounds`]), the closest point is guessed in plain f32, and the guess is
//! certified by projections on the line from it: a point is a triangle whose corners are the same.
//!
//! The point is the origin, and the unit is a power of two that makes the farthest corner of the mesh about 1 away. Each
//! coordinate of the point is a sum of two f32, high and low, so that packets are read as they are stored.
//!
//! Error: let m bound the coordinates of a triangle as the point sees it. The difference from the high part is rounded to
//! within u (m + |low|), the sum with the low part to within u m; both by less than 2^-140 more where they underflow. The low
//! part is off by u |low| <= u^2 |p|. So each coordinate is within e = 2u m + 3u^2 |p| + 2^-140 + that of p in f64, which is
//! at most `error`, and so is 3u^2 |p| / 4. Bounds are within 4e, as in [`crate::leaf::pair_bounds`]. Combinations of corners
//! round by at most 14u m, and by 4u m more where rounded weights leave the triangle: 32u m is charged.

use crate::isa::{Isa, Lanes};
use crate::leaf::math::{Corners, Vec3, along, dot, edges, largest_of, min3, project};
use crate::leaf::pair_bounds::{Bounds, Guess, certify, clamp, inverse_squares, points_on_face};
use crate::numerics::{COORDINATE_UNDERFLOW, U};
use bvh_format::leaf::Packet;

/// A point in two parts.
pub(crate) struct LocalPoint {
    /// In mesh units, around the object's origin.
    high: [f32; 3],
    /// What the high part lacks, in the unit of bounds; negative.
    minus_low: [f32; 3],
    scale: f32,
    /// A bound on the error of a coordinate that does not depend on the triangle, in the unit of bounds.
    pub(super) error: f32,
}

impl LocalPoint {
    /// `error` bounds that of the coordinates in f64, and is at least 2^-48 of their magnitudes. `scale` is the inverse of the
    /// unit, a power of two.
    #[inline(always)]
    pub(crate) fn new(point: &[f64; 3], error: f64, scale: f32) -> Self {
        let high = point.map(|x| x as f32);
        let minus_low = [0, 1, 2].map(|k| ((f64::from(high[k]) - point[k]) * f64::from(scale)) as f32);
        let error = ((5.0 * error * f64::from(scale)) as f32 + COORDINATE_UNDERFLOW) * (1.0 + 4.0 * U);
        Self { high, minus_low, scale, error }
    }

    /// Returns the triangles of four packets as the point sees them: lane `4 * packet + triangle`.
    #[inline(always)]
    pub(super) fn seen<I: Isa>(&self, isa: I, packets: [&Packet; 4]) -> Corners<I::F32x16> {
        let [a, b, c, d] = packets;
        let (zero, scale) = (isa.splat(0.0), isa.splat(self.scale));
        let mut corners = [[zero; 3]; 3];
        for axis in 0..3 {
            let (high, minus_low) = (isa.splat(self.high[axis]), isa.splat(self.minus_low[axis]));
            for corner in 0..3 {
                let from = isa.quads([
                    &a.corners[corner][axis],
                    &b.corners[corner][axis],
                    &c.corners[corner][axis],
                    &d.corners[corner][axis],
                ]);
                corners[corner][axis] = from.sub(high).mul_add(scale, minus_low);
            }
        }
        corners
    }
}

/// Bounds the distances from the triangles of four packets: element `4 * packet + triangle`.
#[inline(always)]
pub(crate) fn point_bounds<I: Isa>(isa: I, packets: [&Packet; 4], point: &LocalPoint) -> Bounds {
    let (zero, one) = (isa.splat(0.0), isa.splat(1.0));
    let corners = point.seen(isa, packets);
    let slack = largest_of(&corners).mul_add(isa.splat(40.0 * U), isa.splat(4.0 * point.error));
    let mut guess = Guess::none(isa);
    let edges = edges(&corners);
    let inverse = inverse_squares(one, edges);
    for i in 0..3 {
        let share = clamp(zero, one, zero.sub(dot(corners[i], edges[i])).mul(inverse[i]));
        let foot: Vec3<I::F32x16> = along(corners[i], share, edges[i]);
        guess.improve(foot);
    }
    points_on_face(isa, &corners, &edges, &[[zero; 3]], &mut guess, true);
    let gap = min3(project(&corners, guess.direction));
    certify(isa, slack, gap, guess)
}
