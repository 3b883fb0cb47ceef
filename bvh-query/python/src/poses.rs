//! Makes poses: from quaternions, and of one body in the frame of another.

use crate::answers::Answers;
use crate::arguments::{many_matrices, poses, rows};
use crate::errors::value_error;
use bvh_query::floats::with_default_floats;
use bvh_query::{Pose, PoseError};
use pyo3::prelude::*;

/// Poses of positions of shape (3,) or (N, 3) and quaternions of shape (4,) or (N, 4).
#[pyfunction]
pub(crate) fn poses_of<'py>(
    position: &Bound<'py, PyAny>,
    quaternion: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (positions, quaternions) = (rows(position, "position")?, rows(quaternion, "quaternion")?);
    let made =
        positions.with("position", (&quaternions, "quaternion"), |&position, &quaternion, place| {
            Pose::from_quaternion(quaternion, position).map_err(|error| value_error(&place(), error))
        })?;
    Answers { py: position.py(), one: made.one }.poses(&made.rows)
}

/// Poses of B in A's frame, from poses of both in the world, of shape (4, 4) or (N, 4, 4).
#[pyfunction]
pub(crate) fn relative_poses<'py>(
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let made = poses(a, "a")?.with("a", (&poses(b, "b")?, "b"), |a, b, place| {
        Pose::relative(a, b).map_err(|error| value_error(&place(), error))
    })?;
    Answers { py: a.py(), one: made.one }.poses(&made.rows)
}

/// The poses nearest to matrices of shape (4, 4) or (N, 4, 4) that are not quite rigid.
#[pyfunction]
pub(crate) fn nearest_poses<'py>(matrix: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let made = many_matrices(matrix, "matrix", |rows| {
        if rows[3] != [0.0, 0.0, 0.0, 1.0] {
            return Err(PoseError::LastRow(rows[3]));
        }
        let row = |k: usize| [rows[k][0], rows[k][1], rows[k][2]];
        with_default_floats(|_| Pose::nearest([0, 1, 2].map(row), [0, 1, 2].map(|k| rows[k][3])))
    })?;
    Answers { py: matrix.py(), one: made.one }.poses(&made.rows)
}
