//! Bakes many assets: each gets its line, whatever happens to the others, also in shards, twice, and after
//! interruptions.

use crate::common::{Ended, Files as _, cbvh_in, cube, names, place};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Returns a tetrahedron that is a little different for each number.
fn tetrahedron(number: usize) -> String {
    let corners = format!("v 0 0 0\nv {} 0 0\nv 0 1 0\nv 0 0 1\n", number + 1);
    corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
}

/// Writes meshes and a manifest of them. `line` returns the manifest's line for each asset.
fn write_assets(directory: &Path, count: usize, line: impl Fn(usize) -> Value) {
    fs::create_dir_all(directory.join("meshes")).unwrap();
    let mut manifest = String::new();
    for number in 0..count {
        fs::write(directory.join(format!("meshes/{number}.obj")), tetrahedron(number)).unwrap();
        manifest += &format!("{}\n", line(number));
    }
    directory.write("in.jsonl", manifest);
}

fn usual(number: usize) -> Value {
    json!({"input": format!("meshes/{number}.obj"), "output": format!("baked/{number}.cbvh")})
}

fn bake(directory: &Path, out: &str, more: &[&str]) -> Ended {
    let arguments = ["bake", "--manifest", "in.jsonl", "--out-manifest", out, "--json"];
    cbvh_in(directory, &[&arguments[..], more].concat())
}

