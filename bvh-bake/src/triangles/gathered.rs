//! An object of the input as the bake receives it: its triangles, its origin, and what is known of its vertices.

use super::TriangleStream;
use super::placement::Moved;

/// An object of the input, ready to be baked.
pub(crate) struct Gathered {
    pub(crate) name: String,
    pub(crate) origin: [f64; 3],
    pub(crate) stream: TriangleStream,
    /// The largest distances by which vertices moved, as far as they have been measured.
    pub(crate) moved: Moved,
    /// The number of distinct vertices that the input's triangles refer to.
    pub(crate) vertices: u64,
}
