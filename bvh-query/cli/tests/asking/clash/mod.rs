//! Tests `cbvh clash`: classes, depths and places of small assemblies, however they are given, and what is written about them.

mod bcf;
mod magnitudes;

use crate::common::{Files as _, Place, backends, cbvh_in, cbvh_with_isa, place};
use crate::documents::rows_of;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Returns a box with faces that look outwards, without the last one if it is open.
fn block(lo: [f64; 3], hi: [f64; 3], is_open: bool) -> String {
    let faces = ["-8 -6 -5 -7", "-4 -3 -1 -2", "-8 -7 -3 -4", "-6 -2 -1 -5", "-8 -4 -2 -6", "-7 -5 -1 -3"];
    let corner = |number: usize| [0, 1, 2].map(|k| if number >> k & 1 == 1 { hi[k] } else { lo[k] });
    let vertices = (0..8).map(corner).map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n"));
    let faces = faces[..6 - usize::from(is_open)].iter().map(|face| format!("f {face}\n"));
    vertices.chain(faces).collect()
}

/// The parts of an assembly on a plate with its upper side at 1.
const PARTS: [(&str, [f64; 3], [f64; 3]); 7] = [
    ("deep", [2.0, 2.0, 0.75], [3.0, 3.0, 5.0]),
    ("flush", [5.0, 5.0, 1.0], [6.0, 6.0, 2.0]),
    ("inner", [4.0, 4.0, 0.25], [4.5, 4.5, 0.75]),
    ("near", [5.0, 7.0, 1.25], [6.0, 8.0, 2.0]),
    ("open", [9.0, 9.0, 0.5], [9.5, 9.5, 3.0]),
    ("plate", [0.0; 3], [10.0, 10.0, 1.0]),
    ("twin", [0.0; 3], [10.0, 10.0, 1.0]),
];

/// Makes a folder `parts` with a file for each part.
fn parts() -> Place {
    let place = place();
    std::fs::create_dir_all(place.join("parts/sub")).unwrap();
    for (name, lo, hi) in PARTS {
        let folder = if name == "near" { "parts/sub" } else { "parts" };
        place.write(&format!("{folder}/{name}.obj"), block(lo, hi, name == "open"));
    }
    place
}

/// Returns a binary glTF file of unit cubes, one node at each place.
fn glb(nodes: &[(&str, [f64; 3])], shares_mesh: bool) -> Vec<u8> {
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let positions = (0..8u32).flat_map(|corner| [0, 1, 2].map(|k| (corner >> k & 1) as f32));
    let mut buffer: Vec<u8> = positions.flat_map(f32::to_le_bytes).collect();
    let corners = faces.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
    buffer.extend(corners.flat_map(u32::to_le_bytes));
    let mesh = json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]});
    let node = |(number, (name, at)): (usize, &(&str, [f64; 3]))| json!({"name": name, "translation": at, "mesh": if shares_mesh { 0 } else { number }});
    let document = json!({
        "asset": {"version": "2.0"},
        "nodes": nodes.iter().enumerate().map(node).collect::<Vec<_>>(),
        "meshes": vec![mesh; if shares_mesh { 1 } else { nodes.len() }],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 36, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 144}],
        "buffers": [{"byteLength": buffer.len()}],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunk =
        |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes(), &kind[..], bytes].concat();
    let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &buffer)].concat();
    [b"glTF", &2u32.to_le_bytes()[..], &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat()
}

/// Returns the classes of an answer by the names of the parts.
fn classes(answer: &Value) -> BTreeMap<(String, String), String> {
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let clashes = answer["clashes"].as_array().unwrap().iter();
    clashes.map(|clash| ((text(&clash["a"]), text(&clash["b"])), text(&clash["class"]))).collect()
}

/// Makes such a table.
fn expected(clashes: &[(&str, &str, &str)]) -> BTreeMap<(String, String), String> {
    clashes.iter().map(|(a, b, class)| ((a.to_string(), b.to_string()), class.to_string())).collect()
}

fn find<'a>(answer: &'a Value, a: &str, b: &str) -> &'a Value {
    answer["clashes"].as_array().unwrap().iter().find(|clash| clash["a"] == a && clash["b"] == b).unwrap()
}

