//! Tests `cbvh-lab search`: it goes on where its record ends, repeats a round, and refuses a record that is none.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `cbvh-lab` with these arguments.
fn lab(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cbvh-lab"));
    command.args(arguments).env_remove("CBVH_ISA").output().unwrap()
}

/// Returns the sorted names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort_unstable();
    names
}

#[test]
fn a_search_does_the_rounds_that_its_record_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.jsonl");
    let record = path.to_str().unwrap();
    for all in [2, 4] {
        let ended = lab(&["search", "--threads", "2", "--rounds", "2", "--record", record]);
        assert!(ended.status.success() && ended.stderr.is_empty(), "{ended:?}");
        let said = String::from_utf8(ended.stdout).unwrap();
        assert!(said.contains(&format!("record.jsonl: {all} rounds in ")), "{said}");
        let text = fs::read_to_string(&path).unwrap();
        let done = |line| {
            let done: serde_json::Value = serde_json::from_str(line).unwrap();
            assert!(done["wrong"].is_null(), "{line}");
            // Each kind of round counts its own things.
            let counted = ["pairs", "files"].map(|name| done["counts"][name].as_u64().unwrap_or(0) > 0);
            let round = done["round"].as_u64().unwrap();
            assert_eq!(counted, [round.is_multiple_of(2), !round.is_multiple_of(2)], "{line}");
            round
        };
        let mut rounds: Vec<_> = text.lines().map(done).collect();
        rounds.sort_unstable();
        assert_eq!(rounds, (0..all).collect::<Vec<_>>());
    }
    assert_eq!(names(folder.path()), ["record.jsonl"]);
    fs::write(&path, "[]").unwrap();
    let ended = lab(&["search", "--record", record]);
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(!ended.status.success() && said.contains("line 1: expected a round of a search"), "{said}");
    assert_eq!(fs::read(&path).unwrap(), b"[]");
}

#[test]
fn a_round_is_repeated_by_its_number() {
    for round in ["0", "1"] {
        let [first, again] = [(); 2].map(|()| lab(&["search", "--again", round]));
        assert!(first.status.success() && first.stdout == again.stdout, "{first:?}");
    }
}
