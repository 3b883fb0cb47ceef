//! Leaf packets in the form that filters need, kept for a query, because a packet meets several others.
//!
//! A placed packet has A's directions and the unit of the local frame, and its first corner as its origin. It therefore
//! does not depend on the packet that it meets. See `Local` for pairs of packets, and for the error.

use crate::isa::{Isa, Lanes};
use crate::leaf::frame::LocalFrame;
use crate::leaf::math::{Corners, Vec3, add, cross, dot, largest, max3, min3, project, splat4, sub};
use bvh_format::leaf::Packet;

/// Packets kept for each side: 24 KiB, so that they stay in the second-level cache beside the memory of the walk.
const PACKETS_PER_SIDE: usize = 64;

/// Four triangles of A or of B, and what filters need of their faces.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct PlacedPacket {
    /// `[corner][axis]`
    pub(crate) corners: [[[f32; 4]; 3]; 3],
    /// Perpendicular to each face, not normalised.
    pub(crate) normal: [[f32; 4]; 3],
    /// The squared length of the normal.
    pub(crate) squared: [f32; 4],
    /// The least and the greatest of the corners' projections on the normal.
    pub(crate) lo: [f32; 4],
    pub(crate) hi: [f32; 4],
    /// The sum of the corners.
    pub(crate) sum: [[f32; 4]; 3],
    /// The largest magnitude of a component of the edges from the first corner.
    pub(crate) edge: [f32; 4],
    /// The first corner of the packet in A's frame, mesh units.
    pub(crate) origin: [f64; 3],
    /// A bound on the magnitudes of the coordinates: for B, of those before it was turned.
    pub(crate) magnitude: f32,
}

impl PlacedPacket {
    pub(super) const NONE: Self = Self {
        corners: [[[0.0; 4]; 3]; 3],
        normal: [[0.0; 4]; 3],
        squared: [0.0; 4],
        lo: [0.0; 4],
        hi: [0.0; 4],
        sum: [[0.0; 4]; 3],
        edge: [0.0; 4],
        origin: [0.0; 3],
        magnitude: 0.0,
    };

    /// Makes this a packet of A.
    #[inline(always)]
    pub(crate) fn place_a<I: Isa>(&mut self, isa: I, frame: &LocalFrame, packet: &Packet) {
        let origin = first_corner(packet);
        self.origin = origin.map(f64::from);
        let scale = isa.splat4(frame.scale);
        let mut reach = isa.splat4(0.0);
        for corner in 0..3 {
            for axis in 0..3 {
                let from = isa.load4(&packet.corners[corner][axis]);
                let a = from.sub(isa.splat4(origin[axis])).mul(scale);
                reach = reach.max(a.abs());
                isa.store4(a, &mut self.corners[corner][axis]);
            }
        }
        self.magnitude = largest_lane(isa, reach);
        self.faces(isa);
    }

    /// Makes this a packet of B.
    #[inline(always)]
    pub(crate) fn place_b<I: Isa>(&mut self, isa: I, frame: &LocalFrame, packet: &Packet) {
        let origin = first_corner(packet);
        let o = origin.map(f64::from);
        for axis in 0..3 {
            let r = &frame.rotation[axis];
            self.origin[axis] = r[0] * o[0] + r[1] * o[1] + r[2] * o[2] + frame.translation[axis];
        }
        let mut reach = isa.splat4(0.0);
        for corner in 0..3 {
            let from = &packet.corners[corner];
            let w: Vec3<I::F32x4> = [
                isa.load4(&from[0]).sub(isa.splat4(origin[0])),
                isa.load4(&from[1]).sub(isa.splat4(origin[1])),
                isa.load4(&from[2]).sub(isa.splat4(origin[2])),
            ];
            reach = reach.max(largest(w));
            for axis in 0..3 {
                let b = dot(w, splat4(isa, frame.rotation32[axis]));
                isa.store4(b, &mut self.corners[corner][axis]);
            }
        }
        self.magnitude = largest_lane(isa, reach) * frame.scale;
        self.faces(isa);
    }

    #[inline(always)]
    fn faces<I: Isa>(&mut self, isa: I) {
        let corners = self.quads(isa);
        let (edge_1, edge_2) = (sub(corners[1], corners[0]), sub(corners[2], corners[0]));
        let normal = cross(edge_1, edge_2);
        let heights = project(&corners, normal);
        let sum = add(add(corners[0], corners[1]), corners[2]);
        for axis in 0..3 {
            isa.store4(normal[axis], &mut self.normal[axis]);
            isa.store4(sum[axis], &mut self.sum[axis]);
        }
        isa.store4(dot(normal, normal), &mut self.squared);
        isa.store4(min3(heights), &mut self.lo);
        isa.store4(max3(heights), &mut self.hi);
        isa.store4(largest(edge_1).max(largest(edge_2)), &mut self.edge);
    }

