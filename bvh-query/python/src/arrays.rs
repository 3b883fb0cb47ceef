//! Reads arrays of numbers, and makes arrays of answers.
//!
//! Everything is copied while Python's lock is held: another thread may change an array while a question runs.

use crate::errors::pose_error;
use bvh_query::Pose;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Reads poses from an array of shape (N, 4, 4).
pub(crate) fn poses(array: &PyReadonlyArray3<'_, f64>) -> PyResult<Vec<Pose>> {
    let (matrices, rest) = array.as_slice()?.as_chunks::<16>();
    if !rest.is_empty() {
        return Err(PyValueError::new_err("poses: expected shape (N, 4, 4)"));
    }
    let numbered = matrices.iter().enumerate();
    numbered
        .map(|(number, matrix)| pose(matrix).map_err(|error| pose_error(&format!("poses[{number}]"), error)))
        .collect()
}

/// Reads one pose from an array of shape (4, 4).
pub(crate) fn one_pose(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Pose> {
    let matrix =
        array.as_slice()?.try_into().map_err(|_| PyValueError::new_err("pose: expected shape (4, 4)"))?;
    pose(matrix).map_err(|error| pose_error("pose", error))
}

fn pose(matrix: &[f64; 16]) -> Result<Pose, bvh_query::PoseError> {
    let row = |row: usize| [0, 1, 2, 3].map(|column| matrix[4 * row + column]);
    Pose::from_matrix(&[0, 1, 2, 3].map(row))
}

/// Reads rows of three numbers from an array of shape (N, 3).
pub(crate) fn rows<T: Element + Copy>(array: &PyReadonlyArray2<'_, T>, name: &str) -> PyResult<Vec<[T; 3]>> {
    let (rows, rest) = array.as_slice()?.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(PyValueError::new_err(format!("{name}: expected shape (N, 3)")));
    }
    Ok(rows.to_vec())
}

/// Makes an array of shape (N,).
pub(crate) fn array<'py, T: Element>(
    py: Python<'py>,
    of: impl Iterator<Item = T>,
) -> Bound<'py, PyArray1<T>> {
    PyArray1::from_vec(py, of.collect())
}

/// Makes an array of shape (N, K).
pub(crate) fn table<'py, T: Element, const K: usize>(
    py: Python<'py>,
    of: impl Iterator<Item = [T; K]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let flat: Vec<T> = of.flatten().collect();
    let rows = flat.len() / K;
    PyArray1::from_vec(py, flat).reshape([rows, K])
}
