//! Answers in the form of Python: plain values for a single question, and arrays of N elements or rows for N questions.
//!
//! An answer of several parts is a tuple. An answer that may be missing begins with a bool; if it is missing, the other
//! parts are NaN and 0.

use bvh_query::{
    Clash, ClosestPoint, Contact, ContactRegion, Distance, Intersection, IntersectionSurface, MotionAnswer,
    Patches, Penetration, Pose, RayHit, SignedDistance,
};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

/// Makes answers to one question alone, or to N.
#[derive(Clone, Copy)]
pub(crate) struct Answers<'py> {
    pub(crate) py: Python<'py>,
    pub(crate) one: bool,
}

impl<'py> Answers<'py> {
    /// A value, or an array of shape (N,).
    pub(crate) fn values<T: Element + IntoPyObject<'py>>(
        self,
        mut of: impl Iterator<Item = T>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.one
            && let Some(value) = of.next()
        {
            return value.into_bound_py_any(self.py);
        }
        Ok(array(self.py, of).into_any())
    }

    /// An array of shape (K,) or (N, K).
    pub(crate) fn rows<T: Element, const K: usize>(
        self,
        mut of: impl Iterator<Item = [T; K]>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.one
            && let Some(row) = of.next()
        {
            return Ok(PyArray1::from_slice(self.py, &row).into_any());
        }
        Ok(table(self.py, of)?.into_any())
    }

    /// Poses of shape (4, 4) or (N, 4, 4).
    pub(crate) fn poses(self, of: &[Pose]) -> PyResult<Bound<'py, PyAny>> {
        let flat: Vec<f64> = of.iter().flat_map(matrix).collect();
        let flat = PyArray1::from_vec(self.py, flat);
        let shaped = if self.one {
            flat.reshape([4, 4])?.into_any()
        } else {
            flat.reshape([of.len(), 4, 4])?.into_any()
        };
        Ok(shaped)
    }

    /// What `make` makes of the rows that each question found, or a list of that.
    pub(crate) fn lists<T>(
        self,
        of: &[T],
        make: impl Fn(&T) -> PyResult<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.one
            && let Some(rows) = of.first()
        {
            return make(rows);
        }
        let lists = of.iter().map(make).collect::<PyResult<Vec<_>>>()?;
        Ok(PyList::new(self.py, lists)?.into_any())
    }
}

/// An array of shape (N,).
pub(crate) fn array<T: Element>(py: Python<'_>, of: impl Iterator<Item = T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, of.collect())
}

/// An array of shape (N, K).
pub(crate) fn table<T: Element, const K: usize>(
    py: Python<'_>,
    of: impl Iterator<Item = [T; K]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let flat: Vec<T> = of.flatten().collect();
    let rows = flat.len() / K;
    PyArray1::from_vec(py, flat).reshape([rows, K])
}

pub(crate) fn matrix(pose: &Pose) -> [f64; 16] {
    let (r, t) = (pose.rotation(), pose.translation());
    let row = |k: usize| [r[k][0], r[k][1], r[k][2], t[k]];
    let mut matrix = [0.0; 16];
    for k in 0..3 {
        matrix[4 * k..4 * k + 4].copy_from_slice(&row(k));
    }
    matrix[15] = 1.0;
    matrix
}

/// Distance, lower and upper bound, points of A and B, object and triangle of A, and of B.
pub(crate) fn distances<'py>(
    to: Answers<'py>,
    of: impl Iterator<Item = Option<Distance>> + Clone,
) -> PyResult<Bound<'py, PyTuple>> {
    let numbers =
        |part: fn(Distance) -> f64| to.values(of.clone().map(|answer| answer.map_or(f64::NAN, part)));
    let points =
        |part: fn(Distance) -> [f64; 3]| to.rows(of.clone().map(|answer| answer.map_or([f64::NAN; 3], part)));
    let ids = |part: fn(Distance) -> u32| to.values(of.clone().map(|answer| answer.map_or(0, part)));
    (
        numbers(|answer| answer.distance)?,
        numbers(|answer| answer.lower)?,
        numbers(|answer| answer.upper)?,
        points(|answer| answer.point_a)?,
        points(|answer| answer.point_b)?,
        ids(|answer| answer.object_a)?,
        ids(|answer| answer.triangle_a)?,
        ids(|answer| answer.object_b)?,
        ids(|answer| answer.triangle_b)?,
    )
        .into_pyobject(to.py)
}

/// The numbers of the kinds of answers about motions.
pub(crate) const FREE: u8 = 0;
pub(crate) const HIT: u8 = 1;
pub(crate) const NEAR: u8 = 2;

