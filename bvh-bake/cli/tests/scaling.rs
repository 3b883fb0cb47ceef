//! `cbvh report --scaling`: four files that hold the same figures, in two sizes.

mod common;

use common::documents::{elements, number, same_figures};
use common::{cbvh_in, names};
use serde_json::Value;
use std::fs;

const GAPS: [f64; 3] = [1e-6, 0.01, 0.05];

#[test]
fn figures_agree_and_work_grows_where_the_meshes_are_near() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path();
    let arguments = ["report", "--scaling", "--largest", "3000", "--out", "new/out", "--quick"];
    let ended = cbvh_in(directory, &arguments).done();
    let out = directory.join("new/out");
    assert_eq!(names(&out), ["scaling.csv", "scaling.html", "scaling.json", "scaling.svg"]);
    let [csv, html, json, svg] = ["csv", "html", "json", "svg"]
        .map(|extension| fs::read_to_string(out.join(format!("scaling.{extension}"))).unwrap());
    for text in [&csv, &html, &json, &svg] {
        assert!(!text.contains("NaN") && !text.contains("inf,") && !text.contains(">inf"));
        assert!(!text.contains(directory.to_str().unwrap()), "a path of this machine");
    }
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["wrong"].as_array().unwrap().len(), 0);
    assert!(ended.out.contains("0 wrong answers"), "{}", ended.out);
    let rows = json["rows"].as_array().unwrap();
    same_figures(&csv, rows);
    for row in rows {
        check(row);
    }

    let of = |part: &str| rows.iter().filter(|row| row["part"] == part).collect::<Vec<_>>();
    // Two questions with three gaps; on two numbers of threads; on twelve paths in two ways.
    assert_eq!(["size", "growth", "batch", "path"].map(|part| of(part).len()), [12, 6, 4, 48]);
    for growth in of("growth") {
        let line: Vec<_> = of("size")
            .into_iter()
            .filter(|row| row["question"] == growth["question"] && row["gap"] == growth["gap"])
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

    let drawn = elements(&svg);
    let in_page = elements(&html);
    for document in [&drawn, &in_page] {
        let marks: Vec<_> = document.iter().filter(|(_, at)| at.contains_key("data-value")).collect();
        let times = of("size").into_iter().map(|row| number(row, "warm_ns_median").unwrap());
        let tests = of("size").into_iter().map(|row| number(row, "node_tests").unwrap());
        let expected: Vec<f64> = times.chain(tests).filter(|&value| value > 0.0).collect();
        let found: Vec<f64> = marks.iter().map(|(_, at)| at["data-value"].parse().unwrap()).collect();
        assert_eq!(found, expected);
        let dashed = document.iter().filter(|(_, at)| at.get("class").is_some_and(|c| c == "front-line"));
        assert_eq!(dashed.count(), 4, "the square root and the logarithm in both panels");
    }
    // Nothing is fetched from elsewhere.
    for (name, attributes) in &in_page {
        assert!(name != "script" && name != "link" && !attributes.contains_key("src"));
        assert!(!attributes.contains_key("href"));
    }
}

/// What holds of every row.
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
