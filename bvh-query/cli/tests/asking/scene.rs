//! Tests `cbvh scene`: answers are those of `cbvh query` pair by pair, however they are found, and bad files are named.

use crate::common::{
    Files as _, Place, backends, cbvh_in, cbvh_with_isa, cube, cube_at, names, place, poses, torus,
};
use std::fs;
use std::path::Path;

/// Three instances, of which two move in 40 frames.
fn world() -> Place {
    let place = place();
    let directory = &place;
    directory.write("cube.obj", cube());
    directory.write("torus.obj", torus(48, 24));
    directory.cbvh("bake torus.obj -o torus.cbvh -q").done();
    let scene = "\
# a comment
mesh ring torus.cbvh
mesh box cube.obj # baked first
instance a ring 1 0 0 0  0 1 0 0  0 0 1 0
instance b box 1 0 0 0  0 1 0 0  0 0 1 0
instance c ring 1 0 0 9  0 1 0 0  0 0 1 0
moving b c
";
    directory.write("s.scene", scene);
    let lines = |poses: &str| -> Vec<String> {
        let lines = poses.lines().map(|line| line.split('#').next().unwrap().trim().to_owned());
        lines.filter(|line| !line.is_empty()).collect()
    };
    let (b, c) = (lines(&poses(40, 0.0, 6.0)), lines(&poses(40, 2.0, 12.0)));
    let frames: String = b.iter().zip(c).map(|(b, c)| format!("{b} {c}\n")).collect();
    directory.write("f.txt", format!("# frames\n{frames}"));
    place
}

fn ask(directory: &Path, more: &[&str]) -> crate::common::Ended {
    cbvh_in(directory, &[&["scene", "s.scene", "f.txt"], more].concat())
}

/// Poses of the moving instances, frame by frame.
fn frames(directory: &Path) -> Vec<(String, String)> {
    let text = directory.text("f.txt");
    let halves = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        (words[..12].join(" "), words[12..].join(" "))
    };
    text.lines().filter(|line| !line.starts_with('#')).map(halves).collect()
}

/// The values of the raw lines that a query about poses of a torus and a cube writes.
fn query(directory: &Path, meshes: [&str; 2], poses: &str, mode: &[&str]) -> Vec<f64> {
    directory.write("q.txt", poses);
    let query =
        [&["query", meshes[0], meshes[1], "q.txt", "--out", "raw.txt", "--json", "--mode"], mode].concat();
    cbvh_in(directory, &query).done();
    values(&directory.text("raw.txt"))
}

fn values(raw: &str) -> Vec<f64> {
    raw.lines().map(|line| line.split(' ').next().unwrap().parse().unwrap()).collect()
}

