//! Robots from URDF files: exact collision queries, distances and certified motions in joint space.
//!
//! ```text
//! URDF (urdf) ──> kinematic tree (model) ─┐
//!      meshes and primitives (shapes) ────┼──> bodies, and pairs that are asked about (robot)
//! SRDF (srdf) ──> allowed pairs, groups ──┘        │
//!                                                  ├──> queries about configurations (questions, asker, rod)
//!                                                  ├──> pairs that are near, with derivatives (near_pairs)
//!                                                  ├──> motions, certain at every moment (motions, pair_path, edge, turns),
//!                                                  │      most of them by balls (screening, screen, cover, moments, states,
//!                                                  │      clearances, around)
//!                                                  ├──> plain data, and back (parts)
//!                                                  └──> what programs draw (tree)
//! ```
//!
//! See [`Robot`] for an example. The feature `serde` serialises answers. Use `bvh_query::Scene` for bodies that no joints connect.

mod around;
mod asker;
mod balls;
mod capsules;
mod clearances;
mod cover;
mod edge;
mod error;
mod frame;
mod lanes;
mod mimic;
mod model;
mod moments;
mod motions;
mod near_pairs;
mod options;
mod packages;
mod pair_path;
mod parts;
mod questions;
mod robot;
mod rod;
mod rod_of;
mod schema;
mod screen;
mod screening;
mod setting;
mod shapes;
mod source;
mod srdf;
mod states;
#[cfg(test)]
mod testing;
mod tree;
mod turns;
mod urdf;
mod xml;

pub use bvh_bake::input::UpAxis;
pub use edge::Edge;
pub use error::RobotError;
pub use motions::RobotMotion;
pub use near_pairs::NearPair;
pub use options::{Base, Geometry, RobotOptions};
pub use parts::{OtherBody, RobotParts};
pub use questions::{RobotDistance, RobotSignedDistance};
pub use robot::Robot;
pub use srdf::{Group, State};
pub use tree::{JointKind, RobotTree, TreeJoint, TreeShape};

/// Compiles the example of the crate's README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