fn lines(path: &Path) -> Vec<Value> {
    let text = fs::read_to_string(path).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[track_caller]
fn counts(summary: &Value, assets: u64, done: u64, skipped: u64, failed: u64) {
    let found = ["assets", "done", "skipped", "failed"].map(|field| summary[field].as_u64().unwrap());
    assert_eq!(found, [assets, done, skipped, failed], "{summary}");
}

#[test]
fn ten_broken_ones_do_not_stop_a_thousand() {
    let directory = &place();
    write_assets(directory, 1000, usual);
    let is_broken = |number: usize| number % 100 == 7;
    for number in (0..1000).filter(|&number| is_broken(number)) {
        let path = directory.join(format!("meshes/{number}.obj"));
        match number {
            // One failure is the system's, among failures of the input.
            107 => fs::remove_file(path).unwrap(),
            207 => fs::write(path, "").unwrap(),
            _ => fs::write(path, tetrahedron(number) + "f 1 2 99\n").unwrap(),
        }
    }
    let run = |done: u64, skipped: u64| {
        let ended = bake(directory, "out.jsonl", &[]);
        assert_eq!(ended.code, 3, "{}", ended.err);
        counts(&ended.json(), 1000, done, skipped, 10);
        assert_eq!(ended.json()["exit_codes"], json!({"2": 1, "3": 9}));
        assert_eq!(ended.json()["triangles"], 990 * 4);
        assert_eq!(ended.err.lines().count(), 11, "{}", ended.err);
        assert!(ended.err.ends_with("cbvh: 10 of 1000 assets failed, see out.jsonl\n"), "{}", ended.err);
        let lines = lines(&directory.join("out.jsonl"));
        assert_eq!(lines.len(), 1000);
        for (number, line) in lines.iter().enumerate() {
            assert_eq!(line["line"], number + 1);
            assert_eq!(line["input"], format!("meshes/{number}.obj"));
            assert_eq!(line["output"], format!("baked/{number}.cbvh"));
            if is_broken(number) {
                let (error, code) = (line["error"].as_str().unwrap(), if number == 107 { 2 } else { 3 });
                assert!(error.contains(&format!("meshes/{number}.obj: ")), "{error}");
                assert!(ended.err.contains(&format!("cbvh: {error}\n")), "{error}");
                assert_eq!(line["exit_code"], code);
            } else {
                assert_eq!((&line["exit_code"], &line["triangles"]), (&json!(0), &json!(4)), "{line}");
                assert_eq!(line["skipped"], skipped > 0);
                assert!(line["error"].is_null());
            }
        }
        lines
    };
    let first = run(990, 0);
    let again = run(0, 990);
    assert!(first.iter().zip(&again).all(|(a, b)| a["content_xxh3"] == b["content_xxh3"]));
    assert_eq!(names(&directory.join("baked")).len(), 990);
    assert_eq!(names(directory), ["baked", "in.jsonl", "meshes", "out.jsonl"]);
    // Only assets that changed are baked again.
    directory.write("meshes/5.obj", tetrahedron(5000));
    fs::remove_file(directory.join("baked/6.cbvh")).unwrap();
    let lines = run_counts(directory, 2, 988);
    assert_eq!((&lines[5]["skipped"], &lines[4]["skipped"]), (&json!(false), &json!(true)));
}

fn run_counts(directory: &Path, done: u64, skipped: u64) -> Vec<Value> {
    let ended = bake(directory, "out.jsonl", &["-q"]);
    counts(&ended.json(), 1000, done, skipped, 10);
    lines(&directory.join("out.jsonl"))
}

#[test]
fn bytes_are_those_of_single_bakes() {
    let directory = &place();
    let options: [(Value, &[&str]); 9] = [
        (json!({"topology": false}), &["--no-ids", "--no-topology"]),
        (json!({}), &["--no-ids"]),
        (json!({"ids": true}), &[]),
        (json!({"scene": true}), &["--no-ids", "--scene"]),
        (
            json!({"profile": "dop6-u8", "triangles": "packed"}),
            &["--no-ids", "--profile", "dop6-u8", "--triangles", "packed"],
        ),
        (
            json!({"triangles": "quantized", "max_error": 0.01}),
            &["--no-ids", "--triangles", "quantized", "--max-error", "0.01"],
        ),
        (
            json!({"split_objects": true, "effort": "quick"}),
            &["--no-ids", "--split-objects", "--effort", "quick"],
        ),
        (json!({"split_objects": false, "effort": "quick"}), &["--no-ids", "--effort", "quick"]),
        (json!({"round": "f32"}), &["--no-ids", "--round", "f32"]),
    ];
    let line = |number: usize| {
        let mut line = usual(number);
        let more = options[number].0.as_object().unwrap().clone();
        line.as_object_mut().unwrap().extend(more);
        line
    };
    write_assets(directory, options.len(), line);
    for more in [&["--no-ids"][..], &["--no-ids", "--force", "--max-memory", "64MiB", "--jobs", "3"]] {
        let summary = bake(directory, "out.jsonl", more).done().json();
        counts(&summary, 9, 9, 0, 0);
        for (number, (_, arguments)) in options.iter().enumerate() {
            let input = format!("meshes/{number}.obj");
            let single = [&["bake", &input, "-o", "single.cbvh", "--json", "-q"], *arguments].concat();
            let report = cbvh_in(directory, &single).done().json();
            let line = &lines(&directory.join("out.jsonl"))[number];
            assert_eq!(line["content_xxh3"], report["content_xxh3"]);
            assert!(
                report
                    .as_object()
                    .unwrap()
                    .keys()
                    .all(|field| !line[field].is_null() || report[field].is_null())
            );
            let baked = fs::read(directory.join(format!("baked/{number}.cbvh"))).unwrap();
            assert!(baked == fs::read(directory.join("single.cbvh")).unwrap(), "{arguments:?}");
        }
    }
}

const PLY_TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

#[test]
fn a_folder_is_baked_as_a_tree() {
    let directory = &place();
    fs::create_dir_all(directory.join("in/deep/er")).unwrap();
    for name in ["in/a.obj", "in/deep/b.OBJ", "in/deep/er/c.obj"] {
        directory.write(name, cube());
    }
    directory.write("in/deep/notes.txt", "no mesh");
    let summary = directory.cbvh("bake in -o out --json --out-manifest o.jsonl").done();
    counts(&summary.json(), 3, 3, 0, 0);
    for name in ["out/a.cbvh", "out/deep/b.cbvh", "out/deep/er/c.cbvh"] {
        cbvh_in(directory, &["verify", name, "in/a.obj"]).done();
    }
    assert_eq!(names(&directory.join("out/deep")), ["b.cbvh", "er"]);
    let outputs: Vec<_> =
        lines(&directory.join("o.jsonl")).iter().map(|line| line["output"].clone()).collect();
    let native = |path: &str| path.replace('/', std::path::MAIN_SEPARATOR_STR);
    assert_eq!(outputs, ["out/a.cbvh", "out/deep/b.cbvh", "out/deep/er/c.cbvh"].map(native));
    let text = directory.cbvh("bake in -o out").done().out;
    assert!(text.starts_with("3 assets: 0 baked, 3 up to date, 0 failed\n"), "{text}");
    // One part in two formats: both are baked, under names of their own, and so is everything else.
    fs::remove_file(directory.join("out/a.cbvh")).unwrap();
    directory.write("in/a.ply", PLY_TRIANGLE);
    let summary = directory.cbvh("bake in -o out --json").done();
    counts(&summary.json(), 4, 2, 2, 0);
    assert_eq!(names(&directory.join("out")), ["a.obj.cbvh", "a.ply.cbvh", "deep"]);
    for (output, input) in [("out/a.obj.cbvh", "in/a.obj"), ("out/a.ply.cbvh", "in/a.ply")] {
        cbvh_in(directory, &["verify", output, input]).done();
    }
    directory.write("in/a.ply", "");
    let ended = directory.cbvh("bake in -o out --json");
    counts(&ended.json(), 4, 0, 3, 1);
    assert_eq!(ended.code, 3, "{ended:?}");
    let told: Vec<&str> = ended.err.lines().collect();
    assert!(told.len() == 2 && told[0].contains(&native("in/a.ply")), "{ended:?}");
    assert_eq!(told[1], "cbvh: 1 of 4 assets failed");
    directory.cbvh("bake in -o o.jsonl").failed(1, &["o.jsonl", "expected a folder"]);
    fs::create_dir(directory.join("empty")).unwrap();
    directory.cbvh("bake empty -o out").failed(2, &["empty: expected a mesh or a folder with"]);
}

#[test]
fn shards_are_parts_of_the_whole() {
    let directory = &place();
    write_assets(directory, 20, usual);
    directory.write("meshes/13.obj", "f 1 2 3\n");
    let mut seen = BTreeSet::new();
    let (mut assets, mut bytes) = (0, 0);
    for index in 1..=3 {
        let shard = format!("{index}/3");
        let out = format!("out.{index}.jsonl");
        let ended = bake(directory, &out, &["--shard", &shard]);
        let summary = ended.json();
        assert_eq!(summary["shard"], shard);
        assets += summary["assets"].as_u64().unwrap();
        bytes += summary["file_bytes"].as_u64().unwrap();
        for line in lines(&directory.join(out)) {
            let number = line["line"].as_u64().unwrap();
            assert_eq!(number % 3, index % 3);
            assert!(seen.insert(number));
        }
    }
    assert_eq!((assets, seen.len()), (20, 20));
    let whole = bake(directory, "out.jsonl", &[]);
    assert_eq!(whole.code, 3);
    counts(&whole.json(), 20, 0, 19, 1);
    assert_eq!(whole.json()["file_bytes"], bytes);
    counts(&bake(directory, "none.jsonl", &["--shard", "30/30"]).done().json(), 0, 0, 0, 0);
    assert_eq!(directory.text("none.jsonl"), "");
    for shard in ["0/3", "4/3", "1", "a/b"] {
        bake(directory, "out.jsonl", &["--shard", shard]).failed(1, &["--shard", "I from 1 to N"]);
    }
    directory.cbvh("bake meshes/1.obj -o o.cbvh --shard 1/2").failed(1, &["--shard"]);
}

/// Runs the second example of `many-assets.md`, which must be in that file exactly as it is run here.
#[cfg(unix)]
#[test]
fn shards_run_side_by_side_under_xargs() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("many-assets.md")).unwrap();
    let block = page.split("```sh\n").find(|block| block.contains("xargs")).unwrap();
    let script = block.split("```").next().unwrap();
    let directory = &place();
    write_assets(directory, 30, usual);
    let command = Path::new(env!("CARGO_BIN_EXE_cbvh"));
    let mut path = command.parent().unwrap().as_os_str().to_owned();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap());
    let run = |expected: bool| {
        let ended = Command::new("sh")
            .args(["-ec", script])
            .env("PATH", &path)
            .current_dir(directory)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert_eq!(ended.status.success(), expected, "{ended:?}");
    };
    run(true);
    let lines = lines(&directory.join("out.jsonl"));
    let numbers: BTreeSet<_> = lines.iter().map(|line| line["line"].as_u64().unwrap()).collect();
    assert_eq!((lines.len(), numbers.len()), (30, 30));
    assert_eq!(names(&directory.join("baked")).len(), 30);
    let summaries = directory.text("summaries.jsonl");
    assert_eq!(summaries.lines().count(), 4);
    directory.write("meshes/3.obj", "");
    run(false);
}

