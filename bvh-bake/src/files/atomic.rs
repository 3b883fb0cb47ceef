//! Writes a file whole or not at all: under another name beside its own, synchronised, then renamed.
//!
//! Such a file is locked as long as a process writes it. One that is not locked was left by a process that was killed;
//! whoever writes the same output next removes it.

use crate::error::BakeError;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Writes a file such that under its name there is, at any time, either what was there before or all
/// of `bytes`. What is mapped or open under the old name keeps its contents.
///
/// # Errors
/// [`BakeError::Write`] if the system refuses, or if something other than a regular file has the name.
/// Nothing is left behind then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), BakeError> {
    refuse_special(path)?;
    let mut temporary = Temporary::beside(path)?;
    temporary.file.write_all(bytes).map_err(failed(path, "write"))?;
    temporary.rename(path)
}

/// Removes the files that are being written in this process under other names than their own, and lets no
/// more be made or renamed: whoever tries waits for ever. For a thread that is told to end the process, such as by a
/// signal, and does so next.
pub fn discard_unfinished() {
    let live = live();
    live.iter().for_each(|path| drop(fs::remove_file(path)));
    std::mem::forget(live);
}

/// A rename over a device or a directory would replace it, or fail late.
pub(super) fn refuse_special(path: &Path) -> Result<(), BakeError> {
    match fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => {
            let found = if metadata.is_dir() { "a directory" } else { "a special file" };
            let source = io::Error::other(format!("expected a regular file or none, found {found}"));
            Err(BakeError::Write { path: path.to_owned(), action: "replace", source })
        }
        _ => Ok(()),
    }
}

/// Removes what processes that were killed have left in a directory of files that were to become `name`.
pub(crate) fn remove_stale_of(directory: &Path, name: &OsStr) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.flatten().filter(|entry| is_temporary(&entry.file_name(), name)) {
        let path = entry.path();
        // Nobody else's file is opened but for this, and a file that cannot be opened is left alone.
        if let Ok(file) = File::options().read(true).write(true).open(&path)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Whether a file is named as those that become `name`.
fn is_temporary(file: &OsStr, name: &OsStr) -> bool {
    let (file, name) = (file.as_encoded_bytes(), name.as_encoded_bytes());
    let rest = file.strip_prefix(b".").and_then(|rest| rest.strip_prefix(name));
    let number = rest.and_then(|rest| rest.strip_prefix(b".")?.strip_suffix(b".tmp"));
    number.is_some_and(|number| number.iter().all(|byte| byte.is_ascii_digit() || *byte == b'-'))
}

/// The files that have such names now.
fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn failed(path: &Path, action: &'static str) -> impl Fn(io::Error) -> BakeError {
    move |source| BakeError::Write { path: path.to_owned(), action, source }
}

/// A new file in the directory of another, locked, and removed when dropped.
pub(crate) struct Temporary {
    path: PathBuf,
    file: File,
    /// Whether the file has its name still.
    named: bool,
}

impl Temporary {
    /// Creates an empty file beside `output`, hidden and named after it.
    pub(crate) fn beside(output: &Path) -> Result<Self, BakeError> {
        let nameless = || io::Error::new(io::ErrorKind::InvalidInput, "the path names no file");
        let name = output.file_name().ok_or_else(nameless).map_err(failed(output, "create"))?;
        Self::named(directory_of(output), name).map_err(failed(output, "create"))
    }

    /// Creates an empty file in a directory, hidden and named after `name`.
    pub(crate) fn named(directory: &Path, name: &OsStr) -> io::Result<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        remove_stale_of(directory, name);
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{number}.tmp", std::process::id()));
            let path = directory.join(hidden);
            let mut live = live();
            match File::options().read(true).write(true).create_new(true).open(&path) {
                Ok(file) => {
                    live.push(path.clone());
                    drop(live);
                    let temporary = Self { path, file, named: true };
                    // Before it was locked another process may have taken it for a stale one. Where files cannot be
                    // locked none is ever taken for one.
                    match temporary.file.try_lock() {
                        Err(fs::TryLockError::WouldBlock) => continue,
                        _ if !temporary.path.exists() => continue,
                        _ => return Ok(temporary),
                    }
                }
                // Of a process of the same number, in another container.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
            }
        }
    }

    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// Takes the name off the file, which stays open. Where the system does not allow it, that is left to `drop`.
    pub(crate) fn forget_name(&mut self) {
        let mut live = live();
        if fs::remove_file(&self.path).is_ok() {
            live.retain(|path| *path != self.path);
            self.named = false;
        }
    }

    /// Gives the file, synchronised, the name `path`, whatever had it before.
    pub(crate) fn rename(mut self, path: &Path) -> Result<(), BakeError> {
        // Without it a crash soon after the rename could leave the name on an empty file.
        self.file.sync_all().map_err(failed(path, "write"))?;
        let mut live = live();
        fs::rename(&self.path, path).map_err(failed(path, "create"))?;
        live.retain(|path| *path != self.path);
        self.named = false;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if self.named {
            let mut live = live();
            // The error that led here is the one to tell.
            let _ = fs::remove_file(&self.path);
            live.retain(|path| *path != self.path);
        }
    }
}

/// The directory that a file is in.
pub(super) fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_is_removed_and_what_is_in_use_is_not() {
        let directory = tempfile::tempdir().unwrap();
        let output = directory.path().join("out.cbvh");
        let write = |name: &str| fs::write(directory.path().join(name), "x").unwrap();
        let stale = ".out.cbvh.123-4.tmp";
        let others = [".out.cbvh.backup.tmp", ".other.cbvh.123-4.tmp", "out.cbvh.123-4.tmp"];
        write(stale);
        others.iter().for_each(|name| write(name));
        let used = Temporary::beside(&output).unwrap();
        let second = Temporary::beside(&output).unwrap();
        assert!(!directory.path().join(stale).exists() && used.path.exists() && second.path.exists());
        assert!(others.iter().all(|name| directory.path().join(name).exists()));
        drop((used, second));
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), others.len());
        write_atomically(&output, b"whole").unwrap();
        assert_eq!(fs::read(&output).unwrap(), b"whole");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), others.len() + 1);
    }

    #[cfg(unix)]
    #[test]
    fn what_cannot_be_synchronised_gets_no_name() {
        let directory = tempfile::tempdir().unwrap();
        let output = directory.path().join("out.cbvh");
        fs::write(&output, "old").unwrap();
        let mut unfinished = Temporary::beside(&output).unwrap();
        // A pipe has nothing that could be synchronised, and the system says so.
        let (_reader, writer) = io::pipe().unwrap();
        unfinished.file = std::os::fd::OwnedFd::from(writer).into();
        let refused = unfinished.rename(&output).unwrap_err();
        assert!(matches!(refused, BakeError::Write { action: "write", .. }), "{refused}");
        assert_eq!(fs::read(&output).unwrap(), b"old");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
