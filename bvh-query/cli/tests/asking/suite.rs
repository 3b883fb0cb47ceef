//! Checks `cbvh suite`: one line out per line in, the answers of the suite's protocol, and refusals that do not end it.

use crate::common::place;
use serde_json::{Value, json};
use std::fmt::Display;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

/// Sends each line only when the line before has been answered, as the suite does.
fn talk(lines: &[impl Display]) -> Vec<Value> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_cbvh"))
        .arg("suite")
        .env_remove("CBVH_ISA")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut input, mut output) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
    let answers = lines
        .iter()
        .map(|line| {
            writeln!(input, "{line}").unwrap();
            let mut answer = String::new();
            output.read_line(&mut answer).unwrap();
            serde_json::from_str(&answer).unwrap()
        })
        .collect();
    drop(input);
    assert!(child.wait().unwrap().success());
    answers
}

/// A tetrahedron with a corner at the origin and edges of this length along the axes.
fn corner(name: &str, length: f64) -> Value {
    json!({
        "mesh": name,
        "vertices": [[0, 0, 0], [length, 0, 0], [0, length, 0], [0, 0, length]],
        "triangles": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    })
}

fn at(x: f64, y: f64, z: f64) -> Value {
    json!([1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z])
}

#[test]
fn every_question_has_its_answer() {
    let about_one = |id: u32, ask: &str, more: Value| {
        let mut line = json!({"id": id, "ask": ask, "a": "large"});
        line.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        line
    };
    let about_two = |id: u32, ask: &str, pose: Value| json!({"id": id, "ask": ask, "a": "large", "b": "small", "pose": pose});
    let answers = talk(&[
        json!({"hello": 1}),
        corner("large", 4.0),
        corner("small", 0.5),
        about_two(1, "collide", at(4.0, 0.0, 0.0)),
        about_two(2, "collide", at(4.0, 0.0, 1e-9)),
        about_two(3, "contacts", at(-0.5, 0.25, 0.25)),
        about_two(4, "distance", at(-1.5, 0.0, 0.0)),
        about_two(5, "relation", at(0.5, 0.5, 0.5)),
        json!({"id": 6, "ask": "within", "a": "large", "b": "small", "pose": at(-1.5, 0.0, 0.0), "within": 1.0}),
        about_two(7, "penetration", at(-0.25, 1.0, 1.0)),
        json!({"id": 8, "ask": "motion", "a": "large", "b": "small", "start": at(-2.5, 0.0, 0.0), "end": at(0.0, 0.0, 0.0)}),
        json!({"id": 9, "ask": "motion", "a": "large", "b": "small", "start": at(-2.5, 0.0, 0.0), "end": at(-2.5, 9.0, 0.0)}),
        about_one(10, "closest", json!({"point": [-3, 0, 0]})),
        about_one(11, "side", json!({"point": [1, 1, 1]})),
        about_one(12, "side", json!({"point": [4, 0, 0]})),
        about_one(13, "ray", json!({"origin": [-1, 0.5, 0.5], "direction": [2, 0, 0]})),
        about_one(14, "ray", json!({"origin": [-1, 0.5, 0.5], "direction": [-2, 0, 0]})),
        about_one(15, "segment", json!({"from": [-1, 1, 1], "to": [0, 1, 1]})),
        about_one(16, "self_contacts", json!({})),
    ]);
    assert_eq!((&answers[0]["hello"], &answers[0]["name"]), (&json!(1), &json!("cbvh")));
    assert_eq!(answers[1], json!({"mesh": "large", "triangles": 4}));
    let of = |id: usize| &answers[id + 2];
    (1..=16).for_each(|id| assert_eq!(of(id)["id"], json!(id)));
    assert_eq!((&of(1)["answer"], &of(2)["answer"]), (&json!(true), &json!(false)));
    // The tip of the small one, a corner of three of its triangles, touches the face at x = 0.
    assert_eq!(of(3)["answer"], json!([[2, 0], [2, 1], [2, 3]]));
    assert_eq!((&of(4)["answer"], &of(6)["answer"]), (&json!(1.0), &json!(true)));
    assert_eq!(of(5)["answer"], json!("b in a"));
    let (lower, upper) = (of(7)["lower"].as_f64().unwrap(), of(7)["upper"].as_f64().unwrap());
    assert!(0.0 < lower && lower <= 0.25 && (0.25..0.2501).contains(&upper), "{}", of(7));
    let times = [&of(8)["free_until"], &of(8)["touching_at"]].map(|time| time.as_f64().unwrap());
    assert!(of(8)["answer"] == json!(false) && times[0] <= 0.8 && 0.8 <= times[1], "{}", of(8));
    assert_eq!((&of(9)["answer"], &of(10)["answer"]), (&json!(true), &json!(3.0)));
    assert_eq!((&of(11)["answer"], &of(12)["answer"]), (&json!("inside"), &json!("on")));
    assert_eq!((&of(13)["t"], &of(14)["answer"]), (&json!(0.5), &json!(false)));
    assert_eq!((&of(15)["answer"], &of(16)["answer"]), (&json!(true), &json!([])));
}

