//! Stores the data of a bake between its stages: in memory if it fits, otherwise in scratch files.
//!
//! Data are stored as pieces of plain records. A piece stays in memory while all pieces there together fit in an
//! allowance; otherwise it is appended to a scratch file. Readers cannot tell the difference. Files are read and
//! written at stated offsets and are not mapped, because mapped pages count as memory of the process.
//!
//! A scratch file is unlinked as soon as it is open. The system frees its room when the last piece in it is dropped or
//! the process ends, in whatever way.

use super::scratch_file::ScratchFile;
use crate::error::BakeError;
use crate::progress::Progress;
use crate::threads;
use bytemuck::Pod;
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// The memory and the scratch files that a bake may use.
pub(crate) struct Scratch {
    /// The directory of scratch files.
    directory: PathBuf,
    /// The most bytes of pieces that may be in memory.
    allowance: u64,
    kept: AtomicU64,
    /// Counts the bytes that go through files, and tells when the bake has to stop.
    progress: Progress,
}

impl Scratch {
    /// Keeps everything in memory.
    pub(crate) fn in_memory(progress: &Progress) -> Arc<Self> {
        Self::in_directory(Path::new(""), u64::MAX, progress)
    }

    /// Keeps `allowance` bytes in memory and the rest in files of a directory.
    pub(crate) fn in_directory(directory: &Path, allowance: u64, progress: &Progress) -> Arc<Self> {
        let (directory, progress) = (directory.to_owned(), progress.clone());
        Arc::new(Self { directory, allowance, kept: AtomicU64::new(0), progress })
    }

    /// Makes a place for the pieces of one stage.
    pub(crate) fn spill(self: &Arc<Self>) -> Spill {
        let threads = threads::current_num_threads() + 1;
        Spill { scratch: self.clone(), files: (0..threads).map(|_| Mutex::new(None)).collect() }
    }

    /// Takes `bytes` bytes of the allowance for good, for data that are no pieces.
    pub(crate) fn hold(&self, bytes: u64) {
        self.kept.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Reserves `bytes` bytes of the allowance, if that many are free.
    fn lease(self: &Arc<Self>, bytes: u64) -> Option<Lease> {
        let within = |kept: u64| kept.checked_add(bytes).filter(|&kept| kept <= self.allowance);
        let granted = self.kept.fetch_update(Ordering::Relaxed, Ordering::Relaxed, within);
        granted.ok().map(|_| Lease { scratch: self.clone(), bytes })
    }
}

/// The part of the allowance that a piece takes.
pub(crate) struct Lease {
    scratch: Arc<Scratch>,
    bytes: u64,
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.scratch.kept.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// Stores pieces. Each thread has a file of its own, because systems let only one thread at a time write to a file. The
/// file is created with the first piece that needs it, and lives as long as its pieces.
pub(crate) struct Spill {
    scratch: Arc<Scratch>,
    /// The files of all threads. The first is for threads outside the pool.
    files: Vec<Mutex<Option<Arc<ScratchFile>>>>,
}

impl Spill {
    /// Returns an error if the bake has to stop.
    pub(crate) fn go_on(&self) -> Result<(), BakeError> {
        self.scratch.progress.go_on()
    }

    /// Stores a piece.
    pub(crate) fn put<T: Pod>(&self, data: Vec<T>) -> Result<Piece<T>, BakeError> {
        self.go_on()?;
        let bytes = size_of_val(&data[..]) as u64;
        if let Some(lease) = self.scratch.lease(bytes) {
            return Ok(Piece::Memory { data, lease });
        }
        let count = data.len();
        let file = self.file()?;
        let offset = file.append(bytemuck::cast_slice(&data))?;
        Ok(Piece::File { file, offset, count })
    }

    fn file(&self) -> Result<Arc<ScratchFile>, BakeError> {
        let number = threads::current_thread_index().map_or(0, |thread| thread + 1) % self.files.len();
        let mut file = self.files[number].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(file) = &*file {
            return Ok(file.clone());
        }
        let made = Arc::new(ScratchFile::create(&self.scratch.directory, &self.scratch.progress)?);
        *file = Some(made.clone());
        Ok(made)
    }
}

/// A stored piece of records.
pub(crate) enum Piece<T> {
    Memory { data: Vec<T>, lease: Lease },
    File { file: Arc<ScratchFile>, offset: u64, count: usize },
}

impl<T: Pod> Piece<T> {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Memory { data, .. } => data.len(),
            Self::File { count, .. } => *count,
        }
    }

    /// Returns all records, or `None` if they are in a file.
    pub(crate) fn in_memory(&self) -> Option<&[T]> {
        match self {
            Self::Memory { data, .. } => Some(data),
            Self::File { .. } => None,
        }
    }

    /// Returns a range of the records.
    pub(crate) fn range(&self, range: Range<usize>) -> Result<Cow<'_, [T]>, BakeError> {
        match self {
            Self::Memory { data, lease } => {
                lease.scratch.progress.go_on()?;
                Ok(Cow::Borrowed(&data[range]))
            }
            Self::File { file, offset, .. } => {
                let mut data = vec![T::zeroed(); range.len()];
                let at = offset + (range.start * size_of::<T>()) as u64;
                file.read(at, bytemuck::cast_slice_mut(&mut data))?;
                Ok(Cow::Owned(data))
            }
        }
    }

    /// Returns all records.
    pub(crate) fn all(&self) -> Result<Cow<'_, [T]>, BakeError> {
        self.range(0..self.len())
    }

    /// Returns all records and consumes the piece.
    pub(crate) fn take(self) -> Result<Vec<T>, BakeError> {
        match self {
            Self::Memory { data, lease } => {
                lease.scratch.progress.go_on()?;
                Ok(data)
            }
            file => Ok(file.all()?.into_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_go_to_files_when_memory_is_full_and_leave_nothing() {
        let directory = cbvh_testkit::folder();
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
        let files = || std::fs::read_dir(directory.path()).unwrap().count();
        // On Windows, some file systems keep the names of removed files until they are closed.
        assert!(files() == 0 || cfg!(windows));
        drop(pieces);
        assert!(in_memory(&spill.put(vec![0u32; 1000]).unwrap()), "room is given back");
        drop(spill);
        assert_eq!(files(), 0);
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
