//! Baking balls of several sizes into memory, proof included; throughput in triangles.

use bvh_bake::{Options, to_bytes};
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

#[divan::bench(args = [16, 50, 158, 500], sample_count = 10)]
fn to_memory(bencher: Bencher, rings: u32) {
    let mesh = bvh_benches::ball(rings);
    let triangles = ItemsCount::new(mesh.triangle_count() as usize);
    bencher.counter(triangles).bench_local(|| to_bytes(&mesh, &Options::default()).unwrap());
}
