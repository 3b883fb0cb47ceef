//! The output manifest. As assets end, their lines are appended to a file beside it. At the end, the manifest is
//! written as a whole, in order.
//!
//! The file beside it has the same name and `.part`. A process that is killed leaves it behind. The next process
//! appends to it, and removes it when the output manifest is written. It is locked, so that two processes never share
//! it.

use crate::bake::Report;
use crate::console::{Failure, counted};
use crate::options::Shard;
use crate::process;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File};
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
        let part = part(path);
        let failed = |error: io::Error| Failure::system(&part, format_args!("cannot create: {error}"));
        if path.is_dir() {
            let what = "cannot replace: expected a file or nothing, found a folder";
            return Err(Failure::system(path, what));
        }
        let Some(mut file) = open_alone(&part).map_err(failed)? else {
            let what = "expected a file that no other process uses, found it in use; wait for the other bake or name another output manifest";
            return Err(Failure::system(&part, what));
        };
        if ends_within_a_line(&mut file).map_err(failed)? {
            file.write_all(b"\n").map_err(failed)?;
        }
        Ok(Self { path: path.to_owned(), part, file, lines: Vec::new() })
    }

    /// Appends the line of an asset that has ended, with its line feed.
    pub(super) fn add(&mut self, number: usize, line: String) -> Result<(), Failure> {
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|error| Failure::system(&self.part, format_args!("cannot write: {error}")))?;
        self.lines.push((number, line));
        Ok(())
    }

    /// Writes all lines in order under the name of the output manifest.
    pub(super) fn close(mut self) -> Result<(), Failure> {
        self.lines.sort_by_key(|(number, _)| *number);
        let whole: String = self.lines.into_iter().map(|(_, line)| line).collect();
        bvh_bake::write_atomically(&self.path, whole.as_bytes())
            .map_err(|error| Failure::from_bake(self.path.display(), &error))?;
        // A part file that stays does no harm.
        let _ = fs::remove_file(&self.part);
        Ok(())
    }
}

/// Returns the file beside an output manifest.
pub(super) fn part(path: &Path) -> PathBuf {
    let mut part = OsString::from(path);
    part.push(".part");
    part.into()
}

/// Opens a file to append to it, and locks it. Returns `None` if another process has locked it. Others may read it.
#[cfg(not(windows))]
fn open_alone(path: &Path) -> io::Result<Option<File>> {
    let file = File::options().read(true).append(true).create(true).open(path)?;
    Ok(if let Err(fs::TryLockError::WouldBlock) = file.try_lock() { None } else { Some(file) })
}

/// Opens a file to append to it, and lets no other process write to it. Returns `None` if another process has it open for
/// writing. Others may read it, which a lock would prevent on Windows.
#[cfg(windows)]
fn open_alone(path: &Path) -> io::Result<Option<File>> {
    use std::os::windows::fs::OpenOptionsExt;
    const SHARE_READ_AND_DELETE: u32 = 1 | 4;
    const SHARING_VIOLATION: i32 = 32;
    let mut options = File::options();
    match options.read(true).append(true).create(true).share_mode(SHARE_READ_AND_DELETE).open(path) {
        Err(error) if error.raw_os_error() == Some(SHARING_VIOLATION) => Ok(None),
        opened => opened.map(Some),
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

/// The object that `--json` prints for many assets. All but `shard`, `elapsed_seconds` and `peak_rss_bytes` are sums.
#[derive(Default, Serialize)]
pub(super) struct Summary {
    shard: Option<String>,
    assets: u64,
    done: u64,
    skipped: u64,
    failed: u64,
    /// The number of failures by exit code.
    exit_codes: BTreeMap<u8, u64>,
    triangles_in: u64,
    triangles: u64,
    degenerate: u64,
    duplicates: u64,
    file_bytes: u64,
    /// The sum of the seconds of all assets.
    seconds: f64,
    elapsed_seconds: f64,
    peak_rss_bytes: Option<u64>,
}

/// Exit codes of failures, the one that takes precedence first.
const CODES_BY_PRECEDENCE: [u8; 4] = [3, 4, 2, 1];

impl Summary {
    pub(super) fn new(shard: Option<Shard>, assets: usize) -> Self {
        Self { shard: shard.map(|shard| shard.to_string()), assets: assets as u64, ..Self::default() }
    }

    pub(super) fn add(&mut self, report: &Report) {
        let file = report.file();
        *if report.baked().is_none() { &mut self.skipped } else { &mut self.done } += 1;
        self.triangles_in += file.triangles_in;
        self.triangles += file.triangles;
        self.degenerate += file.degenerate;
        self.duplicates += file.duplicates;
        self.file_bytes += file.file_bytes;
        self.seconds += report.seconds;
    }

    pub(super) fn add_failed(&mut self, code: u8) {
        self.failed += 1;
        *self.exit_codes.entry(code).or_default() += 1;
    }

    /// Completes the summary after the last asset.
    pub(super) fn close(&mut self, elapsed_seconds: f64) {
        self.elapsed_seconds = elapsed_seconds;
        self.peak_rss_bytes = process::peak_bytes();
    }

    /// Returns the counts so far for the progress line.
    pub(super) fn progress(&self) -> String {
        let ended = self.done + self.skipped + self.failed;
        format!("{ended} of {}, {} failed", counted(self.assets, "asset"), self.failed)
    }

    /// Returns the summary for people.
    pub(super) fn to_text(&self) -> String {
        let memory = process::memory_in_words();
        format!(
            "{}: {} baked, {} up to date, {} failed\n  triangles    {}\n  bytes        {}\n  \
             took         {:.2} s{memory}\n",
            counted(self.assets, "asset"),
            self.done,
            self.skipped,
            self.failed,
            self.triangles,
            self.file_bytes,
            self.elapsed_seconds
        )
    }

    /// Returns the failure to end with, if any asset has failed. `results` is the file that has the details.
    pub(super) fn failure(&self, results: Option<&Path>) -> Option<Failure> {
        let code = CODES_BY_PRECEDENCE.into_iter().find(|code| self.exit_codes.contains_key(code))?;
        let told = results.map(|path| format!(", see {}", path.display())).unwrap_or_default();
        let text = format!("{} of {} failed{told}", self.failed, counted(self.assets, "asset"));
        Some(match code {
            1 => Failure::Usage(text),
            3 => Failure::Invalid(text),
            4 => Failure::Limit(text),
            _ => Failure::System(text),
        })
    }
}
