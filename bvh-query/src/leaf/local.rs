//! Brings a packet of A and a packet of B into one local frame, with a bound on the error.
//!
//! The frame has A's directions, the first corner of A's packet as its origin, and a unit that makes
//! the larger object about 1 in size, so that squares and products stay within f32's range whatever
//! the mesh's unit. The packets' offset from each other is computed in f64: what remains for f32 is
//! as small as the packets and their distance, and so is its rounding.
//!
//! With u = 2^-24, w the corners of B relative to its packet's first corner, |w| <= m_b, c the offset,
//! |c| <= m_c, |a| <= m_a: a corner of A is off by u m_a (one rounded difference); a corner R w + c of B
//! by at most 9u sum |R||w| + 4u m_c (rounded w, R and c, three products, three sums), and the sum is
//! at most sqrt(3) m_b because rows of R have length 1 (within 2^-20). The pose's f64 error comes on
//! top. So every coordinate is within `error = u (2 m_a + 16 m_b + 5 m_c) + e_pose`. Packets that are dust
//! beside their object have coordinates that underflow: what is left of a coordinate after six roundings
//! of 2^-150 and less is within 2^-140 more, which `e_pose` includes.

use crate::isa::{Isa, Lanes};
use crate::leaf::math::{Corners, Vec3};
use crate::traverse::placement::Placement;
use bvh_format::leaf::Packet;
use bvh_format::object::Object;

/// The unit roundoff of `f32`: the largest relative error of one rounding to nearest.
pub(crate) const U: f32 = 1.0 / (1 << 24) as f32;

/// The error that underflow adds to each coordinate: 2^-140, in units of the frame.
const UNDERFLOW: f32 = f32::from_bits(1 << 9);

/// The frame that all pairs of packets of a query share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalFrame {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
    /// Rotation in units of the frame.
    rotation32: [[f32; 3]; 3],
    /// Units of the frame in a mesh unit, a power of two.
    pub(crate) scale: f32,
    /// Bound on the f64 error, units of the frame.
    error: f32,
}

impl LocalFrame {
    pub(crate) fn new(placement: &Placement, a: &Object, b: &Object) -> Self {
        let size = |object: &Object| {
            let record = object.record();
            (0..3).fold(0.0f64, |m, i| {
                m.max(f64::from(record.box_hi[i].get()) - f64::from(record.box_lo[i].get()))
            })
        };
        // A power of two near 1 / size, by its exponent; a point against a point has no size, and any
        // unit will do.
        let exponent = (size(a).max(size(b)).to_bits() >> 52) as i64 - 1023;
        let scale = f64::from_bits(((1023 - exponent.clamp(-120, 120)) as u64) << 52);
        let rotation32 = placement.rotation.map(|row| row.map(|r| (r * scale) as f32));
        Self {
            rotation: placement.rotation,
            translation: placement.translation,
            rotation32,
            scale: scale as f32,
            error: ((placement.error * scale) as f32).next_up() + UNDERFLOW,
        }
    }
}

impl LocalFrame {
    /// Where the first corner of B's packet is, seen from that of A's: units of the frame.
    #[inline(always)]
    fn offset(&self, origin_a: [f32; 3], origin_b: [f32; 3]) -> [f32; 3] {
        let b = [f64::from(origin_b[0]), f64::from(origin_b[1]), f64::from(origin_b[2])];
        let mut offset = [0.0; 3];
        for axis in 0..3 {
            let r = &self.rotation[axis];
            let placed = r[0] * b[0] + r[1] * b[1] + r[2] * b[2] + self.translation[axis];
            offset[axis] = ((placed - f64::from(origin_a[axis])) * f64::from(self.scale)) as f32;
        }
        offset
    }
}

#[inline(always)]
fn first_corner(packet: &Packet) -> [f32; 3] {
    let corner = &packet.corners[0];
    [corner[0][0], corner[1][0], corner[2][0]]
}

/// Corners of both packets, `[corner][axis]`, four lanes each, and how wrong they may be.
pub(crate) struct Local {
    pub(crate) a: [[[f32; 4]; 3]; 3],
    pub(crate) b: [[[f32; 4]; 3]; 3],
    /// Bound on the error of each coordinate.
    pub(crate) error: f32,
    /// Bound on the magnitude of each coordinate of A plus one of B.
    pub(crate) reach: f32,
}

