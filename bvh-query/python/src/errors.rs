//! Errors of the libraries as exceptions with the same messages.

use bvh_bake::ReadError;
use bvh_query::{BackendError, OpenError, QueryError};
use pyo3::create_exception;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::fmt::Display;
use std::path::Path;

create_exception!(cbvh, FormatError, PyValueError, "A file is not a valid .cbvh file, or is damaged.");
create_exception!(cbvh, BakeError, PyValueError, "A mesh cannot be baked.");
create_exception!(
    cbvh,
    StoppedError,
    PyRuntimeError,
    "A query was stopped before it had an answer, or a bake before it was done: see Stop."
);

/// The exception of a file that cannot be opened. An error of the system keeps its class, such as `FileNotFoundError`.
pub(crate) fn open_error(error: OpenError) -> PyErr {
    let message = error.to_string();
    match error {
        OpenError::Io { path, source } => system_error(&path, &source, message),
        _ => FormatError::new_err(message),
    }
}

/// The exception of what the system refuses, such as `FileNotFoundError`.
pub(crate) fn system_error(path: &Path, source: &std::io::Error, message: String) -> PyErr {
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
    question_error(&error, error.to_string())
}

/// The exception of a question that has no answer, with a message that says more.
pub(crate) fn question_error(error: &QueryError, message: String) -> PyErr {
    match error {
        QueryError::Damaged(_) => FormatError::new_err(message),
        QueryError::File { .. } => PyOSError::new_err(message),
        QueryError::Stopped => StoppedError::new_err("expected time for an answer, found the query stopped"),
        _ => PyValueError::new_err(message),
    }
}

/// The exception of a backend that `CBVH_ISA` names and that is not there.
pub(crate) fn backend_error(error: BackendError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The exception of a mesh that cannot be baked, or of a file that the system refuses.
pub(crate) fn bake_error(error: bvh_bake::BakeError) -> PyErr {
    use bvh_bake::BakeError as Error;
    let message = error.to_string();
    match &error {
        Error::Read(ReadError::Io { path, source })
        | Error::Write { path, source, .. }
        | Error::Scratch { directory: path, source, .. } => system_error(path, source, message),
        Error::Stopped => StoppedError::new_err("expected time for the bake, found it stopped"),
        _ => BakeError::new_err(message),
    }
}

/// The exception of numbers that make no pose, or of poses or numbers that make no path.
pub(crate) fn value_error(place: &str, error: impl Display) -> PyErr {
    PyValueError::new_err(format!("{place}: {error}"))
}
