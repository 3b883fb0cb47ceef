//! A file without a name, which is appended to and read at any offset.

use crate::error::BakeError;
use crate::progress::Progress;
use crate::storage::atomic::{SCRATCH_NAME, Temporary, remove_stale};
use std::fs::File;
use std::io;
#[cfg(target_family = "wasm")]
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A scratch file.
pub(crate) struct ScratchFile {
    temporary: Temporary,
    directory: PathBuf,
    end: AtomicU64,
    progress: Progress,
}

impl ScratchFile {
    pub(crate) fn create(directory: &Path, progress: &Progress) -> Result<Self, BakeError> {
        remove_stale(directory, &[SCRATCH_NAME.as_ref()]);
        let named = Temporary::named(directory, SCRATCH_NAME.as_ref());
        let mut temporary =
            named.map_err(|source| failed(directory, "create scratch files in it", source))?;
        temporary.forget_name();
        let directory = directory.to_owned();
        Ok(Self { temporary, directory, end: AtomicU64::new(0), progress: progress.clone() })
    }

    /// Appends bytes and returns their offset.
    pub(crate) fn append(&self, bytes: &[u8]) -> Result<u64, BakeError> {
        let length = bytes.len() as u64;
        let offset = self.end.fetch_add(length, Ordering::Relaxed);
        self.progress.add_scratch_written(length);
        write_all_at(self.temporary.file(), bytes, offset)
            .map_err(|error| failed(&self.directory, "write scratch data in it", error))?;
        Ok(offset)
    }

    /// Reads bytes that were written.
    pub(crate) fn read(&self, offset: u64, bytes: &mut [u8]) -> Result<(), BakeError> {
        self.progress.go_on()?;
        self.progress.add_scratch_read(bytes.len() as u64);
        read_exact_at(self.temporary.file(), bytes, offset)
            .map_err(|error| failed(&self.directory, "read scratch data in it", error))
    }
}

fn failed(directory: &Path, action: &'static str, source: io::Error) -> BakeError {
    BakeError::Scratch { directory: directory.to_owned(), action, source }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        self.progress.drop_scratch(self.end.load(Ordering::Relaxed));
    }
}

/// Writes at an offset, independent of the file's cursor.
#[cfg(unix)]
pub(crate) fn write_all_at(file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

/// Reads at an offset, independent of the file's cursor.
#[cfg(unix)]
pub(crate) fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

/// Writes at an offset of a file.
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

/// Reads at an offset of a file.
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

/// Writes at an offset of a file. No other thread moves the cursor meanwhile, because there is none.
#[cfg(target_family = "wasm")]
pub(crate) fn write_all_at(mut file: &File, bytes: &[u8], offset: u64) -> io::Result<()> {
    file.seek(SeekFrom::Start(offset))?;
    file.write_all(bytes)
}

/// Reads at an offset of a file. No other thread moves the cursor meanwhile, because there is none.
#[cfg(target_family = "wasm")]
pub(crate) fn read_exact_at(mut file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytes)
}
