//! Motions of B in A's frame: the paths that questions about the way between two poses take.

mod path;

pub use path::{Motion, MotionError, Path, Polyline};
