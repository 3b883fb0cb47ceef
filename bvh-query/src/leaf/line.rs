//! Which of the four triangles of a packet four lines may cross.
//!
//! A line with direction w passes an edge from a to b on the side that the sign of w · ((a - r) × (b - r)) tells, where r is a
//! point of the line: see [`crate::narrow::Ray`]. Two opposite signs that are certain show that it misses the triangle.
//!
//! Error: the frame is that of [`crate::leaf::local`], around the packet's first corner, and r is the point of the line that is
//! nearest to it, found in f64. With m the sum of bounds on the magnitudes of corners and of r, and u = 2^-24, a coordinate of
//! a - r is off by at most d = 4u m + e, with e the error in f64. A component of the cross product is then off by
//! 4 m d + 2 d^2 + 4u m^2, and of w by u, as no component of w is beyond 1. The three products and their sums add
//! 24u m^2. Together that is at most 12 m d + 6 d^2 + 36u m^2, and less than m (18 d + 48u m) wherever d is below m.

use crate::isa::{Isa, Lanes};
use crate::leaf::local::{LocalFrame, U, repeat, tile};
use crate::leaf::math::{cross, dot, sub};
use crate::leaf::placed_packet::{PlacedPacket, larger};
use crate::traverse::line_test::Segment;
use crate::traverse::probe_walk::PROBES;

/// More than what the underflow of some 30 products adds to a sign, by 2^-150 each.
const UNDERFLOW: f32 = f32::MIN_POSITIVE;

/// The directions of lines, and of each the point nearest to a packet.
pub(crate) struct LocalLines {
    /// `[axis][line]`
    points: [[f32; PROBES]; 3],
    /// The least product that has a certain sign.
    certain: [f32; PROBES],
}

/// The directions of lines, `[axis][line]`, with no component beyond 1.
pub(crate) type Directions = [[f32; PROBES]; 3];

/// Returns the directions of segments. A point has none: what it may meet is not told by signs.
pub(crate) fn directions(segments: &[Segment; PROBES]) -> Directions {
    let mut directions = [[0.0; PROBES]; 3];
    for (number, segment) in segments.iter().enumerate() {
        let largest = segment.direction.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        if largest > 0.0 {
            for axis in 0..3 {
                directions[axis][number] = (segment.direction[axis] / largest) as f32;
            }
        }
    }
    directions
}

impl LocalLines {
    /// Finds the points of the segments whose bits are set.
    #[inline(always)]
    pub(crate) fn new(
        frame: &LocalFrame,
        packet: &PlacedPacket,
        segments: &[Segment; PROBES],
        chosen: u16,
    ) -> Self {
        let mut local = Self { points: [[0.0; PROBES]; 3], certain: [f32::INFINITY; PROBES] };
        let scale = f64::from(frame.scale);
        for (number, segment) in segments.iter().enumerate() {
            if chosen >> number & 1 == 0 {
                continue;
            }
            let (start, vector) = (&segment.start, &segment.vector);
            let squared = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2];
            let from =
                [packet.origin[0] - start[0], packet.origin[1] - start[1], packet.origin[2] - start[2]];
            let along = from[0] * vector[0] + from[1] * vector[1] + from[2] * vector[2];
            // Any share will do, and the start where there is none. Of finite numbers, the quotient is no NaN.
            let share = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
            let mut magnitude = packet.magnitude;
            for axis in 0..3 {
                let point = ((vector[axis] * share - from[axis]) * scale) as f32;
                local.points[axis][number] = point;
                magnitude = larger(magnitude, packet.magnitude + point.abs());
            }
            let off = 4.0 * U * magnitude + (segment.error * scale) as f32 + frame.error;
            local.certain[number] = magnitude * (18.0 * off + 48.0 * U * magnitude) + UNDERFLOW;
        }
        local
    }
}

/// Returns the pairs that may meet: bit `4 * triangle + line`.
#[inline(always)]
pub(crate) fn crossed<I: Isa>(
    isa: I,
    packet: &PlacedPacket,
    directions: &Directions,
    lines: &LocalLines,
) -> u16 {
    let (w, r) = (tile(isa, directions), tile(isa, &lines.points));
    let certain = isa.tile(&lines.certain);
    let a = sub(repeat(isa, &packet.corners[0]), r);
    let b = sub(repeat(isa, &packet.corners[1]), r);
    let c = sub(repeat(isa, &packet.corners[2]), r);
    let (ab, bc, ca) = (dot(w, cross(a, b)), dot(w, cross(b, c)), dot(w, cross(c, a)));
    let least = ab.min(bc).min(ca);
    let most = ab.max(bc).max(ca);
    let zero = isa.splat(0.0);
    !(I::V::bits(certain.lt(most)) & I::V::bits(least.lt(zero.sub(certain))))
}
