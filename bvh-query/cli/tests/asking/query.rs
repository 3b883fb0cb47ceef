//! Tests query on small meshes: the protocol, and that answers do not depend on how they are found.

use crate::common::{
    Files as _, Place, backends, cbvh_in, cbvh_with_isa, cube, cube_at, names, place, poses, torus,
};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn world() -> Place {
    let place = place();
    let directory = &place;
    directory.write("cube.obj", cube());
    directory.write("torus.obj", torus(48, 24));
    directory.write("near.txt", poses(60, 0.0, 6.0));
    directory.write("far.x.txt", poses(7, 9.0, 12.0));
    for mesh in ["cube", "torus"] {
        let (input, output) = (format!("{mesh}.obj"), format!("{mesh}.cbvh"));
        cbvh_in(directory, &["bake", &input, "-o", &output, "-q"]).done();
    }
    place
}

fn ask(directory: &Path, more: &[&str]) -> Vec<Value> {
    let query = ["query", "torus.cbvh", "cube.cbvh", "near.txt,far.x.txt"];
    cbvh_in(directory, &[&query[..], &["--bench"], more].concat()).done().json_lines()
}

#[test]
fn lines_have_the_fields_of_the_contract() {
    let folder = world();
    let lines = ask(&folder, &["--mode", "distance"]);
    assert_eq!(lines.len(), 2);
    let [near, far] = &lines[..] else { panic!("{lines:?}") };
    assert_eq!((&near["poses"], &far["poses"]), (&"near".into(), &"far.x".into()));
    assert_eq!((&near["peer"], &near["mode"]), (&"cbvh".into(), &"distance".into()));
    assert_eq!((&near["tris_a"], &near["tris_b"]), (&2304.into(), &12.into()));
    assert_eq!((&near["queries"], &near["requested"], &far["queries"]), (&60.into(), &60.into(), &7.into()));
    assert_eq!(far["positives"], 0);
    for field in [
        "build_a_s",
        "build_b_s",
        "total_s",
        "query_sum_s",
        "ns_median",
        "ns_mean",
        "ns_p10",
        "ns_p90",
        "ns_max",
        "positives",
        "sum",
        "node_tests",
        "triangle_tests",
        "exact_tests",
        "file_bytes_per_tri",
    ] {
        assert!(near[field].as_f64().is_some_and(|value| value >= 0.0), "{field}: {near}");
    }
    assert!(["version", "isa", "profile", "triangle_encoding"].iter().all(|field| near[field].is_string()));
    assert_eq!(near["answers_xxh3"].as_str().map(str::len), Some(16));
    assert!(near["ns_p10"].as_u64() <= near["ns_median"].as_u64());
    assert!(near["ns_median"].as_u64() <= near["ns_p90"].as_u64());
    assert!(near["ns_p90"].as_u64() <= near["ns_max"].as_u64());
}

#[test]
fn raw_lines_are_values_and_nanoseconds() {
    let directory = &world();
    let mut sums = Vec::new();
    for (mode, more) in
        [("collide", &[][..]), ("contacts", &[]), ("distance", &[]), ("within", &["--within", "0.5"])]
    {
        let lines = ask(directory, &[&["--mode", mode, "--out", "raw_%s.txt"], more].concat());
        let raw = directory.text("raw_near.txt");
        let values: Vec<f64> = raw
            .lines()
            .map(|line| {
                let (value, nanoseconds) = line.split_once(' ').unwrap();
                nanoseconds.parse::<u64>().unwrap();
                assert!(mode == "distance" || value.parse::<u64>().is_ok(), "{line}");
                value.parse().unwrap()
            })
            .collect();
        assert_eq!(values.len(), 60);
        assert!(
            ["collide", "within"].iter().all(|m| *m != mode) || values.iter().all(|v| *v == 0.0 || *v == 1.0)
        );
        assert!(values.iter().any(|v| *v > 0.0) && values.contains(&0.0), "{mode}: {values:?}");
        assert!((values.iter().sum::<f64>() - lines[0]["sum"].as_f64().unwrap()).abs() < 1e-9);
        sums.push((values, lines[0]["positives"].as_u64().unwrap()));
    }
    let [(collide, hits), (contacts, with), (distance, touching), (within, _)] = &sums[..] else { panic!() };
    assert_eq!((hits, hits), (with, touching));
    for i in 0..60 {
        assert_eq!(collide[i] > 0.0, contacts[i] > 0.0);
        assert_eq!(collide[i] > 0.0, distance[i] == 0.0);
        assert_eq!(within[i] > 0.0, distance[i] <= 0.5);
    }
    assert!(names(directory).contains(&"raw_far.x.txt".to_owned()));
}

