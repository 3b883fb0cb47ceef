//! Questions about motions of one mesh past another.

use crate::answers::{distances, floats, small};
use crate::arguments::{Answer, refused, with_querier};
use crate::mesh::Mesh;
use crate::paths::read;
use bvh_query::{MotionAnswer, MotionOptions, Querier, QueryError, RigidPath};
use js_sys::{Array, Float64Array, Uint8Array};
use wasm_bindgen::prelude::*;

/// The numbers of `MotionKind`.
pub(crate) const FREE: u8 = 0;
pub(crate) const HIT: u8 = 1;
pub(crate) const NEAR: u8 = 2;

/// What counts as a hit, and how exactly time is searched.
pub(crate) fn options(clearance: f64, tolerance: Option<f64>) -> MotionOptions {
    MotionOptions::new().clearance(clearance).tolerance(tolerance)
}

/// Asks about all paths, one after the other.
fn ask<T>(
    kind: u8,
    numbers: &Float64Array,
    one: impl Fn(&mut Querier, &dyn RigidPath) -> Result<T, QueryError>,
) -> Answer<Vec<T>> {
    let paths = read(kind, numbers)?;
    with_querier(|querier| paths.iter().map(|path| one(querier, path.as_ref()).map_err(refused)).collect())
}

/// Kind, time until which the path is free, time of the contact or of the first undecided pose, and the distance there.
#[wasm_bindgen]
pub fn motion(
    a: &Mesh,
    b: &Mesh,
    kind: u8,
    numbers: &Float64Array,
    clearance: f64,
    tolerance: Option<f64>,
) -> Answer<Array> {
    let options = options(clearance, tolerance);
    let found = ask(kind, numbers, |querier, path| querier.motion(&a.shape, &b.shape, path, &options))?;
    let row = |answer: MotionAnswer| match answer {
        MotionAnswer::Free => (FREE, 1.0, f64::NAN, None),
        MotionAnswer::Hit { free_until, touching_at, nearest } => {
            (HIT, free_until, touching_at, Some(nearest))
        }
        MotionAnswer::Near { free_until, at, nearest } => (NEAR, free_until, at, Some(nearest)),
    };
    let rows: Vec<_> = found.into_iter().map(row).collect();
    let nearest: Vec<_> = rows.iter().map(|row| row.3).collect();
    let times = [floats(rows.iter().map(|row| row.1)), floats(rows.iter().map(|row| row.2))];
    let kinds = JsValue::from(small(rows.iter().map(|row| row.0)));
    Ok(std::iter::once(kinds).chain(times).chain([distances(&nearest).into()]).collect())
}

#[wasm_bindgen(js_name = isFree)]
pub fn is_free(
    a: &Mesh,
    b: &Mesh,
    kind: u8,
    numbers: &Float64Array,
    clearance: f64,
    tolerance: Option<f64>,
) -> Answer<Uint8Array> {
    let options = options(clearance, tolerance);
    let found = ask(kind, numbers, |querier, path| querier.is_free(&a.shape, &b.shape, path, &options))?;
    Ok(small(found.into_iter().map(u8::from)))
}
