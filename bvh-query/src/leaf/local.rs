//! Brings a packet of A and a packet of B into one local frame, with a bound on the error.
//!
//! The frame has the directions and the unit of [`LocalFrame`], and the first corner of A's packet as its origin. The
//! offset between the packets is computed in f64. The numbers in f32 are therefore only as large as the packets and
//! their distance, and so their rounding errors are small.
//!
//! Let u = 2^-24, a the corners of A with |a| <= m_a, w the corners of B relative to its packet's first corner with
//! |w| <= m_b, and c the offset with |c| <= m_c. A corner of A is off by u m_a (one rounded difference). A corner R w + c
//! of B is off by at most 9u sum |R||w| + 4u m_c (rounded w, R and c, three products, two sums, and the sum with c).
//! There, sum |R||w| is at most sqrt(3) m_b, because rows of R have length 1 (within 2^-20). The pose's f64 error is
//! added. So every coordinate is within `error = u (2 m_a + 16 m_b + 5 m_c) + e_pose`. If a packet is dust beside its
//! object, its coordinates underflow. Six roundings of 2^-150 or less move a coordinate by less than 2^-140 more, which
//! `e_pose` includes.

use crate::isa::Isa;
use crate::leaf::frame::LocalFrame;
use crate::leaf::math::{Corners, Vec3, add, dot, splat4};
use crate::leaf::placed_packet::{PlacedPacket, larger};
use crate::numerics::U;

/// A packet of A and one of B in one frame, whose origin is the first corner of A's.
pub(crate) struct Local<'a> {
    pub(crate) a: &'a PlacedPacket,
    pub(crate) b: &'a PlacedPacket,
    /// Where the first corner of B's packet is.
    pub(crate) offset: [f32; 3],
    /// Bound on the error of each coordinate.
    pub(crate) error: f32,
    /// Bound on the magnitude of each coordinate of A plus one of B.
    pub(crate) reach: f32,
}

impl<'a> Local<'a> {
    #[inline(always)]
    pub(crate) fn new(frame: &LocalFrame, a: &'a PlacedPacket, b: &'a PlacedPacket) -> Self {
        let mut offset = [0.0; 3];
        for axis in 0..3 {
            offset[axis] = ((b.origin[axis] - a.origin[axis]) * f64::from(frame.scale)) as f32;
        }
        let (m_a, m_b) = (a.magnitude, b.magnitude);
        let m_c = larger(offset[0].abs(), larger(offset[1].abs(), offset[2].abs()));
        let error = U * (2.0 * m_a + 16.0 * m_b + 5.0 * m_c) + frame.error;
        Self { a, b, offset, error, reach: m_a + 1.75 * m_b + m_c }
    }

    /// Corners of A in the first index of the pair, those of B in the second, as 16 lanes each.
    #[inline(always)]
    pub(crate) fn lanes<I: Isa>(&self, isa: I) -> (Corners<I::F32x16>, Corners<I::F32x16>) {
        let (a, b) = (&self.a.corners, &self.b.corners);
        let [x, y, z] = self.offset;
        let offset = [isa.splat(x), isa.splat(y), isa.splat(z)];
        (
            [repeat(isa, &a[0]), repeat(isa, &a[1]), repeat(isa, &a[2])],
            [add(tile(isa, &b[0]), offset), add(tile(isa, &b[1]), offset), add(tile(isa, &b[2]), offset)],
        )
    }

    /// Returns how far along four directions the first corner of B's packet is.
    #[inline(always)]
    pub(crate) fn offset_along<I: Isa>(&self, isa: I, directions: Vec3<I::F32x4>) -> I::F32x4 {
        dot(directions, splat4(isa, self.offset))
    }
}

#[inline(always)]
pub(crate) fn repeat<I: Isa>(isa: I, v: &[[f32; 4]; 3]) -> Vec3<I::F32x16> {
    [isa.repeat(&v[0]), isa.repeat(&v[1]), isa.repeat(&v[2])]
}

#[inline(always)]
pub(crate) fn tile<I: Isa>(isa: I, v: &[[f32; 4]; 3]) -> Vec3<I::F32x16> {
    [isa.tile(&v[0]), isa.tile(&v[1]), isa.tile(&v[2])]
}

/// The lanes of a packet pair that hold pairs of triangles.
#[inline(always)]
pub(crate) fn valid_lanes(triangles_a: u8, triangles_b: u8) -> u16 {
    let a = (1u32 << (4 * u32::from(triangles_a))) - 1;
    a as u16 & (0x1111 * ((1u16 << triangles_b) - 1))
}
