//! Checks what a bake says about its progress: a line per stage, bytes that add up to what the system counts, and a
//! status line on a terminal only.

use crate::common::sheet::write_sheet;
use crate::common::{Files as _, cbvh_in, cube, names, place};
use serde_json::Value;
use std::fs;
use std::path::Path;

const STAGES: [&str; 6] = ["read", "prepare", "build", "assemble", "prove", "write"];

/// Bakes with `--json`. Returns the lines of the stages, and the summary.
#[track_caller]
fn bake(directory: &Path, inputs: &[&str], more: &[&str]) -> (Vec<Value>, Value) {
    let arguments = [&["bake"], inputs, &["-o", "out.cbvh", "--json", "--force"], more].concat();
    let ended = cbvh_in(directory, &arguments);
    assert_eq!(ended.code, 0, "{ended:?}");
    let lines: Vec<Value> = ended.err.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    check_lines(&lines, &ended.json());
    (lines, ended.json())
}

fn integer(object: &Value, field: &str) -> u64 {
    object[field].as_u64().unwrap_or_else(|| panic!("{field}: {object}"))
}

/// Asserts that the lines are in order and add up to the summary.
#[track_caller]
fn check_lines(lines: &[Value], summary: &Value) {
    assert!(lines.iter().map(|line| line["stage"].as_str().unwrap()).eq(STAGES), "{lines:?}");
    let sum = |field: &str| lines.iter().map(|line| integer(line, field)).sum::<u64>();
    for (field, whole) in [
        ("bytes_read", "bytes_read"),
        ("bytes_written", "bytes_written"),
        ("spilled_bytes", "scratch_written_bytes"),
    ] {
        assert_eq!(sum(field), integer(summary, whole), "{field}: {lines:?} {summary}");
    }
    let of = |fields: &[&str]| fields.iter().map(|field| integer(summary, field)).sum::<u64>();
    let read = ["input_read_bytes", "scratch_read_bytes", "output_read_bytes"];
    assert_eq!(of(&read), integer(summary, "bytes_read"));
    assert_eq!(of(&["scratch_written_bytes", "output_written_bytes"]), integer(summary, "bytes_written"));
    let mut seconds = 0.0;
    let mut peak = 0;
    for (line, stage) in lines.iter().zip(STAGES) {
        let own = line["seconds"].as_f64().unwrap();
        assert_eq!(summary["stage_seconds"][stage], own);
        seconds += own;
        let of_input = ["read", "prepare"].contains(&stage);
        let triangles = integer(summary, if of_input { "triangles_in" } else { "triangles" });
        assert_eq!(line["triangles"], triangles, "{line} {summary}");
        let rate = line["triangles_per_second"].as_f64().unwrap();
        assert!((rate * own - triangles as f64).abs() <= 1e-6 * triangles as f64, "{line}");
        if cfg!(target_os = "linux") {
            assert!(integer(line, "peak_rss_bytes") >= peak.max(integer(line, "resident_bytes")), "{line}");
            peak = integer(line, "peak_rss_bytes");
        }
    }
    assert!(seconds <= summary["seconds"].as_f64().unwrap());
    assert!(peak <= summary["peak_rss_bytes"].as_u64().unwrap_or(0));
}

#[test]
fn bytes_are_those_of_the_files() {
    let directory = &place();
    // The mesh has three bricks.
    for input in ["sheet.stl", "sheet.ply", "sheet.obj"] {
        write_sheet(&directory.join(input), 400);
        let size = fs::metadata(directory.join(input)).unwrap().len();
        let (lines, summary) = bake(directory, &[input], &[]);
        let file = fs::read(directory.join("out.cbvh")).unwrap();
        let (output, head) = (file.len() as u64, 64 + 32 * u64::from(file[12]));
        assert_eq!((integer(&summary, "input_read_bytes"), integer(&lines[0], "bytes_read")), (size, size));
        for field in ["scratch_bytes", "scratch_read_bytes", "scratch_written_bytes"] {
            assert_eq!(integer(&summary, field), 0, "{field}");
        }
        // The header and the section table are written twice. The proof reads the bytes in memory.
        assert_eq!(integer(&summary, "output_written_bytes"), output + head);
        assert_eq!(integer(&summary, "output_read_bytes"), 0);
        let (within, within_summary) = bake(directory, &[input], &["--max-memory", "116MiB", "--jobs", "1"]);
        assert_eq!(integer(&within_summary, "input_read_bytes"), size, "{input}");
        assert_eq!(within_summary["output_written_bytes"], summary["output_written_bytes"]);
        // Within a budget the proof reads the whole file back.
        assert!(integer(&within_summary, "output_read_bytes") >= output - 4096, "{within_summary}");
        let [most, written, read] = ["scratch_bytes", "scratch_written_bytes", "scratch_read_bytes"]
            .map(|field| integer(&within_summary, field));
        assert!(0 < most && most <= written && written <= read, "{within_summary}");
        assert!(integer(&within[0], "spilled_bytes") > 0 && integer(&within[2], "spilled_bytes") > 0);
        assert_eq!(within_summary["content_xxh3"], summary["content_xxh3"]);
    }
}

