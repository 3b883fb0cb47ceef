//! Questions about two meshes in many poses, and about a mesh that meets itself.

use crate::answers::{self, Answers, array, table};
use crate::arguments::{self, Rows, flag, limit, number, vector};
use crate::asking::{on_all_cores, one_by_one};
use crate::errors::{backend_error, query_error};
use crate::mesh::Mesh;
use bvh_query::{
    Batch, ClashOptions, Contact, DistanceOptions, PatchOptions, PenetrationOptions, Pose, Querier,
    QueryError, Shape,
};
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
            return on_all_cores(self.py, poses, |stop, poses| {
                let mut all = all.clone();
                all.set_stop(Some(stop));
                batch(&all, poses).map_err(query_error)
            });
        }
        one_by_one(self.py, poses, |querier, pose| one(querier, [a, b], pose).map_err(query_error))
    }

    /// Asks about all poses as `ask` does, with a budget of visits for each.
    fn ask_within<T: Send>(
        &self,
        budget: u64,
        batch: impl Fn(&Batch<'_>, &[Pose]) -> Result<Vec<T>, QueryError> + Send + Sync,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError> + Send + Sync,
    ) -> PyResult<Vec<T>> {
        self.ask(
            |all, poses| {
                let mut all = all.clone();
                all.set_budget(budget);
                batch(&all, poses)
            },
            |querier, shapes, pose| {
                querier.set_budget(budget);
                let found = one(querier, shapes, pose);
                querier.set_budget(u64::MAX);
                found
            },
        )
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

/// Reads what ends a search for a depth.
pub(crate) fn depth_options(
    relative_gap: &Bound<'_, PyAny>,
    tolerance: Option<&Bound<'_, PyAny>>,
) -> PyResult<PenetrationOptions> {
    let options = PenetrationOptions::new().relative_gap(number(relative_gap, "relative_gap")?);
    Ok(match tolerance {
        Some(tolerance) => options.tolerance(number(tolerance, "tolerance")?),
        None => options,
    })
}

#[pyfunction]
pub(crate) fn penetration<'py>(
    asked: Asked<'py>,
    relative_gap: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
    budget: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let question = Question::new(&asked)?;
    let (options, budget) = (depth_options(relative_gap, tolerance)?, limit(budget, "budget")? as u64);
    let found = question.ask_within(
        budget,
        |batch, poses| batch.penetrations(poses, &options),
        |querier, [a, b], pose| querier.penetration(a, b, pose, &options),
    )?;
    answers::penetrations(question.answers(), found.iter().copied().map(Some))
}

#[pyfunction]
pub(crate) fn signed_distance<'py>(
    asked: Asked<'py>,
    relative_gap: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
    budget: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let question = Question::new(&asked)?;
    let (options, budget) = (depth_options(relative_gap, tolerance)?, limit(budget, "budget")? as u64);
    let found = question.ask_within(
        budget,
        |batch, poses| batch.signed_distances(poses, &options),
        |querier, [a, b], pose| querier.signed_distance(a, b, pose, &options),
    )?;
    answers::signed_distances(question.answers(), found.iter().copied().map(Some))
}

#[pyfunction]
pub(crate) fn intersection<'py>(asked: Asked<'py>) -> PyResult<Bound<'py, PyTuple>> {
    let question = Question::new(&asked)?;
    let found = question.ask(
        |batch, poses| batch.intersections(poses),
        |querier, [a, b], pose| querier.intersection(a, b, pose),
    )?;
    answers::intersections(question.answers(), found.iter().copied().map(Some))
}

#[pyfunction]
pub(crate) fn intersection_surface<'py>(asked: Asked<'py>) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(&asked)?;
    let found = question.ask(
        |batch, poses| batch.intersection_surfaces(poses),
        |querier, [a, b], pose| querier.intersection_surface(a, b, pose),
    )?;
    let py = question.py;
    question.answers().lists(&found, |of| Ok(answers::surface(py, of)?.into_any()))
}

