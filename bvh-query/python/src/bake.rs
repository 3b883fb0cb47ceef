//! Bakes meshes: arrays into memory, and files into files of any size.

use crate::arguments::{rows, shape_error};
use crate::asking::{detached, on_pool};
use crate::errors::{BakeError, bake_error};
use crate::mesh::Mesh;
use bvh_bake::mesh::Mesh as Triangles;
use bvh_bake::{Effort, FileBake, Options, Outcome, Profile, Rounding, TriangleEncoding, to_bytes};
use bvh_query::Bvh;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// The options of the command line that have the same names there.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct BakeOptions {
    profile: Option<String>,
    triangles: Option<String>,
    max_error: Option<f64>,
    round: Option<String>,
    weld: f64,
    effort: Option<String>,
    ids: bool,
    topology: bool,
    radius: f64,
    solid: bool,
    drop_nan: bool,
}

impl BakeOptions {
    fn read(&self) -> PyResult<Options> {
        let unknown = |name: &str, found: &str, known: &[&str]| {
            let known = known.join(", ");
            PyValueError::new_err(format!("{name}: expected one of {known}, found {found:?}"))
        };
        let mut options = Options::default()
            .max_error(self.max_error)
            .weld(self.weld)
            .ids(self.ids)
            .topology(self.topology)
            .radius(self.radius)
            .solid(self.solid)
            .drop_nan(self.drop_nan);
        if let Some(name) = &self.profile {
            let profile = Profile::from_name(name);
            let known = Profile::ALL.map(Profile::name);
            options = options.profile(profile.ok_or_else(|| unknown("profile", name, &known))?);
        }
        if let Some(name) = &self.triangles {
            let encoding = TriangleEncoding::ALL.into_iter().find(|encoding| encoding.name() == name);
            let known = TriangleEncoding::ALL.map(TriangleEncoding::name);
            options = options.triangles(encoding.ok_or_else(|| unknown("triangles", name, &known))?);
        }
        if let Some(name) = &self.round {
            let round = Rounding::from_name(name);
            options = options
                .round(round.ok_or_else(|| unknown("round", name, &Rounding::ALL.map(Rounding::name)))?);
        }
        if let Some(name) = &self.effort {
            let effort = Effort::from_name(name);
            options = options.effort(effort.ok_or_else(|| unknown("effort", name, &["quick", "default"]))?);
        }
        Ok(options)
    }
}

/// Bakes arrays of shape (V, 3) and (F, 3) in memory.
#[pyfunction]
pub(crate) fn bake(
    py: Python<'_>,
    vertices: &Bound<'_, PyAny>,
    faces: PyReadonlyArray2<'_, u32>,
    options: BakeOptions,
) -> PyResult<Mesh> {
    let options = options.read()?;
    let [_, 3] = *faces.shape() else { return Err(shape_error("faces", "(F, 3)", faces.shape())) };
    let faces = faces.as_slice()?.as_chunks::<3>().0.to_vec();
    let vertices = rows(vertices, "vertices")?.rows;
    let bake = |stop| to_bytes(&Triangles::from_triangles(vertices, faces), &options.stop(Some(stop)));
    let (bytes, _) = detached(py, || on_pool(bake))?.map_err(bake_error)?;
    let opened = Bvh::from_bytes(bytes);
    opened.map(Mesh::new).map_err(|error| BakeError::new_err(error.to_string()))
}

/// Bakes mesh files into a file. Returns the warnings of their readers.
#[pyfunction]
pub(crate) fn bake_files(
    py: Python<'_>,
    inputs: Vec<PathBuf>,
    output: PathBuf,
    options: BakeOptions,
    max_memory: Option<u64>,
    force: bool,
) -> PyResult<Vec<String>> {
    let options = options.read()?;
    let bake = |stop| {
        let bake = FileBake::new(inputs, output).options(options.stop(Some(stop)));
        bake.max_memory(max_memory).force(force).run()
    };
    let outcome = detached(py, || on_pool(bake))?.map_err(bake_error)?;
    Ok(match outcome {
        Outcome::Baked(report) => report.warnings,
        Outcome::UpToDate(_) => Vec::new(),
    })
}
