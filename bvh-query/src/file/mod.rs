//! Opened files: their bytes, which parts have been checked, and what queries read from them.

pub(crate) mod bvh;
mod convex;
pub(crate) mod files;
#[allow(unsafe_code, reason = "mapping a file is a promise about the file that no type can hold")]
pub(crate) mod mapped;
mod memory;
mod open_edges;
pub(crate) mod owned_shape;
pub(crate) mod place;
pub(crate) mod ray_tree;
pub(crate) mod shape;
pub(crate) mod topology;
mod triangles;
pub(crate) mod unpack;
