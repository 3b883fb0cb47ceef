//! Read-only memory maps: the one place where file bytes become memory.

use memmap2::Mmap;
use std::fs::File;
use std::io;
use std::path::Path;

/// Maps a whole file for reading.
///
/// The bytes are the file's: if another process writes to the file or truncates it while it is
/// mapped, queries may see changed bytes (a page's checksum is verified once, at its first touch),
/// and a read beyond a truncated end kills the process with SIGBUS. Bake to a new name and rename,
/// as `cbvh bake` does, and mapped files keep their old contents. Where others may write to files,
/// read them into memory instead (`Bvh::read`).
pub(crate) fn map(path: &Path) -> io::Result<Mmap> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
    }
    // SAFETY: the map is only ever read, through slices of bytes and types for which any bytes are
    // valid values. That nobody changes the file meanwhile is the promise asked for above; it is the
    // one that every reader of a memory map has to ask for.
    unsafe { Mmap::map(&file) }
}
