//! Read-only memory maps, of files and of copies of them: the one place where file bytes become memory.

use memmap2::{Mmap, MmapMut};
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

/// How the system reads a mapped file from its disk: a hint, without which it guesses. On systems other than Unix all are
/// the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ReadAhead {
    /// As the system does it: around each page that is touched it reads others, on Linux 128 KiB or what the
    /// disk is set to. Best where queries come by most of the file in the end.
    #[default]
    Usual,
    /// No more than queries touch: pages of nodes one by one, the blocks of leaves and ids each at once. Best where the
    /// file is larger than memory, or few of its pages will ever be asked for.
    Sparse,
    /// All of it, in the background from the time it is opened. Best where there is memory for all and time before
    /// the first query.
    Whole,
}

/// Maps a whole file for reading.
///
/// The bytes are the file's: if another process writes to the file or truncates it while it is
/// mapped, queries may see changed bytes (a page's checksum is verified once, at its first touch),
/// and a read beyond a truncated end kills the process with SIGBUS. Bake to a new name and rename,
/// as `cbvh bake` does, and mapped files keep their old contents. Where others may write to files,
/// read them into memory instead (`Bvh::read`).
pub(crate) fn map(path: &Path, read_ahead: ReadAhead) -> io::Result<Mmap> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
    }
    // SAFETY: the map is only ever read, through slices of bytes and types for which any bytes are
    // valid values. That nobody changes the file meanwhile is the promise asked for above; it is the
    // one that every reader of a memory map has to ask for.
    let map = unsafe { Mmap::map(&file) }?;
    // What the system does not understand it leaves.
    #[cfg(unix)]
    let _ = match read_ahead {
        ReadAhead::Usual => Ok(()),
        ReadAhead::Sparse => map.advise(memmap2::Advice::Random),
        ReadAhead::Whole => map.advise(memmap2::Advice::WillNeed),
    };
    Ok(map)
}

/// Asks the system to read a part of a map, which is about to be needed whole.
pub(crate) fn ahead(map: &Mmap, part: Range<usize>) {
    // A hint: whatever is wrong with it shows when the bytes are read.
    #[cfg(unix)]
    let _ = map.advise_range(memmap2::Advice::WillNeed, part.start, part.len());
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
