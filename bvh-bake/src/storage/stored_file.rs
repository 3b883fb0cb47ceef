//! Reads a `.cbvh` file piece by piece, so that files of any size can be checked.
//!
//! The file is not mapped: mapped pages count as memory of the process, and if somebody truncated the file meanwhile,
//! the process would be killed.

use crate::storage::read_exact_at;
use crate::storage::resources::{CHECK_BYTES_PER_THREAD, MIN_BYTES};
use crate::threads;
use bvh_format::FormatError;
use bvh_format::source::Source;
use std::borrow::Cow;
use std::fs::{File, Metadata};
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bytes of memory for each byte of a piece, such as the object table, that is read at once and kept in another form.
const PIECE_BYTES: u64 = 3;

/// An opened file, of which nothing has been read yet.
///
/// ```
/// use bvh_bake::{FileError, Layout, StoredFile, validate_in_parallel};
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-scene.cbvh");
/// let file = StoredFile::open(path.as_ref(), Some(64 << 20))?;
/// let layout: Layout = validate_in_parallel(&file)?;
/// assert_eq!(layout.objects.len(), 1);
///
/// let missing = StoredFile::open("nowhere.cbvh".as_ref(), None);
/// assert!(matches!(missing, Err(FileError::Io { .. })));
/// # Ok::<(), FileError>(())
/// ```
#[derive(Debug)]
pub struct StoredFile {
    file: File,
    path: PathBuf,
    length: u64,
    max_memory: Option<u64>,
}

/// The reason why a file could not be read, or what is wrong with it.
///
/// [`StoredFile`] has an example.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The operating system refused to open or read the file.
    #[error("{}: expected a readable file, found {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file cannot be checked in the memory allowed.
    #[error(
        "{}: expected a file that is checked in at most {budget} bytes of memory, found one that takes at least {needed}; \
         raise the memory budget", path.display()
    )]
    Memory {
        /// The file.
        path: PathBuf,
        /// The bytes that the check needs.
        needed: u64,
        /// The bytes that it may use.
        budget: u64,
    },
    /// The file breaks a rule of the format.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl StoredFile {
    /// Opens a file, to be checked within `max_memory` bytes of memory for the whole process. A check needs 8 MiB,
    /// 1 MiB per thread of rayon's current pool, and three times the bytes of the object table.
    ///
    /// # Errors
    /// [`FileError::Io`] if the file cannot be opened, or is not a regular file and so does not say how long it is.
    /// [`FileError::Memory`] if `max_memory` is too little for any file. Whether it is too little for the object
    /// table shows only when that is read.
    pub fn open(path: &Path, max_memory: Option<u64>) -> Result<Self, FileError> {
        let open = || {
            let require_regular = |metadata: &Metadata| {
                if metadata.is_dir() {
                    return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
                }
                if metadata.is_file() { Ok(()) } else { Err(io::Error::other("not a regular file")) }
            };
            // Opening a named pipe would wait for its other end. Another file may take the name meanwhile.
            require_regular(&std::fs::metadata(path)?)?;
            let file = File::open(path)?;
            let metadata = file.metadata()?;
            require_regular(&metadata)?;
            Ok((file, metadata.len()))
        };
        let (file, length) = open().map_err(|source| FileError::Io { path: path.to_owned(), source })?;
        let opened = Self { file, path: path.to_owned(), length, max_memory };
        opened.require_memory(0)?;
        Ok(opened)
    }

    /// Refuses a piece of `piece` bytes if there is too little memory to read it at once and keep it in another form.
    /// For a growing list, it refuses if there is too little memory for `piece` bytes of the list.
    ///
    /// # Errors
    /// [`FileError::Memory`] if the limit is exceeded.
    pub fn require_memory(&self, piece: usize) -> Result<(), FileError> {
        let Some(budget) = self.max_memory else { return Ok(()) };
        let threads = threads::current_num_threads() as u64;
        let needed = MIN_BYTES + threads * CHECK_BYTES_PER_THREAD;
        // The memory of each thread is counted already.
        let piece = (piece as u64).saturating_sub(CHECK_BYTES_PER_THREAD);
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
