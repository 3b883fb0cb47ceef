//! From an input object to the triangles that a file holds: origin, rounding, grid, duplicates.
//!
//! Coordinates become `f32` around an `f64` origin such that `origin + v` is exact in `f64`. What
//! moves a vertex is measured, not estimated.

use crate::mesh;
use bvh_format::kdop::Kdop;
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// A triangle: three corners around the origin, in mesh units.
pub(crate) type Corners = [[f32; 3]; 3];

/// An object ready to be built into a tree.
pub(crate) struct Prepared {
    pub(crate) name: String,
    pub(crate) origin: [f64; 3],
    /// Distinct triangles, in the order of their ids.
    pub(crate) triangles: Vec<Corners>,
    /// The input number of each triangle.
    pub(crate) ids: Vec<u32>,
    /// (kept id, id of an equal triangle left out), ascending.
    pub(crate) duplicates: Vec<[u32; 2]>,
    /// Zero-area triangles among those kept.
    pub(crate) degenerate: u64,
    /// Largest move of a vertex by rounding to f32, in mesh units.
    pub(crate) max_rounding: f64,
    /// Largest further move by quantisation, in mesh units.
    pub(crate) max_quantization: f64,
    /// Distinct vertices referenced by the input's triangles.
    pub(crate) vertices: u64,
}

/// Rounds, quantises and removes duplicates. `grid_error` is the largest move that quantisation may
/// make, `None` for none.
pub(crate) fn prepare(object: &mesh::Object, grid_error: Option<f64>) -> Prepared {
    let used = used_vertices(object);
    let origin = choose_origin(object, &used);
    let step = grid_error.map(grid_step);
    let placed: Vec<Placed> = object
        .positions
        .par_iter()
        .zip(&used)
        .map(|(&position, &used)| if used { place(position, &origin, step) } else { Placed::default() })
        .collect();
    let max = |of: fn(&Placed) -> f64| placed.par_iter().map(of).reduce(|| 0.0, f64::max);
    let triangles: Vec<Corners> = object
        .triangles
        .par_iter()
        .map(|indices| indices.map(|index| placed[index as usize].vertex))
        .collect();
    let (kept, duplicates) = find_duplicates(&triangles, &object.triangle_ids);
    let (triangles, ids): (Vec<_>, Vec<_>) = if duplicates.is_empty() {
        (triangles, object.triangle_ids.clone())
    } else {
        kept.iter().map(|&i| (triangles[i as usize], object.triangle_ids[i as usize])).unzip()
    };
    Prepared {
        name: object.name.clone(),
        origin: origin.map(|axis| axis.origin),
        degenerate: triangles.par_iter().filter(|t| is_degenerate(t)).count() as u64,
        triangles,
        ids,
        duplicates,
        max_rounding: rounded_up(max(|placed| placed.rounding)),
        max_quantization: rounded_up(max(|placed| placed.quantization)),
        vertices: used.par_iter().filter(|&&used| used).count() as u64,
    }
}

fn used_vertices(object: &mesh::Object) -> Vec<bool> {
    let mut used = vec![false; object.positions.len()];
    object.triangles.iter().flatten().for_each(|&index| used[index as usize] = true);
    used
}

/// One axis of the origin, and the grid on which origin + v is exact.
#[derive(Clone, Copy)]
struct AxisOrigin {
    origin: f64,
    /// v is a multiple of this; 0 asks for nothing.
    grid: f64,
}

/// The origin is 0 where every coordinate of the axis is an f32, or where moving it would gain less
/// than two bits; else the middle of the axis, rounded to the grid of the f64 in use there.
fn choose_origin(object: &mesh::Object, used: &[bool]) -> [AxisOrigin; 3] {
    [0, 1, 2].map(|axis| {
        let values =
            || object.positions.par_iter().zip(used).filter(|(_, used)| **used).map(|(p, _)| p[axis]);
        let lo = values().reduce(|| f64::INFINITY, f64::min);
        let hi = values().reduce(|| f64::NEG_INFINITY, f64::max);
        let largest = lo.abs().max(hi.abs());
        let half = (hi - lo) / 2.0;
        let all_f32 = || values().all(|value| f64::from(value as f32) == value);
        if largest <= 4.0 * half || all_f32() {
            return AxisOrigin { origin: 0.0, grid: 0.0 };
        }
        // origin + v stays below twice the largest coordinate, where f64 has this spacing. Origins are multiples
        // of the smallest f32, as all vertices are.
        let grid = spacing(2.0 * largest).max(f64::from(f32::from_bits(1)));
        let middle = lo + half;
        AxisOrigin { origin: (middle / grid).round() * grid, grid }
    })
}

/// The distance of neighbouring f64 at `value`, a power of two.
fn spacing(value: f64) -> f64 {
    value.next_up() - value
}

#[derive(Clone, Copy, Default)]
struct Placed {
    vertex: [f32; 3],
    rounding: f64,
    quantization: f64,
}

