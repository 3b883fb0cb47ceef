//! Tests `cbvh-lab search`: it goes on where its record ends, repeats a round, and refuses a record that is none.

mod common;

use common::{lab, names};
use std::fs;

#[test]
fn a_search_goes_on_where_its_record_ends() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.json");
    let record = path.to_str().unwrap();
    let json = || -> serde_json::Value { serde_json::from_slice(&fs::read(&path).unwrap()).unwrap() };
    let mut pairs = 0;
    for rounds in [2, 4] {
        let ended =
            lab(&["search", "--kinds", "pairs", "--threads", "2", "--rounds", "2", "--record", record]);
        assert!(ended.status.success() && ended.stderr.is_empty(), "{ended:?}");
        let json = json();
        assert_eq!(json["kinds"]["pairs"]["rounds"], serde_json::json!([[0, rounds]]));
        let counted = json["kinds"]["pairs"]["counts"]["pairs"].as_u64().unwrap();
        assert!(counted > pairs && json["findings"].as_array().unwrap().is_empty());
        pairs = counted;
    }
    assert_eq!(names(folder.path()), ["record.json"]);
    assert_eq!(json()["sessions"].as_array().unwrap().len(), 2);
    fs::write(&path, "[]").unwrap();
    let ended = lab(&["search", "--record", record]);
    assert!(
        !ended.status.success()
            && String::from_utf8_lossy(&ended.stderr).contains("expected the record of a search")
    );
    assert_eq!(fs::read(&path).unwrap(), b"[]");
}

#[test]
fn every_kind_of_round_is_repeated_by_its_number() {
    for kind in ["pairs", "hostile", "probes", "motions"] {
        let [first, again] = [(); 2].map(|()| lab(&["search", "--kinds", kind, "--again", "1"]));
        assert!(first.status.success() && first.stdout == again.stdout, "{first:?}");
    }
}
