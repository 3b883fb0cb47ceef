//! A file without a name that grows at its end and is read anywhere.

use crate::error::BakeError;
use crate::files::{Temporary, remove_stale_of};
use crate::progress::Progress;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// The name that scratch files have while they are opened.
const NAME: &str = "cbvh-scratch";

/// A scratch file.
pub(crate) struct ScratchFile {
    temporary: Temporary,
    directory: PathBuf,
    end: AtomicU64,
    progress: Progress,
}

/// Removes what processes that were killed just as they opened a scratch file have left in a directory.
pub(crate) fn remove_stale(directory: &Path) {
    remove_stale_of(directory, NAME.as_ref());
}

impl ScratchFile {
    pub(super) fn create(directory: &Path, progress: &Progress) -> Result<Self, BakeError> {
        let failed = |source| BakeError::Write {
            path: directory.to_owned(),
            action: "create scratch files in it",
            source,
        };
        let mut temporary = Temporary::named(directory, NAME.as_ref()).map_err(failed)?;
        temporary.forget_name();
        let directory = directory.to_owned();
        Ok(Self { temporary, directory, end: AtomicU64::new(0), progress: progress.clone() })
    }

    /// Writes bytes behind all others; returns where.
    pub(super) fn append(&self, bytes: &[u8]) -> Result<u64, BakeError> {
        let length = bytes.len() as u64;
        let offset = self.end.fetch_add(length, Ordering::Relaxed);
        self.progress.add_scratch_written(length);
        write_all_at(self.temporary.file(), bytes, offset).map_err(|error| self.failed("write", error))?;
        Ok(offset)
    }

    /// Reads bytes that were written.
    pub(super) fn read(&self, offset: u64, bytes: &mut [u8]) -> Result<(), BakeError> {
        self.progress.add_scratch_read(bytes.len() as u64);
        read_exact_at(self.temporary.file(), bytes, offset).map_err(|error| self.failed("read", error))
    }

    fn failed(&self, action: &str, source: io::Error) -> BakeError {
        let action = if action == "write" { "write scratch data in it" } else { "read scratch data in it" };
        BakeError::Write { path: self.directory.clone(), action, source }
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        self.progress.drop_scratch(self.end.load(Ordering::Relaxed));
    }
}

/// Writes at a place of a file, whatever its cursor.
#[cfg(unix)]
pub(crate) fn write_all_at(file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

/// Reads at a place of a file, whatever its cursor.
#[cfg(unix)]
pub(crate) fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

/// Writes at a place of a file.
#[cfg(windows)]
pub(crate) fn write_all_at(file: &File, mut bytes: &[u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_write(file, bytes, offset)? {
            0 => return Err(io::ErrorKind::WriteZero.into()),
            count => (bytes, offset) = (&bytes[count..], offset + count as u64),
        }
    }
    Ok(())
}

/// Reads at a place of a file.
#[cfg(windows)]
pub(crate) fn read_exact_at(file: &File, mut bytes: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, bytes, offset)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => (bytes, offset) = (&mut bytes[count..], offset + count as u64),
        }
    }
    Ok(())
}
