//! Makes poses: from quaternions, and of one body in the frame of another.

use crate::arrays::{pose_rows, poses, rows};
use crate::errors::pose_error;
use bvh_query::Pose;
use numpy::{PyArray3, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Poses of positions of shape (N, 3) and quaternions of shape (N, 4).
#[pyfunction]
pub(crate) fn poses_of<'py>(
    py: Python<'py>,
    positions: PyReadonlyArray2<'py, f64>,
    quaternions: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (positions, quaternions) = (rows(&positions, "position")?, rows(&quaternions, "quaternion")?);
    made(py, ("position", &positions), ("quaternion", &quaternions), |&position, &quaternion| {
        Pose::from_quaternion(quaternion, position)
    })
}

/// Poses of B in A's frame, from poses of both in the world, of shape (N, 4, 4).
#[pyfunction]
pub(crate) fn relative_poses<'py>(
    py: Python<'py>,
    a: PyReadonlyArray3<'py, f64>,
    b: PyReadonlyArray3<'py, f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (a, b) = (poses(&a, "a")?, poses(&b, "b")?);
    made(py, ("a", &a), ("b", &b), Pose::relative)
}

/// Makes a pose of each element of two lists, which messages name.
fn made<'py, A, B>(
    py: Python<'py>,
    (name_a, a): (&str, &[A]),
    (name_b, b): (&str, &[B]),
    make: impl Fn(&A, &B) -> Result<Pose, bvh_query::PoseError>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    if a.len() != b.len() {
        let found = format!("{name_b}: expected as many as of {name_a}, {}, found {}", a.len(), b.len());
        return Err(PyValueError::new_err(found));
    }
    let both = a.iter().zip(b).enumerate();
    let pose = |(number, (a, b))| {
        make(a, b).map_err(|error| pose_error(&format!("{name_a}[{number}] and {name_b}[{number}]"), error))
    };
    pose_rows(py, both.map(pose).collect::<PyResult<Vec<_>>>()?.into_iter())
}
