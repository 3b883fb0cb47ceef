//! Helpers that the tests of several crates share: meshes, files of any content, random numbers and the depth of
//! searches.
//!
//! Nothing here depends on bvh-bake or bvh-query, so that every crate of the workspace can use it in its tests.
//! Meshes are therefore plain arrays. The unit tests within `src` of a published crate do not use this crate, because
//! it is not published and a packaged crate must be able to test itself.

pub mod ball;
pub mod depth;
pub mod forge;
pub mod hard_cases;
pub mod loosen;
pub mod random;
pub mod seal;

pub use random::Random;

/// The three corners of a triangle, in mesh units.
pub type Triangle = [[f64; 3]; 3];

/// Compiles the examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
