//! Questions about points, rays and segments. Each is a visitor of the walk of one tree.

#[cfg(feature = "parallel")]
pub(crate) mod batch;
pub(crate) mod closest;
mod line;
pub(crate) mod placed;
mod point;
pub(crate) mod ray;
mod segment;
