//! Tests `cbvh view` and `cbvh clash --view`: what is in a page equals what was asked for, and nothing else is written.

use crate::common::{Ended, Files as _, Place, cbvh_in, cube, cube_at, names, place};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::io::Read as _;
use std::path::Path;

const POSE: &str = "0.6 -0.8 0 3  0.8 0.6 0 -1.5  0 0 1 1e-3";
const IDENTITY: &str = "1 0 0 0  0 1 0 0  0 0 1 0";

/// Returns a folder with two meshes, baked and not.
fn world() -> Place {
    let place = place();
    place.write("cube.obj", cube());
    place.write("small.obj", cube_at(3, 9));
    place.cbvh("bake cube.obj -o cube.cbvh -q").done();
    place
}

/// Runs `cbvh view` with these arguments and `-o page.html`.
fn view(folder: &Path, arguments: &[&str]) -> Ended {
    cbvh_in(folder, &[&["view"], arguments, &["-o", "page.html"]].concat())
}

/// Returns what a page says, and the files in it.
#[track_caller]
fn unpacked(html: &str) -> (Value, Vec<Vec<u8>>) {
    let (before, rest) = html.split_once("<script type=\"application/json\" id=\"cbvh-content\">").unwrap();
    let (content, mut rest) = rest.split_once("</script>").unwrap();
    let mut files = Vec::new();
    while let Some(next) = rest.strip_prefix("\n<script type=\"text/plain\" class=\"cbvh-file\">") {
        let (text, after) = next.split_once("</script>").unwrap();
        let mut bytes = Vec::new();
        flate2::read::GzDecoder::new(&STANDARD.decode(text).unwrap()[..]).read_to_end(&mut bytes).unwrap();
        files.push(bytes);
        rest = after;
    }
    assert!(before.contains("<body") && rest.contains("</html>"));
    let content: Value = serde_json::from_str(content).unwrap();
    assert_eq!(content["version"], 1);
    assert_eq!(content["files"].as_array().unwrap().len(), files.len());
    (content, files)
}

/// Returns what `page.html` says and has.
#[track_caller]
pub(crate) fn page(folder: &Path) -> (Value, Vec<Vec<u8>>) {
    unpacked(&folder.text("page.html"))
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|number| number.parse().unwrap()).collect()
}

#[test]
fn a_page_has_the_files_byte_for_byte() {
    let folder = world();
    let told = view(&folder, &["cube.cbvh", "cube.obj", "--pose", POSE, "--within", "0.25"]).done();
    assert_eq!(told.out, "page.html: shows cube.cbvh, cube.obj\n");
    let (content, files) = page(&folder);
    let baked = std::fs::read(folder.join("cube.cbvh")).unwrap();
    assert_eq!(files[0], baked);
    assert_eq!(
        content["files"][0],
        json!({ "name": "cube.cbvh", "path": "cube.cbvh", "bytes": baked.len() })
    );
    assert_eq!(
        (&content["files"][1]["name"], &content["files"][1]["path"]),
        (&"cube.obj".into(), &"cube.obj".into())
    );
    assert_eq!(content["show"], json!({ "kind": "pair", "pose": numbers(POSE), "within": 0.25 }));
    // What is baked in memory has the triangles of the mesh.
    folder.write("second.cbvh", &files[1]);
    folder.cbvh("verify second.cbvh cube.obj").done();
    assert_eq!(names(&folder), ["cube.cbvh", "cube.obj", "page.html", "second.cbvh", "small.obj"]);
}

#[test]
fn meshes_are_rounded_on_request() {
    let folder = place();
    folder.write("far.obj", "v 1000.2 0 0\nv 1000.3 0 0\nv 1000.2 1 0\nf 1 2 3\n");
    view(&folder, &["far.obj", "--round", "f32"]).done_as_stored(1);
    folder.write("shown.cbvh", &page(&folder).1[0]);
    folder.cbvh("bake far.obj -o baked.cbvh --round f32 -q").done();
    let content =
        |name: &str| folder.cbvh(&format!("dump {name} --json")).done().json()["content_xxh3"].clone();
    assert!(content("shown.cbvh").is_string());
    assert_eq!(content("shown.cbvh"), content("baked.cbvh"));
}