#[test]
fn answers_are_those_about_each_pair() {
    let directory = &world();
    let frames = frames(directory);
    let [b, c] = [0, 1].map(|side| {
        let line = |frame: &(String, String)| format!("{}\n", if side == 0 { &frame.0 } else { &frame.1 });
        frames.iter().map(line).collect::<String>()
    });
    // `a` is at the origin, so that a pose in the world is one in its frame. The pair of `b` and `c` is allowed to touch.
    let scene = directory.text("s.scene");
    directory.write("s.scene", format!("{scene}allow c b\n"));
    for mode in [&["collide"][..], &["distance"], &["within", "--within", "1.5"]] {
        let of_b = query(directory, ["torus.cbvh", "cube.obj"], &b, mode);
        let of_c = query(directory, ["torus.cbvh", "torus.cbvh"], &c, mode);
        let expected: Vec<f64> = of_b
            .iter()
            .zip(&of_c)
            .map(|(b, c)| match mode[0] {
                "distance" => b.min(*c),
                "within" => b + c,
                _ => b.max(*c),
            })
            .collect();
        let more = [&["--mode"], mode].concat();
        let printed = ask(directory, &more).done().out;
        assert_eq!(values(&printed), expected, "{mode:?}");
        let more = [&["--out", "scene.txt", "--bench", "--mode"], mode].concat();
        let json = ask(directory, &more).done().json();
        assert_eq!(values(&directory.text("scene.txt")), expected, "{mode:?}");
        assert_eq!(
            (&json["mode"], &json["instances"], &json["moving"]),
            (&mode[0].into(), &3.into(), &2.into())
        );
        assert_eq!((&json["queries"], &json["requested"]), (&40.into(), &40.into()));
        assert_eq!(json["triangles"], 2304 + 12);
        let positives = expected.iter().filter(|&&value| (mode[0] == "distance") == (value == 0.0)).count();
        assert!(json["positives"] == positives && positives > 0 && positives < 40, "{mode:?}: {json}");
        // Of all three pairs, with names.
        let list = ask(directory, &[&["--list", "--mode"], mode].concat()).done().out;
        assert_eq!(list.lines().filter(|line| line.starts_with("frame ")).count(), 40, "{list}");
        let records = ask(directory, &[&["--list", "--json", "--mode"], mode].concat()).done().json_lines();
        assert_eq!(records.len(), 40);
        for (number, (record, value)) in records.iter().zip(&expected).enumerate() {
            let found = match mode[0] {
                "collide" => record["collide"].as_bool().map(|flag| f64::from(u8::from(flag))),
                "within" => record["pairs"].as_array().map(|pairs| pairs.len() as f64),
                _ => record["distance"].as_f64(),
            };
            assert!(record["frame"] == number && found == Some(*value), "{record}");
            if mode[0] == "distance" {
                let apart = |axis: usize| {
                    let [a, b] = ["point_a", "point_b"].map(|name| record[name][axis].as_f64().unwrap());
                    (a - b).powi(2)
                };
                assert!(((0..3).map(apart).sum::<f64>().sqrt() - value).abs() < 1e-12, "{record}");
                assert!(record["a"] == "a" && ["b", "c"].iter().any(|name| record["b"] == *name), "{record}");
            }
        }
        if mode[0] == "within" {
            assert_eq!(list.matches("  a b\n").count() as f64, of_b.iter().sum::<f64>(), "{list}");
            assert!(!list.contains("b c"), "{list}");
        }
    }
    assert_eq!(names(directory).len(), 8);
}

#[test]
fn answers_depend_neither_on_the_backend_nor_on_threads() {
    let directory = &world();
    for mode in ["collide", "pairs", "distance", "relation"] {
        let mut hashes = Vec::new();
        for isa in backends(directory) {
            for jobs in ["1", "2"] {
                let arguments = ["scene", "s.scene", "f.txt", "--mode", mode, "--bench", "--jobs", jobs];
                let json = cbvh_with_isa(directory, isa, &arguments).done().json();
                assert_eq!(json["isa"], isa);
                hashes.push(json["answers_xxh3"].as_str().unwrap().to_owned());
            }
        }
        assert!(hashes.iter().all(|hash| *hash == hashes[0] && hash.len() == 16), "{mode}: {hashes:?}");
    }
    let cut = ask(directory, &["--budget", "0", "--bench"]).done().json();
    assert!(cut["answers_xxh3"].is_null() && cut["queries"] == 1 && cut["requested"] == 40, "{cut}");
    let few = ask(directory, &["--limit", "7", "--warm", "0", "--bench"]).done().json();
    assert_eq!((&few["queries"], &few["requested"]), (&7.into(), &7.into()));
}

#[test]
fn a_scene_in_which_nothing_moves_is_asked_about_all_pairs() {
    let directory = &world();
    let scene = directory.text("s.scene").replace("moving b c\n", "");
    directory.write("s.scene", scene);
    let list = directory.cbvh("scene s.scene --mode distance --list").done().out;
    // The cube of side 2 at the middle of a ring reaches its inner side.
    assert!(
        list.starts_with("frame 1: a b ") && list.contains("\n  a c ") && list.lines().count() == 3,
        "{list}"
    );
    directory.cbvh("scene s.scene f.txt").failed(1, &["expected no FRAMES"]);
}

