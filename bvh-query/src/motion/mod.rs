//! Motions of B in A's frame: the paths that questions about the way between two poses take.

mod linear;
mod path;
mod relative;

pub use path::{Motion, MotionError, Polyline, RigidPath};
pub use relative::RelativePath;
