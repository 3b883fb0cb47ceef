//! Queries files evicted from the page cache, and measures what a query reads and what it touches.
//!
//! The system is asked to evict both files, which are then opened and queried. The same query then runs once more, when
//! everything it needs is in memory and validated. The marks that processors leave on the pages they touch are read
//! before and after it. How far the system reads ahead is its own choice, unless an option overrides it.

use std::fs::File;
use std::io;
use std::path::Path;
use std::time::Instant;

/// The answer to one query of two files on disk, and its cost.
#[derive(Debug, Clone)]
pub(crate) struct FromDisk<T> {
    pub(crate) answer: T,
    /// The nanoseconds until both files were open.
    pub(crate) open: u64,
    /// The nanoseconds until the answer, including opening.
    pub(crate) total: u64,
    /// The page faults that waited for the disk.
    pub(crate) faults: u64,
    /// The bytes read from the disk; `None` if the system does not tell.
    pub(crate) read_bytes: Option<u64>,
    /// The bytes of both files that the process has in memory after the first answer, in whole pages.
    pub(crate) resident_bytes: Option<u64>,
    /// The bytes of both files that the same query touches when it is asked again, in whole pages.
    pub(crate) touched_bytes: Option<u64>,
}

/// Opens both files with `open` and queries them twice with `ask`. Returns `None` if the system cannot evict files or count
/// page faults.
pub(crate) fn ask<O, T, E>(
    paths: [&Path; 2],
    open: impl Fn(&Path) -> Result<O, E>,
    mut ask: impl FnMut(&O, &O) -> Result<T, E>,
) -> Result<Option<FromDisk<T>>, E> {
    let evicted = paths.into_iter().try_for_each(evict);
    let (Ok(()), Some(faults), read) = (evicted, disk_faults(), read_bytes()) else { return Ok(None) };
    let start = Instant::now();
    let (a, b) = (open(paths[0])?, open(paths[1])?);
    let opened = start.elapsed().as_nanos() as u64;
    let answer = ask(&a, &b)?;
    let total = start.elapsed().as_nanos() as u64;
    let faults = disk_faults().unwrap_or(faults) - faults;
    let read_bytes = read_bytes().zip(read).map(|(after, before)| after - before);
    let resident_bytes = in_maps(paths, "Rss:");
    let is_clear = clear_marks().is_ok();
    ask(&a, &b)?;
    let touched_bytes = if is_clear { in_maps(paths, "Referenced:") } else { None };
    Ok(Some(FromDisk { answer, open: opened, total, faults, read_bytes, resident_bytes, touched_bytes }))
}

/// Asks the system to evict a file from the page cache.
#[cfg(target_os = "linux")]
fn evict(path: &Path) -> io::Result<()> {
    use rustix::fs::{Advice, fadvise};
    Ok(fadvise(File::open(path)?, 0, None, Advice::DontNeed)?)
}

/// Fails on other systems, which have no such call.
#[cfg(not(target_os = "linux"))]
fn evict(path: &Path) -> io::Result<()> {
    File::open(path).and(Err(io::ErrorKind::Unsupported.into()))
}

/// Returns the page faults of this process so far that waited for a disk, or `None` if the system does not tell.
fn disk_faults() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in brackets, may contain anything. The twelfth field is the tenth after it.
    text.rsplit(')').next()?.split_whitespace().nth(9)?.parse().ok()
}

/// Returns the bytes that the system has read from disks for this process so far.
fn read_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/io").ok()?;
    text.lines().find_map(|line| line.strip_prefix("read_bytes:"))?.trim().parse().ok()
}

/// Clears the marks of all pages of this process.
fn clear_marks() -> io::Result<()> {
    std::fs::write("/proc/self/clear_refs", "1")?;
    // A processor does not mark a page again while the page's address is in its translation buffer. Clearing the other
    // kind of marks flushes that buffer.
    std::fs::write("/proc/self/clear_refs", "4")
}

/// Returns the sum of a figure, in bytes, over the maps that this process has of two files, or `None` if there are none or
/// the system does not tell.
fn in_maps(paths: [&Path; 2], figure: &str) -> Option<u64> {
    let names = paths.map(|path| std::fs::canonicalize(path).ok());
    let maps = std::fs::read_to_string("/proc/self/smaps").ok()?;
    let (mut is_ours, mut sum) = (false, None);
    for line in maps.lines() {
        let first = line.split_whitespace().next().unwrap_or_default();
        if !first.ends_with(':') {
            // The first line of a map: addresses, permissions, offset, device, inode, name.
            let name = line.find('/').map(|at| Path::new(&line[at..]));
            is_ours = name.is_some() && names.iter().any(|ours| ours.as_deref() == name);
        } else if is_ours && first == figure {
            let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
            *sum.get_or_insert(0) += 1024 * kibibytes;
        }
    }
    sum
}
