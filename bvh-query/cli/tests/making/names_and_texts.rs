//! Checks names of files with spaces and letters of other scripts, and texts as editors on Windows write them.

use crate::common::{Files as _, cbvh_in, cube, gltf, names, place};
use serde_json::{Value, json};
use std::fs;

const POSE: &str = "1 0 0 5 0 1 0 0 0 0 1 0";

/// Each text has a byte order mark, and carriage returns at the ends of its lines.
#[test]
fn texts_of_other_editors_mean_the_same() {
    let directory = &place();
    let manifest = json!({"input": "cube.obj", "output": "out.cbvh"});
    let texts = [
        ("cube.obj", cube()),
        ("poses.txt", format!("{POSE}\n\n# a comment\n{POSE}\n")),
        ("cell.scene", format!("mesh m cube.obj\ninstance a m {POSE}\ninstance b m {POSE}\nmoving b\n")),
        ("pairs.txt", "one cube.obj cube.obj poses.txt\n".to_owned()),
        ("in.jsonl", format!("{manifest}\n\n")),
    ];
    let ask = || {
        let query = directory.cbvh("query cube.obj cube.obj poses.txt --mode distance").done().out;
        let scene = directory.cbvh("scene cell.scene poses.txt --mode pairs").done().out;
        let baked = directory.cbvh("bake --manifest in.jsonl --out-manifest out.jsonl --force -q").done();
        directory.cbvh("report pairs.txt --out report").done();
        directory.cbvh("verify out.cbvh cube.obj").done();
        let content = directory.cbvh("dump out.cbvh --json").done().json()["content_xxh3"].clone();
        (query, scene, baked.out, content)
    };
    texts.iter().for_each(|(name, text)| directory.write(name, text));
    let plain = ask();
    assert_eq!(plain.0, "3\n3\n");
    texts
        .iter()
        .for_each(|(name, text)| directory.write(name, format!("\u{feff}{}", text.replace('\n', "\r\n"))));
    assert_eq!(ask(), plain);
}

#[test]
fn names_may_have_spaces_and_any_letters() {
    let directory = &place();
    let folder = "räume und räder/部品 €";
    fs::create_dir_all(directory.join(folder)).unwrap();
    let named = |name: &str| format!("{folder}/{name}");
    let (mesh, baked, poses) = (named("ein würfel.obj"), named("ein würfel.cbvh"), named("шаги 1.txt"));
    directory.write(&mesh, cube());
    directory.write(&poses, format!("{POSE}\n"));
    cbvh_in(directory, &["bake", &mesh, "-o", &baked]).done();
    cbvh_in(directory, &["verify", &baked, &mesh]).done();
    let query =
        ["query", &baked, &mesh, &poses, "--mode", "distance", "--out", &named("%s raw.txt"), "--json"];
    cbvh_in(directory, &query).done();
    assert!(directory.text(&named("шаги 1 raw.txt")).starts_with("3 "));
    directory.write(
        "cell.scene",
        format!("mesh m \"{mesh}\"\ninstance \"ä ö\" m {POSE}\ninstance b m {POSE}\nmoving b\n"),
    );
    let scene = ["scene", "cell.scene", &poses, "--mode", "pairs", "--list"];
    assert!(cbvh_in(directory, &scene).done().out.contains("\"ä ö\" b"));
    directory.write("in.jsonl", json!({"input": mesh, "output": named("zwei.cbvh")}).to_string());
    directory.cbvh("bake --manifest in.jsonl --out-manifest out.jsonl -q").done();
    let values = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    directory.write(&named("é p.bin"), values.map(f32::to_le_bytes).concat());
    directory.write(&named("i.bin"), [0u32, 1, 2].map(u32::to_le_bytes).concat());
    directory.write(&named("a.gltf"), gltf(3, 3, "%C3%A9%20p.bin", "./i.bin"));
    cbvh_in(directory, &["bake", &named("a.gltf"), "-o", &named("a.cbvh")]).done();
    cbvh_in(directory, &["bake", &named("missing.obj"), "-o", &baked]).failed(2, &[&named("missing.obj")]);
    let left = ["a.cbvh", "a.gltf", "ein würfel.cbvh", "ein würfel.obj", "i.bin", "zwei.cbvh", "é p.bin"];
    let left: Vec<&str> = left.into_iter().chain(["шаги 1 raw.txt", "шаги 1.txt"]).collect();
    assert_eq!(names(&directory.join(folder)), left);
}

