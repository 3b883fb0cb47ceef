//! Reads arrays of numbers, and makes arrays of answers.
//!
//! Everything is copied while Python's lock is held: another thread may change an array while a question runs.

use crate::errors::pose_error;
use bvh_query::Pose;
use numpy::{
    Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Reads poses from an array of shape (N, 4, 4), which messages call `name`.
pub(crate) fn poses(array: &PyReadonlyArray3<'_, f64>, name: &str) -> PyResult<Vec<Pose>> {
    expect(name, &array.shape()[1..], &[4, 4])?;
    let matrices = array.as_slice()?.as_chunks::<16>().0;
    let numbered = matrices.iter().enumerate();
    numbered
        .map(|(number, matrix)| pose(matrix).map_err(|error| pose_error(&format!("{name}[{number}]"), error)))
        .collect()
}

/// Reads one pose from an array of shape (4, 4), which messages call `name`.
pub(crate) fn one_pose(array: &PyReadonlyArray2<'_, f64>, name: &str) -> PyResult<Pose> {
    expect(name, array.shape(), &[4, 4])?;
    let matrix = array.as_slice()?.first_chunk();
    let matrix =
        matrix.ok_or_else(|| PyValueError::new_err(format!("{name}: expected a matrix, found none")))?;
    pose(matrix).map_err(|error| pose_error(name, error))
}

fn pose(matrix: &[f64; 16]) -> Result<Pose, bvh_query::PoseError> {
    let row = |row: usize| [0, 1, 2, 3].map(|column| matrix[4 * row + column]);
    Pose::from_matrix(&[0, 1, 2, 3].map(row))
}

/// Reads rows of K numbers from an array of shape (N, K).
pub(crate) fn rows<T: Element + Copy, const K: usize>(
    array: &PyReadonlyArray2<'_, T>,
    name: &str,
) -> PyResult<Vec<[T; K]>> {
    expect(name, &array.shape()[1..], &[K])?;
    Ok(array.as_slice()?.as_chunks::<K>().0.to_vec())
}

/// Compares the shape of one row of an array.
fn expect(name: &str, found: &[usize], expected: &[usize]) -> PyResult<()> {
    if found == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name}: expected rows of shape {expected:?}, found {found:?}")))
}

/// Makes an array of shape (N, 4, 4).
pub(crate) fn pose_rows<'py>(
    py: Python<'py>,
    of: impl Iterator<Item = Pose>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let matrix = |pose: Pose| {
        let (r, t) = (*pose.rotation(), pose.translation());
        let row = |k: usize| [r[k][0], r[k][1], r[k][2], t[k]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    };
    let flat: Vec<f64> = of.flat_map(matrix).flatten().collect();
    let rows = flat.len() / 16;
    PyArray1::from_vec(py, flat).reshape([rows, 4, 4])
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
