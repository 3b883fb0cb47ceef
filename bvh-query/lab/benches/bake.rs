//! Measures baking balls of several sizes in memory, with the proof, as triangles per second.

use bvh_bake::{Options, to_bytes};
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

#[divan::bench(args = [1000, 10_000, 100_000, 1_000_000], sample_count = 10)]
fn to_memory(bencher: Bencher, triangles: u64) {
    let mesh = bvh_benches::ball(triangles);
    let items = ItemsCount::new(mesh.triangle_count() as usize);
    bencher.counter(items).bench_local(|| to_bytes(&mesh, &Options::default()).unwrap());
}
