//! Reads any bytes as points, as XYZ and as PCD, which must give a mesh or an error.
#![no_main]

mod reader;

use bvh_bake::input::MeshFormat;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for format in [MeshFormat::Xyz, MeshFormat::Pcd] {
        let _ = reader::read(bytes, format);
    }
});
