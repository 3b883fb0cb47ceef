//! Questions about motions of one mesh past another.

use crate::answers::{self, Answers};
use crate::arguments::{flag, number};
use crate::asking::{on_all_cores, one_by_one};
use crate::errors::query_error;
use crate::mesh::Mesh;
use crate::paths::{AnyPath, until_raised};
use bvh_query::{Batch, MotionOptions, Querier, QueryError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Asks about all paths. Paths of Python code are called on the thread of the question.
fn ask<T: Send>(
    py: Python<'_>,
    paths: &[AnyPath],
    parallel: bool,
    batch: impl Fn(&[AnyPath]) -> Result<Vec<T>, QueryError> + Sync,
    one: impl Fn(&mut Querier, &AnyPath) -> Result<T, QueryError> + Sync,
) -> PyResult<Vec<T>> {
    // Without paths, too, the other arguments are checked.
    if paths.is_empty() || parallel && !paths.iter().any(AnyPath::is_called) {
        return on_all_cores(py, paths, |paths| batch(paths).map_err(query_error));
    }
    one_by_one(py, paths, |querier, path| {
        until_raised([path].into_iter(), || one(querier, path))?.map_err(query_error)
    })
}

/// Reads what counts as a hit, and how exactly time is searched.
pub(crate) fn options(
    clearance: &Bound<'_, PyAny>,
    tolerance: Option<&Bound<'_, PyAny>>,
) -> PyResult<MotionOptions> {
    let tolerance = tolerance.map(|tolerance| number(tolerance, "tolerance")).transpose()?;
    Ok(MotionOptions::new().clearance(number(clearance, "clearance")?).tolerance(tolerance))
}

/// `paths` is a list, and whether it is one path alone.
#[pyfunction]
pub(crate) fn motion<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    paths: (Vec<Bound<'py, PyAny>>, bool),
    clearance: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (a, b, one, paths) = (a.shape().shape(), b.shape().shape(), paths.1, AnyPath::read(paths.0));
    let (options, parallel) = (options(clearance, tolerance)?, flag(parallel, "parallel")?);
    let batch = |paths: &[AnyPath]| Batch::new(a, b)?.motions(paths, &options);
    let found = ask(py, &paths, parallel, batch, |querier, path| querier.motion(a, b, path, &options))?;
    answers::motions(Answers { py, one }, &found)
}

/// `paths` is a list, and whether it is one path alone.
#[pyfunction]
pub(crate) fn is_free<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    paths: (Vec<Bound<'py, PyAny>>, bool),
    clearance: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (a, b, one, paths) = (a.shape().shape(), b.shape().shape(), paths.1, AnyPath::read(paths.0));
    let (options, parallel) = (options(clearance, tolerance)?, flag(parallel, "parallel")?);
    let batch = |paths: &[AnyPath]| Batch::new(a, b)?.are_free(paths, &options);
    let found = ask(py, &paths, parallel, batch, |querier, path| querier.is_free(a, b, path, &options))?;
    Answers { py, one }.values(found.into_iter())
}
