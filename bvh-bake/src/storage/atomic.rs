//! Writes a file completely or not at all: under a temporary name beside its own, synchronised, then renamed. Last, the
//! directory is synchronised.
//!
//! A temporary file stays locked while a process writes it. One that is not locked was left by a process that was
//! killed, and the next process that writes the same output removes it.

use crate::error::BakeError;
use crate::storage::device_names::names_device;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The name of scratch files until they are unlinked.
pub(crate) const SCRATCH_NAME: &str = "cbvh-scratch";

/// Replaces a file by `bytes` such that its name always refers either to the old content or to all of `bytes`. What is
/// mapped or open under the old name keeps its content. If the name is a symbolic link, the file to which it leads is replaced,
/// and the link stays.
///
/// # Errors
/// [`BakeError::Write`] if the system refuses, or if something other than a regular file has the name, such as a link into
/// `/proc` or `/dev`. Nothing is left behind then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), BakeError> {
    write_atomically_with(path, |out| out.write_all(bytes))
}

/// Replaces a file by what `write` writes, in the way of [`write_atomically`]. This is for outputs that are never in memory as
/// a whole. Writes are not buffered.
///
/// # Errors
/// The errors of [`write_atomically`], and that of `write` as [`BakeError::Write`].
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), BakeError> {
    refuse_special(path)?;
    let path = &target(path)?;
    remove_stale_beside(path);
    let mut temporary = Temporary::beside(path)?;
    write(&mut temporary.file).map_err(failed(path, "write"))?;
    temporary.rename(path)
}

/// Removes the temporary files of this process and prevents new ones and renames: any thread that tries waits for ever.
/// Call this from a thread that is about to end the process, such as one that handles a signal.
pub fn discard_unfinished() {
    let live = live();
    live.iter().for_each(|path| drop(fs::remove_file(path)));
    std::mem::forget(live);
}

/// The most links that lead from a name to its file; Linux follows as many.
const MAX_LINKS: usize = 40;

/// Returns the file to which the links of an output's name lead, whether it exists or not; the name itself if it is no link.
/// Links of the system, such as `/dev/stdout`, and links to its files are refused: what they lead to depends on the process.
pub(crate) fn target(path: &Path) -> Result<PathBuf, BakeError> {
    let is_of_system = |path: &Path| {
        let folder = fs::canonicalize(directory_of(path)).unwrap_or_default();
        ["/proc", "/dev"].iter().any(|system| folder.starts_with(system))
    };
    let mut target = path.to_owned();
    for _ in 0..MAX_LINKS {
        let Ok(next) = fs::read_link(&target) else { return Ok(target) };
        let is_link_of_system = is_of_system(&target);
        target.pop();
        target.push(next);
        if is_link_of_system || is_of_system(&target) {
            break;
        }
    }
    Err(special(path, "a special file"))
}

/// Returns the error of an output that is no regular file.
fn special(path: &Path, found: &str) -> BakeError {
    let source = io::Error::other(format!("expected a regular file or none, found {found}"));
    BakeError::Write { path: path.to_owned(), action: "replace", source }
}

/// Refuses what a rename would wrongly replace, or would fail on late: a device, a directory, or a file in use.
pub(crate) fn refuse_special(path: &Path) -> Result<(), BakeError> {
    target(path)?;
    let found = match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => "a directory",
        Ok(metadata) if !metadata.is_file() => "a special file",
        _ if cfg!(windows) && names_device(path) => "the name of a device",
        _ => return refuse_in_use(path),
    };
    Err(special(path, found))
}

/// Refuses a file that another process has opened without allowing others to replace it, as most programs do on
/// Windows. Whether a file is mapped shows only when it is replaced.
#[cfg(windows)]
fn refuse_in_use(path: &Path) -> Result<(), BakeError> {
    use std::os::windows::fs::OpenOptionsExt;
    /// The access right `DELETE`, which a file must grant in order to be replaced.
    const DELETE: u32 = 0x0001_0000;
    match File::options().access_mode(DELETE).open(path) {
        Err(error) if error.raw_os_error() == Some(SHARING_VIOLATION) => Err(kept(path)(error)),
        _ => Ok(()),
    }
}

/// Other systems replace a file whoever uses it.
#[cfg(not(windows))]
fn refuse_in_use(_: &Path) -> Result<(), BakeError> {
    Ok(())
}

/// Windows' error for a file that another process has opened and does not share.
#[cfg(windows)]
const SHARING_VIOLATION: i32 = 32;

/// Returns the error of an output that the system does not let the bake replace. On Windows, the reason is most likely that
/// another program uses the file, which the system's message does not always say.
fn kept(path: &Path) -> impl Fn(io::Error) -> BakeError {
    move |source| {
        if !cfg!(windows) || !path.exists() {
            return failed(path, "create")(source);
        }
        let remedy = "close the program that has the file open or mapped, or name another output";
        failed(path, "replace")(io::Error::new(source.kind(), format!("{source}; {remedy}")))
    }
}

/// Removes what killed processes left in the directory of an output: the temporary files for that output, and scratch
/// files.
pub(crate) fn remove_stale_beside(output: &Path) {
    remove_stale(directory_of(output), &[output.file_name().unwrap_or_default(), SCRATCH_NAME.as_ref()]);
}