fn close(value: &Value, expected: [f64; 3]) -> bool {
    let value: Vec<f64> = value.as_array().unwrap().iter().map(|c| c.as_f64().unwrap()).collect();
    value.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-3)
}

/// Returns an answer without what differs from run to run.
fn timeless(mut answer: Value) -> Value {
    answer.as_object_mut().unwrap().remove("seconds");
    answer
}

#[test]
fn each_class_is_found_in_a_folder() {
    let directory = &parts();
    let answer = directory.cbvh("clash parts --clearance 0.5 --json").done().json();
    let all = [
        ("deep", "plate", "overlapping"),
        ("flush", "plate", "touching"),
        ("inner", "plate", "contained"),
        ("open", "plate", "intersecting"),
        ("plate", "sub/near", "near"),
        ("plate", "twin", "duplicated"),
    ];
    assert_eq!(classes(&answer), expected(&all));
    let order: Vec<&str> =
        answer["clashes"].as_array().unwrap().iter().map(|of| of["class"].as_str().unwrap()).collect();
    assert_eq!(order, ["overlapping", "intersecting", "duplicated", "contained", "near", "touching"]);
    assert_eq!(
        (&answer["parts"], &answer["triangles"], &answer["copies"]),
        (&json!(7), &json!(82), &json!(1))
    );
    assert_eq!(answer["units"], "mesh units");
    assert_eq!(answer["classes"]["near"], 1);
    assert_eq!(answer["classes"]["undecided"], 0);
    let deep = find(&answer, "deep", "plate");
    let (lower, upper) = (deep["lower"].as_f64().unwrap(), deep["upper"].as_f64().unwrap());
    assert!(lower <= 0.25 && 0.25 <= upper && upper - lower < 0.03, "{deep}");
    // The second part, the plate, moves down.
    assert!(close(&deep["translation"], [0.0, 0.0, -0.25]), "{deep}");
    let near = find(&answer, "plate", "sub/near");
    assert_eq!(
        (&near["distance"], &near["lower"], &near["translation"]),
        (&json!(0.25), &Value::Null, &Value::Null)
    );
    assert!(near["point"][2].as_f64().unwrap() > 1.0);
    assert_eq!(find(&answer, "inner", "plate")["relation"], 2);

    // The same for a person, and with less in the list.
    let text = directory.cbvh("clash parts --clearance 0.5").done().out;
    let words = "6 clashes: 1 overlapping, 1 intersecting, 1 duplicated, 1 contained, 1 near, 1 touching\n";
    assert!(
        text.contains(words) && text.contains("in mesh units") && text.contains("plate | sub/near"),
        "{text}"
    );
    assert!(text.contains("copies of earlier parts in their places, not compared with others: 1\n"));
    let text = directory.cbvh("clash parts --limit 2").done().out;
    assert!(text.contains("and 3 more: --limit 0 lists all\n") && !text.contains("contained  "), "{text}");
    let text = directory
        .cbvh("clash parts/near.obj parts/flush.obj".replace("near", "sub/near").as_str())
        .done()
        .out;
    assert!(text.ends_with("no clashes\n"), "{text}");

    // The table has the same rows.
    let again = directory.cbvh("clash parts --clearance 0.5 --csv c.csv --json").done().json();
    assert_eq!(timeless(again), timeless(answer.clone()));
    let rows = rows_of(&directory.text("c.csv"));
    assert_eq!(rows.len(), 6);
    for (row, clash) in rows.iter().zip(answer["clashes"].as_array().unwrap()) {
        assert!(["id", "class", "a", "b"].iter().all(|field| clash[field] == row[*field]));
        assert_eq!(row["x"].parse().ok(), clash["point"][0].as_f64());
        assert_eq!(row["upper"].parse().ok(), clash["upper"].as_f64());
        assert_eq!(row["translation_z"].parse().ok(), clash["translation"][2].as_f64());
    }
    directory.cbvh("clash parts/flush.obj parts/sub/near.obj --csv none.csv --json").done();
    assert_eq!(directory.text("none.csv").lines().count(), 1);
}

#[test]
fn the_tolerance_tells_touching_from_overlapping() {
    let directory = &parts();
    let class = |more: &str| {
        let answer =
            directory.cbvh(&format!("clash parts/deep.obj parts/plate.obj --json{more}")).done().json();
        answer["clashes"][0]["class"].as_str().unwrap().to_owned()
    };
    let found = ["", " --tolerance 0.2", " --tolerance 0.3", " --visits 0"].map(class);
    assert_eq!(found[..3], ["overlapping", "overlapping", "touching"]);
    assert!(["overlapping", "undecided"].contains(&&*found[3]));
}

