//! The meshes that were sent, baked in memory under their names.

use super::message::MeshMessage;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_query::Bvh;
use std::collections::HashMap;

/// The meshes by name. A mesh that was refused keeps the reason, which questions about it repeat.
#[derive(Default)]
pub(super) struct Meshes(HashMap<String, Result<Bvh, String>>);

impl Meshes {
    /// Bakes a mesh, and returns the number of its triangles or why it is refused.
    pub(super) fn add(&mut self, message: &MeshMessage) -> Result<usize, String> {
        let baked = bake(message);
        let answer = baked.as_ref().map(|_| message.triangles.len()).map_err(Clone::clone);
        self.0.insert(message.mesh.clone(), baked);
        answer
    }

    /// Returns the mesh of this name.
    pub(super) fn get(&self, name: &str) -> Result<&Bvh, String> {
        let found = self.0.get(name).ok_or_else(|| format!("expected the name of a mesh, found {name:?}"))?;
        found.as_ref().map_err(|reason| format!("mesh {name}: {reason}"))
    }
}

/// Bakes a mesh. A mesh whose coordinates the file would round is refused, because answers would be about another mesh.
fn bake(message: &MeshMessage) -> Result<Bvh, String> {
    let positions = message.vertices.iter().map(|corner| corner.map(f64::from)).collect();
    let mesh = Mesh::from_triangles(positions, message.triangles.clone());
    let (bytes, report) = to_bytes(&mesh, &Options::default()).map_err(|error| error.to_string())?;
    let moved = report.file.max_vertex_rounding;
    if moved > 0.0 {
        return Err(format!(
            "expected coordinates that a file stores exactly, found one that moves by {moved:e}"
        ));
    }
    Bvh::from_bytes(bytes).map_err(|error| error.to_string())
}
