//! What can go wrong when opening and asking.

use crate::isa::BackendError;
use bvh_format::FormatError;
use std::io;
use std::path::{Path, PathBuf};

/// A file that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The system refused the file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is not a valid `.cbvh` file.
    #[error("{}: {source}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The rule broken, and where.
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

/// A query that has no answer. Never from geometry: only a damaged file, a budget or a missing backend.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum QueryError {
    /// A page that the query touched breaks the format.
    #[error(transparent)]
    Damaged(#[from] FormatError),
    /// The query needs more than [`crate::Querier::set_budget`] allows; nothing is known of its answer.
    #[error("expected an answer within {visits} visits, found more to visit")]
    Budget {
        /// The budget.
        visits: u64,
    },
    /// The backend asked for cannot be had.
    #[error(transparent)]
    Backend(#[from] BackendError),
}
