//! Questions about many points, rays or segments in the world, over all instances of a scene.

use crate::answers::{self, Answers};
use crate::arguments::{number, points as read_points};
use crate::probes::{rays, segments};
use crate::scene::{Scene, State};
use bvh_query::{ClosestPoint, InstanceId, RayHit, SceneClosestPoint, SceneRayHit};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// The instance, -1 where there is none, and what is found of it.
type OfInstance<T> = (i64, Option<T>);

fn instance(state: &State, id: Option<InstanceId>) -> i64 {
    id.map_or(-1, |id| state.number(id))
}

#[pyfunction]
pub(crate) fn scene_closest_points<'py>(
    scene: &Scene,
    points: &Bound<'py, PyAny>,
    within: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
    let (py, points) = (points.py(), read_points(points, "points")?);
    let (to, within) = (Answers { py, one: points.one }, number(within, "within")?);
    let found: Vec<OfInstance<ClosestPoint>> = scene.ask(
        py,
        |scene| scene.closest_points(&points.rows, within),
        |state, found| {
            let row = |found: Option<SceneClosestPoint>| {
                (instance(state, found.map(|found| found.instance)), found.map(|found| found.closest))
            };
            found.into_iter().map(row).collect()
        },
    )?;
    Ok((to.values(found.iter().map(|row| row.0))?, answers::closest(to, found.iter().map(|row| row.1))?))
}

#[pyfunction]
pub(crate) fn scene_sides<'py>(scene: &Scene, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (py, points) = (points.py(), read_points(points, "points")?);
    let found = scene.ask(py, |scene| scene.sides(&points.rows), |_, found| found)?;
    Answers { py, one: points.one }.values(found.into_iter().map(|side| side as i8))
}

/// NaN where there is no inside, and where there is nothing.
#[pyfunction]
pub(crate) fn scene_signed_distances<'py>(
    scene: &Scene,
    points: &Bound<'py, PyAny>,
    within: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (py, points) = (points.py(), read_points(points, "points")?);
    let within = number(within, "within")?;
    let found = scene.ask(py, |scene| scene.signed_distances(&points.rows, within), |_, found| found)?;
    let distances = found.into_iter().map(|found| found.and_then(|(_, of)| of.value()).unwrap_or(f64::NAN));
    Answers { py, one: points.one }.values(distances)
}

fn hit(state: &State, found: Option<SceneRayHit>) -> OfInstance<RayHit> {
    (instance(state, found.map(|found| found.instance)), found.map(|found| found.hit))
}

fn hits<'py>(
    to: Answers<'py>,
    found: &[OfInstance<RayHit>],
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
    Ok((to.values(found.iter().map(|row| row.0))?, answers::hits(to, found.iter().map(|row| row.1))?))
}

#[pyfunction]
pub(crate) fn scene_first_hits<'py>(
    scene: &Scene,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
    let (py, rays) = (origins.py(), rays(origins, directions, until)?);
    let found: Vec<_> = scene.ask(
        py,
        |scene| scene.first_hits(&rays.rows),
        |state, found| found.into_iter().map(|found| hit(state, found)).collect(),
    )?;
    hits(Answers { py, one: rays.one }, &found)
}

#[pyfunction]
pub(crate) fn scene_any_hits<'py>(
    scene: &Scene,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (py, rays) = (origins.py(), rays(origins, directions, until)?);
    let found = scene.ask(py, |scene| scene.any_hits(&rays.rows), |_, found| found)?;
    Answers { py, one: rays.one }.values(found.into_iter())
}

#[pyfunction]
pub(crate) fn scene_all_hits<'py>(
    scene: &Scene,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    until: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (py, rays) = (origins.py(), rays(origins, directions, until)?);
    let found: Vec<Vec<_>> = scene.ask(
        py,
        |scene| scene.all_hits(&rays.rows),
        |state, found| {
            let of_ray = |hits: Vec<SceneRayHit>| hits.into_iter().map(|one| hit(state, Some(one))).collect();
            found.into_iter().map(of_ray).collect()
        },
    )?;
    let along_one = Answers { py, one: false };
    let list = |found: &[OfInstance<RayHit>]| hits(along_one, found)?.into_bound_py_any(py);
    Answers { py, one: rays.one }.lists(&found, list)
}

#[pyfunction]
pub(crate) fn scene_segment_hits<'py>(
    scene: &Scene,
    starts: &Bound<'py, PyAny>,
    ends: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let (py, segments) = (starts.py(), segments(starts, ends)?);
    let found = scene.ask(py, |scene| scene.segment_hits(&segments.rows), |_, found| found)?;
    Answers { py, one: segments.one }.values(found.into_iter())
}
