//! Exact collision and distance queries between triangle meshes.
//!
//! A mesh is baked once into a `.cbvh` file, in memory or on disk. [`Bvh`] opens such a file, [`Pose`] places one mesh in
//! the frame of another, and a [`Querier`] answers. This crate has no code of its own: it re-exports the libraries of the
//! project under one name.
//!
//! | path | crate | feature | what it has |
//! |---|---|---|---|
//! | `cbvh` | `bvh-query` | | meshes, poses, scenes, motions, and all queries |
//! | `cbvh::bake` | `bvh-bake` | `bake`, by default | readers of mesh files, and bakes |
//! | `cbvh::robot` | `cbvh-robot` | `robot` | robots from URDF files |
//! | `cbvh::view` | `cbvh-view` | `view` | HTML pages that show meshes |
//! | `cbvh::format` | `bvh-format` | | the bytes of a file |
//!
//! The types are those of the crates, so a program may use this crate beside libraries that use the crates. The feature
//! `parallel`, on by default, adds rayon: bakes, batches and scenes then use all cores. The feature `mint` makes poses from
//! the matrices and quaternions of other crates, and `serde` serialises poses and answers. An application that only opens baked files needs no features:
//! `default-features = false`.
//!
//! The command `cbvh` is in the package `cbvh-cli`.
//!
//! # Examples
//! Two meshes are baked in memory and queried. The program `examples/start.rs` does the same with mesh files.
//!
#![cfg_attr(feature = "bake", doc = "```")]
#![cfg_attr(not(feature = "bake"), doc = "```ignore")]
//! use cbvh::bake::{Options, mesh::Mesh, shapes, to_bytes};
//! use cbvh::{Bvh, Pose, Querier};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let triangle = Mesh::from_triangles(corners, vec![[0, 1, 2]]);
//! let (triangle, _report) = to_bytes(&triangle, &Options::default())?;
//! let (block, _report) = to_bytes(&shapes::block([2.0, 2.0, 2.0])?, &Options::default())?;
//! let (triangle, block) = (Bvh::from_bytes(triangle)?, Bvh::from_bytes(block)?);
//!
//! let mut querier = Querier::new()?; // working memory: one per thread
//! // The pose of the triangle in the frame of the block, whose top is at 1.
//! let above = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 1.5])?;
//! assert!(!querier.collide(&block, &triangle, &above)?);
//! assert_eq!(querier.distance(&block, &triangle, &above)?.distance, 0.5);
//! assert!(querier.collide(&block, &triangle, &Pose::IDENTITY)?); // two corners of the triangle are on faces of the block
//! # Ok(())
//! # }
//! ```
//!
//! # Debug builds
//! Without optimisation, queries and bakes take about a hundred times as long. These lines in the `Cargo.toml` of a workspace
//! leave your own code as it is:
//!
//! ```toml
//! [profile.dev.package]
//! bvh-query.opt-level = 3
//! bvh-bake.opt-level = 3
//! bvh-format.opt-level = 3
//! ```
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]

#[cfg(feature = "bake")]
#[doc(no_inline)]
pub use bvh_bake as bake;
#[doc(no_inline)]
pub use bvh_format as format;
#[doc(inline)]
pub use bvh_query::*;
#[cfg(feature = "robot")]
#[doc(no_inline)]
pub use cbvh_robot as robot;
#[cfg(feature = "view")]
#[doc(no_inline)]
pub use cbvh_view as view;

/// Compiles the examples of the crate's README.
#[cfg(all(doctest, feature = "bake"))]
#[doc = include_str!("../README.md")]
struct Readme;
