//! Tests `cbvh probe`: the lines and fields of the contract, equal answers however they are found, labelled probes, and bad
//! files.

use crate::common::{
    Files as _, Place, backends, cbvh_in, cbvh_with_isa, cube, cube_at, place, poses, shared, torus,
};
use std::fs;
use std::path::Path;

/// Lines about the cube, with their raw values.
type Asked = &'static [(&'static str, &'static str)];

/// Modes, the positives of each, and what is asked.
const ASKED: [(&str, usize, Asked); 4] = [
    (
        "closest",
        1,
        &[
            ("0 0.25 0", "0.75"),
            ("3 0 0", "2"),
            ("1 0.5 0.25", "0"),
            ("2 2 1", "1.4142135623730951"),
            ("1.1 0 0", "0.10000000000000009"),
        ],
    ),
    ("side", 2, &[("0 0 0", "1"), ("3 0 0", "-1"), ("1 0.5 0.25", "0"), ("0.999 -0.999 0.999", "1")]),
    (
        "ray",
        3,
        &[
            ("-5 0.25 0.5 2 0 0", "2"),
            ("0 0 0 0 0 8", "0.125"),
            ("-5 0.25 0.5 -2 0 0", "-1"),
            ("1 0 0 1 0 0", "0"),
            ("-5 1.5 0 1 0 0", "-1"),
        ],
    ),
    (
        "segment",
        3,
        &[
            ("-5 0 0 5 0 0", "1"),
            ("0 0 0 0.5 0 0", "0"),
            ("1 1 1 2 2 2", "1"),
            ("2 0 0 5 0 0", "0"),
            ("0 -1 0 0 -1 0", "1"),
        ],
    ),
];

/// A cube and a torus, each also baked; and a file of questions about the cube for each mode.
fn world() -> Place {
    let place = place();
    let directory = &place;
    directory.write("cube.obj", cube());
    directory.write("torus.obj", torus(48, 24));
    for mesh in ["cube", "torus"] {
        let (input, output) = (format!("{mesh}.obj"), format!("{mesh}.cbvh"));
        cbvh_in(directory, &["bake", &input, "-o", &output, "-q"]).done();
    }
    for (mode, _, asked) in ASKED {
        let lines = asked.iter().map(|(line, value)| format!("\t{line} # {value} 7\r\n\n"));
        fs::write(directory.join(format!("{mode}.txt")), format!("# x y z\n{}", lines.collect::<String>()))
            .unwrap();
    }
    place
}

/// Returns the values of raw lines.
fn values(raw: &Path) -> Vec<String> {
    let raw = fs::read_to_string(raw).unwrap();
    let lines = raw.lines().map(|line| {
        let (value, nanoseconds) = line.split_once(' ').unwrap();
        nanoseconds.parse::<u64>().unwrap();
        value.to_owned()
    });
    lines.collect()
}

#[test]
fn lines_and_fields_are_those_of_the_contract() {
    let directory = &world();
    for (mode, positives, asked) in ASKED {
        let expected: Vec<&str> = asked.iter().map(|(_, value)| *value).collect();
        for mesh in ["cube.cbvh", "cube.obj"] {
            let file = format!("{mode}.txt");
            let probe = ["probe", mesh, &file, "--mode", mode];
            let printed: String = expected.iter().map(|value| format!("{value}\n")).collect();
            assert_eq!(cbvh_in(directory, &probe).done().out, printed);
            let records = cbvh_in(directory, &[&probe[..], &["--json"]].concat()).done().json_lines();
            assert_eq!(records.len(), expected.len());
            for (number, (record, value)) in records.iter().zip(&expected).enumerate() {
                let found = match mode {
                    "closest" => record["distance"].as_f64(),
                    "ray" => record["t"].as_f64().or(Some(-1.0)),
                    "segment" => record["meets"].as_bool().map(|meets| f64::from(u8::from(meets))),
                    _ => record["side"].as_f64(),
                };
                assert!(record["probe"] == number && found == value.parse().ok(), "{mode}: {record}");
                let has_point = mode == "closest" || record["hit"] == true;
                assert_eq!(record["point"].is_array() && record["triangle"].is_u64(), has_point, "{record}");
            }
            let probe = [&probe[..], &["--out", "raw_%s.txt", "--bench"]].concat();
            let json = cbvh_in(directory, &probe).done().json();
            assert_eq!(values(&directory.join(format!("raw_{mode}.txt"))), expected);
            for (field, value) in [("peer", "cbvh"), ("mode", mode), ("poses", mode)] {
                assert_eq!(json[field], value, "{field}");
            }
            let count = asked.len();
            assert!(json["tris_a"] == 12 && json["jobs"] == 1, "{json}");
            assert!(json["queries"] == count && json["requested"] == count, "{json}");
            assert_eq!(json["positives"], positives, "{mode}");
            let sum: f64 = expected.iter().map(|value| value.parse::<f64>().unwrap()).sum();
            assert!((json["sum"].as_f64().unwrap() - sum).abs() < 1e-12);
            assert_eq!(json["answers_xxh3"].as_str().map(str::len), Some(16));
            assert!(
                ["tris_b", "build_b_s", "api_bytes_per_tri_b"].iter().all(|field| json.get(field).is_none())
            );
        }
    }
}

