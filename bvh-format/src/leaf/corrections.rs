//! Corrections of a leaf block: what makes predicted coordinates exact, where a predictor misses them.
//!
//! They stand behind the packets of a block, from its next line on, so that filters never load them. An axis has a
//! correction for every corner, or a list of the corners that have one. The corners of a plain block are its lanes; those
//! of a packed one are the vertices of its pool. Section 11.3 of `spec/format.md` states the place of each byte.

use crate::bits::{BitWriter, load_wide};

/// Bytes of the head of the corrections of a block.
pub const CORRECTIONS_HEAD_BYTES: usize = 40;
/// Bytes of a number of a corner in a list.
const CORNER_BYTES: usize = 2;

/// The head of the corrections of a block.
///
/// ```
/// use bvh_format::leaf::{Corrections, F32_PACKET_BYTES, LINE, Packet, TriangleEncoding, WidePacket, encode_block};
/// use bvh_format::vertex::Vertices;
///
/// let vertices = Vertices { corrected: [true, false, false], left_out: [1e-8, 0.0, 0.0], ..Vertices::around([0.0; 3]) };
/// let packet = Packet::new(&[[[0.1_f32, 0.0, 0.0]; 3]]);
/// let wide = WidePacket::new(&[[[0.1_f64, 0.0, 0.0]; 3]]);
/// let block = encode_block(TriangleEncoding::F32, &[packet], &[0], &vertices, &[wide]);
/// let behind = &block[F32_PACKET_BYTES.next_multiple_of(LINE)..];
/// assert_eq!(Corrections::read(behind).map(|head| head.counts), Some([12, 0, 0])); // x of all corners
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corrections {
    /// For each axis, the number of corners with a correction: none, all, or those in a list.
    pub counts: [u32; 3],
    /// Bits of a correction, per axis: at most 64.
    pub bits: [u8; 3],
    /// The number that corrections count from, per axis.
    pub base: [i64; 3],
}

impl Corrections {
    /// Reads the head, or returns `None` if there are fewer bytes.
    #[inline]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let head = bytes.first_chunk::<CORRECTIONS_HEAD_BYTES>()?;
        let word = |at: usize| [head[at], head[at + 1], head[at + 2], head[at + 3]].map(u64::from);
        let half = |at: usize| word(at).into_iter().rev().fold(0, |sum, byte| sum << 8 | byte);
        Some(Self {
            counts: [0, 4, 8].map(|at| half(at) as u32),
            bits: [head[12], head[13], head[14]],
            base: [16, 24, 32].map(|at| (half(at) | half(at + 4) << 32) as i64),
        })
    }

    /// Returns true if the numbers are within the limits for a block of `corners` corners, and none are on other axes than
    /// those that are corrected.
    pub(crate) fn is_consistent(&self, corners: usize, corrected: [bool; 3]) -> bool {
        (0..3).all(|axis| {
            let count = self.counts[axis] as usize;
            count <= corners && self.bits[axis] <= 64 && (corrected[axis] || count == 0)
        })
    }

    /// The bytes of the list of an axis.
    #[inline(always)]
    fn list_bytes(&self, axis: usize, corners: usize) -> usize {
        let count = self.counts[axis] as usize;
        if count == corners { 0 } else { CORNER_BYTES.saturating_mul(count) }
    }

    /// The bytes of the corrections of an axis.
    #[inline(always)]
    fn array_bytes(&self, axis: usize) -> usize {
        (self.counts[axis] as usize).saturating_mul(self.bits[axis].min(64).into()).div_ceil(8)
    }

    /// The byte at which the list of an axis starts, and the one at which its corrections do.
    #[inline(always)]
    fn places(&self, axis: usize, corners: usize) -> (usize, usize) {
        let lists = (0..3).map(|axis| self.list_bytes(axis, corners));
        let before = |sum: usize, bytes: usize| sum.saturating_add(bytes);
        let list = lists.clone().take(axis).fold(CORRECTIONS_HEAD_BYTES, before);
        let arrays = lists.fold(CORRECTIONS_HEAD_BYTES, before);
        (list, (0..axis).map(|axis| self.array_bytes(axis)).fold(arrays, before))
    }

    /// The bytes that the corrections of a block of `corners` corners take.
    pub(crate) fn bytes(&self, corners: usize) -> usize {
        self.places(2, corners).1.saturating_add(self.array_bytes(2)).saturating_add(8)
    }

    /// Returns true if the numbers of corners in each list ascend and are below `corners`.
    pub(crate) fn are_in_order(&self, bytes: &[u8], corners: usize) -> bool {
        (0..3).all(|axis| {
            let (list, _) = self.places(axis, corners);
            let count = self.list_bytes(axis, corners) / CORNER_BYTES;
            let all = (0..count).map(|place| listed(bytes, list, place));
            all.clone().zip(all.skip(1)).all(|(a, b)| a < b)
                && (count == 0 || usize::from(listed(bytes, list, count - 1)) < corners)
        })
    }

    /// Returns the corrections of an axis of a block of `corners` corners, to look them up.
    #[inline(always)]
    pub(crate) fn of_axis(&self, axis: usize, corners: usize) -> AxisCorrections {
        let (list, array) = self.places(axis, corners);
        let (count, bits) = (self.counts[axis] as usize, self.bits[axis].min(64).into());
        AxisCorrections { count, is_list: count != corners, base: self.base[axis], bits, list, array }
    }
}