/// Clearance, tolerance, relative gap, the most visits of the search for a depth, and whether to measure what parts have in common.
#[derive(FromPyObject)]
pub(crate) struct ClashLimits<'py>(
    Bound<'py, PyAny>,
    Option<Bound<'py, PyAny>>,
    Bound<'py, PyAny>,
    Option<Bound<'py, PyAny>>,
    Bound<'py, PyAny>,
);

impl ClashLimits<'_> {
    pub(crate) fn read(&self) -> PyResult<ClashOptions> {
        let Self(clearance, tolerance, relative_gap, visits, magnitudes) = self;
        let options = ClashOptions::new()
            .clearance(number(clearance, "clearance")?)
            .relative_gap(number(relative_gap, "relative_gap")?)
            .visits(limit(visits.as_ref(), "visits")? as u64)
            .magnitudes(flag(magnitudes, "magnitudes")?);
        Ok(match tolerance {
            Some(tolerance) => options.tolerance(number(tolerance, "tolerance")?),
            None => options,
        })
    }
}

#[pyfunction]
pub(crate) fn clash<'py>(asked: Asked<'py>, limits: ClashLimits<'py>) -> PyResult<Bound<'py, PyTuple>> {
    let (question, options) = (Question::new(&asked)?, limits.read()?);
    let found = question.ask(
        |batch, poses| batch.clashes(poses, &options),
        |querier, [a, b], pose| querier.clash(a, b, pose, &options),
    )?;
    answers::clashes(question.answers(), found.iter().copied(), options.magnitudes)
}

#[pyfunction]
pub(crate) fn separation<'py>(
    asked: Asked<'py>,
    direction: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyTuple>> {
    let (question, direction) = (Question::new(&asked)?, vector(direction, "direction")?);
    let found = question.ask(
        |batch, poses| batch.separations(poses, direction),
        |querier, [a, b], pose| querier.separation(a, b, pose, direction),
    )?;
    let to = question.answers();
    let numbers = || found.iter().map(|of| (of.lower, of.upper));
    (
        to.values(numbers().map(|of| of.0))?,
        to.values(numbers().map(|of| of.1))?,
        to.rows(found.iter().map(|of| of.translation))?,
    )
        .into_pyobject(question.py)
}

#[pyfunction]
pub(crate) fn contact_regions<'py>(
    asked: Asked<'py>,
    most: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let (question, most) = (Question::new(&asked)?, limit(most, "limit")?);
    let found = question.ask(
        |batch, poses| batch.contact_regions(poses, most),
        |querier, [a, b], pose| querier.contact_regions(a, b, pose, most),
    )?;
    let py = question.py;
    question.answers().lists(&found, |of| Ok(answers::regions(py, &of.regions, of.total)?.into_any()))
}

#[pyfunction]
pub(crate) fn patches<'py>(
    asked: Asked<'py>,
    tolerance: &Bound<'py, PyAny>,
    max_contacts: Option<&Bound<'py, PyAny>>,
    max_points: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(&asked)?;
    let most = limit(max_contacts, "max_contacts")?;
    let options = PatchOptions::new()
        .tolerance(number(tolerance, "tolerance")?)
        .max_contacts(most)
        .max_points(limit(max_points, "max_points")?);
    let found = question.ask(
        |batch, poses| batch.patches(poses, &options),
        |querier, [a, b], pose| querier.patches(a, b, pose, &options),
    )?;
    let py = question.py;
    question.answers().lists(&found, |of| Ok(answers::patches(py, of)?.into_any()))
}

/// Object and triangle of both, kinds, and the number of all.
#[pyfunction]
pub(crate) fn self_contacts<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    most: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let most = limit(most, "limit")?;
    let shapes = [mesh.shape().shape()];
    let found = one_by_one(py, &shapes, |querier, &shape| querier.self_contacts(shape).map_err(query_error))?;
    let found: Vec<_> = found.into_iter().flatten().collect();
    let first = || found.iter().take(most);
    let triangles = first().map(|of| [of.object_a, of.triangle_a, of.object_b, of.triangle_b]);
    (table(py, triangles)?, array(py, first().map(|of| of.kind as u8)), found.len()).into_pyobject(py)
}