/// What is inside what, and instances placed by a position and a quaternion.
#[test]
fn relations_tell_what_is_inside() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.write("room.obj", cube_at(5, 0));
    let scene = "\
mesh m cube.obj
mesh l room.obj
instance inner m 1 0 0 0.5  0 1 0 0  0 0 1 0
instance room l 0 0 0  0 0 0.70710678118654752 0.70710678118654752
instance near m 6 0 0  0 0 0 1
instance far m 20 0 0  0 0 0 1
";
    directory.write("s.scene", scene);
    let ask = |more: &[&str]| cbvh_in(directory, &[&["scene", "s.scene"], more].concat()).done();
    assert_eq!(ask(&["--mode", "relation"]).out, "2\n");
    assert_eq!(
        ask(&["--mode", "relation", "--list"]).out,
        "frame 1: 2 pairs touching or inside\n  inner inside room\n  room near touching\n"
    );
    let json = ask(&["--mode", "relation", "--json"]).json();
    let pair = |a, b, relation| serde_json::json!({ "a": a, "b": b, "relation": relation });
    assert_eq!(json["pairs"], serde_json::json!([pair("inner", "room", 2), pair("room", "near", 0)]));
    fs::write(
        directory.join("s.scene"),
        scene
            .lines()
            .filter(|line| !line.contains("room"))
            .map(|line| format!("{line}\n"))
            .collect::<String>(),
    )
    .unwrap();
    let json = ask(&["--mode", "distance", "--json"]).json();
    assert!(json["distance"] == 3.5 && json["point_a"][0] == 1.5 && json["point_b"][0] == 5.0, "{json}");
    directory.cbvh("scene cell.glb").failed(2, &["cell.glb"]);
    directory.write("cell.glb", "glTF");
    directory
        .cbvh("scene cell.glb")
        .failed(3, &["cell.glb: expected a scene file, found glTF", "cbvh bake cell.glb --scene -o"]);
}

#[test]
fn bad_files_are_named_with_line_and_remedy() {
    let directory = &world();
    let good = directory.text("s.scene");
    let pose = "1 0 0 0 0 1 0 0 0 0 1 0";
    for (line, code, words) in [
        ("mesh ring cube.obj", 3, "line 8: expected a name of its own, found a second shape \"ring\""),
        ("mesh new no.obj", 2, "no.obj: expected a readable file"),
        (&format!("instance a ring {pose}"), 3, "found a second instance \"a\""),
        (&format!("instance d sphere {pose}"), 3, "expected a shape of an earlier line, found \"sphere\""),
        ("instance d ring 1 2 3", 3, "line 8: expected 12 numbers"),
        ("instance d ring 9 0 0 0 0 0 2", 3, "line 8: expected a quaternion"),
        ("instance d ring", 3, "expected 12 numbers, or 7, after the shape, found none"),
        ("instance d ring 2 0 0 0 0 2 0 0 0 0 2 0", 3, "scaled by 2; bake the mesh at its size"),
        ("instance d ring 1 3e-7 0 0 0 1 0 0 0 0 1 0", 3, "instance d: expected a rotation within 2^-23"),
        ("moving b", 3, "expected each instance once, found \"b\" again"),
        ("moving d", 3, "expected an instance of an earlier line, found \"d\""),
        ("allow a d", 3, "expected an instance of an earlier line, found \"d\""),
        ("allow a a", 3, "line 8: expected two instances, found \"a\" twice"),
        ("moving", 3, "line 8: expected the names of instances after moving, found none"),
        ("allow a", 3, "line 8: expected mesh NAME FILE, sphere NAME R"),
        ("robot x", 3, "found \"robot x\""),
    ] {
        directory.write("s.scene", format!("{good}{line}\n"));
        let ended = ask(directory, &[]);
        assert_eq!(ended.code, code, "{line}: {}", ended.err);
        assert!(ended.err.contains(words) && ended.err.lines().count() == 1, "{line}: {}", ended.err);
        assert!(ended.out.is_empty());
    }
    directory.write("s.scene", "# nothing\n");
    assert!(ask(directory, &[]).err.contains("s.scene: expected at least one line: instance NAME MESH POSE"));
    directory.write("s.scene", &good);
    for (frames, words) in [
        (pose.to_owned(), "line 1: expected 24 numbers, 12 for each of 2 moving instances, found 12"),
        (format!("{pose} {pose}\n{pose} {}", pose.replace("1 0 0 0 0", "1 0 0 x 0")), "line 2: instance c: "),
        (format!("{pose} {}", pose.replacen('1', "-1", 1)), "line 1: instance c: expected a rotation"),
        (String::new(), "expected at least one line of poses, found none"),
        (
            format!("{pose} 1 3e-7 0 0 0 1 0 0 0 0 1 0"),
            "line 1: instance c: expected a rotation within 2^-23 of orthonormal",
        ),
    ] {
        directory.write("f.txt", frames);
        let ended = ask(directory, &["--out", "raw.txt"]);
        assert_eq!(ended.code, 3, "{}", ended.err);
        assert!(ended.err.starts_with("cbvh: f.txt: ") && ended.err.contains(words), "{}", ended.err);
    }
    for (arguments, words) in [
        (&["--mode", "within"][..], "--mode within requires --within D"),
        (&["--within", "1"], "--within requires --mode within"),
        (&["--mode", "within", "--within", "-1"], "--within"),
        (&["--jobs", "0"], "--jobs"),
        (&["--list", "--bench"], "--list"),
    ] {
        let ended = ask(directory, arguments);
        assert!(ended.code == 1 && ended.err.contains(words), "{arguments:?}: {}", ended.err);
    }
    directory.cbvh("scene s.scene").failed(1, &["expected FRAMES"]);
    assert!(!directory.join("raw.txt").exists());
}

