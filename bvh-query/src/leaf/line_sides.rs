//! Which triangles of up to four packets a line may cross.
//!
//! The sign of w · (a × b) tells on which side a line with direction w passes an edge from a to b, where a and b are
//! seen from a point of the line: see [`crate::narrow::Ray`]. Two opposite signs that are certain show that the line
//! misses the triangle.
//!
//! Error: a point of the line near the packets is the origin, in the frame of [`crate::leaf::point_bounds`]. Let m bound the
//! coordinates of a triangle there, and u = 2^-24. A coordinate is off by at most d = 2u m + e, with e what
//! [`LocalPoint`] charges. A component of the cross product is then off by 4 m d + 2 d^2 + 4u m^2. A component of w is
//! off by u, as none is beyond 1. The three products and their sums add 24u m^2. Together that is at most 12 m d + 6
//! d^2 + 36u m^2, and less than (m + d) (18 d + 48u m).

use crate::isa::{Isa, Lanes};
use crate::leaf::math::{cross, dot, largest_of};
use crate::leaf::point_bounds::LocalPoint;
use crate::numerics::{SIGN_UNDERFLOW, U};
use bvh_format::leaf::Packet;

/// Returns a direction with no component beyond 1.
#[inline(always)]
pub(crate) fn direction(vector: &[f64; 3]) -> [f32; 3] {
    let largest = vector[0].abs().max(vector[1].abs()).max(vector[2].abs());
    // A point has no direction: then no sign is certain.
    if largest == 0.0 { [0.0; 3] } else { vector.map(|v| (v / largest) as f32) }
}

/// Returns the triangles of four packets that a line through a point may meet: bit `4 * packet + triangle`.
#[inline(always)]
pub(crate) fn crossed<I: Isa>(
    isa: I,
    packets: [&Packet; 4],
    point: &LocalPoint,
    direction: &[f32; 3],
) -> u16 {
    let [a, b, c] = point.seen(isa, packets);
    let w = [isa.splat(direction[0]), isa.splat(direction[1]), isa.splat(direction[2])];
    let m = largest_of(&[a, b, c]);
    let d = m.mul_add(isa.splat(2.0 * U), isa.splat(point.error));
    let relative = m.mul_add(isa.splat(48.0 * U), d.mul(isa.splat(18.0)));
    let certain = m.add(d).mul_add(relative, isa.splat(SIGN_UNDERFLOW));
    let (ab, bc, ca) = (dot(w, cross(a, b)), dot(w, cross(b, c)), dot(w, cross(c, a)));
    let (least, most) = (ab.min(bc).min(ca), ab.max(bc).max(ca));
    let zero = isa.splat(0.0);
    !(I::F32x16::bits(certain.lt(most)) & I::F32x16::bits(least.lt(zero.sub(certain))))
}
