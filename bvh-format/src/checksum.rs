//! The checksum that guards every part of a file: XXH3 with 64 bits and seed 0.

use std::fmt::{self, Display, Formatter};
use xxhash_rust::xxh3;

/// Returns the checksum of `bytes`. It detects damage, but not forgery.
pub fn checksum(bytes: &[u8]) -> u64 {
    xxh3::xxh3_64(bytes)
}

/// Computes the same checksum from bytes that arrive in pieces.
///
/// ```
/// use bvh_format::checksum::{Hasher, checksum};
///
/// let mut hasher = Hasher::default();
/// hasher.update(b"one part, ");
/// hasher.update(b"and another");
/// assert_eq!(hasher.finish(), checksum(b"one part, and another"));
/// ```
#[derive(Default)]
pub struct Hasher(xxh3::Xxh3);

impl Hasher {
    /// Adds the next piece.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Returns the checksum of all pieces so far, as if they were one.
    pub fn finish(&self) -> u64 {
        self.0.digest()
    }
}

/// Shows a checksum as 16 hexadecimal digits.
pub(crate) fn hex(sum: u64) -> Hex {
    Hex(sum)
}

/// A checksum that is written only where an error shows it.
#[derive(PartialEq)]
pub(crate) struct Hex(u64);

impl Display for Hex {
    fn fmt(&self, formatter: &mut Formatter) -> fmt::Result {
        write!(formatter, "{:016x}", self.0)
    }
}
