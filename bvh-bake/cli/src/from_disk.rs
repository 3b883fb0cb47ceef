//! Asks files that are on disk and nowhere in memory, and tells what a query brings in and what it touches.
//!
//! The system is asked to forget what it holds of both files; then they are opened and asked. After that the same is
//! asked again, when all that it needs is there and checked, between two looks at the marks that processors leave on the
//! pages they touch. How far the system reads ahead is its own affair, unless it is told.

use std::fs::File;
use std::io;
use std::path::Path;
use std::time::Instant;

/// What came of one question to two files on disk.
#[derive(Debug, Clone)]
pub(crate) struct FromDisk<T> {
    pub(crate) answer: T,
    /// Nanoseconds until both files were open.
    pub(crate) open: u64,
    /// Nanoseconds until the answer, with opening.
    pub(crate) total: u64,
    /// Page faults that waited for the disk.
    pub(crate) faults: u64,
    /// Bytes that the disk was asked for; `None` where the system does not tell.
    pub(crate) read_bytes: Option<u64>,
    /// Bytes of both files, in whole pages, that the process has in memory after the first answer.
    pub(crate) resident_bytes: Option<u64>,
    /// Bytes of both files, in whole pages, that the same query touches when it is asked again.
    pub(crate) touched_bytes: Option<u64>,
}

/// Opens both files with `open` and asks them with `ask`, twice. `None` where the system cannot forget files or count
/// faults.
pub(crate) fn ask<O, T, E>(
    paths: [&Path; 2],
    open: impl Fn(&Path) -> Result<O, E>,
    mut ask: impl FnMut(&O, &O) -> Result<T, E>,
) -> Result<Option<FromDisk<T>>, E> {
    let forgotten = paths.into_iter().try_for_each(forget);
    let (Ok(()), Some(faults), read) = (forgotten, disk_faults(), read_bytes()) else { return Ok(None) };
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

/// Asks the system to forget what it holds of a file.
#[cfg(target_os = "linux")]
fn forget(path: &Path) -> io::Result<()> {
    use rustix::fs::{Advice, fadvise};
    Ok(fadvise(File::open(path)?, 0, None, Advice::DontNeed)?)
}

/// There is no way here.
#[cfg(not(target_os = "linux"))]
fn forget(path: &Path) -> io::Result<()> {
    File::open(path).and(Err(io::ErrorKind::Unsupported.into()))
}

/// Page faults of this process so far that had to wait for a disk; `None` where the system does not tell.
fn disk_faults() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in brackets, may hold anything; the twelfth field of all is the tenth behind it.
    text.rsplit(')').next()?.split_whitespace().nth(9)?.parse().ok()
}

/// Bytes that this process made the system fetch from disks so far.
fn read_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/io").ok()?;
    text.lines().find_map(|line| line.strip_prefix("read_bytes:"))?.trim().parse().ok()
}

/// Takes the marks off all pages of this process.
fn clear_marks() -> io::Result<()> {
    std::fs::write("/proc/self/clear_refs", "1")?;
    // A processor does not mark a page anew whose address it has noted. This, which clears other marks, makes it forget
    // its notes.
    std::fs::write("/proc/self/clear_refs", "4")
}

/// The sum of a figure, in bytes, over the maps that this process has of two files; `None` where there are none, or the
/// system does not tell.
fn in_maps(paths: [&Path; 2], figure: &str) -> Option<u64> {
    let names = paths.map(|path| std::fs::canonicalize(path).ok());
    let maps = std::fs::read_to_string("/proc/self/smaps").ok()?;
    let (mut is_ours, mut sum) = (false, None);
    for line in maps.lines() {
        let first = line.split_whitespace().next().unwrap_or_default();
        if !first.ends_with(':') {
            // A new map: addresses, rights, offset, device, number of the file, and its name.
            let name = line.find('/').map(|at| Path::new(&line[at..]));
            is_ours = name.is_some() && names.iter().any(|ours| ours.as_deref() == name);
        } else if is_ours && first == figure {
            let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
            *sum.get_or_insert(0) += 1024 * kibibytes;
        }
    }
    sum
}
