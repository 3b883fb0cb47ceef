//! Keeps the triangles of an input in the order of their ids, without placing or rounding them.

use crate::error::BakeError;
use crate::input::mesh::{Instance, renumber, tell_apart};
use crate::storage::{Spill, Stream};
use crate::triangles::Part;
use std::borrow::Cow;

/// The number of runs in a piece.
const PIECE_RUNS: usize = 1 << 14;

/// Consecutive triangles of one object: its number, and how many.
pub(super) struct ObjectRuns {
    done: Stream<[u32; 2]>,
    open: [u32; 2],
}

impl ObjectRuns {
    pub(super) fn new() -> Self {
        Self { done: Stream::of_pieces(PIECE_RUNS), open: [0, 0] }
    }

    /// Adds triangles of an object. The total is at most [`MAX_TRIANGLES`](crate::limits::MAX_TRIANGLES).
    pub(super) fn add(&mut self, object: usize, count: u64, spill: &Spill) -> Result<(), BakeError> {
        if self.open[0] as usize != object {
            self.close(spill)?;
            self.open = [object as u32, 0];
        }
        self.open[1] += count as u32;
        Ok(())
    }

    fn close(&mut self, spill: &Spill) -> Result<(), BakeError> {
        if self.open[1] > 0 { self.done.append(spill, &[self.open]) } else { Ok(()) }
    }

    fn finish(mut self, spill: &Spill) -> Result<Stream<[u32; 2]>, BakeError> {
        self.close(spill)?;
        self.done.finish(spill)?;
        Ok(self.done)
    }
}

/// All triangles of all files.
pub(crate) struct InputOrder {
    parts: Vec<Part>,
    runs: Stream<[u32; 2]>,
    counts: Vec<u64>,
    /// For each object, its number among the objects with triangles.
    numbers: Vec<u32>,
    instances: Vec<Instance>,
}

impl InputOrder {
    /// Makes the order of the given parts and runs. `objects` is the number of all objects, with or without triangles, and
    /// instances are by these numbers.
    pub(super) fn new(
        parts: Vec<Part>,
        runs: ObjectRuns,
        objects: usize,
        mut instances: Vec<Instance>,
        spill: &Spill,
    ) -> Result<Self, BakeError> {
        let runs = runs.finish(spill)?;
        let mut all = vec![0u64; objects];
        for piece in runs.pieces() {
            piece.all()?.iter().for_each(|&[object, count]| all[object as usize] += u64::from(count));
        }
        let is_full: Vec<bool> = all.iter().map(|&count| count > 0).collect();
        renumber(&mut instances, &is_full);
        tell_apart(&mut instances);
        let (mut counts, mut numbers) = (Vec::new(), Vec::new());
        for count in all {
            numbers.push(counts.len() as u32);
            counts.extend(Some(count).filter(|&count| count > 0));
        }
        Ok(Self { parts, runs, counts, numbers, instances })
    }

    /// Returns the number of triangles of each object that has any.
    pub(crate) fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// Returns the instances, by the numbers of objects among those with triangles.
    pub(crate) fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Calls `visit` for every triangle with its object's number among those with triangles, its id and its corners.
    pub(crate) fn each_triangle<E: From<BakeError>>(
        &self,
        mut visit: impl FnMut(u32, u32, &[[f64; 3]; 3]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut runs = self.runs.pieces().iter();
        let mut open: Cow<[[u32; 2]]> = Cow::default();
        let (mut number, mut left, mut at) = (0, 0, 0);
        let mut one = |id: u32, corners: &[[f64; 3]; 3]| {
            if left == 0 {
                if at == open.len() {
                    // The runs contain as many triangles as the parts.
                    open = runs.next().map_or(Ok(Default::default()), |piece| piece.all())?;
                    at = 0;
                }
                let Some(&[object, count]) = open.get(at) else { return Ok(()) };
                (number, left, at) = (self.numbers[object as usize], count, at + 1);
            }
            left -= 1;
            visit(number, id, corners)
        };
        for part in &self.parts {
            match part {
                Part::Narrow(piece) => {
                    for triangle in piece.all()?.iter() {
                        one(triangle.id, &triangle.corners.map(|corner| corner.map(f64::from)))?;
                    }
                }
                Part::Wide(piece) => {
                    for triangle in piece.all()?.iter() {
                        one(triangle.id, &triangle.corners)?;
                    }
                }
            }
        }
        Ok(())
    }
}
