//! Divides a budget of memory among bakes that run in parallel.
//!
//! Each bake keeps within its own share, and the shares of all running bakes never exceed the budget. A share is the
//! memory for the largest mesh that the file can hold, or an equal part of the budget if that is more. Small assets
//! therefore run in parallel, and an asset that needs the whole budget runs alone.

use crate::process::lock;
use bvh_bake::input::MeshFormat;
use bvh_bake::least_memory;
use std::path::Path;
use std::sync::{Condvar, Mutex, PoisonError};

/// Bytes per triangle beyond the least that a bake needs, so that nothing has to go to scratch files between its stages.
const KEPT_BYTES_PER_TRIANGLE: u64 = 400;

/// A budget of memory, part of which is taken.
pub(super) struct Shares {
    budget: u64,
    jobs: u64,
    free: Mutex<u64>,
    returned: Condvar,
}

/// The bytes of one bake. They return to the budget when the share is dropped.
pub(super) struct Share<'a> {
    pub(super) bytes: u64,
    shares: &'a Shares,
}

impl Shares {
    pub(super) fn new(budget: u64, jobs: usize) -> Self {
        Self { budget, jobs: jobs.max(1) as u64, free: Mutex::new(budget), returned: Condvar::new() }
    }

    /// Returns the whole budget in bytes.
    pub(super) fn budget(&self) -> u64 {
        self.budget
    }

    /// Returns the bytes for baking a file. A file that cannot be inspected needs little, since its bake fails early.
    pub(super) fn of(&self, input: &Path) -> u64 {
        let length = std::fs::metadata(input).map_or(0, |metadata| metadata.len());
        let wanted = match most_triangles(input, length) {
            Some(triangles) => least_memory(triangles).saturating_add(triangles * KEPT_BYTES_PER_TRIANGLE),
            None => self.budget,
        };
        wanted.max(self.budget / self.jobs).min(self.budget)
    }

    /// Waits until this many bytes are free, or the whole budget if it is smaller, and takes them.
    pub(super) fn take(&self, bytes: u64) -> Share<'_> {
        let bytes = bytes.min(self.budget);
        let waited = self.returned.wait_while(lock(&self.free), |free| *free < bytes);
        let mut free = waited.unwrap_or_else(PoisonError::into_inner);
        *free -= bytes;
        Share { bytes, shares: self }
    }
}

impl Drop for Share<'_> {
    fn drop(&mut self) {
        *lock(&self.shares.free) += self.bytes;
        self.shares.returned.notify_all();
    }
}

/// Estimates the most triangles that a usual file of this length can hold. Returns `None` if the length does not tell.
fn most_triangles(input: &Path, length: u64) -> Option<u64> {
    let bytes_per_triangle = match MeshFormat::from_extension(input)? {
        MeshFormat::Stl => 50,
        MeshFormat::Ply | MeshFormat::Obj | MeshFormat::Xyz | MeshFormat::Pcd => 12,
        // Three numbers of one digit with blanks between them.
        MeshFormat::Collada => 6,
        // Three indices of two bytes. A .gltf file keeps its numbers in other files.
        MeshFormat::Gltf if input.extension().is_some_and(|name| name.eq_ignore_ascii_case("glb")) => 6,
        _ => return None,
    };
    Some(length / bytes_per_triangle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    #[test]
    fn small_ones_go_side_by_side_and_a_large_one_alone() {
        let folder = tempfile::tempdir().unwrap();
        let share = |name: &str, length: u64, shares: &Shares| {
            let path = folder.path().join(name);
            File::create(&path).unwrap().set_len(length).unwrap();
            shares.of(&path)
        };
        let shares = Shares::new(512 << 20, 4);
        assert_eq!(share("small.stl", 684, &shares), 128 << 20);
        assert_eq!(share("large.stl", 500 << 20, &shares), 512 << 20);
        assert!((128 << 20..512 << 20).contains(&share("medium.stl", 20 << 20, &shares)));
        assert_eq!(share("unknown.gltf", 684, &shares), 512 << 20);
        assert_eq!(shares.of(&folder.path().join("missing.obj")), 128 << 20);
        // The budget is too small for four at once: the share is more than a quarter.
        let shares = Shares::new(16 << 20, 4);
        assert!(share("small.stl", 684, &shares) >= least_memory(12));
    }

    #[test]
    fn shares_are_given_back() {
        let shares = Shares::new(100, 2);
        let (first, second) = (shares.take(60), shares.take(40));
        assert_eq!(*shares.free.lock().unwrap(), 0);
        std::thread::scope(|scope| {
            let all = scope.spawn(|| shares.take(1000).bytes);
            drop((first, second));
            assert_eq!(all.join().unwrap(), 100);
        });
        assert_eq!(*shares.free.lock().unwrap(), 100);
    }
}
