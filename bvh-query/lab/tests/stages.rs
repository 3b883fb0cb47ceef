//! Tests `cbvh-lab stages`: the table has what a question went through, and shares that add up.
#![cfg(feature = "stages")]

use std::process::Command;

/// Asks twice in a row, with B at A and far away, and returns the table's columns by the name of the stage.
fn table(question: &str) -> Vec<(String, Vec<f64>)> {
    let folder = tempfile::tempdir().unwrap();
    let poses = folder.path().join("poses.txt");
    std::fs::write(&poses, "1 0 0 0 0 1 0 0 0 0 1 0\n# far\n1 0 0 1e4 0 1 0 0 0 0 1 0 # away\n").unwrap();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/ok-everything.cbvh");
    let mut lab = Command::new(env!("CARGO_BIN_EXE_cbvh-lab"));
    lab.args(["stages", mesh, mesh]).arg(&poses).args(["--ask", question, "--repeat", "2", "--rounds", "2"]);
    let ended = lab.env_remove("CBVH_ISA").output().unwrap();
    assert!(ended.status.success() && ended.stderr.is_empty(), "{ended:?}");
    let text = String::from_utf8(ended.stdout).unwrap();
    assert!(text.starts_with(&format!("{question}, 2 poses, each asked 2 times in a row")), "{text}");
    let row = |line: &str| {
        let numbers = line[32..].trim_end_matches('%').split_whitespace().map(|word| word.parse().unwrap());
        (line[..32].trim().to_owned(), numbers.collect())
    };
    text.lines().skip(3).map(row).collect()
}

#[test]
fn stages_have_calls_and_shares_of_their_sum() {
    for question in ["collide", "distance", "contacts"] {
        let table = table(question);
        let of = |name: &str| table.iter().find(|row| row.0 == name).map(|row| &row.1[..]);
        let [around, tested, all] =
            ["around the walk", "testing two packets in f32", "the question, without the clock"]
                .map(|name| of(name).unwrap());
        assert_eq!((around[0], all[3]), (1.0, 100.0));
        // One of both poses has packets to test.
        assert!(tested[0] >= 0.5, "{question}: {tested:?}");
        let shares: f64 = table[..table.len() - 1].iter().map(|row| row.1[3]).sum();
        assert!((shares - 100.0).abs() < 2.0, "{shares}");
    }
}

#[test]
fn poses_that_are_none_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let poses = folder.path().join("poses.txt");
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/ok-everything.cbvh");
    for (text, said) in [
        ("1 0 0\n", "line 1: expected 12 numbers, found 3"),
        ("# none\n", "expected at least one pose"),
        ("\n1 0 0 x 0 1 0 0 0 0 1 0\n", "line 2: "),
        ("1 0 0 nan 0 1 0 0 0 0 1 0\n", "line 1: "),
        ("1 0 0 inf 0 1 0 0 0 0 1 0\n", "line 1: "),
        ("2 0 0 0 0 1 0 0 0 0 1 0\n", "line 1: "),
    ] {
        std::fs::write(&poses, text).unwrap();
        let mut lab = Command::new(env!("CARGO_BIN_EXE_cbvh-lab"));
        let ended = lab.args(["stages", mesh, mesh]).arg(&poses).output().unwrap();
        let error = String::from_utf8(ended.stderr).unwrap();
        assert!(
            !ended.status.success() && error.contains(said) && error.contains("poses.txt"),
            "{text}: {error}"
        );
    }
}