/// Writes a glTF file of three nodes: two share a box, and the third has it twice as large.
fn boxes(directory: &Path) {
    let mut blob = Vec::new();
    for corner in 0..8u32 {
        let side = |axis: u32| if corner >> axis & 1 == 1 { 1.0f32 } else { -1.0 };
        [0, 1, 2].map(side).iter().for_each(|value| blob.extend(value.to_le_bytes()));
    }
    blob.extend([
        0u8, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7,
        1, 7, 5,
    ]);
    directory.write("boxes.bin", blob);
    let json = r#"{"asset":{"version":"2.0"},"nodes":[{"name":"a","mesh":0},{"name":"b","mesh":0,"translation":[1.5,0,0]},
        {"mesh":0,"scale":[2,2,2],"translation":[9,0,0]}],
        "meshes":[{"name":"box","primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"},
        {"bufferView":1,"componentType":5121,"count":36,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":36}],
        "buffers":[{"byteLength":132,"uri":"boxes.bin"}]}"#;
    directory.write("boxes.gltf", json);
}

/// A baked scene gives the answers of a text file that says the same, as it stands and when its instances move.
#[test]
fn baked_scenes_are_asked_like_text() {
    let directory = &place();
    boxes(directory);
    let bake = ["bake", "boxes.gltf", "-o", "boxes.cbvh", "--scene", "--json", "-q"];
    let json = cbvh_in(directory, &bake).done().json();
    assert_eq!(
        (&json["objects"], &json["instances"], &json["triangles"]),
        (&2.into(), &3.into(), &24.into())
    );
    assert_eq!(cbvh_in(directory, &bake).done().json()["skipped"], true);
    directory.cbvh("verify boxes.cbvh boxes.gltf").done();
    let dump = directory.cbvh("dump boxes.cbvh --json").done().json();
    assert_eq!(dump["instances"][1]["name"], "b");
    assert_eq!(dump["instances"][2]["translation"], serde_json::json!([9.0, 0.0, 0.0]));
    assert!(
        directory.cbvh("dump boxes.cbvh").done().out.contains("\ninstances\n  number 0, name a, object 0,")
    );

    let list = directory.cbvh("scene boxes.cbvh --mode pairs --list").done().out;
    assert_eq!(list, "frame 1: 1 pair touching\n  a b\n");
    let list = directory.cbvh("scene boxes.cbvh --mode within --within 9 --list").done().out;
    assert_eq!(list, "frame 1: 3 pairs near enough\n  a b\n  a box\n  b box\n");

    let large =
        cube().replace('1', "2").lines().filter(|line| line.starts_with('v')).collect::<Vec<_>>().join("\n");
    let faces: String =
        cube().lines().filter(|line| line.starts_with('f')).map(|line| format!("{line}\n")).collect();
    directory.write("cube.obj", cube());
    directory.write("large.obj", format!("{large}\n{faces}"));
    let identity = "1 0 0 0  0 1 0 0  0 0 1 0";
    let text = format!(
        "mesh m cube.obj\nmesh l large.obj\ninstance a m {identity}\ninstance b m {identity}\ninstance box l {identity}\n\
         moving a b box\n"
    );
    directory.write("s.scene", text);
    let of = |from: f64, to: f64| -> Vec<String> {
        let all = poses(30, from, to);
        all.lines()
            .map(|line| line.split('#').next().unwrap().trim().to_owned())
            .filter(|l| !l.is_empty())
            .collect()
    };
    let lines = of(0.0, 6.0).into_iter().zip(of(1.0, 9.0)).zip(of(3.0, 0.0));
    let frames: String = lines.map(|((a, b), c)| format!("{a} {b} {c}\n")).collect();
    directory.write("f.txt", frames);
    for mode in ["collide", "pairs", "distance"] {
        let ask = |scene: &str, jobs: &str| {
            directory.cbvh(&format!("scene {scene} f.txt --mode {mode} --bench --jobs {jobs}")).done().json()
        };
        let (text, baked) = (ask("s.scene", "1"), ask("boxes.cbvh", "2"));
        for field in ["answers_xxh3", "positives", "instances", "moving", "triangles"] {
            assert_eq!(text[field], baked[field], "{mode}, {field}");
        }
    }

    directory.write("f.txt", identity);
    directory.cbvh("scene boxes.cbvh f.txt").failed(3, &["f.txt: line 1: expected 36 numbers"]);
    directory.write("p.txt", identity);
    let query = ["query", "boxes.cbvh", "cube.obj", "p.txt"];
    cbvh_in(directory, &query)
        .failed(3, &["boxes.cbvh: expected a mesh, or one object of a scene, found a scene"]);
    cbvh_in(directory, &[&query[..], &["--object", "box"]].concat()).done();
    directory.cbvh("bake cube.obj -o cube.cbvh -q").done();
    directory.cbvh("scene cube.cbvh").failed(3, &["cube.cbvh: expected a scene", "--scene"]);
    let mut bytes = fs::read(directory.join("boxes.cbvh")).unwrap();
    let at = bytes.windows(8).rposition(|window| window == 9f64.to_le_bytes()).unwrap();
    bytes[at] ^= 1;
    directory.write("boxes.cbvh", bytes);
    directory.cbvh("scene boxes.cbvh").failed(3, &["boxes.cbvh: ", "R10"]);
    directory.cbvh("validate boxes.cbvh").failed(3, &["boxes.cbvh", "R10"]);
}

