//! Finds how the coordinates of an object follow from their offsets: a predictor for each axis, and what it misses.
//!
//! Candidates are tried on a sample, then one pass over all coordinates finds whether any has to be corrected.

use super::placement::Extent;
use super::{Part, fold};
use crate::error::BakeError;
use bvh_format::vertex::{MAX_SIGNIFICANT, Predictor, Vertices};

/// The most parts and the most triangles of a part in a sample.
const SAMPLE_PARTS: usize = 16;
const SAMPLE_TRIANGLES: usize = 256;
/// The share of a sample that a predictor may miss: one in this many.
const MISSED: usize = 4;
/// The most digits after the point that are tried. Beyond, coordinates have more digits than `f32` tells apart.
const MOST_DECIMALS: u8 = 12;
/// Lengths of units of drawings in metres, and of metres in units of drawings.
const SCALES: [f64; 8] = [0.001, 0.01, 0.1, 0.0254, 0.3048, 0.9144, 1000.0, 100.0];

/// Returns how the vertices of an object follow from their offsets, given all of its parts.
pub(crate) fn predict(parts: &[Part], extent: &Extent) -> Result<Vertices, BakeError> {
    if extent.all_f32 == [true; 3] {
        return Ok(Vertices::around([0.0; 3]));
    }
    let sample = sample(parts)?;
    let mut vertices = Vertices::around([0.0; 3]);
    for axis in (0..3).filter(|&axis| !extent.all_f32[axis]) {
        let (predictor, scale) = best(&sample, axis, extent, vertices.scale);
        vertices.predictors[axis] = predictor;
        vertices.origin[axis] = if predictor.needs_no_origin() { 0.0 } else { extent.middle(axis).origin };
        vertices.scale = if predictor == Predictor::Scaled { scale } else { vertices.scale };
    }
    let found = survey(parts, &vertices)?;
    if found.lost.contains(&true) {
        for axis in 0..3 {
            if found.lost[axis] {
                (vertices.predictors[axis], vertices.origin[axis]) =
                    (Predictor::Sum, extent.middle(axis).origin);
            }
        }
        if !vertices.predictors.contains(&Predictor::Scaled) {
            vertices.scale = 0.0;
        }
        return Ok(stated(vertices, &survey(parts, &vertices)?));
    }
    Ok(stated(vertices, &found))
}

fn stated(mut vertices: Vertices, found: &Found) -> Vertices {
    vertices.corrected = found.missed;
    vertices.left_out = found.left_out.map(|most| {
        let nearest = most as f32;
        if f64::from(nearest) < most { nearest.next_up() } else { nearest }
    });
    vertices
}

/// Returns corners of triangles from all over an object.
fn sample(parts: &[Part]) -> Result<Vec<[f64; 3]>, BakeError> {
    let mut sample = Vec::new();
    for part in parts.iter().step_by(parts.len().div_ceil(SAMPLE_PARTS).max(1)) {
        let step = part.len().div_ceil(SAMPLE_TRIANGLES).max(1);
        let mut number = 0;
        part.each_triangle(|corners| {
            if number % step == 0 {
                sample.extend(corners);
            }
            number += 1;
        })?;
    }
    Ok(sample)
}

/// Returns the predictor of an axis that misses the least of a sample, and its scale. All axes have one scale, `scale` if it is
/// not 0.
fn best(sample: &[[f64; 3]], axis: usize, extent: &Extent, scale: f64) -> (Predictor, f64) {
    let decimals = (0..=MOST_DECIMALS).map(|digits| (Predictor::Decimals(digits), 0.0));
    let significant = (6..=MAX_SIGNIFICANT).map(|digits| (Predictor::Significant(digits), 0.0));
    let scaled = SCALES.into_iter().filter(|&other| scale == 0.0 || scale == other);
    let scaled = scaled.map(|scale| (Predictor::Scaled, scale));
    let candidates = decimals.chain(significant).chain([(Predictor::Shortest, 0.0)]).chain(scaled);
    let (mut best, mut least) = ((Predictor::Sum, 0.0), sample.len() / MISSED + 1);
    let origin = extent.middle(axis).origin;
    for (predictor, scale) in candidates {
        let origin = if predictor.needs_no_origin() { 0.0 } else { origin };
        let vertices = Vertices { predictors: [predictor; 3], scale, ..Vertices::around([origin; 3]) };
        let misses = |corner: &&[f64; 3]| {
            let coordinate = corner[axis];
            let offset = (coordinate - origin) as f32;
            match predictor {
                // A step or two from the nearest number take a bit or two.
                Predictor::Scaled => {
                    vertices.correction(axis, offset, coordinate).is_none_or(|c| c.abs() > 2)
                }
                _ => vertices.coordinate(axis, offset, 0) != coordinate,
            }
        };
        let missed = sample.iter().filter(misses).take(least).count();
        if missed < least {
            (best, least) = ((predictor, scale), missed);
        }
        if least == 0 {
            break;
        }
    }
    best
}

/// What a pass over all coordinates finds, axis by axis.
#[derive(Clone, Copy, Default)]
struct Found {
    /// Whether coordinates have to be corrected.
    missed: [bool; 3],
    /// Whether no correction gives a coordinate back.
    lost: [bool; 3],
    /// The largest distance of a coordinate from the sum of the origin and its offset.
    left_out: [f64; 3],
}

fn survey(parts: &[Part], vertices: &Vertices) -> Result<Found, BakeError> {
    let add = |found: &mut Found, number: usize| {
        parts[number].each_triangle(|corners| {
            // Exact: the origin is 0, or as large as half of all coordinates and of their units.
            let rest = corners.map(|corner| [0, 1, 2].map(|axis| corner[axis] - vertices.origin[axis]));
            let offsets = rest.map(|corner| corner.map(|value| value as f32));
            let predicted = vertices.predicted_triangle(&offsets);
            for (corner, given) in corners.iter().enumerate() {
                for axis in 0..3 {
                    let left_out = (rest[corner][axis] - f64::from(offsets[corner][axis])).abs();
                    let most = &mut found.left_out[axis];
                    *most = if left_out > *most { left_out } else { *most };
                    if predicted[corner][axis] != given[axis] {
                        found.missed[axis] = true;
                        found.lost[axis] |= vertices.predictors[axis] == Predictor::Scaled
                            && vertices.correction(axis, offsets[corner][axis], given[axis]).is_none();
                    }
                }
            }
        })
    };
    let found = fold(parts.len(), Found::default, add)?;
    Ok(found.into_iter().fold(Found::default(), |all, some| Found {
        missed: [0, 1, 2].map(|axis| all.missed[axis] || some.missed[axis]),
        lost: [0, 1, 2].map(|axis| all.lost[axis] || some.lost[axis]),
        left_out: [0, 1, 2].map(|axis| all.left_out[axis].max(some.left_out[axis])),
    }))
}
