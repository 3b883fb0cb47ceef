//! Divides the memory budget of a bake or a check among its stages, and provides scratch files for the rest.

use super::Scratch;
use crate::error::Halt;
use crate::progress::Progress;
use crate::threads;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The most triangles of a brick, which is what a bake builds at once. The bytes of a file depend on this number.
pub(crate) const MAX_BRICK_TRIANGLES: usize = 1 << 18;

/// Bytes that any bake or check needs for the program, its threads and everything that is allocated page by page.
pub(crate) const MIN_BYTES: u64 = 8 << 20;
/// Bytes of memory per triangle of a brick, from its triangles to its pages.
const BRICK_BYTES_PER_TRIANGLE: u64 = 300;
/// Bytes of the records that wait until their piece of a file is full, and bytes of a run that is sorted at once.
const BUFFER_BYTES: u64 = 16 << 20;

/// Tasks of reading per thread, so that no thread waits for the others.
const READING_TASKS_PER_THREAD: usize = 4;

/// Bytes of memory for each thread of a check: its stack, one page and the blocks of that page.
pub(crate) const CHECK_BYTES_PER_THREAD: u64 = 1 << 20;
/// The least and the most bytes of each buffer of a check.
const CHECK_BUFFER_BYTES: [u64; 2] = [4 << 20, 32 << 20];
/// The buffers of a check: two for a window of corners, two for each of two sorters, and two for some pages with
/// their leaf blocks.
const CHECK_BUFFERS: u64 = 8;

/// Bytes of memory for blocks and pieces while a file is read that is larger.
pub(crate) const READING_BYTES: u64 = 6 << 20;

/// Memory that is needed for a while or to the end, beside what goes to scratch files when there is too much of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Allowance {
    /// The most bytes.
    pub(crate) free: u64,
    /// The budget of the whole process.
    budget: u64,
    /// The bytes by which the budget must grow for one more byte.
    cost: u64,
}

impl Allowance {
    /// Allows as much as there is.
    pub(crate) const UNLIMITED: Self = Self { free: u64::MAX, budget: u64::MAX, cost: 1 };

    /// Allows what a budget leaves for inputs, of which `taken` bytes are in memory.
    pub(crate) fn of_inputs(budget: u64, taken: u64) -> Self {
        Self { free: budget.saturating_sub(MIN_BYTES).saturating_sub(taken), budget, cost: 1 }
    }

    /// Allows `bytes` bytes less.
    pub(crate) fn less(self, bytes: u64) -> Self {
        Self { free: self.free.saturating_sub(bytes), ..self }
    }

    /// Refuses more bytes than are allowed.
    pub(crate) fn require(self, bytes: u64) -> Result<(), Halt> {
        if bytes <= self.free {
            return Ok(());
        }
        let needed = self.budget.saturating_add((bytes - self.free).saturating_mul(self.cost));
        Err(Halt::Memory { needed, budget: self.budget })
    }
}

/// The memory and the scratch files that a bake or a check may use, and the counters of its progress.
pub(crate) struct Resources {
    pub(crate) scratch: Arc<Scratch>,
    pub(crate) progress: Progress,
    /// The most bricks that are built at the same time.
    pub(crate) bricks: usize,
    /// Bytes of the bricks that are built at the same time. Other stages may use them before that.
    pub(crate) brick_bytes: usize,
    /// Bytes of each buffer, or `None` where everything stays in memory.
    buffers: Option<u64>,
    /// What a document may take that is read as a whole. The memory for bricks is free meanwhile.
    pub(crate) document: Allowance,
    /// What names, objects and instances may take together, and what they take.
    keeping: Allowance,
    kept: AtomicU64,
}

/// Returns the bytes that `bricks` bricks take while they are built.
fn bytes_of_bricks(bricks: u64) -> u64 {
    bricks * MAX_BRICK_TRIANGLES as u64 * BRICK_BYTES_PER_TRIANGLE
}

impl Resources {
    /// Allows as much memory as the work takes.
    pub(crate) fn unlimited(progress: &Progress) -> Self {
        let bricks = threads::current_num_threads();
        Self {
            scratch: Scratch::in_memory(progress),
            progress: progress.clone(),
            bricks,
            brick_bytes: bytes_of_bricks(bricks as u64) as usize,
            buffers: None,
            document: Allowance::UNLIMITED,
            keeping: Allowance::UNLIMITED,
            kept: AtomicU64::new(0),
        }
    }

