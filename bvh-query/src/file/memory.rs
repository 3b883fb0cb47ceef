//! Copies of files in memory of their own, and what the system is told about memory.

use memmap2::{Mmap, MmapMut};
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

/// Asks the system to read a part of a map, all of which is about to be needed.
#[cfg_attr(not(unix), allow(unused_variables, reason = "other systems take no hint"))]
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
