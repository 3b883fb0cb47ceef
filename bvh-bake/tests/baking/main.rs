//! From meshes to bytes: what a bake promises, what files hold, and what checks them again.

mod bake;
mod clouds;
mod files;
mod golden;
mod hull;
mod open_edges;
mod progress;
mod rounding;
mod stopped;
mod stored;
mod topology;
mod verify;
mod weld;

use bvh_bake::mesh::Mesh;
use cbvh_testkit::Triangle;

/// Makes a mesh of one object.
fn mesh(triangles: &[Triangle]) -> Mesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::from_triangles(triangles.iter().flatten().copied().collect(), indices)
}
