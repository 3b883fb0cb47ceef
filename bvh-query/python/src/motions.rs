//! Questions about the way of one mesh past another.

use crate::answers::{self, Answers};
use crate::errors::query_error;
use crate::mesh::Mesh;
use crate::pairs::with_querier;
use crate::paths::{AnyPath, until_raised};
use bvh_query::{Batch, MotionOptions, Querier, QueryError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Why a question about paths has no answer.
enum Ended {
    Query(QueryError),
    Raised(PyErr),
}

impl From<QueryError> for Ended {
    fn from(error: QueryError) -> Self {
        Self::Query(error)
    }
}

impl From<Ended> for PyErr {
    fn from(ended: Ended) -> Self {
        match ended {
            Ended::Query(error) => query_error(error),
            Ended::Raised(error) => error,
        }
    }
}

/// Asks about all paths, on all cores or one after the other, without Python's lock.
fn ask<T: Send>(
    py: Python<'_>,
    paths: &[AnyPath],
    parallel: bool,
    batch: impl Fn() -> Result<Vec<T>, QueryError> + Sync,
    one: impl Fn(&mut Querier, &AnyPath) -> Result<T, QueryError> + Sync,
) -> PyResult<Vec<T>> {
    let parallel = parallel && !paths.iter().any(AnyPath::is_called);
    let answer = |querier: &mut Querier, path: &AnyPath| {
        Ok(until_raised([path].into_iter(), || one(querier, path)).map_err(Ended::Raised)??)
    };
    let asked = py.detach(|| {
        if parallel {
            return Ok(batch()?);
        }
        with_querier(|querier| paths.iter().map(|path| answer(querier, path)).collect())
    });
    asked.map_err(|ended: Ended| ended.into())
}

/// `paths` is a list, and whether it is one path alone.
#[pyfunction]
pub(crate) fn motion<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    paths: (Vec<Bound<'py, PyAny>>, bool),
    clearance: f64,
    tolerance: Option<f64>,
    parallel: bool,
) -> PyResult<Bound<'py, PyTuple>> {
    let (a, b, one, paths) = (a.shape().shape(), b.shape().shape(), paths.1, AnyPath::read(paths.0));
    let options = MotionOptions::new().clearance(clearance).tolerance(tolerance);
    let batch = || Batch::new(a, b)?.motion(&paths, &options);
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
    clearance: f64,
    tolerance: Option<f64>,
    parallel: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let (a, b, one, paths) = (a.shape().shape(), b.shape().shape(), paths.1, AnyPath::read(paths.0));
    let options = MotionOptions::new().clearance(clearance).tolerance(tolerance);
    let batch = || Batch::new(a, b)?.is_free(&paths, &options);
    let found = ask(py, &paths, parallel, batch, |querier, path| querier.is_free(a, b, path, &options))?;
    Answers { py, one }.values(found.into_iter())
}