/// Parts a little above a plate and a little in it, with a tolerance that is larger or smaller than that.
#[test]
fn parts_that_nearly_meet_touch_from_both_sides() {
    let directory = &place();
    let little = 2f64.powi(-20);
    let block_at = |z: f64| block([1.0, 1.0, z], [2.0, 2.0, 3.0], false);
    directory.write("plate.obj", block([0.0; 3], [9.0, 9.0, 1.0], false));
    directory.write("above.obj", block_at(1.0 + little));
    directory.write("below.obj", block([5.0, 5.0, 1.0 - little], [6.0, 6.0, 3.0], false));
    let ask = |options: &str| {
        let command = format!("clash plate.obj above.obj below.obj --json {options}");
        directory.cbvh(&command).done().json()
    };
    let answer = ask("--tolerance 1e-6");
    let both = [("plate", "above", "touching"), ("plate", "below", "touching")];
    assert_eq!(classes(&answer), expected(&both));
    let above = find(&answer, "plate", "above");
    let fields = ["relation", "distance", "lower", "upper", "translation"].map(|name| above[name].clone());
    assert_eq!(fields, [json!(1), json!(little), json!(0.0), json!(0.0), Value::Null]);
    let z = above["point"][2].as_f64().unwrap();
    assert!(1.0 < z && z < 1.0 + little, "{above}");
    let text = directory.cbvh("clash plate.obj above.obj --tolerance 1e-6").done().out;
    assert!(text.contains("touching  9.53674e-7 apart  "), "{text}");
    // At the tolerance they touch, and below it they do not.
    assert_eq!(find(&ask(&format!("--tolerance {little:?}")), "plate", "above")["class"], "touching");
    for options in ["--tolerance 0".to_owned(), format!("--tolerance {:?}", little.next_down())] {
        let found = classes(&ask(&options));
        assert!(found.len() == 1 && found.keys().all(|(_, b)| b == "below"), "{options}: {found:?}");
        let found = ask(&format!("{options} --clearance 1e-5"));
        assert_eq!(find(&found, "plate", "above")["class"], "near");
    }
    assert_eq!(find(&ask("--tolerance 5e-7"), "plate", "below")["class"], "overlapping");
    directory
        .cbvh("clash plate.obj above.obj --tolerance 1e-6 --fail-on touching")
        .failed(5, &["plate | above"]);

    // What an earlier version wrote about the same parts with a face in common: the way of a rounding does not count.
    let id = above["id"].as_str().unwrap();
    let old = json!({"clearance": 0.0, "tolerance": 1e-5, "clashes": [{"id": id, "class": "touching", "a": "plate",
        "b": "above", "relation": 0, "distance": 0.0, "lower": 0.0, "upper": 3.5e-13, "translation": [0.0, 0.0, -3.5e-13],
        "point": [1.0, 1.0, 1.0]}]});
    directory.write("old.json", old.to_string());
    for z in [1.0 + little, 1.0, 1.0 - little] {
        directory.write("above.obj", block_at(z));
        let command = "clash plate.obj above.obj --tolerance 1e-5 --baseline old.json --json";
        assert_eq!(directory.cbvh(command).done().json()["clashes"][0]["status"], "same", "{z}");
    }
}

#[test]
fn all_backends_and_threads_answer_the_same() {
    let directory = &parts();
    let arguments = ["clash", "parts", "--clearance", "0.5", "--json"];
    let answer = timeless(cbvh_in(directory, &arguments).done().json());
    for jobs in ["1", "2"] {
        let again = cbvh_in(directory, &[&arguments[..], &["--jobs", jobs]].concat()).done().json();
        assert_eq!(timeless(again), answer);
    }
    for isa in backends(directory) {
        assert_eq!(timeless(cbvh_with_isa(directory, isa, &arguments).done().json()), answer, "{isa}");
    }
}

