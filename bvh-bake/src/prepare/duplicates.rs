//! Finds exact duplicates: triangles whose corners are the same points in any order. Of equal triangles, the first is
//! kept.
//!
//! The hashes of all triangles are sorted. Triangles that share their hash with another are then sorted by their
//! corners, so that equal ones become neighbours. Different triangles may have the same hash, even many of them by
//! intent. This costs the second sort, but such triangles are never taken for duplicates.
//!
//! If all hashes are in memory, a bitmap first drops most hashes that occur once, because sorting all of them takes ten
//! times as long.

use crate::error::{BakeError, LimitError};
use crate::storage::Spill;
use crate::storage::external_sort::Sorter;
use crate::threads;
use crate::topology::{End, MAX_NET, ends};
use crate::triangles::{Corners, TRIANGLES_PER_PART, Triangle, TriangleStream, Triangles};
use bytemuck::{Pod, Zeroable};
use std::cmp::Ordering;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

/// The hash of a triangle, upper half first, and the triangle's place in the stream.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Hashed([u32; 3]);

impl Hashed {
    fn hash(self) -> u64 {
        u64::from(self.0[0]) << 32 | u64::from(self.0[1])
    }

    fn place(self) -> u32 {
        self.0[2]
    }
}

/// Compares by hash, then by place.
impl Ord for Hashed {
    fn cmp(&self, other: &Self) -> Ordering {
        self.hash().cmp(&other.hash()).then(self.place().cmp(&other.place()))
    }
}

impl PartialOrd for Hashed {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The bits per hash of the bitmap that finds hashes which occur once; an eighth of these share their bit with another
/// hash.
const BITS_PER_HASH: usize = 8;

/// A triangle that shares its hash with another. Suspects are sorted by their fields, the first one first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Suspect {
    /// The corners in a fixed order.
    corners: [End; 3],
    /// The place in the stream.
    place: u64,
    id: u64,
    turn: Turn,
}

/// 1 if a triangle goes around its corners against their fixed order, else 0. Where corners are equal it is 0, because
/// the triangle goes around them in both ways.
type Turn = u64;

/// What [`find`] finds.
pub(crate) enum Found {
    /// The id of a triangle that is kept, and that of an equal one.
    Pair([u32; 2]),
    /// A triangle that is kept, how many equal ones have its orientation, itself included, less the number of those
    /// that have the opposite one, which makes other than 1, and the bits of its corners.
    Net { id: u32, net: i32, corners: [End; 3] },
}

/// Returns the hash of the triangle at a place. Triangles with the same vertices have the same offsets.
#[inline]
pub(crate) fn hashed(corners: &Corners, place: u64) -> Hashed {
    // A sum of the hashes of corners does not depend on their order.
    let of_corner = |corner: &[f32; 3]| {
        let [x, y, z] = corner.map(|value| u64::from(value.to_bits()));
        mixed(mixed(x << 32 | y).wrapping_add(z))
    };
    let hash = mixed(corners.iter().map(of_corner).fold(0, u64::wrapping_add));
    Hashed([(hash >> 32) as u32, hash as u32, place as u32])
}

/// Spreads the bits of a number: the upper half of its product with 2^64 over the golden ratio falls onto the lower half. Numbers
/// that are 0 do not stay so.
#[inline]
fn mixed(number: u64) -> u64 {
    let product = u128::from(number ^ 0x2545_f491_4f6c_dd1d) * 0x9e37_79b9_7f4a_7c15;
    product as u64 ^ (product >> 64) as u64
}

/// Returns corners in a fixed order.
#[inline(always)]
fn canonical<T: Copy + Ord>([mut a, mut b, mut c]: [T; 3]) -> ([T; 3], Turn) {
    let mut turn = b < a;
    (a, b) = (a.min(b), a.max(b));
    turn ^= c < b;
    (b, c) = (b.min(c), b.max(c));
    turn ^= b < a;
    (a, b) = (a.min(b), a.max(b));
    turn &= a != b && b != c;
    ([a, b, c], turn.into())
}

/// The triangle that is kept of equal ones, and the net of those seen so far.
struct Group {
    kept: Suspect,
    net: i64,
}

impl Group {
    /// Passes the net on, after the last triangle of the group, if it is not 1.
    fn finish(self, found: &mut impl FnMut(Found) -> Result<(), BakeError>) -> Result<(), BakeError> {
        let Self { kept, net } = self;
        if net == 1 {
            return Ok(());
        }
        if net.abs() > MAX_NET {
            return Err(LimitError::EqualTriangles.into());
        }
        let [a, b, c] = kept.corners;
        let corners = if kept.turn == 0 { [a, b, c] } else { [a, c, b] };
        found(Found::Net { id: kept.id as u32, net: net as i32, corners })
    }
}

/// Drops most of the hashes that occur once, namely those that are alone in their bit of the bitmap.
fn drop_single(hashes: &mut Vec<Hashed>, spill: &Spill) -> Result<(), BakeError> {
    let bits = (hashes.len() * BITS_PER_HASH).next_power_of_two().max(64);
    let bitmap = || (0..bits / 64).map(|_| AtomicU64::new(0)).collect::<Vec<_>>();
    let (once, twice) = (bitmap(), bitmap());
    let place = |hashed: &Hashed| {
        let bit = hashed.hash() as usize & (bits - 1);
        (bit / 64, 1 << (bit % 64))
    };
    let marked = threads::map(hashes.chunks(TRIANGLES_PER_PART), |hashes| {
        for (word, bit) in hashes.iter().map(place) {
            if once[word].fetch_or(bit, Relaxed) & bit != 0 {
                twice[word].fetch_or(bit, Relaxed);
            }
        }
        spill.go_on()
    });
    marked.into_iter().collect::<Result<(), _>>()?;
    let mut kept = 0;
    for start in (0..hashes.len()).step_by(TRIANGLES_PER_PART) {
        spill.go_on()?;
        for at in start..hashes.len().min(start + TRIANGLES_PER_PART) {
            let (word, bit) = place(&hashes[at]);
            hashes[kept] = hashes[at];
            kept += usize::from(twice[word].load(Relaxed) & bit != 0);
        }
    }
    hashes.truncate(kept);
    Ok(())
}

