//! From a stored triangle to its exactly defined corners in A's frame.

use crate::error::QueryError;
use crate::narrow::Triangle;
use crate::query::Scene;
use crate::traverse::opened::Leaf;

impl Scene<'_> {
    /// A triangle of A: origin plus stored offset, which is exact.
    pub(crate) fn triangle_a(&self, leaf: Leaf, lane: u8) -> Result<Triangle, QueryError> {
        let object = self.pair.object_a;
        let packet = self.pair.bvh_a.packet(object, leaf.page, leaf.packet)?;
        let origin = object.record.origin.map(|o| o.get());
        let corners = packet.triangle(usize::from(lane & 3));
        Ok(corners.map(|v| [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis]))))
    }

    /// A triangle of B, placed.
    pub(crate) fn triangle_b(&self, leaf: Leaf, lane: u8) -> Result<Triangle, QueryError> {
        let object = self.pair.object_b;
        let packet = self.pair.bvh_b.packet(object, leaf.page, leaf.packet)?;
        let origin = object.record.origin.map(|o| o.get());
        let corners = packet.triangle(usize::from(lane & 3));
        Ok(corners.map(|v| self.pose.place([0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis])))))
    }
}