/// A name that a terminal and a spreadsheet would obey, and that begins a line of its own.
const HOSTILE: &str = "=a\u{1b}[31m\nno clashes\r\u{7f}\u{9b}2J\u{202e}";

/// Windows has no files of such names.
#[test]
#[cfg(unix)]
fn names_do_not_command_a_terminal() {
    let directory = &place();
    let values = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    directory.write("p.bin", values.map(f32::to_le_bytes).concat());
    directory.write("i.bin", [0u32, 1, 2].map(u32::to_le_bytes).concat());
    let mut document: Value = serde_json::from_str(&gltf(3, 3, "p.bin", "i.bin")).unwrap();
    document["meshes"][0]["name"] = json!(HOSTILE);
    document["nodes"] = json!([
        { "mesh": 0, "name": HOSTILE },
        { "mesh": 0, "name": "second", "translation": [0.1, 0.1, 0.0] },
    ]);
    let named = |end: &str| format!("{HOSTILE}{end}");
    let [mesh, scene, objects, missing, page, report] =
        [".gltf", "-scene.cbvh", "-objects.cbvh", ".obj", ".html", "-report"].map(named);
    directory.write(&mesh, document.to_string());
    directory.write("plain.gltf", document.to_string());
    // Spaces end a name here.
    directory.write("pairs.txt", "=a\u{1b}[31m\u{9b}2J\u{202e} plain.gltf plain.gltf\n");
    let runs: &[(i32, &[&str])] = &[
        (0, &["bake", &mesh, "-o", &scene, "--scene"]),
        (0, &["bake", &mesh, "-o", &scene, "--scene"]),
        (0, &["bake", &mesh, "-o", &objects, "--split-objects"]),
        (0, &["dump", &scene]),
        (0, &["validate", &objects, "--self-contacts"]),
        (0, &["verify", &objects, &mesh]),
        (0, &["query", &objects, &objects, "--mode", "distance", "--pose", POSE]),
        (0, &["query", &objects, &objects, "--mode", "contacts", "--pose", "1 0 0 0 0 1 0 0 0 0 1 0"]),
        (0, &["scene", &scene, "--mode", "pairs", "--list"]),
        (0, &["scene", &scene, "--mode", "distance", "--list"]),
        (0, &["view", &objects, "-o", &page]),
        (0, &["clash", &mesh, "--csv", "clashes.csv"]),
        (0, &["clash", &mesh, &scene]),
        (5, &["clash", &mesh, "--fail-on", "intersecting"]),
        (0, &["report", "pairs.txt", "--out", &report, "--quick"]),
        (2, &["bake", &missing, "-o", &objects]),
        (2, &["dump", &missing]),
        (3, &["validate", &mesh]),
        (3, &["scene", &mesh]),
        (1, &["query", &objects, &objects, "--object", HOSTILE, "--pose", POSE, "--mode", HOSTILE]),
        (1, &["query", &objects, &objects, "--object", &missing, "--pose", POSE]),
        (1, &[HOSTILE]),
    ];
    for (code, arguments) in runs {
        let ran = cbvh_in(directory, arguments);
        assert_eq!(ran.code, *code, "{arguments:?}: {ran:?}");
        for line in ran.out.lines().chain(ran.err.lines()) {
            assert!(!line.starts_with("no clashes"), "{arguments:?}: {ran:?}");
            assert!(!line.contains(|c: char| c.is_control() || c == '\u{202e}'), "{arguments:?}: {ran:?}");
        }
    }
    // The name in the table, quoted because of its line breaks, and what one reads there.
    let table = directory.text("clashes.csv");
    assert!(table.contains(&format!(",\"'{HOSTILE}\",second,")), "{table:?}");
    assert_eq!(table.matches(HOSTILE).count(), 1);
    // JSON has it as it is.
    let answer = directory.cbvh("clash plain.gltf --json").done().json();
    assert_eq!((&answer["clashes"][0]["a"], &answer["clashes"][0]["b"]), (&json!(HOSTILE), &json!("second")));
}
