//! Pages that show meshes and scenes in a browser or in a notebook.

use crate::arguments::{number, pose_or_identity, poses, shape_error};
use crate::asking::detached;
use crate::errors::{bake_error, query_error};
use crate::mesh::Mesh;
use crate::scene::Scene;
use bvh_bake::write_atomically_with;
use cbvh_view::{DEFAULT_MAX_BYTES, Frames, Named, PageError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::collections::HashMap;
use std::path::PathBuf;

/// A page: the files that it shows, and what it shows of them.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Page(cbvh_view::Page);

/// A mesh, the name of its file, and its path.
type Shown<'py> = (PyRef<'py, Mesh>, String, String);

fn named((mesh, name, path): Shown<'_>) -> Named {
    Named { name, path, shape: mesh.shape().clone() }
}

/// The exception of what cannot be shown.
fn page_error(error: PageError) -> PyErr {
    match error {
        PageError::Shape(error) => query_error(error),
        PageError::TooLarge { .. } => {
            let remedy =
                "bake with triangles=\"packed\" or \"quantized\" to make files smaller, or give max_bytes";
            PyValueError::new_err(format!("{error}; {remedy}"))
        }
        error => PyValueError::new_err(error.to_string()),
    }
}

/// Returns a page of at most so many bytes of files, or of as many as most browsers show.
fn limited(page: Result<cbvh_view::Page, PageError>, max_bytes: Option<u64>) -> PyResult<Page> {
    let limit = max_bytes.unwrap_or(DEFAULT_MAX_BYTES);
    page.and_then(|page| page.limited_to(limit)).map(Page).map_err(page_error)
}

#[pymethods]
impl Page {
    /// One mesh alone.
    #[staticmethod]
    fn file(a: Shown<'_>, max_bytes: Option<u64>) -> PyResult<Self> {
        limited(cbvh_view::Page::file(named(a)), max_bytes)
    }

    /// B in the frame of A, which is B as well if there is no other.
    #[staticmethod]
    fn pair(
        a: Shown<'_>,
        b: Option<Shown<'_>>,
        pose: Option<&Bound<'_, PyAny>>,
        within: Option<&Bound<'_, PyAny>>,
        max_bytes: Option<u64>,
    ) -> PyResult<Self> {
        let pose = pose_or_identity(pose, "pose")?;
        let within = within.map(|within| number(within, "within")).transpose()?;
        limited(cbvh_view::Page::pair(named(a), b.map(named), &pose, within), max_bytes)
    }

    /// B on its way between two poses in the frame of A, an array of shape (2, 4, 4).
    #[staticmethod]
    fn motion(
        a: Shown<'_>,
        b: Option<Shown<'_>>,
        ends: &Bound<'_, PyAny>,
        clearance: &Bound<'_, PyAny>,
        tolerance: Option<&Bound<'_, PyAny>>,
        max_bytes: Option<u64>,
    ) -> PyResult<Self> {
        let read = poses(ends, "motion")?;
        let [start, end] = read.rows[..] else {
            return Err(shape_error("motion", "(2, 4, 4)", &[read.rows.len(), 4, 4]));
        };
        let clearance = number(clearance, "clearance")?;
        let tolerance = tolerance.map(|tolerance| number(tolerance, "tolerance")).transpose()?;
        let page = cbvh_view::Page::motion(named(a), b.map(named), [start, end], clearance, tolerance);
        limited(page, max_bytes)
    }

    /// A scene as it is. `files` has the name and the path of the file of each instance, by its number.
    #[staticmethod]
    fn scene(
        py: Python<'_>,
        scene: &Scene,
        files: HashMap<i64, (String, String)>,
        max_bytes: Option<u64>,
    ) -> PyResult<Self> {
        scene.with_snapshot(py, |state| {
            let number_of = |id| state.number(id);
            let file_of = |id| files.get(&number_of(id)).cloned().unwrap_or_default();
            let page = cbvh_view::Page::of_scene(&state.scene, &Frames::default(), file_of, number_of);
            limited(page, max_bytes)
        })
    }

    /// The page as UTF-8.
    fn html<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut html = Vec::new();
        detached(py, || self.0.write(&mut html))?;
        Ok(PyBytes::new(py, &html))
    }

    /// Writes the page to a file that appears complete or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        detached(py, || write_atomically_with(&path, |out| self.0.write(out))).map_err(bake_error)
    }

    /// The bytes of all files in the page, before they are packed.
    fn size(&self) -> u64 {
        self.0.bytes()
    }
}
