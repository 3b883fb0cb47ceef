//! What a bake or a check may use: the memory for its stages, divided among them, and the scratch files.

use crate::build::BRICK;
use crate::progress::Progress;
use crate::scratch::{Scratch, Stream};
use bytemuck::Pod;
use std::path::Path;
use std::sync::Arc;

/// Bytes that any bake or check needs: the program, its threads and what is allocated page by page.
pub(crate) const BYTES_AT_LEAST: u64 = 8 << 20;
/// Bytes of memory a triangle of a brick, from its triangles to its pages.
const BRICK_BYTES_A_TRIANGLE: u64 = 300;
/// Bytes of the records that wait for their piece of a file to fill up, and of a run that is sorted at once.
const BUFFER_BYTES: u64 = 16 << 20;

/// Bytes of memory for each thread of a check: its stack, a page and its blocks.
pub(crate) const CHECK_BYTES_A_THREAD: u64 = 1 << 20;
/// Bytes of the buffers of a check: at least, and at most.
const CHECK_BUFFER_BYTES: [u64; 2] = [4 << 20, 32 << 20];
/// Buffers of a check: a window of corners takes two, two sorters two each, some pages with their leaf blocks two.
const CHECK_BUFFERS: u64 = 8;

/// The memory and the files of a bake or a check, and where it counts what it does.
pub(crate) struct Means {
    pub(crate) scratch: Arc<Scratch>,
    pub(crate) progress: Progress,
    /// Bricks that are built side by side, at most.
    pub(crate) bricks: usize,
    /// Bytes of the bricks that are built side by side, which are free until then.
    pub(crate) brick_bytes: usize,
    /// Bytes of buffers; `None` where all is in memory.
    buffers: Option<u64>,
}

/// Bytes of so many bricks.
fn bytes_of_bricks(bricks: u64) -> usize {
    (bricks * BRICK as u64 * BRICK_BYTES_A_TRIANGLE) as usize
}

impl Means {
    /// As much memory as it takes.
    pub(crate) fn unlimited(progress: &Progress) -> Self {
        let bricks = rayon::current_num_threads();
        Self {
            scratch: Scratch::in_memory(progress),
            progress: progress.clone(),
            bricks,
            brick_bytes: bytes_of_bricks(bricks as u64),
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
        Self {
            scratch: Scratch::in_directory(directory, left / 2, progress),
            progress: progress.clone(),
            bricks: bricks as usize,
            brick_bytes: bytes_of_bricks(bricks),
            buffers: Some(BUFFER_BYTES),
        }
    }

    /// Within `budget` bytes of memory for a process that checks a file and builds no bricks.
    pub(crate) fn of_check(budget: u64, directory: &Path) -> Self {
        let [least, most] = CHECK_BUFFER_BYTES;
        let buffer = (budget / (2 * CHECK_BUFFERS)).clamp(least, most);
        let left = budget.saturating_sub(check_bytes(buffer));
        // Nobody looks at how far it is.
        let progress = Progress::default();
        Self {
            scratch: Scratch::in_directory(directory, left / 2, &progress),
            progress,
            bricks: 1,
            brick_bytes: 2 * buffer as usize,
            buffers: Some(buffer),
        }
    }

    /// Bytes of memory without which no file can be compared with a mesh.
    pub(crate) fn least_of_check() -> u64 {
        check_bytes(CHECK_BUFFER_BYTES[0])
    }

    /// Bytes of memory without which `triangles` triangles cannot be baked, whatever goes to files.
    pub(crate) fn least(triangles: u64) -> u64 {
        let brick = triangles.min(BRICK as u64) * BRICK_BYTES_A_TRIANGLE;
        // Grids of cells and buffers, when there are several bricks; a bit for each triangle.
        let shared = if triangles > BRICK as u64 { 2 * BUFFER_BYTES + triangles / 8 } else { 0 };
        BYTES_AT_LEAST + brick + shared
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

/// Bytes that a check with such buffers takes besides what the scratch keeps in memory.
fn check_bytes(buffer: u64) -> u64 {
    BYTES_AT_LEAST + rayon::current_num_threads() as u64 * CHECK_BYTES_A_THREAD + CHECK_BUFFERS * buffer
}
