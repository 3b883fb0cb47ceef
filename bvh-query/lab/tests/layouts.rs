//! Tests `cbvh-lab layouts`: it writes three files, and its walks count differently for different profiles.

mod common;

use common::{lab, names};
use serde_json::Value;
use std::fs;

const TESTDATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata");

#[test]
fn every_layout_has_cold_times_and_counts_of_walks() {
    let folder = tempfile::tempdir().unwrap();
    let (list, poses) = (folder.path().join("pairs.txt"), folder.path().join("fcl.txt"));
    fs::write(&list, "fcl fclenv.obj fclrob.obj\n").unwrap();
    // One pose well apart, one close.
    let line = |x: f64| format!("0.6 -0.8 0 {x}  0.8 0.6 0 -1600  0 0 1 -500\n");
    fs::write(&poses, format!("# two poses\n{}{}", line(300.0), line(900.0))).unwrap();
    let out = folder.path().join("out");
    let named = folder.path().join("%s.txt");
    let [list, out_text, named] = [&list, &out, &named].map(|path| path.to_str().unwrap());
    let ended =
        lab(&["layouts", list, "--meshes", TESTDATA, "--poses", named, "--sweep", "1", "--out", out_text]);
    assert!(ended.status.success(), "{ended:?}");
    assert_eq!(names(&out), ["layouts.csv", "layouts.json", "layouts.md"]);
    let json: Value = serde_json::from_slice(&fs::read(out.join("layouts.json")).unwrap()).unwrap();
    let rows = json["rows"].as_array().unwrap();
    // Six profiles, two encodings, two questions.
    assert_eq!(rows.len(), 6 * 2 * 2);
    assert_eq!(fs::read_to_string(out.join("layouts.csv")).unwrap().lines().count(), 1 + rows.len());
    let figure = |profile: &str, question: &str, field: &str| {
        let row = rows.iter().find(|row| row["profile"] == profile && row["question"] == question).unwrap();
        row[field].as_f64().unwrap()
    };
    for row in rows {
        assert_eq!(row["poses"], 2);
        assert!(row["cold_ns_median"].as_f64().unwrap() > 0.0, "{row}");
        assert!(row["in_vain"].as_f64().is_none_or(|share| (0.0..=1.0).contains(&share)), "{row}");
    }
    let tests = |profile| figure(profile, "distance", "walked_node_tests");
    assert!(tests("dop26-u8-wide") < tests("dop6-u8"));
    // Of the same directions, codes of eight bits are tighter than those of four.
    let in_vain = |profile| figure(profile, "distance", "in_vain");
    assert!(in_vain("dop26-u8-wide") < in_vain("dop26-u4"));
}
