//! Questions about all pairs of a scene, standing still and moving.

use crate::answers::{self, Answers, FREE, HIT, NEAR, array, table};
use crate::arguments::number;
use crate::asking::on_threads;
use crate::motions::options;
use crate::pairs::{ClashLimits, depth_options};
use crate::paths::{AnyPath, until_raised};
use crate::scene::{Scene, State};
use bvh_query::{Distance, InstanceId, RigidPath, SceneDistance, SceneError, SceneMotionAnswer, ScenePair};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

type Pairs<'py> = Bound<'py, PyArray2<i64>>;

/// A pair and its distance or signed distance, or `None` where there is no pair.
type Nearest<'py> = Option<(i64, i64, Bound<'py, PyTuple>)>;

/// Pairs, their signed distances as numbers, and all parts of these.
type Near<'py> = (Pairs<'py>, Bound<'py, PyArray1<f64>>, Bound<'py, PyTuple>);

fn nearest<'py>(py: Python<'py>, found: Option<([i64; 2], Distance)>) -> PyResult<Nearest<'py>> {
    let Some(([a, b], nearest)) = found else { return Ok(None) };
    let nearest = answers::distances(Answers { py, one: true }, std::iter::once(Some(nearest)))?;
    Ok(Some((a, b, nearest)))
}

fn numbered(state: &State, pairs: Vec<ScenePair>) -> Vec<[i64; 2]> {
    pairs.into_iter().map(|pair| state.pair(pair)).collect()
}

#[pyfunction]
pub(crate) fn scene_collide(py: Python<'_>, scene: &Scene) -> PyResult<bool> {
    scene.ask(py, |scene| scene.collide(), |_, found| found)
}

#[pyfunction]
pub(crate) fn scene_within(py: Python<'_>, scene: &Scene, d: &Bound<'_, PyAny>) -> PyResult<bool> {
    let d = number(d, "d")?;
    scene.ask(py, |scene| scene.within(d), |_, found| found)
}

#[pyfunction]
pub(crate) fn scene_pairs_in_contact<'py>(py: Python<'py>, scene: &Scene) -> PyResult<Pairs<'py>> {
    table(py, scene.ask(py, |scene| scene.pairs_in_contact(), numbered)?.into_iter())
}

#[pyfunction]
pub(crate) fn scene_pairs_within<'py>(
    py: Python<'py>,
    scene: &Scene,
    d: &Bound<'py, PyAny>,
) -> PyResult<Pairs<'py>> {
    let d = number(d, "d")?;
    table(py, scene.ask(py, |scene| scene.pairs_within(d), numbered)?.into_iter())
}

#[pyfunction]
pub(crate) fn scene_relations<'py>(
    py: Python<'py>,
    scene: &Scene,
) -> PyResult<(Pairs<'py>, Bound<'py, PyArray1<u8>>)> {
    let found: Vec<_> = scene.ask(
        py,
        |scene| scene.relations(),
        |state, found| found.into_iter().map(|(pair, relation)| (state.pair(pair), relation as u8)).collect(),
    )?;
    Ok((table(py, found.iter().map(|row| row.0))?, array(py, found.iter().map(|row| row.1))))
}

#[pyfunction]
pub(crate) fn scene_clashes<'py>(
    py: Python<'py>,
    scene: &Scene,
    limits: ClashLimits<'py>,
) -> PyResult<(Pairs<'py>, Bound<'py, PyTuple>)> {
    let options = limits.read()?;
    let found: Vec<_> = scene.ask(
        py,
        |scene| scene.clashes(&options),
        |state, found| found.into_iter().map(|row| (state.pair(row.pair), row.clash)).collect(),
    )?;
    let clashes =
        answers::clashes(Answers { py, one: false }, found.iter().map(|row| row.1), options.magnitudes)?;
    Ok((table(py, found.iter().map(|row| row.0))?, clashes))
}

#[pyfunction]
pub(crate) fn scene_contacts<'py>(
    py: Python<'py>,
    scene: &Scene,
) -> PyResult<(Pairs<'py>, Bound<'py, PyArray2<u32>>)> {
    let found: Vec<_> = scene.ask(
        py,
        |scene| scene.contacts(),
        |state, found| found.into_iter().map(|row| (state.pair(row.pair), row.contact)).collect(),
    )?;
    let triangles = found.iter().map(|(_, contact)| answers::triangles(contact));
    Ok((table(py, found.iter().map(|row| row.0))?, table(py, triangles)?))
}

#[pyfunction]
pub(crate) fn scene_distance<'py>(py: Python<'py>, scene: &Scene) -> PyResult<Nearest<'py>> {
    let read = |state: &State, found: Option<SceneDistance>| {
        found.map(|found| (state.pair(found.pair), found.nearest))
    };
    nearest(py, scene.ask(py, |scene| scene.distance(), read)?)
}

