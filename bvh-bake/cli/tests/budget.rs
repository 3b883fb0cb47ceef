//! Baking within a budget of memory: the same bytes, and the memory promised.
#![cfg(target_os = "linux")]

mod common;

use common::sheet::write_sheet;
use common::{cbvh_in, names};
use serde_json::Value;
use std::path::Path;

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
