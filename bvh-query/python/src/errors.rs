//! Errors of the libraries as exceptions with the same messages.

use bvh_bake::ReadError;
use bvh_query::{MotionError, OpenError, PoseError, QueryError};
use pyo3::create_exception;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use std::path::Path;

create_exception!(cbvh, FormatError, PyValueError, "A file is not a valid .cbvh file, or is damaged.");
create_exception!(cbvh, BakeError, PyValueError, "A mesh cannot be baked.");

/// The exception of a file that cannot be opened. An error of the system keeps its class, such as `FileNotFoundError`.
pub(crate) fn open_error(error: OpenError) -> PyErr {
    let message = error.to_string();
    match error {
        OpenError::Io { path, source } => system_error(&path, &source, message),
        _ => FormatError::new_err(message),
    }
}

/// The exception of what the system refuses, such as `FileNotFoundError`.
fn system_error(path: &Path, source: &std::io::Error, message: String) -> PyErr {
    match source.raw_os_error() {
        // With its number, `OSError` picks the class.
        Some(number) => {
            let text = Python::attach(|py| py.import("os")?.call_method1("strerror", (number,))?.extract());
            let text: String = text.unwrap_or(message);
            PyOSError::new_err((number, text, path.as_os_str().to_owned()))
        }
        None => PyOSError::new_err(message),
    }
}

/// The exception of a question that has no answer.
pub(crate) fn query_error(error: QueryError) -> PyErr {
    match error {
        QueryError::Damaged(_) => FormatError::new_err(error.to_string()),
        QueryError::File { .. } => PyOSError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// The exception of a matrix that is not a pose.
pub(crate) fn pose_error(place: &str, error: PoseError) -> PyErr {
    PyValueError::new_err(format!("{place}: {error}"))
}

/// The exception of a mesh that cannot be baked, or of a file that the system refuses.
pub(crate) fn bake_error(error: bvh_bake::BakeError) -> PyErr {
    use bvh_bake::BakeError as Error;
    let message = error.to_string();
    match &error {
        Error::Read(ReadError::Io { path, source })
        | Error::Write { path, source, .. }
        | Error::Scratch { directory: path, source, .. } => system_error(path, source, message),
        _ => BakeError::new_err(message),
    }
}

/// The exception of poses or numbers that make no motion.
pub(crate) fn path_error(place: &str, error: &MotionError) -> PyErr {
    PyValueError::new_err(format!("{place}: {error}"))
}
