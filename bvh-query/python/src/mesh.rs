//! A mesh in a `.cbvh` file, mapped or in memory: what Python code holds.

use crate::answers::table;
use crate::arguments::reserved;
use crate::asking::detached;
use crate::errors::{FormatError, bake_error, open_error, query_error};
use bvh_bake::write_atomically;
use bvh_query::{Bvh, Object, OwnedShape};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;

/// Open edges in the form of Python.
type Found =
    ([u64; 4], [Option<f64>; 3], Vec<(&'static str, u32, Vec<u32>, [[f64; 3]; 2], Option<f64>)>, String);

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

    /// The nine coordinates of each triangle. A duplicate that was left out has the corners of
    /// the triangle that is stored.
    fn corners_by_id(&self) -> PyResult<Vec<f64>> {
        let shape = self.shape.shape();
        if !shape.bvh().layout().has_ids() && shape.objects().len() > 1 {
            let objects = shape.objects().len();
            let message = format!("triangles: expected one object in a file without ids, found {objects}");
            return Err(PyValueError::new_err(message));
        }
        let mut found: Vec<(u32, [[f64; 3]; 3])> = reserved(shape.triangles() as usize)?;
        shape.visit_triangles(|id, corners| found.push((id, corners))).map_err(query_error)?;
        let count = found.iter().map(|&(id, _)| id as usize + 1).max().unwrap_or(0);
        let mut corners = reserved(9 * count)?;
        corners.resize(9 * count, f64::NAN);
        for (id, triangle) in found {
            corners[9 * id as usize..][..9].copy_from_slice(triangle.as_flattened());
        }
        Ok(corners)
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

    /// The same core with a radius.
    fn rounded(&self, radius: f64) -> PyResult<Self> {
        Ok(Self { shape: self.shape.clone().rounded(radius).map_err(query_error)? })
    }

    /// The same mesh, of which the inside counts as well.
    fn solid(&self, py: Python<'_>) -> PyResult<Self> {
        let shape = detached(py, || self.shape.clone().solid()).map_err(query_error)?;
        Ok(Self { shape })
    }

    /// The open edges: the number of each kind and of cracks; the nearest gap, the widest crack and the weld that is proposed, if there
    /// are any; the kind, object, triangles, ends and gap of those that are listed; and a sentence about them.
    fn open_edges(&self, py: Python<'_>) -> PyResult<Found> {
        let edges = detached(py, || self.shape.shape().open_edges()).map_err(query_error)?;
        let kinds = edges.kinds();
        let listed =
            kinds.iter().flat_map(|(kind, of_kind)| of_kind.first.iter().map(move |edge| (*kind, edge)));
        let listed =
            listed.map(|(kind, edge)| (kind, edge.object, edge.triangles.clone(), edge.ends, edge.gap));
        let [boundary, flipped, crowded] = kinds.map(|(_, of_kind)| of_kind.count);
        let gaps = [edges.gaps.nearest, edges.gaps.widest_crack, edges.proposed_weld()];
        Ok(([boundary, flipped, crowded, edges.gaps.cracks], gaps, listed.collect(), edges.to_string()))
    }

    fn radius(&self) -> f64 {
        self.shape.shape().radius()
    }

    fn max_move(&self) -> f64 {
        self.shape.shape().max_move()
    }

    fn is_solid(&self) -> bool {
        self.shape.shape().is_solid()
    }

    /// The names of all objects of the file.
    fn names(&self) -> Vec<String> {
        self.shape.bvh().objects().iter().map(|object| object.name().to_owned()).collect()
    }

    /// The number of triangles stored.
    fn count(&self) -> u64 {
        self.shape.shape().triangles()
    }

    /// The corners of all triangles, shape (T, 3, 3): row `id` is triangle `id`, and rows of no triangle are NaN.
    fn corners<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let corners = detached(py, || self.corners_by_id())?;
        let count = corners.len() / 9;
        PyArray1::from_vec(py, corners).reshape([count, 3, 3])
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
    fn bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.shape.bytes().map_err(query_error)?))
    }

    /// Writes the bytes to a file that appears complete or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let bytes = self.shape.bytes().map_err(query_error)?;
        detached(py, || write_atomically(&path, &bytes)).map_err(bake_error)
    }

    /// The number of bytes of the file.
    fn size(&self) -> usize {
        self.shape.bvh().bytes().len()
    }

    /// Checks the whole file.
    fn validate(&self, py: Python<'_>) -> PyResult<()> {
        detached(py, || self.shape.bvh().validate()).map_err(query_error)
    }
}