#[test]
fn coordinates_that_single_precision_does_not_hold_are_answered_exactly() {
    let box_between = |name: &str, x: [f64; 2]| {
        let corners: Vec<[f64; 3]> =
            (0..8).map(|i| [x[i & 1], [0.1, 0.7][i >> 1 & 1], [1e9, 1e9 + 0.3][i >> 2]]).collect();
        // Two triangles for each side, across z, y and x.
        let z = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6]];
        let y = [[0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7]];
        let x = [[0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]];
        let triangles = [z, y, x].concat();
        json!({"mesh": name, "vertices": corners, "triangles": triangles})
    };
    let collide =
        |id: u32, b: &str| json!({"id": id, "ask": "collide", "a": "a", "b": b, "pose": at(0.0, 0.0, 0.0)});
    let answers = talk(&[
        json!({"hello": 1}),
        box_between("a", [-0.2, 0.3]),
        box_between("touching", [0.3, 0.9]),
        box_between("apart", [0.3_f64.next_up(), 0.9]),
        collide(1, "touching"),
        collide(2, "apart"),
    ]);
    assert_eq!(answers[0]["coordinates"], json!("f64"));
    assert_eq!((&answers[4]["answer"], &answers[5]["answer"]), (&json!(true), &json!(false)));
}

#[test]
fn meshes_that_do_not_close_have_no_relation_unless_they_touch() {
    let triangle =
        json!({"mesh": "t", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]});
    let relation = |id: u32, a: &str, b: &str, pose: Value| json!({"id": id, "ask": "relation", "a": a, "b": b, "pose": pose});
    let answers = talk(&[
        corner("large", 4.0),
        triangle,
        relation(1, "large", "t", at(9.0, 0.0, 0.0)),
        relation(2, "t", "large", at(9.0, 0.0, 0.0)),
        relation(3, "large", "t", at(0.5, 0.5, 0.5)),
        relation(4, "large", "t", at(0.0, 0.0, 0.0)),
        relation(5, "large", "large", at(9.0, 0.0, 0.0)),
    ]);
    let found: Vec<&Value> = answers[2..].iter().map(|answer| &answer["answer"]).collect();
    assert_eq!(json!(found), json!(["undefined", "undefined", "undefined", "touching", "apart"]));
}