fn place(position: [f64; 3], origin: &[AxisOrigin; 3], step: Option<f64>) -> Placed {
    let mut placed = Placed::default();
    let (mut rounding, mut quantization) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        let AxisOrigin { origin, grid } = origin[axis];
        let mut offset = position[axis] - origin;
        if grid > 0.0 {
            offset = (offset / grid).round() * grid;
        }
        let rounded = offset as f32;
        rounding[axis] = position[axis] - (origin + f64::from(rounded));
        // A step below the spacing of f32 at the vertex is already met; one so small that the
        // quotient overflows all the more.
        let snapped = step.map(|step| ((f64::from(rounded) / step).round() * step) as f32);
        let snapped = snapped.filter(|snapped| snapped.is_finite()).unwrap_or(rounded);
        quantization[axis] = f64::from(snapped) - f64::from(rounded);
        // Equal values must have equal bits.
        placed.vertex[axis] = if snapped == 0.0 { 0.0 } else { snapped };
    }
    placed.rounding = norm(rounding);
    placed.quantization = norm(quantization);
    placed
}

/// Length of a vector, scaled so that squares neither overflow nor vanish.
fn norm(v: [f64; 3]) -> f64 {
    let largest = v.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * v.iter().map(|c| (c / largest).powi(2)).sum::<f64>().sqrt()
}

/// Above the true value for a length computed by `norm`: five roundings of 2^-53 at most.
fn rounded_up(length: f64) -> f64 {
    if length == 0.0 { 0.0 } else { (length * (1.0 + 2f64.powi(-49))).next_up() }
}

/// The largest power of two whose grid moves no vertex by more than `error`: half a step along each
/// of three axes is sqrt(3) / 2 steps.
fn grid_step(error: f64) -> f64 {
    let limit = error * 2.0 / 3f64.sqrt();
    // Its leading bit; a logarithm may differ from one platform's library to the next.
    f64::from_bits(limit.to_bits() & 0x7ff << 52).max(f64::MIN_POSITIVE)
}

/// Indices of the triangles kept, and the pairs (kept id, dropped id). Triangles are equal if their
/// corners are the same points in any order; the first of equals is kept.
fn find_duplicates(triangles: &[Corners], ids: &[u32]) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut hashed: Vec<(u64, u32)> = triangles
        .par_iter()
        .enumerate()
        .map(|(index, triangle)| {
            let key = canonical(triangle);
            (xxh3_64(bytemuck::bytes_of(&key)), index as u32)
        })
        .collect();
    hashed.par_sort_unstable();
    let mut first_of = Vec::new();
    for run in hashed.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        // Members ascend; equal hashes of different triangles are possible, so compare.
        let mut distinct: Vec<([[u32; 3]; 3], u32)> = Vec::new();
        for &(_, index) in run {
            let key = canonical(&triangles[index as usize]);
            match distinct.iter().find(|(other, _)| *other == key) {
                Some(&(_, first)) => first_of.push((index, first)),
                None => distinct.push((key, index)),
            }
        }
    }
    first_of.sort_unstable();
    let mut dropped = first_of.iter().map(|&(index, _)| index).peekable();
    let kept = (0..triangles.len() as u32).filter(|&i| dropped.next_if_eq(&i).is_none()).collect();
    let mut pairs: Vec<[u32; 2]> =
        first_of.iter().map(|&(i, first)| [ids[first as usize], ids[i as usize]]).collect();
    pairs.sort_unstable();
    (kept, pairs)
}

/// The corners' bits in a fixed order.
fn canonical(triangle: &Corners) -> [[u32; 3]; 3] {
    let mut corners = triangle.map(|corner| corner.map(f32::to_bits));
    corners.sort_unstable();
    corners
}

/// True if the three corners lie on a line, decided exactly: the cross product of two edges has
/// components that are sums of products of f32 differences, each a 2-by-2 orientation.
fn is_degenerate(triangle: &Corners) -> bool {
    let [a, b, c] = triangle.map(|corner| corner.map(f64::from));
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(x, y)| {
        let point = |p: [f64; 3]| robust::Coord { x: p[x], y: p[y] };
        robust::orient2d(point(a), point(b), point(c)) == 0.0
    })
}

/// The box of all triangles and a sphere around them: centre and radius, rounded up.
pub(crate) fn box_and_sphere(triangles: &[Corners]) -> (Kdop, [f32; 3], f32) {
    let bounds =
        triangles.par_chunks(4096).map(|chunk| Kdop::of_points(chunk.iter().flatten().copied())).reduce(
            || Kdop::EMPTY,
            |mut a, b| {
                a.join(&b, 3);
                a
            },
        );
    let centre = [0, 1, 2].map(|a| ((f64::from(bounds.lo[a]) + f64::from(bounds.hi[a])) / 2.0) as f32);
    let squared = triangles
        .par_iter()
        .flatten()
        .map(|corner| (0..3).map(|a| (f64::from(corner[a]) - f64::from(centre[a])).powi(2)).sum())
        .reduce(|| 0.0, f64::max);
    // Differences of f32 in f64, three squares, two sums and a root: each rounds by at most 2^-53
    // relative; 2^-40 covers them, the f32 above it covers the last rounding.
    let radius = (squared.sqrt() * (1.0 + 2f64.powi(-40))) as f32;
    (bounds, centre, radius.next_up())
}
