//! What parts have in common: volumes, boxes and pierced thicknesses, in everything that the command writes.

use super::bcf::unzip;
use super::{block, close, find, parts};
use crate::common::Files as _;
use crate::documents::rows_of;
use serde_json::{Value, json};

/// A duct through the plate, and all others, with what they have in common.
#[test]
fn magnitudes_are_those_of_boxes() {
    let directory = &parts();
    directory.write("parts/duct.obj", block([7.0, 7.0, -1.0], [8.0, 7.5, 3.0], false));
    let plain = directory.cbvh("clash parts --json").done();
    directory.write("plain.json", plain.out.as_bytes());
    assert!(find(&plain.json(), "duct", "plate").get("volume").is_none());
    let answer = directory
        .cbvh("clash parts --magnitudes --json --csv c.csv --bcf c.bcfzip --baseline plain.json")
        .done()
        .json();
    // Dividing a class is no change.
    assert_eq!(answer["statuses"], json!({"new": 0, "changed": 0, "same": 6, "gone": 0}));
    assert_eq!((&answer["classes"]["piercing"], &answer["classes"]["overlapping"]), (&json!(1), &json!(0)));
    let near = |value: &Value, expected: f64| (value.as_f64().unwrap() - expected).abs() <= 1e-12 * expected;
    for (a, b, class, volume, pierced, lo, hi) in [
        ("duct", "plate", "piercing", 0.5, json!([null, 1.0]), [7.0, 7.0, 0.0], [8.0, 7.5, 1.0]),
        ("deep", "plate", "protruding", 0.25, json!([null, null]), [2.0, 2.0, 0.75], [3.0, 3.0, 1.0]),
        ("inner", "plate", "contained", 0.125, json!([null, null]), [4.0, 4.0, 0.25], [4.5, 4.5, 0.75]),
        ("plate", "twin", "duplicated", 100.0, json!([null, null]), [0.0; 3], [10.0, 10.0, 1.0]),
    ] {
        let clash = find(&answer, a, b);
        assert_eq!(
            (&clash["class"], &clash["pierced"], &clash["reason"]),
            (&json!(class), &pierced, &Value::Null),
            "{clash}"
        );
        assert!(near(&clash["volume"], volume) && clash["volume_error"].as_f64().unwrap() < 1e-10, "{clash}");
        assert!(close(&clash["box"][0], lo) && close(&clash["box"][1], hi), "{clash}");
    }
    let open = find(&answer, "open", "plate");
    assert_eq!(
        (&open["volume"], &open["box"], &open["reason"]),
        (&Value::Null, &Value::Null, &json!("a is not closed"))
    );
    assert!(find(&answer, "flush", "plate").get("volume").is_none());
    let rows = rows_of(&directory.text("c.csv"));
    let duct = rows.iter().find(|row| row["a"] == "duct").unwrap();
    assert_eq!((&*duct["pierced_a"], &*duct["pierced_b"], &*duct["high_y"]), ("", "1.0", "7.5"));
    let topics = unzip(&std::fs::read(directory.join("c.bcfzip")).unwrap());
    assert!(topics.values().any(|text| text.contains("piercing: duct | plate")
        && text.contains("volume 0.5, 1 of the second pierced")));

    let listed = |arguments: &str| -> Vec<String> {
        let answer = directory.cbvh(&format!("clash parts --json {arguments}")).done().json();
        let names = answer["clashes"].as_array().unwrap().iter();
        names.map(|clash| clash["a"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(listed("--sort volume"), ["plate", "duct", "deep", "inner", "open", "flush"]);
    assert_eq!(listed("--min-volume 0.25"), ["duct", "deep", "open", "plate"]);
    let text = directory.cbvh("clash parts --magnitudes").done().out;
    assert!(
        text.contains("volume 0.5, 1 of the second pierced") && text.contains("a is not closed"),
        "{text}"
    );
    let ended = directory.cbvh("clash parts --magnitudes --fail-on overlapping");
    ended.failed(5, &["found 2; the first: duct | plate"]);
    directory.cbvh("clash parts --min-volume -1").failed(1, &["--min-volume", "-1"]);
    directory.cbvh("clash parts --sort depth").failed(1, &["--sort", "depth", "volume"]);
}
