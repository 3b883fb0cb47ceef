//! Stops bakes, or lets them run out of disk, at several moments. Afterwards the output is completely the old one or
//! completely the new one, and nothing else stays for good.

// Needs commands and mounts of Linux.
#[cfg(target_os = "linux")]
mod disks;

use crate::common::sheet::write_sheet;
use crate::common::{cbvh_in, names, place, skip};
use cbvh_testkit::Random;
use cbvh_testkit::depth::rounds;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
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
            if signal == "-KILL" {
                child.kill().unwrap();
            } else {
                let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
                assert!(sent.success());
            }
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

/// Ends bakes with signals, one after the other, at moments throughout the bake.
fn end_with(signals: &[&str], seed: u64, leaves_nothing: bool) {
    let mut folder = Folder::new();
    let (mut ended, mut stages) = (0, BTreeSet::new());
    let moments = moments(seed);
    for (&moment, signal) in moments.iter().zip(signals.iter().cycle()) {
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
    end_with(&["-KILL"], 1, false);
}

#[cfg(unix)]
#[test]
fn a_bake_that_is_told_to_end_leaves_nothing() {
    end_with(&["-TERM", "-INT", "-HUP"], 2, true);
}

/// Sends a hangup to a bake that waits for a pipe. If the bake is to ignore it, the pipe then gets a mesh.
#[cfg(unix)]
fn hang_up(is_ignored: bool) -> (std::process::ExitStatus, String) {
    let directory = &place();
    assert!(Command::new("mkfifo").arg(directory.join("pipe.stl")).status().unwrap().success());
    let trap = if is_ignored { "trap '' HUP;" } else { "" };
    let bake = Command::new("sh")
        .args(["-c", &format!("{trap} exec \"$0\" bake pipe.stl -o out.cbvh -q"), env!("CARGO_BIN_EXE_cbvh")])
        .current_dir(directory)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // This waits until the bake opens the pipe, long after it has begun to wait for signals.
    let mut pipe = File::options().write(true).open(directory.join("pipe.stl")).unwrap();
    assert!(Command::new("kill").args(["-HUP", &bake.id().to_string()]).status().unwrap().success());
    if is_ignored {
        write_sheet(&directory.join("small.stl"), 2);
        pipe.write_all(&fs::read(directory.join("small.stl")).unwrap()).unwrap();
        drop(pipe);
    }
    let ended = bake.wait_with_output().unwrap();
    (ended.status, String::from_utf8(ended.stderr).unwrap())
}

#[cfg(unix)]
#[test]
fn a_hangup_ends_a_bake_unless_it_is_ignored() {
    use std::os::unix::process::ExitStatusExt as _;
    let (ended, said) = hang_up(true);
    assert!(ended.success() && said.is_empty(), "{ended} {said}");
    if Command::new("sh").args(["-c", "kill -HUP $$"]).status().unwrap().success() {
        skip("the tests themselves ignore hangups");
        return;
    }
    let (ended, said) = hang_up(false);
    assert_eq!(said, "cbvh: stopped by SIGHUP; no unfinished file was left behind\n");
    assert_eq!(ended.signal(), Some(1));
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
