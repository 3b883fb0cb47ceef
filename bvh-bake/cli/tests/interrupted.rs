//! Bakes that are ended, or run out of disk, at twenty moments each: the output is the old one or the new one, whole,
//! and nothing else stays for good.
#![cfg(target_os = "linux")]

mod common;

use common::sheet::write_sheet;
use common::{cbvh_in, names, skip};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Moments, or sizes of disks.
const MOMENTS: u32 = 20;

/// Numbers from 0 to 1 that look random, the same each time: one in each part of that range, in no order.
fn moments(seed: u32) -> impl Iterator<Item = f64> {
    let mut state = seed;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24)
    };
    // 7 has no factor in common with their number.
    (0..MOMENTS).map(move |i| (f64::from(i * 7 % MOMENTS) + random()) / f64::from(MOMENTS))
}

/// A folder with a large mesh, and an output that was baked from a small one.
struct Folder {
    folder: tempfile::TempDir,
    old: Vec<u8>,
    new: Vec<u8>,
    /// Of the quickest bake of the large mesh so far.
    duration: Duration,
}

/// Squares along a side of the large mesh.
const SIDE: u32 = 400;
const USUAL: [&str; 3] = ["large.stl", "out.cbvh", "small.stl"];
const LARGE: [&str; 8] =
    ["bake", "large.stl", "-o", "out.cbvh", "--force", "--json", "--max-memory", "120MiB"];

impl Folder {
    /// The large mesh has two bricks.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        write_sheet(&folder.path().join("large.stl"), SIDE);
        write_sheet(&folder.path().join("small.stl"), 2);
        let mut made = Self { folder, old: Vec::new(), new: Vec::new(), duration: Duration::MAX };
        for _ in 0..2 {
            let start = Instant::now();
            let baked = cbvh_in(made.path(), &[&LARGE[..], &["-q"]].concat()).done().json();
            assert!(baked["scratch_bytes"].as_u64().unwrap() > 0, "{baked}");
            made.duration = made.duration.min(start.elapsed());
        }
        made.new = fs::read(made.path().join("out.cbvh")).unwrap();
        made.bake_small();
        made.old = fs::read(made.path().join("out.cbvh")).unwrap();
        made
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn bake_small(&self) {
        cbvh_in(self.path(), &["bake", "small.stl", "-o", "out.cbvh", "--force", "-q"]).done();
    }

    /// Bakes the large mesh and sends a signal at a moment; returns whether it came in time, and the stages that had
    /// ended.
    fn end(&mut self, moment: f64, signal: &str) -> (bool, usize) {
        let said = self.path().join("said");
        let mut child = Command::new(env!("CARGO_BIN_EXE_cbvh"))
            .args(LARGE)
            .current_dir(self.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(&said).unwrap())
            .spawn()
            .unwrap();
        let start = Instant::now();
        std::thread::sleep(self.duration.mul_f64(moment));
        if child.try_wait().unwrap().is_none() {
            let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
            assert!(sent.success());
        }
        let status = child.wait().unwrap();
        if status.success() {
            self.duration = self.duration.min(start.elapsed());
        }
        let stages = fs::read_to_string(&said).unwrap().lines().count();
        fs::remove_file(said).unwrap();
        (!status.success(), stages)
    }

    /// The output is the one or the other, whole; afterwards the old one is there again.
    fn check_output(&self, what: &str) {
        let output = self.path().join("out.cbvh");
        cbvh_in(self.path(), &["validate", "out.cbvh"]).done();
        let found = fs::read(&output).unwrap();
        assert!(found == self.old || found == self.new, "{what}: neither the old output nor the new one");
        fs::write(&output, &self.old).unwrap();
    }
}

/// Ends bakes with a signal at all moments.
fn end_with(signal: &str, seed: u32, leaves_nothing: bool) {
    let mut folder = Folder::new();
    let (mut ended, mut stages) = (0, BTreeSet::new());
    for moment in moments(seed) {
        let (in_time, stage) = folder.end(moment, signal);
        let what = format!("{signal} at {moment:.3} of the bake, in stage {stage}");
        if in_time {
            ended += 1;
            stages.insert(stage);
        }
        if leaves_nothing {
            assert_eq!(names(folder.path()), USUAL, "{what}");
        }
        folder.check_output(&what);
        // The next bake of this output removes what there may be.
        folder.bake_small();
        assert_eq!(names(folder.path()), USUAL, "{what}");
        assert!(fs::read(folder.path().join("out.cbvh")).unwrap() == folder.old, "{what}");
    }
    // How long bakes take differs, so that not every signal need come in time.
    assert!(ended >= 5, "only {ended} were ended before they were done");
    assert!(stages.len() >= 2, "all in the stages {stages:?}");
}

