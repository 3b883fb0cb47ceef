//! Baking within a budget of memory: the same bytes, the memory promised, and nothing left whatever happens.
#![cfg(target_os = "linux")]

mod common;

use common::sheet::write_sheet;
use common::{cbvh_in, names};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn bake(directory: &Path, input: &str, more: &[&str]) -> Value {
    let arguments = [&["bake", input, "-o", "out.cbvh", "--json", "-q", "--force"], more].concat();
    cbvh_in(directory, &arguments).done().json()
}

#[test]
fn budgets_jobs_and_formats_do_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    // Three bricks.
    let side = 500;
    let mut all = Vec::new();
    for input in ["sheet.stl", "sheet.ply", "sheet.obj"] {
        write_sheet(&directory.join(input), side);
        for more in [&[][..], &["--max-memory", "140MiB", "--jobs", "1"], &["--max-memory", "1GiB"]] {
            let baked = bake(directory, input, more);
            all.push((baked["content_xxh3"].clone(), baked["vertices"].clone()));
            if more.contains(&"140MiB") {
                assert!(baked["scratch_written_bytes"].as_u64().unwrap() > 0, "{baked}");
            }
        }
    }
    assert_eq!(all[0].1, (side + 1).pow(2));
    assert!(all.iter().all(|one| *one == all[0]), "{all:?}");
    assert_eq!(names(directory), ["out.cbvh", "sheet.obj", "sheet.ply", "sheet.stl"]);
}

#[test]
fn memory_stays_within_the_budget() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    write_sheet(&directory.join("sheet.stl"), 1000);
    let (mut contents, mut jobs) = (Vec::new(), ["1", "2"].into_iter().cycle());
    for mebibytes in [128, 200, 512] {
        let budget = format!("{mebibytes}MiB");
        let more = ["--max-memory", &budget, "--jobs", jobs.next().unwrap(), "--scratch", "."];
        let baked = bake(directory, "sheet.stl", &more);
        let peak = baked["peak_rss_bytes"].as_u64().unwrap();
        assert!(peak <= mebibytes << 20, "{peak} bytes, not {budget}");
        contents.push(baked["content_xxh3"].clone());
    }
    assert!(contents.iter().all(|content| *content == contents[0]), "{contents:?}");
    let refused =
        cbvh_in(directory, &["bake", "sheet.stl", "-o", "out.cbvh", "--force", "--max-memory", "64MiB"]);
    refused.failed(4, &["sheet.stl", "67108864 bytes of memory", "2000000 triangles", "at least"]);
}

fn start(directory: &Path, input: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_cbvh"))
        .args(["bake", input, "-o", "out.cbvh", "--force", "--max-memory", "200MiB"])
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn send(child: &Child, signal: &str) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

#[test]
fn a_bake_that_is_ended_leaves_nothing_for_good() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    write_sheet(&directory.join("large.stl"), 500);
    write_sheet(&directory.join("small.stl"), 2);
    bake(directory, "small.stl", &[]);
    let old = fs::read(directory.join("out.cbvh")).unwrap();
    let usual = ["large.stl", "out.cbvh", "small.stl"];
    let whole = || {
        cbvh_in(directory, &["validate", "out.cbvh"]).done();
        fs::read(directory.join("out.cbvh")).unwrap() == old
    };
    let mut ended = 0;
    for moment in 0..12u64 {
        for signal in ["-TERM", "-KILL"] {
            let mut child = start(directory, "large.stl");
            std::thread::sleep(Duration::from_millis(1 + 97 * moment));
            let running = child.try_wait().unwrap().is_none();
            if running {
                send(&child, signal);
            }
            let status = child.wait().unwrap();
            ended += usize::from(!status.success());
            if signal == "-TERM" {
                assert_eq!(names(directory), usual, "{moment}");
            }
            if !whole() {
                // Done before the signal came.
                fs::write(directory.join("out.cbvh"), &old).unwrap();
            }
            // The next bake of this output removes what there may be.
            bake(directory, "small.stl", &["--max-memory", "100MiB"]);
            assert_eq!(names(directory), usual, "{signal} {moment}");
            assert!(whole());
        }
    }
    assert!(ended >= 4, "only {ended} were ended before they were done");
}

#[test]
fn a_full_disk_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    write_sheet(&directory.join("large.stl"), 400);
    write_sheet(&directory.join("small.stl"), 2);
    bake(directory, "small.stl", &[]);
    let old = fs::read(directory.join("out.cbvh")).unwrap();
    // No file may grow beyond so many units of 512 bytes: scratch files first, then the output.
    for units in [0, 8, 1000, 10_000, 20_000, 24_000, 28_000] {
        let command = format!(
            "trap '' XFSZ; ulimit -f {units}; \
             exec {} bake large.stl -o out.cbvh --force --max-memory 130MiB",
            env!("CARGO_BIN_EXE_cbvh")
        );
        let ended = Command::new("sh").args(["-c", &command]).current_dir(directory).output().unwrap();
        let said = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(2), "{units}: {said}");
        assert!(said.lines().count() == 1 && said.contains("cannot"), "{units}: {said}");
        assert_eq!(names(directory), ["large.stl", "out.cbvh", "small.stl"]);
        assert_eq!(fs::read(directory.join("out.cbvh")).unwrap(), old);
    }
}