#[test]
fn inputs_of_all_kinds_hold_the_same_parts() {
    let directory = &parts();
    let several = |names: &[&str]| -> String {
        let of = |name: &&str| PARTS.into_iter().find(|part| part.0 == *name).unwrap();
        names.iter().map(of).map(|(name, lo, hi)| format!("o {name}\n{}", block(lo, hi, false))).collect()
    };
    directory.write("all.obj", several(&["deep", "plate", "flush"]));
    let clashes = |arguments: &str| {
        directory.cbvh(&format!("clash {arguments} --json")).done().json()["clashes"].clone()
    };
    let split = clashes("all.obj");
    let all = [("deep", "plate", "overlapping"), ("plate", "flush", "touching")];
    assert_eq!(classes(&json!({ "clashes": split })), expected(&all));
    directory.cbvh("bake all.obj -o all.cbvh --split-objects -q").done();
    directory.cbvh("bake all.obj -o scene.cbvh --scene -q").done();
    assert_eq!(clashes("all.cbvh"), split);
    assert_eq!(clashes("scene.cbvh"), split);
    // Several files, each a part with the name of its file.
    assert_eq!(clashes("parts/deep.obj parts/plate.obj parts/flush.obj"), split);
    directory.cbvh("bake parts -o baked -q").done();
    assert_eq!(clashes("baked/deep.cbvh parts/plate.obj baked/flush.cbvh"), split);
    // Objects of one of several files, and names that occur again.
    directory.write("more.obj", several(&["plate", "deep"]));
    let all = [
        ("deep", "more/plate", "overlapping"),
        ("more/plate", "more/deep", "overlapping"),
        ("deep", "more/deep", "duplicated"),
        ("deep", "deep#2", "duplicated"),
    ];
    let more = clashes("parts/deep.obj more.obj parts/deep.obj --split-objects");
    assert_eq!(classes(&json!({ "clashes": more })), expected(&all));
}

#[test]
fn nodes_of_a_gltf_file_are_parts() {
    let directory = &place();
    let nodes = [
        ("a", [0.0; 3]),
        ("b", [0.75, 0.0, 0.0]),
        ("b", [0.75, 0.0, 0.0]),
        ("c", [5.0; 3]),
        ("d", [1.75, 0.0, 0.0]),
    ];
    for (name, shares_mesh) in [("shared.glb", true), ("own.glb", false)] {
        directory.write(name, glb(&nodes, shares_mesh));
        let answer = directory.cbvh(&format!("clash {name} --json")).done().json();
        let all = [("a", "b", "overlapping"), ("b", "b.2", "duplicated"), ("b", "d", "touching")];
        assert_eq!(classes(&answer), expected(&all), "{name}");
        assert_eq!((&answer["units"], &answer["copies"]), (&json!("metres"), &json!(1)));
    }
    directory.cbvh("bake shared.glb -o scene.cbvh --scene -q").done();
    let [glb, baked] = ["shared.glb", "scene.cbvh"]
        .map(|name| directory.cbvh(&format!("clash {name} --json")).done().json()["clashes"].clone());
    assert_eq!(glb, baked);
}

#[test]
fn many_parts_in_one_place_take_little_time() {
    let directory = &place();
    let nodes = vec![("same", [1.0, 2.0, 3.0]); 20_000];
    directory.write("many.glb", glb(&nodes, true));
    let answer = directory.cbvh("clash many.glb --json").done().json();
    assert_eq!((&answer["classes"]["duplicated"], &answer["copies"]), (&json!(19_999), &json!(19_999)));
    directory.write("cube.obj", block([0.0; 3], [1.0; 3], false));
    directory.write("parts.jsonl", "{\"file\": \"cube.obj\"}\n".repeat(20_000));
    let answer = directory.cbvh("clash --manifest parts.jsonl --json").done().json();
    assert_eq!(answer["classes"]["duplicated"], 19_999);
    let clashes = answer["clashes"].as_array().unwrap();
    assert!(clashes.len() == 19_999 && clashes.iter().all(|clash| clash["a"] == "cube"));
}