#[test]
fn two_assets_with_one_output_are_refused_before_the_work() {
    let directory = &place();
    fs::create_dir(directory.join("there")).unwrap();
    for (a, b) in
        [("o.cbvh", "o.cbvh"), ("new/o.cbvh", "./new/x/../o.cbvh"), ("there/o.cbvh", "there/../there/o.cbvh")]
    {
        let output = |number| {
            if number == 1 {
                a.into()
            } else if number == 3 {
                b.into()
            } else {
                format!("{number}")
            }
        };
        let line = |number| json!({"input": format!("meshes/{number}.obj"), "output": output(number)});
        write_assets(directory, 5, line);
        // The whole manifest is checked, whatever the shard.
        for more in [&[][..], &["--shard", "1/5"]] {
            bake(directory, "out.jsonl", more).failed(3, &["o.cbvh", "by asset 2 (", "and by asset 4 ("]);
        }
    }
    for (output, words) in [("meshes/0.obj", "an input that no asset writes"), ("in.jsonl", "the manifest")] {
        write_assets(directory, 2, |number| match number {
            1 => json!({"input": "meshes/1.obj", "output": output}),
            _ => usual(number),
        });
        bake(directory, "out.jsonl", &[]).failed(3, &[output, words, "asset 2"]);
    }
    bake(directory, "in.jsonl", &[]).failed(1, &["in.jsonl", "other than the manifest"]);
    assert_eq!(names(directory), ["in.jsonl", "meshes", "there"]);
}

