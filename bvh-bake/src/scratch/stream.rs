//! Records in the order in which they were added, in pieces.

use super::{Piece, Spill};
use crate::error::BakeError;
use bytemuck::Pod;
use std::ops::Range;

/// Records that are added a few at a time. What has been added last waits in memory until it fills a piece.
pub(crate) struct Stream<T> {
    pieces: Vec<Piece<T>>,
    tail: Vec<T>,
    /// Records of a piece.
    piece: usize,
    count: u64,
}

impl<T: Pod> Stream<T> {
    /// Pieces of so many records.
    pub(crate) fn of_pieces(piece: usize) -> Self {
        Self { pieces: Vec::new(), tail: Vec::new(), piece: piece.max(1), count: 0 }
    }

    /// Records added.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Adds records behind the others.
    pub(crate) fn append(&mut self, spill: &Spill, mut records: &[T]) -> Result<(), BakeError> {
        self.count += records.len() as u64;
        while !records.is_empty() {
            if self.tail.capacity() == 0 {
                self.tail.reserve_exact(self.piece);
            }
            let (now, later) = records.split_at(records.len().min(self.piece - self.tail.len()));
            self.tail.extend_from_slice(now);
            records = later;
            if self.tail.len() == self.piece {
                self.pieces.push(spill.put(std::mem::take(&mut self.tail))?);
            }
        }
        Ok(())
    }

    /// Puts away what waits in memory.
    pub(crate) fn finish(&mut self, spill: &Spill) -> Result<(), BakeError> {
        if !self.tail.is_empty() {
            let mut tail = std::mem::take(&mut self.tail);
            tail.shrink_to_fit();
            self.pieces.push(spill.put(tail)?);
        }
        Ok(())
    }

    /// All pieces of a finished stream.
    pub(crate) fn pieces(&self) -> &[Piece<T>] {
        &self.pieces
    }

    /// The records of a finished stream in parts of at most so many: which piece, and which of its records.
    pub(crate) fn parts(&self, most: usize) -> Vec<(usize, Range<usize>)> {
        let of_piece = |(number, piece): (usize, &Piece<T>)| {
            let length = piece.len();
            (0..length).step_by(most).map(move |start| (number, start..(start + most).min(length)))
        };
        self.pieces.iter().enumerate().flat_map(of_piece).collect()
    }

    /// All records of a finished stream; the stream is gone.
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
