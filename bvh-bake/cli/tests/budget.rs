//! Bakes and checks within a memory budget: the results are the same, and the memory stays within the budget.
#![cfg(target_os = "linux")]

mod common;

use common::sheet::write_sheet;
use common::{cbvh_in, names};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

fn bake(directory: &Path, input: &str, more: &[&str]) -> Value {
    let arguments = [&["bake", input, "-o", "out.cbvh", "--json", "-q", "--force"], more].concat();
    cbvh_in(directory, &arguments).done().json()
}

#[test]
fn budgets_jobs_and_formats_do_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    // The mesh has three bricks.
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

/// A sheet and its back: all triangles have duplicates, and only with them is the surface closed.
#[test]
fn memory_stays_within_the_budget_where_all_triangles_have_duplicates() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    write_sheet(&directory.join("sheet.stl"), 600);
    let front = fs::read(directory.join("sheet.stl")).unwrap();
    let triangles = front[84..].as_chunks::<50>().0;
    let mut both = front.clone();
    both[80..84].copy_from_slice(&(2 * triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        both.extend([&triangle[..12], &triangle[24..36], &triangle[12..24], &triangle[36..]].concat());
    }
    fs::write(directory.join("both.stl"), both).unwrap();
    let free = bake(directory, "both.stl", &[]);
    assert_eq!((&free["closed"], &free["triangles"]), (&1.into(), &triangles.len().into()));
    for jobs in ["1", "2"] {
        let baked =
            bake(directory, "both.stl", &["--max-memory", "132MiB", "--jobs", jobs, "--scratch", "."]);
        let peak = baked["peak_rss_bytes"].as_u64().unwrap();
        assert!(peak <= 132 << 20, "{peak} bytes");
        assert_eq!(baked["content_xxh3"], free["content_xxh3"]);
    }
    let checked = ["verify", "out.cbvh", "both.stl", "--json", "--max-memory", "48MiB"];
    assert_eq!(cbvh_in(directory, &checked).done().json()["valid"], true);
    assert_eq!(bake(directory, "sheet.stl", &[])["closed"], 0);
}

#[test]
fn memory_of_checks_stays_within_the_budget() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    write_sheet(&directory.join("sheet.stl"), 1000);
    bake(directory, "sheet.stl", &[]);
    let length = fs::metadata(directory.join("out.cbvh")).unwrap().len();
    let threads = std::thread::available_parallelism().unwrap().get() as u64;
    let within = |arguments: &[&str], mebibytes: u64| {
        let budget = format!("{mebibytes}MiB");
        let told =
            cbvh_in(directory, &[arguments, &["--json", "--max-memory", &budget]].concat()).done().json();
        let peak = told["peak_rss_bytes"].as_u64().unwrap();
        assert!(peak <= mebibytes << 20, "{arguments:?}: {peak} bytes, not {budget}");
        let mut usual = cbvh_in(directory, &[arguments, &["--json"]].concat()).done().json();
        usual["peak_rss_bytes"] = peak.into();
        assert_eq!(told, usual);
    };
    let least = 10 + threads;
    assert!(threads > 16 || length > (5 * least) << 20, "{length} bytes");
    within(&["validate", "out.cbvh"], least);
    within(&["verify", "out.cbvh", "sheet.stl"], 46 + threads);
    // A process with a limited address space cannot hold more memory than that. Each further thread needs only its
    // stack.
    for way in ["--json", "--page 7", "--treelet 9999"] {
        let command = format!("ulimit -v 65536; exec {} dump out.cbvh {way}", env!("CARGO_BIN_EXE_cbvh"));
        let ended = Command::new("sh").args(["-c", &command]).current_dir(directory).output().unwrap();
        let told = String::from_utf8(ended.stdout).unwrap();
        assert_eq!(ended.status.code(), Some(0), "{way}: {}", String::from_utf8_lossy(&ended.stderr));
        let arguments: Vec<&str> = ["dump", "out.cbvh"].into_iter().chain(way.split(' ')).collect();
        assert_eq!(told, cbvh_in(directory, &arguments).done().out);
    }
    assert!(length > 64 << 20);
    // A damaged byte near the end of the file is found.
    let mut bytes = fs::read(directory.join("out.cbvh")).unwrap();
    let at = bytes.len() / 20 * 19;
    bytes[at] ^= 1;
    fs::write(directory.join("out.cbvh"), bytes).unwrap();
    let budget = format!("{least}MiB");
    let damaged = |more: &[&str]| {
        cbvh_in(directory, &[&["validate", "out.cbvh"], more].concat()).failed(3, &["out.cbvh: byte"]).err
    };
    assert_eq!(damaged(&[]), damaged(&["--max-memory", &budget]));
    assert_eq!(names(directory), ["out.cbvh", "sheet.stl"]);
}
