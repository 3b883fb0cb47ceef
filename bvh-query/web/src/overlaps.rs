//! Where and how deep two meshes overlap, how far apart they are if they do not, and where a mesh meets itself.

use crate::answers::{
    clashes, contacts, floats, ids, intersections, penetrations, points, signed_distances, small,
};
use crate::arguments::{Answer, pose, refused, rows, same_count, with_querier};
use crate::mesh::Mesh;
use crate::pairs::ask;
use bvh_query::{ClashOptions, Contact, ContactRegion, Patch, PatchOptions, PenetrationOptions};
use js_sys::{Array, Float64Array};
use wasm_bindgen::prelude::*;

/// Lower and upper bound, and translation. There is a direction for each pose.
#[wasm_bindgen]
pub fn separation(a: &Mesh, b: &Mesh, poses: &Float64Array, directions: &Float64Array) -> Answer<Array> {
    let directions = rows::<3>(directions, "directions")?;
    same_count("directions", directions.len(), "poses", poses.length() as usize / 12)?;
    let mut directions = directions.into_iter();
    let found = ask([a, b], poses, |querier, [a, b], pose| {
        querier.separation(a, b, pose, directions.next().unwrap_or_default())
    })?;
    let parts = [
        floats(found.iter().map(|way| way.lower)),
        floats(found.iter().map(|way| way.upper)),
        points(found.iter().map(|way| way.translation)),
    ];
    Ok(parts.into_iter().collect())
}

/// Reads when the search for a depth ends.
pub(crate) fn depth_options(relative_gap: Option<f64>, tolerance: Option<f64>) -> PenetrationOptions {
    let mut options = PenetrationOptions::new();
    options.relative_gap = relative_gap.unwrap_or(options.relative_gap);
    options.tolerance = tolerance;
    options
}

/// The parts of depths.
#[wasm_bindgen]
pub fn penetration(
    a: &Mesh,
    b: &Mesh,
    poses: &Float64Array,
    relative_gap: Option<f64>,
    tolerance: Option<f64>,
) -> Answer<Array> {
    let options = depth_options(relative_gap, tolerance);
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.penetration(a, b, pose, &options))?;
    Ok(penetrations(found.iter().map(Some)))
}

/// The parts of signed distances.
#[wasm_bindgen(js_name = signedDistance)]
pub fn signed_distance(
    a: &Mesh,
    b: &Mesh,
    poses: &Float64Array,
    relative_gap: Option<f64>,
    tolerance: Option<f64>,
) -> Answer<Array> {
    let options = depth_options(relative_gap, tolerance);
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.signed_distance(a, b, pose, &options))?;
    Ok(signed_distances(&found))
}

/// Reads what counts as a clash.
pub(crate) fn clash_options(
    clearance: f64,
    tolerance: Option<f64>,
    relative_gap: Option<f64>,
    visits: Option<u32>,
    magnitudes: bool,
) -> ClashOptions {
    let mut options = ClashOptions::new().clearance(clearance).magnitudes(magnitudes);
    options.tolerance = tolerance;
    options.relative_gap = relative_gap.unwrap_or(options.relative_gap);
    options.visits = visits.map_or(options.visits, u64::from);
    options
}

/// The parts of intersections.
#[wasm_bindgen]
pub fn intersection(a: &Mesh, b: &Mesh, poses: &Float64Array) -> Answer<Array> {
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.intersection(a, b, pose))?;
    Ok(intersections(found.iter().map(Some)))
}

/// Points, the number of corners of each loop, and the number of loops of each polygon.
#[wasm_bindgen(js_name = intersectionSurface)]
pub fn intersection_surface(a: &Mesh, b: &Mesh, at: &Float64Array) -> Answer<Array> {
    let pose = pose(at, "pose")?;
    with_querier(|querier| {
        let found = querier.intersection_surface(&a.shape, &b.shape, &pose).map_err(refused)?;
        let counts = [found.loops, found.polygons].map(|counts| ids(counts.into_iter()));
        Ok([points(found.points.into_iter())].into_iter().chain(counts).collect())
    })
}

