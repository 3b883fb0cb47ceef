//! Questions about one mesh and many points, rays or segments.

use crate::answers::{self, Found, Lists, starts};
use crate::arrays::{array, one_pose, rows};
use crate::errors::query_error;
use crate::mesh::Mesh;
use crate::pairs::with_querier;
use bvh_query::{PlacedShape, Pose, ProbeBatch, Querier, QueryError, Ray};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A mesh, where it stands in the frame of the probes, and whether all cores work.
struct Place {
    pose: Pose,
    parallel: bool,
}

impl Place {
    fn new(pose: &PyReadonlyArray2<'_, f64>, parallel: bool) -> PyResult<Self> {
        Ok(Self { pose: one_pose(pose, "pose")?, parallel })
    }

    /// Asks about all probes, on all cores or one after the other, without Python's lock.
    fn ask<P: Sync, T: Send>(
        &self,
        py: Python<'_>,
        (mesh, probes): (&Mesh, &[P]),
        batch: impl Fn(&ProbeBatch<'_>) -> Result<Vec<T>, QueryError> + Send + Sync,
        one: impl Fn(&mut Querier, PlacedShape<'_>, &P) -> Result<T, QueryError> + Send + Sync,
    ) -> PyResult<Vec<T>> {
        let placed = mesh.shape().shape().at(&self.pose);
        let parallel = self.parallel;
        py.detach(|| {
            if parallel {
                return batch(&ProbeBatch::new(placed)?);
            }
            with_querier(|querier| probes.iter().map(|probe| one(querier, placed, probe)).collect())
        })
        .map_err(query_error)
    }
}

#[pyfunction]
pub(crate) fn closest_points<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    points: PyReadonlyArray2<'py, f64>,
    within: f64,
    pose: PyReadonlyArray2<'py, f64>,
    parallel: bool,
) -> PyResult<Found<'py>> {
    let points = rows(&points, "points")?;
    let found = Place::new(&pose, parallel)?.ask(
        py,
        (mesh, &points),
        |batch| batch.closest_points(&points, within),
        |querier, shape, &point| querier.closest_point(shape, point, within),
    )?;
    answers::closest(py, found.iter().copied())
}

#[pyfunction]
pub(crate) fn sides<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    points: PyReadonlyArray2<'py, f64>,
    pose: PyReadonlyArray2<'py, f64>,
    parallel: bool,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let points = rows(&points, "points")?;
    let found = Place::new(&pose, parallel)?.ask(
        py,
        (mesh, &points),
        |batch| batch.sides(&points),
        |querier, shape, &point| querier.side(shape, point),
    )?;
    Ok(array(py, found.into_iter().map(|side| side as u8)))
}

/// Reads rays: origins and directions of shape (N, 3), and the greatest parameter of each of shape (N,).
pub(crate) fn rays(
    origins: &PyReadonlyArray2<'_, f64>,
    directions: &PyReadonlyArray2<'_, f64>,
    until: &PyReadonlyArray1<'_, f64>,
) -> PyResult<Vec<Ray>> {
    let (origins, directions) = (rows(origins, "origins")?, rows(directions, "directions")?);
    let until = until.as_slice()?;
    if origins.len() != directions.len() || origins.len() != until.len() {
        return Err(PyValueError::new_err(format!(
            "expected as many directions and ends as origins, found {} origins, {} directions and {} ends",
            origins.len(),
            directions.len(),
            until.len()
        )));
    }
    let both = origins.into_iter().zip(directions).zip(until);
    Ok(both.map(|((origin, direction), &until)| Ray::new(origin, direction).until(until)).collect())
}

#[pyfunction]
pub(crate) fn first_hits<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    until: PyReadonlyArray1<'py, f64>,
    pose: PyReadonlyArray2<'py, f64>,
    parallel: bool,
) -> PyResult<Found<'py>> {
    let rays = rays(&origins, &directions, &until)?;
    let found = Place::new(&pose, parallel)?.ask(
        py,
        (mesh, &rays),
        |batch| batch.first_hits(&rays),
        |querier, shape, ray| querier.first_hit(shape, ray),
    )?;
    answers::hits(py, found.iter().copied())
}

#[pyfunction]
pub(crate) fn any_hits<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    until: PyReadonlyArray1<'py, f64>,
    pose: PyReadonlyArray2<'py, f64>,
    parallel: bool,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let rays = rays(&origins, &directions, &until)?;
    let found = Place::new(&pose, parallel)?.ask(
        py,
        (mesh, &rays),
        |batch| batch.any_hits(&rays),
        |querier, shape, ray| querier.any_hit(shape, ray),
    )?;
    Ok(array(py, found.into_iter()))
}

#[pyfunction]
pub(crate) fn all_hits<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    until: PyReadonlyArray1<'py, f64>,
    pose: PyReadonlyArray2<'py, f64>,
    parallel: bool,
) -> PyResult<Lists<'py, Found<'py>>> {
    let rays = rays(&origins, &directions, &until)?;
    let found = Place::new(&pose, parallel)?.ask(
        py,
        (mesh, &rays),
        |batch| batch.all_hits(&rays),
        |querier, shape, ray| querier.all_hits(shape, ray),
    )?;
    let hits = answers::hits(py, found.iter().flatten().copied().map(Some))?;
    Ok((starts(py, found.iter().map(Vec::len)), hits))
}

/// Reads segments: starts and ends of shape (N, 3).
pub(crate) fn segments(
    starts: &PyReadonlyArray2<'_, f64>,
    ends: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<[[f64; 3]; 2]>> {
    let (starts, ends) = (rows(starts, "starts")?, rows(ends, "ends")?);
    if starts.len() != ends.len() {
        let found = format!("expected as many ends as starts, found {} and {}", ends.len(), starts.len());
        return Err(PyValueError::new_err(found));
    }
    Ok(starts.into_iter().zip(ends).map(|(start, end)| [start, end]).collect())
}

#[pyfunction]
pub(crate) fn meet_segments<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    starts: PyReadonlyArray2<'py, f64>,
    ends: PyReadonlyArray2<'py, f64>,
    pose: PyReadonlyArray2<'py, f64>,
    parallel: bool,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let segments = segments(&starts, &ends)?;
    let found = Place::new(&pose, parallel)?.ask(
        py,
        (mesh, &segments),
        |batch| batch.meet_segments(&segments),
        |querier, shape, &[start, end]| querier.meets_segment(shape, start, end),
    )?;
    Ok(array(py, found.into_iter()))
}
