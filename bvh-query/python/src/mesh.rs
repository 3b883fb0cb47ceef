//! A mesh in a `.cbvh` file, mapped or in memory: what Python code holds.

use crate::answers::table;
use crate::asking::detached;
use crate::errors::{FormatError, bake_error, open_error};
use bvh_bake::write_atomically;
use bvh_query::{Bvh, Object, OwnedShape};
use numpy::PyArray2;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;

/// All objects of a file, or one of them.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Mesh {
    shape: OwnedShape,
}

impl Mesh {
    pub(crate) fn new(bvh: Bvh) -> Self {
        Self { shape: bvh.into() }
    }

    pub(crate) fn of(shape: OwnedShape) -> Self {
        Self { shape }
    }

    pub(crate) fn shape(&self) -> &OwnedShape {
        &self.shape
    }
}

#[pymethods]
impl Mesh {
    /// Maps a file, of which the caller promises that nobody changes it while it is open.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        // SAFETY: the documentation of `cbvh.open` asks for it.
        detached(py, || unsafe { Bvh::map(path) }).map(Self::new).map_err(open_error)
    }

    /// Opens the bytes of a file, which are copied.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        let opened = Bvh::from_bytes(bytes.to_vec());
        opened.map(Self::new).map_err(|error| FormatError::new_err(error.to_string()))
    }

    /// One object of the file.
    fn object(&self, number: i64) -> PyResult<Self> {
        let bvh = self.shape.bvh().clone();
        let objects = bvh.objects().len();
        let shape = usize::try_from(number).ok().and_then(|number| OwnedShape::object(bvh, number));
        let shape = shape.ok_or_else(|| {
            PyIndexError::new_err(format!("object: expected a number below {objects}, found {number}"))
        })?;
        Ok(Self { shape })
    }

    /// The names of all objects of the file.
    fn names(&self) -> Vec<String> {
        self.shape.bvh().objects().iter().map(|object| object.name().to_owned()).collect()
    }

    /// The triangles stored.
    fn triangles(&self) -> u64 {
        self.shape.shape().triangles()
    }

    /// The lower and the upper corner of the box of all objects.
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let boxes = self.shape.shape().objects().iter().map(Object::bounding_box);
        let joined = boxes.reduce(|[lo_a, hi_a], [lo_b, hi_b]| {
            [0, 1].map(|end| {
                [0, 1, 2].map(|k| if end == 0 { lo_a[k].min(lo_b[k]) } else { hi_a[k].max(hi_b[k]) })
            })
        });
        table(py, joined.into_iter().flatten())
    }

    /// The bytes of the file.
    fn bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.shape.bvh().bytes())
    }

    /// Writes the bytes to a file that appears complete or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        detached(py, || write_atomically(&path, self.shape.bvh().bytes())).map_err(bake_error)
    }

    /// The number of bytes of the file.
    fn size(&self) -> usize {
        self.shape.bvh().bytes().len()
    }

    /// Checks the whole file.
    fn validate(&self, py: Python<'_>) -> PyResult<()> {
        detached(py, || self.shape.bvh().validate()).map_err(crate::errors::query_error)
    }
}
