//! Bakes triangle meshes into `.cbvh` files: bounding volume hierarchies of compressed k-DOPs, which the crate `bvh-query`
//! maps and queries for collisions and distances.
//!
//! A mesh is baked once, ahead of time: by a tool, in a build script or in memory. The result is a file that needs no
//! unpacking and no building when it is opened.
//!
//! # Usage
//!
//! [`FileBake`] bakes mesh files (OBJ, STL, PLY, glTF, COLLADA, XYZ, PCD) of any size within a memory budget, [`to_bytes`] bakes a
//! [`Mesh`](mesh::Mesh) in memory, and [`build_rs::bake`] bakes a mesh of the source tree from a build script.
//! [`Options`] lists the choices; the defaults suit most meshes. [`Options::stop`] lets a flag or a time end a bake.
//!
//! ```
//! use bvh_bake::{Effort, Options, mesh::Mesh, to_bytes};
//!
//! # fn main() -> Result<(), bvh_bake::BakeError> {
//! let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let mesh = Mesh::from_triangles(corners, vec![[0, 1, 2]]);
//! let (bytes, report) = to_bytes(&mesh, &Options::default().effort(Effort::Quick))?;
//! println!("{} triangle in {} bytes", report.file.triangles, bytes.len());
//! # Ok(())
//! # }
//! ```
//!
//! The folder `examples` has a program to copy: `bake` bakes mesh files and prints the results.
//!
//! [`verify`] and [`verify_files`] compare a file with its mesh, and [`validate_in_parallel`] checks a file alone. [`open_edges`] tells
//! why objects are open, and [`Options::weld`] closes cracks.
//!
//! # How a bake works
//!
//! | step | what happens |
//! |---|---|
//! | read | one reader per format returns triangles piece by piece; the triangles of a mesh in memory are taken from it |
//! | prepare | coordinates are placed around an origin, duplicates are found, the layout is chosen |
//! | build | a tree over bricks of at most 2^18 triangles, built side by side, and the pages of each |
//! | assemble | pages get their numbers, and the file its sections and checksums |
//! | prove | the finished bytes are validated, and every bound is checked against its triangles |
//! | write | the file is synchronised and gets its name, so that it is written completely or not at all |
//!
//! All data between the steps are stored in pieces, in memory or, with a memory budget, also in scratch files. The
//! bytes of the output depend neither on the budget nor on the number of threads.
//!
//! # Guarantees
//!
//! No input makes a bake panic: every error names the file, the place, what was expected and what was found. Equal
//! meshes and options give equal bytes. A vertex of the file is the `f64` number that was given. It moves only if an option
//! says so ([`Options::weld`], [`Options::round`], quantised triangles), or to the nearest multiple of 2^-180 if a coordinate is
//! below 2^-128 in magnitude. The file states by how far.
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]

mod bake;
pub mod build_rs;
mod check;
mod error;
pub mod input;
mod limits;
mod options;
mod pages;
mod prepare;
mod progress;
pub mod shapes;
mod storage;
mod threads;
mod topology;
mod tree;
mod triangles;

pub use bake::files::{FileBake, Outcome, least_memory};
pub use bake::provenance::generator;
pub use bake::report::{BakeReport, FileSummary};
pub use bake::{to_bytes, to_bytes_with};
pub use bvh_format::leaf::TriangleEncoding;
pub use bvh_format::object::MAX_RADIUS;
pub use bvh_format::open_edges::{EdgesOfKind, Gaps, OpenEdge, OpenEdges};
pub use bvh_format::profile::Profile;
pub use bvh_format::source::Source;
pub use bvh_format::{FormatError, Layout, Stop};
pub use check::open_edges::open_edges;
pub use check::prove::{prove_bounds, validate_in_parallel};
pub use check::verify::{VerifyError, VerifyOptions, VerifyReport, verify, verify_files};
pub use error::{BakeError, InputError, LimitError, Place, ReadError, ShapeError};
pub use input::{MeshFormat, mesh, read_meshes};
pub use options::{Effort, Options, Rounding};
pub use progress::{Progress, Stage, Step, Traffic};
pub use storage::atomic::{discard_unfinished, write_atomically, write_atomically_with};
pub use storage::stored_file::{FileError, StoredFile};

/// Compiles the examples of the crate's README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
