//! What can go wrong when baking, sorted by whose fault it is.

use crate::io::ReadError;
use crate::mesh::InputError;
use bvh_format::FormatError;
use std::path::PathBuf;

/// A bake that did not happen. Nothing is left under the output's name.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// The input file could not be read or is not a valid mesh.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The mesh breaks the input contract.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The system refused to write the output.
    #[error("{}: cannot {action}: {source}", path.display())]
    Write {
        /// The output.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The output is one of the inputs; baking would destroy it.
    #[error("{}: expected an output other than the inputs, found an input", path.display())]
    OutputIsInput {
        /// The output.
        path: PathBuf,
    },
    /// The bake needs more memory than it may use, whatever goes to scratch files.
    #[error(
        "{}: expected a mesh that bakes in at most {budget} bytes of memory, found {} that takes at least \
         {needed}", input.display(), counted(*triangles)
    )]
    Memory {
        /// The first input.
        input: PathBuf,
        /// Its triangles and those of the other inputs; 0 if they were not even read.
        triangles: u64,
        /// Bytes that a bake needs.
        needed: u64,
        /// Bytes that it may use.
        budget: u64,
    },
    /// There is too little room for scratch files and the output.
    #[error("{}: expected room for {needed} bytes of scratch files and output, found {found}", directory.display())]
    Room {
        /// Where they go.
        directory: PathBuf,
        /// Bytes that they take.
        needed: u64,
        /// Bytes that are free.
        found: u64,
    },
    /// A build script's function was called outside a build script.
    #[error("expected the environment variable OUT_DIR of a build script, found none")]
    NoOutDir,
    /// The mesh outgrows the format or the limits given.
    #[error("the mesh needs more than {0}")]
    Limit(String),
    /// The result failed its own proof: a defect of the baker, never of the input.
    #[error("the baked bytes fail their proof, please report this: {0}")]
    Unproved(#[from] FormatError),
}

fn counted(triangles: u64) -> String {
    match triangles {
        0 => "a file".to_owned(),
        1 => "1 triangle".to_owned(),
        _ => format!("{triangles} triangles"),
    }
}
