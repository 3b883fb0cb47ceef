//! Questions about motions of one mesh past another.

use crate::answers::{self, Answers};
use crate::arguments::{flag, number};
use crate::asking::{on_all_cores, one_by_one};
use crate::errors::{backend_error, query_error};
use crate::mesh::Mesh;
use crate::paths::{AnyPath, until_raised};
use bvh_query::{Batch, MotionOptions, Querier, QueryError, Shape};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Asks about all paths. Paths of Python code are called on the thread of the question.
fn ask<T: Send>(
    py: Python<'_>,
    paths: &[AnyPath],
    parallel: bool,
    [a, b]: [Shape<'_>; 2],
    batch: impl Fn(&Batch<'_>, &[AnyPath]) -> Result<Vec<T>, QueryError> + Sync,
    one: impl Fn(&mut Querier, &AnyPath) -> Result<T, QueryError> + Sync,
) -> PyResult<Vec<T>> {
    // Without paths, too, the other arguments are checked.
    if paths.is_empty() || parallel && !paths.iter().any(AnyPath::is_called) {
        let all = Batch::new(a, b).map_err(backend_error)?;
        return on_all_cores(py, paths, |stop, paths| {
            let mut all = all.clone();
            all.set_stop(Some(stop));
            batch(&all, paths).map_err(query_error)
        });
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
    let batch = |batch: &Batch<'_>, paths: &[AnyPath]| batch.motions(paths, &options);
    let one_of = |querier: &mut Querier, path: &AnyPath| querier.motion(a, b, path, &options);
    let found = ask(py, &paths, parallel, [a, b], batch, one_of)?;
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
    let batch = |batch: &Batch<'_>, paths: &[AnyPath]| batch.are_free(paths, &options);
    let one_of = |querier: &mut Querier, path: &AnyPath| querier.is_free(a, b, path, &options);
    let found = ask(py, &paths, parallel, [a, b], batch, one_of)?;
    Answers { py, one }.values(found.into_iter())
}
