//! Damages files in any of the ways in which bytes go wrong, at random but mostly where structures are, and misstates their numbers.

use crate::Random;
use crate::seal::{put, seal, section};

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

/// Replaces so many words of a file, most of them in its tables and pages, by values that mislead readers. The sections are found in
/// `original`, where no word misleads yet.
pub fn mislead(bytes: &mut [u8], original: &[u8], words: u64, random: &mut Random) {
    for _ in 0..words {
        let place = section(original, [1, 2, 2, 3, 4, 5, 6, 1][random.below(8)]);
        let place = if place.len() < 4 { section(original, 2) } else { place };
        let place = if place.len() < 4 { 0..original.len() } else { place };
        // The part of a page, block or table that is in use lies at its start.
        let at = place.start + random.below(place.len().min(700)) / 4 * 4;
        let values = [0, 1, 0xff, u32::MAX, 0x7fc0_0000, 0x7f80_0000, random.bits() as u32];
        let value = values[random.below(values.len())].to_le_bytes();
        if at + 4 <= bytes.len() {
            put(bytes, at, &value);
        }
    }
}

/// Returns files that state too large numbers, and what each states: every word of the header, the section table, the object table
/// and the first page header is set to large values in turn. All checksums are right.
pub fn overstated(honest: &[u8]) -> impl Iterator<Item = (String, Vec<u8>)> {
    let (objects, nodes) = (section(honest, 1).start, section(honest, 2).start);
    let places = (8..40).step_by(4).chain((64..256).step_by(4));
    let places = places.chain((0..16 + 192).step_by(4).map(move |at| objects + at));
    let places = places.chain((0..64).step_by(4).map(move |at| nodes + at));
    let values = [u32::MAX, i32::MAX as u32, 1 << 20];
    places.flat_map(move |place| values.map(|value| (place, value))).map(|(place, value)| {
        let mut bytes = honest.to_vec();
        put(&mut bytes, place, &value.to_le_bytes());
        seal(&mut bytes);
        (format!("byte {place}, {value:#x}"), bytes)
    })
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
