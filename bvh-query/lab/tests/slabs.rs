//! Tests `cbvh-lab slabs`: it writes five files, slabs never cost tests, and bytes add up to those of files.

mod common;

use common::{lab, names};
use serde_json::Value;
use std::fs;

const TESTDATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata");

#[test]
fn slabs_never_cost_tests_and_bytes_add_up() {
    let folder = tempfile::tempdir().unwrap();
    let (list, poses) = (folder.path().join("pairs.txt"), folder.path().join("fcl_near.txt"));
    fs::write(&list, "fcl fclenv.obj fclrob.obj\n").unwrap();
    let line = |x: f64| format!("0.6 -0.8 0 {x}  0.8 0.6 0 -1600  0 0 1 -500\n");
    fs::write(&poses, format!("{}{}", line(300.0), line(900.0))).unwrap();
    let (out, named) = (folder.path().join("out"), folder.path().join("%s_near.txt"));
    let [list, out_text, named] = [&list, &out, &named].map(|path| path.to_str().unwrap());
    let files = ["--contact", named, "--distance", named, "--meshes", TESTDATA, "--largest", "1000"];
    let ended = lab(&[&["slabs", list, "--out", out_text, "--limit", "3"], &files[..]].concat());
    assert!(ended.status.success(), "{ended:?}");
    let written = ["slabs-census.csv", "slabs-shares.csv", "slabs.csv", "slabs.json", "slabs.md"];
    assert_eq!(names(&out), written);
    for name in written {
        let text = fs::read_to_string(out.join(name)).unwrap();
        assert!(!text.contains("NaN") && !text.contains("inf"), "{name}");
        assert!(!text.contains(folder.path().to_str().unwrap()), "a path of this machine");
    }
    let json: Value = serde_json::from_slice(&fs::read(out.join("slabs.json")).unwrap()).unwrap();
    let part = |name: &str| json[name].as_array().unwrap().clone();
    let rows = part("rows");
    assert_eq!(fs::read_to_string(out.join("slabs.csv")).unwrap().lines().count(), 1 + rows.len());
    let plain = rows.iter().filter(|row| row["topic"] == "fixed directions" && row["variant"] == "no slab");
    assert_eq!(plain.clone().count(), 6 * 2);
    for plain in plain {
        assert_eq!((plain["count"].as_u64(), plain["poses"].as_str()), (Some(2), Some("near")));
        let same = |row: &&Value| ["base", "pair", "question"].iter().all(|&name| row[name] == plain[name]);
        for row in rows.iter().filter(same) {
            for tests in ["node_tests_mean", "packet_tests_mean"] {
                assert!(row[tests].as_f64() <= plain[tests].as_f64(), "{row} {plain}");
            }
        }
    }
    // Three sets of poses for each way to bound the ball.
    assert_eq!(rows.iter().filter(|row| row["pair"] == "ball 1000").count(), 5 * 3);
    // Two meshes in three layouts. All kinds of bytes stand between the triangles and their sum.
    let census = part("census");
    assert_eq!(census.len(), 2 * 3);
    let csv = fs::read_to_string(out.join("slabs-census.csv")).unwrap();
    for line in csv.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').skip(3).take(15).map(|cell| cell.parse().unwrap()).collect();
        assert!(cells.iter().all(|&bytes| bytes >= 0.0), "{line}");
        assert!((cells[..14].iter().sum::<f64>() - cells[14]).abs() < 1e-9, "{line}");
    }
    // Each child but the root has a slab.
    let shares = part("shares");
    assert_eq!(shares.len(), 2 * 7);
    assert!(shares.iter().all(|share| share["narrower_than_0.75"].as_u64() <= share["children"].as_u64()));
}
