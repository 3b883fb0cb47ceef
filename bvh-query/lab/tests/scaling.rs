//! `cbvh-lab scaling`: four files, in two sizes.

mod common;

use common::{lab, names};
use serde_json::Value;
use std::fs;

/// Returns a figure of a row.
fn number(row: &Value, field: &str) -> Option<f64> {
    row[field].as_f64()
}

const GAPS: [f64; 3] = [1e-6, 0.01, 0.05];

#[test]
fn figures_agree_and_work_grows_where_the_meshes_are_near() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    let out = directory.join("new/out");
    let few = ["--largest", "3000", "--rounds", "2", "--poses", "10", "--path-poses", "100"];
    let ended = lab(&[&["scaling", "--out", out.to_str().unwrap()], &few[..]].concat());
    assert!(ended.status.success(), "{ended:?}");
    assert_eq!(names(&out), ["scaling.csv", "scaling.json", "scaling.md", "scaling.svg"]);
    let [csv, json, page, svg] = ["csv", "json", "md", "svg"]
        .map(|extension| fs::read_to_string(out.join(format!("scaling.{extension}"))).unwrap());
    for text in [&csv, &page, &json, &svg] {
        assert!(!text.contains("NaN") && !text.contains("inf,") && !text.contains(">inf"));
        assert!(!text.contains(directory.to_str().unwrap()), "a path of this machine");
    }
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["wrong"].as_array().unwrap().len(), 0);
    assert!(String::from_utf8(ended.stdout).unwrap().contains("0 wrong answers"));
    let rows = json["rows"].as_array().unwrap();
    assert_eq!(csv.lines().count(), 1 + rows.len());
    for row in rows {
        check(row);
    }

    let of = |part: &str| rows.iter().filter(|row| row["part"] == part).collect::<Vec<_>>();
    // Two questions with three gaps, with and without slabs; on two numbers of threads; on twelve paths in two ways.
    assert_eq!(["size", "growth", "batch", "path"].map(|part| of(part).len()), [24, 12, 4, 48]);
    for growth in of("growth") {
        let line: Vec<_> = of("size")
            .into_iter()
            .filter(|row| ["question", "gap", "turning_slabs"].iter().all(|same| row[same] == growth[same]))
            .collect();
        let figures = |name: &str| [0, 1].map(|size| number(line[size], name).unwrap());
        let [fewer, more] = figures("triangles");
        assert_eq!([fewer, more], [960.0, 3024.0]);
        let (tests, bytes) = (figures("node_tests"), figures("file_bytes_per_tri"));
        // Apart, a bounding sphere or a few nodes decide about contact, in all sizes.
        if growth["question"] == "distance" || growth["gap"] == GAPS[0] {
            assert!(tests[0] < tests[1], "{growth}: {tests:?}");
        }
        assert!(bytes[0] > bytes[1] && bytes[1] > 36.0, "{bytes:?}");
        for (slope, [before, after]) in [("growth", figures("warm_ns_median")), ("node_growth", tests)] {
            // A line through two points has their slope; where a figure is 0 there is none.
            let expected = (after / before).ln() / (more / fewer).ln();
            match number(growth, slope) {
                Some(found) => assert!((found - expected).abs() < 1e-9, "{found} {expected}"),
                None => assert!(before == 0.0 || after == 0.0, "{growth}"),
            }
        }
    }
    for path in of("path").chunks_exact(2) {
        assert_eq!([&path[0]["tracker"], &path[1]["tracker"]], [false, true]);
        for same in ["touching", "gap_least", "gap_most", "question", "gap", "step"] {
            assert_eq!(path[0][same], path[1][same]);
        }
        if path[0]["gap"] == 0.0 && path[0]["step"] != 1e-4 {
            let touching = number(path[0], "touching").unwrap();
            assert!(touching > 0.0 && touching < 100.0, "in and out: {touching}");
        }
    }

    // A mark is a polygon: in two plots, for each size with a figure.
    let marks = svg.matches("<polygon").count();
    let marked = of("size").into_iter().filter(|row| row["turning_slabs"] == true).count();
    assert!(
        marked == 12 && marks >= marked && svg.contains("square root") && svg.contains("logarithm"),
        "{marks}"
    );
}

/// Checks what holds for every row.
fn check(row: &Value) {
    let at = |field| number(row, field);
    if row["part"] == "growth" {
        return;
    }
    assert!(at("warm_ns_median").unwrap() > 0.0 && at("bake_seconds").unwrap() > 0.0, "{row}");
    assert!(at("warm_ns_q1") <= at("warm_ns_median") && at("warm_ns_median") <= at("warm_ns_q3"), "{row}");
    assert_eq!(at("warm_ns_p90").is_some(), row["part"] == "size", "{row}");
    assert_eq!(at("node_tests").is_none(), row["part"] == "batch", "{row}");
    if row["gap"] != 0.0 {
        assert_eq!(at("touching"), Some(0.0), "{row}");
    }
    // The poses were made for these gaps, and distances say that they have them: to a hundredth.
    let Some(gap) = at("gap").filter(|&gap| gap > 0.0 && row["question"] == "distance") else { return };
    assert!(GAPS.contains(&gap));
    let [least, most] = ["gap_least", "gap_most"].map(|name| at(name).unwrap());
    assert!(least >= gap * (1.0 - 1e-9) && least <= most && most <= gap * 1.01, "{row}");
}
