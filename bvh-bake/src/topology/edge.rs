//! An edge and how often it is traversed.

use crate::triangles::{Exact, Triangle};
use bytemuck::{Pod, Zeroable};

/// The bits of a vertex, or of the offsets that determine it, none of which is -0.
pub(crate) type End = [u64; 3];

/// Returns the ends of the edges of a triangle, given its vertices if its offsets do not determine these.
#[inline(always)]
pub(crate) fn ends(triangle: &Triangle, exact: Option<&Exact>) -> [End; 3] {
    // -0.0 + 0.0 is 0.0; every other number stays as it is.
    match exact {
        None => triangle.corners.map(|corner| corner.map(|value| u64::from((value + 0.0).to_bits()))),
        Some(exact) => exact.map(|corner| corner.map(|value| (value + 0.0).to_bits())),
    }
}

/// An edge of triangles that belong together.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Edge {
    pub(super) ends: [End; 2],
    /// How often it is traversed from the first end to the second one, less how often the other way.
    pub(super) count: i32,
    /// A triangle that has the edge, or the part of that triangle.
    pub(super) of: u32,
}

impl Edge {
    /// Returns the same edge with its lesser end first.
    #[inline(always)]
    pub(super) fn sorted(self) -> Self {
        let [from, to] = self.ends;
        if from <= to { self } else { Self { ends: [to, from], count: -self.count, ..self } }
    }
}
