//! Checks what `Bvh::map` says about open files that others replace, remove or truncate.

use crate::common::shapes::{soup, sphere};
use crate::common::{baked, mesh};
use bvh_bake::{Options, to_bytes};
use bvh_query::{Bvh, OpenError, OwnedShape, Pose, Querier, QueryError};
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

fn file(seed: u64) -> Vec<u8> {
    to_bytes(&mesh(&soup(3000, seed)), &Options::default()).unwrap().0
}

/// Writes a file into a folder that is removed with the guard.
fn written(bytes: &[u8]) -> (cbvh_testkit::TempDir, PathBuf) {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("victim.cbvh");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// Maps a file that a test is about to change.
fn map(path: &Path) -> Result<Bvh, OpenError> {
    // SAFETY: there is none once the file changes, and what happens then is tested. Files are replaced, removed or
    // truncated here, but not written into.
    unsafe { Bvh::map(path) }
}

fn truncate(path: &Path) {
    // Everything that opening has read, which is the first page, stays there.
    OpenOptions::new().write(true).open(path).unwrap().set_len(4096).unwrap();
}

fn contacts(bvh: &Bvh) -> usize {
    let good = baked(&sphere(1));
    Querier::new().unwrap().contacts(bvh, &good, &Pose::IDENTITY).unwrap().len()
}

/// Other systems have another number for the signal, or do not have the signal.
#[cfg(target_os = "linux")]
mod on_linux {
    use super::*;
    use std::os::unix::process::ExitStatusExt;
    use std::process::Command;

    /// Names, for the child process, the file that it opens, truncates and queries. The test starts itself as the child.
    const VICTIM: &str = "CBVH_TRUNCATION_VICTIM";
    const SIGBUS: i32 = 7;

    /// Does nothing in a normal test run; `a_truncated_map_ends_the_process` runs it as a process of its own.
    #[test]
    fn the_child_process() {
        let Ok(path) = std::env::var(VICTIM) else { return };
        let bvh = map(path.as_ref()).unwrap();
        truncate(Path::new(&path));
        println!("{} contacts", contacts(&bvh));
    }

    #[test]
    fn a_truncated_map_ends_the_process() {
        let (_folder, path) = written(&file(5));
        let child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "truncation::on_linux::the_child_process", "--nocapture"])
            .env(VICTIM, &path)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&child.stdout).into_owned();
        assert!(!said.contains("contacts"), "{said}");
        assert_eq!(
            std::fs::metadata(&path).unwrap().len(),
            4096,
            "the child did not come to the question: {said}"
        );
        // A sanitizer catches the signal, reports it and exits instead.
        let sanitized = String::from_utf8_lossy(&child.stderr).contains("AddressSanitizer: BUS");
        assert!(child.status.signal() == Some(SIGBUS) || sanitized, "{:?}: {said}", child.status);
    }
}

/// A shape does not lose its radius on the way into a copy of a file that has changed.
#[test]
#[cfg(target_os = "linux")]
fn a_changed_file_is_not_copied_with_another_radius() {
    use std::os::unix::fs::FileExt;
    let (_folder, path) = written(&file(6));
    let shape = OwnedShape::from(map(&path).unwrap()).rounded(0.5).unwrap();
    let copy = Bvh::from_bytes(shape.bytes().unwrap().into_owned()).unwrap();
    assert_eq!(copy.objects()[0].radius(), 0.5);
    // The checksum of the content, in the header.
    OpenOptions::new().write(true).open(&path).unwrap().write_all_at(&[0; 8], 24).unwrap();
    let refused = shape.bytes();
    assert!(matches!(refused, Err(QueryError::Damaged(_))), "{refused:?}");
}

#[cfg(windows)]
#[test]
fn a_mapped_file_cannot_be_truncated() {
    let bytes = file(5);
    let expected = contacts(&Bvh::from_bytes(bytes.clone()).unwrap());
    let (_folder, path) = written(&bytes);
    let bvh = map(&path).unwrap();
    let refused = OpenOptions::new().write(true).open(&path).unwrap().set_len(4096).unwrap_err();
    const USER_MAPPED_FILE: i32 = 1224;
    assert_eq!(refused.raw_os_error(), Some(USER_MAPPED_FILE), "{refused}");
    assert_eq!(contacts(&bvh), expected);
    drop(bvh);
    truncate(&path);
}

#[test]
fn a_file_that_was_read_may_be_truncated() {
    let bytes = file(5);
    let expected = contacts(&Bvh::from_bytes(bytes.clone()).unwrap());
    let (_folder, path) = written(&bytes);
    let bvh = Bvh::read(&path).unwrap();
    truncate(&path);
    assert_eq!(contacts(&bvh), expected);
    assert!(expected > 0);
    // The rest is not a valid file any more.
    assert!(Bvh::read(&path).is_err() && map(path.as_ref()).is_err());
    assert!(Bvh::read(path.with_extension("none")).is_err());
}

#[test]
fn a_file_that_was_replaced_or_removed_stays_as_it_was() {
    let bytes = file(5);
    let expected = contacts(&Bvh::from_bytes(bytes.clone()).unwrap());
    let (_folder, path) = written(&bytes);
    let replaced = map(path.as_ref()).unwrap();
    let other = path.with_extension("new");
    std::fs::write(&other, file(6)).unwrap();
    // Windows may refuse both while the file is mapped, and then the file stays as well.
    let is_allowed = |result: std::io::Result<()>| result.is_ok() || (cfg!(windows) && path.exists());
    assert!(is_allowed(std::fs::rename(&other, &path)));
    assert_eq!(contacts(&replaced), expected);
    let removed = map(path.as_ref()).unwrap();
    let new = contacts(&Bvh::read(&path).unwrap());
    assert!(is_allowed(std::fs::remove_file(&path)));
    assert_eq!(contacts(&removed), new);
    assert!(new != expected || (cfg!(windows) && other.exists()));
}