/// Kind, time until which the path is free, time of the contact or of the first undecided pose, and the distance there.
pub(crate) fn motions<'py>(to: Answers<'py>, of: &[MotionAnswer]) -> PyResult<Bound<'py, PyTuple>> {
    let rows: Vec<_> = of
        .iter()
        .map(|answer| match *answer {
            MotionAnswer::Free => (FREE, 1.0, f64::NAN, None),
            MotionAnswer::Hit { free_until, touching_at, nearest } => {
                (HIT, free_until, touching_at, Some(nearest))
            }
            MotionAnswer::Near { free_until, at, nearest } => (NEAR, free_until, at, Some(nearest)),
        })
        .collect();
    (
        to.values(rows.iter().map(|row| row.0))?,
        to.values(rows.iter().map(|row| row.1))?,
        to.values(rows.iter().map(|row| row.2))?,
        distances(to, rows.iter().map(|row| row.3))?,
    )
        .into_pyobject(to.py)
}

/// Object and triangle of A, and of B.
pub(crate) fn triangles(contact: &Contact) -> [u32; 4] {
    [contact.object_a, contact.triangle_a, contact.object_b, contact.triangle_b]
}

/// Lower and upper bound, translation, common point and radii of the balls about it, and whether the search was ended early.
pub(crate) fn penetrations<'py>(
    to: Answers<'py>,
    of: impl Iterator<Item = Option<Penetration>> + Clone,
) -> PyResult<Bound<'py, PyTuple>> {
    let numbers = |part: fn(Penetration) -> f64| to.values(of.clone().map(|of| of.map_or(f64::NAN, part)));
    let points =
        |part: fn(Penetration) -> [f64; 3]| to.rows(of.clone().map(|of| of.map_or([f64::NAN; 3], part)));
    (
        numbers(|of| of.lower)?,
        numbers(|of| of.upper)?,
        points(|of| of.translation)?,
        points(|of| of.point)?,
        to.rows(of.clone().map(|of| of.map_or([f64::NAN; 2], |of| of.radii)))?,
        to.values(of.clone().map(|of| of.is_some_and(|of| of.is_spent)))?,
    )
        .into_pyobject(to.py)
}

/// Lower and upper bound, normal, points of A and B, translation, whether there is a depth, and whether the search was ended early.
/// Where nothing is near, the bounds are infinite.
pub(crate) fn signed_distances<'py>(
    to: Answers<'py>,
    of: impl Iterator<Item = Option<SignedDistance>> + Clone,
) -> PyResult<Bound<'py, PyTuple>> {
    let numbers =
        |part: fn(SignedDistance) -> f64| to.values(of.clone().map(|of| of.map_or(f64::INFINITY, part)));
    let points =
        |part: fn(SignedDistance) -> [f64; 3]| to.rows(of.clone().map(|of| of.map_or([f64::NAN; 3], part)));
    (
        numbers(|of| of.lower)?,
        numbers(|of| of.upper)?,
        points(|of| of.normal)?,
        points(|of| of.point_a)?,
        points(|of| of.point_b)?,
        points(|of| of.translation)?,
        to.values(of.clone().map(|of| of.is_some_and(|of| of.is_signed)))?,
        to.values(of.clone().map(|of| of.is_some_and(|of| of.is_spent)))?,
    )
        .into_pyobject(to.py)
}

/// Volume and its error, areas of A and B, box, and the pierced thickness of A and B.
pub(crate) fn intersections<'py>(
    to: Answers<'py>,
    of: impl Iterator<Item = Option<Intersection>> + Clone,
) -> PyResult<Bound<'py, PyTuple>> {
    let numbers = |part: fn(Intersection) -> f64| to.values(of.clone().map(|of| of.map_or(f64::NAN, part)));
    let boxes: Vec<f64> = of
        .clone()
        .flat_map(|of| of.and_then(|of| of.bounds).unwrap_or([[f64::NAN; 3]; 2]))
        .flatten()
        .collect();
    let count = boxes.len() / 6;
    let boxes = PyArray1::from_vec(to.py, boxes);
    let boxes =
        if to.one { boxes.reshape([2, 3])?.into_any() } else { boxes.reshape([count, 2, 3])?.into_any() };
    (
        numbers(|of| of.volume)?,
        numbers(|of| of.volume_error)?,
        numbers(|of| of.area_a)?,
        numbers(|of| of.area_b)?,
        boxes,
        numbers(|of| of.pierced_a.unwrap_or(f64::NAN))?,
        numbers(|of| of.pierced_b.unwrap_or(f64::NAN))?,
    )
        .into_pyobject(to.py)
}

/// Points, the corners of each loop, and the loops of each polygon.
pub(crate) fn surface<'py>(py: Python<'py>, of: &IntersectionSurface) -> PyResult<Bound<'py, PyTuple>> {
    let points = table(py, of.points.iter().copied())?;
    (points, array(py, of.loops.iter().copied()), array(py, of.polygons.iter().copied())).into_pyobject(py)
}

