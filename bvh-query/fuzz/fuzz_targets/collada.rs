//! Reads any bytes as COLLADA, which must give a mesh or an error.
#![no_main]

mod reader;

use bvh_bake::input::MeshFormat;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = reader::read(bytes, MeshFormat::Collada);
});
