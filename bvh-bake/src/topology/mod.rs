//! Finds out, during a bake, whether objects are closed, and a triangle of each of their components.
//!
//! An object is closed if its triangles, each counted as often as its net says, traverse every edge as often in one
//! direction as in the other. Edges are counted in three steps, each of which passes on only those that do not cancel:
//! in runs of a few hundred neighbouring triangles (`brick`), in a brick, and in the object (`joined`). The same steps
//! join triangles that share an edge into parts, and parts into components.
//!
//! An edge that cancels in one step is dropped, even if triangles elsewhere also have it. Surfaces that meet along such
//! an edge may therefore stay two components. An edge that does not cancel in a brick is passed on only if another
//! brick's box contains it. Only edges between bricks therefore reach the last step, where they are sorted, in files if
//! need be.
//!
//! Triangles count once in their bricks. Duplicates add to this, or take away if their orientation is the opposite.
//! These differences are counted separately (`nets`), as additional edges.

mod brick;
mod edge;
mod joined;
mod nets;

pub(crate) use brick::{BrickTopology, Survey};
pub(crate) use edge::{End, ends};
pub(crate) use joined::{ObjectTopology, Rest, TopologyLists, join};
pub(crate) use nets::{MAX_NET, Nets};

/// An object has at least this many triangles for each component listed, unless it has at most [`MAX_FEW_PARTS`].
const TRIANGLES_PER_PART: u64 = 100;
/// This many parts are listed however few triangles they have.
pub(crate) const MAX_FEW_PARTS: u64 = 64;

/// Returns the most parts that an object may have to get a list of components. A soup of loose triangles would need
/// four bytes for each of them.
fn max_parts(triangles: u64) -> u64 {
    (triangles / TRIANGLES_PER_PART).max(MAX_FEW_PARTS)
}
