//! Exact collision and distance queries between `.cbvh` meshes.
//!
//! [`Bvh`] opens a file (mapped, read, from memory, or embedded with [`include_cbvh!`]), [`Pose`] places one
//! mesh in the frame of another, and a [`Querier`] answers:
//!
//! | question | method | answer |
//! |---|---|---|
//! | do they touch? | [`Querier::collide`] | `bool`, exact |
//! | which triangles touch? | [`Querier::contacts`], [`Querier::visit_contacts`] | pairs of triangle ids, exact |
//! | how far apart? | [`Querier::distance`] | distance, both closest points, both triangle ids |
//! | nearer than d? | [`Querier::within`] | `bool` |
//!
//! [`Tracker`] asks the same questions about poses that follow a path, for less, and [`Batch`] about many poses on all
//! cores. The feature `parallel`, on by default, brings the latter and the dependency on rayon.
//!
//! A query walks both trees together. Nodes and triangles are filtered in `f32`, 16 pairs at a time, by
//! AVX-512, AVX2 or portable code; what the filters cannot decide goes to `f64` and exact predicates.
//! So answers are bit-identical on every backend and in every order of queries.
//!
//! ```
//! use bvh_query::{Bvh, Pose, Querier};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
//! let (bytes, _) = bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?;
//! let triangle = Bvh::from_bytes(bytes)?;
//!
//! let mut querier = Querier::new()?;
//! let above = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 0.5])?;
//! assert!(!querier.collide(&triangle, &triangle, &above)?);
//! assert_eq!(querier.distance(&triangle, &triangle, &above)?.distance, 0.5);
//! assert!(querier.collide(&triangle, &triangle, &Pose::IDENTITY)?);
//! # Ok(())
//! # }
//! ```
#![deny(unsafe_code)]

mod bvh;
mod error;
mod isa;
mod leaf;
#[allow(unsafe_code, reason = "mapping a file is a promise about the file that no type can hold")]
mod mapped;
mod narrow;
mod pose;
mod query;
mod traverse;

pub use bvh::{Bvh, Shape};
pub use error::{OpenError, QueryError};
pub use isa::{Backend, BackendError};
pub use mapped::ReadAhead;
pub use pose::{Pose, PoseError};
#[cfg(feature = "parallel")]
pub use query::batch::Batch;
pub use query::tracker::Tracker;
pub use query::{Contact, Distance, DistanceOptions, Querier, QueryStats};

/// The examples of the README, compiled.
#[cfg(all(doctest, feature = "parallel"))]
#[doc = include_str!("../../README.md")]
struct Readme;

/// Embeds a `.cbvh` file into the program and opens it: `Result<Bvh, FormatError>`.
///
/// The path is as for `include_bytes!`; with a file that a build script baked, it is
/// `concat!(env!("OUT_DIR"), "/name.cbvh")`. Nothing is copied, and any alignment will do.
#[macro_export]
macro_rules! include_cbvh {
    ($path:expr $(,)?) => {
        $crate::Bvh::from_static(::core::include_bytes!($path))
    };
}

pub use bvh_format::{FormatError, Rule};
