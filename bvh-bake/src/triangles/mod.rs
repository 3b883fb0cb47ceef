//! The triangles on their way through a bake: their records, streams of them, and the placement of their coordinates.

mod batch;
mod passes;
pub(crate) mod placement;
pub(crate) mod prediction;
mod rounding;
mod stream;

pub(crate) use batch::{Batch, BatchStream};
pub(crate) use passes::{Grouped, InStream, distribute, fold};
pub(crate) use stream::{Gathered, Kept, Part, TriangleStream};

use crate::error::BakeError;
use bytemuck::{Pod, Zeroable};

/// Three corners relative to the origin, in mesh units.
pub(crate) type Corners = [[f32; 3]; 3];

/// The vertices behind the corners of a triangle, in mesh units.
pub(crate) type Exact = [[f64; 3]; 3];

/// The number of triangles in a full part.
pub(crate) const TRIANGLES_PER_PART: usize = 1 << 14;

/// A triangle as a file stores it, with its number in the input.
#[derive(Clone, Copy, Pod, Zeroable, Debug, PartialEq)]
#[repr(C)]
pub(crate) struct Triangle {
    pub(crate) corners: Corners,
    pub(crate) id: u32,
}

/// A triangle of the input with at least one coordinate that is not an `f32`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct WideTriangle {
    pub(crate) corners: [[f64; 3]; 3],
    pub(crate) id: u32,
    pub(crate) spare: u32,
}

/// Triangles that can be read part by part, any number of times.
pub(crate) trait Triangles: Sync {
    /// Returns the number of parts.
    fn parts(&self) -> usize;
    /// Returns the triangles of a part.
    fn part(&self, number: usize) -> Result<Batch<'_>, BakeError>;
    /// Whether batches have the vertices behind their triangles.
    fn are_exact(&self) -> bool;
}