/// Returns the number of a corner in a list.
#[inline(always)]
fn listed(bytes: &[u8], list: usize, place: usize) -> u16 {
    let at = list.saturating_add(CORNER_BYTES.saturating_mul(place));
    bytes
        .get(at..at.saturating_add(CORNER_BYTES))
        .map_or(u16::MAX, |two| u16::from_le_bytes([two[0], two[1]]))
}

/// The corrections of an axis.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AxisCorrections {
    count: usize,
    /// Whether a list has the numbers of the corners; else all have a correction.
    is_list: bool,
    base: i64,
    bits: usize,
    /// The byte at which the list starts, and that at which the corrections do.
    list: usize,
    array: usize,
}

impl AxisCorrections {
    /// Returns the correction of a corner; 0 if it has none. Bytes beyond the end read as zero.
    #[inline(always)]
    pub(crate) fn get(&self, bytes: &[u8], corner: usize) -> i64 {
        if self.count == 0 {
            return 0;
        }
        let place = if self.is_list { self.find(bytes, corner) } else { Some(corner) };
        let Some(place) = place else { return 0 };
        let at = self.array.saturating_mul(8).saturating_add(place.saturating_mul(self.bits));
        let offset = (load_wide(bytes, at) & ((1u128 << self.bits) - 1)) as u64;
        self.base.wrapping_add(offset as i64)
    }