/// Removes the temporary files for any of the given names that killed processes left in a directory.
pub(crate) fn remove_stale(directory: &Path, names: &[&OsStr]) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    let is_named = |file: &OsStr| names.iter().any(|name| is_temporary(file, name));
    for entry in entries.flatten().filter(|entry| is_named(&entry.file_name())) {
        let path = entry.path();
        // Another process's file is opened only for this check, and a file that cannot be opened is left alone.
        if let Ok(file) = File::options().read(true).write(true).open(&path)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Returns whether a name is that of a temporary file for `name`.
fn is_temporary(file: &OsStr, name: &OsStr) -> bool {
    let (file, name) = (file.as_encoded_bytes(), name.as_encoded_bytes());
    let rest = file.strip_prefix(b".").and_then(|rest| rest.strip_prefix(name));
    let number = rest.and_then(|rest| rest.strip_prefix(b".")?.strip_suffix(b".tmp"));
    number.is_some_and(|number| number.iter().all(|byte| byte.is_ascii_digit() || *byte == b'-'))
}

/// The temporary files of this process that exist now.
fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the error of an output at which the system refused an operation.
pub(crate) fn failed(path: &Path, action: &'static str) -> impl Fn(io::Error) -> BakeError {
    move |source| BakeError::Write { path: path.to_owned(), action, source }
}

/// A new, locked file in the directory of the output. It is removed when dropped.
pub(crate) struct Temporary {
    path: PathBuf,
    file: File,
    /// Whether the file still has its temporary name.
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
        // WebAssembly has no process ids. A name in use is never taken, and without locks no file counts as stale.
        let process = if cfg!(target_family = "wasm") { 0 } else { std::process::id() };
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let mut hidden = OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{process}-{number}.tmp"));
            let path = directory.join(hidden);
            let mut live = live();
            match File::options().read(true).write(true).create_new(true).open(&path) {
                Ok(file) => {
                    live.push(path.clone());
                    drop(live);
                    let temporary = Self { path, file, named: true };
                    // Before the file was locked, another process may have taken it for a stale one. Where files cannot
                    // be locked, no file is taken for stale.
                    match temporary.file.try_lock() {
                        Err(fs::TryLockError::WouldBlock) => continue,
                        _ if !temporary.path.exists() => continue,
                        _ => return Ok(temporary),
                    }
                }
                // The name is in use by a process with the same number in another container.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
            }
        }
    }

    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// Unlinks the file, which stays open. If the system does not allow that, `drop` does it.
    pub(crate) fn forget_name(&mut self) {
        let mut live = live();
        if fs::remove_file(&self.path).is_ok() {
            live.retain(|path| *path != self.path);
            self.named = false;
        }
    }

    /// Renames the synchronised file to `path` and replaces what had that name.
    pub(crate) fn rename(mut self, path: &Path) -> Result<(), BakeError> {
        // Without this, a crash soon after the rename could leave an empty file under the name.
        self.file.sync_all().map_err(failed(path, "write"))?;
        if cfg!(windows) {
            // A lock would keep others from reading, and a program may wait for the name to appear.
            let _ = self.file.unlock();
        }
        let mut live = live();
        fs::rename(&self.path, path).map_err(kept(path))?;
        live.retain(|path| *path != self.path);
        self.named = false;
        drop(live);
        sync_directory(directory_of(path));
        Ok(())
    }
}

/// Synchronises a directory in which a file was renamed, so that the name outlasts a crash.
///
/// Failures are ignored. The file is complete and has its name in any case; without this, a crash within the next
/// seconds may bring back the old file, which is complete as well. Some file systems cannot synchronise directories at
/// all.
fn sync_directory(directory: &Path) {
    // Other systems do not open directories.
    if cfg!(unix)
        && let Ok(directory) = File::open(directory)
    {
        let _ = directory.sync_all();
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if self.named {
            let mut live = live();
            // Only the error that led here is reported.
            let _ = fs::remove_file(&self.path);
            live.retain(|path| *path != self.path);
        }
    }
}

/// Returns the directory of a file.
pub(crate) fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(target_family = "wasm", ignore = "WASI has no locks, without which no file counts as stale")]
    fn what_a_killed_process_left_is_removed_and_what_is_in_use_is_not() {
        let directory = cbvh_testkit::folder();
        let output = directory.path().join("out.cbvh");
        let write = |name: &str| fs::write(directory.path().join(name), "x").unwrap();
        let stale = ".out.cbvh.123-4.tmp";
        let others = [".out.cbvh.backup.tmp", ".other.cbvh.123-4.tmp", "out.cbvh.123-4.tmp"];
        write(stale);
        others.iter().for_each(|name| write(name));
        remove_stale_beside(&output);
        let used = Temporary::beside(&output).unwrap();
        remove_stale_beside(&output);
        let second = Temporary::beside(&output).unwrap();
        assert!(!directory.path().join(stale).exists() && used.path.exists() && second.path.exists());
        assert!(others.iter().all(|name| directory.path().join(name).exists()));
        drop((used, second));
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), others.len());
        write_atomically(&output, b"whole").unwrap();
        assert_eq!(fs::read(&output).unwrap(), b"whole");
        let broken = write_atomically_with(&output, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert!(matches!(broken, Err(BakeError::Write { action: "write", .. })), "{broken:?}");
        assert_eq!(fs::read(&output).unwrap(), b"whole");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), others.len() + 1);
    }

    #[cfg(unix)]
    #[test]
    fn what_cannot_be_synchronised_gets_no_name() {
        let directory = cbvh_testkit::folder();
        let output = directory.path().join("out.cbvh");
        fs::write(&output, "old").unwrap();
        let mut unfinished = Temporary::beside(&output).unwrap();
        // A pipe cannot be synchronised, and the system says so.
        let (_reader, writer) = io::pipe().unwrap();
        unfinished.file = std::os::fd::OwnedFd::from(writer).into();
        let refused = unfinished.rename(&output).unwrap_err();
        assert!(matches!(refused, BakeError::Write { action: "write", .. }), "{refused}");
        assert_eq!(fs::read(&output).unwrap(), b"old");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
