//! Triangle pairs of several packet pairs, gathered until they fill all lanes of a register.
//!
//! Cheap tests leave one or two of the 16 pairs of two packets. The costly tests are made for 16 of the remaining pairs
//! at once.

use crate::file::place::{LeafPacket, TrianglePlace};
use crate::isa::Isa;
use crate::leaf::local::Local;
use crate::leaf::math::Corners;

/// A pair of triangles that the cheap tests do not decide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrianglePair {
    pub(crate) a: LeafPacket,
    pub(crate) b: LeafPacket,
    pub(crate) lane_a: u8,
    pub(crate) lane_b: u8,
}

impl TrianglePair {
    /// Returns where the triangle of A is stored.
    pub(crate) fn place_a(&self) -> TrianglePlace {
        TrianglePlace { page: self.a.page, packet: self.a.packet, lane: self.lane_a }
    }

    /// Returns where the triangle of B is stored.
    pub(crate) fn place_b(&self) -> TrianglePlace {
        TrianglePlace { page: self.b.page, packet: self.b.packet, lane: self.lane_b }
    }

    /// Returns the pair in a lane of two packets: element `4 * a + b`.
    #[inline(always)]
    pub(crate) fn in_lane(a: LeafPacket, b: LeafPacket, lane: u8) -> Self {
        Self { a, b, lane_a: lane >> 2 & 3, lane_b: lane & 3 }
    }
}

/// Up to 16 candidates with their local corners.
pub(crate) struct TriangleQueue {
    /// `[side][corner][axis]`
    corners: [[[[f32; 16]; 3]; 3]; 2],
    error: [f32; 16],
    reach: [f32; 16],
    candidates: [Option<TrianglePair>; 16],
    /// The lanes of pairs of which each triangle certainly has corners strictly on both sides of the other's plane.
    straddling: u16,
    len: usize,
}

impl Default for TriangleQueue {
    fn default() -> Self {
        Self {
            corners: [[[[0.0; 16]; 3]; 3]; 2],
            error: [0.0; 16],
            reach: [0.0; 16],
            candidates: [None; 16],
            straddling: 0,
            len: 0,
        }
    }
}

impl TriangleQueue {
    /// The number of pairs in a full queue.
    pub(crate) const FULL: usize = 16;

    pub(crate) fn clear(&mut self) {
        (self.len, self.straddling) = (0, 0);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(crate) fn is_full(&self) -> bool {
        self.len == Self::FULL
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn push(&mut self, local: &Local<'_>, candidate: TrianglePair) {
        // It also shows the compiler that no access below is out of bounds.
        assert!(self.len < Self::FULL, "a full queue is emptied before the next pair");
        let at = self.len;
        let (lane_a, lane_b) = (usize::from(candidate.lane_a & 3), usize::from(candidate.lane_b & 3));
        for corner in 0..3 {
            for axis in 0..3 {
                self.corners[0][corner][axis][at] = local.a.corners[corner][axis][lane_a];
                self.corners[1][corner][axis][at] =
                    local.b.corners[corner][axis][lane_b] + local.offset[axis];
            }
        }
        self.error[at] = local.error;
        self.reach[at] = local.reach;
        self.candidates[at] = Some(candidate);
        self.len = at + 1;
    }

    /// Records of the last pair that each triangle certainly has corners strictly on both sides of the other's plane.
    #[inline(always)]
    pub(crate) fn mark_last_straddling(&mut self, straddles: bool) {
        self.straddling |= u16::from(straddles) << (self.len.wrapping_sub(1) & 15);
    }

    /// Returns the lanes that `mark_last_straddling` marked.
    #[inline(always)]
    pub(crate) fn straddling(&self) -> u16 {
        self.straddling
    }

    /// Returns the corners of both sides.
    #[inline(always)]
    pub(crate) fn corners<I: Isa>(&self, isa: I) -> (Corners<I::F32x16>, Corners<I::F32x16>) {
        (self.side(isa, 0), self.side(isa, 1))
    }

    #[inline(always)]
    fn side<I: Isa>(&self, isa: I, side: usize) -> Corners<I::F32x16> {
        let c = &self.corners[side];
        [
            [isa.load(&c[0][0]), isa.load(&c[0][1]), isa.load(&c[0][2])],
            [isa.load(&c[1][0]), isa.load(&c[1][1]), isa.load(&c[1][2])],
            [isa.load(&c[2][0]), isa.load(&c[2][1]), isa.load(&c[2][2])],
        ]
    }

    /// Returns the bounds on the error of the coordinates: see `Local`.
    #[inline(always)]
    pub(crate) fn error<I: Isa>(&self, isa: I) -> I::F32x16 {
        isa.load(&self.error)
    }

    /// Returns the bounds on the magnitude of the coordinates.
    #[inline(always)]
    pub(crate) fn reach<I: Isa>(&self, isa: I) -> I::F32x16 {
        isa.load(&self.reach)
    }

    /// Returns the lanes that hold a pair.
    #[inline(always)]
    pub(crate) fn filled(&self) -> u16 {
        ((1u32 << self.len) - 1) as u16
    }

    /// Empties the queue, and returns its pairs.
    #[inline(always)]
    pub(crate) fn take(&mut self) -> [Option<TrianglePair>; 16] {
        self.clear();
        self.candidates
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf::frame::LocalFrame;
    use crate::leaf::placed_packet::PlacedPacket;

    const LEAF: LeafPacket = LeafPacket { page: 0, packet: 0, triangles: 4 };

    /// A pair beyond a full queue would take the place of another one, whose contact would be lost.
    #[test]
    #[should_panic(expected = "a full queue is emptied before the next pair")]
    fn a_full_queue_takes_no_more() {
        let frame = LocalFrame {
            rotation: [[0.0; 3]; 3],
            translation: [0.0; 3],
            rotation32: [[0.0; 3]; 3],
            scale: 1.0,
            error: f32::MIN_POSITIVE,
        };
        let local = Local::new(&frame, &PlacedPacket::NONE, &PlacedPacket::NONE);
        let mut queue = TriangleQueue::default();
        for lane in 0..17 {
            assert_eq!(queue.len(), usize::from(lane));
            queue.push(&local, TrianglePair::in_lane(LEAF, LEAF, lane));
        }
    }
}
