//! Queries files that are not in memory, or only in part: the answers are the same, and the bytes read are as
//! expected.

use crate::common::{Files as _, cbvh_in, torus};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns a folder on a disk, because files of a file system in memory cannot be evicted from the page cache.
fn folder_on_disk() -> tempfile::TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap()
}

/// Writes a sheet of `side` by `side` squares with small waves, as binary STL, and bakes it as `sheet.cbvh`. Bakes
/// also a torus as `torus.cbvh`, and writes poses above the sheet and in it.
fn bake(directory: &Path, side: u32) {
    let height = |x: u32, y: u32| ((x * 7 + y * 13) % 32) as f32 / 64.0;
    let mut stl = vec![b' '; 80];
    stl.extend((2 * side * side).to_le_bytes());
    for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
        for corners in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
            stl.extend([0; 12]);
            for (i, j) in corners {
                let at = [(x + i) as f32, (y + j) as f32, height(x + i, y + j)];
                at.iter().for_each(|value| stl.extend(value.to_le_bytes()));
            }
            stl.extend([0; 2]);
        }
    }
    directory.write("sheet.stl", stl);
    directory.write("torus.obj", torus(40, 30));
    for (mesh, file) in [("sheet.stl", "sheet.cbvh"), ("torus.obj", "torus.cbvh")] {
        cbvh_in(directory, &["bake", mesh, "-o", file, "-q"]).done();
    }
    let place = |at: u32, z: f64| {
        let (x, y) = (f64::from(at * 37 % side), f64::from(at * 101 % side));
        format!("1 0 0 {x:?} 0 1 0 {y:?} 0 0 1 {z:?}\n")
    };
    let lines = (0..6).map(|at| place(at, if at % 2 == 0 { 0.125 } else { 1.5 }));
    directory.write("poses.txt", lines.collect::<String>());
}

fn query(directory: &Path, mode: &str, more: &[&str]) -> Value {
    let arguments =
        [&["query", "sheet.cbvh", "torus.cbvh", "poses.txt", "--bench", "--mode", mode], more].concat();
    cbvh_in(directory, &arguments).done().json()
}

#[test]
fn answers_do_not_depend_on_read_ahead() {
    let folder = folder_on_disk();
    let directory = folder.path();
    bake(directory, 400);
    for mode in ["collide", "distance", "contacts"] {
        let usual = query(directory, mode, &[]);
        assert!((1..6).contains(&usual["positives"].as_u64().unwrap()), "{usual}");
        for how in ["usual", "sparse", "whole"] {
            let other = query(directory, mode, &["--read-ahead", how]);
            for field in ["answers_xxh3", "sum", "positives", "node_tests", "triangle_tests"] {
                assert_eq!(other[field], usual[field], "{mode} {how} {field}");
            }
        }
    }
    directory
        .cbvh("query sheet.cbvh torus.cbvh poses.txt --read-ahead all")
        .failed(1, &["usual", "sparse", "whole"]);
}

/// A group of processes with a common limit on memory, which includes cached pages of files.
struct Limited {
    group: PathBuf,
    /// The name of the file with the most memory that the group used.
    peak: &'static str,
}

impl Limited {
    /// Returns `None` if this process may not make such a group.
    fn new(bytes: u64) -> Option<Self> {
        let name = format!("cbvh-test-{}", std::process::id());
        let second = Path::new("/sys/fs/cgroup").join(&name);
        let first = Path::new("/sys/fs/cgroup/memory").join(&name);
        for (group, limit, peak) in [
            (first, "memory.limit_in_bytes", "memory.max_usage_in_bytes"),
            (second, "memory.max", "memory.peak"),
        ] {
            if !group.parent().unwrap().is_dir() || fs::create_dir(&group).is_err() {
                continue;
            }
            let made = Self { group, peak };
            if fs::write(made.group.join(limit), bytes.to_string()).is_ok() {
                return Some(made);
            }
        }
        None
    }

    /// Runs the command in the group.
    fn cbvh_in(&self, directory: &Path, arguments: &[&str]) -> Value {
        let command = "echo $$ > \"$0\"/cgroup.procs && exec \"$@\"";
        let output = Command::new("sh")
            .args(["-c", command])
            .arg(&self.group)
            .arg(env!("CARGO_BIN_EXE_cbvh"))
            .args(arguments)
            .current_dir(directory)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn peak(&self) -> u64 {
        fs::read_to_string(self.group.join(self.peak)).unwrap().trim().parse().unwrap()
    }
}

impl Drop for Limited {
    fn drop(&mut self) {
        // The group is empty, because the commands have ended.
        let _ = fs::remove_dir(&self.group);
    }
}

#[test]
fn a_file_larger_than_memory_is_queried_rightly() {
    const MOST: u64 = 24 << 20;
    let folder = folder_on_disk();
    let directory = folder.path();
    bake(directory, 900);
    let length = fs::metadata(directory.join("sheet.cbvh")).unwrap().len();
    assert!(length > 3 * MOST, "{length}");
    let Some(limited) = Limited::new(MOST) else {
        return cbvh_testkit::skip("this process cannot create a group with limited memory");
    };
    for mode in ["collide", "distance", "contacts"] {
        let free = query(directory, mode, &[]);
        for more in [&["--read-ahead", "sparse"][..], &[]] {
            // Pages that other processes have read count as theirs, so they are evicted from the page cache first.
            let evict =
                ["of=sheet.cbvh", "oflag=nocache", "conv=notrunc,fdatasync", "count=0", "status=none"];
            assert!(Command::new("dd").args(evict).current_dir(directory).status().unwrap().success());
            let asked = ["query", "sheet.cbvh", "torus.cbvh", "poses.txt", "--bench", "--mode", mode];
            let held = limited.cbvh_in(directory, &[&asked, more].concat());
            for field in ["answers_xxh3", "sum", "positives", "queries"] {
                assert_eq!(held[field], free[field], "{mode} {more:?} {field}");
            }
        }
    }
    let peak = limited.peak();
    assert!(peak <= MOST, "{peak}");
}
