//! Finds exact duplicates: triangles whose corners are the same points in any order. The first of equals is kept.
//!
//! Hashes of all triangles are sorted. Those that share theirs with another are looked at again, value by value: no
//! mesh can be made of which a triangle is taken for another's duplicate.

use crate::error::BakeError;
use crate::progress::Tally;
use crate::scratch::Spill;
use crate::sorter::Sorter;
use crate::soup::{Corners, PART, Soup, Triangles};
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// A triangle's hash, upper half first, and its place in the soup.
pub(crate) type Hashed = [u32; 3];

/// The same, then its corners in a fixed order, then its id.
type Candidate = [u32; 13];

/// The hash of the triangle in a place.
pub(crate) fn hashed(corners: &Corners, place: u64) -> Hashed {
    let hash = xxh3_64(bytemuck::bytes_of(&canonical(corners)));
    [(hash >> 32) as u32, hash as u32, place as u32]
}

/// The corners' bits in a fixed order.
fn canonical(triangle: &Corners) -> [[u32; 3]; 3] {
    let mut corners = triangle.map(|corner| corner.map(f32::to_bits));
    corners.sort_unstable();
    corners
}

/// Of all triangles' hashes finds the places of duplicates, a bit for each triangle (none at all without
/// duplicates), and gives `found` the pairs (kept id, id of an equal triangle). `run` records are sorted at a time.
/// `tally` is over the triangles.
pub(crate) fn find(
    soup: &Soup,
    hashes: Sorter<Hashed>,
    run: usize,
    spill: &Spill,
    tally: &Tally,
    mut found: impl FnMut([u32; 2]) -> Result<(), BakeError>,
) -> Result<Vec<u64>, BakeError> {
    let words = soup.count.div_ceil(64) as usize;
    let mut shared: Vec<u64> = Vec::new();
    let mut last: Option<Hashed> = None;
    let mut visited = 0;
    hashes.visit(|hashed| {
        visited += 1;
        if visited % PART == 0 {
            tally.add(PART as u64);
        }
        if let Some(last) = last.filter(|last| last[..2] == hashed[..2]) {
            shared.resize(words, 0);
            [last[2], hashed[2]].into_iter().for_each(|place| set(&mut shared, place));
        }
        last = Some(*hashed);
        Ok(())
    })?;
    if shared.is_empty() {
        return Ok(shared);
    }
    let mut candidates = Sorter::of_runs(run);
    let batch = 4 * rayon::current_num_threads();
    for start in (0..soup.parts()).step_by(batch) {
        let parts = (start..(start + batch).min(soup.parts())).into_par_iter();
        let parts: Vec<Vec<Candidate>> =
            parts.map(|part| of_part(soup, part, &shared)).collect::<Result<_, _>>()?;
        parts.iter().try_for_each(|part| candidates.extend(part, spill))?;
    }
    let mut dropped = shared;
    dropped.fill(0);
    let mut any = false;
    // Of those with the hash at hand, one of each kind. Equal hashes of different triangles are possible.
    let mut distinct: Vec<Candidate> = Vec::new();
    candidates.visit(|candidate| {
        if distinct.first().is_some_and(|first| first[..2] != candidate[..2]) {
            distinct.clear();
        }
        match distinct.iter().find(|other| other[3..12] == candidate[3..12]) {
            Some(first) => {
                any = true;
                set(&mut dropped, candidate[2]);
                found([first[12], candidate[12]])?;
            }
            None => distinct.push(*candidate),
        }
        Ok(())
    })?;
    Ok(if any { dropped } else { Vec::new() })
}

/// The triangles of a part that have a bit in `shared`.
fn of_part(soup: &Soup, part: usize, shared: &[u64]) -> Result<Vec<Candidate>, BakeError> {
    let first = part * PART;
    let words = &shared[first / 64..shared.len().min((first + PART) / 64)];
    if words.iter().all(|&word| word == 0) {
        return Ok(Vec::new());
    }
    let triangles = soup.part(part)?;
    let candidate = |(place, triangle): (usize, &crate::soup::Triangle)| {
        if words[place / 64] >> (place % 64) & 1 == 0 {
            return None;
        }
        let mut candidate = [0; 13];
        candidate[..3].copy_from_slice(&hashed(&triangle.corners, (first + place) as u64));
        candidate[3..12].copy_from_slice(canonical(&triangle.corners).as_flattened());
        candidate[12] = triangle.id;
        Some(candidate)
    };
    Ok(triangles.iter().enumerate().filter_map(candidate).collect())
}

fn set(bits: &mut [u64], place: u32) {
    bits[place as usize / 64] |= 1 << (place % 64);
}
