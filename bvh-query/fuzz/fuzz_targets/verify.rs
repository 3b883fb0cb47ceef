//! Verifies a `.cbvh` file of any bytes, with corrected checksums, against the mesh of a cube. `prove_bounds` runs on
//! whatever is valid.
#![no_main]

use bvh_bake::mesh::Mesh;
use bvh_bake::{prove_bounds, validate_in_parallel, verify};
use cbvh_testkit::seal::seal;
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static CUBE: LazyLock<Mesh> = LazyLock::new(|| {
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let halves = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh::from_triangles((0..8).map(corner).collect(), halves)
});

fuzz_target!(|bytes: &[u8]| {
    if bytes.len() < 64 {
        return;
    }
    let mut bytes = bytes.to_vec();
    seal(&mut bytes);
    let _ = verify(&bytes, &CUBE);
    if let Ok(layout) = validate_in_parallel(&bytes[..]) {
        let _ = prove_bounds(&layout, &bytes[..]);
    }
});