#[test]
fn one_file_is_shown_alone_or_is_both() {
    let folder = world();
    view(&folder, &["cube.cbvh"]).done();
    let (content, files) = page(&folder);
    assert_eq!((&content["show"], files.len()), (&json!({ "kind": "file" }), 1));
    view(&folder, &["cube.cbvh", "--pose", POSE]).done();
    let (content, files) = page(&folder);
    let show = json!({ "kind": "pair", "pose": numbers(POSE), "same": true });
    assert_eq!((&content["show"], files.len()), (&show, 1));
    view(&folder, &["cube.cbvh", "cube.cbvh"]).done();
    let (content, files) = page(&folder);
    let show = json!({ "kind": "pair", "pose": numbers(IDENTITY), "same": true });
    assert_eq!((&content["show"], files.len()), (&show, 1));
}

#[test]
fn layouts_and_objects_are_those_of_queries() {
    let folder = world();
    folder.write("two.obj", format!("{}o other\n{}", cube(), cube_at(1, 5)));
    view(
        &folder,
        &["two.obj", "cube.obj", "--object", "other", "--profile", "dop6-u8", "--triangles", "packed"],
    )
    .done();
    let (content, files) = page(&folder);
    assert_eq!((&content["files"][0]["object"], &content["files"][1]["object"]), (&1.into(), &Value::Null));
    folder.write("first.cbvh", &files[0]);
    let dump = folder.cbvh("dump first.cbvh").done().out;
    assert!(dump.contains("dop6-u8") && dump.contains("packed") && dump.contains("other"), "{dump}");
    view(&folder, &["two.obj", "--object", "other"]).done();
    let (content, _) = page(&folder);
    assert_eq!((&content["show"]["kind"], &content["files"][0]["object"]), (&"file".into(), &1.into()));
    view(&folder, &["two.obj", "--object", "none"]).failed(1, &["--object", "\"none\""]);
}

#[test]
fn motions_have_both_ends_and_the_options() {
    let folder = world();
    let motion = format!("{POSE} {IDENTITY}");
    view(
        &folder,
        &["cube.cbvh", "small.obj", "--motion", &motion, "--clearance", "0.5", "--tolerance", "1e-4"],
    )
    .done();
    let show = json!({ "kind": "motion", "motion": numbers(&motion), "clearance": 0.5, "tolerance": 1e-4 });
    assert_eq!(page(&folder).0["show"], show);
    view(&folder, &["cube.cbvh", "--motion", &motion]).done();
    let show = json!({ "kind": "motion", "motion": numbers(&motion), "clearance": 0.0, "tolerance": null, "same": true });
    assert_eq!(page(&folder).0["show"], show);
}

const SCENE: &str = "\
mesh block cube.cbvh
mesh \"block again\" cube.obj
sphere ball 0.5
box table 4 4 0.5
instance base block 1 0 0 0  0 1 0 0  0 0 1 0
instance arm block 1 0 0 5  0 1 0 0  0 0 1 0
instance \"the ball\" ball 1 0 0 0  0 1 0 7  0 0 1 0
instance desk table 1 0 0 0  0 1 0 0  0 0 1 -9
moving arm base
allow base arm
margin arm 0.125
";