#[test]
fn a_bake_that_is_killed_leaves_nothing_for_good() {
    end_with("-KILL", 1, false);
}

#[test]
fn a_bake_that_is_told_to_end_leaves_nothing() {
    end_with("-TERM", 2, true);
}

/// What a process that was killed at the worst moment leaves is removed by the next bake, though it needs no scratch
/// file itself.
#[test]
fn scratch_files_that_kept_their_names_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    write_sheet(&directory.join("small.stl"), 2);
    fs::create_dir(directory.join("scratch")).unwrap();
    for (place, more) in [
        ("", &[][..]),
        ("", &["--max-memory", "100MiB"]),
        ("scratch", &["--max-memory", "100MiB", "--scratch", "scratch"]),
    ] {
        let stale = directory.join(place).join(".cbvh-scratch.123-4.tmp");
        fs::write(&stale, "x").unwrap();
        let bake = ["bake", "small.stl", "-o", "out.cbvh", "--force", "-q"];
        cbvh_in(directory, &[&bake[..], more].concat()).done();
        assert!(!stale.exists(), "{more:?}");
    }
    assert_eq!(names(directory), ["out.cbvh", "scratch", "small.stl"]);
}

/// The last line on standard error, which is the only one but for those of stages, says what the system refused.
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
    // The output grows beyond what it may at last.
    let most = folder.new.len() as f64 / 512.0 - 1.0;
    for moment in moments(3).chain([0.0]) {
        // No file may grow beyond so many units of 512 bytes: scratch files first, then the output.
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

/// Disks in memory, on which nothing stays: each run of a script has its own.
struct Disks {
    folder: Folder,
    script: PathBuf,
}

/// A page of such a disk.
const PAGE: u64 = 4096;

impl Disks {
    /// `None` where this process may not mount anything.
    fn new() -> Option<Self> {
        let may = Command::new("unshare")
            .args(["-m", "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /mnt"])
            .stderr(Stdio::null())
            .status();
        if !may.is_ok_and(|status| status.success()) {
            skip("this process may not mount a disk");
            return None;
        }
        let folder = Folder::new();
        let script = folder.path().join("script");
        Some(Self { folder, script })
    }

    /// Mounts a disk of so many pages besides those of the old output, which is there, and bakes on it. Returns how the
    /// bake ended, after checking what is there then. `meanwhile` is done while it bakes.
    fn bake(&self, pages: u64, arguments: &str, meanwhile: &str) -> Output {
        let old = self.folder.old.len() as u64;
        assert_eq!(old % PAGE, 0);
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
            old + pages * PAGE,
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
    let needed = disks.folder.new.len() as u64 / PAGE;
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
    // What is read of this format takes three times the room of the input, which must be there before the work.
    write_sheet(&disks.folder.path().join("large.ply"), SIDE);
    let input = fs::metadata(disks.folder.path().join("large.ply")).unwrap().len() / PAGE;
    let mut refused = BTreeSet::new();
    for moment in moments(5) {
        let pages = (moment * 3.0 * input as f64) as u64;
        let ended = disks.bake(pages, "large.ply -o disk/out.cbvh --scratch disk --max-memory 116MiB", "");
        assert_eq!(ended.status.code(), Some(2), "{pages} pages");
        refused.insert(String::from_utf8_lossy(&ended.stderr).contains("expected room for"));
    }
    assert_eq!(refused.len(), 2, "some before the work and some during it: {refused:?}");
}

#[test]
fn a_disk_that_fills_up_meanwhile_changes_nothing() {
    let Some(disks) = Disks::new() else { return };
    let (mut full, mut stages) = (0, BTreeSet::new());
    for moment in moments(6) {
        let seconds = (disks.folder.duration.mul_f64(moment)).as_secs_f64();
        // The disk shrinks to what is on it, unless that grows at the same time: then once more.
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
    assert!(full >= 5, "only {full} disks were full before the bake was done");
    assert!(stages.len() >= 2, "all in the stages {stages:?}");
}
