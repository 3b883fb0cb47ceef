//! Simple shapes: cores that are baked in memory. The Python code gives them radii and makes them solid.

use crate::arguments::{self, rows};
use crate::asking::{detached, on_pool};
use crate::errors::{BakeError, bake_error};
use crate::mesh::Mesh;
use bvh_bake::mesh::Mesh as Triangles;
use bvh_bake::shapes::{self, Circumscribed, OctreeCell};
use bvh_bake::{Options, ShapeError, to_bytes};
use bvh_query::Bvh;
use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

fn baked(py: Python<'_>, core: Result<Triangles, ShapeError>) -> PyResult<Mesh> {
    let core = core.map_err(|error| PyValueError::new_err(error.to_string()))?;
    let bake = |stop| to_bytes(&core, &Options::default().stop(Some(stop)));
    let (bytes, _) = detached(py, || on_pool(bake))?.map_err(bake_error)?;
    let opened = Bvh::from_bytes(bytes);
    opened.map(Mesh::new).map_err(|error| BakeError::new_err(error.to_string()))
}

/// A polyhedron, and how far it is from the round shape.
fn around(py: Python<'_>, found: Result<Circumscribed, ShapeError>) -> PyResult<(Mesh, f64)> {
    let found = found.map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok((baked(py, Ok(found.mesh))?, found.error))
}

/// Points of shape (N, 3), which messages call `name`.
#[pyfunction]
pub(crate) fn cloud_core(py: Python<'_>, points: &Bound<'_, PyAny>, name: &str) -> PyResult<Mesh> {
    let points = arguments::points(points, name)?.rows;
    baked(py, Ok(shapes::cloud(&points)))
}

/// A segment between two points.
#[pyfunction]
pub(crate) fn segment_core(py: Python<'_>, start: [f64; 3], end: [f64; 3]) -> PyResult<Mesh> {
    baked(py, Ok(shapes::segment(start, end)))
}

#[pyfunction]
pub(crate) fn block_core(py: Python<'_>, sides: [f64; 3]) -> PyResult<Mesh> {
    baked(py, shapes::block(sides))
}

#[pyfunction]
pub(crate) fn ground_core(py: Python<'_>, sides: [f64; 2], thickness: f64) -> PyResult<Mesh> {
    baked(py, shapes::ground(sides, thickness))
}

#[pyfunction]
pub(crate) fn cylinder_core(
    py: Python<'_>,
    radius: f64,
    length: f64,
    max_error: f64,
) -> PyResult<(Mesh, f64)> {
    around(py, shapes::cylinder(radius, length, max_error))
}

#[pyfunction]
pub(crate) fn cone_core(py: Python<'_>, radius: f64, height: f64, max_error: f64) -> PyResult<(Mesh, f64)> {
    around(py, shapes::cone(radius, height, max_error))
}

/// Heights of shape (rows, columns).
#[pyfunction]
pub(crate) fn height_field_core(
    py: Python<'_>,
    heights: PyReadonlyArray2<'_, f64>,
    cell: [f64; 2],
) -> PyResult<Mesh> {
    let columns = heights.as_array().ncols();
    let heights = heights.as_slice()?.to_vec();
    baked(py, shapes::height_field(columns, &heights, cell))
}

/// Cells of shape (N, 3).
#[pyfunction]
pub(crate) fn voxels_core(py: Python<'_>, cells: PyReadonlyArray2<'_, i32>, side: f64) -> PyResult<Mesh> {
    let cells = cells.as_slice()?.as_chunks::<3>().0.to_vec();
    baked(py, shapes::voxels(&cells, side))
}

/// Cells of shape (N, 4): a corner and a size each.
#[pyfunction]
pub(crate) fn octree_core(py: Python<'_>, cells: PyReadonlyArray2<'_, i64>, side: f64) -> PyResult<Mesh> {
    let rows = cells.as_slice()?.as_chunks::<4>().0;
    // The Python code has checked that numbers are in range.
    let cell = |&[i, j, k, size]: &[i64; 4]| OctreeCell {
        corner: [i as i32, j as i32, k as i32],
        size: size as u32,
    };
    let cells: Vec<OctreeCell> = rows.iter().map(cell).collect();
    baked(py, shapes::octree(&cells, side))
}

/// Points of shape (N, 3).
#[pyfunction]
pub(crate) fn convex_hull_core(py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<Mesh> {
    let points = rows(points, "points")?.rows;
    let hull = detached(py, || shapes::convex_hull(&points));
    baked(py, hull)
}