    /// Returns the place of a corner in the list.
    fn find(&self, bytes: &[u8], corner: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            if usize::from(listed(bytes, self.list, middle)) < corner {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        (low < self.count && usize::from(listed(bytes, self.list, low)) == corner).then_some(low)
    }
}

/// Makes the corrections of a block, given those of all corners, axis by axis. Zeros to the end of the line are missing.
pub(super) fn encode(all: &[Vec<i64>; 3]) -> Vec<u8> {
    let mut head = Corrections { counts: [0; 3], bits: [0; 3], base: [0; 3] };
    let mut lists: [Vec<u16>; 3] = Default::default();
    for (axis, corrections) in all.iter().enumerate() {
        // A list of those that are not 0, or all of them, whichever takes fewer bits.
        let width = |least: i64, most: i64| 64 - most.wrapping_sub(least).cast_unsigned().leading_zeros();
        let ends = |of: &mut dyn Iterator<Item = i64>| {
            of.fold((i64::MAX, i64::MIN), |(least, most), value| (least.min(value), most.max(value)))
        };
        let listed = corrections.iter().filter(|&&correction| correction != 0).count();
        if listed == 0 {
            continue;
        }
        let of_some = ends(&mut corrections.iter().copied().filter(|&correction| correction != 0));
        let of_all = ends(&mut corrections.iter().copied());
        let bits_of_list = listed * (8 * CORNER_BYTES + width(of_some.0, of_some.1) as usize);
        let bits_of_all = corrections.len() * width(of_all.0, of_all.1) as usize;
        let is_list = listed < corrections.len() && bits_of_list < bits_of_all;
        let (least, most) = if is_list { of_some } else { of_all };
        (head.base[axis], head.bits[axis]) = (least, width(least, most) as u8);
        head.counts[axis] = if is_list { listed } else { corrections.len() } as u32;
        if is_list {
            let numbered = (0..).zip(corrections).filter(|(_, correction)| **correction != 0);
            lists[axis] = numbered.map(|(corner, _)| corner).collect();
        }
    }
    let mut bytes = Vec::with_capacity(head.bytes(all[0].len()));
    head.counts.iter().for_each(|count| bytes.extend_from_slice(&count.to_le_bytes()));
    bytes.extend_from_slice(&head.bits);
    bytes.push(0);
    head.base.iter().for_each(|base| bytes.extend_from_slice(&base.to_le_bytes()));
    lists.iter().flatten().for_each(|corner| bytes.extend_from_slice(&corner.to_le_bytes()));
    for (axis, corrections) in all.iter().enumerate() {
        let mut writer = BitWriter::default();
        let is_list = !lists[axis].is_empty();
        if head.counts[axis] > 0 {
            for correction in corrections.iter().filter(|&&correction| !is_list || correction != 0) {
                let offset = correction.wrapping_sub(head.base[axis]).cast_unsigned();
                let low = u32::from(head.bits[axis]).min(32);
                writer.push((offset & ((1 << low) - 1)) as u32, low);
                writer.push((offset >> 32) as u32, u32::from(head.bits[axis]) - low);
            }
        }
        bytes.extend_from_slice(&writer.finish());
    }
    bytes.extend_from_slice(&[0; 8]);
    debug_assert_eq!(bytes.len(), head.bytes(all[0].len()));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    /// Corrections of all widths, of all corners and of few, are those that were given.
    #[test]
    fn corrections_come_back() {
        let mut random = Random::new(6);
        for round in 0..600usize {
            let corners = 1 + random.below(300);
            let all: [Vec<i64>; 3] = std::array::from_fn(|axis| {
                let width = (round + 7 * axis) % 65;
                let share = [0, 1, 40, 100][(round / 3 + axis) % 4];
                let one = |random: &mut Random| {
                    let value = random.bits() as i64;
                    let value = if width == 0 { 5 } else { value >> (64 - width) };
                    if random.below(100) < share { value } else { 0 }
                };
                (0..corners).map(|_| one(&mut random)).collect()
            });
            let bytes = encode(&all);
            let head = Corrections::read(&bytes).unwrap();
            let corrected = [0, 1, 2].map(|axis| all[axis].iter().any(|&correction| correction != 0));
            assert!(head.is_consistent(corners, corrected) && head.are_in_order(&bytes, corners));
            assert_eq!(head.bytes(corners), bytes.len());
            for axis in 0..3 {
                for (corner, &correction) in all[axis].iter().enumerate() {
                    assert_eq!(head.of_axis(axis, corners).get(&bytes, corner), correction, "{head:?}");
                }
                if corrected[axis] {
                    assert!(!head.is_consistent(corners, [false; 3]));
                }
            }
        }
    }

    #[test]
    fn any_bytes_are_read_without_a_panic() {
        let mut random = Random::new(8);
        for _ in 0..20_000 {
            let bytes: Vec<u8> = (0..random.below(120)).map(|_| random.bits() as u8).collect();
            let Some(head) = Corrections::read(&bytes) else { continue };
            let corners = random.below(1 << 16);
            let _ = (
                head.is_consistent(corners, [true; 3]),
                head.bytes(corners),
                head.are_in_order(&bytes, corners),
            );
            for axis in 0..3 {
                let _ = head.of_axis(axis, corners).get(&bytes, random.below(1 << 16));
            }
        }
    }
}