#[test]
fn a_relation_tells_what_is_inside() {
    let directory = &place();
    let write = |name: &str, text: &str| directory.write(name, text);
    write("cube.obj", &cube());
    write("room.obj", &cube_at(5, 0));
    write("two.obj", &(cube_at(1, 0) + &cube_at(1, 20)));
    let pose = |x: f64| format!("1 0 0 {x:?} 0 1 0 0 0 0 1 0\n");
    write("poses.txt", &[0.0, 2.5, 4.0, 5.0, 6.0, 6.5, 40.0].map(pose).concat());
    for (a, b, expected, positives) in [
        ("room.obj", "cube.obj", ["3", "3", "0", "0", "0", "1", "1"], 5),
        ("cube.obj", "room.obj", ["2", "2", "0", "0", "0", "1", "1"], 5),
        ("room.obj", "two.obj", ["4", "4", "0", "0", "0", "1", "1"], 5),
        ("cube.obj", "cube.obj", ["0", "1", "1", "1", "1", "1", "1"], 1),
    ] {
        let json = directory
            .cbvh(&format!("query {a} {b} poses.txt --mode relation --out raw_%s.txt --bench"))
            .done()
            .json();
        let raw = directory.text("raw_poses.txt");
        let found: Vec<&str> = raw.lines().map(|line| line.split_once(' ').unwrap().0).collect();
        assert_eq!(found, expected, "{a} {b}");
        assert!(json["mode"] == "relation" && json["positives"] == positives, "{json}");
        // Surfaces alone tell less.
        let collide = cbvh_in(directory, &["query", a, b, "poses.txt", "--bench"]).done().json();
        assert_eq!(collide["positives"], expected.iter().filter(|number| **number == "0").count());
    }
    for (a, b, x, words) in [
        ("room.obj", "cube.obj", 1.0, "B inside A\n"),
        ("cube.obj", "room.obj", 1.0, "A inside B\n"),
        ("cube.obj", "room.obj", 4.0, "touching\n"),
        ("cube.obj", "room.obj", 7.0, "apart\n"),
        ("two.obj", "room.obj", 1.0, "not touching, some parts inside the other mesh and some not\n"),
    ] {
        let query = ["query", a, b, "--mode", "relation", "--pose", &pose(x)];
        assert_eq!(cbvh_in(directory, &query).done().out, words);
    }
}

/// How deep, and the move that ends it; nothing where they are apart; no numbers where a mesh is not closed.
#[test]
fn a_penetration_has_bounds_and_the_move_that_ends_it() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.write("open.obj", cube_at(1, 0).trim_end().rsplit_once('\n').unwrap().0);
    let pose = |x: f64| format!("1 0 0 {x:?} 0 1 0 0.25 0 0 1 0.125\n");
    directory.write("poses.txt", [1.5, 2.5, -1.75].map(pose).concat());
    let ask = |more: &str| {
        directory.cbvh(&format!("query cube.obj cube.obj poses.txt --mode penetration{more}")).done()
    };
    let printed = ask("").out;
    let lines: Vec<Vec<f64>> =
        printed.lines().map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect()).collect();
    for (line, depth) in lines.iter().zip([0.5, 0.0, 0.25]) {
        let [lower, upper, x, y, z] = line[..] else { panic!("{printed}") };
        assert!(
            0.3 * depth <= lower && lower <= depth && depth <= upper && upper <= depth + 1e-11,
            "{printed}"
        );
        assert!((x.abs() - upper).abs() < 1e-12 && y.abs() + z.abs() < 1e-12, "{printed}");
    }
    assert!(lines[0][2] > 0.0 && lines[2][2] < 0.0 && printed.lines().nth(1) == Some("0 0 0 0 0"));
    assert_eq!(ask(" --bench").json()["positives"], 2);
    for (record, line) in ask(" --json").json_lines().iter().zip(&lines) {
        assert_eq!((record["lower"].as_f64(), record["upper"].as_f64()), (Some(line[0]), Some(line[1])));
        assert_eq!(record["translation"][0].as_f64(), Some(line[2]));
    }
    let open = directory.cbvh("query open.obj cube.obj poses.txt --mode penetration").done().out;
    assert_eq!(open, "nan nan nan nan nan\n".repeat(3));
    let words = directory.cbvh("query cube.obj cube.obj --mode penetration").done().out;
    assert!(words.starts_with("depth from ") && words.contains("makes the insides disjoint"), "{words}");
}