    /// Corners as four lanes each.
    #[inline(always)]
    pub(crate) fn quads<I: Isa>(&self, isa: I) -> Corners<I::F32x4> {
        let c = &self.corners;
        [load4(isa, &c[0]), load4(isa, &c[1]), load4(isa, &c[2])]
    }
}

#[inline(always)]
fn first_corner(packet: &Packet) -> [f32; 3] {
    let corner = &packet.corners[0];
    [corner[0][0], corner[1][0], corner[2][0]]
}

#[inline(always)]
pub(crate) fn load4<I: Isa>(isa: I, v: &[[f32; 4]; 3]) -> Vec3<I::F32x4> {
    [isa.load4(&v[0]), isa.load4(&v[1]), isa.load4(&v[2])]
}

/// The larger of two numbers that are not NaN; `f32::max` takes three instructions to care for it.
#[inline(always)]
pub(crate) fn larger(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// The largest of four lanes that are not NaN.
#[inline(always)]
fn largest_lane<I: Isa>(isa: I, lanes: I::F32x4) -> f32 {
    let mut values = [0.0; 4];
    isa.store4(lanes, &mut values);
    larger(larger(values[0], values[1]), larger(values[2], values[3]))
}

/// The packets of one side that a query placed last. A packet has one place, which follows from its number.
pub(crate) struct PlacedPackets {
    /// Query, page and number of the packet in each place.
    keys: [u64; PACKETS_PER_SIDE],
    packets: Box<[PlacedPacket; PACKETS_PER_SIDE]>,
    query: u64,
    /// The file and the unit of A's packets.
    of: (u64, u32),
    /// Whether A's packets may be of another file or unit than the query needs.
    may_be_others: bool,
}

impl Default for PlacedPackets {
    fn default() -> Self {
        Self {
            keys: [0; PACKETS_PER_SIDE],
            packets: Box::new([PlacedPacket::NONE; PACKETS_PER_SIDE]),
            query: 0,
            of: (0, 0),
            may_be_others: false,
        }
    }
}

impl PlacedPackets {
    /// Forgets all packets, before a query.
    pub(crate) fn start(&mut self) {
        // The key has 22 bits for the query; 0 stands for none.
        self.query = (self.query + 1) % (1 << 22);
        if self.query == 0 {
            self.keys = [0; PACKETS_PER_SIDE];
            self.query = 1;
        }
    }

    /// Starts a query in which the packets are A's. They do not depend on where B is, so they stay until `forget_others` is
    /// told of another file or unit.
    pub(crate) fn start_with_known(&mut self) {
        self.may_be_others = true;
    }

    /// Forgets all packets, if they are of another file or in another unit than these. It is called when the first packet is
    /// needed, because most queries need none.
    #[inline(always)]
    pub(crate) fn forget_others(&mut self, of: (u64, u32)) {
        if std::mem::take(&mut self.may_be_others) && self.of != of {
            self.of = of;
            self.start();
        }
    }

    /// Returns the place of a packet.
    #[inline(always)]
    pub(crate) fn place(&mut self, page: u32, packet: u16) -> Place<'_> {
        let wanted = self.query << 42 | u64::from(page) << 16 | u64::from(packet);
        // A page whose bytes change after their check may have any number.
        let place = (page as usize).wrapping_mul(37).wrapping_add(usize::from(packet)) % PACKETS_PER_SIDE;
        Place { key: &mut self.keys[place], wanted, packet: &mut self.packets[place] }
    }
}

/// The place of a packet, which may hold another one.
pub(crate) struct Place<'a> {
    key: &'a mut u64,
    wanted: u64,
    pub(crate) packet: &'a mut PlacedPacket,
}

impl Place<'_> {
    /// Returns whether the packet is there. If it is not, the caller puts it there, and says so.
    #[inline(always)]
    pub(crate) fn is_known(&self) -> bool {
        *self.key == self.wanted
    }

    /// Says that the packet is there from now on.
    #[inline(always)]
    pub(crate) fn keep(&mut self) {
        *self.key = self.wanted;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_of_a_stay_while_they_are_of_the_same_file_and_unit() {
        let mut packets = PlacedPackets::default();
        packets.start();
        // The caller may fail to put a packet there.
        assert!(!packets.place(3, 5).is_known());
        assert!(!packets.place(3, 5).is_known());
        for (of, stays) in [((1, 2), false), ((1, 2), true), ((1, 3), false), ((2, 3), false), ((2, 3), true)]
        {
            packets.start_with_known();
            packets.forget_others(of);
            let mut place = packets.place(3, 5);
            assert_eq!(place.is_known(), stays, "{of:?}");
            place.keep();
            // Only the first packet of a query asks whether the others may stay.
            packets.forget_others((9, 9));
            assert!(packets.place(3, 5).is_known());
            assert!(!packets.place(3, 6).is_known());
        }
        packets.start();
        assert!(!packets.place(3, 5).is_known());
    }
}
