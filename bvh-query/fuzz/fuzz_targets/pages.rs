//! Validates and decodes a tree of the right shape with any slabs, vertices and ids, and some changed bytes.
#![no_main]

mod decode;

use cbvh_testkit::forge::{Input, forge};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    decode::decode(&forge(&mut Input(bytes)));
});
