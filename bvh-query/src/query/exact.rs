//! Places stored triangles: their corners in A's frame are defined exactly.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::isa::{Isa, Task};
use crate::narrow::{Closest, Triangle, triangle_distance_with};
use crate::pose::Pose;
use crate::query::placed_pair::PlacedPair;
use bvh_format::leaf::PACKET;
use bvh_format::object::Object;

impl PlacedPair<'_> {
    /// Returns a triangle of A.
    pub(crate) fn triangle_a(&self, leaf: LeafPacket, lane: u8) -> Result<Triangle, QueryError> {
        stored(self.pair.bvh_a, self.pair.object_a, leaf, lane)
    }

    /// Returns a triangle of B, placed in A's frame.
    pub(crate) fn triangle_b(&self, leaf: LeafPacket, lane: u8) -> Result<Triangle, QueryError> {
        Ok(placed(&stored(self.pair.bvh_b, self.pair.object_b, leaf, lane)?, self.pose))
    }
}

/// The triangles of a side that were placed last, one for each lane. Candidates of two packets name a triangle up to
/// four times, and unpacking and placing it takes a large part of an exact test.
#[derive(Default)]
pub(super) struct RecentTriangles {
    /// The page and the packet of each triangle.
    of: [Option<(u32, u16)>; PACKET],
    triangles: [Triangle; PACKET],
}

impl RecentTriangles {
    /// Forgets all triangles, before a query.
    pub(super) fn start(&mut self) {
        self.of = [None; PACKET];
    }

    /// Returns the triangle in a lane of a packet, or what `place` returns, which is then kept.
    #[inline(always)]
    pub(super) fn get_or_place(
        &mut self,
        leaf: LeafPacket,
        lane: u8,
        place: impl FnOnce() -> Result<Triangle, QueryError>,
    ) -> Result<&Triangle, QueryError> {
        let lane = usize::from(lane) % PACKET;
        let wanted = Some((leaf.page, leaf.packet));
        if self.of[lane] != wanted {
            self.triangles[lane] = place()?;
            self.of[lane] = wanted;
        }
        Ok(&self.triangles[lane])
    }
}

/// Returns a triangle in the frame of its own file.
pub(super) fn stored(bvh: &Bvh, object: &Object, leaf: LeafPacket, lane: u8) -> Result<Triangle, QueryError> {
    bvh.vertices(object, leaf, lane & 3)
}

/// Returns the triangle at a place, in the frame of its own file.
pub(super) fn stored_at(bvh: &Bvh, object: &Object, place: TrianglePlace) -> Result<Triangle, QueryError> {
    let leaf = LeafPacket { page: place.page, packet: place.packet, triangles: 4 };
    stored(bvh, object, leaf, place.lane)
}

/// Computes `triangle_distance` with the features of a backend.
pub(super) struct TriangleDistance<'a>(pub(super) &'a Triangle, pub(super) &'a Triangle);

impl Task for TriangleDistance<'_> {
    type Output = Closest;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Closest {
        triangle_distance_with(isa, self.0, self.1)
    }
}

/// Returns a triangle of B, placed in A's frame.
pub(super) fn placed(triangle: &Triangle, pose: &Pose) -> Triangle {
    [pose.place(triangle[0]), pose.place(triangle[1]), pose.place(triangle[2])]
}
