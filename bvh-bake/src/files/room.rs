//! Whether there is room in a directory for what is going to be written, found out before the work.

use crate::error::BakeError;
use std::path::Path;

/// Bytes of scratch files a triangle from when a mesh has been read: triangles in bricks, and pages with their blocks,
/// which take up to 80 in the largest profile.
pub(super) const SCRATCH_A_TRIANGLE: u64 = 120;
/// Bytes of the output a triangle.
pub(super) const OUTPUT_A_TRIANGLE: u64 = 80;

/// Refuses directories that have less room than the bytes given, which add up where directories share a file system.
pub(super) fn check(needs: &[(&Path, u64)]) -> Result<(), BakeError> {
    for (number, (directory, needed)) in needs.iter().enumerate() {
        let others = needs.iter().enumerate().filter(|(other, _)| *other != number);
        let shared = others.filter(|(_, (other, _))| same_system(directory, other));
        let needed = shared.fold(*needed, |sum, (_, (_, bytes))| sum.saturating_add(*bytes));
        if let Some(found) = free_bytes(directory).filter(|&found| found < needed) {
            return Err(BakeError::Room { directory: directory.to_path_buf(), needed, found });
        }
    }
    Ok(())
}

/// Bytes that may still be written in a directory; `None` where the system does not tell.
#[cfg(unix)]
fn free_bytes(directory: &Path) -> Option<u64> {
    let found = rustix::fs::statvfs(directory).ok()?;
    Some(found.f_bavail.saturating_mul(found.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_: &Path) -> Option<u64> {
    None
}

#[cfg(unix)]
fn same_system(a: &Path, b: &Path) -> bool {
    let device = |path: &Path| rustix::fs::stat(path).ok().map(|stat| stat.st_dev);
    device(a) == device(b)
}

#[cfg(not(unix))]
fn same_system(_: &Path, _: &Path) -> bool {
    false
}