#[test]
fn a_baseline_tells_what_is_new_changed_and_gone() {
    let directory = &parts();
    let old = directory.cbvh("clash parts --json").done();
    directory.write("old.json", &old.out);
    let answer =
        directory.cbvh("clash parts --baseline old.json --json --fail-on overlapping,touching").done().json();
    assert_eq!(answer["statuses"], json!({"new": 0, "changed": 0, "same": 5, "gone": 0}));
    // One overlaps deeper, one touches no more, one is new.
    directory.write("parts/deep.obj", block([2.0, 2.0, 0.5], [3.0, 3.0, 5.0], false));
    directory.write("parts/flush.obj", block([5.0, 5.0, 1.5], [6.0, 6.0, 2.0], false));
    directory.write("parts/fresh.obj", block([7.0, 0.0, 0.5], [8.0, 1.0, 2.0], false));
    let answer = directory.cbvh("clash parts --baseline old.json --json").done().json();
    assert_eq!(answer["statuses"], json!({"new": 1, "changed": 1, "same": 3, "gone": 1}));
    let status = |a: &str, b: &str| find(&answer, a, b)["status"].as_str().unwrap();
    assert_eq!(
        (status("fresh", "plate"), status("deep", "plate"), status("open", "plate")),
        ("new", "changed", "same")
    );
    assert_eq!((&answer["gone"][0]["a"], &answer["gone"][0]["class"]), (&json!("flush"), &json!("touching")));
    let id = |answer: &Value| find(answer, "deep", "plate")["id"].clone();
    assert_eq!(id(&answer), id(&old.json()));
    let text = directory.cbvh("clash parts --baseline old.json").done().out;
    assert!(
        text.contains("; 1 new, 1 changed, 3 same, 1 gone\n") && text.contains("flush | plate"),
        "{text}"
    );
    // Only what is new or changed fails.
    directory.cbvh("clash parts --baseline old.json --fail-on intersecting").done();
    let words = [
        "parts: --fail-on overlapping: expected no new or changed clash",
        "found 2; the first: deep | plate",
    ];
    directory.cbvh("clash parts --baseline old.json --fail-on overlapping").failed(5, &words);
    // A wider tolerance sees no change.
    let answer =
        directory.cbvh("clash parts/deep.obj parts/plate.obj --baseline old.json --tolerance 0.3 --json");
    assert_eq!(answer.done().json()["clashes"][0]["status"], "same");

    directory.write("cut.json", &old.out[..old.out.len() / 2]);
    directory.write("other.json", "{\"parts\": 3}");
    directory.write("class.json", old.out.replace("touching\",\"a", "odd\",\"a"));
    let expected = "expected what cbvh clash --json has printed";
    for (name, place, found) in [
        ("cut.json", "line 1, column", "EOF"),
        ("other.json", "line 1, column 12", "missing field `clashes`"),
        ("class.json", "clashes[4].class", "\"odd\""),
    ] {
        let words = [&format!("{name}: {place}"), expected, found];
        directory.cbvh(&format!("clash parts --baseline {name}")).failed(3, &words);
    }
    directory.cbvh("clash parts --baseline none.json").failed(2, &["none.json"]);
}

#[test]
fn wrong_arguments_and_files_are_named() {
    let directory = &parts();
    for (arguments, words) in [
        ("clash parts --clearance -1", ["--clearance", "finite number of at least 0"]),
        ("clash parts --tolerance nan", ["--tolerance", "finite number of at least 0"]),
        ("clash parts --fail-on apart", ["--fail-on", "expected one of piercing, protruding, overlapping"]),
        ("clash parts --shard 3/2", ["--shard", "expected I/N"]),
        ("clash parts --shard 1/2 --baseline b.json", ["--baseline", "--shard"]),
        ("clash parts --manifest m.jsonl", ["--manifest", "cannot be used"]),
        ("clash --json", ["FILE", "required"]),
    ] {
        directory.cbvh(arguments).failed(1, &words);
    }
    std::fs::create_dir(directory.join("empty")).unwrap();
    directory.cbvh("clash none.obj parts").failed(2, &["none.obj", "found nothing of this name"]);
    directory.cbvh("clash empty").failed(2, &["empty: expected a folder with files named .cbvh"]);
    directory.cbvh("clash parts --csv none/c.csv").failed(2, &["none/c.csv"]);
    directory.cbvh("clash parts/deep.obj").failed(3, &["deep.obj: expected at least two parts, found 1"]);
    directory.write("bad.obj", "v 1 2\n");
    directory.cbvh("clash bad.obj parts").failed(3, &["bad.obj", "line 1"]);
    directory.cbvh("bake parts/plate.obj -o bare.cbvh --no-topology -q").done();
    let words = ["bare.cbvh: ", "does not say which objects are closed"];
    directory.cbvh("clash parts/deep.obj bare.cbvh").failed(3, &words);
    for (line, words) in [
        ("{\"file\": \"parts/deep.obj\", \"pose\": [1, 2]}", "line 2: pose: expected 12 numbers"),
        ("{\"file\": \"parts/deep.obj\", \"pose\": [2,0,0,0,0,1,0,0,0,0,1,0]}", "line 2: pose: "),
        ("{\"input\": \"parts/deep.obj\"}", "line 2: column 8: expected a JSON object with file"),
    ] {
        directory.write("m.jsonl", format!("\n{line}\n"));
        directory.cbvh("clash --manifest m.jsonl").failed(3, &["m.jsonl", words]);
    }
    // The classes that are asked for fail after everything is written.
    let ended = directory.cbvh("clash parts --fail-on touching,overlapping --csv c.csv --json");
    let ended = ended.failed(5, &["parts: --fail-on touching,overlapping: expected no clash", "found 2"]);
    assert_eq!(ended.json()["classes"]["touching"], 1);
    assert_eq!(directory.text("c.csv").lines().count(), 6);
    directory.cbvh("clash parts --fail-on near,undecided").done();
}

