//! Makes arrays from answers: one array per field, in the order in which `ts/answers.ts` names them.

use bvh_query::{
    Clash, ClosestPoint, Contact, Distance, Intersection, Penetration, Pose, RayHit, SignedDistance,
};
use js_sys::{Array, Float64Array, Uint8Array, Uint32Array};
use wasm_bindgen::JsValue;

pub(crate) fn floats(of: impl Iterator<Item = f64>) -> JsValue {
    Float64Array::from(&of.collect::<Vec<f64>>()[..]).into()
}

pub(crate) fn ids(of: impl Iterator<Item = u32>) -> JsValue {
    Uint32Array::from(&of.collect::<Vec<u32>>()[..]).into()
}

/// Yes and no as 1 and 0, and other small numbers.
pub(crate) fn small(of: impl Iterator<Item = u8>) -> Uint8Array {
    Uint8Array::from(&of.collect::<Vec<u8>>()[..])
}

pub(crate) fn points(of: impl Iterator<Item = [f64; 3]>) -> JsValue {
    Float64Array::from(of.collect::<Vec<[f64; 3]>>().as_flattened()).into()
}

/// Object and triangle of A, and of B.
pub(crate) fn contacts<'a>(of: impl Iterator<Item = &'a Contact>) -> Uint32Array {
    let row = |found: &Contact| [found.object_a, found.triangle_a, found.object_b, found.triangle_b];
    Uint32Array::from(of.map(row).collect::<Vec<_>>().as_flattened())
}

/// Twelve numbers per pose.
pub(crate) fn poses(of: &[Pose]) -> Float64Array {
    let rows: Vec<[f64; 12]> = of
        .iter()
        .map(|pose| {
            let (rotation, translation) = (pose.rotation(), pose.translation());
            std::array::from_fn(|k| if k % 4 == 3 { translation[k / 4] } else { rotation[k / 4][k % 4] })
        })
        .collect();
    Float64Array::from(rows.as_flattened())
}

/// Distance, lower and upper bound, points of A and B, object and triangle of A, and of B. NaN and 0 for `None`.
pub(crate) fn distances(of: &[Option<Distance>]) -> Array {
    let numbers = |part: fn(&Distance) -> f64| floats(of.iter().map(|d| d.as_ref().map_or(f64::NAN, part)));
    let places =
        |part: fn(&Distance) -> [f64; 3]| points(of.iter().map(|d| d.as_ref().map_or([f64::NAN; 3], part)));
    let numbered = |part: fn(&Distance) -> u32| ids(of.iter().map(|d| d.as_ref().map_or(0, part)));
    [
        numbers(|d| d.distance),
        numbers(|d| d.lower),
        numbers(|d| d.upper),
        places(|d| d.point_a),
        places(|d| d.point_b),
        numbered(|d| d.object_a),
        numbered(|d| d.triangle_a),
        numbered(|d| d.object_b),
        numbered(|d| d.triangle_b),
    ]
    .into_iter()
    .collect()
}

/// Lower and upper bound, translation, common point, radii of the balls about it, and whether the visits ended the search. NaN and 0
/// for `None`.
pub(crate) fn penetrations<'a>(of: impl Iterator<Item = Option<&'a Penetration>>) -> Array {
    let found: Vec<Option<&Penetration>> = of.collect();
    let numbers = |part: fn(&Penetration) -> f64| floats(found.iter().map(|of| of.map_or(f64::NAN, part)));
    let places =
        |part: fn(&Penetration) -> [f64; 3]| points(found.iter().map(|of| of.map_or([f64::NAN; 3], part)));
    [
        numbers(|depth| depth.lower),
        numbers(|depth| depth.upper),
        places(|depth| depth.translation),
        places(|depth| depth.point),
        floats(found.iter().flat_map(|of| of.map_or([f64::NAN; 2], |depth| depth.radii))),
        small(found.iter().map(|of| of.is_some_and(|depth| depth.is_spent).into())).into(),
    ]
    .into_iter()
    .collect()
}

/// Lower and upper bound, normal, points of A and B, translation, whether both have an inside, and whether the visits ended the
/// search.
pub(crate) fn signed_distances(of: &[SignedDistance]) -> Array {
    let places = |part: fn(&SignedDistance) -> [f64; 3]| points(of.iter().map(part));
    [
        floats(of.iter().map(|of| of.lower)),
        floats(of.iter().map(|of| of.upper)),
        places(|of| of.normal),
        places(|of| of.point_a),
        places(|of| of.point_b),
        places(|of| of.translation),
        small(of.iter().map(|of| of.is_signed.into())).into(),
        small(of.iter().map(|of| of.is_spent.into())).into(),
    ]
    .into_iter()
    .collect()
}

/// Volume and its error, areas of A and B, box, and the pierced thickness of A and B. NaN for what there is not.
pub(crate) fn intersections<'a>(of: impl Iterator<Item = Option<&'a Intersection>>) -> Array {
    let found: Vec<Option<&Intersection>> = of.collect();
    let numbers = |part: fn(&Intersection) -> f64| floats(found.iter().map(|of| of.map_or(f64::NAN, part)));
    let boxes = found.iter().map(|of| of.and_then(|of| of.bounds).unwrap_or([[f64::NAN; 3]; 2]));
    [
        numbers(|of| of.volume),
        numbers(|of| of.volume_error),
        numbers(|of| of.area_a),
        numbers(|of| of.area_b),
        points(boxes.flatten()),
        numbers(|of| of.pierced_a.unwrap_or(f64::NAN)),
        numbers(|of| of.pierced_b.unwrap_or(f64::NAN)),
    ]
    .into_iter()
    .collect()
}

/// Class, relation, distance, point, parts of the depth and, if they were asked for, those of the intersection.
pub(crate) fn clashes(of: &[Clash], with_magnitudes: bool) -> Array {
    let shared = with_magnitudes.then(|| intersections(of.iter().map(|of| of.magnitudes.as_ref())));
    [
        small(of.iter().map(|of| of.class as u8)).into(),
        small(of.iter().map(|of| of.relation as u8)).into(),
        floats(of.iter().map(|of| of.distance)),
        points(of.iter().map(|of| of.point)),
        penetrations(of.iter().map(|of| of.depth.as_ref())).into(),
        shared.into(),
    ]
    .into_iter()
    .collect()
}

/// Distance or parameter with its bounds, point, object and triangle.
pub(crate) type Row = ([f64; 3], [f64; 3], u32, u32);

pub(crate) fn closest_row(found: ClosestPoint) -> Row {
    ([found.distance, found.lower, found.upper], found.point, found.object, found.triangle)
}

pub(crate) fn hit_row(hit: RayHit) -> Row {
    ([hit.t, hit.lower, hit.upper], hit.point, hit.object, hit.triangle)
}

/// Whether there is an answer, its distance or parameter, lower and upper bound, point, object and triangle.
pub(crate) fn found(of: impl Iterator<Item = Option<Row>>) -> Array {
    let found: Vec<Option<Row>> = of.collect();
    let rows = || found.iter().map(|row| row.unwrap_or(([f64::NAN; 3], [f64::NAN; 3], 0, 0)));
    [
        small(found.iter().map(|row| u8::from(row.is_some()))).into(),
        floats(rows().map(|row| row.0[0])),
        floats(rows().map(|row| row.0[1])),
        floats(rows().map(|row| row.0[2])),
        points(rows().map(|row| row.1)),
        ids(rows().map(|row| row.2)),
        ids(rows().map(|row| row.3)),
    ]
    .into_iter()
    .collect()
}
