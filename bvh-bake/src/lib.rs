//! Bakes triangle meshes into `.cbvh` files.
#![forbid(unsafe_code)]

mod auto;
mod bake;
mod build;
mod encode;
mod error;
pub mod io;
pub mod mesh;
mod options;
mod pages;
mod prepare;
mod prove;
mod report;
mod treelets;

pub use bake::{Stage, to_bytes, to_bytes_with};
pub use error::BakeError;
pub use options::Options;
pub use prove::prove_bounds;
pub use report::BakeReport;
