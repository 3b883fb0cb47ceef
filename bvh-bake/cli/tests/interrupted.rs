//! Stops bakes, or lets them run out of disk, at several moments. Afterwards the output is completely the old one or
//! completely the new one, and nothing else stays for good.
#![cfg(target_os = "linux")]

mod common;

use cbvh_testkit::Random;
use cbvh_testkit::depth::rounds;
use common::place;
use common::sheet::write_sheet;
use common::{cbvh_in, names, skip};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// With fewer moments than this, a test does not check how the bakes ended, because all of them may meet the same
/// stage.
const MIN_MOMENTS_THAT_DIFFER: usize = 10;

/// Returns numbers from 0 to 1, the same ones each time: one at random from each of `rounds(2)` equal parts of that
/// range.
fn moments(seed: u64) -> Vec<f64> {
    let (mut random, count) = (Random::new(seed), rounds(2));
    (0..count).map(|i| (i as f64 + (random.signed() + 1.0) / 2.0) / count as f64).collect()
}

/// Returns whether there are enough moments for the bakes to end in different stages.
fn differ(moments: &[f64]) -> bool {
    moments.len() >= MIN_MOMENTS_THAT_DIFFER
}

/// A folder with a large mesh, and an output that was baked from a small one.
struct Folder {
    folder: tempfile::TempDir,
    old: Vec<u8>,
    new: Vec<u8>,
    /// The duration of the quickest bake of the large mesh so far.
    duration: Duration,
}

/// The number of squares along a side of the large mesh.
const SIDE: u32 = 400;
const USUAL: [&str; 3] = ["large.stl", "out.cbvh", "small.stl"];
const LARGE: [&str; 8] =
    ["bake", "large.stl", "-o", "out.cbvh", "--force", "--json", "--max-memory", "120MiB"];

impl Folder {
    /// Bakes both meshes. The large one has two bricks.
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

    /// Bakes the large mesh and sends a signal at a moment. Returns whether the signal came in time, and how many
    /// stages had ended.
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
        let text = fs::read_to_string(&said).unwrap();
        fs::remove_file(said).unwrap();
        let (stages, others): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with('{'));
        let stopped = format!("cbvh: stopped by SIG{}; no unfinished file was left behind", &signal[1..]);
        assert!(others.is_empty() || others == [&stopped[..]], "{signal}: {text}");
        let stages = stages.len();
        (!status.success(), stages)
    }

    /// Checks that the output is completely the old one or the new one, and puts the old one back.
    fn check_output(&self, what: &str) {
        let output = self.path().join("out.cbvh");
        cbvh_in(self.path(), &["validate", "out.cbvh"]).done();
        let found = fs::read(&output).unwrap();
        assert!(found == self.old || found == self.new, "{what}: neither the old output nor the new one");
        fs::write(&output, &self.old).unwrap();
    }
}

/// Ends bakes with a signal at moments throughout the bake.
fn end_with(signal: &str, seed: u64, leaves_nothing: bool) {
    let mut folder = Folder::new();
    let (mut ended, mut stages) = (0, BTreeSet::new());
    let moments = moments(seed);
    for &moment in &moments {
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
        // The next bake of this output removes everything that was left behind.
        folder.bake_small();
        assert_eq!(names(folder.path()), USUAL, "{what}");
        assert!(fs::read(folder.path().join("out.cbvh")).unwrap() == folder.old, "{what}");
    }
    // Bakes take different times, so that a signal may come too late.
    assert!(4 * ended >= moments.len(), "only {ended} were ended before they were done");
    assert!(stages.len() >= 2 || !differ(&moments), "all in the stages {stages:?}");
}

#[test]
fn a_bake_that_is_killed_leaves_nothing_for_good() {
    end_with("-KILL", 1, false);
}

#[test]
fn a_bake_that_is_told_to_end_leaves_nothing() {
    end_with("-TERM", 2, true);
}

/// A process that is killed at the worst moment may leave a scratch file. The next bake removes it, even if that bake
/// needs no scratch file itself.
#[test]
fn scratch_files_that_kept_their_names_are_removed() {
    let directory = &place();
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