#[pyfunction]
pub(crate) fn scene_signed_distance<'py>(
    py: Python<'py>,
    scene: &Scene,
    relative_gap: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
) -> PyResult<Nearest<'py>> {
    let options = depth_options(relative_gap, tolerance)?;
    let found = scene.ask(
        py,
        |scene| scene.signed_distance(&options),
        |state, found| found.map(|found| (state.pair(found.pair), found.nearest)),
    )?;
    let Some(([a, b], nearest)) = found else { return Ok(None) };
    let nearest = answers::signed_distances(Answers { py, one: true }, std::iter::once(Some(nearest)))?;
    Ok(Some((a, b, nearest)))
}

#[pyfunction]
pub(crate) fn scene_near_pairs<'py>(
    py: Python<'py>,
    scene: &Scene,
    margin: &Bound<'py, PyAny>,
    relative_gap: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
) -> PyResult<Near<'py>> {
    let (margin, options) = (number(margin, "margin")?, depth_options(relative_gap, tolerance)?);
    let found = scene.ask(
        py,
        |scene| scene.near_pairs(margin, &options),
        |state, found| found.into_iter().map(|of| (state.pair(of.pair), of.nearest)).collect::<Vec<_>>(),
    )?;
    let nearest = found.iter().map(|(_, nearest)| Some(*nearest));
    Ok((
        table(py, found.iter().map(|(pair, _)| *pair))?,
        array(py, found.iter().map(|(_, nearest)| nearest.distance)),
        answers::signed_distances(Answers { py, one: false }, nearest)?,
    ))
}

/// Instances and their paths.
struct Ways {
    numbers: Vec<i64>,
    paths: Vec<AnyPath>,
}

impl Ways {
    /// Asks a question about them. A path of Python code is called on this thread alone.
    fn ask<A: Send, T: Send>(
        &self,
        py: Python<'_>,
        scene: &Scene,
        ask: impl Fn(&mut bvh_query::Scene, &[(InstanceId, &(dyn RigidPath + Sync))]) -> Result<A, SceneError>
        + Sync,
        read: impl Fn(&State, A) -> T + Sync,
    ) -> PyResult<T> {
        scene.with_snapshot(py, |state| {
            let ids = self.numbers.iter().map(|&number| state.id(number, "paths"));
            let ids = ids.collect::<PyResult<Vec<_>>>()?;
            let ways: Vec<_> = ids.into_iter().zip(self.paths.iter().map(AnyPath::path)).collect();
            let parallel = state.parallel && !self.paths.iter().any(AnyPath::is_called);
            let scene = &mut state.scene;
            scene.set_parallel(parallel);
            let answer = on_threads(parallel, |stop| {
                scene.set_stop(Some(stop));
                until_raised(self.paths.iter(), || ask(scene, &ways))
            })??;
            match answer {
                Ok(answer) => Ok(read(state, answer)),
                Err(error) => Err(state.refused(error)),
            }
        })
    }
}

#[pyfunction]
pub(crate) fn scene_motion<'py>(
    py: Python<'py>,
    scene: &Scene,
    numbers: Vec<i64>,
    paths: Vec<Bound<'py, PyAny>>,
    clearance: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
) -> PyResult<(u8, f64, f64, Nearest<'py>)> {
    let ways = Ways { numbers, paths: AnyPath::read(paths) };
    let options = options(clearance, tolerance)?;
    let read = |state: &State, answer: SceneMotionAnswer| match answer {
        SceneMotionAnswer::Free => (FREE, 1.0, f64::NAN, None),
        SceneMotionAnswer::Hit { free_until, touching_at, pair, nearest } => {
            (HIT, free_until, touching_at, Some((state.pair(pair), nearest)))
        }
        SceneMotionAnswer::Near { free_until, at, pair, nearest } => {
            (NEAR, free_until, at, Some((state.pair(pair), nearest)))
        }
    };
    let (kind, free_until, at, found) =
        ways.ask(py, scene, |scene, ways| scene.motion(ways, &options), read)?;
    Ok((kind, free_until, at, nearest(py, found)?))
}

#[pyfunction]
pub(crate) fn scene_is_free<'py>(
    py: Python<'py>,
    scene: &Scene,
    numbers: Vec<i64>,
    paths: Vec<Bound<'py, PyAny>>,
    clearance: &Bound<'py, PyAny>,
    tolerance: Option<&Bound<'py, PyAny>>,
) -> PyResult<bool> {
    let ways = Ways { numbers, paths: AnyPath::read(paths) };
    let options = options(clearance, tolerance)?;
    ways.ask(py, scene, |scene, ways| scene.is_free(ways, &options), |_, found| found)
}
