//! Helpers that the tests of several crates share: meshes, files of any content, random numbers and the depth of
//! searches.
//!
//! Nothing here depends on bvh-bake or bvh-query, so that every crate of the workspace can use it in its tests.
//! Meshes are therefore plain arrays. The unit tests of bvh-format link a second build of bvh-format through this crate, so
//! they can use only functions without types of bvh-format. This crate is not published, and published crates leave it
//! out, so their tests run in this repository only.

pub mod ball;
pub mod damage;
pub mod depth;
pub mod exact;
pub mod forge;
pub mod here;
pub mod loosen;
pub mod random;
pub mod seal;
pub mod skip;
pub mod stored;

pub use here::{Pool, folder, pool};
pub use random::Random;
pub use skip::skip;
pub use tempfile::TempDir;

/// The three corners of a triangle, in mesh units.
pub type Triangle = [[f64; 3]; 3];

/// Compiles the examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Compiles the Rust blocks of the book. `spec/book/check.py` checks those of other languages.
#[cfg(doctest)]
#[doc = include_str!("../../../spec/book/src/start/rust.md")]
#[doc = include_str!("../../../spec/book/src/guide/baking.md")]
#[doc = include_str!("../../../spec/book/src/guide/points-and-rays.md")]
#[doc = include_str!("../../../spec/book/src/guide/shapes.md")]
#[doc = include_str!("../../../spec/book/src/guide/motions.md")]
#[doc = include_str!("../../../spec/book/src/guide/scenes.md")]
struct Book;
