//! Meshes baked in memory, ready to be timed.

use super::kind::Subject;
use crate::console::Failure;
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeError, BakeReport, Options, to_bytes};
use bvh_query::Bvh;
use std::path::Path;
use std::sync::Arc;

/// A baked mesh, and the report of the bake.
pub(super) type Baked = (Arc<Bvh>, BakeReport);

/// Bakes both meshes of a pair. If it is a mesh and itself, the second is the first.
pub(super) fn bake_both(subject: &Subject<'_>, options: &Options) -> Result<[Baked; 2], Failure> {
    let Subject { pair, meshes: [a, b], .. } = subject;
    let baked_a = bake(&pair.a, a, options)?;
    let baked_b = if pair.a == pair.b { baked_a.clone() } else { bake(&pair.b, b, options)? };
    Ok([baked_a, baked_b])
}

/// Bakes the mesh of a file, and checks all pages, so that no timed query pays for the first touch of one.
fn bake(path: &Path, mesh: &Mesh, options: &Options) -> Result<Baked, Failure> {
    let failed = |error: &BakeError| Failure::from_bake(&path.display().to_string(), error);
    let (bytes, report) = to_bytes(mesh, options).map_err(|error| failed(&error))?;
    let bvh = Bvh::from_bytes(bytes).map_err(|error| failed(&BakeError::Unproved(error)))?;
    bvh.check_all().map_err(|error| Failure::invalid(path, error))?;
    Ok((Arc::new(bvh), report))
}

/// Returns the name of a bake's layout, as tables have it.
pub(super) fn layout_of(report: &BakeReport) -> String {
    format!("{} {}", report.file.profile.name(), report.file.triangle_encoding.name())
}
