//! Sorts records of which there may be more than fit in memory: sorted runs, then a merge of all.

use crate::error::BakeError;
use crate::scratch::{Piece, Spill};
use bytemuck::Pod;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Records that are to be sorted.
pub(crate) struct Sorter<T> {
    runs: Vec<Piece<T>>,
    open: Vec<T>,
    /// Records of a run.
    run: usize,
    count: u64,
}

/// Bytes that are read at a time of each run.
const READ_BYTES: usize = 1 << 16;

impl<T: Pod + Ord + Send + Sync> Sorter<T> {
    /// Sorts runs of so many records at a time, all at once if there are no more.
    pub(crate) fn of_runs(run: usize) -> Self {
        Self { runs: Vec::new(), open: Vec::new(), run: run.max(1), count: 0 }
    }

    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    pub(crate) fn extend(&mut self, mut records: &[T], spill: &Spill) -> Result<(), BakeError> {
        self.count += records.len() as u64;
        while !records.is_empty() {
            let (now, later) = records.split_at(records.len().min(self.run - self.open.len()));
            self.open.extend_from_slice(now);
            records = later;
            if self.open.len() == self.run {
                let mut run = std::mem::take(&mut self.open);
                run.par_sort_unstable();
                self.runs.push(spill.put(run)?);
            }
        }
        Ok(())
    }

    /// Visits all records in ascending order.
    pub(crate) fn visit(
        mut self,
        mut visit: impl FnMut(&T) -> Result<(), BakeError>,
    ) -> Result<(), BakeError> {
        self.open.par_sort_unstable();
        if self.runs.is_empty() {
            return self.open.iter().try_for_each(visit);
        }
        let block = (READ_BYTES / size_of::<T>()).max(1);
        let mut readers: Vec<Reader<T>> = self.runs.into_iter().map(|run| Reader::new(run, block)).collect();
        readers.push(Reader { run: None, next: 0, block, open: self.open, at: 0 });
        let mut heap = BinaryHeap::with_capacity(readers.len());
        for (number, reader) in readers.iter_mut().enumerate() {
            if let Some(record) = reader.next()? {
                heap.push(Reverse((record, number)));
            }
        }
        while let Some(mut least) = heap.peek_mut() {
            let Reverse((record, number)) = *least;
            visit(&record)?;
            match readers[number].next()? {
                Some(record) => *least = Reverse((record, number)),
                None => drop(std::collections::binary_heap::PeekMut::pop(least)),
            }
        }
        Ok(())
    }
}

/// Reads a run from its beginning.
struct Reader<T> {
    run: Option<Piece<T>>,
    /// The first record not read yet.
    next: usize,
    block: usize,
    open: Vec<T>,
    at: usize,
}

impl<T: Pod> Reader<T> {
    fn new(run: Piece<T>, block: usize) -> Self {
        Self { run: Some(run), next: 0, block, open: Vec::new(), at: 0 }
    }

    fn next(&mut self) -> Result<Option<T>, BakeError> {
        if self.at == self.open.len()
            && let Some(run) = &self.run
        {
            let end = (self.next + self.block).min(run.len());
            self.open = run.range(self.next..end)?.into_owned();
            (self.next, self.at) = (end, 0);
        }
        let record = self.open.get(self.at).copied();
        self.at += 1;
        Ok(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    #[test]
    fn runs_are_merged() {
        let directory = tempfile::tempdir().unwrap();
        let scratch = Scratch::in_directory(directory.path(), 1000, &Default::default());
        let records: Vec<[u32; 2]> = (0..50_000u32).map(|i| [i.wrapping_mul(0x9e37_79b9) >> 20, i]).collect();
        let mut expected = records.clone();
        expected.sort();
        for run in [1000, 1001, 100_000] {
            let spill = scratch.spill();
            let mut sorter = Sorter::of_runs(run);
            records.chunks(777).for_each(|some| sorter.extend(some, &spill).unwrap());
            let mut sorted = Vec::new();
            let keep = |record: &[u32; 2]| {
                sorted.push(*record);
                Ok(())
            };
            sorter.visit(keep).unwrap();
            assert_eq!(sorted, expected);
        }
    }
}