#[test]
fn names_in_quotes_have_spaces_and_distances_of_all_pairs_are_listed() {
    let directory = &place();
    directory.write("my #1 cube.obj", cube());
    let at = |name: &str, x: i32| format!("instance {name} \"the box\" {x} 0 0 0 0 0 1\n");
    let scene = "mesh \"the box\" \"my #1 cube.obj\" # a comment\n".to_owned()
        + &at("\"left \\\"arm\\\"\"", 0)
        + &at("mid", 3)
        + &at("\"right arm\"", 10)
        + "allow \"right arm\" mid\n";
    directory.write("s.scene", &scene);
    let ask = |more: &[&str]| cbvh_in(directory, &[&["scene", "s.scene", "--mode"], more].concat());
    let listed = ask(&["distance", "--list"]).done().out;
    let expected = "frame 1: \"left \\\"arm\\\"\" mid 1 mesh units apart\n  \"left \\\"arm\\\"\" \"right arm\" 8 mesh units apart\n";
    assert_eq!(listed, expected);
    assert_eq!(ask(&["distance"]).done().out, "1\n");
    let json = ask(&["distance", "--list", "--json"]).done().json();
    assert_eq!((&json["a"], &json["b"]), (&"left \"arm\"".into(), &"mid".into()));
    let other = serde_json::json!({ "a": "left \"arm\"", "b": "right arm", "distance": 8.0 });
    assert_eq!(json["others"], serde_json::json!([other]));
    assert!(ask(&["distance", "--json"]).done().json().get("others").is_none());
    directory.write("s.scene", scene + "moving \"mid\n");
    ask(&["collide"]).failed(3, &["s.scene: line 6", "expected a quote at the end of a name"]);
}