#[test]
fn answers_do_not_depend_on_how_they_are_found() {
    let directory = &world();
    // The numbers of poses serve as points and rays, too.
    let numbers: Vec<String> = poses(80, -3.0, 3.0)
        .lines()
        .filter(|line| line.len() > 20)
        .map(|line| line.split(' ').skip(2).take(6).collect::<Vec<_>>().join(" "))
        .collect();
    let points: Vec<String> =
        numbers.iter().map(|line| line.split(' ').skip(1).take(3).collect::<Vec<_>>().join(" ")).collect();
    directory.write("lines.txt", numbers.join("\n"));
    directory.write("points.txt", points.join("\n"));
    let backends = backends(directory);
    for mode in ["closest", "side", "ray", "segment"] {
        let file = if ["closest", "side"].contains(&mode) { "points.txt" } else { "lines.txt" };
        let ask = |mesh: &str, more: &[&str]| {
            let probe = ["probe", mesh, file, "--mode", mode, "--bench"];
            cbvh_in(directory, &[&probe[..], more].concat()).done().json()["answers_xxh3"].clone()
        };
        let expected = ask("torus.cbvh", &["--out", "raw.txt"]);
        let mut found = values(&directory.join("raw.txt"));
        assert!(expected.is_string() && found.len() == 80);
        found.sort();
        found.dedup();
        assert!(found.len() > 1, "{mode}: {found:?}");
        assert_eq!(ask("torus.cbvh", &["--jobs", "2"]), expected);
        assert_eq!(ask("torus.cbvh", &["--jobs", "7", "--warm", "0", "--read-ahead", "sparse"]), expected);
        for profile in ["auto", "dop6-u8", "dop26-u4"] {
            assert_eq!(
                ask("torus.obj", &["--profile", profile, "--triangles", "packed"]),
                expected,
                "{profile}"
            );
        }
        for isa in &backends {
            assert_eq!(ask("torus.cbvh", &["--isa", isa]), expected, "{isa}");
            let forced =
                cbvh_with_isa(directory, isa, &["probe", "torus.cbvh", file, "--mode", mode, "--bench"])
                    .done()
                    .json();
            assert_eq!((&forced["isa"], &forced["answers_xxh3"]), (&(*isa).into(), &expected));
        }
    }
}

#[test]
fn several_files_are_read_before_the_first_question() {
    let directory = &world();
    directory.write("more.txt", "0 0 0\n");
    directory.write("bad.txt", "0 0 0\n0 0\n");
    let probe = |files: &str| {
        cbvh_in(directory, &["probe", "cube.obj", files, "--mode", "side", "--out", "raw_%s.txt", "--bench"])
    };
    probe("side.txt,bad.txt").failed(3, &["bad.txt: line 2: expected 3 numbers, a point, found 2"]);
    assert!(!directory.join("raw_side.txt").exists());
    let lines = probe("side.txt,more.txt").done().json_lines();
    assert!(lines.len() == 2 && lines[0]["poses"] == "side" && lines[1]["poses"] == "more");
    assert_eq!(values(&directory.join("raw_more.txt")), ["1"]);
}

#[test]
fn an_object_can_be_named() {
    let directory = &world();
    directory.write("both.obj", cube() + "o moved\n" + &cube_at(1, 10));
    directory.cbvh("bake both.obj -o both.cbvh --split-objects -q").done();
    let ask = |mesh: &str, more: &[&str]| {
        cbvh_in(directory, &[&["probe", mesh, "--probe", "6 0 0"], more].concat())
    };
    assert!(ask("both.obj", &[]).done().out.starts_with("3.0 mesh units"));
    for mesh in ["both.obj", "both.cbvh"] {
        assert!(ask(mesh, &["--object", "cube"]).done().out.starts_with("5.0 mesh units"));
    }
    assert!(ask("both.cbvh", &[]).done().out.contains(", object 1 \"moved\" triangle "));
    ask("both.cbvh", &["--object", "ball"]).failed(1, &["both.cbvh", "found none named \"ball\""]);
}

