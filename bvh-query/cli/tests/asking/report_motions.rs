//! Tests `cbvh report PAIRS --motions`: its four files show the same figures, and certified answers have no errors.

use crate::common::{Files as _, TESTDATA, cbvh_in, place, torus};
use crate::documents::{
    elements, fetches_nothing, number, pose_shown, report_files, same_figures, same_figures_in_page,
};
use serde_json::Value;
use std::fs;
use std::path::Path;

#[test]
fn four_files_hold_the_same_figures_and_no_answer_contradicts_another() {
    let directory = &place();
    directory.write("torus.obj", torus(24, 12));
    for mesh in ["fclenv.obj", "fclrob.obj"] {
        fs::copy(Path::new(TESTDATA).join(mesh), directory.join(mesh)).unwrap();
    }
    // Through the tube of the ring, and far away from it.
    let pose = |[x, y]: [f64; 2]| format!("1 0 0 {x} 0 1 0 {y} 0 0 1 0.25");
    let motion = |from, to| format!("{} {} # motion\n", pose(from), pose(to));
    let motions = [motion([-20.0, 0.0], [20.0, 0.0]), motion([-20.0, 20.0], [20.0, 20.0])];
    directory.write("tori.txt", motions.concat());
    let list = "fcl fclenv.obj fclrob.obj\ntori torus.obj torus.obj tori.txt # with motions\n";
    directory.write("pairs.txt", list);
    let said = directory.cbvh("report pairs.txt --motions --out out --quick").done().out;
    let [csv, html, json, svg] = report_files(directory, "out");
    // The second page shows where the only hit touches.
    let pose = pose_shown(&directory.text("out/view-2.html"));
    let asked = ["query", "torus.obj", "torus.obj", "--mode", "collide", "--pose", &pose];
    assert!(cbvh_in(directory, &asked).done().out.starts_with("the meshes touch"));
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["wrong"].as_array().unwrap().len(), 0);
    let rows = json["rows"].as_array().unwrap();
    // There are two pairs, and seven numbers of samples beside two certified answers.
    assert_eq!(rows.len(), 2 * (7 + 2));
    same_figures(&csv, rows);
    rows.iter().for_each(check);

    let in_page = elements(&html);
    let shown = same_figures_in_page(&in_page, rows);
    // Missed, their share, and three times in each row; in some also how late contacts are.
    assert!(shown > 2 * 9 * 5, "{shown}");
    fetches_nothing(&in_page);
    for document in [&in_page, &elements(&svg)] {
        let marks = document.iter().filter(|(name, _)| name == "polygon").count();
        assert!(marks >= 2 * 9, "{marks}");
    }
    let [fcl, tori] = [&json["pairs"][0], &json["pairs"][1]];
    assert!(fcl["motions_from"].as_str().unwrap().starts_with("made") && fcl["motions"] == 10);
    assert_eq!(tori["motions_from"], "tori");
    assert_eq!([&tori["motions"], &tori["hits"], &tori["free"]], [2, 1, 1]);
    assert_eq!((&tori["undecided"], &json["settings"]["motions"]), (&0.into(), &10.into()));
    assert!(
        said.contains("18 rows, 0 wrong results")
            && said.contains("tori: 2 motions: 1 certified hits, 1 free, 0 undecided"),
        "{said}"
    );
}

/// Checks what holds for every row.
fn check(row: &Value) {
    let at = |field| number(row, field);
    for always in ["ns_median", "ns_p90", "ns_mean", "missed", "missed_share"] {
        assert!(at(always).is_some(), "{row}");
    }
    assert!(at("ns_q1") <= at("ns_median") && at("ns_median") <= at("ns_q3"), "{row}");
    assert_eq!(at("missed").unwrap() / at("hits").unwrap(), at("missed_share").unwrap(), "{row}");
    assert!((1.0..=2.0).contains(&at("rounds").unwrap()) && at("late_median") <= at("late_max"), "{row}");
    let (method, samples) = (row["method"].as_str().unwrap(), row["samples"].as_f64());
    assert_eq!(at("undecided").is_none(), samples.is_some(), "{row}");
    match samples {
        Some(_) => {
            assert_eq!(method, "ordered samples", "{row}");
            assert!(at("late_max").is_none_or(|late| (0.0..=1.0).contains(&late)), "{row}");
        }
        None => {
            assert_eq!((at("missed"), at("undecided")), (Some(0.0), Some(0.0)), "{row}");
            assert_eq!(method == "is_free", at("late_max").is_none(), "{row}");
            assert!(at("late_max").is_none_or(|late| late < 1e-4), "{row}");
        }
    }
}
