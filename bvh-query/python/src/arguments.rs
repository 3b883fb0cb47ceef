//! Reads what callers give: numbers, and arrays of one row alone, such as a pose of shape (4, 4), or of N rows.
//!
//! Messages begin with the name of the argument. Everything is copied while Python's lock is held, and checked in the
//! copy: another thread may change an array while a question runs, and numpy fills large arrays without the lock.

use crate::errors::value_error;
use bvh_query::floats::with_default_floats;
use bvh_query::{Pose, PoseError};
use numpy::npyffi::NPY_ORDER;
use numpy::{
    PyArray1, PyArrayDescr, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArray, PyUntypedArrayMethods, dtype, get_array_module,
};
use pyo3::exceptions::{PyMemoryError, PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat};

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
        let mut read = reserved(rows.len())?;
        for numbered in rows.iter().enumerate() {
            read.push(row(numbered)?);
        }
        Ok(Self { rows: read, one })
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
        // What is made of rows may be computed.
        let made = with_default_floats(|_| both.map(row).collect::<PyResult<_>>());
        Ok(Rows { rows: made?, one })
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
    let array = numpy.call_method1("asarray", (value,)).map_err(|error| no_array(py, name, error))?;
    let array = array.cast_into::<PyUntypedArray>()?;
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

/// Copies numbers of any shape into an array that nobody else has.
#[pyfunction]
pub(crate) fn copied_numbers<'py>(
    value: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = numbers(value, name)?;
    PyArray1::from_slice(value.py(), array.as_slice()?)
        .reshape_with_order(array.shape(), NPY_ORDER::NPY_CORDER)
}

/// Checks a pose of shape (4, 4).
#[pyfunction]
pub(crate) fn check_pose(value: &Bound<'_, PyAny>, name: &str) -> PyResult<()> {
    pose(value, name).map(drop)
}

/// Names the argument that numpy makes no array of, such as a list of rows of several lengths.
fn no_array(py: Python<'_>, name: &str, error: PyErr) -> PyErr {
    let message =
        format!("{name}: expected numbers in an array, found what numpy refuses: {}", error.value(py));
    let named = match &error {
        _ if error.is_instance_of::<PyValueError>(py) => PyValueError::new_err(message),
        _ if error.is_instance_of::<PyTypeError>(py) => PyTypeError::new_err(message),
        _ => return error,
    };
    named.set_cause(py, Some(error));
    named
}

/// Returns whether numbers lie one after the other, and can be read where they are.
fn is_plain(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    array.is_c_contiguous() && array.data().is_aligned()
}

