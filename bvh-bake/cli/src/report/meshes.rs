//! The meshes of a pair: read from mesh files or taken out of `.cbvh` files, and baked in memory, ready to be timed.

use crate::asking::mesh::{is_baked, refuse_scene, triangles};
use crate::console::Failure;
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeError, BakeReport, Options, input, to_bytes};
use bvh_format::validate::validate;
use bvh_query::Bvh;
use cbvh_measure::pairs::Pair;
use std::path::Path;

/// Returns the mesh of a file, all its objects as one.
pub(super) fn read(path: &Path) -> Result<Mesh, Failure> {
    if is_baked(path)? {
        return unbaked(path);
    }
    let read =
        input::read(path).map_err(|error| Failure::from_bake(&path.display().to_string(), &error.into()))?;
    Ok(read.merged())
}

/// Returns the triangles of a `.cbvh` file in the order of their ids, or in the order of the file if it has no ids. The
/// file stores only one of several exact duplicates, so the others are missing.
fn unbaked(path: &Path) -> Result<Mesh, Failure> {
    let bvh = crate::map::map(path, bvh_query::ReadAhead::Usual)?;
    refuse_scene(path, &bvh)?;
    validate(bvh.bytes()).map_err(|error| Failure::invalid(path, error))?;
    let mut triangles: Vec<_> = bvh.objects().iter().flat_map(|object| triangles(&bvh, object)).collect();
    if bvh.layout().has_ids() {
        triangles.sort_by_key(|&(id, _)| id);
    }
    let positions: Vec<[f64; 3]> = triangles.iter().flat_map(|&(_, corners)| corners).collect();
    let numbers = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Ok(Mesh::from_triangles(positions, numbers))
}

/// A baked mesh, and the report of the bake.
pub(super) type Baked = (Bvh, BakeReport);

/// Bakes both meshes of a pair. If it is a mesh and itself, the second is the first.
pub(super) fn bake_both(pair: &Pair, [a, b]: &[Mesh; 2], options: &Options) -> Result<[Baked; 2], Failure> {
    let baked_a = bake(&pair.a, a, options)?;
    let baked_b = if pair.a == pair.b { baked_a.clone() } else { bake(&pair.b, b, options)? };
    Ok([baked_a, baked_b])
}

/// Bakes the mesh of a file, and checks all pages, so that no timed query pays for the first touch of one.
fn bake(path: &Path, mesh: &Mesh, options: &Options) -> Result<Baked, Failure> {
    let failed = |error: &BakeError| Failure::from_bake(&path.display().to_string(), error);
    let (bytes, report) = to_bytes(mesh, options).map_err(|error| failed(&error))?;
    let bvh = Bvh::from_bytes(bytes).map_err(|error| failed(&BakeError::Unproved(error)))?;
    bvh.validate().map_err(|error| Failure::invalid(path, error))?;
    Ok((bvh, report))
}

/// Returns the name of a bake's layout, as tables have it.
pub(super) fn layout_of(report: &BakeReport) -> String {
    format!("{} {}", report.file.profile.name(), report.file.triangle_encoding.name())
}
