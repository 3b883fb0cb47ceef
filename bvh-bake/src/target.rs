//! Where the bytes of a file go, and from where the proof reads them again: memory, or a file without its name yet.

use crate::error::BakeError;
use crate::files::Temporary;
use crate::progress::Progress;
use crate::scratch::{read_exact_at, write_all_at};
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Bytes that are written from the first to the last.
pub(crate) enum Target {
    Memory(Vec<u8>),
    File { file: Temporary, output: PathBuf, length: u64, progress: Progress },
}

impl Target {
    /// A new file beside `output`. What is written and read of it is counted.
    pub(crate) fn beside(output: &Path, progress: &Progress) -> Result<Self, BakeError> {
        let (file, output) = (Temporary::beside(output)?, output.to_owned());
        Ok(Self::File { file, output, length: 0, progress: progress.clone() })
    }

    /// Bytes written.
    pub(crate) fn length(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File { length, .. } => *length,
        }
    }

    /// Expects so many bytes in all.
    pub(crate) fn expect(&mut self, length: u64) {
        if let Self::Memory(bytes) = self {
            bytes.reserve_exact((length as usize).saturating_sub(bytes.len()));
        }
    }

    /// Adds bytes at the end.
    pub(crate) fn append(&mut self, bytes: &[u8]) -> Result<(), BakeError> {
        match self {
            Self::Memory(all) => all.extend_from_slice(bytes),
            Self::File { file, output, length, progress } => {
                progress.add_output_written(bytes.len() as u64);
                write_all_at(file.file(), bytes, *length).map_err(|error| failed(output, "write", error))?;
                *length += bytes.len() as u64;
            }
        }
        Ok(())
    }

    /// Puts others in the place of the first bytes.
    pub(crate) fn replace_first(&mut self, bytes: &[u8]) -> Result<(), BakeError> {
        match self {
            Self::Memory(all) => all[..bytes.len()].copy_from_slice(bytes),
            Self::File { file, output, progress, .. } => {
                progress.add_output_written(bytes.len() as u64);
                write_all_at(file.file(), bytes, 0).map_err(|error| failed(output, "write", error))?;
            }
        }
        Ok(())
    }

    /// Gives the file its name.
    pub(crate) fn rename(self) -> Result<(), BakeError> {
        match self {
            Self::Memory(_) => Ok(()),
            Self::File { file, output, .. } => file.rename(&output),
        }
    }

    /// For reading what has been written.
    pub(crate) fn source(&self) -> Source<'_> {
        match self {
            Self::Memory(bytes) => Source::Memory(bytes),
            Self::File { file, output, length, progress } => {
                Source::File { file: file.file(), path: output, length: *length, progress }
            }
        }
    }
}

fn failed(path: &Path, action: &'static str, source: std::io::Error) -> BakeError {
    BakeError::Write { path: path.to_owned(), action, source }
}

/// The bytes of a file, read piece by piece.
#[derive(Clone, Copy)]
pub(crate) enum Source<'a> {
    Memory(&'a [u8]),
    File { file: &'a std::fs::File, path: &'a Path, length: u64, progress: &'a Progress },
}

impl bvh_format::source::Source for Source<'_> {
    type Error = BakeError;

    fn length(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File { length, .. } => *length,
        }
    }

    fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, BakeError> {
        match self {
            Self::Memory(bytes) => Ok(Cow::Borrowed(&bytes[range])),
            Self::File { file, path, progress, .. } => {
                progress.add_output_read(range.len() as u64);
                let mut bytes = vec![0; range.len()];
                read_exact_at(file, &mut bytes, range.start as u64)
                    .map_err(|error| failed(path, "read back what was written to", error))?;
                Ok(Cow::Owned(bytes))
            }
        }
    }
}