#[test]
fn meshes_of_very_different_size_are_pointed_out_once() {
    let directory = &place();
    directory.write("small.obj", cube());
    directory.write("large.obj", cube_at(2000, 0));
    let lines = ["a small", "b large", "c large"].map(|of| format!("instance {of} 0 0 0 0 0 0 1\n"));
    let scene = format!("mesh small small.obj\nmesh large large.obj\n{}", lines.concat());
    directory.write("s.scene", scene);
    let ended = directory.cbvh("scene s.scene");
    assert_eq!((ended.code, ended.err.lines().count()), (0, 1), "{ended:?}");
    assert!(ended.err.contains("small.obj is about 2.000") && ended.err.contains("same unit?"), "{ended:?}");
}

/// Simple shapes, with distances that are known.
#[test]
fn scenes_have_simple_shapes_and_margins() {
    let place = place();
    place.write("p.xyz", "# two points\n0 0 0\n\n1 0 0 # the second\n");
    let at = |x: &str| format!("1 0 0 {x}  0 1 0 0  0 0 1 0");
    let shapes =
        "sphere ball 2\ncapsule pill 0.5 2\nbox brick 2 4 6\ncylinder pipe 1 4\ncloud dots p.xyz 0.25\n";
    for (pair, more, expected) in [
        (["ball 0", "ball 5"], "", 1.0),
        (["ball 0", "ball 4"], "", 0.0),
        (["ball 0", "pill 5"], "", 2.5),
        (["brick 0", "ball 5"], "", 2.0),
        (["brick 0", "dots 0.5"], "", 0.0),
        (["dots 0", "ball 4"], "", 0.75),
        (["ball 0", "ball 5"], "margin a 0.25\nmargin b 0.5\n", 0.25),
        (["ball 0", "ball 5"], "margin a 0.5\nmargin b 0.5\n", 0.0),
    ] {
        let instance = |name: &str, text: &str| {
            let (shape, x) = text.split_once(' ').unwrap();
            format!("instance {name} {shape} {}\n", at(x))
        };
        let [a, b] = [instance("a", pair[0]), instance("b", pair[1])];
        place.write("s.scene", format!("{shapes}{a}{b}{more}"));
        let distance = cbvh_in(&place, &["scene", "s.scene", "--mode", "distance"]).done().out;
        assert_eq!(distance.trim().parse::<f64>().unwrap(), expected, "{pair:?} {more}");
        let touching = cbvh_in(&place, &["scene", "s.scene", "--mode", "collide"]).done().out;
        assert_eq!(touching.trim() == "1", expected == 0.0, "{pair:?} {more}");
        let list =
            cbvh_in(&place, &["scene", "s.scene", "--mode", "distance", "--list", "--json"]).done().out;
        assert!(list.contains("\"others\":[]"), "{list}");
    }
    // Of the prism around a cylinder, the distance may be that much less.
    place.write("s.scene", format!("{shapes}instance a pipe {}\ninstance b ball {}\n", at("0"), at("5")));
    let distance = cbvh_in(&place, &["scene", "s.scene", "--mode", "distance"]).done().out;
    let distance: f64 = distance.trim().parse().unwrap();
    assert!((2.0 - 0.005..=2.0).contains(&distance), "{distance}");
    for (line, expected) in [
        ("sphere s -1", "line 6: R: expected a finite length of at least 0, found \"-1\""),
        ("capsule s 1 nan", "line 6: LENGTH: expected a finite length"),
        ("box s 1 0 1", "line 6: side: expected a finite length above 0, found 0"),
        ("cylinder s 1 inf", "line 6: LENGTH: expected a finite length"),
        (
            "sphere s 1e300\ninstance c s 1 0 0 0  0 1 0 0  0 0 1 0",
            "line 6: radius: expected a length from 0 to 2^118",
        ),
        ("sphere ball 1", "line 6: expected a name of its own, found a second shape \"ball\""),
        ("margin a 1", "line 6: expected an instance of an earlier line, found \"a\""),
        ("cloud more none.xyz 1", "none.xyz"),
        ("halfspace floor 0 0 1 0", "a half-space; write a box"),
    ] {
        place.write("s.scene", format!("{shapes}{line}\ninstance a ball {}\n", at("0")));
        let ended = cbvh_in(&place, &["scene", "s.scene"]);
        assert!(ended.err.contains(expected), "{line}: {}", ended.err);
    }
    for (points, expected) in [
        ("0 0 0\n1 nan 0\n", "line 2: expected a finite coordinate of at most 2^120 in magnitude, found NaN"),
        ("0 0\n", "line 1: expected a point: three numbers, found 0 0"),
        ("# none\n", "expected at least one point, found none"),
    ] {
        place.write("p.xyz", points);
        place.write("s.scene", format!("cloud dots p.xyz 1\ninstance a dots {}\n", at("0")));
        let ended = cbvh_in(&place, &["scene", "s.scene"]);
        assert!(ended.code == 3 && ended.err.contains(expected), "{points}: {}", ended.err);
    }
}

