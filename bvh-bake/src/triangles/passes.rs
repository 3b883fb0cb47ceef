//! Passes over triangles, part by part: `fold` accumulates them per thread, `distribute` sorts them into streams.

use super::{Batch, BatchStream, TRIANGLES_PER_PART, Triangle, Triangles};
use crate::error::BakeError;
use crate::storage::Spill;
use crate::threads;
use std::ops::Range;

/// Adds each part to an accumulator. Each thread has one accumulator for a run of successive parts; all of them are
/// returned in the order of their parts.
pub(crate) fn fold<A: Send>(
    parts: usize,
    new: impl Fn() -> A + Sync,
    add: impl Fn(&mut A, usize) -> Result<(), BakeError> + Sync,
) -> Result<Vec<A>, BakeError> {
    let run = parts.div_ceil(threads::current_num_threads()).max(1);
    let of_run = |start: usize| {
        let mut sum = new();
        (start..(start + run).min(parts)).try_for_each(|part| add(&mut sum, part))?;
        Ok(sum)
    };
    threads::map((0..parts).step_by(run), of_run).into_iter().collect()
}

/// The triangles of a part in groups, each in the order of the part. The triangles themselves are not moved.
pub(crate) struct Grouped<'a> {
    triangles: Batch<'a>,
    /// The places of the triangles, group after group; empty if there is only one group.
    places: Vec<u16>,
    /// The position after the last place of each group.
    ends: Vec<usize>,
}

// Places in a part have 16 bits.
const _: () = assert!(TRIANGLES_PER_PART <= 1 << 16);

impl<'a> Grouped<'a> {
    /// Puts each triangle of a part into one of `groups` groups.
    pub(crate) fn new(
        triangles: Batch<'a>,
        groups: usize,
        group_of: impl Fn(usize, &Triangle) -> u32,
    ) -> Self {
        if groups == 1 {
            return Self { ends: vec![triangles.len()], triangles, places: Vec::new() };
        }
        let of: Vec<u32> =
            triangles.iter().enumerate().map(|(place, triangle)| group_of(place, triangle)).collect();
        let mut ends = vec![0; groups];
        of.iter().for_each(|&group| ends[group as usize] += 1);
        let mut start = 0;
        for end in &mut ends {
            (*end, start) = (start, start + *end);
        }
        let mut places = vec![0; triangles.len()];
        for (place, &group) in (0..).zip(&of) {
            let end = &mut ends[group as usize];
            places[*end] = place;
            *end += 1;
        }
        Self { triangles, places, ends }
    }

    /// Appends the triangles of a group to a stream.
    fn append_to(&self, group: usize, stream: &mut BatchStream, spill: &Spill) -> Result<(), BakeError> {
        if self.ends.len() == 1 {
            return stream.append(spill, &self.triangles);
        }
        let start = if group == 0 { 0 } else { self.ends[group - 1] };
        stream.append_places(spill, &self.triangles, &self.places[start..self.ends[group]])
    }
}

/// Groups each part by `make` and appends each group to its stream, in the order of the parts. Then finishes the
/// streams.
pub(crate) fn distribute<'a>(
    parts: usize,
    make: impl Fn(usize) -> Result<Grouped<'a>, BakeError> + Sync,
    streams: &mut [BatchStream],
    spill: &Spill,
) -> Result<(), BakeError> {
    // Only this many parts are in memory at the same time.
    let batch = 4 * threads::current_num_threads();
    for start in (0..parts).step_by(batch) {
        let made = threads::map(start..(start + batch).min(parts), &make);
        let made = made.into_iter().collect::<Result<Vec<Grouped>, _>>()?;
        let append = |(group, stream): (usize, &mut _)| {
            made.iter().try_for_each(|part| part.append_to(group, stream, spill))
        };
        threads::map(streams.iter_mut().enumerate(), append).into_iter().collect::<Result<(), _>>()?;
    }
    threads::map(streams, |stream| stream.finish(spill)).into_iter().collect()
}

/// The triangles of a finished stream.
pub(crate) struct InStream<'a> {
    stream: &'a BatchStream,
    parts: Vec<(usize, Range<usize>)>,
}

impl<'a> InStream<'a> {
    pub(crate) fn new(stream: &'a BatchStream) -> Self {
        Self { stream, parts: stream.parts(TRIANGLES_PER_PART) }
    }
}

impl Triangles for InStream<'_> {
    fn parts(&self) -> usize {
        self.parts.len()
    }

    fn part(&self, number: usize) -> Result<Batch<'_>, BakeError> {
        self.stream.part(&self.parts[number])
    }

    fn are_exact(&self) -> bool {
        self.stream.are_exact()
    }
}
