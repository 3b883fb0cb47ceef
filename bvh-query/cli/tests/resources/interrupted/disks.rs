//! Lets bakes run out of disk: by a limit on the length of files, and on disks in memory that are or become full.

use super::{Folder, LARGE, SIDE, USUAL, differ, moments};
use crate::common::sheet::write_sheet;
use crate::common::{names, skip};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// Checks that standard error has one line besides those of stages, and that it says what the system refused.
#[track_caller]
fn told_once(ended: &Output, what: &str) {
    let said = String::from_utf8_lossy(&ended.stderr);
    let lines: Vec<&str> = said.lines().filter(|line| !line.starts_with('{')).collect();
    assert!(lines.len() == 1 && lines[0].starts_with("cbvh: "), "{what}: {said}");
    assert!(["cannot", "expected room for"].iter().any(|word| lines[0].contains(word)), "{what}: {said}");
}

#[test]
fn a_limit_on_files_changes_nothing() {
    let folder = Folder::new();
    // The limit is always below the final size of the output.
    let most = folder.new.len() as f64 / 512.0 - 1.0;
    for moment in moments(3).into_iter().chain([0.0]) {
        // No file may grow beyond this number of units of 512 bytes: first the scratch files, then the output.
        let units = (moment * most) as u64;
        let command = format!(
            "trap '' XFSZ; ulimit -f {units}; exec {} {}",
            env!("CARGO_BIN_EXE_cbvh"),
            LARGE.join(" ")
        );
        let ended = Command::new("sh").args(["-c", &command]).current_dir(folder.path()).output().unwrap();
        let what = format!("{units} units");
        assert_eq!(ended.status.code(), Some(2), "{what}");
        told_once(&ended, &what);
        assert_eq!(names(folder.path()), USUAL);
        assert!(fs::read(folder.path().join("out.cbvh")).unwrap() == folder.old, "{what}");
    }
}

/// Disks in memory that are empty again after use, because each run of a script mounts its own.
struct Disks {
    folder: Folder,
    script: PathBuf,
}

/// The bytes of a page of such a disk.
const PAGE: u64 = 4096;

impl Disks {
    /// Returns `None` if this process may not mount anything.
    fn new() -> Option<Self> {
        let may = Command::new("unshare")
            .args(["-m", "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /mnt"])
            .stderr(Stdio::null())
            .status();
        if !may.is_ok_and(|status| status.success()) {
            skip("this process cannot mount a disk");
            return None;
        }
        let folder = Folder::new();
        let script = folder.path().join("script");
        Some(Self { folder, script })
    }

    /// Mounts a disk with the old output on it and `pages` free pages, and bakes on it while the script runs
    /// `meanwhile`. Checks the files that are on the disk afterwards, and returns how the bake ended.
    fn bake(&self, pages: u64, arguments: &str, meanwhile: &str) -> Output {
        let old = (self.folder.old.len() as u64).div_ceil(PAGE);
        let script = format!(
            "mkdir -p disk\n\
             mount -t tmpfs -o size={} tmpfs disk\n\
             cp out.cbvh disk/out.cbvh\n\
             {} bake {arguments} --force --json &\n\
             {meanwhile}\n\
             wait $! && code=0 || code=$?\n\
             ls -A disk > listing\n\
             cp disk/out.cbvh found.cbvh\n\
             umount disk && rmdir disk\n\
             exit $code\n",
            (old + pages) * PAGE,
            env!("CARGO_BIN_EXE_cbvh"),
        );
        fs::write(&self.script, script).unwrap();
        let ended = Command::new("unshare")
            .args(["-m", "sh", "-e", "script"])
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        let what = format!("{pages} pages, {arguments}, {meanwhile}: {ended:?}");
        let found = fs::read(self.folder.path().join("found.cbvh")).unwrap();
        assert_eq!(fs::read_to_string(self.folder.path().join("listing")).unwrap(), "out.cbvh\n", "{what}");
        match ended.status.code() {
            Some(0) => assert!(found == self.folder.new, "{what}"),
            Some(2) => {
                told_once(&ended, &what);
                assert!(found == self.folder.old, "{what}");
            }
            _ => panic!("{what}"),
        }
        ended
    }
}

#[test]
fn a_full_disk_for_the_output_changes_nothing() {
    let Some(disks) = Disks::new() else { return };
    let needed = (disks.folder.new.len() as u64).div_ceil(PAGE);
    for moment in moments(4) {
        let pages = (moment * needed as f64) as u64;
        let ended = disks.bake(pages, "large.stl -o disk/out.cbvh", "");
        assert_eq!(ended.status.code(), Some(2), "{pages} pages of {needed}");
    }
    assert_eq!(disks.bake(needed - 1, "large.stl -o disk/out.cbvh", "").status.code(), Some(2));
    assert!(
        disks.bake(needed, "large.stl -o disk/out.cbvh", "").status.success(),
        "there is just enough room"
    );
}

#[test]
fn a_full_disk_for_scratch_changes_nothing() {
    let Some(disks) = Disks::new() else { return };
    // PLY is read with scratch files of three times the size of the input, and there must be room for them before the
    // work.
    write_sheet(&disks.folder.path().join("large.ply"), SIDE);
    let input = fs::metadata(disks.folder.path().join("large.ply")).unwrap().len() / PAGE;
    let mut refused = BTreeSet::new();
    let moments = moments(5);
    for &moment in &moments {
        let pages = (moment * 3.0 * input as f64) as u64;
        let ended = disks.bake(pages, "large.ply -o disk/out.cbvh --scratch disk --max-memory 116MiB", "");
        assert_eq!(ended.status.code(), Some(2), "{pages} pages");
        refused.insert(String::from_utf8_lossy(&ended.stderr).contains("expected room for"));
    }
    assert!(refused.len() == 2 || !differ(&moments), "some before the work and some during it: {refused:?}");
}

#[test]
fn a_disk_that_fills_up_meanwhile_changes_nothing() {
    let Some(disks) = Disks::new() else { return };
    let (mut full, mut stages) = (0, BTreeSet::new());
    let moments = moments(6);
    for &moment in &moments {
        let seconds = (disks.folder.duration.mul_f64(moment)).as_secs_f64();
        // The disk shrinks to the size in use. If files grow at the same time, that fails and is tried again.
        let meanwhile = format!(
            "sleep {seconds:.3}\n\
             for i in 1 2 3 4 5 6 7 8 9; do\n\
               used=$(df -k --output=used disk | tail -1)\n\
               mount -o remount,size=$((used + 64))k disk 2>/dev/null && break\n\
             done"
        );
        let ended = disks.bake(1 << 20, "large.stl -o disk/out.cbvh --max-memory 120MiB", &meanwhile);
        if !ended.status.success() {
            full += 1;
            stages.insert(String::from_utf8_lossy(&ended.stderr).lines().count());
        }
    }
    assert!(4 * full >= moments.len(), "only {full} disks were full before the bake was done");
    assert!(stages.len() >= 2 || !differ(&moments), "all in the stages {stages:?}");
}