#[test]
fn scenes_have_instances_margins_and_frames() {
    let folder = world();
    folder.write("cell.scene", SCENE);
    let [arm, base] = ["1 0 0 50  0 1 0 0  0 0 1 0", "1 0 0 -50  0 1 0 0  0 0 1 0"];
    folder.write("frames.txt", format!("{arm} {base}\n{base} {arm}\n"));
    let told = view(&folder, &["--scene", "cell.scene", "frames.txt"]).done();
    assert_eq!(told.out, "page.html: shows cell.scene, frames.txt\n");
    let (content, files) = page(&folder);
    // The shape that no instance uses is not there.
    assert_eq!(files.len(), 3);
    assert_eq!(files[0], std::fs::read(folder.join("cube.cbvh")).unwrap());
    let of_files = |field: &str| (0..3).map(|k| content["files"][k][field].clone()).collect::<Vec<_>>();
    assert_eq!(of_files("name"), ["block", "ball", "table"]);
    assert_eq!(of_files("path"), ["cube.cbvh", "cell.scene", "cell.scene"]);
    let show = &content["show"];
    let of = |field: &str| (0..4).map(|k| show["instances"][k][field].clone()).collect::<Vec<_>>();
    assert_eq!(of("name"), ["base", "arm", "the ball", "desk"]);
    assert_eq!(of("file"), [0, 0, 1, 2]);
    assert_eq!(of("margin"), [0.0, 0.125, 0.0, 0.0]);
    assert_eq!(of("moving"), [true, true, false, false]);
    assert_eq!(of("pose")[1], json!(numbers("1 0 0 5 0 1 0 0 0 0 1 0")));
    assert_eq!(show["allowed"], json!([[0, 1]]));
    // What stands still is asked about with what moves only.
    assert_eq!(
        (of("member"), of("meets")),
        (vec![json!(1), json!(1), json!(2), json!(2)], vec![json!(3), json!(3), json!(1), json!(1)])
    );
    // Frames are in the order of the instances, not of the line that says what moves.
    let frames = [format!("{base} {arm}"), format!("{arm} {base}")].map(|frame| numbers(&frame));
    assert_eq!(show["frames"], json!(frames));
    // The files state radius and solidity, so that they are opened as shapes.
    for (file, bytes, radius, solid) in
        [("ball.cbvh", &files[1], 0.5, false), ("table.cbvh", &files[2], 0.0, true)]
    {
        folder.write(file, bytes);
        let dump = cbvh_in(&folder, &["dump", file, "--json"]).done().json();
        let object = &dump["objects"][0];
        assert_eq!((&object["radius"], &object["solid"]), (&radius.into(), &solid.into()), "{object}");
    }
    view(&folder, &["--scene", "cell.scene"]).done();
    let (content, _) = page(&folder);
    assert_eq!(
        (&content["show"]["frames"], &content["show"]["instances"][0]["moving"]),
        (&json!([]), &true.into())
    );
}

#[test]
fn baked_scenes_are_one_file() {
    let folder = world();
    folder.write("two.gltf", two_nodes());
    folder.cbvh("bake two.gltf --scene -o two.cbvh -q").done();
    let baked = std::fs::read(folder.join("two.cbvh")).unwrap();
    for arguments in [&["--scene", "two.cbvh"][..], &["two.cbvh"]] {
        view(&folder, arguments).done();
        let (content, files) = page(&folder);
        assert_eq!(files, [&baked[..]]);
        let instances = content["show"]["instances"].as_array().unwrap();
        assert_eq!(instances.len(), 2);
        assert!(instances.iter().all(|instance| instance["file"] == 0 && instance["moving"] == false));
        assert_eq!((&instances[0]["name"], &instances[1]["name"]), (&"left".into(), &"right".into()));
        assert_eq!(instances[1]["pose"], json!(numbers("1 0 0 7 0 1 0 0 0 0 1 0")));
    }
    folder.write("frames.txt", format!("{IDENTITY} {IDENTITY}"));
    view(&folder, &["--scene", "two.cbvh", "frames.txt"]).done();
    let (content, _) = page(&folder);
    assert_eq!(content["show"]["frames"], json!([numbers(&format!("{IDENTITY} {IDENTITY}"))]));
    assert_eq!(content["show"]["instances"][0]["moving"], true);
    view(&folder, &["two.cbvh", "--pose", IDENTITY]).failed(3, &["two.cbvh", "found a scene"]);
    view(&folder, &["--scene", "two.gltf"]).failed(3, &["two.gltf", "found glTF"]);
}

/// Returns a glTF document with a triangle in two places.
fn two_nodes() -> String {
    let buffer: Vec<u8> =
        [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].into_iter().flat_map(f32::to_le_bytes).collect();
    json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "name": "left", "mesh": 0 }, { "name": "right", "mesh": 0, "translation": [7, 0, 0] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(buffer)) }],
    })
    .to_string()
}