#[test]
fn one_question_is_answered_for_a_person() {
    let directory = &world();
    for (mode, probe, words) in [
        ("closest", "3,0.5,0.25", &["2.0 mesh units from the mesh\n", "at 1.0 0.5 0.25, triangle "][..]),
        ("closest", "1 0 0", &["on the mesh\n", "certainly 0.0 to 0.0", "at 1.0 0.0 0.0, triangle "]),
        ("side", "0 0 0", &["inside the mesh\n"]),
        ("side", "1 0 0", &["on the mesh\n"]),
        ("side", "-1e2 0 0", &["outside the mesh\n"]),
        (
            "ray",
            "-5 0.25 0.5, 2 0 0",
            &["hits the mesh at 2.0 times the direction\n", "at -1.0 0.25 0.5, triangle "],
        ),
        ("ray", "-5 0 0 -1 0 0", &["does not hit the mesh\n"]),
        ("segment", "-5 0 0 5 0 0", &["meets the mesh\n"]),
        ("segment", "2 0 0 5 0 0", &["does not meet the mesh\n"]),
    ] {
        let said = cbvh_in(directory, &["probe", "cube.cbvh", "--mode", mode, "--probe", probe]).done().out;
        assert!(
            said.starts_with(words[0]) && words.iter().all(|words| said.contains(words)),
            "{probe}: {said}"
        );
        assert!(
            said.ends_with('\n') && said.lines().count() == if words.len() > 1 { 3 } else { 1 },
            "{said}"
        );
    }
}

#[test]
fn bad_questions_are_named() {
    let directory = &world();
    let point = "expected 3 numbers, a point, found ";
    let ray = "expected 6 numbers, the origin and the direction of a ray, found ";
    let segment = "expected 6 numbers, both ends of a segment, found ";
    let far = "expected finite coordinates of at most 2^120 mesh units, found ";
    let unit =
        "expected a direction of finite numbers, the largest from 2^-500 to 2^500 in magnitude, found ";
    for (mode, line, words) in [
        ("closest", "1 2", [point, "2"]),
        ("closest", "1 2 3 4 5 6", [point, "6; a ray or a segment? use --mode ray or --mode segment"]),
        ("side", "1 2 3 4", [point, "4"]),
        ("ray", "1 2 3", [ray, "3; a point? use --mode closest or --mode side"]),
        ("ray", "1 2 3 4 5 6 7", [ray, "7"]),
        ("segment", "1 2 3 # 4 5 6", [segment, "3; a point?"]),
        ("closest", "1 two 3", ["expected a number, found ", "\"two\""]),
        ("closest", "1 nan 3", [far, "NaN"]),
        ("side", "1 2 -inf", [far, "-inf"]),
        ("side", "1e400 2 3", [far, "inf"]),
        ("closest", "1 2 1e37", [far, "1e37"]),
        ("segment", "0 0 0 1 inf 2", [far, "inf"]),
        ("ray", "0 nan 0 1 2 3", [far, "NaN"]),
        ("ray", "0 0 0 0 -0 0", [unit, "0.0 -0.0 0.0; a point?"]),
        ("ray", "0 0 0 1 nan 0", [unit, "1.0 NaN 0.0"]),
        ("ray", "0 0 0 1 inf 0", [unit, "1.0 inf 0.0"]),
        ("ray", "0 0 0 1e-200 0 0", [unit, "1e-200 0.0 0.0"]),
    ] {
        let good = if ["closest", "side"].contains(&mode) { "1 2 3" } else { "1 2 3 4 5 6" };
        directory.write("p.txt", format!("# a comment\n\n{good}\n{line}\n"));
        let probe = ["probe", "cube.obj", "p.txt", "--mode", mode, "--out", "raw.txt"];
        let place = format!("p.txt: line 4: {}{}", words[0], words[1]);
        assert_eq!(cbvh_in(directory, &probe).failed(3, &[&place]).out, "");
        if !line.contains('#') {
            let probe = ["probe", "cube.obj", "--mode", mode, "--probe", line];
            cbvh_in(directory, &probe).failed(3, &[&format!("--probe: {}{}", words[0], words[1])]);
        }
    }
    for none in ["", "\n", "# nothing\n\n"] {
        directory.write("p.txt", none);
        directory
            .cbvh("probe cube.obj p.txt")
            .failed(3, &["p.txt: expected 3 numbers, a point, in at least one line, found none"]);
    }
    cbvh_in(directory, &["probe", "cube.obj", "--probe", " "]).failed(3, &["--probe: ", "found none"]);
    directory.cbvh("probe cube.obj none.txt").failed(2, &["none.txt"]);
    directory.cbvh("probe none.obj side.txt").failed(2, &["none.obj"]);
    assert!(!directory.join("raw.txt").exists());
}