/// Reads rows of K numbers: an array of shape (K,) or (N, K).
pub(crate) fn rows<const K: usize>(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Rows<[f64; K]>> {
    let array = numbers(value, name)?;
    let one = expect_rows(&array, name, &[K])?;
    let found = array.as_slice()?.as_chunks::<K>().0;
    let mut rows = reserved(found.len())?;
    rows.extend_from_slice(found);
    Ok(Rows { rows, one })
}

/// Reads points, which are finite: an array of shape (3,) or (N, 3).
pub(crate) fn points(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Rows<[f64; 3]>> {
    let read = rows(value, name)?;
    for (number, point) in read.rows.iter().enumerate() {
        if let Some(found) = point.iter().find(|x| !x.is_finite()) {
            let place = if read.one { String::new() } else { format!("[{number}]") };
            let message = format!("{name}{place}: expected finite coordinates, found {found}");
            return Err(PyValueError::new_err(message));
        }
    }
    Ok(read)
}

/// An empty list with room for `count` elements.
pub(crate) fn reserved<T>(count: usize) -> PyResult<Vec<T>> {
    let mut list = Vec::new();
    let refused =
        |_| PyMemoryError::new_err(format!("expected room for {count} rows, found too little memory"));
    list.try_reserve_exact(count).map_err(refused)?;
    Ok(list)
}

/// Reads a number.
#[pyfunction]
pub(crate) fn number(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    // Numpy makes numbers of its strings, and of complex numbers without their imaginary parts.
    if !value.is_instance_of::<PyFloat>()
        && let Ok(dtype) = value.getattr("dtype").and_then(|dtype| Ok(dtype.cast_into::<PyArrayDescr>()?))
        && b"cSU".contains(&dtype.kind())
    {
        return Err(PyTypeError::new_err(format!("{name}: expected a number, found dtype {}", dtype.str()?)));
    }
    value.extract().map_err(|error: PyErr| {
        let py = value.py();
        if error.is_instance_of::<PyTypeError>(py) {
            PyTypeError::new_err(format!("{name}: expected a number, found {}", kind(value)))
        } else if error.is_instance_of::<PyOverflowError>(py) {
            PyValueError::new_err(format!(
                "{name}: expected a number that a float can hold, found one beyond"
            ))
        } else {
            error
        }
    })
}

/// Reads an array of shape (3,).
pub(crate) fn vector(value: &Bound<'_, PyAny>, name: &str) -> PyResult<[f64; 3]> {
    let array = numbers(value, name)?;
    let vector = array.as_slice()?.first_chunk().filter(|_| array.shape() == [3]);
    vector.copied().ok_or_else(|| shape_error(name, "(3,)", array.shape()))
}

/// Reads how many there may be; as many as there are if it is `None`.
pub(crate) fn limit(value: Option<&Bound<'_, PyAny>>, name: &str) -> PyResult<usize> {
    let Some(value) = value else { return Ok(usize::MAX) };
    value.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyTypeError>(value.py()) {
            PyTypeError::new_err(format!("{name}: expected a whole number or None, found {}", kind(value)))
        } else {
            PyValueError::new_err(format!(
                "{name}: expected a whole number from 0 to 2^64 - 1, found {value}"
            ))
        }
    })
}

/// Reads a choice.
#[pyfunction]
pub(crate) fn flag(value: &Bound<'_, PyAny>, name: &str) -> PyResult<bool> {
    let wrong = |_| PyTypeError::new_err(format!("{name}: expected a bool, found {}", kind(value)));
    value.extract().map_err(wrong)
}

/// The name of a value's type.
fn kind(value: &Bound<'_, PyAny>) -> String {
    value.get_type().name().map_or_else(|_| "another type".to_owned(), |name| name.to_string())
}

/// Reads poses: an array of shape (4, 4) or (N, 4, 4).
pub(crate) fn poses(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Rows<Pose>> {
    many_matrices(value, name, pose_of)
}

/// Reads matrices of shape (4, 4) or (N, 4, 4), and makes a pose of each.
pub(crate) fn many_matrices(
    value: &Bound<'_, PyAny>,
    name: &str,
    make: impl Fn(&[[f64; 4]; 4]) -> Result<Pose, PoseError>,
) -> PyResult<Rows<Pose>> {
    let array = numbers(value, name)?;
    let one = expect_rows(&array, name, &[4, 4])?;
    let matrices = array.as_slice()?.as_chunks::<4>().0.as_chunks::<4>().0;
    Rows::read(matrices, one, name, |matrix, place| {
        make(matrix).map_err(|error| value_error(&place(), error))
    })
}

/// Reads poses of shape (N, 4, 4).
pub(crate) fn many_poses(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<Pose>> {
    let Rows { rows, one } = poses(value, name)?;
    if one { Err(shape_error(name, "(N, 4, 4)", &[4, 4])) } else { Ok(rows) }
}

/// Reads a pose of shape (4, 4).
pub(crate) fn pose(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Pose> {
    let array = numbers(value, name)?;
    let matrix = array.as_slice()?.as_chunks::<4>().0.first_chunk().filter(|_| array.shape() == [4, 4]);
    let matrix = matrix.ok_or_else(|| shape_error(name, "(4, 4)", array.shape()))?;
    pose_of(matrix).map_err(|error| value_error(name, error))
}

/// Reads a pose of shape (4, 4), or `None` for the identity.
pub(crate) fn pose_or_identity(value: Option<&Bound<'_, PyAny>>, name: &str) -> PyResult<Pose> {
    value.map_or(Ok(Pose::IDENTITY), |value| pose(value, name))
}

fn pose_of(matrix: &[[f64; 4]; 4]) -> Result<Pose, PoseError> {
    with_default_floats(|_| Pose::from_matrix(matrix))
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
