//! Questions about points, rays and segments. Each is a visitor of the walk of one tree.

pub(in crate::query) mod bounded;
pub(crate) mod closest;
pub(crate) mod line;
mod line_walks;
pub(in crate::query) mod near;
pub(crate) mod placed;
pub(crate) mod point;
#[cfg(feature = "parallel")]
pub(crate) mod probe_batch;
pub(crate) mod ray;
pub(crate) mod relation;
pub(crate) mod segment;
pub(crate) mod side;
mod stays;
