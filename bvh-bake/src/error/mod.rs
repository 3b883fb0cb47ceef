//! The errors of a bake, by cause: the input, the system, a limit, or the baker.

mod mesh;
mod read;
mod shape;

pub use mesh::InputError;
pub(crate) use read::{Fault, Halt, excerpt, quoted, sentence};
pub use read::{Place, ReadError};
pub use shape::ShapeError;

use bvh_format::FormatError;
use bvh_format::open_edges::OpenEdges;
use std::path::PathBuf;

/// The reason why a bake failed. The output's name still has its old content, if it had any.
///
/// ```
/// use bvh_bake::{BakeError, FileBake, Options, shapes, to_bytes};
///
/// let missing = FileBake::new(["nowhere.obj"], "nowhere.cbvh").run();
/// assert!(matches!(missing, Err(BakeError::Read(_))));
/// let sheet = bvh_bake::mesh::Mesh::from_triangles(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// let Err(BakeError::NotClosed { edges, .. }) = to_bytes(&sheet, &Options::default().solid(true)) else { panic!() };
/// assert_eq!(edges.count(), 3);
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The input file could not be read or is not a valid mesh.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The mesh breaks the input contract.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The operating system refused to write the output.
    #[error("{}: cannot {action}: {source}", path.display())]
    Write {
        /// The output.
        path: PathBuf,
        /// The operation that failed.
        action: &'static str,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The operating system refused to create, write or read scratch files.
    #[error(
        "{}: cannot {action}: {source}; free room there, or name another directory for scratch files",
        directory.display()
    )]
    Scratch {
        /// The directory.
        directory: PathBuf,
        /// The operation that failed.
        action: &'static str,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The output is one of the inputs, and baking would destroy it.
    #[error("{}: expected an output other than the inputs, found an input", path.display())]
    OutputIsInput {
        /// The output.
        path: PathBuf,
    },
    /// The bake needs more memory than it may use, even with scratch files.
    #[error(
        "{}: expected a mesh that bakes in at most {budget} bytes of memory, found {} that takes at least \
         {needed}; raise the memory budget", input.display(), counted(*triangles)
    )]
    Memory {
        /// The first input.
        input: PathBuf,
        /// The number of triangles of all inputs, or 0 if none has been read.
        triangles: u64,
        /// The bytes that the bake needs.
        needed: u64,
        /// The bytes that it may use.
        budget: u64,
    },
    /// The allowed error of quantisation is no length, or too large for an object: most of its triangles would collapse.
    #[error(
        "{}expected a max error from 0 to {limit:.2e}, a hundredth of the diagonal {diagonal:.2e} of the object's box, \
         found {allowed:e}; a larger one would collapse most triangles",
        of_object(object)
    )]
    MaxError {
        /// The object's name, shortened; empty if it has none.
        object: String,
        /// The allowed error, in mesh units.
        allowed: f64,
        /// The largest error for this object, in mesh units.
        limit: f64,
        /// The diagonal of the object's box, in mesh units.
        diagonal: f64,
    },
    /// The distance within which vertices should be welded is no length, or exceeds an object.
    #[error(
        "{}expected a weld distance from 0 to {}, found {found:e}; weld within a little more than the widest crack, which \
         a bake without it states",
        of_object(object), diagonal_of_box(*diagonal)
    )]
    Weld {
        /// The object's name, shortened; empty if it has none, or if the distance is no length.
        object: String,
        /// The distance, in mesh units.
        found: f64,
        /// The diagonal of the object's box, in mesh units; `None` if the distance is no length.
        diagonal: Option<f64>,
    },
    /// The radius of the objects is no length, or too large.
    #[error("expected a radius from 0 to 2^118, found {0:e}")]
    Radius(f64),
    /// An object that is to be solid has no inside.
    #[error(
        "{}expected a closed surface, which a solid needs, found an open one: {edges}; close it, or leave it hollow",
        of_object(object)
    )]
    NotClosed {
        /// The object's name, shortened; empty if it has none.
        object: String,
        /// Its open edges.
        edges: Box<OpenEdges>,
    },
    /// There is too little room for scratch files and the output.
    #[error("{}: expected room for {needed} bytes of scratch files and output, found {found}", directory.display())]
    Room {
        /// The directory.
        directory: PathBuf,
        /// The bytes that the files take.
        needed: u64,
        /// The bytes that are free.
        found: u64,
    },
    /// [`Options::stop`](crate::Options::stop) was set before the bake was done.
    #[error("expected time for the bake, found it stopped: its flag is set, or its time is over")]
    Stopped,
    /// The function for build scripts was called outside a build script.
    #[error("expected the environment variable OUT_DIR of a build script, found none")]
    NoOutDir,
    /// The mesh exceeds a limit of the format.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// The output failed its own proof. This is a defect of the baker, never of the input.
    #[error("the baked bytes fail their proof, please report this: {0}")]
    Unproved(#[from] FormatError),
}

/// The limit of the format that a mesh exceeds.
///
/// No mesh of ordinary size comes near these limits:
///
/// ```
/// use bvh_bake::{BakeError, LimitError};
///
/// let error = BakeError::from(LimitError::Pages);
/// assert_eq!(error.to_string(), "the mesh needs more than 2^26 pages");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LimitError {
    /// The pages of all objects together.
    #[error("the mesh needs more than 2^26 pages")]
    Pages,
    /// The leaf packets of one object.
    #[error("the mesh needs more than 2^30 leaf packets")]
    Packets,
    /// Equal triangles, less those of the opposite orientation.
    #[error("the mesh needs more than 2^31 equal triangles")]
    EqualTriangles,
}

fn of_object(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!("object \"{name}\": ") }
}

fn diagonal_of_box(diagonal: Option<f64>) -> String {
    let diagonal = diagonal.map_or(String::new(), |diagonal| format!(" {diagonal:.2e}"));
    format!("the diagonal{diagonal} of the object's box")
}

fn counted(triangles: u64) -> String {
    match triangles {
        0 => "a file".to_owned(),
        1 => "1 triangle".to_owned(),
        _ => format!("{triangles} triangles"),
    }
}
