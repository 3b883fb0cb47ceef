//! `cbvh report PAIRS`: four files that hold the same figures, and errors in one line.

mod common;

use common::documents::{elements, number, same_figures};
use common::{cbvh_in, names, poses, torus};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

const TESTDATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata");

/// Longer than other commands may take: it bakes and measures 37 variants.
fn report(directory: &Path, arguments: &[&str]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cbvh"));
    command.arg("report").args(arguments).current_dir(directory).env_remove("CBVH_ISA").output().unwrap()
}

#[test]
fn four_files_hold_the_same_figures_and_all_answers_are_right() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    fs::write(directory.join("torus.obj"), torus(24, 12)).unwrap();
    cbvh_in(directory, &["bake", "torus.obj", "-o", "torus.cbvh", "--no-ids"]).done();
    fs::write(directory.join("p.txt"), poses(8, 0.0, 6.0)).unwrap();
    for mesh in ["fclenv.obj", "fclrob.obj"] {
        fs::copy(Path::new(TESTDATA).join(mesh), directory.join(mesh)).unwrap();
    }
    let list =
        "# name a b poses\nfcl fclenv.obj fclrob.obj\n\ntori torus.cbvh torus.cbvh p.txt # with poses\n";
    fs::write(directory.join("pairs.txt"), list).unwrap();
    let ended = report(directory, &["pairs.txt", "--out", "new/out", "--quick"]);
    assert!(ended.status.success() && ended.stderr.is_empty(), "{ended:?}");
    let out = directory.join("new/out");
    assert_eq!(names(&out), ["report.csv", "report.html", "report.json", "report.svg"]);
    let [csv, html, json, svg] = ["csv", "html", "json", "svg"]
        .map(|extension| fs::read_to_string(out.join(format!("report.{extension}"))).unwrap());
    for text in [&csv, &html, &json, &svg] {
        assert!(!text.contains("NaN") && !text.contains("inf,") && !text.contains(">inf"));
        assert!(!text.contains(directory.to_str().unwrap()), "a path of this machine");
    }

    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["wrong"].as_array().unwrap().len(), 0);
    let rows = json["rows"].as_array().unwrap();
    // Of each pair: 30 layouts, 3 splits and 4 orders with 5 questions, and 12 models with 2.
    assert_eq!(rows.len(), 2 * (37 * 5 + 12 * 2));
    same_figures(&csv, rows);
    for row in rows {
        check(row);
    }

    let find = |pair: &str, group: &str, variant: &str, question: &str, rel_err: f64| {
        let is_it = |row: &&Value| {
            row["pair"] == pair
                && row["group"] == group
                && row["variant"] == variant
                && row["question"] == question
                && number(row, "rel_err").unwrap_or(0.0) == rel_err
        };
        rows.iter().find(is_it).unwrap()
    };
    let in_page = elements(&html);
    let shown: Vec<_> = in_page.iter().filter(|(name, _)| name == "data").collect();
    assert!(shown.len() > 2000, "{}", shown.len());
    for (_, data) in shown {
        let at = |name: &str| data[name].as_str();
        let rel_err = at("data-rel-err").parse().unwrap();
        let row = find(at("data-pair"), at("data-group"), at("data-variant"), at("data-question"), rel_err);
        assert_eq!(number(row, at("data-field")), at("value").parse().ok(), "{data:?}");
    }
    for document in [&in_page, &elements(&svg)] {
        let marks: Vec<_> = document.iter().filter(|(_, at)| at.contains_key("data-ns")).collect();
        // Distance: 30 layouts with 4 allowed errors each, and those without once more by bytes.
        assert_eq!(marks.len(), 2 * (30 * 4 + 30));
        for (_, mark) in &marks {
            let rel_err = mark["data-rel-err"].parse().unwrap();
            let row = find(&mark["data-pair"], "layout", &mark["data-variant"], "distance", rel_err);
            assert_eq!(number(row, "warm_ns_median"), mark["data-ns"].parse().ok());
            let (field, flag, found) = match mark.get("data-error") {
                Some(error) => ("distance_error_max", "pareto_error", error),
                None => ("file_bytes_per_tri", "pareto_bytes", &mark["data-bytes"]),
            };
            assert_eq!(number(row, field), found.parse().ok());
            assert_eq!(mark["class"].contains("front"), row[flag] == true, "{mark:?}");
        }
    }
    // Nothing is fetched from elsewhere.
    let outside = ["src", "xlink:href"];
    for (name, attributes) in &in_page {
        assert!(
            name != "script" && name != "link" && outside.iter().all(|key| !attributes.contains_key(*key))
        );
        assert!(attributes.get("href").is_none_or(|to| to.starts_with('#')));
    }
    for pair in ["fcl", "tori"] {
        let inflation = |variant| number(find(pair, "predictor", variant, "collide", 0.0), "width_inflation");
        assert!(inflation("parent-tight u8") <= inflation("chain u8"), "{pair}");
        assert!(inflation("chain u8") < inflation("none u8"), "{pair}");
        let reached = |name, question| {
            let row = find(pair, "layout", name, question, 0.0);
            number(row, "node_tests").unwrap()
        };
        assert!(reached("dop26-u8-wide f32", "distance") < reached("dop6-u8 f32", "distance"), "{pair}");
        // The same file three times: the same work.
        for question in ["collide", "distance"] {
            let tests = |group, name| number(find(pair, group, name, question, 0.0), "node_tests");
            assert_eq!(tests("layout", "dop14-u8 f32"), tests("splits", "reach"));
            assert_eq!(tests("layout", "dop14-u8 f32"), tests("pages", "van-emde-boas"));
        }
    }
    assert!(json["pairs"][0]["poses_from"].as_str().unwrap().starts_with("made up"));
    assert_eq!(json["pairs"][1]["poses_from"], "p");
    assert_eq!(json["pairs"][1]["a"]["triangles"], 2 * 24 * 12);
    assert!(String::from_utf8(ended.stdout).unwrap().contains("0 wrong answers"));
}

