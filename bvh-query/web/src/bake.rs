//! Bakes meshes in memory, from arrays and from the bytes of mesh files.

use crate::arguments::{Answer, bytes, refused, room, rows, wrong};
use crate::mesh::Mesh;
use bvh_bake::mesh::Mesh as Triangles;
use bvh_bake::{Effort, MeshFormat, Options, Profile, Rounding, TriangleEncoding, input, to_bytes_with};
use bvh_query::Bvh;
use js_sys::{Float64Array, Function, Reflect, Uint8Array, Uint32Array};
use std::path::Path;
use wasm_bindgen::prelude::*;

/// Finds the value with a given name.
fn named<T>(name: &str, found: Option<String>, known: &[T], name_of: fn(&T) -> &str) -> Answer<Option<T>>
where
    T: Copy,
{
    let Some(found) = found else { return Ok(None) };
    let names = || known.iter().map(name_of).collect::<Vec<_>>().join(", ");
    let of_name = known.iter().find(|one| name_of(one) == found).copied();
    of_name.map(Some).ok_or_else(|| wrong(name, format_args!("expected one of {}, found {found:?}", names())))
}

/// Reads the options of a bake. Their values have the same names on the command line.
fn options(given: &JsValue) -> Answer<Options> {
    let get = |name: &str| Reflect::get(given, &name.into()).unwrap_or(JsValue::UNDEFINED);
    let text = |name: &str| get(name).as_string();
    let profile = named("profile", text("profile"), &Profile::ALL, |profile| profile.name())?;
    let known = &TriangleEncoding::ALL;
    let triangles = named("triangles", text("triangles"), known, |encoding| encoding.name())?;
    let effort = named("effort", text("effort"), &Effort::ALL, |effort| effort.name())?;
    let round = named("round", text("round"), &Rounding::ALL, |round| round.name())?;
    let max_error = get("maxError").as_f64();
    if let Some(found) = max_error {
        if triangles != Some(TriangleEncoding::Quantized) {
            return Err(wrong(
                "maxError",
                "expected triangles \"quantized\" beside it, found other triangles",
            ));
        }
        if !(found.is_finite() && found > 0.0) {
            return Err(wrong("maxError", format_args!("expected a finite length above 0, found {found}")));
        }
    }
    let flag = |name: &str| get(name).as_bool().unwrap_or(true);
    Ok(Options::default()
        .drop_nan(get("dropNan").is_truthy())
        .profile(profile)
        .triangles(triangles)
        .effort(effort.unwrap_or_default())
        .max_error(max_error)
        .round(round.unwrap_or_default())
        .weld(get("weld").as_f64().unwrap_or(0.0))
        .ids(flag("ids"))
        .topology(flag("topology"))
        .radius(get("radius").as_f64().unwrap_or(0.0))
        .solid(get("solid").is_truthy()))
}

/// Bakes a mesh, and calls `onStage` with the name of each stage. An exception thrown there is thrown again after the bake.
pub(crate) fn bake_mesh(mesh: &Triangles, given: &JsValue) -> Result<Mesh, JsValue> {
    let options = options(given)?;
    let told = Reflect::get(given, &"onStage".into()).ok().and_then(|told| told.dyn_into::<Function>().ok());
    let mut thrown = Ok(());
    let baked = to_bytes_with(mesh, &options, "", &mut |stage| {
        if let (Some(told), Ok(())) = (&told, &thrown) {
            thrown = told.call1(&JsValue::UNDEFINED, &stage.name().into()).map(|_| ());
        }
    });
    thrown?;
    let (bytes, _) = baked.map_err(refused)?;
    Ok(Bvh::from_bytes(bytes).map(Mesh::from).map_err(refused)?)
}

/// Bakes a mesh. A triangle is three vertex numbers in `faces` or, without `faces`, the next three vertices.
#[wasm_bindgen]
pub fn bake(vertices: &Float64Array, faces: Option<Uint32Array>, options: &JsValue) -> Result<Mesh, JsValue> {
    let vertices = rows::<3>(vertices, "vertices")?;
    let corners = faces.as_ref().map_or(vertices.len(), |faces| faces.length() as usize);
    if !corners.is_multiple_of(3) {
        let found = format_args!("expected three corners for each triangle, found {corners} corners");
        return Err(wrong(if faces.is_some() { "faces" } else { "vertices" }, found).into());
    }
    let mut triangles = room("faces", [0; 3], corners / 3)?;
    match &faces {
        Some(faces) => faces.copy_to(triangles.as_flattened_mut()),
        None => {
            triangles.as_flattened_mut().iter_mut().zip(0..).for_each(|(corner, number)| *corner = number)
        }
    }
    bake_mesh(&Triangles::from_triangles(vertices, triangles), options)
}

/// Bakes the bytes of a file. Its name tells the format and appears in errors.
#[wasm_bindgen(js_name = bakeFile)]
pub fn bake_file(name: &str, file: &Uint8Array, options: &JsValue) -> Result<Mesh, JsValue> {
    let (path, bytes) = (Path::new(name), bytes(file, name)?);
    let format = MeshFormat::of_file(path, &bytes).map_err(refused)?;
    let mesh = input::read_bytes_with(&bytes, format, path, &self::options(options)?).map_err(refused)?;
    // The bake does not need the file.
    drop(bytes);
    let told =
        Reflect::get(options, &"onWarning".into()).ok().and_then(|told| told.dyn_into::<Function>().ok());
    for warning in told.iter().flat_map(|told| mesh.warnings.iter().map(move |warning| (told, warning))) {
        warning.0.call1(&JsValue::UNDEFINED, &warning.1.into())?;
    }
    bake_mesh(&mesh, options)
}
