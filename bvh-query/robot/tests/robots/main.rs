//! Robots: where their links stand, what they answer, and what is refused.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod bodies;
mod capsules;
mod files;
mod kinematics;
mod meshes;
mod misuse;
mod near_pairs;
mod parts;
mod questions;
#[cfg(feature = "serde")]
mod serialised;
mod stop;
mod tree;
mod turns;
mod uris;
mod warnings;
mod worlds;
mod xml;
