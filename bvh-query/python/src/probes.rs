//! Questions about one mesh and many points, rays or segments.

use crate::answers::{self, Answers};
use crate::arguments::{Rows, flag, number, numbers, points as read_points, pose_or_identity, shape_error};
use crate::asking::{on_all_cores, one_by_one};
use crate::errors::query_error;
use crate::mesh::Mesh;
use bvh_query::{PlacedShape, Pose, ProbeBatch, Querier, QueryError, Ray, RayHit};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// A mesh, where it stands in the frame of the probes, and the probes.
struct Question<'py, 'a, P> {
    py: Python<'py>,
    mesh: &'a Mesh,
    pose: Pose,
    probes: Rows<P>,
    parallel: bool,
}

impl<'py, 'a, P: Sync> Question<'py, 'a, P> {
    fn new(
        py: Python<'py>,
        mesh: &'a Mesh,
        probes: Rows<P>,
        pose: Option<&Bound<'py, PyAny>>,
        parallel: &Bound<'py, PyAny>,
    ) -> PyResult<Self> {
        let (pose, parallel) = (pose_or_identity(pose, "pose")?, flag(parallel, "parallel")?);
        Ok(Self { py, mesh, pose, probes, parallel })
    }

    /// Asks about all probes, on all cores or one after the other, without Python's lock.
    fn ask<T: Send>(
        &self,
        batch: impl Fn(&ProbeBatch<'_>, &[P]) -> Result<Vec<T>, QueryError> + Send + Sync,
        one: impl Fn(&mut Querier, PlacedShape<'_>, &P) -> Result<T, QueryError> + Send + Sync,
    ) -> PyResult<Vec<T>> {
        let placed = self.mesh.shape().shape().at(&self.pose);
        let probes = &self.probes.rows;
        // Without probes, too, the other arguments are checked.
        if self.parallel || probes.is_empty() {
            let all = ProbeBatch::new(placed).map_err(query_error)?;
            return on_all_cores(self.py, probes, |probes| batch(&all, probes).map_err(query_error));
        }
        one_by_one(self.py, probes, |querier, probe| one(querier, placed, probe).map_err(query_error))
    }

    fn answers(&self) -> Answers<'py> {
        Answers { py: self.py, one: self.probes.one }
    }
}

#[pyfunction]
pub(crate) fn closest_points<'py>(
    mesh: &Mesh,
    points: &Bound<'py, PyAny>,
    within: &Bound<'py, PyAny>,
    pose: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyTuple>> {
    let question = Question::new(points.py(), mesh, read_points(points, "points")?, pose, parallel)?;
    let within = number(within, "within")?;
    let found = question.ask(
        |batch, points| batch.closest_points(points, within),
        |querier, shape, &point| querier.closest_point(shape, point, within),
    )?;
    answers::closest(question.answers(), found.into_iter())
}

#[pyfunction]
pub(crate) fn sides<'py>(
    mesh: &Mesh,
    points: &Bound<'py, PyAny>,
    pose: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(points.py(), mesh, read_points(points, "points")?, pose, parallel)?;
    let found = question
        .ask(|batch, points| batch.sides(points), |querier, shape, &point| querier.side(shape, point))?;
    question.answers().values(found.into_iter().map(|side| side as i8))
}

/// NaN where the mesh has no inside, and where no surface is within the distance.
#[pyfunction]
pub(crate) fn signed_distances<'py>(
    mesh: &Mesh,
    points: &Bound<'py, PyAny>,
    within: &Bound<'py, PyAny>,
    pose: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(points.py(), mesh, read_points(points, "points")?, pose, parallel)?;
    let within = number(within, "within")?;
    let found = question.ask(
        |batch, points| batch.signed_distances(points, within),
        |querier, shape, &point| querier.signed_distance(shape, point, within),
    )?;
    let distances = found.into_iter().map(|found| found.and_then(|found| found.value()).unwrap_or(f64::NAN));
    question.answers().values(distances)
}

/// Reads rays: origins and directions of shape (3,) or (N, 3), and their greatest parameters of shape () or (N,). One origin
/// serves N directions, and one direction N origins.
pub(crate) fn rays(
    origins: &Bound<'_, PyAny>,
    directions: &Bound<'_, PyAny>,
    until: &Bound<'_, PyAny>,
) -> PyResult<Rows<Ray>> {
    let (origins, directions) = (read_points(origins, "origins")?, read_points(directions, "directions")?);
    let mut rays = origins.with("origins", (&directions, "directions"), |&origin, &direction, _| {
        Ok(Ray::new(origin, direction))
    })?;
    let until = numbers(until, "until")?;
    let count = rays.rows.len();
    if !until.shape().is_empty() && (rays.one || until.shape() != [count]) {
        let expected = if rays.one { "()".to_owned() } else { format!("() or ({count},)") };
        return Err(shape_error("until", &expected, until.shape()));
    }
    for (ray, &until) in rays.rows.iter_mut().zip(until.as_slice()?.iter().cycle()) {
        *ray = ray.until(until);
    }
    Ok(rays)
}

#[pyfunction]
pub(crate) fn first_hits<'py>(
    mesh: &Mesh,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
    pose: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyTuple>> {
    let question = Question::new(origins.py(), mesh, rays(origins, directions, until)?, pose, parallel)?;
    let found = question
        .ask(|batch, rays| batch.first_hits(rays), |querier, shape, ray| querier.first_hit(shape, ray))?;
    answers::hits(question.answers(), found.into_iter())
}

#[pyfunction]
pub(crate) fn any_hits<'py>(
    mesh: &Mesh,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
    pose: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(origins.py(), mesh, rays(origins, directions, until)?, pose, parallel)?;
    let found = question
        .ask(|batch, rays| batch.any_hits(rays), |querier, shape, ray| querier.any_hit(shape, ray))?;
    question.answers().values(found.into_iter())
}

#[pyfunction]
pub(crate) fn all_hits<'py>(
    mesh: &Mesh,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
    pose: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(origins.py(), mesh, rays(origins, directions, until)?, pose, parallel)?;
    let found = question
        .ask(|batch, rays| batch.all_hits(rays), |querier, shape, ray| querier.all_hits(shape, ray))?;
    let along_one = Answers { py: question.py, one: false };
    let hits = |hits: &[RayHit]| Ok(answers::hits(along_one, hits.iter().copied().map(Some))?.into_any());
    question.answers().lists(&found, hits)
}

/// Reads segments: starts and ends of shape (3,) or (N, 3). One start serves N ends, and one end N starts.
pub(crate) fn segments(starts: &Bound<'_, PyAny>, ends: &Bound<'_, PyAny>) -> PyResult<Rows<[[f64; 3]; 2]>> {
    let ends = read_points(ends, "ends")?;
    read_points(starts, "starts")?.with("starts", (&ends, "ends"), |&start, &end, _| Ok([start, end]))
}

#[pyfunction]
pub(crate) fn segment_hits<'py>(
    mesh: &Mesh,
    starts: &Bound<'py, PyAny>,
    ends: &Bound<'py, PyAny>,
    pose: Option<&Bound<'py, PyAny>>,
    parallel: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::new(starts.py(), mesh, segments(starts, ends)?, pose, parallel)?;
    let found = question.ask(
        |batch, segments| batch.segment_hits(segments),
        |querier, shape, &[start, end]| querier.segment_hit(shape, start, end),
    )?;
    question.answers().values(found.into_iter())
}
