//! The triangles of an object in the order of their ids, part by part, as often as they are needed.
//!
//! Parts are small enough for every thread to hold a few. What goes through all triangles does so by `fold`, an
//! accumulator a thread, or by `distribute`, which puts records into streams in their order.

use crate::error::BakeError;
use crate::placement::{Moved, Placement};
use crate::progress::Tally;
use crate::scratch::{Piece, Spill, Stream};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Three corners around the origin, in mesh units.
pub(crate) type Corners = [[f32; 3]; 3];

/// Triangles in a full part.
pub(crate) const PART: usize = 1 << 14;

/// A triangle as a file holds it, with its number in the input.
#[derive(Clone, Copy, Pod, Zeroable, Debug, PartialEq)]
#[repr(C)]
pub(crate) struct Triangle {
    pub(crate) corners: Corners,
    pub(crate) id: u32,
}

/// A triangle of the input whose coordinates are not all `f32`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct WideTriangle {
    pub(crate) corners: [[f64; 3]; 3],
    pub(crate) id: u32,
    pub(crate) spare: u32,
}

/// Triangles that are gone through part by part, any number of times.
pub(crate) trait Triangles: Sync {
    /// Number of parts.
    fn parts(&self) -> usize;
    /// The triangles of a part.
    fn part(&self, number: usize) -> Result<Cow<'_, [Triangle]>, BakeError>;
}

/// Adds each part to an accumulator, of which each thread has one for a run of parts; returns them in order.
pub(crate) fn fold<A: Send>(
    parts: usize,
    new: impl Fn() -> A + Sync,
    add: impl Fn(&mut A, usize) -> Result<(), BakeError> + Sync,
) -> Result<Vec<A>, BakeError> {
    let run = parts.div_ceil(rayon::current_num_threads()).max(1);
    let starts: Vec<usize> = (0..parts).step_by(run).collect();
    let of_run = |start: usize| {
        let mut sum = new();
        (start..(start + run).min(parts)).try_for_each(|part| add(&mut sum, part))?;
        Ok(sum)
    };
    starts.into_par_iter().map(of_run).collect()
}

/// Records in groups, each group in the order given.
pub(crate) struct Grouped<T> {
    records: Vec<T>,
    /// Where each group ends.
    ends: Vec<usize>,
}

impl<T: Pod> Grouped<T> {
    /// Puts each record into one of `groups` groups.
    pub(crate) fn new(records: &[T], groups: usize, group_of: impl Fn(usize, &T) -> u32) -> Self {
        let of: Vec<u32> =
            records.iter().enumerate().map(|(place, record)| group_of(place, record)).collect();
        let mut ends = vec![0; groups];
        of.iter().for_each(|&group| ends[group as usize] += 1);
        let mut start = 0;
        for end in &mut ends {
            (*end, start) = (start, start + *end);
        }
        let mut grouped = vec![T::zeroed(); records.len()];
        for (record, &group) in records.iter().zip(&of) {
            let end = &mut ends[group as usize];
            grouped[*end] = *record;
            *end += 1;
        }
        Self { records: grouped, ends }
    }

    fn group(&self, group: usize) -> &[T] {
        let start = if group == 0 { 0 } else { self.ends[group - 1] };
        &self.records[start..self.ends[group]]
    }
}

/// Adds what `make` gives for each part to the streams, a group to each, in the order of the parts; then finishes the
/// streams. `tally` is over the records.
pub(crate) fn distribute<T: Pod + Send + Sync>(
    parts: usize,
    make: impl Fn(usize) -> Result<Grouped<T>, BakeError> + Sync,
    streams: &mut [Stream<T>],
    spill: &Spill,
    tally: &Tally,
) -> Result<(), BakeError> {
    // A few parts at a time are in memory.
    let batch = 4 * rayon::current_num_threads();
    for start in (0..parts).step_by(batch) {
        let made = (start..(start + batch).min(parts)).into_par_iter().map(&make);
        let made: Vec<Grouped<T>> = made.collect::<Result<_, _>>()?;
        streams.par_iter_mut().enumerate().try_for_each(|(group, stream)| {
            made.iter().try_for_each(|part| stream.append(spill, part.group(group)))
        })?;
        tally.add(made.iter().map(|part| part.records.len() as u64).sum());
    }
    streams.par_iter_mut().try_for_each(|stream| stream.finish(spill))
}

