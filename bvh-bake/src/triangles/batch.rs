//! Triangles with the vertices behind them, where offsets do not determine these: batches of both, and streams of batches.

use super::{Exact, Triangle};
use crate::error::BakeError;
use crate::storage::resources::Resources;
use crate::storage::{Piece, Spill, Stream};
use std::borrow::Cow;
use std::ops::{Deref, Range};

/// Some triangles.
#[derive(Clone, Default)]
pub(crate) struct Batch<'a> {
    pub(crate) triangles: Cow<'a, [Triangle]>,
    /// The vertices of each triangle, or nothing if these follow from the offsets.
    pub(crate) exact: Cow<'a, [Exact]>,
}

impl Deref for Batch<'_> {
    type Target = [Triangle];

    fn deref(&self) -> &[Triangle] {
        &self.triangles
    }
}

impl<'a> Batch<'a> {
    /// Makes a batch of triangles whose vertices follow from their offsets.
    pub(crate) fn of(triangles: impl Into<Cow<'a, [Triangle]>>) -> Self {
        Self { triangles: triangles.into(), exact: Cow::default() }
    }

    /// Returns the triangles at some places.
    pub(crate) fn at(&self, places: impl Iterator<Item = usize> + Clone) -> Batch<'static> {
        let exact = if self.exact.is_empty() { 0 } else { usize::MAX };
        Batch {
            exact: places.clone().take(exact).map(|place| self.exact[place]).collect(),
            triangles: places.map(|place| self.triangles[place]).collect(),
        }
    }

    /// Appends other triangles.
    pub(crate) fn append(&mut self, other: Batch) {
        self.triangles.to_mut().extend_from_slice(&other.triangles);
        self.exact.to_mut().extend_from_slice(&other.exact);
    }
}

/// Triangles that are added a few at a time.
pub(crate) struct BatchStream {
    triangles: Stream<Triangle>,
    /// As many, or none.
    exact: Stream<Exact>,
}

impl BatchStream {
    /// Makes an empty stream for each expected number of triangles.
    pub(crate) fn several(resources: &Resources, counts: &[u64], are_exact: bool) -> Vec<Self> {
        let bytes = size_of::<Triangle>() + if are_exact { size_of::<Exact>() } else { 0 };
        let pieces = resources.pieces(counts, bytes).into_iter();
        pieces
            .map(|piece| Self { triangles: Stream::of_pieces(piece), exact: Stream::of_pieces(piece) })
            .collect()
    }

    /// Makes a finished stream of triangles whose vertices follow from their offsets.
    pub(crate) fn of_stored(pieces: Vec<Piece<Triangle>>) -> Self {
        Self { triangles: Stream::of_stored(pieces), exact: Stream::of_stored(Vec::new()) }
    }

    pub(crate) fn count(&self) -> u64 {
        self.triangles.count()
    }

    pub(crate) fn append(&mut self, spill: &Spill, batch: &Batch) -> Result<(), BakeError> {
        self.triangles.append(spill, &batch.triangles)?;
        self.exact.append(spill, &batch.exact)
    }

    pub(crate) fn append_places(
        &mut self,
        spill: &Spill,
        batch: &Batch,
        places: &[u16],
    ) -> Result<(), BakeError> {
        self.triangles.append_places(spill, &batch.triangles, places)?;
        if batch.exact.is_empty() { Ok(()) } else { self.exact.append_places(spill, &batch.exact, places) }
    }

    /// Stores the triangles that still wait in memory.
    pub(crate) fn finish(&mut self, spill: &Spill) -> Result<(), BakeError> {
        self.triangles.finish(spill)?;
        self.exact.finish(spill)
    }

    pub(crate) fn are_exact(&self) -> bool {
        self.exact.count() > 0
    }

    /// Cuts the triangles of a finished stream into parts of at most `most` triangles.
    pub(crate) fn parts(&self, most: usize) -> Vec<(usize, Range<usize>)> {
        self.triangles.parts(most)
    }

    /// Returns a part.
    pub(crate) fn part(&self, (piece, range): &(usize, Range<usize>)) -> Result<Batch<'_>, BakeError> {
        // Pieces of both streams have the same number of records.
        let exact =
            if self.are_exact() { self.exact.pieces()[*piece].range(range.clone())? } else { Cow::default() };
        Ok(Batch { triangles: self.triangles.pieces()[*piece].range(range.clone())?, exact })
    }

    /// Returns all triangles of a finished stream.
    pub(crate) fn take(self) -> Result<Batch<'static>, BakeError> {
        Ok(Batch { triangles: Cow::Owned(self.triangles.take()?), exact: Cow::Owned(self.exact.take()?) })
    }
}
