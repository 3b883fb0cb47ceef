//! How deep shapes overlap: the ways on which they come free, and how far they have to go at least.

pub(super) mod balls;
pub(crate) mod clash;
mod convex;
mod free;
mod leaving;
pub(crate) mod options;
pub(crate) mod penetration;
mod pieces;
mod planes;
mod polytope;
pub(crate) mod signed_distance;
mod translation;
