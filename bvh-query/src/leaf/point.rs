//! Bounds on the distances of four points from the four triangles of a packet.
//!
//! As for pairs of triangles ([`crate::leaf::distance`]), the closest point is guessed in plain f32, and the guess is
//! certified by projections on the line from it: a point is a triangle whose corners are the same.
//!
//! Error: the frame is that of [`crate::leaf::local`], around the packet's first corner. A coordinate of a point is rounded
//! twice, and to f64 before. So with m_a and m_p bounds on the magnitudes of the packet's and the point's, each coordinate is
//! within u (2 m_a + 5 m_p) + e_pose, as there.

use crate::isa::{Isa, Lanes};
use crate::leaf::distance::{Bounds, Guess, certify, inverse_squares, points_on_face};
use crate::leaf::local::{LocalFrame, U, repeat, tile};
use crate::leaf::math::{Vec3, along, dot, edges, sub};
use crate::leaf::placed_packet::{PlacedPacket, larger};
use crate::traverse::probe_walk::PROBES;

/// Points around the first corner of a packet, in units of the local frame.
pub(crate) struct LocalPoints {
    /// `[axis][point]`
    coordinates: [[f32; PROBES]; 3],
    /// The error of a bound of the distance of each point.
    slack: [f32; PROBES],
}

impl LocalPoints {
    /// `points` are around the object's origin, in mesh units.
    #[inline(always)]
    pub(crate) fn new(frame: &LocalFrame, packet: &PlacedPacket, points: &[[f64; 3]; PROBES]) -> Self {
        let mut local = Self { coordinates: [[0.0; PROBES]; 3], slack: [0.0; PROBES] };
        for (number, point) in points.iter().enumerate() {
            let mut magnitude = 0.0;
            for axis in 0..3 {
                let from = (point[axis] - packet.origin[axis]) * f64::from(frame.scale);
                local.coordinates[axis][number] = from as f32;
                magnitude = larger(magnitude, (from as f32).abs());
            }
            let error = U * (2.0 * packet.magnitude + 5.0 * magnitude) + frame.error;
            local.slack[number] = 4.0 * error + 16.0 * U * (packet.magnitude + magnitude);
        }
        local
    }
}

/// Bounds the distances in units of the local frame: element `4 * triangle + point`.
#[inline(always)]
pub(crate) fn point_bounds<I: Isa>(isa: I, packet: &PlacedPacket, points: &LocalPoints) -> Bounds {
    let a =
        [repeat(isa, &packet.corners[0]), repeat(isa, &packet.corners[1]), repeat(isa, &packet.corners[2])];
    let p = tile(isa, &points.coordinates);
    let (zero, one) = (isa.splat(0.0), isa.splat(1.0));
    let mut guess = Guess::none(isa);
    let edges = edges(&a);
    let inverse = inverse_squares(one, edges);
    for i in 0..3 {
        let v = sub(p, a[i]);
        // NaN, from an edge of no length, ends as 0: `max` returns its second operand.
        let share = dot(v, edges[i]).mul(inverse[i]).max(zero).min(one);
        let foot: Vec3<I::V> = along([zero; 3], share, edges[i]);
        guess.improve(sub(v, foot));
    }
    points_on_face(isa, &a, &edges, &[p], &mut guess, false);
    certify(isa, isa.tile(&points.slack), &a, &[p; 3], guess)
}
