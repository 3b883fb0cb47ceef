//! A `.cbvh` file that is read piece by piece, for checks of files of any size.
//!
//! Not mapped: pages of a map count as memory of the process, and a file that somebody truncates meanwhile would end it.

use crate::means::{BYTES_AT_LEAST, CHECK_BYTES_A_THREAD};
use crate::scratch::read_exact_at;
use bvh_format::FormatError;
use bvh_format::source::Source;
use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bytes of memory for each byte of a piece that is read at once, as the object table is, and kept in another form.
const PIECE_BYTES: u64 = 3;

/// A file that has been opened; nothing of it has been read.
#[derive(Debug)]
pub struct StoredFile {
    file: File,
    path: PathBuf,
    length: u64,
    max_memory: Option<u64>,
}

/// Why a file could not be read, or what is wrong with it.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The system refused.
    #[error("{}: expected a readable file, found {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file cannot be checked in the memory allowed.
    #[error(
        "{}: expected a file that is checked in at most {budget} bytes of memory, found one that takes at least {needed}",
        path.display()
    )]
    Memory {
        /// The file.
        path: PathBuf,
        /// Bytes that the check needs.
        needed: u64,
        /// Bytes that it may use.
        budget: u64,
    },
    /// The file breaks a rule of the format.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl StoredFile {
    /// Opens a file, to be checked within `max_memory` bytes of memory for the whole process. A check needs 8 MiB,
    /// 1 MiB a thread of rayon's current pool, and three times the bytes of the object table.
    ///
    /// # Errors
    /// [`FileError::Io`], also if it is no regular file: others do not say how long they are. [`FileError::Memory`] if
    /// that is too little memory for any file; for the object table, that is found when it is read.
    pub fn open(path: &Path, max_memory: Option<u64>) -> Result<Self, FileError> {
        let open = || {
            let file = File::open(path)?;
            let metadata = file.metadata()?;
            if metadata.is_dir() {
                return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
            }
            if !metadata.is_file() {
                return Err(io::Error::other("no regular file"));
            }
            Ok((file, metadata.len()))
        };
        let (file, length) = open().map_err(|source| FileError::Io { path: path.to_owned(), source })?;
        let opened = Self { file, path: path.to_owned(), length, max_memory };
        opened.require_memory(0)?;
        Ok(opened)
    }

    /// Refuses what the memory does not allow: a piece of so many bytes, to be read at once and kept in another form, or
    /// a list of so many bytes that grows.
    ///
    /// # Errors
    /// [`FileError::Memory`].
    pub fn require_memory(&self, piece: usize) -> Result<(), FileError> {
        let Some(budget) = self.max_memory else { return Ok(()) };
        let threads = rayon::current_num_threads() as u64;
        let needed = BYTES_AT_LEAST + threads * CHECK_BYTES_A_THREAD;
        // What a thread has for itself is counted already.
        let piece = (piece as u64).saturating_sub(CHECK_BYTES_A_THREAD);
        let needed = needed.saturating_add(piece.saturating_mul(PIECE_BYTES));
        if needed <= budget {
            return Ok(());
        }
        Err(FileError::Memory { path: self.path.clone(), needed, budget })
    }
}

impl Source for StoredFile {
    type Error = FileError;

    fn length(&self) -> u64 {
        self.length
    }

    fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, FileError> {
        self.require_memory(range.len())?;
        let mut bytes = vec![0; range.len()];
        read_exact_at(&self.file, &mut bytes, range.start as u64)
            .map_err(|source| FileError::Io { path: self.path.clone(), source })?;
        Ok(Cow::Owned(bytes))
    }
}
