//! Read-only memory maps, of files and of copies of them: the one place where file bytes become memory.

use memmap2::{Mmap, MmapMut};
use std::fs::File;
use std::io::{self, Read};
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

/// Reads a whole file into memory of its own.
pub(crate) fn read(path: &Path) -> io::Result<Mmap> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        // A pipe does not tell how long it is.
        return copy(&std::fs::read(path)?);
    }
    let length = usize::try_from(metadata.len()).map_err(|_| io::Error::from(io::ErrorKind::FileTooLarge))?;
    let mut memory = memory(length)?;
    file.read_exact(&mut memory)?;
    memory.make_read_only()
}

/// Copies bytes to memory of its own.
pub(crate) fn copy(bytes: &[u8]) -> io::Result<Mmap> {
    let mut memory = memory(bytes.len())?;
    memory.copy_from_slice(bytes);
    memory.make_read_only()
}

/// Memory in large pages where the system has them: a query touches a few lines of many pages, and looks up the
/// address of each.
fn memory(length: usize) -> io::Result<MmapMut> {
    let memory = MmapMut::map_anon(length)?;
    // A kernel without them says no, and memory is memory.
    #[cfg(target_os = "linux")]
    let _ = memory.advise(memmap2::Advice::HugePage);
    Ok(memory)
}
