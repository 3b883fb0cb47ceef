//! Read-only memory maps, of files and of copies of files: the one place where the bytes of a file become memory.
//!
//! [`ReadAhead`] states what a mapped file asks of its user, and why mapping is a safe function.

use memmap2::{Mmap, MmapMut};
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

/// How the system reads a mapped file from its disk.
///
/// This is a hint; without it, the system guesses. On systems other than Unix all hints are the same.
///
/// # What a mapped file asks for
/// The bytes of a file that is open by [`Bvh::open`](crate::Bvh::open) or
/// [`Bvh::open_with`](crate::Bvh::open_with) must not change:
///
/// - *Replaced* by renaming another file over it, or *removed*: allowed. The old content stays, and so do the answers.
///   `cbvh bake` replaces its output in this way.
/// - *Truncated*, by whatever process: on Unix the first access beyond the new end sends SIGBUS, which ends this process.
///   There is no error to catch.
/// - *Written into*: answers are undefined, because a page is checked at its first touch only. Formally the behaviour of
///   the program is undefined as well, since Rust assumes that bytes behind a shared reference do not change. Queries
///   are written so that they do not depend on that assumption: they take file bytes as numbers of which each value is
///   valid, they check each index they compute from them, and a walk is bounded by counts that were read once.
///
/// # Why mapping is a safe function
/// An `unsafe fn` asks its caller for a proof, and no caller can prove what other processes do to a file: neither a
/// file lock nor its permissions bind them. The keyword would make every caller write the same sentence, and leave the
/// risk as it is. So the promise is documented here and named at [`Bvh::open`](crate::Bvh::open). Programs
/// that cannot make it have [`Bvh::read`](crate::Bvh::read), which copies the file and asks for nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum ReadAhead {
    /// Reads as the system usually does: around each page that is touched, other pages as well; on Linux 128 KiB, or
    /// what is set for the disk. Best where queries touch most of the file in the end.
    #[default]
    Usual,
    /// Reads no more than queries touch: pages of nodes one by one, blocks of leaves and of ids each at once. Best where
    /// the file is larger than memory, or where few of its pages will ever be asked for.
    Sparse,
    /// Reads the whole file in the background, from the time it is opened. Best where there is memory for all of it
    /// and time before the first query.
    Whole,
}

/// Maps a whole file for reading.
pub(crate) fn map(path: &Path, read_ahead: ReadAhead) -> io::Result<Mmap> {
    // Opening a named pipe would wait for its other end, and another file may take the name before it is opened.
    require_mappable(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    require_mappable(&file.metadata()?)?;
    // SAFETY: the map is only ever read, as slices of bytes and as types for which any bytes are valid. That nobody
    // changes the file meanwhile is what the documentation of `ReadAhead` asks of the user.
    let map = unsafe { Mmap::map(&file) }?;
    // A hint that the system does not know is no error.
    #[cfg(unix)]
    let _ = match read_ahead {
        ReadAhead::Usual => Ok(()),
        ReadAhead::Sparse => map.advise(memmap2::Advice::Random),
        ReadAhead::Whole => map.advise(memmap2::Advice::WillNeed),
    };
    Ok(map)
}

/// Refuses what has no bytes of its own.
fn require_mappable(metadata: &Metadata) -> io::Result<()> {
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
    }
    if metadata.is_file() { Ok(()) } else { Err(io::Error::other("not a regular file")) }
}

/// Asks the system to read a part of a map, all of which is about to be needed.
pub(crate) fn will_need(map: &Mmap, part: Range<usize>) {
    // What is wrong with the hint shows when the bytes are read.
    #[cfg(unix)]
    let _ = map.advise_range(memmap2::Advice::WillNeed, part.start, part.len());
}

/// Reads a whole file into anonymous memory.
pub(crate) fn read(path: &Path) -> io::Result<Mmap> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        // A pipe does not tell its length.
        return copy(&std::fs::read(path)?);
    }
    let length = usize::try_from(metadata.len()).map_err(|_| io::Error::from(io::ErrorKind::FileTooLarge))?;
    let mut memory = memory(length)?;
    file.read_exact(&mut memory)?;
    memory.make_read_only()
}

/// Copies bytes into anonymous memory.
pub(crate) fn copy(bytes: &[u8]) -> io::Result<Mmap> {
    let mut memory = memory(bytes.len())?;
    memory.copy_from_slice(bytes);
    memory.make_read_only()
}

/// Maps anonymous memory, in large pages where the system has them: a query touches a few cache lines in each of many
/// pages, and each page costs an address translation.
fn memory(length: usize) -> io::Result<MmapMut> {
    let memory = MmapMut::map_anon(length)?;
    // A kernel without large pages refuses the hint; the memory serves as well.
    #[cfg(target_os = "linux")]
    let _ = memory.advise(memmap2::Advice::HugePage);
    Ok(memory)
}
