//! Questions about two meshes in many poses.

use crate::answers::{self, Answers, table};
use crate::arguments::{self, Rows, flag, number};
use crate::asking::{on_all_cores, one_by_one};
use crate::errors::{backend_error, query_error};
use crate::mesh::Mesh;
use bvh_query::{Batch, Contact, DistanceOptions, Pose, Querier, QueryError, Shape};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// What all questions take: two meshes, the poses of the second in the frame of the first, and whether to use all cores.
#[derive(FromPyObject)]
pub(crate) struct Asked<'py>(Bound<'py, Mesh>, Bound<'py, Mesh>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// What was asked, as it was read.
struct Question<'py, 'a> {
    py: Python<'py>,
    a: Shape<'a>,
    b: Shape<'a>,
    poses: Rows<Pose>,
    parallel: bool,
}

impl<'py, 'a> Question<'py, 'a> {
    fn new(Asked(a, b, poses, parallel): &'a Asked<'py>) -> PyResult<Self> {
        let (a, b, parallel) =
            (a.get().shape().shape(), b.get().shape().shape(), flag(parallel, "parallel")?);
        Ok(Self { py: poses.py(), a, b, poses: arguments::poses(poses, "poses")?, parallel })
    }

    /// Asks about all poses, on all cores or one after the other, without Python's lock.
    fn ask<T: Send>(
        &self,
        batch: impl Fn(&Batch<'_>, &[Pose]) -> Result<Vec<T>, QueryError> + Send + Sync,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError> + Send + Sync,
    ) -> PyResult<Vec<T>> {
        let (a, b, poses) = (self.a, self.b, &self.poses.rows);
        // Without poses, too, the other arguments are checked.
        if self.parallel || poses.is_empty() {
            let all = Batch::new(a, b).map_err(backend_error)?;
            return on_all_cores(self.py, poses, |poses| batch(&all, poses).map_err(query_error));
        }
        one_by_one(self.py, poses, |querier, pose| one(querier, [a, b], pose).map_err(query_error))
    }

    fn answers(&self) -> Answers<'py> {
        Answers { py: self.py, one: self.poses.one }
    }
}

#[pyfunction]
pub(crate) fn collide<'py>(asked: Asked<'py>) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(&asked)?;
    let found = question
        .ask(|batch, poses| batch.collide(poses), |querier, [a, b], pose| querier.collide(a, b, pose))?;
    question.answers().values(found.into_iter())
}

#[pyfunction]
pub(crate) fn within<'py>(asked: Asked<'py>, d: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (question, d) = (Question::new(&asked)?, number(d, "d")?);
    let found = question
        .ask(|batch, poses| batch.within(poses, d), |querier, [a, b], pose| querier.within(a, b, pose, d))?;
    question.answers().values(found.into_iter())
}

#[pyfunction]
pub(crate) fn relation<'py>(asked: Asked<'py>) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(&asked)?;
    let found = question
        .ask(|batch, poses| batch.relations(poses), |querier, [a, b], pose| querier.relation(a, b, pose))?;
    question.answers().values(found.into_iter().map(|relation| relation as u8))
}

/// Allowed errors cannot be combined with all cores.
#[pyfunction]
pub(crate) fn distance<'py>(
    asked: Asked<'py>,
    rel_err: &Bound<'py, PyAny>,
    abs_err: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyTuple>> {
    let question = Question::new(&asked)?;
    let (rel_err, abs_err) = (number(rel_err, "rel_err")?, number(abs_err, "abs_err")?);
    let options = DistanceOptions::new().rel_err(rel_err).abs_err(abs_err);
    let exact = rel_err == 0.0 && abs_err == 0.0;
    if question.parallel && !exact {
        return Err(PyValueError::new_err("parallel: expected False with rel_err or abs_err, found True"));
    }
    let found = question.ask(
        |batch, poses| batch.distances(poses),
        |querier, [a, b], pose| {
            if exact { querier.distance(a, b, pose) } else { querier.distance_with(a, b, pose, &options) }
        },
    )?;
    answers::distances(question.answers(), found.iter().copied().map(Some))
}

#[pyfunction]
pub(crate) fn contacts<'py>(asked: Asked<'py>) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(&asked)?;
    let found = question
        .ask(|batch, poses| batch.contacts(poses), |querier, [a, b], pose| querier.contacts(a, b, pose))?;
    let py = question.py;
    let triangles = |rows: &Vec<Contact>| Ok(table(py, rows.iter().map(answers::triangles))?.into_any());
    question.answers().lists(&found, triangles)
}