/// Class, relation, distance, point, the parts of the depth, and those of the intersection or, if nobody asked for these, `None`.
pub(crate) fn clashes<'py>(
    to: Answers<'py>,
    of: impl Iterator<Item = Clash> + Clone,
    with_magnitudes: bool,
) -> PyResult<Bound<'py, PyTuple>> {
    let shared = of.clone().map(|of| of.magnitudes);
    let shared = with_magnitudes.then(|| intersections(to, shared)).transpose()?;
    (
        to.values(of.clone().map(|of| of.class as u8))?,
        to.values(of.clone().map(|of| of.relation as u8))?,
        to.values(of.clone().map(|of| of.distance))?,
        to.rows(of.clone().map(|of| of.point))?,
        penetrations(to, of.map(|of| of.depth))?,
        shared,
    )
        .into_pyobject(to.py)
}

/// Triangles, kind, count and points (the rest NaN), normals, error and overlap of each region, and the number of all contacts.
pub(crate) fn regions<'py>(
    py: Python<'py>,
    of: &[ContactRegion],
    total: u64,
) -> PyResult<Bound<'py, PyTuple>> {
    let points = of.iter().flat_map(|of| {
        let mut points = [[f64::NAN; 3]; 6];
        points.iter_mut().zip(of.points()).for_each(|(to, point)| *to = *point);
        points
    });
    (
        table(py, of.iter().map(|of| triangles(&of.contact)))?,
        array(py, of.iter().map(|of| of.kind as u8)),
        array(py, of.iter().map(|of| of.count)),
        table(py, points)?.reshape([of.len(), 6, 3])?,
        table(py, of.iter().map(|of| of.normal_a))?,
        table(py, of.iter().map(|of| of.normal_b))?,
        array(py, of.iter().map(|of| of.error)),
        array(py, of.iter().map(|of| of.overlap)),
        total,
    )
        .into_pyobject(py)
}

/// Centre, normal, length, area, depth, first and count of each patch, the regions in their order, and first and count of each
/// patch's points, the points, their normals and depths.
pub(crate) fn patches<'py>(py: Python<'py>, of: &Patches) -> PyResult<Bound<'py, PyTuple>> {
    let patches = || of.patches.iter();
    let points = (
        array(py, patches().map(|of| of.first_point as i64)),
        array(py, patches().map(|of| of.point_count as i64)),
        table(py, of.points.iter().map(|of| of.point))?,
        table(py, of.points.iter().map(|of| of.normal))?,
        array(py, of.points.iter().map(|of| of.depth)),
    );
    (
        table(py, patches().map(|of| of.center))?,
        table(py, patches().map(|of| of.normal))?,
        array(py, patches().map(|of| of.length)),
        array(py, patches().map(|of| of.area)),
        array(py, patches().map(|of| of.depth)),
        array(py, patches().map(|of| of.first as i64)),
        array(py, patches().map(|of| of.count as i64)),
        regions(py, &of.regions, of.total)?,
        points,
    )
        .into_pyobject(py)
}

/// Distance or parameter with its bounds, point, object and triangle of one answer.
type Row = ([f64; 3], [f64; 3], u32, u32);

/// Whether there is one, distance, its lower and upper bound, point, object and triangle.
pub(crate) fn closest<'py>(
    to: Answers<'py>,
    of: impl Iterator<Item = Option<ClosestPoint>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let row = |c: ClosestPoint| ([c.distance, c.lower, c.upper], c.point, c.object, c.triangle);
    found(to, of.map(|answer| answer.map(row)).collect())
}

/// Whether there is one, parameter, its lower and upper bound, point, object and triangle.
pub(crate) fn hits<'py>(
    to: Answers<'py>,
    of: impl Iterator<Item = Option<RayHit>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let row = |hit: RayHit| ([hit.t, hit.lower, hit.upper], hit.point, hit.object, hit.triangle);
    found(to, of.map(|answer| answer.map(row)).collect())
}

fn found<'py>(to: Answers<'py>, of: Vec<Option<Row>>) -> PyResult<Bound<'py, PyTuple>> {
    let rows = || of.iter().map(|row| row.unwrap_or(([f64::NAN; 3], [f64::NAN; 3], 0, 0)));
    (
        to.values(of.iter().map(Option::is_some))?,
        to.values(rows().map(|row| row.0[0]))?,
        to.values(rows().map(|row| row.0[1]))?,
        to.values(rows().map(|row| row.0[2]))?,
        to.rows(rows().map(|row| row.1))?,
        to.values(rows().map(|row| row.2))?,
        to.values(rows().map(|row| row.3))?,
    )
        .into_pyobject(to.py)
}
