//! Benchmarks share two kinds of scenes: two balls with bumps, with a pose for each distance, which need no files, and arms among
//! obstacles.

pub mod scenes;

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_query::{Backend, Bvh, Pose, Querier};

/// Returns a ball of radius about 1 with bumps, of about this many triangles.
pub fn ball(triangles: u64) -> Mesh {
    let (positions, triangles) = cbvh_testkit::ball::ball(triangles);
    Mesh::from_triangles(positions, triangles)
}

/// Returns the baked mesh with all pages checked.
pub fn bake(mesh: &Mesh) -> Bvh {
    let bvh = Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap();
    bvh.validate().unwrap();
    bvh
}

/// Returns the pose of a turned copy of the mesh at this distance from it, found by bisection. A negative distance is the
/// depth to which the copy enters the mesh.
pub fn at_distance(bvh: &Bvh, distance: f64) -> Pose {
    let mut querier = Querier::with_backend(Backend::detect().unwrap());
    let (sin, cos) = 0.7f64.sin_cos();
    let pose = |along: f64| {
        Pose::new([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], [0.8 * along, 0.6 * along, 0.1])
            .unwrap()
    };
    let (mut near, mut far) = (0.0, 4.0);
    for _ in 0..60 {
        let middle = (near + far) / 2.0;
        let apart = querier.distance(bvh, bvh, &pose(middle)).unwrap().distance;
        if apart > distance.max(0.0) { far = middle } else { near = middle }
    }
    pose(far + distance.min(0.0))
}
