//! Two placed objects, which every query about a pair of shapes walks.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::file::shape::Shape;
use crate::isa::{Isa, Task};
use crate::leaf::frame::LocalFrame;
use crate::leaf::local::Local;
use crate::leaf::placed_packet::{PlacedPacket, PlacedPackets};
use crate::leaf::queue::TrianglePair;
use crate::pose::Pose;
use crate::traverse::placement::{ObjectPair, Placement};
use crate::traverse::walk::{Visitor, traverse};
use crate::traverse::walk_memory::WalkMemory;
use bvh_format::leaf::Packet;
use std::cell::OnceCell;
use std::ops::ControlFlow;

/// Two objects in place, with everything that leaf tests need.
pub(crate) struct PlacedPair<'a> {
    pub(crate) pair: ObjectPair<'a>,
    pub(crate) pose: &'a Pose,
    /// Prepared when the first leaf is visited, which most queries of separated meshes never do.
    frame: OnceCell<LocalFrame>,
    /// The numbers that the objects have in their files.
    pub(crate) numbers: (u32, u32),
}

impl<'p> PlacedPair<'p> {
    /// Returns the same objects with B elsewhere.
    pub(crate) fn moved<'q>(&self, pose: &'q Pose, placement: &'q Placement) -> PlacedPair<'q>
    where
        'p: 'q,
    {
        let pair = ObjectPair { placement, end: placement, ..self.pair };
        PlacedPair { pair, pose, frame: OnceCell::new(), numbers: self.numbers }
    }
}

impl PlacedPair<'_> {
    /// Returns what all pairs of packets share.
    #[inline(always)]
    pub(crate) fn frame(&self) -> &LocalFrame {
        let ObjectPair { object_a, object_b, placement, .. } = self.pair;
        self.frame.get_or_init(|| LocalFrame::new(placement, object_a, object_b))
    }

    /// Fetches two leaf packets and brings them into their local frame.
    #[inline(always)]
    pub(crate) fn local<'a, I: Isa>(
        &self,
        isa: I,
        [packets_a, packets_b]: &'a mut [PlacedPackets; 2],
        (a, b): (LeafPacket, LeafPacket),
    ) -> Result<Local<'a>, QueryError> {
        Ok(Local::new(self.frame(), self.place_a(isa, packets_a, a)?, self.place_b(isa, packets_b, b)?))
    }

    /// Fetches a leaf packet of A.
    #[inline(always)]
    pub(crate) fn place_a<'a, I: Isa>(
        &self,
        isa: I,
        packets: &'a mut PlacedPackets,
        leaf: LeafPacket,
    ) -> Result<&'a PlacedPacket, QueryError> {
        packets.forget_others((self.pair.bvh_a.identity(), self.frame().scale.to_bits()));
        let mut place = packets.place(leaf.page, leaf.packet);
        if !place.is_known() {
            let ObjectPair { bvh_a, object_a, .. } = self.pair;
            let room = &mut Packet::default();
            place.packet.place_a(isa, self.frame(), bvh_a.packet(isa, object_a, leaf, room)?);
            place.keep();
        }
        Ok(place.packet)
    }

    /// Fetches a leaf packet of B.
    #[inline(always)]
    pub(crate) fn place_b<'a, I: Isa>(
        &self,
        isa: I,
        packets: &'a mut PlacedPackets,
        leaf: LeafPacket,
    ) -> Result<&'a PlacedPacket, QueryError> {
        let mut place = packets.place(leaf.page, leaf.packet);
        if !place.is_known() {
            let ObjectPair { bvh_b, object_b, .. } = self.pair;
            let room = &mut Packet::default();
            place.packet.place_b(isa, self.frame(), bvh_b.packet(isa, object_b, leaf, room)?);
            place.keep();
        }
        Ok(place.packet)
    }
}

/// What is done with a pair of triangles in contact. A reference, so that one walk is compiled for all of them.
pub(super) type VisitPair<'a> =
    &'a mut dyn FnMut(TrianglePair) -> Result<ControlFlow<TrianglePair>, QueryError>;

/// A pair of triangles that a query has found.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoundPair {
    /// The numbers that the objects have in their files.
    pub(super) numbers: (u32, u32),
    pub(super) pair: TrianglePair,
}

/// Calls `visit` for each pair of objects of the two sides, in the order of the files, until it returns a result.
pub(super) fn each_pair<R>(
    a: Shape<'_>,
    b: Shape<'_>,
    pose: &Pose,
    mut visit: impl FnMut(&PlacedPair<'_>) -> Result<Option<R>, QueryError>,
) -> Result<Option<R>, QueryError> {
    for (index_a, object_a) in a.objects().iter().enumerate() {
        for (index_b, object_b) in b.objects().iter().enumerate() {
            let placement = Placement::new(pose, object_a, object_b);
            let placed = PlacedPair {
                pair: ObjectPair {
                    bvh_a: a.bvh(),
                    object_a,
                    bvh_b: b.bvh(),
                    object_b,
                    placement: &placement,
                    end: &placement,
                },
                pose,
                frame: OnceCell::new(),
                numbers: ((a.first() + index_a) as u32, (b.first() + index_b) as u32),
            };
            if let Some(result) = visit(&placed)? {
                return Ok(Some(result));
            }
        }
    }
    Ok(None)
}

/// A walk with a visitor, compiled for each backend. It is a task by reference, because a large task is copied before it runs,
/// and the copy waits for what has just been written.
pub(super) struct Walk<'a, W> {
    pub(super) pair: &'a ObjectPair<'a>,
    pub(super) memory: &'a mut WalkMemory,
    pub(super) visitor: &'a mut W,
}

impl<W: Visitor> Task for &mut Walk<'_, W> {
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let WalkMemory { pairs, budget, .. } = &mut *self.memory;
        traverse(isa, self.pair, pairs, budget, &mut *self.visitor)
    }
}
