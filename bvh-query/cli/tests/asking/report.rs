//! Tests `cbvh report PAIRS`: its four files show the same figures, and errors take one line.

use crate::common::{Files as _, TESTDATA, cbvh_in, place, poses, torus};
use crate::documents::{
    elements, fetches_nothing, number, pose_shown, report_files, same_figures, same_figures_in_page,
};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the report, which may take longer than other commands because it bakes and measures 18 layouts.
fn report(directory: &Path, arguments: &[&str]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cbvh"));
    command.arg("report").args(arguments).current_dir(directory).env_remove("CBVH_ISA").output().unwrap()
}

#[test]
fn four_files_hold_the_same_figures_and_all_answers_are_right() {
    let directory = &place();
    directory.write("torus.obj", torus(24, 12));
    directory.cbvh("bake torus.obj -o torus.cbvh --no-ids").done();
    // The first of them are apart.
    directory.write("p.txt", poses(8, 6.0, 0.0));
    for mesh in ["fclenv.obj", "fclrob.obj"] {
        fs::copy(Path::new(TESTDATA).join(mesh), directory.join(mesh)).unwrap();
    }
    let list =
        "# name a b poses\nfcl fclenv.obj fclrob.obj\n\ntori torus.cbvh torus.cbvh p.txt # with poses\n";
    directory.write("pairs.txt", list);
    let ended = report(directory, &["pairs.txt", "--out", "new/out", "--quick"]);
    assert!(ended.status.success() && ended.stderr.is_empty(), "{ended:?}");
    let [csv, html, json, svg] = report_files(directory, "new/out");
    // The second page shows the first pose in which the tori touch.
    let asked = directory.cbvh("query torus.cbvh torus.cbvh p.txt --mode collide").done().out;
    let touching = asked.lines().position(|line| line == "1").unwrap();
    assert!(touching > 0, "{asked}");
    let all = directory.text("p.txt");
    let pose = all.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).nth(touching).unwrap();
    let numbers =
        |text: &str| text.split_whitespace().take(12).map(|x| x.parse().unwrap()).collect::<Vec<f64>>();
    assert_eq!(numbers(&pose_shown(&directory.text("new/out/view-2.html"))), numbers(pose));
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["wrong"].as_array().unwrap().len(), 0);
    let rows = json["rows"].as_array().unwrap();
    // There are two pairs, 18 layouts and 5 questions.
    assert_eq!(rows.len(), 2 * 18 * 5);
    same_figures(&csv, rows);
    for row in rows {
        check(row);
    }

    let find = |pair: &str, layout: &str, question: &str, rel_err: f64| {
        let is_it = |row: &&Value| {
            row["pair"] == pair
                && row["layout"] == layout
                && row["question"] == question
                && number(row, "rel_err").unwrap_or(0.0) == rel_err
        };
        rows.iter().find(is_it).unwrap()
    };
    let in_page = elements(&html);
    let shown = same_figures_in_page(&in_page, rows);
    // Per pair and layout, 8 figures about contact, and 10 about each of four distances. Errors relative to a distance need
    // poses that are apart.
    assert_eq!(shown, 2 * 18 * (8 + 4 * 10));
    // Each pair has a table for each of five questions.
    assert_eq!(in_page.iter().filter(|at| at.0 == "tr").count(), 2 * 5 * (1 + 18));
    // Each table about a question begins with the fastest layout.
    for at in in_page.windows(2).filter(|at| at[0].0 == "tbody" && at[1].1.contains_key("data-row")) {
        let row: &Value = &rows[at[1].1["data-row"].parse::<usize>().unwrap()];
        let is_it = |other: &&Value| ["pair", "question", "rel_err"].iter().all(|key| row[key] == other[key]);
        let time = |row: &Value| number(row, "ns_median").unwrap();
        assert_eq!(time(row), rows.iter().filter(is_it).map(time).reduce(f64::min).unwrap());
    }
    for document in [&in_page, &elements(&svg)] {
        // A mark is a polygon. There are 18 layouts in two plots by bytes, and with 4 allowed errors in a plot by
        // error.
        let marks = document.iter().filter(|(name, _)| name == "polygon").count();
        assert!(marks >= 2 * (2 * 18 + 4 * 18), "{marks}");
    }
    fetches_nothing(&in_page);
    for pair in ["fcl", "tori"] {
        let tests = |layout| number(find(pair, layout, "distance", 0.0), "node_tests").unwrap();
        assert!(tests("dop26-u8-wide f32") < tests("dop6-u8 f32"), "{pair}");
    }
    let pairs = &json["pairs"];
    assert!(pairs[0]["poses_from"].as_str().unwrap().starts_with("made"));
    assert_eq!(pairs[1]["poses_from"], "p");
    assert_eq!(pairs[1]["a"]["triangles"], 2 * 24 * 12);
    assert_eq!(pairs[1]["a"]["chosen_layout"], pairs[1]["b"]["chosen_layout"]);
    let said = String::from_utf8(ended.stdout).unwrap();
    assert!(said.contains("0 wrong results") && said.contains("Without options cbvh bake chooses"), "{said}");
}