/// Compares the bytes with those that the kernel counts for all reads and writes of the command.
#[cfg(target_os = "linux")]
#[test]
fn the_system_counts_the_same_bytes() {
    let directory = &place();
    write_sheet(&directory.join("sheet.ply"), 400);
    if fs::read_to_string("/proc/self/io").is_err() {
        return crate::common::skip("this system does not count bytes");
    }
    for more in ["", "--max-memory 140MiB", "--max-memory 1GiB --jobs 1"] {
        // The numbers of a shell include those of its children that have ended.
        let script = format!(
            "{} bake sheet.ply -o out.cbvh --force --json -q {more} > summary && cat /proc/$$/io",
            env!("CARGO_BIN_EXE_cbvh")
        );
        let ended =
            std::process::Command::new("sh").args(["-ec", &script]).current_dir(directory).output().unwrap();
        let counted = String::from_utf8(ended.stdout).unwrap();
        let system = |label: &str| {
            let line = counted.lines().find_map(|line| line.strip_prefix(label));
            line.unwrap_or_else(|| panic!("{counted:?} {more}")).trim().parse::<u64>().unwrap()
        };
        let summary: Value = serde_json::from_str(&directory.text("summary")).unwrap();
        // The system also counts the loading of the program and its messages.
        for (field, label) in [("bytes_read", "rchar:"), ("bytes_written", "wchar:")] {
            let (own, system) = (integer(&summary, field), system(label));
            assert!((own..own + (1 << 18)).contains(&system), "{field}: {own}, system {system}, {more}");
        }
    }
}

#[test]
fn several_objects_and_duplicates_add_up() {
    let directory = &place();
    directory.write("cube.obj", cube() + "f 1 3 4 2\no another\nf 1 3 4 2\nf 5 6 8\nf 5 6 8\n");
    write_sheet(&directory.join("sheet.stl"), 40);
    for more in [&[][..], &["--split-objects"], &["--split-objects", "--max-memory", "100MiB"]] {
        let (_, summary) = bake(directory, &["cube.obj", "sheet.stl", "cube.obj"], more);
        assert_eq!(integer(&summary, "triangles_in"), 3200 + 2 * (14 + 4));
        assert!(integer(&summary, "duplicates") > 0);
    }
    assert_eq!(names(directory), ["cube.obj", "out.cbvh", "sheet.stl"]);
}

#[test]
fn stages_are_told_only_where_they_are_asked_for() {
    let directory = &place();
    directory.write("cube.obj", cube());
    let bake = ["bake", "cube.obj", "-o", "c.cbvh", "--force"];
    for quiet in [&[][..], &["-q"], &["--json", "-q"]] {
        cbvh_in(directory, &[&bake[..], quiet].concat()).done();
    }
    assert_eq!(cbvh_in(directory, &[&bake[..], &["--json"]].concat()).err.lines().count(), STAGES.len());
    // The bake is skipped, so there are no stages. Nor are there stages if several assets are baked in parallel.
    directory.cbvh("bake cube.obj -o c.cbvh --json").done();
    fs::create_dir(directory.join("in")).unwrap();
    ["a.obj", "b.obj"].iter().for_each(|name| fs::write(directory.join("in").join(name), cube()).unwrap());
    directory.cbvh("bake in -o out --json").done();
    // The summary for people tells of scratch files only if there were some.
    assert!(!cbvh_in(directory, &bake).done().out.contains("scratch"));
}

/// Runs the command in `script`, which is a terminal for it.
#[cfg(target_os = "linux")]
#[test]
fn a_terminal_shows_how_far_it_is() {
    let directory = &place();
    write_sheet(&directory.join("sheet.ply"), 500);
    let on_a_terminal = |more: &str| {
        let command = format!(
            "{} bake sheet.ply -o out.cbvh --force --max-memory 140MiB {more}",
            env!("CARGO_BIN_EXE_cbvh")
        );
        let script = ["-qec", &command, "/dev/null"];
        let ended = std::process::Command::new("script").args(script).current_dir(directory).output().ok()?;
        assert!(ended.status.success(), "{ended:?}");
        Some(String::from_utf8(ended.stdout).unwrap())
    };
    let Some(shown) = on_a_terminal("") else {
        return crate::common::skip("the command `script` is missing");
    };
    for words in ["reading", "preparing", "building bricks", " %", " triangles/s", " MiB spilled", "left"] {
        assert!(shown.contains(words), "{words}: {shown}");
    }
    assert_eq!(on_a_terminal("-q").unwrap(), "");
}
