//! Questions about two meshes in many poses.

use crate::answers;
use crate::arguments::{Answer, poses, refused, with_querier};
use crate::mesh::Mesh;
use bvh_query::{DistanceOptions, Pose, Querier, QueryError, Shape};
use js_sys::{Array, Float64Array, Uint8Array};
use wasm_bindgen::prelude::*;

/// Asks about all poses, one after the other.
pub(crate) fn ask<T>(
    meshes: [&Mesh; 2],
    array: &Float64Array,
    mut one: impl FnMut(&mut Querier, [Shape<'_>; 2], &Pose) -> Result<T, QueryError>,
) -> Answer<Vec<T>> {
    let (poses, shapes) = (poses(array, "poses")?, meshes.map(|mesh| mesh.shape.shape()));
    with_querier(|querier| poses.iter().map(|pose| one(querier, shapes, pose).map_err(refused)).collect())
}

#[wasm_bindgen]
pub fn collide(a: &Mesh, b: &Mesh, poses: &Float64Array) -> Answer<Uint8Array> {
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.collide(a, b, pose))?;
    Ok(answers::small(found.into_iter().map(u8::from)))
}

#[wasm_bindgen]
pub fn within(a: &Mesh, b: &Mesh, poses: &Float64Array, d: f64) -> Answer<Uint8Array> {
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.within(a, b, pose, d))?;
    Ok(answers::small(found.into_iter().map(u8::from)))
}

/// The numbers of `Relation`.
#[wasm_bindgen]
pub fn relation(a: &Mesh, b: &Mesh, poses: &Float64Array) -> Answer<Uint8Array> {
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.relation(a, b, pose))?;
    Ok(answers::small(found.into_iter().map(|relation| relation as u8)))
}

#[wasm_bindgen]
pub fn distance(
    a: &Mesh,
    b: &Mesh,
    poses: &Float64Array,
    relative_error: f64,
    absolute_error: f64,
) -> Answer<Array> {
    let options = DistanceOptions::new().rel_err(relative_error).abs_err(absolute_error);
    let found =
        ask([a, b], poses, |querier, [a, b], pose| querier.distance_with(a, b, pose, &options).map(Some))?;
    Ok(answers::distances(&found))
}

/// A list with an array for each pose.
#[wasm_bindgen]
pub fn contacts(a: &Mesh, b: &Mesh, poses: &Float64Array) -> Answer<Array> {
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.contacts(a, b, pose))?;
    Ok(found.iter().map(|found| JsValue::from(answers::contacts(found.iter()))).collect())
}
