//! Two knobbly balls and a pose for every distance: scenes that need no files.

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_query::{Backend, Bvh, Pose, Querier};

/// A ball of radius about 1 with bumps, `2 * rings * (2 * rings - 1)` triangles or so.
pub fn ball(rings: u32) -> Mesh {
    let (rows, columns) = (rings, 2 * rings);
    let mut corners = Vec::new();
    for row in 0..=rows {
        for column in 0..columns {
            let (polar, around) = (
                std::f64::consts::PI * f64::from(row) / f64::from(rows),
                std::f64::consts::TAU * f64::from(column) / f64::from(columns),
            );
            let bump = 1.0 + 0.1 * (5.0 * polar).sin() * (7.0 * around).cos();
            let point = [polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()];
            // As f32, so that storing moves nothing.
            corners.push(point.map(|c| f64::from((bump * c) as f32)));
        }
    }
    let at = |row: u32, column: u32| row * columns + column % columns;
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    Mesh::from_triangles(corners, triangles)
}

/// A baked mesh, all pages checked.
pub fn bake(mesh: &Mesh) -> Bvh {
    let bvh = Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap();
    bvh.check_all().unwrap();
    bvh
}

/// A turned copy of the mesh at this distance from it, found by bisection; negative: so deep in it.
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
