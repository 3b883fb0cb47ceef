//! A file without a name that grows at its end and is read anywhere.

use super::Counters;
use crate::error::BakeError;
use crate::files::Temporary;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The name that scratch files have while they are opened.
const NAME: &str = "cbvh-scratch";

/// A scratch file.
pub(crate) struct ScratchFile {
    temporary: Temporary,
    directory: PathBuf,
    end: AtomicU64,
    counters: Arc<Counters>,
}

impl ScratchFile {
    pub(super) fn create(directory: &Path, counters: &Arc<Counters>) -> Result<Self, BakeError> {
        let failed = |source| BakeError::Write {
            path: directory.to_owned(),
            action: "create scratch files in it",
            source,
        };
        let mut temporary = Temporary::named(directory, NAME.as_ref()).map_err(failed)?;
        temporary.forget_name();
        let directory = directory.to_owned();
        Ok(Self { temporary, directory, end: AtomicU64::new(0), counters: counters.clone() })
    }

    /// Writes bytes behind all others; returns where.
    pub(super) fn append(&self, bytes: &[u8]) -> Result<u64, BakeError> {
        let length = bytes.len() as u64;
        let offset = self.end.fetch_add(length, Ordering::Relaxed);
        let held = self.counters.held.fetch_add(length, Ordering::Relaxed) + length;
        self.counters.most.fetch_max(held, Ordering::Relaxed);
        self.counters.written.fetch_add(length, Ordering::Relaxed);
        write_all_at(self.temporary.file(), bytes, offset).map_err(|error| self.failed("write", error))?;
        Ok(offset)
    }

    /// Reads bytes that were written.
    pub(super) fn read(&self, offset: u64, bytes: &mut [u8]) -> Result<(), BakeError> {
        self.counters.read.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        read_exact_at(self.temporary.file(), bytes, offset).map_err(|error| self.failed("read", error))
    }

    fn failed(&self, action: &str, source: io::Error) -> BakeError {
        let action = if action == "write" { "write scratch data in it" } else { "read scratch data in it" };
        BakeError::Write { path: self.directory.clone(), action, source }
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        self.counters.held.fetch_sub(self.end.load(Ordering::Relaxed), Ordering::Relaxed);
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
