//! Questions about many points, rays or segments near one mesh. Without a pose, they are in the frame of the mesh.

use crate::answers::{self, closest_row, hit_row};
use crate::arguments::{Answer, pose_or_identity, refused, rows, same_count, with_querier};
use crate::mesh::Mesh;
use bvh_query::{PlacedShape, Querier, QueryError, Ray, RayHit};
use js_sys::{Array, Float64Array, Int8Array, Uint8Array};
use wasm_bindgen::prelude::*;

/// Asks about all probes, one after the other.
fn ask<T, P>(
    mesh: &Mesh,
    pose: Option<&Float64Array>,
    probes: &[P],
    one: impl Fn(&mut Querier, PlacedShape<'_>, &P) -> Result<T, QueryError>,
) -> Answer<Vec<T>> {
    let placed = mesh.shape.shape().at(&pose_or_identity(pose)?);
    with_querier(|querier| probes.iter().map(|probe| one(querier, placed, probe).map_err(refused)).collect())
}

/// The rays of a question, which consumes them.
#[wasm_bindgen]
pub struct Rays {
    pub(crate) rays: Vec<Ray>,
}

#[wasm_bindgen]
impl Rays {
    /// Reads N origins, N directions, and N greatest parameters or one for all rays.
    #[wasm_bindgen(constructor)]
    pub fn new(origins: &Float64Array, directions: &Float64Array, until: &Float64Array) -> Answer<Rays> {
        let (origins, directions) = (rows::<3>(origins, "origins")?, rows::<3>(directions, "directions")?);
        let until = rows::<1>(until, "until")?;
        same_count("directions", directions.len(), "origins", origins.len())?;
        if until.len() != 1 {
            same_count("until", until.len(), "origins", origins.len())?;
        }
        let rays = origins.into_iter().zip(directions).zip(until.iter().cycle());
        let rays = rays.map(|((origin, direction), &[until])| Ray::new(origin, direction).until(until));
        Ok(Self { rays: rays.collect() })
    }
}

/// Reads segments: N starts and N ends.
pub(crate) fn segments(starts: &Float64Array, ends: &Float64Array) -> Answer<Vec<[[f64; 3]; 2]>> {
    let (starts, ends) = (rows::<3>(starts, "starts")?, rows::<3>(ends, "ends")?);
    same_count("ends", ends.len(), "starts", starts.len())?;
    Ok(starts.into_iter().zip(ends).map(|(start, end)| [start, end]).collect())
}

#[wasm_bindgen(js_name = closestPoints)]
pub fn closest_points(
    mesh: &Mesh,
    pose: Option<Float64Array>,
    points: &Float64Array,
    within: f64,
) -> Answer<Array> {
    let points = rows::<3>(points, "points")?;
    let found = ask(mesh, pose.as_ref(), &points, |querier, shape, &point| {
        querier.closest_point(shape, point, within)
    })?;
    Ok(answers::found(found.into_iter().map(|found| found.map(closest_row))))
}

/// The numbers of `Side`.
#[wasm_bindgen]
pub fn sides(mesh: &Mesh, pose: Option<Float64Array>, points: &Float64Array) -> Answer<Int8Array> {
    let points = rows::<3>(points, "points")?;
    let found = ask(mesh, pose.as_ref(), &points, |querier, shape, &point| querier.side(shape, point))?;
    Ok(Int8Array::from(&found.into_iter().map(|side| side as i8).collect::<Vec<i8>>()[..]))
}

/// NaN where there is no inside, and where no surface is within the distance.
#[wasm_bindgen(js_name = signedPointDistances)]
pub fn signed_point_distances(
    mesh: &Mesh,
    pose: Option<Float64Array>,
    points: &Float64Array,
    within: f64,
) -> Answer<JsValue> {
    let points = rows::<3>(points, "points")?;
    let found = ask(mesh, pose.as_ref(), &points, |querier, shape, &point| {
        querier.signed_point_distance(shape, point, within)
    })?;
    Ok(answers::floats(
        found.into_iter().map(|found| found.and_then(|found| found.value()).unwrap_or(f64::NAN)),
    ))
}

#[wasm_bindgen(js_name = firstHits)]
pub fn first_hits(mesh: &Mesh, pose: Option<Float64Array>, rays: Rays) -> Answer<Array> {
    let found = ask(mesh, pose.as_ref(), &rays.rays, |querier, shape, ray| querier.first_hit(shape, ray))?;
    Ok(answers::found(found.into_iter().map(|hit| hit.map(hit_row))))
}

#[wasm_bindgen(js_name = anyHits)]
pub fn any_hits(mesh: &Mesh, pose: Option<Float64Array>, rays: Rays) -> Answer<Uint8Array> {
    let found = ask(mesh, pose.as_ref(), &rays.rays, |querier, shape, ray| querier.any_hit(shape, ray))?;
    Ok(answers::small(found.into_iter().map(u8::from)))
}

/// A list with the hits of each ray.
#[wasm_bindgen(js_name = allHits)]
pub fn all_hits(mesh: &Mesh, pose: Option<Float64Array>, rays: Rays) -> Answer<Array> {
    let found = ask(mesh, pose.as_ref(), &rays.rays, |querier, shape, ray| querier.all_hits(shape, ray))?;
    let hits = |hits: Vec<RayHit>| answers::found(hits.into_iter().map(|hit| Some(hit_row(hit))));
    Ok(found.into_iter().map(hits).collect())
}

/// Segments meet what hides their ends from each other.
#[wasm_bindgen]
pub fn visible(
    mesh: &Mesh,
    pose: Option<Float64Array>,
    starts: &Float64Array,
    ends: &Float64Array,
    margin: f64,
) -> Answer<Uint8Array> {
    let segments = segments(starts, ends)?;
    let found = ask(mesh, pose.as_ref(), &segments, |querier, shape, &[start, end]| {
        querier.visible(shape, start, end, margin)
    })?;
    Ok(answers::small(found.into_iter().map(u8::from)))
}