/// The open scenes with shapes: every answer is right, and the same on every backend and on two threads.
#[test]
#[ignore = "needs ../shared"]
fn open_scenes_with_shapes_have_true_answers() {
    let folder = crate::common::shared("shapes");
    let place = place();
    for name in ["cell", "cloud", "padded", "robot"] {
        let [scene, frames] = [".scene", "_frames.txt"].map(|end| folder.join(format!("{name}{end}")));
        let truth = fs::read_to_string(folder.join(format!("{name}.truth"))).unwrap();
        let size = truth.lines().find_map(|line| line.strip_prefix("# size ")).unwrap();
        let slack = 1e-9 * size.parse::<f64>().unwrap();
        let ask = |mode: &str, more: &[&str]| {
            let asked = [&["scene", scene.to_str().unwrap(), frames.to_str().unwrap(), "--mode", mode], more]
                .concat();
            cbvh_in(&place, &asked).done().out
        };
        let (distances, pairs) = (ask("distance", &[]), ask("pairs", &[]));
        let lines = truth.lines().filter(|line| !line.starts_with('#'));
        let (mut frames, mut touching) = (0, 0);
        for ((line, distance), count) in lines.zip(distances.lines()).zip(pairs.lines()) {
            let words: Vec<&str> = line.split(' ').collect();
            let (distance, count): (f64, u32) = (distance.parse().unwrap(), count.parse().unwrap());
            let (most, least): (f64, f64) = (words[0].parse().unwrap(), words[2].parse().unwrap());
            assert!(
                least - slack <= distance && distance <= most + slack,
                "{name} {frames}: {distance}, {line}"
            );
            assert_eq!(distance == 0.0, count > 0, "{name} {frames}");
            if words[1] != "?" {
                let (least, most): (u32, u32) =
                    (words[1].parse().unwrap(), words[3].parse().unwrap_or(u32::MAX));
                assert!((least..=most).contains(&count), "{name} {frames}: {count}, {line}");
            }
            frames += 1;
            touching += u32::from(count > 0);
        }
        assert!(frames > 40 && touching > 10, "{name}: {frames} frames");
        for isa in backends(&place) {
            for jobs in ["1", "2"] {
                assert_eq!(
                    ask("distance", &["--isa", isa, "--jobs", jobs]),
                    distances,
                    "{name} {isa} {jobs}"
                );
            }
        }
    }
}
