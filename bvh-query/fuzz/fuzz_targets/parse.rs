//! Validates and decodes a file of any bytes, both as they are and with all checksums corrected.
#![no_main]

mod decode;

use cbvh_testkit::seal::seal;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    decode::decode(bytes);
    if bytes.len() >= 64 {
        let mut bytes = bytes.to_vec();
        seal(&mut bytes);
        decode::decode(&bytes);
    }
});
