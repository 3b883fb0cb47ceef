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
    /// The mesh outgrows the format or the limits given.
    #[error("the mesh needs more than {0}")]
    Limit(String),
    /// The result failed its own proof: a defect of the baker, never of the input.
    #[error("the baked bytes fail their proof, please report this: {0}")]
    Unproved(FormatError),
}