/// The parts of clashes.
#[wasm_bindgen]
#[expect(clippy::too_many_arguments, reason = "they are what JavaScript passes, one by one")]
pub fn clash(
    a: &Mesh,
    b: &Mesh,
    poses: &Float64Array,
    clearance: f64,
    tolerance: Option<f64>,
    relative_gap: Option<f64>,
    visits: Option<u32>,
    magnitudes: bool,
) -> Answer<Array> {
    let options = clash_options(clearance, tolerance, relative_gap, visits, magnitudes);
    let found = ask([a, b], poses, |querier, [a, b], pose| querier.clash(a, b, pose, &options))?;
    Ok(clashes(&found, magnitudes))
}

/// Object and triangle of A and of B, kind, number of points, points, normals of A and of B, error and overlap.
fn regions(of: &[ContactRegion]) -> Array {
    let parts = [
        contacts(of.iter().map(|region| &region.contact)).into(),
        small(of.iter().map(|region| region.kind as u8)).into(),
        small(of.iter().map(|region| region.count)).into(),
        points(of.iter().flat_map(|region| region.all_points)),
        points(of.iter().map(|region| region.normal_a)),
        points(of.iter().map(|region| region.normal_b)),
        floats(of.iter().map(|region| region.error)),
        floats(of.iter().map(|region| region.overlap)),
    ];
    parts.into_iter().collect()
}

/// The parts of the regions, and the number of all contacts.
#[wasm_bindgen(js_name = contactRegions)]
pub fn contact_regions(a: &Mesh, b: &Mesh, at: &Float64Array, limit: u32) -> Answer<Array> {
    let pose = pose(at, "pose")?;
    with_querier(|querier| {
        let found = querier.contact_regions(&a.shape, &b.shape, &pose, limit as usize).map_err(refused)?;
        Ok([regions(&found.regions).into(), JsValue::from(found.total as f64)].into_iter().collect())
    })
}

/// First contact, number of contacts, centre, normal, length, area and depth of each patch, the parts of the regions, the number of
/// all contacts, first point and number of points of each patch, and the points, their normals and depths.
#[wasm_bindgen]
pub fn patches(
    a: &Mesh,
    b: &Mesh,
    at: &Float64Array,
    tolerance: f64,
    limit: u32,
    most_points: u32,
) -> Answer<Array> {
    let pose = pose(at, "pose")?;
    let options = PatchOptions::new()
        .tolerance(tolerance)
        .max_contacts(limit as usize)
        .max_points(most_points as usize);
    with_querier(|querier| {
        let found = querier.patches(&a.shape, &b.shape, &pose, &options).map_err(refused)?;
        let of = || found.patches.iter();
        let numbers = |part: fn(&Patch) -> f64| floats(of().map(part));
        let parts = [
            ids(of().map(|patch| patch.first as u32)),
            ids(of().map(|patch| patch.count as u32)),
            points(of().map(|patch| patch.center)),
            points(of().map(|patch| patch.normal)),
            numbers(|patch| patch.length),
            numbers(|patch| patch.area),
            numbers(|patch| patch.depth),
            regions(&found.regions).into(),
            JsValue::from(found.total as f64),
            ids(of().map(|patch| patch.first_point as u32)),
            ids(of().map(|patch| patch.point_count as u32)),
            points(found.points.iter().map(|of| of.point)),
            points(found.points.iter().map(|of| of.normal)),
            floats(found.points.iter().map(|of| of.depth)),
        ];
        Ok(parts.into_iter().collect())
    })
}

/// Object and triangle of the first and of the second triangle, and kind.
#[wasm_bindgen(js_name = selfContacts)]
pub fn self_contacts(mesh: &Mesh) -> Answer<Array> {
    with_querier(|querier| {
        let found = querier.self_contacts(&mesh.shape).map_err(refused)?;
        let pairs: Vec<Contact> = found
            .iter()
            .map(|pair| Contact {
                object_a: pair.object_a,
                triangle_a: pair.triangle_a,
                object_b: pair.object_b,
                triangle_b: pair.triangle_b,
            })
            .collect();
        let kinds = small(found.iter().map(|pair| pair.kind as u8));
        Ok([contacts(pairs.iter()).into(), JsValue::from(kinds)].into_iter().collect())
    })
}
