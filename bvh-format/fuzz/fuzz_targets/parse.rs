//! A file of any bytes, as they are and with all checksums made right: validated and decoded.
#![no_main]

mod decode;
#[allow(dead_code, reason = "tests use the rest")]
#[path = "../../tests/common/seal.rs"]
mod seal;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    decode::decode(bytes);
    if bytes.len() >= 4096 {
        let mut bytes = bytes.to_vec();
        seal::seal(&mut bytes);
        decode::decode(&bytes);
    }
});
