//! An edge and how often it is traversed.

use bytemuck::{Pod, Zeroable};

/// The bits of a corner's coordinates in one number, which orders corners and is equal for equal ones.
pub(super) type End = u128;

/// Returns the end of an edge at a corner.
pub(super) fn end(corner: [f32; 3]) -> End {
    // -0.0 + 0.0 is 0.0; every other number stays as it is.
    end_of_bits(corner.map(|value| (value + 0.0).to_bits()))
}

/// Does the same for the bits of coordinates, none of which is -0.
pub(super) fn end_of_bits(corner: [u32; 3]) -> End {
    let [x, y, z] = corner.map(u128::from);
    x << 64 | y << 32 | z
}

/// An edge of triangles of a part.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Edge {
    /// The lesser end, then the greater one.
    pub(super) ends: [End; 2],
    /// How often it is traversed from the lesser end to the greater one, less how often the other way.
    pub(super) count: i32,
    /// A triangle that has the edge, or the part of that triangle.
    pub(super) of: u32,
}

impl Edge {
    /// Returns the edge that is traversed from one end to the other, or `None` if they are equal.
    #[inline(always)]
    pub(super) fn new(from: End, to: End, of: u32) -> Option<Self> {
        let ascends = from < to;
        let (ends, count) = if ascends { ([from, to], 1) } else { ([to, from], -1) };
        (from != to).then_some(Self { ends, count, of })
    }
}

/// An edge as it is sorted, in the order of its ends.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct StoredEdge([u32; 8]);

impl StoredEdge {
    pub(super) fn new(edge: &Edge) -> Self {
        let [[a, b, c], [d, e, f]] = edge.ends.map(|end| [64, 32, 0].map(|shift| (end >> shift) as u32));
        Self([a, b, c, d, e, f, edge.count as u32, edge.of])
    }

    pub(super) fn ends(&self) -> &[u32] {
        &self.0[..6]
    }

    pub(super) fn count(&self) -> i32 {
        self.0[6] as i32
    }

    pub(super) fn part(&self) -> u32 {
        self.0[7]
    }

    /// Returns the same edge of another part.
    pub(super) fn of_part(mut self, part: u32) -> Self {
        self.0[7] = part;
        self
    }
}