#[test]
fn shards_together_are_the_whole() {
    let directory = &place();
    directory.write("cube.obj", block([0.0; 3], [1.0; 3], false));
    directory.cbvh("bake cube.obj -o cube.cbvh -q").done();
    // A row of cubes, some of them turned, and each fifth one twice.
    let line = |number: usize| {
        let x = 0.9 * (number - usize::from(number % 5 == 1)) as f64;
        let file = if number.is_multiple_of(7) { "cube.obj" } else { "cube.cbvh" };
        let pose = if number.is_multiple_of(3) {
            json!([0, -1, 0, x + 1.0, 1, 0, 0, 0, 0, 0, 1, 0])
        } else {
            json!([1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0])
        };
        json!({"file": file, "pose": pose, "name": format!("cube {number}")}).to_string() + "\n"
    };
    directory.write("parts.jsonl", (0..40).map(line).collect::<String>());
    let whole = directory.cbvh("clash --manifest parts.jsonl --json").done().json();
    let sorted = |answers: &[Value]| {
        let clashes = answers.iter().flat_map(|answer| answer["clashes"].as_array().unwrap());
        let mut clashes: Vec<String> = clashes.map(Value::to_string).collect();
        clashes.sort();
        clashes
    };
    let shard = |number: usize| {
        let answer =
            directory.cbvh(&format!("clash --manifest parts.jsonl --shard {number}/3 --json")).done().json();
        assert_eq!(
            (&answer["shard"], &answer["tolerance"]),
            (&json!(format!("{number}/3")), &whole["tolerance"])
        );
        assert!(!answer["clashes"].as_array().unwrap().is_empty());
        answer
    };
    let shards = [1, 2, 3].map(shard);
    assert_eq!(sorted(&shards), sorted(std::slice::from_ref(&whole)));
    assert!(whole["copies"].as_u64().unwrap() > 0);
    // Translations are in the world, also where A is turned.
    for clash in whole["clashes"].as_array().unwrap().iter().filter(|clash| clash["class"] == "overlapping") {
        let [x, y, z] = [0, 1, 2].map(|k| clash["translation"][k].as_f64().unwrap());
        assert!(
            (x - 0.1).abs() < 1e-3 || (x - 1.0).abs() < 1e-3 || (y.hypot(z) - 1.0).abs() < 1e-3,
            "{clash}"
        );
    }
}

/// Damaged pages of a part are told with its file, and only if they are needed.
#[test]
fn a_damaged_part_is_named() {
    let directory: &Path = &parts();
    directory.cbvh("bake parts -o baked -q").done();
    let path = directory.join("baked/deep.cbvh");
    let mut bytes = std::fs::read(&path).unwrap();
    // The first page of nodes follows the head of the file.
    let middle = bytes.len() / 2;
    bytes[4096..middle.max(4100)].fill(0xA5);
    std::fs::write(&path, bytes).unwrap();
    directory.cbvh("clash baked/deep.cbvh baked/plate.cbvh").failed(3, &["deep.cbvh", "part \"deep\""]);
    directory.cbvh("clash baked/deep.cbvh baked/inner.cbvh").done();
}
