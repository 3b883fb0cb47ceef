//! The output manifest: lines are appended to a file beside it as assets end, and at the end it is written whole, in order.
//!
//! The file beside it has the same name and `.part`. A process that is killed leaves it behind; the next one appends to it,
//! and removes it when the output manifest is written. It is locked, so that two processes never share it.

use super::shown;
use crate::console::Failure;
use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The output manifest of a run.
pub(super) struct Journal {
    path: PathBuf,
    part: PathBuf,
    file: File,
    /// The lines and the numbers of their assets.
    lines: Vec<(usize, String)>,
}

impl Journal {
    pub(super) fn open(path: &Path) -> Result<Self, Failure> {
        let mut part = OsString::from(path);
        part.push(".part");
        let part = PathBuf::from(part);
        let failed = |error: io::Error| Failure::System(format!("{}: cannot create: {error}", shown(&part)));
        if path.is_dir() {
            return Err(Failure::System(format!(
                "{}: cannot replace: expected a file or nothing, found a folder",
                shown(path)
            )));
        }
        let mut file = File::options().read(true).append(true).create(true).open(&part).map_err(failed)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let what = "expected a file that no other process uses, found it in use; wait for the other bake or name another output manifest";
            return Err(Failure::System(format!("{}: {what}", shown(&part))));
        }
        if ends_within_a_line(&mut file).map_err(failed)? {
            file.write_all(b"\n").map_err(failed)?;
        }
        Ok(Self { path: path.to_owned(), part, file, lines: Vec::new() })
    }

    /// Appends the line of an asset that has ended.
    pub(super) fn add(&mut self, number: usize, mut line: String) -> Result<(), Failure> {
        line.push('\n');
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|error| Failure::System(format!("{}: cannot write: {error}", shown(&self.part))))?;
        self.lines.push((number, line));
        Ok(())
    }

    /// Writes all lines in order under the name of the output manifest.
    pub(super) fn close(mut self) -> Result<(), Failure> {
        self.lines.sort_by_key(|(number, _)| *number);
        let whole: String = self.lines.into_iter().map(|(_, line)| line).collect();
        bvh_bake::write_atomically(&self.path, whole.as_bytes())
            .map_err(|error| Failure::from_bake(&shown(&self.path), &error))?;
        // A part file that stays does no harm.
        let _ = fs::remove_file(&self.part);
        Ok(())
    }
}

/// Returns whether the last line was cut off.
fn ends_within_a_line(file: &mut File) -> io::Result<bool> {
    if file.metadata()?.len() == 0 {
        return Ok(false);
    }
    let mut last = [0];
    file.seek(SeekFrom::End(-1))?;
    file.read_exact(&mut last)?;
    Ok(last != *b"\n")
}
