//! Baking and checking within a budget of memory: the same results, the memory promised, and nothing left whatever
//! happens.
#![cfg(target_os = "linux")]

mod common;

use common::{cbvh_in, names};
use serde_json::Value;
use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A bumpy sheet of `side` by `side` squares: vertices that are `f32` numbers, and triangles.
fn sheet(side: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let height = |x: u32, y: u32| (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)) >> 24;
    let at = |i: u32| {
        let (x, y) = (i % (side + 1), i / (side + 1));
        [x as f32, y as f32, height(x, y) as f32 / 256.0]
    };
    let square = |i: u32| {
        let first = i / side * (side + 1) + i % side;
        let [right, up, across] = [first + 1, first + side + 1, first + side + 2];
        [[first, right, across], [first, across, up]]
    };
    ((0..(side + 1).pow(2)).map(at).collect(), (0..side * side).flat_map(square).collect())
}

/// Writes a sheet in the format that the name ends in.
fn write_sheet(path: &Path, side: u32) {
    let (vertices, triangles) = sheet(side);
    let mut file = BufWriter::new(fs::File::create(path).unwrap());
    let mut put = |bytes: &[u8]| file.write_all(bytes).unwrap();
    match path.extension().unwrap().to_str().unwrap() {
        "stl" => {
            put(&[b' '; 80]);
            put(&(triangles.len() as u32).to_le_bytes());
            for triangle in &triangles {
                put(&[0; 12]);
                triangle.iter().flat_map(|&v| vertices[v as usize]).for_each(|c| put(&c.to_le_bytes()));
                put(&[0; 2]);
            }
        }
        "ply" => {
            let head = format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
                 property float z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
                vertices.len(),
                triangles.len()
            );
            put(head.as_bytes());
            vertices.iter().flatten().for_each(|c| put(&c.to_le_bytes()));
            for triangle in &triangles {
                put(&[3]);
                triangle.iter().for_each(|v| put(&v.to_le_bytes()));
            }
        }
        _ => {
            vertices.iter().for_each(|[x, y, z]| put(format!("v {x} {y} {z}\n").as_bytes()));
            triangles.iter().map(|t| t.map(|v| v + 1)).for_each(|[a, b, c]| {
                put(format!("f {a} {b} {c}\n").as_bytes());
            });
        }
    }
    file.flush().unwrap();
}

fn bake(directory: &Path, input: &str, more: &[&str]) -> Value {
    let arguments = [&["bake", input, "-o", "out.cbvh", "--json", "--force"], more].concat();
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
    // Who may not have more addresses than this holds no more memory; a thread has but its stack.
    for way in ["--json", "--page 7", "--treelet 9999"] {
        let command = format!("ulimit -v 65536; exec {} dump out.cbvh {way}", env!("CARGO_BIN_EXE_cbvh"));
        let ended = Command::new("sh").args(["-c", &command]).current_dir(directory).output().unwrap();
        let told = String::from_utf8(ended.stdout).unwrap();
        assert_eq!(ended.status.code(), Some(0), "{way}: {}", String::from_utf8_lossy(&ended.stderr));
        let arguments: Vec<&str> = ["dump", "out.cbvh"].into_iter().chain(way.split(' ')).collect();
        assert_eq!(told, cbvh_in(directory, &arguments).done().out);
    }
    assert!(length > 64 << 20);
    // A damaged byte near the end is found.
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
