//! Motions of B in A's frame: the paths for questions about motions.

mod attached;
mod linear;
mod path;
mod polyline;
mod relative;

pub(crate) use attached::{AttachedPath, TogetherPath};
pub use path::{Motion, RigidPath};
pub use polyline::Polyline;
pub use relative::RelativePath;