#[test]
fn clashes_are_about_parts_that_share_files() {
    let folder = world();
    // A copy of a part, and a part that overlaps both.
    folder.write(
        "manifest.jsonl",
        "{\"file\": \"cube.cbvh\", \"name\": \"first\"}\n{\"file\": \"cube.cbvh\", \"name\": \"copy\"}\n\
        {\"file\": \"cube.cbvh\", \"name\": \"deep\", \"pose\": [1, 0, 0, 1.5, 0, 1, 0, 0, 0, 0, 1, 0]}\n",
    );
    let found = folder.cbvh("clash --manifest manifest.jsonl --view page.html --json").done().json();
    let (content, files) = page(&folder);
    assert_eq!(files, [std::fs::read(folder.join("cube.cbvh")).unwrap()]);
    let show = &content["show"];
    assert_eq!(show["kind"], "clash");
    let names: Vec<&str> =
        show["instances"].as_array().unwrap().iter().map(|part| part["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["first", "copy", "deep"]);
    let (shown, told) = (show["clashes"].as_array().unwrap(), found["clashes"].as_array().unwrap());
    assert!(shown.len() == told.len() && shown.len() == 2, "{shown:?}");
    for (shown, told) in shown.iter().zip(told) {
        let name = |field: &str| names[shown[field].as_u64().unwrap() as usize];
        assert_eq!((name("a"), name("b")), (told["a"].as_str().unwrap(), told["b"].as_str().unwrap()));
        for field in ["class", "lower", "upper", "distance", "point", "translation"] {
            assert_eq!(shown[field], told[field], "{field}");
        }
    }
    // What both have in common is in the page if it was measured: a rod passes through a cube.
    let cube = cube();
    let rod = cube.lines().map(|line| match line.strip_prefix("v ") {
        Some(corner) => {
            let corner: Vec<f64> = corner.split(' ').map(|x| x.parse().unwrap()).collect();
            format!("v {} {} {}\n", corner[0] / 4.0 + 0.25, corner[1] / 4.0 + 0.25, corner[2] * 4.0 - 1.5)
        }
        None => format!("{line}\n"),
    });
    folder.write("rod.obj", rod.collect::<String>());
    folder.write(
        "manifest.jsonl",
        "{\"file\": \"cube.cbvh\", \"name\": \"first\"}\n{\"file\": \"rod.obj\", \"name\": \"rod\"}\n\
        {\"file\": \"cube.cbvh\", \"name\": \"copy\"}\n",
    );
    let found =
        folder.cbvh("clash --manifest manifest.jsonl --magnitudes --view page.html --json").done().json();
    let (content, _) = page(&folder);
    let (shown, told) = (&content["show"]["clashes"], &found["clashes"]);
    for (shown, told) in shown.as_array().unwrap().iter().zip(told.as_array().unwrap()) {
        assert!(
            told["volume"].as_f64().unwrap() > 0.0 && shown["volume"] == told["volume"],
            "{shown} {told}"
        );
        let pierced = if told["class"] == "piercing" { &told["pierced"] } else { &Value::Null };
        assert_eq!(&shown["pierced"], pierced);
    }
    let classes: Vec<&Value> = told.as_array().unwrap().iter().map(|clash| &clash["class"]).collect();
    assert_eq!(classes, ["piercing", "duplicated"]);
    folder.cbvh("clash --manifest manifest.jsonl --max-page 1MiB").failed(1, &["--max-page requires --view"]);
    folder.cbvh("clash --manifest manifest.jsonl --view -").failed(1, &["--view: expected a file, found -"]);
    // An input is no output, whether the command line, the manifest or a folder names it.
    let baked = std::fs::read(folder.join("cube.cbvh")).unwrap();
    std::fs::create_dir(folder.join("parts")).unwrap();
    folder.write("parts/one.cbvh", &baked);
    folder.write("parts/two.cbvh", &baked);
    for (inputs, taken) in [
        ("--manifest manifest.jsonl", "manifest.jsonl"),
        ("--manifest manifest.jsonl", "cube.cbvh"),
        ("parts", "parts/two.cbvh"),
    ] {
        for option in ["--view", "--csv", "--bcf"] {
            folder.cbvh(&format!("clash {inputs} {option} ./{taken}")).failed(1, &[taken, "found an input"]);
        }
    }
    assert_eq!(std::fs::read(folder.join("cube.cbvh")).unwrap(), baked);
    assert_eq!(std::fs::read(folder.join("parts/two.cbvh")).unwrap(), baked);
    let limited = "clash --manifest manifest.jsonl --view other.html --csv other.csv --max-page 1";
    folder.cbvh(limited).failed(4, &["--max-page"]);
    assert!(!folder.join("other.html").exists() && !folder.join("other.csv").exists());
}

#[test]
fn wrong_numbers_are_refused_as_by_queries() {
    let folder = world();
    let turned = "1 0 0 0  0 1 0 0  0 0 2 0";
    for (pose, words) in [
        ("1 0 0 0 0 1 0 0 0 0 1", "found 11"),
        ("1 0 0 0 0 1 0 0 0 0 1 0 0", "found 13"),
        ("", "found none"),
        ("a", "expected a number"),
        ("1 0 0 nan  0 1 0 0  0 0 1 0", "NaN"),
        ("1 0 0 inf  0 1 0 0  0 0 1 0", "inf"),
        (turned, "rotation"),
        ("-1 0 0 0  0 1 0 0  0 0 1 0", "rotation"),
    ] {
        let shown = view(&folder, &["cube.cbvh", "--pose", pose]).failed(3, &["--pose"]);
        let asked = cbvh_in(&folder, &["query", "cube.cbvh", "cube.cbvh", "--pose", pose]);
        assert_eq!((shown.code, &shown.err), (asked.code, &asked.err), "{words}");
    }
    for motion in
        [IDENTITY, &format!("{IDENTITY} {turned}"), &format!("{IDENTITY} -1 0 0 0  0 -1 0 0  0 0 1 0")]
    {
        let shown = view(&folder, &["cube.cbvh", "--motion", motion]).failed(3, &["--motion"]);
        let asked = cbvh_in(&folder, &["motion", "cube.cbvh", "cube.cbvh", "--motion", motion]);
        assert_eq!((shown.code, &shown.err), (asked.code, &asked.err));
    }
    folder.write("cell.scene", SCENE);
    folder.write("frames.txt", IDENTITY);
    view(&folder, &["--scene", "cell.scene", "frames.txt"])
        .failed(3, &["frames.txt", "line 1", "24 numbers"]);
    // The rotation is rigid enough for a pair, and not for a scene.
    folder.write("frames.txt", format!("{IDENTITY} 1.0000004 0 0 0  0 1 0 0  0 0 1 0"));
    view(&folder, &["--scene", "cell.scene", "frames.txt"]).failed(3, &["frames.txt", "line 1", "base"]);
    assert!(!folder.join("page.html").exists());
}

#[test]
fn wrong_usage_says_so() {
    let folder = world();
    folder.write("cell.scene", SCENE);
    for (arguments, words) in [
        (&[][..], "FILE"),
        (&["cube.cbvh", "cube.cbvh", "cube.cbvh"], "found 3 files"),
        (&["cube.cbvh", "--scene", "cell.scene"], "--scene"),
        (&["cube.cbvh", "--pose", IDENTITY, "--motion", IDENTITY], "--motion"),
        (&["cube.cbvh", "--clearance", "1"], "--motion"),
        (&["cube.cbvh", "--within", "-1"], "--within"),
        (&["cube.cbvh", "--within", "nan"], "--within"),
        (&["cube.cbvh", "--profile", "none"], "dop14-u8"),
        (&["cube.cbvh", "--max-page", "much"], "512MiB"),
    ] {
        view(&folder, arguments).failed(1, &[words]);
    }
    let small = view(&folder, &["cube.cbvh", "--max-page", "100"]);
    small.failed(4, &["100 bytes", "--triangles packed", "--max-page 1MiB"]);
    assert!(!folder.join("page.html").exists());
}

#[test]
fn nothing_but_the_page_is_written_or_replaced() {
    let folder = world();
    let before = names(&folder);
    let baked = std::fs::read(folder.join("cube.cbvh")).unwrap();
    folder.write("damaged.cbvh", &baked[..baked.len() - 100]);
    let mut flipped = baked.clone();
    flipped[baked.len() / 2] ^= 1;
    folder.write("flipped.cbvh", &flipped);
    let to = |arguments: &str| folder.cbvh(&format!("view {arguments}"));
    to("missing.cbvh -o page.html").failed(2, &["missing.cbvh", "nothing of this name"]);
    to("damaged.cbvh -o page.html").failed(3, &["damaged.cbvh"]);
    to("flipped.cbvh -o page.html").failed(3, &["flipped.cbvh"]);
    to("cube.cbvh -o -").failed(1, &["found -"]);
    to("cube.cbvh -o .").failed(2, &["directory"]);
    to("cube.cbvh -o none/page.html").failed(2, &["the folder none"]);
    // An input is no output, however it is named.
    to("cube.cbvh -o ./cube.cbvh").failed(1, &["cube.cbvh"]);
    folder.write("cell.scene", SCENE);
    to("--scene cell.scene -o cube.cbvh").failed(1, &["cube.cbvh"]);
    to("--scene cell.scene -o cell.scene").failed(1, &["cell.scene"]);
    // No instance has this shape.
    to("--scene cell.scene -o cube.obj").failed(1, &["cube.obj"]);
    assert_eq!(std::fs::read(folder.join("cube.cbvh")).unwrap(), baked);
    for name in ["damaged.cbvh", "flipped.cbvh", "cell.scene"] {
        std::fs::remove_file(folder.join(name)).unwrap();
    }
    assert_eq!(names(&folder), before);
    // An earlier page stays until the new one is whole.
    view(&folder, &["cube.cbvh"]).done();
    let page = folder.text("page.html");
    view(&folder, &["missing.cbvh"]).failed(2, &["missing.cbvh"]);
    assert_eq!(folder.text("page.html"), page);
    view(&folder, &["small.obj"]).done();
    assert_ne!(folder.text("page.html"), page);
}

/// Tests what starts programs, which are shell scripts here.
#[cfg(unix)]
mod browser {
    use super::*;
    use std::os::unix::fs::PermissionsExt as _;
    use std::process::{Command, Output};

    /// Runs `cbvh view` with a browser of one's own, whose script is given, or without one.
    fn show(folder: &Path, script: Option<&str>, arguments: &[&str]) -> Output {
        for name in ["bin", "temporary folder"] {
            std::fs::create_dir_all(folder.join(name)).unwrap();
        }
        for program in ["xdg-open", "open"] {
            let path = folder.join("bin").join(program);
            let _ = std::fs::remove_file(&path);
            if let Some(script) = script {
                std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
                std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
            }
        }
        Command::new(env!("CARGO_BIN_EXE_cbvh"))
            .arg("view")
            .args(arguments)
            .current_dir(folder)
            .env("PATH", folder.join("bin"))
            .env("TMPDIR", folder.join("temporary folder"))
            .output()
            .unwrap()
    }

    /// Returns the only page in the temporary folder, and removes it.
    fn only_page(folder: &Path) -> (String, String) {
        let all = folder.join("temporary folder");
        let [name] = &names(&all)[..] else { panic!("{:?}", names(&all)) };
        assert_eq!(names(&all.join(name)), ["view.html"]);
        let mode = std::fs::metadata(all.join(name)).unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "others may not read the page");
        let path = all.join(name).join("view.html");
        let page = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_dir_all(all.join(name)).unwrap();
        (path.to_str().unwrap().to_owned(), page)
    }

    #[test]
    fn the_page_is_opened() {
        let folder = world();
        let hostile = "$(touch hacked);.obj";
        folder.write(hostile, cube());
        let shown = show(&folder, Some("echo \"$#:$1\" > opened"), &[hostile]);
        assert!(shown.status.success(), "{shown:?}");
        let (path, page) = only_page(&folder);
        assert_eq!(folder.text("opened"), format!("1:{path}\n"));
        assert_eq!(String::from_utf8(shown.stdout).unwrap(), format!("{path}: shows {hostile}\n"));
        assert_eq!(unpacked(&page).0["files"][0]["name"], hostile);
        assert!(!folder.join("hacked").exists());
    }

    #[test]
    fn without_a_browser_the_page_is_named() {
        let folder = world();
        for (script, word) in [(None, "found none"), (Some("exit 3"), "exit status: 3")] {
            let shown = show(&folder, script, &["cube.cbvh"]);
            let (path, page) = only_page(&folder);
            let err = String::from_utf8(shown.stderr).unwrap();
            assert_eq!(shown.status.code(), Some(2));
            assert!(err.lines().count() == 1 && err.contains(&path) && err.contains(word), "{err}");
            assert_eq!(unpacked(&page).0["show"]["kind"], "file");
        }
    }

    #[test]
    fn nothing_is_left_of_a_page_that_fails() {
        let folder = world();
        let shown = show(&folder, Some("true"), &["missing.cbvh"]);
        assert_eq!(shown.status.code(), Some(2));
        let shown = show(&folder, Some("true"), &["cube.cbvh", "--max-page", "1"]);
        assert_eq!(shown.status.code(), Some(4));
        assert_eq!(names(&folder.join("temporary folder")), [""; 0]);
    }
}
