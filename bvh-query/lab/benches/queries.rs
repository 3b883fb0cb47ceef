//! Queries between two balls of 80,000 triangles, on every backend, and parry3d beside them.
//!
//! The same pose is queried again and again, which is the best case for caches and branch predictors. `cbvh report`
//! measures many poses.

use bvh_query::{Backend, Bvh, DistanceOptions, Pose, Querier};
use divan::{Bencher, black_box};
use parry3d::math::{Pose as Isometry, Vector};
use parry3d::query::{distance, intersection_test};
use parry3d::shape::TriMesh;
use std::sync::LazyLock;

const TRIANGLES: u64 = 80_000;

/// Distances in radii: deep in each other, nearly touching, and apart.
const DISTANCES: [f64; 5] = [-0.1, 1e-6, 0.01, 0.1, 1.0];

static BALL: LazyLock<Bvh> = LazyLock::new(|| bvh_benches::bake(&bvh_benches::ball(TRIANGLES)));
static PARRY: LazyLock<TriMesh> = LazyLock::new(|| {
    let mesh = bvh_benches::ball(TRIANGLES);
    let object = &mesh.objects[0];
    let corners = object.positions.iter().map(|p| Vector::new(p[0] as f32, p[1] as f32, p[2] as f32));
    TriMesh::new(corners.collect(), object.triangles.clone()).unwrap()
});

fn main() {
    divan::main();
}

fn backends() -> impl Iterator<Item = Backend> {
    Backend::ALL.into_iter().filter(|backend| backend.is_available())
}

/// Backends with all distances.
fn cases() -> Vec<(Backend, f64)> {
    backends().flat_map(|backend| DISTANCES.map(|distance| (backend, distance))).collect()
}

/// The cost of a query that the bounding spheres answer, and of one whose spheres overlap.
#[divan::bench(args = [1.0, 0.15])]
fn setup(bencher: Bencher, apart: f64) {
    let pose = bvh_benches::at_distance(&BALL, apart);
    let mut querier = Querier::new().unwrap();
    bencher.bench_local(|| querier.collide(&*BALL, &*BALL, black_box(&pose)).unwrap());
}

#[divan::bench(args = cases())]
fn collide(bencher: Bencher, (backend, apart): (Backend, f64)) {
    let pose = bvh_benches::at_distance(&BALL, apart);
    let mut querier = Querier::with_backend(backend);
    bencher.bench_local(|| querier.collide(&*BALL, &*BALL, black_box(&pose)).unwrap());
}

#[divan::bench(args = cases())]
fn distance_exact(bencher: Bencher, (backend, apart): (Backend, f64)) {
    let pose = bvh_benches::at_distance(&BALL, apart);
    let mut querier = Querier::with_backend(backend);
    bencher.bench_local(|| querier.distance(&*BALL, &*BALL, black_box(&pose)).unwrap());
}

#[divan::bench(args = [1e-3, 1e-2, 1e-1])]
fn distance_with_error(bencher: Bencher, rel_err: f64) {
    let pose = bvh_benches::at_distance(&BALL, 0.1);
    let options = DistanceOptions::new().rel_err(rel_err);
    let mut querier = Querier::new().unwrap();
    bencher.bench_local(|| querier.distance_with(&*BALL, &*BALL, black_box(&pose), &options).unwrap());
}

#[divan::bench]
fn contacts(bencher: Bencher) {
    let pose = bvh_benches::at_distance(&BALL, -0.1);
    let mut querier = Querier::new().unwrap();
    bencher.bench_local(|| querier.contacts(&*BALL, &*BALL, black_box(&pose)).unwrap());
}

/// The pose for parry3d.
fn isometry(pose: &Pose) -> Isometry {
    let ([x, y, z], t) = (*pose.rotation(), pose.translation());
    let columns =
        [x[0], y[0], z[0], 0.0, x[1], y[1], z[1], 0.0, x[2], y[2], z[2], 0.0, t[0], t[1], t[2], 1.0];
    Isometry::from_mat4(parry3d::glamx::Mat4::from_cols_array(&columns.map(|v| v as f32)))
}

#[divan::bench(args = DISTANCES, sample_count = 20)]
fn parry_collide(bencher: Bencher, apart: f64) {
    let pose = isometry(&bvh_benches::at_distance(&BALL, apart));
    let (here, mesh) = (Isometry::identity(), &*PARRY);
    bencher.bench_local(|| intersection_test(&here, mesh, black_box(&pose), mesh).unwrap());
}

#[divan::bench(args = DISTANCES, sample_count = 20)]
fn parry_distance(bencher: Bencher, apart: f64) {
    let pose = isometry(&bvh_benches::at_distance(&BALL, apart));
    let (here, mesh) = (Isometry::identity(), &*PARRY);
    bencher.bench_local(|| distance(&here, mesh, black_box(&pose), mesh).unwrap());
}
