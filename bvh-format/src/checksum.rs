//! The checksum of everything in a file: XXH3, 64 bits, seed 0.

use xxhash_rust::xxh3;

/// XXH3-64 with seed 0 of `bytes`. It finds damage, not malice.
pub fn checksum(bytes: &[u8]) -> u64 {
    xxh3::xxh3_64(bytes)
}

/// The same checksum over bytes that come in pieces.
#[derive(Default)]
pub struct Hasher(xxh3::Xxh3);

impl Hasher {
    /// Adds the next piece.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The checksum of all pieces so far, as if they had been one.
    pub fn finish(&self) -> u64 {
        self.0.digest()
    }
}

/// A checksum as people compare them.
pub(crate) fn hex(sum: u64) -> String {
    format!("{sum:016x}")
}
