//! Bit arrays: integers of a few bits each, stored without gaps, least significant bit first.
//!
//! Value `i` of width `w` takes bits `i * w .. (i + 1) * w` of the bytes, which are read as one little-endian number. At
//! least 8 bytes follow each array, so that a reader may load 64 bits at once.

/// Reads `width` bits (at most 32) from bit `at`. Bits beyond the end read as zero.
#[inline]
pub(crate) fn read_bits(bytes: &[u8], at: usize, width: u32) -> u32 {
    (load_bits(bytes, at) & ((1u64 << width) - 1)) as u32
}

/// Reads at least 57 bits from bit `at` on. Bits beyond the end read as zero.
#[inline]
pub(crate) fn load_bits(bytes: &[u8], at: usize) -> u64 {
    let word = match bytes.get(at / 8..at / 8 + 8) {
        Some(eight) => {
            let mut word = [0; 8];
            word.copy_from_slice(eight);
            u64::from_le_bytes(word)
        }
        None => read_tail(bytes, at / 8),
    };
    word >> (at % 8)
}

/// Reads at least 121 bits from bit `at` on. Bits beyond the end read as zero.
#[inline(always)]
pub(crate) fn load_wide(bytes: &[u8], at: usize) -> u128 {
    let bytes = bytes.get(at / 8..).unwrap_or(&[]);
    let word = match bytes.first_chunk() {
        Some(chunk) => u128::from_le_bytes(*chunk),
        None => read_wide_tail(bytes),
    };
    word >> (at % 8)
}

/// Reads the last bytes of an array, fewer than sixteen, as a number.
#[cold]
fn read_wide_tail(bytes: &[u8]) -> u128 {
    bytes.iter().rev().fold(0, |word, &byte| word << 8 | u128::from(byte))
}

/// Reads the last bytes of an array, fewer than eight, as a number.
#[cold]
fn read_tail(bytes: &[u8], start: usize) -> u64 {
    let tail = bytes.get(start..).unwrap_or(&[]);
    tail.iter().take(8).rev().fold(0, |word, &byte| word << 8 | u64::from(byte))
}

/// Writes an array by appending values.
#[derive(Default)]
pub(crate) struct BitWriter {
    bytes: Vec<u8>,
    pending: u64,
    pending_bits: u32,
}

impl BitWriter {
    /// Appends the low `width` bits (at most 32) of `value`.
    #[inline]
    pub(crate) fn push(&mut self, value: u32, width: u32) {
        debug_assert!(width == 32 || value >> width == 0);
        self.pending |= u64::from(value) << self.pending_bits;
        self.pending_bits += width;
        if self.pending_bits >= 32 {
            self.bytes.extend_from_slice(&(self.pending as u32).to_le_bytes());
            self.pending >>= 32;
            self.pending_bits -= 32;
        }
    }

    /// The number of bits so far.
    pub(crate) fn bits(&self) -> usize {
        8 * self.bytes.len() + self.pending_bits as usize
    }

    /// Returns the bytes. Zeros fill the last one.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        let rest = self.pending_bits.div_ceil(8) as usize;
        self.bytes.extend_from_slice(&self.pending.to_le_bytes()[..rest]);
        self.bytes
    }
}

/// The number of bits that `value` needs: 0 for 0.
pub(crate) fn bit_width(value: u32) -> u32 {
    32 - value.leading_zeros()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_all_widths_round_trip() {
        let mut writer = BitWriter::default();
        let mut expected = Vec::new();
        let mut at = 0;
        for i in 0..2000u32 {
            let width = i % 33;
            let value = (u64::from(i.wrapping_mul(0x9e37_79b9)) & ((1 << width) - 1)) as u32;
            writer.push(value, width);
            expected.push((at, width, value));
            at += width as usize;
        }
        let bytes = writer.finish();
        assert_eq!(bytes.len(), at.div_ceil(8));
        for (at, width, value) in expected {
            assert_eq!(read_bits(&bytes, at, width), value);
        }
        assert_eq!(read_bits(&bytes, at + 1000, 32), 0);
    }
}
