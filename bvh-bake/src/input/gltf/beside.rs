//! Opens a file that a mesh file names, and refuses names that lead to forbidden places.
//!
//! The author of a mesh file chooses the names in it, and the person who bakes it does not read them. A name may
//! therefore lead only to a regular file in the folder of the mesh file or below it. `..` and symbolic links are
//! followed first, and the place where they end decides. A named pipe or a device is opened without waiting for it, and
//! refused.

use crate::error::{Fault, Place, excerpt};
use crate::storage::device_names::names_device;
use std::fs::{self, File};
use std::io;
use std::path::{Component, Path, PathBuf};

/// The most bytes of a URI that may name a file. A longer one is none, but data, for instance.
const MAX_URI_BYTES: usize = 4096;

/// The folder of a mesh file, and whether names may lead out of it.
pub(super) struct Folder<'a> {
    path: &'a Path,
    allows_outside: bool,
}

/// An opened file, and its path without links.
pub(super) struct Beside {
    pub(super) file: File,
    pub(super) path: PathBuf,
    pub(super) length: u64,
}

impl<'a> Folder<'a> {
    /// Returns the folder of a mesh file.
    pub(super) fn of(document: &'a Path, allows_outside: bool) -> Self {
        let parent = document.parent().filter(|parent| !parent.as_os_str().is_empty());
        Self { path: parent.unwrap_or(Path::new(".")), allows_outside }
    }

    /// Opens the file that a relative URI names.
    pub(super) fn open(&self, uri: &str) -> Result<Beside, Fault> {
        let refused = |expected: &'static str| Fault::new(Place::File, expected, excerpt(uri.as_bytes()));
        if uri.len() > MAX_URI_BYTES {
            return Err(refused("a name of a file of at most 4096 bytes, or a data URI"));
        }
        let name = decode_percent(uri).ok_or_else(|| refused("a percent-encoded URI"))?;
        if has_scheme(&name) || !is_relative(Path::new(&name)) {
            return Err(refused("a buffer in a file named relative to this one"));
        }
        if cfg!(windows) && names_device(Path::new(&name)) {
            return Err(refused("a buffer in a file, not a device"));
        }
        let path = self.path.join(name);
        let failed = |source| Fault::Io { path: path.clone(), source };
        let folder = fs::canonicalize(self.path).map_err(failed)?;
        let target = fs::canonicalize(&path).map_err(failed)?;
        if !self.allows_outside && !target.starts_with(folder) {
            let expected =
                "a buffer in a file below the folder of this one (copy it there, or allow files outside)";
            return Err(refused(expected));
        }
        let file = open_at_once(&target).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        if !metadata.is_file() {
            return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file")));
        }
        // If a folder on the way was replaced meanwhile, the file may be another than the one that was judged.
        if !is_same_file(&metadata, &target).map_err(failed)? {
            return Err(failed(io::Error::other("a file that was replaced while it was opened")));
        }
        Ok(Beside { length: metadata.len(), path: target, file })
    }
}

/// Opens a file for reading without waiting for the other end of a pipe, and does not follow a link that has taken the
/// place of the file.
#[cfg(unix)]
fn open_at_once(path: &Path) -> io::Result<File> {
    use rustix::fs::{Mode, OFlags, open};
    let flags = OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NONBLOCK | OFlags::NOFOLLOW | OFlags::NOCTTY;
    Ok(open(path, flags, Mode::empty())?.into())
}

/// Opens a regular file for reading. What is none is not opened, because that might wait.
#[cfg(not(unix))]
fn open_at_once(path: &Path) -> io::Result<File> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    File::open(path)
}

/// Returns whether a path without links still has none and leads to the file that was opened.
#[cfg(unix)]
fn is_same_file(opened: &fs::Metadata, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let found = fs::symlink_metadata(path)?;
    Ok((found.dev(), found.ino()) == (opened.dev(), opened.ino()) && fs::canonicalize(path)? == path)
}

/// Returns whether a path without links still has none.
#[cfg(not(unix))]
fn is_same_file(_: &fs::Metadata, path: &Path) -> io::Result<bool> {
    Ok(fs::canonicalize(path)? == path)
}

/// Returns whether a URI begins with a scheme such as `http:`, or with the letter of a drive. A colon further on is part
/// of a name.
fn has_scheme(uri: &str) -> bool {
    let first = uri.split(['/', '\\']).next().unwrap_or_default();
    first.contains(':')
}

/// Returns whether a path begins neither at a root nor at a drive.
fn is_relative(path: &Path) -> bool {
    !path.components().any(|part| matches!(part, Component::Prefix(_) | Component::RootDir))
}

fn decode_percent(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        if first == b'%' {
            let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &rest[2..];
        } else {
            bytes.push(first);
        }
    }
    // No system has files with a NUL in their names.
    String::from_utf8(bytes).ok().filter(|name| !name.contains('\0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_signs_are_decoded() {
        assert_eq!(decode_percent("my%20mesh%C3%A9.bin").as_deref(), Some("my meshé.bin"));
        assert_eq!(decode_percent("a%2"), None);
        assert_eq!(decode_percent("a%zz"), None);
        assert_eq!(decode_percent("a%00.bin"), None);
    }

    #[test]
    fn schemes_and_drives_are_told_from_names() {
        for uri in ["http://x/y", "file:a.bin", "C:\\a.bin", "c:a.bin"] {
            assert!(has_scheme(uri), "{uri}");
        }
        for uri in ["a.bin", "parts/a:b.bin", "../a.bin", ""] {
            assert!(!has_scheme(uri), "{uri}");
        }
    }
}