#[test]
fn what_has_no_answer_is_refused_and_the_next_line_is_answered() {
    let stretched = json!([2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);
    let asked = |id: u32, ask: &str, b: &str, pose: Value| json!({"id": id, "ask": ask, "a": "large", "b": b, "pose": pose});
    let refused = [
        json!({"mesh": "broken", "vertices": [["nan", 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}),
        json!({"mesh": "broken", "vertices": [["-inf", 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}),
        // Files store multiples of 2^-180.
        json!({"mesh": "broken", "vertices": [[1e-60, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}),
        json!({"mesh": "broken", "vertices": [[0, 0, 0]], "triangles": [[0, 1, 2]]}),
        json!({"mesh": "broken", "vertices": [], "triangles": []}),
        asked(1, "collide", "broken", at(0.0, 0.0, 0.0)),
        asked(2, "collide", "unknown", at(0.0, 0.0, 0.0)),
        asked(3, "collide", "large", stretched),
        asked(4, "collide", "large", json!(["inf", 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0])),
        asked(5, "volume", "large", at(0.0, 0.0, 0.0)),
        asked(6, "within", "large", at(0.0, 0.0, 0.0)),
        json!({"id": 7, "ask": "side", "a": "large", "point": ["nan", 0, 0]}),
        json!({"id": 8, "ask": "ray", "a": "large", "origin": [0, 0, 0], "direction": [0, 0, 0]}),
        json!({"id": 9, "ask": "side", "a": "large", "point": "here"}),
        json!({"id": 10}),
        json!({"hello": 2}),
        json!({"mesh": "broken"}),
        json!({"mesh": 3}),
        json!({}),
        json!([]),
        json!("hello"),
    ];
    let mut lines = vec![corner("large", 4.0)];
    for line in refused {
        lines.extend([line, asked(99, "collide", "large", at(0.0, 0.0, 0.0))]);
    }
    let answers = talk(&lines);
    for (line, answer) in lines.iter().zip(&answers).skip(1) {
        if line["id"] == json!(99) {
            assert_eq!(answer, &json!({"id": 99, "answer": true}));
        } else {
            assert_eq!(answer["refused"], json!(true), "{line}");
            assert!(!answer["reason"].as_str().unwrap().is_empty() && answer["id"] == line["id"], "{line}");
        }
    }
}

#[test]
fn a_line_that_is_no_json_is_refused() {
    for answer in talk(&["{", "hello", "\u{0}"]) {
        assert_eq!(answer["refused"], json!(true), "{answer}");
    }
}

/// Writes a tetrahedron with edges of length 1 along the axes, as timed questions send it.
fn write_tetrahedron(file: &Path) {
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].map(f32::to_le_bytes);
    let triangles = [0_u32, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3].map(u32::to_le_bytes);
    std::fs::write(file, [corners.as_flattened(), triangles.as_flattened()].concat()).unwrap();
}

#[test]
fn timed_questions_have_a_time_for_each_pose() {
    let place = place();
    let file = place.join("tetrahedron.mesh");
    write_tetrahedron(&file);
    let mesh = |triangles| json!({"mesh": "t", "file": file, "corners": 4, "triangles": triangles});
    let asked = |a: &str, ask: &str| {
        let poses = [at(3.0, 0.0, 0.0), at(0.5, 0.25, 0.0)];
        json!({"id": 1, "ask": ask, "a": a, "b": "t", "poses": poses, "budget": 60.0})
    };
    let mut batch = asked("t", "distance");
    batch["batch"] = json!(true);
    let answers = talk(&[
        mesh(4),
        json!({"field": "f", "meshes": ["t"], "instances": [[0, at(0.0, 0.0, 0.0)], [0, at(1.0, 0.0, 0.0)]]}),
        asked("t", "collide"),
        asked("t", "distance"),
        asked("t", "contacts"),
        asked("f", "collide"),
        asked("f", "touched"),
        asked("f", "distance"),
        batch,
        asked("t", "touched"),
        asked("f", "contacts"),
        asked("u", "collide"),
        mesh(5),
        asked("t", "collide"),
        json!({"mesh": "t", "file": file, "corners": u64::MAX, "triangles": 4}),
        json!({"mesh": "t", "file": place.join("none"), "corners": 4, "triangles": 4}),
    ]);
    assert!(
        answers[0]["seconds"].as_f64().unwrap() > 0.0 && answers[0]["open_seconds"].as_f64().unwrap() > 0.0
    );
    assert!(answers[0]["bytes"].as_u64().unwrap() > 100 && answers[1]["seconds"].as_f64().is_some());
    for (answer, expected) in answers[2..8].iter().zip([
        Some([0.0, 1.0]),
        Some([2.0, 0.0]),
        None,
        Some([0.0, 1.0]),
        Some([0.0, 2.0]),
        Some([1.0, 0.0]),
    ]) {
        assert_eq!(answer["nanoseconds"].as_array().unwrap().len(), 2, "{answer}");
        if let Some(expected) = expected {
            assert_eq!(answer["answers"], json!(expected));
        }
    }
    assert!(answers[4]["answers"][0] == json!(0.0) && answers[4]["answers"][1].as_f64().unwrap() > 0.0);
    assert_eq!(answers[8]["answers"], json!([2.0, 0.0]));
    assert!(answers[8]["seconds"].as_f64().unwrap() > 0.0 && answers[8]["threads"].as_u64().unwrap() > 0);
    for answer in &answers[9..] {
        assert_eq!(answer["refused"], json!(true), "{answer}");
    }
    // A budget of any size, and a mesh that is sent again while its file is mapped.
    let budget = |seconds: f64| {
        let mut question = asked("t", "collide");
        question["budget"] = json!(seconds);
        question
    };
    let answers = talk(&[mesh(4), mesh(4), budget(-1.0), budget(0.0), budget(1e300)]);
    let counts: Vec<_> =
        answers[2..].iter().map(|answer| answer["answers"].as_array().unwrap().len()).collect();
    assert_eq!(counts, [1, 1, 2]);
}

#[test]
fn rays_and_points_are_timed_one_by_one_and_in_one_call() {
    let place = place();
    let write = |name: &str, numbers: &[f32]| {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(place.join(name), bytes).unwrap();
    };
    write_tetrahedron(&place.join("mesh"));
    write("rays", &[0.25, 0.25, -1.0, 0.0, 0.0, 2.0, 5.0, 5.0, 5.0, 1.0, 0.0, 0.0]);
    write("points", &[0.125, 0.125, 0.125, -1.0, 0.25, 0.25, 0.25, 0.25, 0.0]);
    let mesh = json!({"mesh": "t", "file": place.join("mesh"), "corners": 4, "triangles": 4});
    let set = |name: &str, count: u64, numbers: u64| json!({"probes": name, "file": place.join(name), "count": count, "numbers": numbers});
    let asked = |id: u32, ask: &str, probes: &str, batch: bool| json!({"id": id, "ask": ask, "a": "t", "probes": probes, "budget": 60.0, "batch": batch});
    let questions = [("ray", "rays"), ("hit", "rays"), ("closest", "points"), ("side", "points")];
    let expected = [json!([0.5, -1.0]), json!([1.0, 0.0]), json!([0.125, 1.0, 0.0]), json!([1.0, -1.0, 0.0])];
    let mut lines = vec![mesh, set("rays", 2, 6), set("points", 3, 3)];
    lines.extend(questions.iter().map(|(ask, probes)| asked(1, ask, probes, false)));
    lines.extend(questions.iter().map(|(ask, probes)| asked(2, ask, probes, true)));
    let answers = talk(&lines);
    assert_eq!(
        answers[1..3],
        [json!({"probes": "rays", "count": 2}), json!({"probes": "points", "count": 3})]
    );
    for (singles, (all, expected)) in answers[3..7].iter().zip(answers[7..].iter().zip(&expected)) {
        assert_eq!((&singles["answers"], &all["answers"]), (expected, expected));
        assert_eq!(singles["nanoseconds"].as_array().unwrap().len(), expected.as_array().unwrap().len());
        assert!(all["seconds"].as_f64().unwrap() > 0.0 && all["threads"].as_u64().unwrap() > 0);
    }
    let mut one = asked(1, "ray", "rays", false);
    one["budget"] = json!(0.0);
    lines.truncate(3);
    lines.extend([
        one,
        asked(1, "closest", "rays", false),
        asked(1, "ray", "points", true),
        asked(1, "ray", "unknown", false),
        set("rays", 3, 6),
        set("rays", u64::MAX, 6),
        set("points", 9, 1),
        set("none", 1, 3),
    ]);
    let answers = talk(&lines);
    assert_eq!(answers[3]["answers"], json!([0.5]));
    for answer in &answers[4..] {
        assert_eq!(answer["refused"], json!(true), "{answer}");
    }
}

#[test]
fn a_backend_that_is_unknown_is_an_error() {
    crate::common::cbvh_in(&place(), &["suite", "--isa", "mmx"]).failed(1, &["mmx"]);
}
