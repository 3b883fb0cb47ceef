//! Judges a binary STL file that has bytes after its last triangle: whether they may be left out, or a copy has mangled the file.
//!
//! Some exporters write a trailer of their own, which means nothing. A copy in text mode, though, puts a CR before each LF byte
//! and so moves all numbers behind it. Two rules tell such files. They need a look at all bytes, which files without a rest are
//! spared.
//!
//! 1. Each LF follows a CR, and there are as many of these pairs as bytes that are left.
//! 2. What is left is no multiple of the size of a triangle, and the triangles are absurd: the largest coordinate is more than
//!    2^[`MAX_SPREAD`] times that of a triangle in the lowest tenth, if each triangle counts with its largest coordinate. Bytes at
//!    wrong places give exponents at random.

use super::TRIANGLE;
use crate::error::{Fault, Place};
use memchr::memchr_iter;

/// The most powers of two between the coordinates of most triangles and the largest coordinate. Models of the solar system with
/// details of a metre have fewer.
const MAX_SPREAD: usize = 44;

/// The bytes after the last triangle, and what tells whether they belong there.
pub(super) struct Leftover {
    bytes: u64,
    /// The byte that was looked at last.
    last: u8,
    /// The LF bytes that follow a CR, and the others.
    pairs: u64,
    single: u64,
    /// The number of triangles by the exponent of their largest coordinate.
    exponents: [u64; 256],
}

impl Leftover {
    /// Makes the judge of a file with so many bytes after its last triangle.
    pub(super) fn new(bytes: u64) -> Self {
        Self { bytes, last: 0, pairs: 0, single: 0, exponents: [0; 256] }
    }

    /// Looks at the next bytes of the file.
    pub(super) fn look(&mut self, bytes: &[u8]) {
        for at in memchr_iter(b'\n', bytes) {
            let before = if at == 0 { self.last } else { bytes[at - 1] };
            if before == b'\r' { self.pairs += 1 } else { self.single += 1 }
        }
        self.last = bytes.last().copied().unwrap_or(self.last);
    }

    /// Counts a triangle with these corners.
    pub(super) fn count(&mut self, corners: &[[f32; 3]; 3]) {
        let largest = corners.as_flattened().iter().fold(0.0, |most: f32, value| most.max(value.abs()));
        self.exponents[(largest.to_bits() >> 23) as usize] += 1;
    }

    /// Returns whether what is left is no multiple of the size of a triangle.
    pub(super) fn is_ragged(&self) -> bool {
        !self.bytes.is_multiple_of(TRIANGLE as u64)
    }

    /// Returns the warning about a file that may have a rest, after all of its bytes, or the fault of a mangled one.
    pub(super) fn judge(&self, end: Place) -> Result<String, Fault> {
        let bytes = counted(self.bytes);
        if self.pairs == self.bytes && self.single == 0 {
            let found = format!(
                "{bytes}, and a CR before each of {} LF; a copy in text mode has mangled the file: copy it again \
                 as binary",
                self.pairs
            );
            return Err(Fault::new(end, "the end of the file after the last triangle", found));
        }
        if let Some(spread) = self.spread().filter(|spread| self.is_ragged() && *spread > MAX_SPREAD) {
            let found = format!(
                "{bytes}, no multiple of {TRIANGLE}, and coordinates 2^{spread} times as large as those of most \
                 triangles; the file is mangled: copy it again as binary"
            );
            return Err(Fault::new(end, "the end of the file after the last triangle", found));
        }
        Ok(format!("left out {bytes} after the last triangle"))
    }

    /// Returns how many powers of two are between the largest coordinate and that of a triangle in the lowest tenth.
    fn spread(&self) -> Option<usize> {
        let largest = self.exponents.iter().rposition(|&count| count > 0)?;
        let tenth = self.exponents.iter().sum::<u64>() / 10;
        let mut below = 0;
        let low = self.exponents.iter().position(|&count| {
            below += count;
            below > tenth
        })?;
        Some(largest - low)
    }
}

fn counted(bytes: u64) -> String {
    if bytes == 1 { "1 more byte".to_owned() } else { format!("{bytes} more bytes") }
}
