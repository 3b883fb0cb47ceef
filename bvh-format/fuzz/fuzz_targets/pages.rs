//! A tree of the right shape with any slabs, vertices and ids, and some bytes poked into it: validated and decoded.
#![no_main]

mod decode;
#[path = "../../tests/common/forge.rs"]
mod forge;
#[allow(dead_code, reason = "tests use the rest")]
#[path = "../../tests/common/seal.rs"]
mod seal;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    decode::decode(&forge::forge(&mut forge::Input(bytes)));
});
