//! Tests `cbvh motion`: the lines and fields of the contract, equal answers however they are found, and bad files.

use crate::common::{Files as _, Place, backends, cbvh_in, cbvh_with_isa, cube, place, torus};
use std::path::Path;

/// A ring and a cube, and three motions of the cube: through the hole of the ring, into the ring, and far away.
fn world() -> Place {
    let place = place();
    let directory = &place;
    directory.write("cube.obj", cube());
    directory.write("torus.obj", torus(48, 24));
    let pose = |[x, y, z]: [f64; 3]| format!("1 0 0 {x} 0 1 0 {y} 0 0 1 {z}");
    let motion = |from, to| format!("{} {}\n", pose(from), pose(to));
    let motions = [
        "# motions\n".to_owned(),
        motion([-20.0, 0.0, 0.0], [20.0, 0.0, 0.0]),
        "\n".to_owned(),
        motion([-20.0, 20.0, 0.0], [20.0, 20.0, 0.0]),
        motion([0.0, 0.0, 0.0], [0.0, 0.0, 20.0]),
    ];
    directory.write("m.txt", motions.concat());
    place
}

fn motion(directory: &Path, more: &[&str]) -> crate::common::Ended {
    cbvh_in(directory, &[&["motion", "torus.obj", "cube.obj"], more].concat())
}

#[test]
fn lines_and_fields_are_those_of_the_contract() {
    let directory = &world();
    let json = motion(directory, &["m.txt", "--bench", "--out", "raw_%s.txt"]).done().json();
    assert_eq!(
        (&json["peer"], &json["mode"], &json["poses"]),
        (&"cbvh".into(), &"motion".into(), &"m".into())
    );
    assert_eq!((&json["queries"], &json["requested"], &json["near"]), (&3.into(), &3.into(), &0.into()));
    let raw = directory.text("raw_m.txt");
    let lines: Vec<Vec<&str>> = raw.lines().map(|line| line.split(' ').collect()).collect();
    assert_eq!(lines.len(), 3);
    let hits = lines.iter().filter(|words| words[0] == "hit").count();
    assert!(json["hits"] == hits && json["positives"] == hits && hits > 0 && hits < 3, "{raw}");
    for words in &lines {
        assert_eq!(words.len(), if words[0] == "free" { 2 } else { 4 }, "{raw}");
        if words[0] == "hit" {
            let [free_until, touching_at] = [words[1], words[2]].map(|word| word.parse::<f64>().unwrap());
            assert!((0.0..=1.0).contains(&free_until) && free_until <= touching_at && touching_at <= 1.0);
        }
    }
    assert_eq!(lines[1][0], "free");
    let printed: String = lines.iter().map(|words| words[..words.len() - 1].join(" ") + "\n").collect();
    assert_eq!(motion(directory, &["m.txt"]).done().out, printed);
    let records = motion(directory, &["m.txt", "--json"]).done().json_lines();
    assert_eq!(records.len(), 3);
    for (number, (record, words)) in records.iter().zip(&lines).enumerate() {
        assert_eq!((&record["motion"], &record["answer"]), (&number.into(), &words[0].into()), "{record}");
        if words[0] == "hit" {
            let times = ["free_until", "touching_at"].map(|name| record[name].as_f64());
            assert_eq!(times, [words[1], words[2]].map(|word| word.parse().ok()), "{record}");
            assert!(record["distance"] == 0.0 && record["point_a"].is_array(), "{record}");
        }
    }
    let near = motion(directory, &["m.txt", "--bench", "--clearance", "18"]).done().json();
    assert_eq!(near["hits"], 3);
    for isa in backends(directory) {
        for jobs in ["1", "2"] {
            let arguments = ["motion", "torus.obj", "cube.obj", "m.txt", "--bench", "--jobs", jobs];
            let other = cbvh_with_isa(directory, isa, &arguments).done().json();
            assert_eq!((&other["answers_xxh3"], &other["isa"]), (&json["answers_xxh3"], &isa.into()));
        }
    }
}

#[test]
fn one_motion_is_answered_for_a_person() {
    let directory = &world();
    let through = "1 0 0 -20 0 1 0 0 0 0 1 0  1,0,0,20, 0,1,0,0, 0,0,1,0";
    let said = motion(directory, &["--motion", through, "--witness", "w.obj"]).done().out;
    assert!(said.starts_with("free until 0.") && said.contains(", hit at 0."), "{said}");
    assert!(said.contains("distance 0.0 (the meshes touch)"), "{said}");
    assert!(directory.text("w.obj").contains("o segment"));
    let hit = motion(directory, &["--motion", through, "--json"]).done().json();
    assert!(hit["answer"] == "hit" && hit["motion"] == 0 && hit["distance"] == 0.0, "{hit}");
    let away = "1 0 0 90 0 1 0 0 0 0 1 0  1 0 0 99 0 1 0 0 0 0 1 0";
    assert_eq!(motion(directory, &["--motion", away]).done().out, "free\n");
}

#[test]
fn bad_motions_are_named() {
    let directory = &world();
    let identity = "1 0 0 0 0 1 0 0 0 0 1 0";
    let half = "-1 0 0 0 0 -1 0 0 0 0 1 0";
    for (text, words) in [
        (identity.to_owned(), "line 1: expected 24 numbers, two poses of 12 numbers each, found 12"),
        (format!("{identity} {half}"), "line 1: expected a turn of less than half a circle"),
        (format!("# a\n{identity} 2{}", &identity[1..]), "line 2: end: expected a rotation"),
        (format!("x{} {identity}", &identity[1..]), "line 1: start: expected a number, found \"x\""),
        ("# nothing\n".to_owned(), "in at least one line, found none"),
    ] {
        directory.write("m.txt", text);
        motion(directory, &["m.txt", "--out", "raw.txt"]).failed(3, &["m.txt: ", words]);
    }
    motion(directory, &["none.txt"]).failed(2, &["none.txt"]);
    motion(directory, &[]).failed(1, &["MOTIONS"]);
    motion(directory, &["--motion", "1 2"]).failed(3, &["--motion: expected 24 numbers"]);
    motion(directory, &["m.txt", "--tolerance", "0"]).failed(1, &["--tolerance"]);
    motion(directory, &["m.txt", "--clearance", "-1"]).failed(1, &["--clearance"]);
    motion(directory, &["m.txt", "--witness", "w.obj"]).failed(1, &["--motion"]);
    assert!(!directory.join("raw.txt").exists());
}
