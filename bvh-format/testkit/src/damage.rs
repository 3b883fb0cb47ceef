//! Damages files in any of the ways in which bytes go wrong: at random, but mostly where structures are.

use crate::Random;
use crate::seal::{put, section};

/// Returns a place in a file of any bytes, more often one that is in use: near the start of a page or of a section.
pub fn place_in_file(bytes: &[u8], random: &mut Random) -> usize {
    let start = match random.below(4) {
        0 => section(bytes, 1 + random.below(8) as u32).start,
        1 => section(bytes, 2).start + 64,
        _ => 4096 * random.below(bytes.len().div_ceil(4096)),
    };
    let within = if random.below(3) == 0 { random.below(4096) } else { random.below(512) };
    (start + within).min(bytes.len() - 1)
}

/// Damages a file in one way, whose name it returns. Parts of `other` may replace parts of the file. What is too short for
/// a page stays as it is.
pub fn damage(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) -> &'static str {
    if bytes.len() <= 4096 || other.is_empty() {
        return "nothing";
    }
    let at = place_in_file(bytes, random);
    let word = at.min(bytes.len() - 4) & !3;
    match random.below(10) {
        0 | 1 => {
            for _ in 0..1 + random.below(3) {
                let at = place_in_file(bytes, random);
                bytes[at] ^= 1 << random.below(8);
            }
            "flipped"
        }
        2 => {
            bytes[at] = if random.below(2) == 0 { random.bits() as u8 } else { bytes[at].wrapping_add(1) };
            "set"
        }
        3 => {
            let values: [u32; 8] =
                [0, 1, u32::MAX, 0x7f80_0000, 0xff80_0000, 0x7fc0_0000, 0x8000_0000, 0x7f7f_ffff];
            put(bytes, word, &values[random.below(8)].to_le_bytes());
            "limit"
        }
        4 => {
            // A number of f32 grows by a power of two.
            let exponent = (random.below(64) as u32) << 23;
            let value = u32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[word + i]));
            put(bytes, word, &value.wrapping_add(exponent).to_le_bytes());
            "scaled"
        }
        5 => {
            // A stretch of the file itself replaces bytes.
            let length = random.below(128).min(bytes.len() - at);
            let from = random.below(bytes.len() - length);
            bytes.copy_within(from..from + length, at);
            "copied"
        }
        6 => {
            // A stretch of another file replaces bytes, at the same place or at any place.
            let most = 2 << random.below(13);
            let length = (1 + random.below(most)).min(bytes.len() - at);
            let from = if random.below(2) == 0 { at } else { place_in_file(other, random) };
            let stretch = &other[from.min(other.len())..(from + length).min(other.len())];
            put(bytes, at, stretch);
            "spliced"
        }
        7 => {
            match random.below(3) {
                0 => bytes.truncate(random.below(bytes.len())),
                1 => bytes.truncate(4096 * random.below(bytes.len() / 4096)),
                _ => bytes.extend((0..random.below(5000)).map(|i| i as u8)),
            }
            "truncated"
        }
        8 => {
            // A page, line or word replaces another one.
            let unit = [4096, 64, 8][random.below(3)];
            let (to, from) = (at / unit * unit, place_in_file(bytes, random) / unit * unit);
            let length = unit.min(bytes.len() - to).min(bytes.len() - from);
            bytes.copy_within(from..from + length, to);
            "doubled"
        }
        _ => {
            // A page, line or byte is inserted or removed, and everything after it moves.
            let unit = [4096, 64, 1][random.below(3)];
            let end = (at + unit).min(bytes.len());
            if random.below(2) == 0 {
                bytes.drain(at..end);
            } else {
                let more = bytes[at..end].to_vec();
                bytes.splice(at..at, more);
            }
            "moved"
        }
    }
}