/// Finds the places of duplicates from the hashes of all triangles, as one bit per triangle, or no bits at all if there
/// are no duplicates. Passes the pairs and the nets to `found`. Sorts `run` records at a time.
pub(crate) fn find(
    stream: &TriangleStream,
    mut hashes: Sorter<Hashed>,
    run: usize,
    spill: &Spill,
    mut found: impl FnMut(Found) -> Result<(), BakeError>,
) -> Result<Vec<u64>, BakeError> {
    let words = stream.count.div_ceil(64) as usize;
    let mut shared: Vec<u64> = Vec::new();
    let mut last: Option<Hashed> = None;
    if let Some(hashes) = hashes.in_memory() {
        drop_single(hashes, spill)?;
    }
    hashes.visit(|hashed| {
        if let Some(last) = last.filter(|last| last.hash() == hashed.hash()) {
            shared.resize(words, 0);
            [last.place(), hashed.place()].into_iter().for_each(|place| set(&mut shared, place));
        }
        last = Some(*hashed);
        Ok(())
    })?;
    if shared.is_empty() {
        return Ok(shared);
    }
    let mut suspects = Sorter::of_runs(run);
    let batch = 4 * threads::current_num_threads();
    for start in (0..stream.parts()).step_by(batch) {
        let parts = start..(start + batch).min(stream.parts());
        for part in threads::map(parts, |part| of_part(stream, part, &shared)) {
            suspects.extend(&part?, spill)?;
        }
    }
    let mut dropped = shared;
    dropped.fill(0);
    let mut any = false;
    // Of equal triangles, the one with the first place is kept.
    let mut last: Option<Group> = None;
    suspects.visit(|suspect| match &mut last {
        Some(Group { kept, net }) if kept.corners == suspect.corners => {
            any = true;
            set(&mut dropped, suspect.place as u32);
            *net += if kept.turn == suspect.turn { 1 } else { -1 };
            found(Found::Pair([kept.id as u32, suspect.id as u32]))
        }
        _ => {
            let next = Group { kept: *suspect, net: 1 };
            last.replace(next).map_or(Ok(()), |group| group.finish(&mut found))
        }
    })?;
    last.map_or(Ok(()), |group| group.finish(&mut found))?;
    Ok(if any { dropped } else { Vec::new() })
}

/// Returns the triangles of a part whose bit in `shared` is set.
fn of_part(stream: &TriangleStream, part: usize, shared: &[u64]) -> Result<Vec<Suspect>, BakeError> {
    let first = part * TRIANGLES_PER_PART;
    let words = &shared[first / 64..shared.len().min((first + TRIANGLES_PER_PART) / 64)];
    if words.iter().all(|&word| word == 0) {
        return Ok(Vec::new());
    }
    let triangles = stream.part(part)?;
    let suspect = |(place, triangle): (usize, &Triangle)| {
        if words[place / 64] >> (place % 64) & 1 == 0 {
            return None;
        }
        let (corners, turn) = canonical(ends(triangle, triangles.exact.get(place)));
        Some(Suspect { corners, place: (first + place) as u64, id: triangle.id.into(), turn })
    };
    Ok(triangles.iter().enumerate().filter_map(suspect).collect())
}

fn set(bits: &mut [u64], place: u32) {
    bits[place as usize / 64] |= 1 << (place % 64);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Progress;
    use crate::storage::Scratch;
    use crate::triangles::{Part, Triangle};

    /// A mesh forged such that all hashes are equal. Comparing each triangle with each other one would take minutes.
    #[test]
    fn equal_hashes_are_no_duplicates_and_take_no_quadratic_time() {
        let progress = Progress::default();
        let spill = Scratch::in_memory(&progress).spill();
        let count = 300_000u32;
        // Every tenth triangle equals the one before it, with its corners in another order.
        let corners = |number: u32| {
            let at = |corner: u32| [number as f32, corner as f32, 0.0];
            [at(0), at(1), at(2)]
        };
        let triangle = |id: u32| {
            let [a, b, c] = corners(if id % 10 == 9 { id - 1 } else { id });
            Triangle { corners: if id % 10 == 9 { [c, a, b] } else { [a, b, c] }, id }
        };
        let all: Vec<Triangle> = (0..count).map(triangle).collect();
        let parts = all
            .chunks(TRIANGLES_PER_PART)
            .map(|part| Part::Narrow(spill.put(part.to_vec()).unwrap()))
            .collect();
        let stream = TriangleStream { parts, count: count.into(), placement: None };
        let mut hashes = Sorter::of_runs(count as usize);
        (0..count).for_each(|place| hashes.extend(&[Hashed([7, 7, place])], &spill).unwrap());
        let mut pairs = Vec::new();
        let dropped = find(&stream, hashes, count as usize, &spill, |found| {
            if let Found::Pair(pair) = found {
                pairs.push(pair);
            }
            Ok(())
        });
        pairs.sort_unstable();
        let expected: Vec<[u32; 2]> = (9..count).step_by(10).map(|id| [id - 1, id]).collect();
        assert!(pairs == expected);
        let dropped = dropped.unwrap();
        assert!(
            (0..count)
                .all(|place| (dropped[place as usize / 64] >> (place % 64) & 1 == 1) == (place % 10 == 9))
        );
    }
}