/// The distance, or minus the depth, in one number between two bounds; never below 0 where a mesh is open.
#[test]
fn a_signed_distance_is_a_distance_or_minus_a_depth() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.write("open.obj", cube_at(1, 0).trim_end().rsplit_once('\n').unwrap().0);
    let pose = |x: f64| format!("1 0 0 {x:?} 0 1 0 0.25 0 0 1 0.125\n");
    directory.write("poses.txt", [1.5, 2.5, -1.75, 2.0].map(pose).concat());
    let ask =
        |more: &str| directory.cbvh(&format!("query cube.obj cube.obj poses.txt --mode signed{more}")).done();
    let printed = ask("").out;
    let lines: Vec<Vec<f64>> =
        printed.lines().map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect()).collect();
    for (line, expected) in lines.iter().zip([-0.5, 0.5, -0.25, 0.0]) {
        let [lower, upper, x, y, z] = line[..] else { panic!("{printed}") };
        assert!(lower <= expected && expected <= upper && upper - lower < 1e-9, "{printed}");
        let way = if lower < 0.0 { -lower } else { 0.0 };
        assert!((x.abs() - way).abs() < 1e-12 && y.abs() + z.abs() < 1e-12, "{printed}");
    }
    let bench = ask(" --bench").json();
    assert_eq!((&bench["positives"], &bench["mode"]), (&2.into(), &"signed".into()));
    for (record, line) in ask(" --json").json_lines().iter().zip(&lines) {
        assert_eq!((record["lower"].as_f64(), record["upper"].as_f64()), (Some(line[0]), Some(line[1])));
        assert_eq!((record["translation"][0].as_f64(), &record["signed"]), (Some(line[2]), &true.into()));
    }
    let open = directory.cbvh("query open.obj cube.obj poses.txt --mode signed --json").done().json_lines();
    assert!(
        open.iter().all(|record| record["signed"] == false && record["lower"].as_f64() >= Some(0.0)),
        "{open:?}"
    );
    let words = directory.cbvh("query cube.obj cube.obj --mode signed").done().out;
    assert!(
        words.starts_with("signed distance from -2.0") && words.contains("makes the insides disjoint"),
        "{words}"
    );
    let words = directory.cbvh("query open.obj cube.obj --mode signed").done().out;
    assert!(words.contains("there is no depth") && words.contains("A"), "{words}");
}

#[test]
fn answers_do_not_depend_on_how_they_are_found() {
    let directory = &world();
    let backends = backends(directory);
    for mode in ["collide", "contacts", "distance", "within", "relation", "penetration", "signed"] {
        let within: &[&str] = if mode == "within" { &["--within", "0.25"] } else { &[] };
        let hashes = |more: &[&str]| -> Vec<Value> {
            let lines = ask(directory, &[&["--mode", mode], within, more].concat());
            lines.iter().map(|line| line["answers_xxh3"].clone()).collect()
        };
        let expected = hashes(&[]);
        assert!(expected.iter().all(Value::is_string));
        assert_eq!(hashes(&["--jobs", "2"]), expected);
        assert_eq!(hashes(&["--jobs", "7", "--warm", "0"]), expected);
        for isa in &backends {
            assert_eq!(hashes(&["--isa", isa]), expected, "{isa}");
            let query = ["query", "torus.cbvh", "cube.cbvh", "near.txt", "--bench", "--mode", mode];
            let forced = cbvh_with_isa(directory, isa, &[&query[..], within].concat()).done().json();
            assert_eq!((&forced["isa"], &forced["answers_xxh3"]), (&(*isa).into(), &expected[0]));
        }
        // The meshes are baked in memory, with any profile that does not move vertices.
        for profile in ["auto", "dop6-u8", "dop26-u4"] {
            let query = ["query", "torus.obj", "cube.obj", "near.txt", "--mode", mode, "--profile", profile];
            let baked = cbvh_in(directory, &[&query[..], &["--bench"], within].concat()).done().json();
            assert_eq!(baked["answers_xxh3"], expected[0], "{profile}");
        }
    }
}

#[test]
fn limits_and_budgets_cut_runs_short() {
    let directory = &world();
    let limited = ask(directory, &["--limit", "5"]);
    assert_eq!((&limited[0]["queries"], &limited[0]["requested"]), (&5.into(), &5.into()));
    assert!(limited[0]["answers_xxh3"].is_string());
    for jobs in ["1", "2"] {
        let cut = ask(directory, &["--budget", "0", "--out", "cut_%s.txt", "--jobs", jobs]);
        assert_eq!(cut[0]["requested"], 60);
        let answered = cut[0]["queries"].as_u64().unwrap();
        assert!((1..60).contains(&answered) && cut[0]["answers_xxh3"].is_null(), "{cut:?}");
        let raw = directory.text("cut_near.txt");
        assert_eq!(raw.lines().count() as u64, answered);
    }
    let exact = ask(directory, &["--mode", "distance"])[1]["sum"].as_f64().unwrap();
    let rough = &ask(directory, &["--mode", "distance", "--rel-err", "0.5", "--abs-err", "0.1"])[1];
    let sum = rough["sum"].as_f64().unwrap();
    assert!(rough["answers_xxh3"].is_null() && sum >= exact && sum <= 1.5 * exact + 0.7, "{exact} {rough}");
}

