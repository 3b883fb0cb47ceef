//! Keeps records in pieces, in the order in which they were added.

use super::{Piece, Spill};
use crate::error::BakeError;
use bytemuck::Pod;
use std::ops::Range;

/// Records that are added a few at a time. The last ones wait in memory until they fill a piece.
pub(crate) struct Stream<T> {
    pieces: Vec<Piece<T>>,
    tail: Vec<T>,
    /// The number of records in a full piece.
    piece: usize,
    count: u64,
}

impl<T: Pod> Stream<T> {
    /// Makes an empty stream with pieces of `piece` records.
    pub(crate) fn of_pieces(piece: usize) -> Self {
        Self { pieces: Vec::new(), tail: Vec::new(), piece: piece.max(1), count: 0 }
    }

    /// Makes a finished stream of pieces.
    pub(crate) fn of_stored(pieces: Vec<Piece<T>>) -> Self {
        let count = pieces.iter().map(|piece| piece.len() as u64).sum();
        Self { pieces, tail: Vec::new(), piece: 1, count }
    }

    /// Returns the number of records added so far.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Adds records after all others.
    pub(crate) fn append(&mut self, spill: &Spill, mut records: &[T]) -> Result<(), BakeError> {
        while !records.is_empty() {
            let (now, later) = records.split_at(records.len().min(self.room()));
            self.tail.extend_from_slice(now);
            self.added(now.len(), spill)?;
            records = later;
        }
        Ok(())
    }

    /// Adds the records at the given places, after all others.
    pub(crate) fn append_places(
        &mut self,
        spill: &Spill,
        records: &[T],
        mut places: &[u16],
    ) -> Result<(), BakeError> {
        while !places.is_empty() {
            let (now, later) = places.split_at(places.len().min(self.room()));
            self.tail.extend(now.iter().map(|&place| records[usize::from(place)]));
            self.added(now.len(), spill)?;
            places = later;
        }
        Ok(())
    }

    /// Returns the number of records for which the open piece has room.
    fn room(&mut self) -> usize {
        if self.tail.capacity() == 0 {
            self.tail.reserve_exact(self.piece);
        }
        self.piece - self.tail.len()
    }

    /// Counts records that were added to the open piece, and stores the piece if it is full.
    fn added(&mut self, records: usize, spill: &Spill) -> Result<(), BakeError> {
        self.count += records as u64;
        if self.tail.len() == self.piece {
            self.pieces.push(spill.put(std::mem::take(&mut self.tail))?);
        }
        Ok(())
    }

    /// Stores the records that still wait in memory.
    pub(crate) fn finish(&mut self, spill: &Spill) -> Result<(), BakeError> {
        if !self.tail.is_empty() {
            let mut tail = std::mem::take(&mut self.tail);
            tail.shrink_to_fit();
            self.pieces.push(spill.put(tail)?);
        }
        Ok(())
    }

    /// Returns all pieces of a finished stream.
    pub(crate) fn pieces(&self) -> &[Piece<T>] {
        &self.pieces
    }

    /// Cuts the records of a finished stream into parts of at most `most` records. Each part is a piece's number and
    /// a range of that piece's records.
    pub(crate) fn parts(&self, most: usize) -> Vec<(usize, Range<usize>)> {
        let of_piece = |(number, piece): (usize, &Piece<T>)| {
            let length = piece.len();
            (0..length).step_by(most).map(move |start| (number, start..(start + most).min(length)))
        };
        self.pieces.iter().enumerate().flat_map(of_piece).collect()
    }

    /// Returns all records of a finished stream and consumes the stream.
    pub(crate) fn take(mut self) -> Result<Vec<T>, BakeError> {
        if self.pieces.len() == 1
            && let Some(piece) = self.pieces.pop()
        {
            return piece.take();
        }
        let mut all = Vec::with_capacity(self.count as usize);
        for piece in self.pieces {
            all.extend_from_slice(&piece.all()?);
        }
        Ok(all)
    }
}