/// Triangles in a finished stream.
pub(crate) struct InStream<'a> {
    stream: &'a Stream<Triangle>,
    parts: Vec<(usize, Range<usize>)>,
}

impl<'a> InStream<'a> {
    pub(crate) fn new(stream: &'a Stream<Triangle>) -> Self {
        Self { stream, parts: stream.parts(PART) }
    }
}

impl Triangles for InStream<'_> {
    fn parts(&self) -> usize {
        self.parts.len()
    }

    fn part(&self, number: usize) -> Result<Cow<'_, [Triangle]>, BakeError> {
        let (piece, range) = &self.parts[number];
        self.stream.pieces()[*piece].range(range.clone())
    }
}

/// A part of the input as it was read.
pub(crate) enum Part {
    Narrow(Piece<Triangle>),
    Wide(Piece<WideTriangle>),
}

/// All triangles of an object, duplicates included. All parts but the last are full.
pub(crate) struct Soup {
    pub(crate) parts: Vec<Part>,
    pub(crate) count: u64,
    /// What is done to each corner when it is read; `None` if that has been done.
    pub(crate) placement: Option<Placement>,
}

impl Soup {
    /// The triangles of a part, and how far their corners were moved.
    pub(crate) fn measured_part(&self, number: usize) -> Result<(Cow<'_, [Triangle]>, Moved), BakeError> {
        let mut moved = Moved::default();
        let placed = match (&self.parts[number], &self.placement) {
            (Part::Narrow(piece), None) => piece.all()?,
            (Part::Narrow(piece), Some(placement)) => {
                let place = |triangle: &Triangle| Triangle {
                    corners: triangle.corners.map(|c| placement.place(c.map(f64::from), &mut moved)),
                    id: triangle.id,
                };
                Cow::Owned(piece.all()?.iter().map(place).collect())
            }
            (Part::Wide(piece), placement) => {
                let placement = placement.unwrap_or_default();
                let place = |triangle: &WideTriangle| Triangle {
                    corners: triangle.corners.map(|corner| placement.place(corner, &mut moved)),
                    id: triangle.id,
                };
                Cow::Owned(piece.all()?.iter().map(place).collect())
            }
        };
        Ok((placed, moved))
    }
}

impl Triangles for Soup {
    fn parts(&self) -> usize {
        self.parts.len()
    }

    fn part(&self, number: usize) -> Result<Cow<'_, [Triangle]>, BakeError> {
        Ok(self.measured_part(number)?.0)
    }
}

/// A soup without its duplicates.
pub(crate) struct Kept<'a> {
    pub(crate) soup: &'a Soup,
    /// A bit for each triangle that is left out; empty if none is.
    dropped: &'a [u64],
    /// For each part the triangles kept in all before it, then those of the whole.
    firsts: Vec<u64>,
}

impl<'a> Kept<'a> {
    pub(crate) fn new(soup: &'a Soup, dropped: &'a [u64]) -> Self {
        let mut firsts = vec![0];
        let mut first = 0;
        for part in 0..soup.parts.len() {
            let size = (soup.count - (part * PART) as u64).min(PART as u64);
            let words = dropped.get(part * PART / 64..).unwrap_or(&[]);
            let missing: u32 = words.iter().take(PART / 64).map(|word| word.count_ones()).sum();
            first += size - u64::from(missing);
            firsts.push(first);
        }
        Self { soup, dropped, firsts }
    }

    /// Triangles kept.
    pub(crate) fn count(&self) -> u64 {
        self.firsts[self.soup.parts.len()]
    }

    /// Triangles kept before a part.
    pub(crate) fn first(&self, part: usize) -> u64 {
        self.firsts[part]
    }
}

impl Triangles for Kept<'_> {
    fn parts(&self) -> usize {
        self.soup.parts.len()
    }

    fn part(&self, number: usize) -> Result<Cow<'_, [Triangle]>, BakeError> {
        let all = self.soup.part(number)?;
        if self.firsts[number + 1] - self.firsts[number] == all.len() as u64 {
            return Ok(all);
        }
        let first = number * PART;
        let is_kept = |place: &usize| self.dropped[(first + place) / 64] >> ((first + place) % 64) & 1 == 0;
        Ok(Cow::Owned((0..all.len()).filter(is_kept).map(|place| all[place]).collect()))
    }
}
