//! Questions about many points, rays or segments in the world, over all instances of a scene.

use crate::answers::{self, Found, Lists, starts};
use crate::arrays::{array, rows};
use crate::probes::{rays, segments};
use crate::scene::{Scene, State};
use bvh_query::{InstanceId, SceneRayHit};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// The instances, -1 where there is none, and what is found of each.
type OfInstances<'py> = (Bound<'py, PyArray1<i64>>, Found<'py>);

fn instance(state: &State, id: Option<InstanceId>) -> i64 {
    id.map_or(-1, |id| state.number(id))
}

#[pyfunction]
pub(crate) fn scene_closest_points<'py>(
    py: Python<'py>,
    scene: &Scene,
    points: PyReadonlyArray2<'py, f64>,
    within: f64,
) -> PyResult<OfInstances<'py>> {
    let points = rows(&points, "points")?;
    let found: Vec<_> = scene.ask(
        py,
        |scene| scene.closest_points(&points, within),
        |state, found| {
            let row = |found: Option<bvh_query::SceneClosestPoint>| {
                (instance(state, found.map(|found| found.instance)), found.map(|found| found.closest))
            };
            found.into_iter().map(row).collect()
        },
    )?;
    Ok((array(py, found.iter().map(|row| row.0)), answers::closest(py, found.iter().map(|row| row.1))?))
}

#[pyfunction]
pub(crate) fn scene_sides<'py>(
    py: Python<'py>,
    scene: &Scene,
    points: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let points = rows(&points, "points")?;
    let found = scene.ask(py, |scene| scene.sides(&points), |_, found| found)?;
    Ok(array(py, found.into_iter().map(|side| side as u8)))
}

/// NaN where there is no inside, and where there is nothing.
#[pyfunction]
pub(crate) fn scene_signed_distances<'py>(
    py: Python<'py>,
    scene: &Scene,
    points: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let points = rows(&points, "points")?;
    let found = scene.ask(py, |scene| scene.signed_distances(&points, f64::INFINITY), |_, found| found)?;
    Ok(array(py, found.into_iter().map(|found| found.and_then(|(_, of)| of.value()).unwrap_or(f64::NAN))))
}

fn hit(state: &State, found: Option<SceneRayHit>) -> (i64, Option<bvh_query::RayHit>) {
    (instance(state, found.map(|found| found.instance)), found.map(|found| found.hit))
}

#[pyfunction]
pub(crate) fn scene_first_hits<'py>(
    py: Python<'py>,
    scene: &Scene,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    until: PyReadonlyArray1<'py, f64>,
) -> PyResult<OfInstances<'py>> {
    let rays = rays(&origins, &directions, &until)?;
    let found: Vec<_> = scene.ask(
        py,
        |scene| scene.first_hits(&rays),
        |state, found| found.into_iter().map(|found| hit(state, found)).collect(),
    )?;
    Ok((array(py, found.iter().map(|row| row.0)), answers::hits(py, found.iter().map(|row| row.1))?))
}

#[pyfunction]
pub(crate) fn scene_any_hits<'py>(
    py: Python<'py>,
    scene: &Scene,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    until: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let rays = rays(&origins, &directions, &until)?;
    Ok(array(py, scene.ask(py, |scene| scene.any_hits(&rays), |_, found| found)?.into_iter()))
}

#[pyfunction]
pub(crate) fn scene_all_hits<'py>(
    py: Python<'py>,
    scene: &Scene,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    until: PyReadonlyArray1<'py, f64>,
) -> PyResult<Lists<'py, OfInstances<'py>>> {
    let rays = rays(&origins, &directions, &until)?;
    let found: Vec<Vec<_>> = scene.ask(
        py,
        |scene| scene.all_hits(&rays),
        |state, found| {
            let of_ray = |hits: Vec<SceneRayHit>| hits.into_iter().map(|one| hit(state, Some(one))).collect();
            found.into_iter().map(of_ray).collect()
        },
    )?;
    let all = || found.iter().flatten();
    let hits = (array(py, all().map(|row| row.0)), answers::hits(py, all().map(|row| row.1))?);
    Ok((starts(py, found.iter().map(Vec::len)), hits))
}

#[pyfunction]
pub(crate) fn scene_meet_segments<'py>(
    py: Python<'py>,
    scene: &Scene,
    starts: PyReadonlyArray2<'py, f64>,
    ends: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let segments = segments(&starts, &ends)?;
    Ok(array(py, scene.ask(py, |scene| scene.meet_segments(&segments), |_, found| found)?.into_iter()))
}
