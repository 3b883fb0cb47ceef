//! The meshes that were sent, baked in memory under their names.

use super::message::{MeshFile, MeshMessage};
use crate::console::{Record, record};
use crate::process;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Effort, Options, to_bytes, write_atomically};
use bvh_query::{Bvh, ReadAhead};
use std::collections::HashMap;
use std::fs;
use std::time::Instant;

/// The meshes by name. A mesh that was refused keeps the reason, which questions about it repeat.
pub(super) struct Meshes {
    baked: HashMap<String, Result<Bvh, String>>,
    effort: Effort,
}

impl Meshes {
    /// Begins without meshes, which are baked with this effort.
    pub(super) fn of_effort(effort: Effort) -> Self {
        Self { baked: HashMap::new(), effort }
    }

    /// Returns how meshes are baked, in words.
    pub(super) fn settings(&self) -> &'static str {
        match self.effort {
            Effort::Quick => "meshes baked in memory in little time; without topology for timed questions",
            _ => "meshes baked in memory with the default options",
        }
    }

    fn options(&self) -> Options {
        Options::default().effort(self.effort)
    }

    /// Bakes a mesh, and returns the number of its triangles or why it is refused.
    pub(super) fn add(&mut self, message: &MeshMessage) -> Result<usize, String> {
        let baked = bake(message, &self.options());
        let answer = baked.as_ref().map(|_| message.triangles.len()).map_err(Clone::clone);
        self.baked.insert(message.mesh.clone(), baked);
        answer
    }

    /// Bakes the mesh of a file into a `.cbvh` file beside it, maps that, and returns how long each took.
    pub(super) fn add_file(&mut self, message: &MeshFile) -> Result<Record, String> {
        // Windows does not replace a file that is mapped.
        self.baked.remove(&message.mesh);
        // Of timed questions, only that for sides needs it: it is refused after a quick bake.
        let options = self.options().topology(self.effort != Effort::Quick);
        let baked = bake_file(message, &options);
        let answer = baked.as_ref().map(|(_, record)| record.clone()).map_err(Clone::clone);
        self.baked.insert(message.mesh.clone(), baked.map(|(bvh, _)| bvh));
        answer
    }

    /// Returns the mesh of this name.
    pub(super) fn get(&self, name: &str) -> Result<&Bvh, String> {
        let found =
            self.baked.get(name).ok_or_else(|| format!("expected the name of a mesh, found {name:?}"))?;
        found.as_ref().map_err(|reason| format!("mesh {name}: {reason}"))
    }
}

/// Bakes a mesh. Files store each `f64` that is a multiple of 2^-180; a mesh with a finer coordinate, which the file rounds, is
/// refused, because answers would be about another mesh.
fn bake(message: &MeshMessage, options: &Options) -> Result<Bvh, String> {
    let positions = message.vertices.iter().map(|corner| corner.map(f64::from)).collect();
    let mesh = Mesh::from_triangles(positions, message.triangles.clone());
    let (bytes, report) = to_bytes(&mesh, options).map_err(|error| error.to_string())?;
    let moved = report.file.max_vertex_rounding;
    if moved > 0.0 {
        return Err(format!(
            "expected coordinates that a file stores exactly, found one that moves by {moved:e}"
        ));
    }
    Bvh::from_bytes(bytes).map_err(|error| error.to_string())
}

/// Bakes and maps the mesh of a file. Returns it with the seconds of the bake, of the opening, and the bytes of the baked file.
fn bake_file(message: &MeshFile, options: &Options) -> Result<(Bvh, Record), String> {
    let name = message.file.display();
    let bytes = fs::read(&message.file).map_err(|error| format!("{name}: cannot read: {error}"))?;
    let expected = (message.corners.saturating_add(message.triangles)).saturating_mul(12);
    if bytes.len() != expected {
        return Err(format!("{name}: expected {expected} bytes, found {}", bytes.len()));
    }
    let (numbers, _) = bytes.as_chunks::<4>();
    let (rows, _) = numbers.as_chunks::<3>();
    let (corners, triangles) = rows.split_at(message.corners);
    let corners = corners.iter().map(|row| row.map(|x| f64::from(f32::from_le_bytes(x)))).collect();
    let triangles = triangles.iter().map(|row| row.map(u32::from_le_bytes)).collect();
    let start = Instant::now();
    let mesh = Mesh::from_triangles(corners, triangles);
    let (baked, _) = to_bytes(&mesh, options).map_err(|error| error.to_string())?;
    let seconds = start.elapsed().as_secs_f64();
    // The mesh may be sent again while the file of the first time is mapped: that one is replaced, not written to.
    let path = message.file.with_extension("cbvh");
    write_atomically(&path, &baked).map_err(|error| error.to_string())?;
    let start = Instant::now();
    let bvh = process::map(&path, ReadAhead::Usual).map_err(|error| error.to_string())?;
    let open_seconds = start.elapsed().as_secs_f64();
    let record = record! { triangles: message.triangles, seconds: seconds, open_seconds: open_seconds, bytes: baked.len() };
    Ok((bvh, record))
}