#[test]
fn an_open_mesh_has_no_sides_but_its_surface() {
    let directory = &world();
    // The cube without its last face.
    let open: Vec<String> = cube().lines().map(str::to_owned).collect();
    directory.write("open.obj", open[..open.len() - 1].join("\n"));
    for (point, words) in [
        (
            "0 0 0",
            "undefined, because the mesh is not closed and consistently oriented: 4 edges have one triangle; the nearest gap is 2.00e0, and no \
             crack\n",
        ),
        (
            "9 9 9",
            "undefined, because the mesh is not closed and consistently oriented: 4 edges have one triangle; the nearest gap is 2.00e0, and no \
             crack\n",
        ),
        ("-1 0 0", "on the mesh\n"),
    ] {
        let probe = ["probe", "open.obj", "--mode", "side", "--probe", point];
        assert_eq!(cbvh_in(directory, &probe).done().out, words);
    }
    assert_eq!(
        directory.cbvh("probe open.obj side.txt --mode side --out raw.txt --bench").done().json()["positives"],
        0
    );
    assert_eq!(values(&directory.join("raw.txt")), ["2", "2", "2", "2"]);
    directory.write("tiny.obj", "o tiny\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n");
    let query = ["query", "open.obj", "tiny.obj", "--mode", "relation", "--pose", "1 0 0 0 0 1 0 0 0 0 1 0"];
    assert_eq!(
        cbvh_in(directory, &query).done().out,
        "not touching, undefined because a mesh is not closed: A: 4 edges have one triangle; the nearest gap is 2.00e0, and no \
         crack; B: 3 edges have one triangle; the nearest gap is 1.00e-1, and no crack\n"
    );
}

#[test]
fn a_file_without_topology_is_named() {
    let directory = &world();
    directory.cbvh("bake cube.obj -o bare.cbvh --no-topology -q").done();
    let refused = |arguments: &[&str]| {
        cbvh_in(directory, arguments)
            .failed(3, &["cbvh: bare.cbvh: this file does not say", "bake it again with topology"]);
    };
    refused(&["probe", "bare.cbvh", "side.txt", "--mode", "side"]);
    refused(&["probe", "bare.cbvh", "--mode", "side", "--probe", "0 0 0"]);
    let pose = "1 0 0 9 0 1 0 0 0 0 1 0";
    refused(&["query", "bare.cbvh", "torus.cbvh", "--mode", "relation", "--pose", pose]);
    refused(&["query", "torus.cbvh", "bare.cbvh", "--mode", "relation", "--pose", pose]);
    for mode in ["closest", "ray", "segment"] {
        let file = format!("{mode}.txt");
        cbvh_in(directory, &["probe", "bare.cbvh", &file, "--mode", mode]).done();
    }
}

/// The labels are exact, and about meshes rounded to f32. A bake may round vertices once more, which the tolerances of
/// lengths allow for: parts of the mesh's diagonal, as in the protocol of the labels.
#[test]
#[ignore = "needs ../shared"]
fn answers_are_those_of_the_labels() {
    let (probes, meshes) = (shared("probes"), shared("meshes"));
    let directory = &place();
    for (name, mesh, is_closed) in
        [("ball", probes.join("ball.obj"), true), ("bunny", meshes.join("bunny.obj"), false)]
    {
        // The labels are about f32 coordinates.
        let bake = ["bake", mesh.to_str().unwrap(), "-o", "m.cbvh", "--force", "-q", "--round", "f32"];
        cbvh_in(directory, &bake).done();
        for (mode, kind, label) in [
            ("closest", "points", "dist"),
            ("side", "points", "side"),
            ("ray", "rays", "t"),
            ("segment", "segments", "hit"),
        ] {
            if mode == "side" && !is_closed {
                continue;
            }
            let file = probes.join(format!("{name}_{kind}.txt"));
            let probe = [
                "probe",
                "m.cbvh",
                file.to_str().unwrap(),
                "--mode",
                mode,
                "--out",
                "raw.txt",
                "--jobs",
                "2",
                "--bench",
            ];
            let ended = cbvh_in(directory, &probe);
            assert_eq!((ended.code, ended.json()["poses"].as_str()), (0, Some(&*format!("{name}_{kind}"))));
            let text = fs::read_to_string(&file).unwrap();
            let labelled: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
            let values = values(&directory.join("raw.txt"));
            assert_eq!((values.len(), labelled.len()), (1000, 1000), "{name}_{kind}");
            for (value, line) in values.iter().zip(labelled) {
                let label = line.split(&format!(" {label} ")).nth(1).unwrap().split(' ').next().unwrap();
                let [value, expected] = [value, label].map(|number| number.parse::<f64>().unwrap());
                let is_right = match mode {
                    "side" | "segment" => value == expected,
                    _ => (value < 0.0) == (expected < 0.0) && (value - expected).abs() <= 1e-6,
                };
                assert!(is_right, "{name} {mode}: expected {expected}, found {value}: {line}");
            }
        }
    }
}
