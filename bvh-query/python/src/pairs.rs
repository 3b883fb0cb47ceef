//! Questions about two meshes in many poses.

use crate::answers::{self, Distances, Lists};
use crate::arrays::{array, poses};
use crate::errors::query_error;
use crate::mesh::Mesh;
use bvh_query::{Batch, DistanceOptions, Pose, Querier, QueryError, Shape};
use numpy::{PyArray1, PyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use std::sync::Mutex;

/// Queriers that are not in use. Their memory is that of the largest questions so far.
static QUERIERS: Mutex<Vec<Querier>> = Mutex::new(Vec::new());

/// Calls `ask` with a querier that no other thread has.
pub(crate) fn with_querier<T, E: From<QueryError>>(
    ask: impl FnOnce(&mut Querier) -> Result<T, E>,
) -> Result<T, E> {
    let kept = QUERIERS.lock().ok().and_then(|mut queriers| queriers.pop());
    let mut querier = kept.map_or_else(Querier::new, Ok)?;
    let answer = ask(&mut querier);
    // After an error, which is rare, a querier may be in the middle of a question.
    if answer.is_ok()
        && let Ok(mut queriers) = QUERIERS.lock()
    {
        queriers.push(querier);
    }
    answer
}

/// A pair of meshes, and the poses of the second in the frame of the first.
struct Question<'a> {
    a: Shape<'a>,
    b: Shape<'a>,
    poses: Vec<Pose>,
    parallel: bool,
}

impl<'a> Question<'a> {
    fn new(a: &'a Mesh, b: &'a Mesh, array: &PyReadonlyArray3<'_, f64>, parallel: bool) -> PyResult<Self> {
        Ok(Self { a: a.shape().shape(), b: b.shape().shape(), poses: poses(array, "poses")?, parallel })
    }

    /// Asks about all poses, on all cores or one after the other, without Python's lock.
    fn ask<T: Send>(
        &self,
        py: Python<'_>,
        batch: impl Fn(&Batch<'_>, &[Pose]) -> Result<Vec<T>, QueryError> + Send + Sync,
        one: impl Fn(&mut Querier, Shape<'_>, Shape<'_>, &Pose) -> Result<T, QueryError> + Send + Sync,
    ) -> PyResult<Vec<T>> {
        let Self { a, b, ref poses, parallel } = *self;
        py.detach(|| {
            if parallel {
                return batch(&Batch::new(a, b)?, poses);
            }
            with_querier(|querier| poses.iter().map(|pose| one(querier, a, b, pose)).collect())
        })
        .map_err(query_error)
    }
}

#[pyfunction]
pub(crate) fn collide<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    poses: PyReadonlyArray3<'py, f64>,
    parallel: bool,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let question = Question::new(a, b, &poses, parallel)?;
    let one = |querier: &mut Querier, a: Shape<'_>, b: Shape<'_>, pose: &Pose| querier.collide(a, b, pose);
    Ok(array(py, question.ask(py, |batch, poses| batch.collide(poses), one)?.into_iter()))
}

#[pyfunction]
pub(crate) fn within<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    poses: PyReadonlyArray3<'py, f64>,
    d: f64,
    parallel: bool,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let question = Question::new(a, b, &poses, parallel)?;
    let one = |querier: &mut Querier, a: Shape<'_>, b: Shape<'_>, pose: &Pose| querier.within(a, b, pose, d);
    Ok(array(py, question.ask(py, |batch, poses| batch.within(poses, d), one)?.into_iter()))
}

#[pyfunction]
pub(crate) fn relation<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    poses: PyReadonlyArray3<'py, f64>,
    parallel: bool,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let question = Question::new(a, b, &poses, parallel)?;
    let one = |querier: &mut Querier, a: Shape<'_>, b: Shape<'_>, pose: &Pose| querier.relation(a, b, pose);
    let answers = question.ask(py, |batch, poses| batch.relation(poses), one)?;
    Ok(array(py, answers.into_iter().map(|relation| relation as u8)))
}

#[pyfunction]
pub(crate) fn distance<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    poses: PyReadonlyArray3<'py, f64>,
    parallel: bool,
) -> PyResult<Distances<'py>> {
    let question = Question::new(a, b, &poses, parallel)?;
    let one = |querier: &mut Querier, a: Shape<'_>, b: Shape<'_>, pose: &Pose| querier.distance(a, b, pose);
    let found = question.ask(py, |batch, poses| batch.distance(poses), one)?;
    answers::distances(py, found.iter().copied().map(Some))
}

#[pyfunction]
pub(crate) fn distance_with<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    poses: PyReadonlyArray3<'py, f64>,
    rel_err: f64,
    abs_err: f64,
) -> PyResult<Distances<'py>> {
    let question = Question::new(a, b, &poses, false)?;
    let options = DistanceOptions::new().rel_err(rel_err).abs_err(abs_err);
    let one = |querier: &mut Querier, a: Shape<'_>, b: Shape<'_>, pose: &Pose| {
        querier.distance_with(a, b, pose, &options)
    };
    // Only a querier takes allowed errors.
    let found = question.ask(py, |_, _| Ok(Vec::new()), one)?;
    answers::distances(py, found.iter().copied().map(Some))
}

#[pyfunction]
pub(crate) fn contacts<'py>(
    py: Python<'py>,
    a: &Mesh,
    b: &Mesh,
    poses: PyReadonlyArray3<'py, f64>,
    parallel: bool,
) -> PyResult<Lists<'py, Bound<'py, PyArray2<u32>>>> {
    let question = Question::new(a, b, &poses, parallel)?;
    let one = |querier: &mut Querier, a: Shape<'_>, b: Shape<'_>, pose: &Pose| querier.contacts(a, b, pose);
    answers::contacts(py, &question.ask(py, |batch, poses| batch.contacts(poses), one)?)
}