    /// Allows `budget` bytes of memory for the whole process, of which inputs have taken `taken`. What does not fit goes
    /// to scratch files in `directory`.
    pub(crate) fn within(budget: u64, taken: u64, directory: &Path, progress: &Progress) -> Self {
        let (whole, budget) = (budget, budget.saturating_sub(taken));
        let threads = threads::current_num_threads() as u64;
        let brick = MAX_BRICK_TRIANGLES as u64 * BRICK_BYTES_PER_TRIANGLE;
        let fixed = MIN_BYTES + 2 * BUFFER_BYTES;
        let bricks = (budget.saturating_sub(fixed) / brick).clamp(1, threads);
        let left = budget.saturating_sub(fixed + bricks * brick);
        // Only half of the rest, because the allocator does not always return freed memory to the system.
        Self {
            scratch: Scratch::in_directory(directory, left / 2, progress),
            progress: progress.clone(),
            bricks: bricks as usize,
            // A budget for a small mesh is less than a brick takes.
            brick_bytes: bytes_of_bricks(bricks).min(budget.saturating_sub(MIN_BYTES)) as usize,
            buffers: Some(BUFFER_BYTES),
            ..Self::keeping_within(whole, budget.saturating_sub(MIN_BYTES + left / 2))
        }
    }

    /// Allows `budget` bytes of memory for a process that checks a file and builds no bricks.
    pub(crate) fn of_check(budget: u64, directory: &Path) -> Self {
        let [least, most] = CHECK_BUFFER_BYTES;
        let buffer = (budget / (2 * CHECK_BUFFERS)).clamp(least, most);
        let left = budget.saturating_sub(check_bytes(buffer));
        // Nobody reads the progress of a check.
        let progress = Progress::default();
        Self {
            scratch: Scratch::in_directory(directory, left / 2, &progress),
            progress,
            bricks: 1,
            brick_bytes: 2 * buffer as usize,
            buffers: Some(buffer),
            ..Self::keeping_within(budget, budget.saturating_sub(MIN_BYTES + left / 2))
        }
    }

    /// Allows `free` bytes for a document, and as many for what is kept to the end.
    fn keeping_within(budget: u64, free: u64) -> Self {
        let allowance = Allowance { free, budget, cost: 2 };
        Self { document: allowance, keeping: allowance, ..Self::unlimited(&Progress::default()) }
    }

    /// Counts names, objects and instances, and refuses more of them than there is memory for. Pieces have less room then.
    pub(crate) fn keep(&self, bytes: u64) -> Result<(), Halt> {
        self.scratch.hold(bytes);
        let kept = self.kept.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        self.keeping.require(kept).map_err(|halt| match halt {
            // How many follow is not known. The budget that is told is enough for as many as there were.
            Halt::Memory { needed, budget } => {
                Halt::Memory { needed: needed.saturating_add(2 * kept), budget }
            }
            other => other,
        })
    }

    /// Returns the bytes of names, objects and instances.
    pub(crate) fn kept(&self) -> u64 {
        self.kept.load(Ordering::Relaxed)
    }

    /// Returns the bytes of memory without which no file can be compared with a mesh.
    pub(crate) fn least_of_check() -> u64 {
        check_bytes(CHECK_BUFFER_BYTES[0])
    }

    /// Returns the bytes of memory without which `triangles` triangles cannot be baked, even if all else goes to
    /// files.
    pub(crate) fn least(triangles: u64) -> u64 {
        let brick = triangles.min(MAX_BRICK_TRIANGLES as u64) * BRICK_BYTES_PER_TRIANGLE;
        // With several bricks come the grids of cells, the buffers, and one bit per triangle.
        let shared =
            if triangles > MAX_BRICK_TRIANGLES as u64 { 2 * BUFFER_BYTES + triangles / 8 } else { 0 };
        MIN_BYTES + brick + shared
    }

    /// Returns how many tasks of reading may run side by side or wait, each of which takes `bytes_per_task` bytes.
    /// Together they take a quarter of the memory for bricks, which is free until bricks are built.
    pub(crate) fn reading_tasks(&self, bytes_per_task: usize) -> usize {
        let most = READING_TASKS_PER_THREAD * threads::current_num_threads();
        (self.brick_bytes / 4 / bytes_per_task).clamp(1, most)
    }

    /// Returns how many of `records` records are sorted at once.
    pub(crate) fn sorted_at_once<T>(&self, records: u64) -> usize {
        let most = self.buffers.map_or(u64::MAX, |bytes| bytes / size_of::<T>() as u64);
        usize::try_from(records.min(most)).unwrap_or(usize::MAX)
    }

    /// Returns how many records of `bytes` bytes a piece of each of several streams has, given how many they expect.
    pub(crate) fn pieces(&self, counts: &[u64], bytes: usize) -> Vec<usize> {
        let most = match self.buffers {
            Some(buffer) => buffer / (counts.len().max(1) * bytes) as u64,
            None => u64::MAX,
        };
        counts.iter().map(|&count| count.min(most) as usize).collect()
    }
}

/// Returns the bytes that a check with buffers of `buffer` bytes takes, besides what the scratch keeps in memory.
fn check_bytes(buffer: u64) -> u64 {
    MIN_BYTES + threads::current_num_threads() as u64 * CHECK_BYTES_PER_THREAD + CHECK_BUFFERS * buffer
}
