//! Reads arrays of numbers as callers give them: one row alone, such as a pose of shape (4, 4), or N rows.
//!
//! Everything is copied while Python's lock is held: another thread may change an array while a question runs.

use crate::errors::pose_error;
use bvh_query::Pose;
use numpy::{
    PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods, dtype, get_array_module,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Rows that a caller gave, and whether they are one row alone.
pub(crate) struct Rows<T> {
    pub(crate) rows: Vec<T>,
    pub(crate) one: bool,
}

impl<T> Rows<T> {
    /// Reads the rows one after the other. An error knows the row's place: `name` or, of many, `name[number]`.
    pub(crate) fn read<S>(
        rows: &[S],
        one: bool,
        name: &str,
        read: impl Fn(&S, &dyn Fn() -> String) -> PyResult<T>,
    ) -> PyResult<Self> {
        let row = |(number, row): (usize, &S)| {
            read(row, &|| if one { name.to_owned() } else { format!("{name}[{number}]") })
        };
        Ok(Self { rows: rows.iter().enumerate().map(row).collect::<PyResult<_>>()?, one })
    }

    /// Makes something of each row of one list and the same row of another. One row alone serves all rows of the other
    /// list.
    pub(crate) fn with<S, M>(
        &self,
        name: &str,
        (other, other_name): (&Rows<S>, &str),
        make: impl Fn(&T, &S, &dyn Fn() -> String) -> PyResult<M>,
    ) -> PyResult<Rows<M>> {
        let one = self.one && other.one;
        let count = if self.one { other.rows.len() } else { self.rows.len() };
        if !other.one && other.rows.len() != count {
            let found = other.rows.len();
            return Err(PyValueError::new_err(format!(
                "{other_name}: expected as many as of {name}, {count}, found {found}"
            )));
        }
        let both = self.rows.iter().cycle().zip(other.rows.iter().cycle()).take(count).enumerate();
        let row = |(number, (a, b))| {
            make(a, b, &|| {
                if one {
                    format!("{name} and {other_name}")
                } else {
                    format!("{name}[{number}] and {other_name}[{number}]")
                }
            })
        };
        Ok(Rows { rows: both.map(row).collect::<PyResult<_>>()?, one })
    }
}

/// Reads numbers of any shape, which messages call `name`: an array of doubles in C's order as it is, all else as numpy
/// converts it.
pub(crate) fn numbers<'py>(value: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && is_plain(array)
    {
        return Ok(array.try_readonly()?);
    }
    let py = value.py();
    let numpy = get_array_module(py)?;
    let array = numpy.call_method1("asarray", (value,))?.cast_into::<PyUntypedArray>()?;
    let found = array.dtype();
    if array.len() > 0 && !b"fiu".contains(&found.kind()) {
        return Err(PyTypeError::new_err(format!("{name}: expected numbers, found dtype {}", found.str()?)));
    }
    let as_doubles = PyDict::new(py);
    as_doubles.set_item("dtype", dtype::<f64>(py))?;
    as_doubles.set_item("order", "C")?;
    let mut array =
        numpy.call_method("asarray", (array,), Some(&as_doubles))?.cast_into::<PyArrayDyn<f64>>()?;
    if !is_plain(&array) {
        array = array.call_method0("copy")?.cast_into()?;
    }
    Ok(array.try_readonly()?)
}

/// Returns whether numbers lie one after the other, and can be read where they are.
fn is_plain(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    array.is_c_contiguous() && array.data().is_aligned()
}

/// Reads rows of K numbers: an array of shape (K,) or (N, K).
pub(crate) fn rows<const K: usize>(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Rows<[f64; K]>> {
    let array = numbers(value, name)?;
    let one = expect_rows(&array, name, &[K])?;
    Ok(Rows { rows: array.as_slice()?.as_chunks::<K>().0.to_vec(), one })
}

/// Reads poses: an array of shape (4, 4) or (N, 4, 4).
pub(crate) fn poses(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Rows<Pose>> {
    let array = numbers(value, name)?;
    let one = expect_rows(&array, name, &[4, 4])?;
    Rows::read(array.as_slice()?.as_chunks::<16>().0, one, name, |matrix, place| {
        pose_of(matrix).map_err(|error| pose_error(&place(), error))
    })
}

/// Reads poses of shape (N, 4, 4).
pub(crate) fn many_poses(value: &Bound<'_, PyAny>, name: &str, least: &str) -> PyResult<Vec<Pose>> {
    let Rows { rows, one } = poses(value, name)?;
    if one {
        let message = format!("{name}: expected shape (N, 4, 4){least}, found (4, 4)");
        return Err(PyValueError::new_err(message));
    }
    Ok(rows)
}

/// Reads a pose of shape (4, 4).
pub(crate) fn pose(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Pose> {
    let array = numbers(value, name)?;
    let matrix = array.as_slice()?.first_chunk().filter(|_| array.shape() == [4, 4]);
    let matrix = matrix.ok_or_else(|| shape_error(name, "(4, 4)", array.shape()))?;
    pose_of(matrix).map_err(|error| pose_error(name, error))
}

/// Reads a pose of shape (4, 4), or `None` for the identity.
pub(crate) fn pose_or_identity(value: Option<&Bound<'_, PyAny>>, name: &str) -> PyResult<Pose> {
    value.map_or(Ok(Pose::IDENTITY), |value| pose(value, name))
}

fn pose_of(matrix: &[f64; 16]) -> Result<Pose, bvh_query::PoseError> {
    let row = |row: usize| [0, 1, 2, 3].map(|column| matrix[4 * row + column]);
    Pose::from_matrix(&[0, 1, 2, 3].map(row))
}

/// Expects one row of a shape or many, and returns whether it is one.
fn expect_rows(array: &PyReadonlyArrayDyn<'_, f64>, name: &str, row: &[usize]) -> PyResult<bool> {
    let shape = array.shape();
    if shape != row && (shape.len() != row.len() + 1 || shape[1..] != *row) {
        return Err(shape_error(name, &format!("{} or (N, {})", tuple(row), list(row)), shape));
    }
    Ok(shape == row)
}

/// The exception of an array of another shape.
pub(crate) fn shape_error(name: &str, expected: &str, found: &[usize]) -> PyErr {
    PyValueError::new_err(format!("{name}: expected shape {expected}, found {}", tuple(found)))
}

/// A shape as Python writes it.
fn tuple(shape: &[usize]) -> String {
    format!("({}{})", list(shape), if shape.len() == 1 { "," } else { "" })
}

fn list(shape: &[usize]) -> String {
    shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}