impl Local {
    #[inline(always)]
    pub(crate) fn new<I: Isa>(isa: I, frame: &LocalFrame, packet_a: &Packet, packet_b: &Packet) -> Self {
        let origin_a = first_corner(packet_a);
        let origin_b = first_corner(packet_b);
        let offset = frame.offset(origin_a, origin_b);
        let scale = isa.splat4(frame.scale);
        let mut local = Self { a: [[[0.0; 4]; 3]; 3], b: [[[0.0; 4]; 3]; 3], error: 0.0, reach: 0.0 };
        let mut reach_a = isa.splat4(0.0);
        let mut reach_b = reach_a;
        for corner in 0..3 {
            let (from_a, from_b) = (&packet_a.corners[corner], &packet_b.corners[corner]);
            let difference: Vec3<I::H> = [
                isa.load4(&from_b[0]).sub(isa.splat4(origin_b[0])),
                isa.load4(&from_b[1]).sub(isa.splat4(origin_b[1])),
                isa.load4(&from_b[2]).sub(isa.splat4(origin_b[2])),
            ];
            for axis in 0..3 {
                let a = isa.load4(&from_a[axis]).sub(isa.splat4(origin_a[axis])).mul(scale);
                reach_a = reach_a.max(a.abs());
                reach_b = reach_b.max(difference[axis].abs());
                isa.store4(a, &mut local.a[corner][axis]);
                let r = splat4(isa, frame.rotation32[axis]);
                let sum = difference[2].mul_add(r[2], isa.splat4(offset[axis]));
                let b = difference[0].mul_add(r[0], difference[1].mul_add(r[1], sum));
                isa.store4(b, &mut local.b[corner][axis]);
            }
        }
        let (m_a, m_b) = (largest_lane(isa, reach_a), largest_lane(isa, reach_b) * frame.scale);
        let m_c = larger(offset[0].abs(), larger(offset[1].abs(), offset[2].abs()));
        local.error = U * (2.0 * m_a + 16.0 * m_b + 5.0 * m_c) + frame.error;
        local.reach = m_a + 1.75 * m_b + m_c;
        local
    }

    /// Corners of A in the first index of the pair, those of B in the second, as 16 lanes each.
    #[inline(always)]
    pub(crate) fn lanes<I: Isa>(&self, isa: I) -> (Corners<I::V>, Corners<I::V>) {
        let (a, b) = (&self.a, &self.b);
        (
            [repeat(isa, &a[0]), repeat(isa, &a[1]), repeat(isa, &a[2])],
            [tile(isa, &b[0]), tile(isa, &b[1]), tile(isa, &b[2])],
        )
    }

    /// Corners of one side as four lanes each.
    #[inline(always)]
    pub(crate) fn quads<I: Isa>(isa: I, side: &[[[f32; 4]; 3]; 3]) -> Corners<I::H> {
        [load4(isa, &side[0]), load4(isa, &side[1]), load4(isa, &side[2])]
    }
}

#[inline(always)]
pub(crate) fn repeat<I: Isa>(isa: I, v: &[[f32; 4]; 3]) -> Vec3<I::V> {
    [isa.repeat(&v[0]), isa.repeat(&v[1]), isa.repeat(&v[2])]
}

#[inline(always)]
pub(crate) fn tile<I: Isa>(isa: I, v: &[[f32; 4]; 3]) -> Vec3<I::V> {
    [isa.tile(&v[0]), isa.tile(&v[1]), isa.tile(&v[2])]
}

#[inline(always)]
fn load4<I: Isa>(isa: I, v: &[[f32; 4]; 3]) -> Vec3<I::H> {
    [isa.load4(&v[0]), isa.load4(&v[1]), isa.load4(&v[2])]
}

#[inline(always)]
pub(crate) fn splat4<I: Isa>(isa: I, v: [f32; 3]) -> Vec3<I::H> {
    [isa.splat4(v[0]), isa.splat4(v[1]), isa.splat4(v[2])]
}

/// The larger of two numbers that are not NaN; `f32::max` takes three instructions to care for it.
#[inline(always)]
fn larger(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// The largest of four lanes that are not NaN.
#[inline(always)]
fn largest_lane<I: Isa>(isa: I, lanes: I::H) -> f32 {
    let mut values = [0.0; 4];
    isa.store4(lanes, &mut values);
    larger(larger(values[0], values[1]), larger(values[2], values[3]))
}

/// The lanes of a packet pair that hold pairs of triangles.
#[inline(always)]
pub(crate) fn valid_lanes(triangles_a: u8, triangles_b: u8) -> u16 {
    let a = (1u32 << (4 * u32::from(triangles_a))) - 1;
    a as u16 & (0x1111 * ((1u16 << triangles_b) - 1))
}