#[test]
fn an_asset_that_is_its_own_output_fails_alone() {
    let directory = &place();
    write_assets(directory, 3, |number| match number {
        1 => json!({"input": "meshes/1.obj", "output": "meshes/1.obj"}),
        _ => usual(number),
    });
    let ended = bake(directory, "out.jsonl", &[]);
    assert_eq!(ended.code, 1, "{ended:?}");
    counts(&ended.json(), 3, 2, 0, 1);
    assert_eq!(directory.text("meshes/1.obj"), tetrahedron(1));
}

#[test]
fn a_wrong_line_is_told_by_its_number() {
    let directory = &place();
    for (wrong, words) in [
        ("{", "column 1"),
        ("[1]", "input"),
        ("\"a.obj\"", "expected"),
        (r#"{"input": "a.obj"}"#, "missing field `output`"),
        (r#"{"input": "a.obj", "output": 3}"#, "invalid type"),
        (r#"{"input": "", "output": "b"}"#, "empty"),
        (r#"{"input": "a", "output": "b", "jobs": 3}"#, "unknown field `jobs`"),
        (r#"{"input": "a", "output": "b", "profile": "dop7"}"#, "profile: expected auto, dop14-u8"),
        (r#"{"input": "a", "output": "b", "triangles": "f64"}"#, "triangles: expected auto, f32"),
        (r#"{"input": "a", "output": "b", "effort": "low"}"#, "effort: expected quick"),
        (r#"{"input": "a", "output": "b", "round": "f16"}"#, "round: expected none or f32"),
        (r#"{"input": "a", "output": "b", "max_error": 0.1}"#, "quantized"),
        (r#"{"input": "a", "output": "b", "triangles": "quantized", "max_error": -1}"#, "above 0"),
        (r#"{"input": "a", "output": "b"} {}"#, "trailing"),
    ] {
        let manifest = format!("{}\n\n{wrong}\n{}\n", usual(0), usual(1));
        directory.write("in.jsonl", manifest);
        bake(directory, "out.jsonl", &[]).failed(3, &["in.jsonl: line 3: ", words]);
    }
    directory.write("in.jsonl", b"{\"input\": \"\xff\", \"output\": \"b\"}\n");
    bake(directory, "out.jsonl", &[]).failed(3, &["in.jsonl: line 1: "]);
    directory.write("in.jsonl", "");
    counts(&bake(directory, "out.jsonl", &[]).done().json(), 0, 0, 0, 0);
    fs::remove_file(directory.join("in.jsonl")).unwrap();
    bake(directory, "out.jsonl", &[]).failed(2, &["in.jsonl"]);
    directory.cbvh("bake --manifest in.jsonl").failed(1, &["--out-manifest"]);
    directory.cbvh("bake a.obj --manifest in.jsonl --out-manifest o").failed(1, &["--manifest"]);
    directory.cbvh("bake a.obj").failed(1, &["--output"]);
}

#[test]
fn only_the_systems_faults_are_exit_code_2_and_limits_4() {
    let directory = &place();
    write_assets(directory, 3, usual);
    fs::remove_file(directory.join("meshes/1.obj")).unwrap();
    let ended = bake(directory, "out.jsonl", &[]);
    assert_eq!(ended.code, 2, "{ended:?}");
    counts(&ended.json(), 3, 2, 0, 1);
    let ended = bake(directory, "out.jsonl", &["--force", "--max-memory", "1MiB"]);
    assert_eq!(ended.code, 4, "{ended:?}");
    // The lack of memory is found before the missing file.
    counts(&ended.json(), 3, 0, 0, 3);
    assert!(ended.err.contains("bytes of memory"), "{ended:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn memory_of_all_stays_within_the_budget() {
    let directory = &place();
    write_assets(directory, 60, usual);
    // A few large meshes among small ones.
    let side = 300;
    let mut large = String::new();
    (0..side * side).for_each(|i| large += &format!("v {} {} {}\n", i % side, i / side, i % 7));
    for i in (0..side * (side - 1)).filter(|i| i % side + 1 < side) {
        large += &format!("f {} {} {} {}\n", i + 1, i + 2, i + side + 2, i + side + 1);
    }
    [3, 4, 20, 40].iter().for_each(|n| fs::write(directory.join(format!("meshes/{n}.obj")), &large).unwrap());
    let summary = bake(directory, "out.jsonl", &["--max-memory", "128MiB", "--jobs", "4"]).done().json();
    counts(&summary, 60, 60, 0, 0);
    let peak = summary["peak_rss_bytes"].as_u64().unwrap();
    assert!(peak <= 128 << 20, "{peak}");
}

#[test]
fn what_is_done_when_the_process_is_killed_stays_done() {
    let directory = &place();
    write_assets(directory, 600, usual);
    let part = directory.join("out.jsonl.part");
    let mut told = 0;
    for signal in ["-KILL", "-TERM"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_cbvh"))
            .args(["bake", "--manifest", "in.jsonl", "--out-manifest", "out.jsonl", "--jobs", "1", "-q"])
            .current_dir(directory)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let whole_lines = || fs::read_to_string(&part).unwrap_or_default().matches('\n').count();
        let (start, before) = (Instant::now(), told);
        while whole_lines() < before + 20 {
            assert!(start.elapsed() < Duration::from_secs(20), "no progress");
            assert!(child.try_wait().unwrap().is_none(), "done before it could be killed");
            std::thread::sleep(Duration::from_millis(1));
        }
        // Windows has no signals: both processes are ended like the first.
        if signal == "-KILL" || cfg!(windows) {
            child.kill().unwrap();
        } else {
            assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        }
        assert!(!child.wait().unwrap().success());
        assert!(!directory.join("out.jsonl").exists());
        told = whole_lines();
    }
    // The file has the lines of both runs, and the last line of each run may be cut off.
    let left = fs::read_to_string(&part).unwrap();
    let done: BTreeSet<_> = left
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .map(|line| line["line"].as_u64().unwrap())
        .collect();
    assert!(done.len() >= 20 && done.len() < 600, "{}", done.len());
    let summary = bake(directory, "out.jsonl", &[]).done().json();
    let skipped = summary["skipped"].as_u64().unwrap();
    assert!(skipped >= done.len() as u64, "{summary}");
    counts(&summary, 600, 600 - skipped, skipped, 0);
    let lines = lines(&directory.join("out.jsonl"));
    assert_eq!(lines.len(), 600);
    assert!(done.iter().all(|&line| lines[line as usize - 1]["skipped"] == true));
    assert_eq!(names(directory), ["baked", "in.jsonl", "meshes", "out.jsonl"]);
    // No half-written output is left either.
    assert_eq!(names(&directory.join("baked")).len(), 600);
}
