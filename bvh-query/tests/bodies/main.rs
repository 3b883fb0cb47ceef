//! Meshes as bodies: points and lines about them, what is inside, radii around them, how deep they overlap, and where they
//! touch.

#[path = "../common/mod.rs"]
mod common;

mod depth;
mod intersection;
mod patches;
mod probes;
mod rounded;
