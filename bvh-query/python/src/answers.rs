//! Answers as tuples of arrays, one element or row per question.
//!
//! Answers that may be missing have an array of bool in front; the other arrays hold NaN and 0 where there is none.

use crate::arrays::{array, table};
use bvh_query::{ClosestPoint, Contact, Distance, MotionAnswer, RayHit};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

type Numbers<'py> = Bound<'py, PyArray1<f64>>;
type Points<'py> = Bound<'py, PyArray2<f64>>;
type Ids<'py> = Bound<'py, PyArray1<u32>>;

/// Distance, lower and upper bound, points of A and B, object and triangle of A, and of B.
pub(crate) type Distances<'py> = (
    Numbers<'py>,
    Numbers<'py>,
    Numbers<'py>,
    Points<'py>,
    Points<'py>,
    Ids<'py>,
    Ids<'py>,
    Ids<'py>,
    Ids<'py>,
);

pub(crate) fn distances<'py>(
    py: Python<'py>,
    of: impl Iterator<Item = Option<Distance>> + Clone,
) -> PyResult<Distances<'py>> {
    let numbers =
        |of_one: fn(Distance) -> f64| array(py, of.clone().map(|answer| answer.map_or(f64::NAN, of_one)));
    let points = |of_one: fn(Distance) -> [f64; 3]| {
        table(py, of.clone().map(|answer| answer.map_or([f64::NAN; 3], of_one)))
    };
    let ids = |of_one: fn(Distance) -> u32| array(py, of.clone().map(|answer| answer.map_or(0, of_one)));
    Ok((
        numbers(|answer| answer.distance),
        numbers(|answer| answer.lower),
        numbers(|answer| answer.upper),
        points(|answer| answer.point_a)?,
        points(|answer| answer.point_b)?,
        ids(|answer| answer.object_a),
        ids(|answer| answer.triangle_a),
        ids(|answer| answer.object_b),
        ids(|answer| answer.triangle_b),
    ))
}

/// The numbers of the kinds of answers about motions.
pub(crate) const FREE: u8 = 0;
pub(crate) const HIT: u8 = 1;
pub(crate) const NEAR: u8 = 2;

/// Kind, time until which the way is free, time of the contact or of the first undecided pose, and the distance there.
pub(crate) type Motions<'py> = (Bound<'py, PyArray1<u8>>, Numbers<'py>, Numbers<'py>, Distances<'py>);

pub(crate) fn motions<'py>(py: Python<'py>, of: &[MotionAnswer]) -> PyResult<Motions<'py>> {
    let rows: Vec<_> = of
        .iter()
        .map(|answer| match *answer {
            MotionAnswer::Free => (FREE, 1.0, f64::NAN, None),
            MotionAnswer::Hit { free_until, touching_at, contact } => {
                (HIT, free_until, touching_at, Some(contact))
            }
            MotionAnswer::Near { free_until, at, distance } => (NEAR, free_until, at, Some(distance)),
        })
        .collect();
    Ok((
        array(py, rows.iter().map(|row| row.0)),
        array(py, rows.iter().map(|row| row.1)),
        array(py, rows.iter().map(|row| row.2)),
        distances(py, rows.iter().map(|row| row.3))?,
    ))
}

/// Where the rows of each question start, and the rows of all.
pub(crate) type Lists<'py, T> = (Bound<'py, PyArray1<i64>>, T);

pub(crate) fn starts<'py>(
    py: Python<'py>,
    lengths: impl Iterator<Item = usize>,
) -> Bound<'py, PyArray1<i64>> {
    let mut end = 0;
    array(
        py,
        std::iter::once(0).chain(lengths.map(|length| {
            end += length as i64;
            end
        })),
    )
}

/// Rows of object and triangle of A, and of B.
pub(crate) fn contacts<'py>(
    py: Python<'py>,
    of: &[Vec<Contact>],
) -> PyResult<Lists<'py, Bound<'py, PyArray2<u32>>>> {
    Ok((starts(py, of.iter().map(Vec::len)), table(py, of.iter().flatten().map(triangles))?))
}

/// Object and triangle of A, and of B.
pub(crate) fn triangles(contact: &Contact) -> [u32; 4] {
    [contact.object_a, contact.triangle_a, contact.object_b, contact.triangle_b]
}

/// Whether there is an answer; distance or parameter, its lower and upper bound, point, object and triangle.
pub(crate) type Found<'py> =
    (Bound<'py, PyArray1<bool>>, Numbers<'py>, Numbers<'py>, Numbers<'py>, Points<'py>, Ids<'py>, Ids<'py>);

/// Distance or parameter with its bounds, point, object and triangle of one answer.
type Row = ([f64; 3], [f64; 3], u32, u32);

pub(crate) fn closest<'py>(
    py: Python<'py>,
    of: impl Iterator<Item = Option<ClosestPoint>>,
) -> PyResult<Found<'py>> {
    let row = |c: ClosestPoint| ([c.distance, c.lower, c.upper], c.point, c.object, c.triangle);
    found(py, of.map(|answer| answer.map(row)).collect())
}

pub(crate) fn hits<'py>(py: Python<'py>, of: impl Iterator<Item = Option<RayHit>>) -> PyResult<Found<'py>> {
    let row = |hit: RayHit| ([hit.t, hit.lower, hit.upper], hit.point, hit.object, hit.triangle);
    found(py, of.map(|answer| answer.map(row)).collect())
}

fn found(py: Python<'_>, of: Vec<Option<Row>>) -> PyResult<Found<'_>> {
    let rows = || of.iter().map(|row| row.unwrap_or(([f64::NAN; 3], [f64::NAN; 3], 0, 0)));
    Ok((
        array(py, of.iter().map(Option::is_some)),
        array(py, rows().map(|row| row.0[0])),
        array(py, rows().map(|row| row.0[1])),
        array(py, rows().map(|row| row.0[2])),
        table(py, rows().map(|row| row.1))?,
        array(py, rows().map(|row| row.2)),
        array(py, rows().map(|row| row.3)),
    ))
}
