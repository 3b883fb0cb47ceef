//! Writes a file whole or not at all: beside its name, synchronised, then renamed.

use crate::error::BakeError;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Writes a file such that under its name there is, at any time, either what was there before or all
/// of `bytes`. What is mapped or open under the old name keeps its contents.
///
/// # Errors
/// [`BakeError::Write`] if the system refuses, or if something other than a regular file has the name.
/// Nothing is left behind then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), BakeError> {
    refuse_special(path)?;
    let mut temporary = Temporary::beside(path)?;
    let failed = |action| move |source| BakeError::Write { path: path.to_owned(), action, source };
    temporary.file.write_all(bytes).map_err(failed("write"))?;
    // Without it a crash soon after the rename could leave the name on an empty file.
    temporary.file.sync_all().map_err(failed("write"))?;
    fs::rename(&temporary.path, path).map_err(failed("create"))?;
    temporary.renamed = true;
    Ok(())
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

/// A new file in the directory of another, removed when dropped.
pub(super) struct Temporary {
    path: PathBuf,
    file: File,
    renamed: bool,
}

impl Temporary {
    /// Creates an empty file beside `output`, hidden and named after it.
    pub(super) fn beside(output: &Path) -> Result<Self, BakeError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let failed = |source| BakeError::Write { path: output.to_owned(), action: "create", source };
        let nameless = || io::Error::new(io::ErrorKind::InvalidInput, "the path names no file");
        let name = output.file_name().ok_or_else(nameless).map_err(failed)?;
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{number}.tmp", std::process::id()));
            let path = output.with_file_name(hidden);
            match File::create_new(&path) {
                Ok(file) => return Ok(Self { path, file, renamed: false }),
                // Left by a process of the same number that was killed.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(failed(error)),
            }
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.renamed {
            // The error that led here is the one to tell.
            let _ = fs::remove_file(&self.path);
        }
    }
}
