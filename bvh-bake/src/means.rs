//! What a bake may use: the memory for its stages, divided among them, and the scratch files.

use crate::build::BRICK;
use crate::progress::Progress;
use crate::scratch::{Scratch, Stream};
use bytemuck::Pod;
use std::path::Path;
use std::sync::Arc;

/// Bytes that any bake needs: the program, its threads and what is allocated page by page.
const BYTES_AT_LEAST: u64 = 8 << 20;
/// Bytes of memory a triangle of a brick, from its triangles to its pages.
const BRICK_BYTES_A_TRIANGLE: u64 = 300;
/// Bytes of the records that wait for their piece of a file to fill up, and of a run that is sorted at once.
const BUFFER_BYTES: u64 = 16 << 20;

/// The memory and the files of a bake, and where it counts what it does.
pub(crate) struct Means {
    pub(crate) scratch: Arc<Scratch>,
    pub(crate) progress: Progress,
    /// Bricks that are built side by side, at most.
    pub(crate) bricks: usize,
    /// Bytes of buffers; `None` where all is in memory.
    buffers: Option<u64>,
}

impl Means {
    /// As much memory as it takes.
    pub(crate) fn unlimited(progress: &Progress) -> Self {
        Self {
            scratch: Scratch::in_memory(progress),
            progress: progress.clone(),
            bricks: rayon::current_num_threads(),
            buffers: None,
        }
    }

    /// Within `budget` bytes of memory for the whole process; what does not fit goes to files in `directory`.
    pub(crate) fn within(budget: u64, directory: &Path, progress: &Progress) -> Self {
        let threads = rayon::current_num_threads() as u64;
        let brick = BRICK as u64 * BRICK_BYTES_A_TRIANGLE;
        let fixed = BYTES_AT_LEAST + 2 * BUFFER_BYTES;
        let bricks = (budget.saturating_sub(fixed) / brick).clamp(1, threads);
        let left = budget.saturating_sub(fixed + bricks * brick);
        // Half of it: what has been freed is not always given back.
        let scratch = Scratch::in_directory(directory, left / 2, progress);
        let progress = progress.clone();
        Self { scratch, progress, bricks: bricks as usize, buffers: Some(BUFFER_BYTES) }
    }

    /// Bytes of memory without which `triangles` triangles cannot be baked, whatever goes to files.
    pub(crate) fn least(triangles: u64) -> u64 {
        let brick = triangles.min(BRICK as u64) * BRICK_BYTES_A_TRIANGLE;
        // Grids of cells and buffers, when there are several bricks; a bit for each triangle.
        let shared = if triangles > BRICK as u64 { 2 * BUFFER_BYTES + triangles / 8 } else { 0 };
        BYTES_AT_LEAST + brick + shared
    }

    /// Bytes of the bricks that are built side by side, which are free until then.
    pub(crate) fn brick_bytes(&self) -> usize {
        self.bricks * BRICK * BRICK_BYTES_A_TRIANGLE as usize
    }

    /// How many of so many records are sorted at once.
    pub(crate) fn sorted_at_once<T>(&self, records: u64) -> usize {
        let most = self.buffers.map_or(u64::MAX, |bytes| bytes / size_of::<T>() as u64);
        records.min(most) as usize
    }

    /// An empty stream for each of the counts, which are of the records expected.
    pub(crate) fn streams<T: Pod>(&self, counts: &[u64]) -> Vec<Stream<T>> {
        let most = match self.buffers {
            Some(bytes) => bytes / (counts.len().max(1) * size_of::<T>()) as u64,
            None => u64::MAX,
        };
        counts.iter().map(|&count| Stream::of_pieces(count.min(most) as usize)).collect()
    }
}
