//! The output manifest: lines beside it as assets are done, and under its name all of them in order, whole.
//!
//! A process that is killed leaves the lines in the file whose name ends in `.part`. The next one adds to it, and
//! removes it when the whole has its name. It is locked, so that two processes never share it.

use super::shown;
use crate::error::Failure;
use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// An output manifest that is being written.
pub(super) struct Journal {
    path: PathBuf,
    part: PathBuf,
    file: File,
    /// Lines by number of the asset.
    lines: Vec<(usize, String)>,
}

impl Journal {
    pub(super) fn open(path: &Path) -> Result<Self, Failure> {
        let mut part = OsString::from(path);
        part.push(".part");
        let part = PathBuf::from(part);
        let failed = |error: io::Error| Failure::System(format!("{}: cannot create: {error}", shown(&part)));
        if path.is_dir() {
            return Err(Failure::System(format!("{}: cannot replace: it is a folder", shown(path))));
        }
        let mut file = File::options().read(true).append(true).create(true).open(&part).map_err(failed)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let what = "expected a file of this process alone, found it in use by another";
            return Err(Failure::System(format!("{}: {what}", shown(&part))));
        }
        if ends_within_a_line(&mut file).map_err(failed)? {
            file.write_all(b"\n").map_err(failed)?;
        }
        Ok(Self { path: path.to_owned(), part, file, lines: Vec::new() })
    }

    /// Notes the line of an asset that has ended.
    pub(super) fn add(&mut self, number: usize, mut line: String) -> Result<(), Failure> {
        line.push('\n');
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|error| Failure::System(format!("{}: cannot write: {error}", shown(&self.part))))?;
        self.lines.push((number, line));
        Ok(())
    }

    /// Writes the whole.
    pub(super) fn close(mut self) -> Result<(), Failure> {
        self.lines.sort_by_key(|(number, _)| *number);
        let whole: String = self.lines.into_iter().map(|(_, line)| line).collect();
        bvh_bake::write_atomically(&self.path, whole.as_bytes())
            .map_err(|error| Failure::from_bake(&shown(&self.path), &error))?;
        // What is left of it is no harm.
        let _ = fs::remove_file(&self.part);
        Ok(())
    }
}

/// Whether the last line was cut off.
fn ends_within_a_line(file: &mut File) -> io::Result<bool> {
    if file.metadata()?.len() == 0 {
        return Ok(false);
    }
    let mut last = [0];
    file.seek(SeekFrom::End(-1))?;
    file.read_exact(&mut last)?;
    Ok(last != *b"\n")
}
