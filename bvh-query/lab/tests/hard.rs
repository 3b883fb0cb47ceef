//! Tests `cbvh-lab hard`: it writes three files, finds no wrong answer of cbvh, and counts other libraries' answers
//! correctly.

mod common;

use cbvh_testkit::depth::rounds;
use common::{lab, names};
use std::fs;
use std::path::Path;

fn json(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("hard.json")).unwrap()).unwrap()
}

#[cfg(unix)]
fn program(path: &Path, text: &str) {
    use std::os::unix::fs::PermissionsExt;
    fs::write(path, text).unwrap();
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
}

/// One other library always says 0, one has no answer.
#[cfg(unix)]
#[test]
fn all_answers_are_right_and_others_are_judged() {
    let folder = tempfile::tempdir().unwrap();
    let (out, build) = (folder.path().join("new/out"), folder.path().join("build"));
    fs::create_dir_all(build.join("bin")).unwrap();
    let zero = "#!/bin/sh\necho 0 1 > raw_pose.txt\necho '{\"version\":\"7.5\"}'\n";
    program(&build.join("bin/peer_ode"), zero);
    program(&build.join("bin/peer_cgal"), "#!/bin/sh\nexit 3\n");
    // All cases at full depth.
    let every = (250 / rounds(25)).max(1).to_string();
    let (out_text, build) = (out.to_str().unwrap(), build.to_str().unwrap());
    let ended = lab(&["hard", "--out", out_text, "--peers", build, "--every", &every]);
    assert!(ended.status.success() && ended.stderr.is_empty(), "{ended:?}");
    assert_eq!(names(&out), ["hard.json", "hard.md"]);

    let record = json(&out);
    let cases = record["cases"].as_array().unwrap();
    assert!(cases.len() as u64 >= rounds(25).min(250));
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../spec/hard-cases.md");
    let page = fs::read_to_string(page).unwrap();
    let (mut touching, mut asked) = (0, 0);
    for case in cases {
        let name = case["name"].as_str().unwrap();
        assert!(page.contains(&format!("| **{name}**: ")), "spec/hard-cases.md is older than {name}");
        for order in case["orders"].as_array().unwrap() {
            assert_eq!(order["own"]["wrong"].as_array().unwrap().len(), 0, "{case}");
            assert_eq!(order["own"]["differ"].as_array().unwrap().len(), 0, "{case}");
            if let Some(is_touching) = case["truth"]["touching"].as_bool() {
                touching += u64::from(is_touching);
                asked += 1;
                assert_eq!(order["own"]["collide"], is_touching, "{case}");
            } else {
                assert!(
                    order["own"]["refusal"].is_string() && order["others"].as_array().unwrap().is_empty()
                );
            }
        }
    }
    let count = |peer: usize, what: &str| record["peers"][peer]["modes"][0][what].as_u64().unwrap();
    assert_eq!([count(0, "asked"), count(0, "crashes"), count(0, "wrong")], [asked, asked, 0], "cgal-rigid");
    assert_eq!(
        [count(1, "asked"), count(1, "crashes"), count(1, "wrong")],
        [asked, 0, touching],
        "ode-opcode"
    );
    assert_eq!(record["peers"][1]["version"], "7.5");

    assert!(fs::read_to_string(out.join("hard.md")).unwrap().contains("**0 wrong answers**"));
}

#[test]
fn what_is_missing_is_told_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let out = folder.path().join("out");
    let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
    for (arguments, words) in [
        (&["hard", "--out", file][..], "expected a folder"),
        (&["hard", "--out", out, "--peers", "missing"], "expected programs peer_*, found none"),
    ] {
        let ended = lab(arguments);
        let said = String::from_utf8(ended.stderr).unwrap();
        assert!(ended.status.code() == Some(1) && said.contains(words), "{said}");
    }
    assert_eq!(names(folder.path()), ["file"]);
}
