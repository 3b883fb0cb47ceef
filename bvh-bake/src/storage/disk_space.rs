//! Finds out before the work whether the directories have room for what will be written to them.

use crate::error::BakeError;
use std::path::Path;

/// Bytes of scratch files per triangle once a mesh has been read: the triangles in bricks, and the pages with their
/// blocks, which take up to 80 in the largest profile.
pub(crate) const SCRATCH_BYTES_PER_TRIANGLE: u64 = 120;
/// Bytes of the output per triangle.
pub(crate) const OUTPUT_BYTES_PER_TRIANGLE: u64 = 80;

/// Refuses a directory that has less room than the bytes given. Where directories share a file system, their bytes
/// add up.
pub(crate) fn check(needs: &[(&Path, u64)]) -> Result<(), BakeError> {
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

/// Returns the bytes that may still be written in a directory, or `None` if the system does not say.
#[cfg(unix)]
fn free_bytes(directory: &Path) -> Option<u64> {
    let found = rustix::fs::statvfs(directory).ok()?;
    Some(found.f_bavail.saturating_mul(found.f_frsize))
}

/// Returns the bytes that may still be written in a directory, or `None` if the system does not say.
#[cfg(windows)]
fn free_bytes(directory: &Path) -> Option<u64> {
    fs4::available_space(directory).ok()
}

#[cfg(not(any(unix, windows)))]
fn free_bytes(_: &Path) -> Option<u64> {
    None
}

#[cfg(unix)]
fn same_system(a: &Path, b: &Path) -> bool {
    let device = |path: &Path| rustix::fs::stat(path).ok().map(|stat| stat.st_dev);
    device(a) == device(b)
}

/// Compares the drives, or the servers and their shares.
#[cfg(windows)]
fn same_system(a: &Path, b: &Path) -> bool {
    let resolved = [a, b].map(|path| std::fs::canonicalize(path).unwrap_or_default());
    let [a, b] = resolved.each_ref().map(|path| path.components().next());
    a == b
}

#[cfg(not(any(unix, windows)))]
fn same_system(_: &Path, _: &Path) -> bool {
    false
}

#[cfg(all(test, any(unix, windows)))]
mod tests {
    use super::*;

    #[test]
    fn room_is_counted_once_per_disk() {
        let directory = cbvh_testkit::folder();
        let (path, inner) = (directory.path(), directory.path().join("inner"));
        std::fs::create_dir(&inner).unwrap();
        let free = free_bytes(path).unwrap();
        assert!(free > 0);
        check(&[(path, 1), (&inner, 1)]).unwrap();
        for needs in [&[(path, u64::MAX)][..], &[(path, u64::MAX / 2), (&inner, u64::MAX / 2)]] {
            let refused = check(needs).unwrap_err();
            assert!(matches!(refused, BakeError::Room { needed: 0xffff_ffff_ffff_fffe.., .. }), "{refused}");
        }
    }
}
