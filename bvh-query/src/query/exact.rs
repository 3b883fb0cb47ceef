//! From a stored triangle to its exactly defined corners in A's frame.

use crate::bvh::Bvh;
use crate::error::QueryError;
use crate::isa::{Isa, Task};
use crate::narrow::{Closest, Triangle, triangle_distance};
use crate::pose::Pose;
use crate::query::Scene;
use crate::traverse::opened::Leaf;
use bvh_format::object::Object;

impl Scene<'_> {
    /// A triangle of A.
    pub(crate) fn triangle_a(&self, leaf: Leaf, lane: u8) -> Result<Triangle, QueryError> {
        stored(self.pair.bvh_a, self.pair.object_a, leaf, lane)
    }

    /// A triangle of B, placed.
    pub(crate) fn triangle_b(&self, leaf: Leaf, lane: u8) -> Result<Triangle, QueryError> {
        Ok(placed(&stored(self.pair.bvh_b, self.pair.object_b, leaf, lane)?, self.pose))
    }
}

/// A triangle in its own file's frame: origin plus stored offset, which is exact.
pub(super) fn stored(bvh: &Bvh, object: &Object, leaf: Leaf, lane: u8) -> Result<Triangle, QueryError> {
    let corners = bvh.triangle(object, leaf, lane & 3)?;
    let origin = object.record.origin.map(|o| o.get());
    Ok(corners.map(|v| [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis]))))
}

/// `triangle_distance`, with the features of a backend: its 42 candidates fill vector registers.
pub(super) struct TriangleDistance<'a>(pub(super) &'a Triangle, pub(super) &'a Triangle);

impl Task for TriangleDistance<'_> {
    type Output = Closest;

    #[inline(always)]
    fn run<I: Isa>(self, _isa: I) -> Closest {
        triangle_distance(self.0, self.1)
    }
}

/// Where a pose puts a triangle of B.
pub(super) fn placed(triangle: &Triangle, pose: &Pose) -> Triangle {
    triangle.map(|corner| pose.place(corner))
}