/// Checks what holds for every row.
fn check(row: &Value) {
    let at = |field| number(row, field);
    for always in ["ns_median", "ns_p90", "node_tests", "packet_tests", "exact_tests"] {
        assert!(at(always).is_some(), "{row}");
    }
    assert!(at("ns_q1") <= at("ns_median") && at("ns_median") <= at("ns_q3"), "{row}");
    assert!(at("width_inflation").unwrap() >= 1.0 && at("volume_inflation").unwrap() >= 1.0, "{row}");
    assert!(at("node_bytes_per_tri").unwrap() > 0.0, "{row}");
    if row["question"] == "collide" {
        assert_eq!(at("distance_error_max"), None, "{row}");
        return;
    }
    if row["triangles"] != "quantized" {
        // The only error is that of rounding to f32.
        assert!(at("vertex_error").unwrap() < if row["pair"] == "fcl" { 1e-4 } else { 1e-6 }, "{row}");
        let (max, allowed) = (at("distance_error_max").unwrap(), at("rel_err").unwrap());
        assert!(max <= allowed * 1.000001 && at("distance_error_median").unwrap() <= max, "{row}");
    }
}

#[test]
fn what_is_wrong_is_told_in_one_line_before_the_work() {
    let directory = &place();
    let write = |name: &str, text: &str| directory.write(name, text);
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
    fails(1, &["--out", "o"], &["PAIRS"]);
    fails(1, &["good.txt", "--quick", "--rounds", "3", "--out", "o"], &["--quick"]);
    fails(1, &["good.txt", "--out", "o", "--isa", "mmx"], &["mmx"]);
    fails(1, &["good.txt", "--out", "o", "--rounds", "0"], &["--rounds"]);
    fails(1, &["good.txt", "--out", "o", "--motions", "--poses", "p.txt"], &["--motions", "--poses"]);
    fails(1, &["good.txt", "--out", "o", "--motions", "m.txt"], &["m.txt"]);
    fails(2, &["missing.txt", "--out", "o"], &["missing.txt"]);
    fails(2, &["lost.txt", "--out", "o"], &["missing.obj"]);
    fails(2, &["good.txt", "--poses", "%s.poses", "--out", "o"], &["one.poses"]);
    fails(2, &["good.txt", "--motions=%s.motions", "--out", "o"], &["one.motions"]);
    fails(2, &["good.txt", "--out", "one.obj"], &["one.obj", "expected a folder"]);
    fails(3, &["empty.txt", "--out", "o"], &["empty.txt", "NAME A B"]);
    fails(3, &["bad.txt", "--out", "o"], &["bad.txt: line 2", "found 2 words"]);
    fails(3, &["twice.txt", "--out", "o"], &["twice.txt: line 3", "again"]);
    fails(3, &["mesh.txt", "--out", "o"], &["bad.obj: line 2"]);
    fails(3, &["poses.txt", "--out", "o"], &["p.txt: line 1", "found 3"]);
    fails(
        3,
        &["void.txt", "--out", "o"],
        &["empty.txt: expected at least one line of 12 numbers", "found no pose"],
    );
    fails(3, &["poses.txt", "--motions", "--out", "o"], &["p.txt: line 1", "expected 24 numbers", "found 3"]);
    fails(3, &["void.txt", "--motions", "--out", "o"], &["empty.txt", "in at least one line, found none"]);
    fails(3, &["bad.txt", "--motions", "--out", "o"], &["bad.txt: line 2", "found 2 words"]);
    assert!(!directory.join("o").exists());
}
