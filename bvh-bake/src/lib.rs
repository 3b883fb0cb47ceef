//! Bakes triangle meshes into `.cbvh` files.
#![forbid(unsafe_code)]

mod ablation;
mod arena;
mod assemble;
mod auto;
mod bake;
mod build;
pub mod build_rs;
mod encode;
mod error;
mod files;
pub mod io;
pub mod mesh;
mod options;
mod pages;
mod prepare;
mod prove;
mod report;
mod summary;
mod treelets;
mod verify;

#[doc(hidden)]
pub use ablation::{Ablation, PageOrder, SplitRule};
pub use bake::{Stage, to_bytes, to_bytes_with};
pub use error::BakeError;
pub use files::{FileOptions, Outcome, Step, bake_files, estimate_memory, read_meshes, write_atomically};
pub use options::{Effort, Options};
pub use prove::{prove_bounds, validate_in_parallel};
pub use report::BakeReport;
pub use summary::FileSummary;
pub use verify::{VerifyError, VerifyReport, verify};