#[test]
fn an_object_can_be_named() {
    let directory = &world();
    // The vertex numbers of the second object follow those of the first.
    let shifted: String = torus(48, 24)
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => {
                let numbers = face.split(' ').map(|n| (n.parse::<usize>().unwrap() + 8).to_string());
                format!("f {}\n", numbers.collect::<Vec<_>>().join(" "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    directory.write("both.obj", cube() + &shifted);
    directory.cbvh("bake both.obj -o both.cbvh --split-objects -q").done();
    let ask = |a: &str, more: &[&str]| {
        let query = ["query", a, "cube.cbvh", "near.txt", "--mode", "contacts", "--bench"];
        cbvh_in(directory, &[&query[..], more].concat()).done().json()
    };
    let torus = ask("torus.cbvh", &[]);
    for file in ["both.cbvh", "both.obj"] {
        let named = ask(file, &["--object", "torus"]);
        assert_eq!(named["answers_xxh3"], torus["answers_xxh3"], "{file}");
        assert_eq!(named["tris_a"], 2304);
        assert_eq!(ask(file, &[])["tris_a"], 2316);
    }
    assert_eq!(ask("both.cbvh", &["--object", "cube"])["tris_a"], 12);
}

/// The lines printed are the raw ones without times, whether they go to a file or to a terminal, and `--json` agrees.
#[test]
fn each_pose_has_a_line_and_a_record() {
    let directory = &world();
    for mode in ["collide", "contacts", "distance", "within", "relation"] {
        let within: &[&str] = if mode == "within" { &["--within", "0.5"] } else { &[] };
        let ask = |more: &[&str]| {
            let query = ["query", "torus.cbvh", "cube.cbvh", "near.txt,far.x.txt", "--mode", mode];
            cbvh_in(directory, &[&query[..], within, more].concat()).done()
        };
        let printed = ask(&["--out", "raw_%s.txt"]).out;
        let raw = ["near", "far.x"].map(|stem| {
            let raw = fs::read_to_string(directory.join(format!("raw_{stem}.txt"))).unwrap();
            raw.lines().map(|line| format!("{}\n", line.rsplit_once(' ').unwrap().0)).collect::<String>()
        });
        assert_eq!(printed, raw.concat(), "{mode}");
        let records = ask(&["--json"]).json_lines();
        assert_eq!(records.len(), 67);
        for (number, (record, line)) in records.iter().zip(printed.lines()).enumerate() {
            let (stem, pose) = if number < 60 { ("near", number) } else { ("far.x", number - 60) };
            assert_eq!((&record["poses"], &record["pose"]), (&stem.into(), &pose.into()), "{record}");
            match mode {
                "collide" | "within" => assert_eq!(record[mode], Value::from(line == "1"), "{record}"),
                _ => assert_eq!(record[mode].as_f64(), line.parse().ok(), "{record}"),
            }
            if mode == "contacts" {
                let pairs = record["pairs"].as_array().unwrap();
                assert_eq!(record["contacts"], pairs.len());
                assert!(pairs.iter().all(|pair| pair["triangle_a"].as_u64() < Some(2304)), "{record}");
            }
            if mode == "distance" {
                let at = |name: &str, axis: usize| record[name][axis].as_f64().unwrap();
                let apart: f64 = (0..3)
                    .map(|axis| (at("point_a", axis) - at("point_b", axis)).powi(2))
                    .sum::<f64>()
                    .sqrt();
                let [lower, distance, upper] =
                    ["lower", "distance", "upper"].map(|name| record[name].as_f64());
                assert!(lower <= distance && distance <= upper, "{record}");
                assert!(
                    (apart - distance.unwrap()).abs() < 1e-12 && record["triangle_b"].as_u64() < Some(12)
                );
            }
        }
    }
    let one = directory.cbvh("query cube.cbvh cube.cbvh far.x.txt --json --limit 1");
    assert_eq!(one.done().out, "{\"pose\":0,\"collide\":false}\n");
}

/// Runs the command in `script`, which is a terminal for it.
#[cfg(target_os = "linux")]
#[test]
fn a_terminal_gets_the_lines_of_a_pipe() {
    let directory = &world();
    let command =
        format!("{} query torus.cbvh cube.cbvh near.txt --mode distance", env!("CARGO_BIN_EXE_cbvh"));
    let script = ["-qec", &command, "/dev/null"];
    let shown = std::process::Command::new("script").args(script).current_dir(directory).output();
    let Ok(shown) = shown else { return crate::common::skip("the command `script` is missing") };
    let piped = ["query", "torus.cbvh", "cube.cbvh", "near.txt", "--mode", "distance"];
    let piped = cbvh_in(directory, &piped).done().out;
    assert!(shown.status.success());
    assert_eq!(String::from_utf8(shown.stdout).unwrap().replace("\r\n", "\n"), piped);
}

/// Files whose units differ are pointed out, and the answer stands.
#[test]
fn meshes_of_very_different_size_are_pointed_out() {
    let directory = &place();
    directory.write("cube.obj", cube());
    for (half_side, is_told) in [(999, false), (1001, true)] {
        directory.write("large.obj", cube_at(half_side, 0));
        for (a, b) in [("cube.obj", "large.obj"), ("large.obj", "cube.obj")] {
            let ended = cbvh_in(directory, &["query", a, b, "--mode", "relation"]);
            assert_eq!(ended.code, 0);
            assert_eq!(ended.err.lines().count(), usize::from(is_told), "{}", ended.err);
            let words =
                ["cube.obj is about 2.000 mesh units across", "large.obj", "2002.000", "the same unit"];
            assert!(!is_told || words[1..].iter().all(|word| ended.err.contains(word)), "{}", ended.err);
            assert!(!is_told || a != "cube.obj" || ended.err.contains(words[0]), "{}", ended.err);
        }
    }
}

#[test]
fn one_pose_is_answered_for_a_person() {
    let directory = &world();
    let ask = |pose: &str, more: &[&str]| {
        let query = ["query", "cube.cbvh", "cube.obj", "--pose", pose];
        cbvh_in(directory, &[&query[..], more].concat()).done().out
    };
    let apart = "1 0 0 5  0 1 0 0  0 0 1 0";
    let touching = "1,0,0,2,0,1,0,0,0,0,1,0";
    assert_eq!(ask(apart, &[]), "the meshes do not touch\n");
    assert_eq!(ask(touching, &[]), "the meshes touch\n");
    assert_eq!(ask(apart, &["--json"]), "{\"pose\":0,\"collide\":false}\n");
    let identity = directory.cbvh("query cube.cbvh cube.obj --mode relation").done().out;
    assert_eq!(identity, "touching\n");
    assert!(ask(touching, &["--mode", "contacts"]).contains("pairs of triangles in contact"));
    assert!(ask(apart, &["--mode", "within", "--within", "3"]).contains("at most 3"));
    assert!(ask(apart, &["--mode", "within", "--within", "2.9"]).contains("more than 2.9"));
    assert!(ask(touching, &["--mode", "distance"]).starts_with("distance 0.0 (the meshes touch)"));
    let text = ask(apart, &["--mode", "distance", "--witness", "w.obj"]);
    assert!(
        text.starts_with("distance 3.0\n") && text.contains("on A 1.0") && text.contains("on B 4.0"),
        "{text}"
    );
    let witness = directory.text("w.obj");
    let vertices: Vec<Vec<f64>> = witness
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| line.split(' ').map(|number| number.parse().unwrap()).collect())
        .collect();
    assert_eq!(vertices.len(), 8);
    // Several triangles are at that distance, and any may be named. Each has a corner on the near face.
    let near = |range: std::ops::Range<usize>, x: f64| vertices[range].iter().any(|vertex| vertex[0] == x);
    assert!(near(0..3, 1.0) && near(3..6, 4.0), "{witness}");
    assert_eq!((vertices[6][0], vertices[7][0]), (1.0, 4.0));
    assert_eq!(vertices[6][1..], vertices[7][1..]);
    assert!(
        witness.contains("\nf 1 2 3\n") && witness.contains("\nf 4 5 6\n") && witness.ends_with("l 7 8\n")
    );
}

#[test]
fn a_damaged_file_is_named() {
    let directory = &world();
    let mut bytes = fs::read(directory.join("torus.cbvh")).unwrap();
    let page = 2 * 4096 + 100;
    bytes[page] ^= 1;
    directory.write("bad.cbvh", &bytes);
    for jobs in ["1", "2"] {
        directory
            .cbvh(&format!("query cube.cbvh bad.cbvh near.txt --jobs {jobs}"))
            .failed(3, &["bad.cbvh: byte ", "R15"]);
    }
}
