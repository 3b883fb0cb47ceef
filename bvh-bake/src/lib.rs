//! Bakes triangle meshes into `.cbvh` files.
#![forbid(unsafe_code)]

mod ablation;
mod arena;
mod assemble;
mod auto;
mod bake;
mod brick;
mod build;
pub mod build_rs;
mod draft;
mod duplicates;
mod encode;
mod error;
mod files;
mod gather;
pub mod io;
mod means;
pub mod mesh;
mod options;
mod pages;
mod placement;
mod prepare;
mod progress;
mod prove;
mod report;
mod scratch;
mod sorter;
mod soup;
mod stored;
mod summary;
mod target;
mod treelets;
mod verify;

#[doc(hidden)]
pub use ablation::{Ablation, PageOrder, SplitRule};
pub use bake::{Stage, to_bytes, to_bytes_with};
pub use error::BakeError;
pub use files::{
    FileOptions, Outcome, bake_files, discard_unfinished, least_memory, read_meshes, write_atomically,
};
pub use options::{Effort, Options};
pub use progress::{Progress, Step, Traffic};
pub use prove::{prove_bounds, validate_in_parallel};
pub use report::BakeReport;
pub use stored::{FileError, StoredFile};
pub use summary::FileSummary;
pub use verify::{VerifyError, VerifyOptions, VerifyReport, verify, verify_files};