/// What holds of every row.
fn check(row: &Value) {
    let at = |field| number(row, field);
    let modelled = row["how"] == "modelled";
    assert_eq!(modelled, ["predictor", "branching", "leaf"].contains(&row["group"].as_str().unwrap()));
    for (times, tests) in
        [("warm_ns_median", "node_tests"), ("cold_ns_median", "packet_tests"), ("warm_ns_p90", "exact_tests")]
    {
        assert_eq!(at(times).is_none(), modelled, "{row}");
        assert_eq!(at(tests).is_none(), modelled, "{row}");
    }
    assert!(at("warm_ns_q1") <= at("warm_ns_median") && at("warm_ns_median") <= at("warm_ns_q3"), "{row}");
    assert!(at("width_inflation").unwrap() >= 1.0 && at("volume_inflation").unwrap() >= 1.0, "{row}");
    assert!(at("false_positive_rate").is_none_or(|rate| (0.0..=1.0).contains(&rate)), "{row}");
    assert!(at("node_bytes_per_tri").unwrap() > 0.0, "{row}");
    if modelled || row["question"] == "collide" {
        assert_eq!(at("distance_error_max"), None, "{row}");
        return;
    }
    if row["triangles"] != "quantized" {
        // Rounding to f32 alone.
        assert!(at("vertex_error").unwrap() < if row["pair"] == "fcl" { 1e-4 } else { 1e-6 }, "{row}");
        let (max, allowed) = (at("distance_error_max").unwrap(), at("rel_err").unwrap());
        assert!(max <= allowed * 1.000001 && at("distance_error_median").unwrap() <= max, "{row}");
    }
}

#[test]
fn what_is_wrong_is_told_in_one_line_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    let write = |name: &str, text: &str| fs::write(directory.join(name), text).unwrap();
    write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    write("good.txt", "one one.obj one.obj\n");
    write("empty.txt", "# nothing\n");
    write("p.txt", "1 2 3\n");
    write("bad.txt", "a one.obj one.obj\nb one.obj\n");
    write("twice.txt", "a one.obj one.obj\n\na one.obj one.obj\n");
    write("mesh.txt", "a one.obj bad.obj\n");
    write("lost.txt", "a one.obj missing.obj\n");
    write("poses.txt", "a one.obj one.obj p.txt\n");
    write("void.txt", "a one.obj one.obj empty.txt\n");
    let fails = |code: i32, arguments: &[&str], words: &[&str]| {
        cbvh_in(directory, &[&["report"], arguments].concat()).failed(code, words);
    };
    fails(1, &["good.txt"], &["--out"]);
    fails(1, &["good.txt", "--hard", "--out", "o"], &["--hard"]);
    fails(1, &["good.txt", "--peers", "p", "--out", "o"], &["--peers"]);
    fails(1, &["--hard", "--quick", "--out", "o"], &["--quick"]);
    fails(1, &["good.txt", "--scaling", "--out", "o"], &["--scaling"]);
    fails(1, &["--hard", "--scaling", "--out", "o"], &["--scaling"]);
    fails(1, &["good.txt", "--largest", "3000", "--out", "o"], &["--largest"]);
    fails(1, &["--scaling", "--largest", "999", "--out", "o"], &["--largest", "999"]);
    fails(1, &["--scaling", "--meshes", "m", "--out", "o"], &["--meshes"]);
    fails(2, &["--scaling", "--out", "one.obj"], &["one.obj", "expected a folder"]);
    fails(1, &["good.txt", "--out", "o", "--isa", "mmx"], &["mmx"]);
    fails(1, &["good.txt", "--out", "o", "--rounds", "0"], &["--rounds"]);
    fails(2, &["missing.txt", "--out", "o"], &["missing.txt"]);
    fails(2, &["lost.txt", "--out", "o"], &["missing.obj"]);
    fails(2, &["good.txt", "--poses", "%s.poses", "--out", "o"], &["one.poses"]);
    fails(2, &["good.txt", "--out", "one.obj"], &["one.obj", "expected a folder"]);
    fails(3, &["empty.txt", "--out", "o"], &["empty.txt", "NAME A B"]);
    fails(3, &["bad.txt", "--out", "o"], &["bad.txt: line 2", "found 2 words"]);
    fails(3, &["twice.txt", "--out", "o"], &["twice.txt: line 3", "again"]);
    fails(3, &["mesh.txt", "--out", "o"], &["bad.obj: line 2"]);
    fails(3, &["poses.txt", "--out", "o"], &["p.txt: line 1", "found 3"]);
    fails(3, &["void.txt", "--out", "o"], &["empty.txt: expected poses, found none"]);
    assert!(!directory.join("o").exists());
}
