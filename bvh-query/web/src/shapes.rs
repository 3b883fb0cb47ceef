//! Makes the meshes of simple shapes: one function for all of them, because each export adds to the module.

use crate::arguments::{refused, wrong};
use crate::bake::bake_mesh;
use crate::mesh::Mesh;
use bvh_bake::ShapeError;
use bvh_bake::shapes::{Circumscribed, cone, cylinder, height_field};
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

/// Bakes the shape of a kind, without a radius and not solid, from the numbers of the shape and a list of further ones.
#[wasm_bindgen(js_name = bakeShape)]
pub fn bake_shape(kind: &str, numbers: &[f64], list: &Float64Array) -> Result<Mesh, JsValue> {
    let mesh = |shape: Circumscribed| shape.mesh;
    let made = match (kind, numbers) {
        ("cylinder", &[radius, length, error]) => cylinder(radius, length, error).map(mesh),
        ("cone", &[radius, height, error]) => cone(radius, height, error).map(mesh),
        ("heightField", &[columns, x, y]) => height_field(columns as usize, &list.to_vec(), [x, y]),
        _ => return Err(wrong("kind", format_args!("expected a shape, found {kind}")).into()),
    };
    // The argument has the name that JavaScript gives it.
    let named = |error: ShapeError| refused(error.to_string().replacen("max_error", "maxError", 1));
    bake_mesh(&made.map_err(named)?, &JsValue::UNDEFINED)
}
