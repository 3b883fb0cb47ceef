//! What can go wrong when a file is opened and when a question is asked.

use crate::isa::BackendError;
use crate::pose::PoseError;
use bvh_format::FormatError;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The system refused the file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file is not a valid `.cbvh` file.
    #[error("{}: {source}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The rule that is broken, and where.
        source: FormatError,
    },
}

impl OpenError {
    pub(crate) fn io(path: &Path, source: io::Error) -> Self {
        Self::Io { path: path.to_owned(), source }
    }

    pub(crate) fn format(path: &Path, source: FormatError) -> Self {
        Self::Format { path: path.to_owned(), source }
    }
}

/// Why a query has no answer. Geometry is never the reason: it is a damaged file, a budget, a missing backend or a number
/// that means nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QueryError {
    /// A page that the query touched breaks a rule of the format.
    #[error(transparent)]
    Damaged(#[from] FormatError),
    /// The query needs more visits than [`crate::Querier::set_budget`] allows. Nothing is known of its answer.
    #[error("expected an answer within {visits} visits, found more to visit; raise the budget")]
    Budget {
        /// The budget.
        visits: u64,
    },
    /// A number given with the question means nothing, such as a distance of NaN.
    #[error("{name}: expected {expected}, found {found}")]
    Number {
        /// The parameter.
        name: &'static str,
        /// The numbers that are allowed.
        expected: &'static str,
        /// The number given.
        found: f64,
    },
    /// Two poses have no relative pose.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// A file that is opened at first need is not there, or has changed since its header was read.
    #[error("{}: expected the file as it was when it was added, found {found}; bring it back, or add what is there now", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What became of it.
        found: String,
    },
    /// The file does not state which of its objects are closed.
    #[error("this file does not say which objects are closed; bake it again with topology")]
    NoTopology,
    /// The backend asked for is not available.
    #[error(transparent)]
    Backend(#[from] BackendError),
}
