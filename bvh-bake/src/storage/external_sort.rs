//! Sorts records that may not all fit in memory: sorts runs of them, then merges the runs.

use crate::error::BakeError;
use crate::storage::{Piece, Spill};
use crate::threads;
use bytemuck::Pod;
use std::borrow::Cow;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

/// Collects the records that are to be sorted.
pub(crate) struct Sorter<T> {
    runs: Vec<Piece<T>>,
    open: Vec<T>,
    /// The number of records in a full run.
    run: usize,
    count: u64,
}

/// The most bytes that are read from one run at a time.
const MAX_READ_BYTES: usize = 1 << 16;

impl<T: Pod + Ord + Send + Sync> Sorter<T> {
    /// Sorts runs of `run` records at a time, which means all records at once if there are no more than that.
    pub(crate) fn of_runs(run: usize) -> Self {
        Self { runs: Vec::new(), open: Vec::new(), run: run.max(1), count: 0 }
    }

    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    pub(crate) fn extend(&mut self, mut records: &[T], spill: &Spill) -> Result<(), BakeError> {
        self.count += records.len() as u64;
        while !records.is_empty() {
            // A full run is stored only when more records follow, so that a single run stays in memory.
            if self.open.len() == self.run {
                let mut run = std::mem::take(&mut self.open);
                threads::sort_unstable(&mut run);
                self.runs.push(spill.put(run)?);
            }
            let (now, later) = records.split_at(records.len().min(self.run - self.open.len()));
            self.open.extend_from_slice(now);
            records = later;
        }
        Ok(())
    }

    /// Adds the records of another sorter.
    pub(crate) fn append(&mut self, other: Self, spill: &Spill) -> Result<(), BakeError> {
        self.count += other.count - other.open.len() as u64;
        self.runs.extend(other.runs);
        self.extend(&other.open, spill)
    }

    /// Returns all records in no order, or `None` if some are in files.
    pub(crate) fn in_memory(&mut self) -> Option<&mut Vec<T>> {
        self.runs.is_empty().then_some(&mut self.open)
    }

    /// Visits all records in ascending order.
    pub(crate) fn visit(self, mut visit: impl FnMut(&T) -> Result<(), BakeError>) -> Result<(), BakeError> {
        let sorted = self.finish();
        if sorted.runs.is_empty() {
            return sorted.open.iter().try_for_each(visit);
        }
        let mut merge = sorted.merge();
        while let Some(record) = merge.next()? {
            visit(&record)?;
        }
        Ok(())
    }

    /// Sorts the last run, after the last record has been added.
    pub(crate) fn finish(mut self) -> Sorted<T> {
        threads::sort_unstable(&mut self.open);
        // All blocks together take no more memory than one run.
        let block = (MAX_READ_BYTES / size_of::<T>()).min(self.run / (self.runs.len() + 1)).max(1);
        Sorted { runs: self.runs, open: self.open, block }
    }
}

/// Sorted runs, which can be merged any number of times.
pub(crate) struct Sorted<T> {
    runs: Vec<Piece<T>>,
    open: Vec<T>,
    /// The number of records read from one run at a time.
    block: usize,
}

impl<T: Pod + Ord> Sorted<T> {
    /// Starts a merge, which returns all records in ascending order.
    pub(crate) fn merge(&self) -> Merge<'_, T> {
        let reader = |run| Reader { run: Some(run), next: 0, block: self.block, open: Cow::default(), at: 0 };
        let mut readers: Vec<Reader<T>> = self.runs.iter().map(reader).collect();
        let open = Cow::Borrowed(&self.open[..]);
        readers.push(Reader { run: None, next: 0, block: self.block, open, at: 0 });
        Merge { readers, heap: BinaryHeap::new() }
    }
}

/// Merges sorted runs.
pub(crate) struct Merge<'a, T: Clone> {
    readers: Vec<Reader<'a, T>>,
    /// The next record of each run, with the run's number; empty before the first record and after the last.
    heap: BinaryHeap<Reverse<(T, usize)>>,
}

impl<T: Pod + Ord> Merge<'_, T> {
    /// Returns the next record.
    pub(crate) fn next(&mut self) -> Result<Option<T>, BakeError> {
        if let [only] = &mut self.readers[..] {
            return only.next();
        }
        if self.heap.is_empty() {
            // After the last record, this finds nothing.
            for (number, reader) in self.readers.iter_mut().enumerate() {
                self.heap.extend(reader.next()?.map(|record| Reverse((record, number))));
            }
        }
        let Some(mut least) = self.heap.peek_mut() else { return Ok(None) };
        let Reverse((record, number)) = *least;
        match self.readers[number].next()? {
            Some(next) => *least = Reverse((next, number)),
            None => drop(PeekMut::pop(least)),
        }
        Ok(Some(record))
    }
}

/// A merge with a look at the next record.
pub(crate) struct Ahead<'a, T: Clone> {
    merge: Merge<'a, T>,
    pub(crate) first: Option<T>,
}

impl<'a, T: Pod + Ord + Send + Sync> Ahead<'a, T> {
    pub(crate) fn of(sorted: &'a Sorted<T>) -> Result<Self, BakeError> {
        let mut merge = sorted.merge();
        let first = merge.next()?;
        Ok(Self { merge, first })
    }

    /// Takes the next record if there is one for which `is` is true.
    pub(crate) fn next_if(&mut self, is: impl FnOnce(&T) -> bool) -> Result<Option<T>, BakeError> {
        if !self.first.as_ref().is_some_and(is) {
            return Ok(None);
        }
        let next = self.merge.next()?;
        Ok(std::mem::replace(&mut self.first, next))
    }
}

/// Reads a run from its beginning.
struct Reader<'a, T: Clone> {
    run: Option<&'a Piece<T>>,
    /// The position of the first record that has not been read yet.
    next: usize,
    block: usize,
    open: Cow<'a, [T]>,
    at: usize,
}

impl<T: Pod> Reader<'_, T> {
    fn next(&mut self) -> Result<Option<T>, BakeError> {
        if self.at == self.open.len()
            && let Some(run) = self.run
        {
            let end = (self.next + self.block).min(run.len());
            self.open = run.range(self.next..end)?;
            (self.next, self.at) = (end, 0);
        }
        let record = self.open.get(self.at).copied();
        self.at += usize::from(record.is_some());
        Ok(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::Scratch;

    #[test]
    fn runs_are_merged() {
        let directory = cbvh_testkit::folder();
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
            let mut again = Sorter::of_runs(run);
            again.extend(&records, &spill).unwrap();
            let again = again.finish();
            for _ in 0..2 {
                let mut merge = again.merge();
                let all: Vec<_> = std::iter::from_fn(|| merge.next().unwrap()).collect();
                assert_eq!(all, expected);
                assert_eq!(merge.next().unwrap(), None);
            }
        }
    }
}
