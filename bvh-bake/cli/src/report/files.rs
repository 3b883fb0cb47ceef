//! Times the first query of files that are on disk and nowhere in memory.
//!
//! The system is asked to forget what it holds of both files; then they are opened, asked one question and
//! closed. What is counted beside the time are page faults that waited for the disk: that is where the order of
//! pages shows. How far the system reads ahead is its own affair, and its disk's.

use super::machine::disk_faults;
use super::measure::{Baked, Question};
use bvh_bake::write_atomically;
use bvh_query::{Backend, Bvh, Pose, Querier};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What came of one question to the files of one variant.
#[derive(Debug, Clone)]
pub(super) struct FromDisk {
    /// Nanoseconds by pose, with opening.
    pub(super) times: Vec<u64>,
    /// Faults that waited for the disk, by pose.
    pub(super) faults: Vec<u64>,
}

/// Asks; `None` where the system cannot forget files or count faults, or has no disk below the folder.
pub(super) fn first_queries(
    bake: &Baked,
    question: Question,
    poses: &[Pose],
    backend: Backend,
    folder: &Path,
) -> Option<FromDisk> {
    let files = [("a", &bake.a), ("b", &bake.b)].map(|(side, bvh)| {
        let path = folder.join(format!(".report-{}-{side}.cbvh", std::process::id()));
        Temporary::write(path, bvh.bytes())
    });
    let [Some(a), Some(b)] = files else { return None };
    let mut found = FromDisk { times: Vec::new(), faults: Vec::new() };
    let mut querier = Querier::with_backend(backend);
    for pose in poses {
        forget(&a.path).ok()?;
        forget(&b.path).ok()?;
        let faults = disk_faults()?;
        let before = Instant::now();
        let open = |path: &Path| Bvh::open(path).ok().map(Arc::new);
        let (a, b) = (open(&a.path)?, open(&b.path)?);
        let opened = Baked { variant: bake.variant.clone(), a, b };
        question.ask(&mut querier, &opened, pose).ok()?;
        found.times.push(before.elapsed().as_nanos() as u64);
        found.faults.push(disk_faults()? - faults);
    }
    // Files that are in memory whatever one asks have no such faults.
    found.faults.iter().any(|&faults| faults > 0).then_some(found)
}

/// A file that goes when this does.
struct Temporary {
    path: PathBuf,
}

impl Temporary {
    /// Writes it to the disk itself: what has not got there cannot be forgotten.
    fn write(path: PathBuf, bytes: &[u8]) -> Option<Self> {
        write_atomically(&path, bytes).ok()?;
        let file = Self { path };
        File::open(&file.path).and_then(|file| file.sync_all()).ok()?;
        Some(file)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // If it is gone already, so much the better.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Asks the system to forget what it holds of a file.
#[cfg(target_os = "linux")]
fn forget(path: &Path) -> io::Result<()> {
    use rustix::fs::{Advice, fadvise};
    Ok(fadvise(File::open(path)?, 0, None, Advice::DontNeed)?)
}

/// There is no way here.
#[cfg(not(target_os = "linux"))]
fn forget(_: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
