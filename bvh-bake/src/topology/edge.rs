//! An edge and how often it is traversed.

use bytemuck::{Pod, Zeroable};

/// The bits of a corner's coordinates, none of which is -0.
pub(super) type End = [u32; 3];

/// Returns the end of an edge at a corner.
#[inline(always)]
pub(super) fn end(corner: [f32; 3]) -> End {
    // -0.0 + 0.0 is 0.0; every other number stays as it is.
    corner.map(|value| (value + 0.0).to_bits())
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
