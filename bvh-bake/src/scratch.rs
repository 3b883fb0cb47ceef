//! Where the data of a bake is kept between its stages: in memory where it fits, in scratch files where not.
//!
//! Data comes in pieces of plain records. A piece goes to memory as long as all pieces there together stay within
//! an allowance, and else to the end of a scratch file; what reads it cannot tell the difference. Files are read
//! and written at stated places, not mapped: pages that are mapped count as memory of the process.
//!
//! A scratch file loses its name as soon as it is open. The system frees its room when the last piece in it is
//! dropped or the process ends, however it ends.

mod file;
mod stream;

pub(crate) use file::{read_exact_at, remove_stale, write_all_at};
pub(crate) use stream::Stream;

use crate::error::BakeError;
use crate::progress::Progress;
use bytemuck::Pod;
use file::ScratchFile;
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// The memory and the scratch files that a bake may use.
pub(crate) struct Scratch {
    /// Where files go; `None` where all fits in memory.
    directory: Option<PathBuf>,
    /// Bytes of pieces that may be in memory.
    allowance: u64,
    kept: AtomicU64,
    /// Counts what goes through files.
    progress: Progress,
}

impl Scratch {
    /// Keeps everything in memory.
    pub(crate) fn in_memory(progress: &Progress) -> Arc<Self> {
        Self::new(None, u64::MAX, progress)
    }

    /// Keeps `allowance` bytes in memory and the rest in files of a directory.
    pub(crate) fn in_directory(directory: &Path, allowance: u64, progress: &Progress) -> Arc<Self> {
        Self::new(Some(directory.to_owned()), allowance, progress)
    }

    fn new(directory: Option<PathBuf>, allowance: u64, progress: &Progress) -> Arc<Self> {
        Arc::new(Self { directory, allowance, kept: AtomicU64::new(0), progress: progress.clone() })
    }

    /// A place for the pieces of one stage.
    pub(crate) fn spill(self: &Arc<Self>) -> Spill {
        let threads = rayon::current_num_threads() + 1;
        Spill { scratch: self.clone(), files: (0..threads).map(|_| Mutex::new(None)).collect() }
    }

    /// Room in memory for so many bytes, if there is.
    fn lease(self: &Arc<Self>, bytes: u64) -> Option<Lease> {
        let within = |kept: u64| kept.checked_add(bytes).filter(|&kept| kept <= self.allowance);
        let granted = self.kept.fetch_update(Ordering::Relaxed, Ordering::Relaxed, within);
        granted.ok().map(|_| Lease { scratch: self.clone(), bytes })
    }
}

/// Room in memory that a piece takes.
pub(crate) struct Lease {
    scratch: Arc<Scratch>,
    bytes: u64,
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.scratch.kept.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// Takes pieces. Each thread has a file of its own, since systems let only one at a time write to a file: it is made
/// with the first piece that needs it, and lives as long as its pieces.
pub(crate) struct Spill {
    scratch: Arc<Scratch>,
    /// That of threads outside the pool first.
    files: Vec<Mutex<Option<Arc<ScratchFile>>>>,
}

impl Spill {
    /// Keeps a piece.
    pub(crate) fn put<T: Pod>(&self, data: Vec<T>) -> Result<Piece<T>, BakeError> {
        let bytes = size_of_val(&data[..]) as u64;
        if let Some(lease) = self.scratch.lease(bytes) {
            return Ok(Piece::Memory { data, _lease: lease });
        }
        let count = data.len();
        let file = self.file()?;
        let offset = file.append(bytemuck::cast_slice(&data))?;
        Ok(Piece::File { file, offset, count })
    }

    fn file(&self) -> Result<Arc<ScratchFile>, BakeError> {
        let number = rayon::current_thread_index().map_or(0, |thread| thread + 1) % self.files.len();
        let mut file = self.files[number].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(file) = &*file {
            return Ok(file.clone());
        }
        let directory = self.scratch.directory.clone().unwrap_or_else(std::env::temp_dir);
        let made = Arc::new(ScratchFile::create(&directory, &self.scratch.progress)?);
        *file = Some(made.clone());
        Ok(made)
    }
}

/// Records that have been put away.
pub(crate) enum Piece<T> {
    Memory { data: Vec<T>, _lease: Lease },
    File { file: Arc<ScratchFile>, offset: u64, count: usize },
}

impl<T: Pod> Piece<T> {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Memory { data, .. } => data.len(),
            Self::File { count, .. } => *count,
        }
    }

    /// Some of the records.
    pub(crate) fn range(&self, range: Range<usize>) -> Result<Cow<'_, [T]>, BakeError> {
        match self {
            Self::Memory { data, .. } => Ok(Cow::Borrowed(&data[range])),
            Self::File { file, offset, .. } => {
                let mut data = vec![T::zeroed(); range.len()];
                let at = offset + (range.start * size_of::<T>()) as u64;
                file.read(at, bytemuck::cast_slice_mut(&mut data))?;
                Ok(Cow::Owned(data))
            }
        }
    }

    /// All records.
    pub(crate) fn all(&self) -> Result<Cow<'_, [T]>, BakeError> {
        self.range(0..self.len())
    }

    /// All records; the piece is gone.
    pub(crate) fn take(self) -> Result<Vec<T>, BakeError> {
        match self {
            Self::Memory { data, .. } => Ok(data),
            file => Ok(file.all()?.into_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_go_to_files_when_memory_is_full_and_leave_nothing() {
        let directory = tempfile::tempdir().unwrap();
        let progress = Progress::default();
        let scratch = Scratch::in_directory(directory.path(), 4000, &progress);
        let spill = scratch.spill();
        let pieces: Vec<Piece<u32>> =
            (0..4).map(|i| spill.put((0..500).map(|j| i * 1000 + j).collect()).unwrap()).collect();
        let in_memory = |piece: &Piece<u32>| matches!(piece, Piece::Memory { .. });
        assert_eq!(pieces.iter().filter(|piece| in_memory(piece)).count(), 2);
        assert_eq!(progress.traffic().scratch_written, 4000);
        for (i, piece) in (0..).zip(&pieces) {
            assert!(piece.all().unwrap().iter().copied().eq(i * 1000..i * 1000 + 500));
            assert_eq!(*piece.range(7..9).unwrap(), [i * 1000 + 7, i * 1000 + 8]);
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
        drop(pieces);
        assert!(in_memory(&spill.put(vec![0u32; 1000]).unwrap()), "room is given back");
        drop(spill);
        let traffic = progress.traffic();
        assert_eq!((traffic.scratch_most, traffic.scratch_read), (4000, 2 * (2000 + 8)));
        assert_eq!(progress.scratch_held(), 0);
    }

    #[test]
    fn a_directory_that_is_not_there_is_an_error() {
        let scratch = Scratch::in_directory(Path::new("/no/such/place"), 0, &Progress::default());
        let refused = scratch.spill().put(vec![1u8]).err().unwrap();
        assert!(refused.to_string().starts_with("/no/such/place: cannot create scratch"), "{refused}");
    }
}
