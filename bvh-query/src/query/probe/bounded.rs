//! Triangles with lower bounds of their distances from a point.

use crate::file::place::LeafPacket;

/// A triangle that may be the closest, with a lower bound of its distance.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct BoundedTriangle {
    pub(super) lower: f32,
    pub(super) leaf: LeafPacket,
    pub(super) lane: u8,
}
