//! Motions of B in A's frame: the paths for questions about motions.

mod linear;
mod path;
mod relative;

pub use path::{Motion, PathError, Polyline, RigidPath};
pub use relative::RelativePath;
