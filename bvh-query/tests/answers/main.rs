//! One question about meshes in a pose, against brute force in exact arithmetic: the first tests to read.

#[path = "../common/mod.rs"]
mod common;

mod exact;
mod numbers;
mod numerics;
mod oracle;
mod poses;
mod self_contacts;
#[cfg(feature = "serde")]
mod serialised;
mod triangles;
mod turning;
