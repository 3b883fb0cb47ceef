//! Checks what differs on Windows: files in use are not replaced, paths have drives and devices, and the case of names is ignored.

use crate::common::sheet::write_sheet;
use crate::common::{Files as _, cbvh_in, cube, cube_at, gltf, names, place, skip};
use serde_json::json;
use std::fs::{self, File};
use std::os::windows::fs::OpenOptionsExt;
use std::os::windows::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const POSE: &str = "1 0 0 5 0 1 0 0 0 0 1 0";
const SHARE_READ: u32 = 1;

/// Bakes another mesh to a file in use. Either that fails with one line that names the file and the remedy, or the file
/// is replaced. Nothing else is left.
#[track_caller]
fn bake_over(directory: &Path, is_refused: Option<bool>) {
    let old = fs::read(directory.join("o.cbvh")).unwrap();
    directory.write("cube.obj", cube_at(2, 7));
    for budget in [&[][..], &["--max-memory", "100MiB"]] {
        let ended =
            cbvh_in(directory, &[&["bake", "cube.obj", "-o", "o.cbvh", "--force", "-q"], budget].concat());
        if is_refused.unwrap_or(ended.code != 0) {
            ended
                .failed(2, &["cbvh: o.cbvh: cannot replace: ", "; close the program that has the file open"]);
            assert_eq!(fs::read(directory.join("o.cbvh")).unwrap(), old);
        } else {
            ended.done();
            directory.cbvh("verify o.cbvh cube.obj").done();
        }
        assert_eq!(names(directory), ["cube.obj", "o.cbvh"]);
    }
}

#[test]
fn an_output_that_is_open_elsewhere_is_one_clear_error() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.cbvh("bake cube.obj -o o.cbvh").done();
    // As most programs open files: others may read them, but not replace them.
    let open = File::options().read(true).share_mode(SHARE_READ).open(directory.join("o.cbvh")).unwrap();
    bake_over(directory, Some(true));
    drop(open);
    bake_over(directory, Some(false));
}

/// Whether a mapped file may be replaced depends on the version and the file system. If it may, the map keeps its content.
#[test]
fn an_output_that_is_mapped_is_one_clear_error_or_is_replaced() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.cbvh("bake cube.obj -o o.cbvh").done();
    let before = fs::read(directory.join("o.cbvh")).unwrap();
    // SAFETY: nobody writes to the file: a bake replaces it by another one.
    let mapped = unsafe { bvh_query::Bvh::map(directory.join("o.cbvh")) }.unwrap();
    bake_over(directory, None);
    assert!(mapped.bytes() == before);
    // Nobody can cut off what is mapped.
    let cut = File::options().write(true).open(directory.join("o.cbvh")).and_then(|file| file.set_len(0));
    assert!(cut.is_err() || mapped.bytes() == before);
    drop(mapped);
}

/// An asset that cannot be replaced does not stop the others, and the output manifest can be read meanwhile.
#[test]
fn an_asset_in_use_fails_alone() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.cbvh("bake cube.obj -o a.cbvh").done();
    let _open = File::options().read(true).share_mode(SHARE_READ).open(directory.join("a.cbvh")).unwrap();
    let line = |output: &str| json!({"input": "cube.obj", "output": output}).to_string() + "\n";
    directory.write("in.jsonl", line("a.cbvh") + &line("b.cbvh"));
    let bake = "bake --manifest in.jsonl --out-manifest out.jsonl --force -q";
    let ended = directory.cbvh(bake);
    assert_eq!(ended.code, 2, "{ended:?}");
    assert!(ended.err.contains("a.cbvh: cannot replace: "), "{ended:?}");
    directory.cbvh("verify b.cbvh cube.obj").done();
    assert_eq!(names(directory), ["a.cbvh", "b.cbvh", "cube.obj", "in.jsonl", "out.jsonl"]);
    // Another process writes the results.
    let _part = File::options().append(true).create(true).open(directory.join("out.jsonl.part")).unwrap();
    directory.cbvh(bake).failed(2, &["out.jsonl.part: expected a file that no other process uses"]);
}

#[test]
fn outputs_that_differ_in_case_are_one() {
    let directory = &place();
    fs::create_dir(directory.join("there")).unwrap();
    directory.write("cube.obj", cube());
    for (a, b) in [("there/O.cbvh", "There\\o.CBVH"), ("new/ö.cbvh", "NEW/Ö.cbvh"), ("o.cbvh", "o.cbvh. ")]
    {
        let line = |output: &str| json!({"input": "cube.obj", "output": output}).to_string() + "\n";
        directory.write("in.jsonl", line(a) + &line(b));
        directory
            .cbvh("bake --manifest in.jsonl --out-manifest out.jsonl")
            .failed(3, &["expected an output of one asset only", "asset 1 ", "asset 2 "]);
    }
    directory
        .cbvh("bake cube.obj -o CUBE.OBJ")
        .failed(1, &["CUBE.OBJ: expected an output other than the inputs"]);
    assert_eq!(names(directory), ["cube.obj", "in.jsonl", "there"]);
}

#[test]
fn all_forms_of_paths_lead_to_the_file() {
    let directory = &place();
    fs::create_dir_all(directory.join("a b/ü")).unwrap();
    directory.write("a b/ü/cube.obj", cube());
    let whole = fs::canonicalize(directory.join("a b/ü")).unwrap();
    let whole = whole.to_str().unwrap();
    assert!(whole.starts_with(r"\\?\"), "{whole}");
    let drive = &whole[4..6];
    let forms = [
        "a b/ü".to_owned(),
        r"a b\ü".to_owned(),
        r".\a b/ü\..\ü".to_owned(),
        whole.to_owned(),
        whole[4..].to_owned(),
        whole[4..].replace('\\', "/"),
        format!(r"\\.\{}", &whole[4..]),
        // Relative to the current folder of the drive.
        format!(r"{drive}a b\ü"),
        // On the current drive.
        whole[6..].to_owned(),
    ];
    for form in &forms {
        let [mesh, out] = ["cube.obj", "o.cbvh"].map(|name| format!(r"{form}\{name}"));
        cbvh_in(directory, &["bake", &mesh, "-o", &out, "-q"]).done();
        cbvh_in(directory, &["verify", &out, &mesh]).done();
        assert_eq!(
            cbvh_in(directory, &["bake", &mesh, "-o", &out, "--json"]).json()["skipped"],
            true,
            "{form}"
        );
        let quoted = mesh.replace('\\', r"\\");
        directory.write(
            "s.scene",
            format!("mesh m \"{quoted}\"\ninstance a m {POSE}\ninstance b m {POSE}\nmoving b\n"),
        );
        directory.write("f.txt", POSE);
        assert_eq!(directory.cbvh("scene s.scene f.txt --mode pairs").done().out, "1\n");
        directory.write(
            "in.jsonl",
            json!({"input": mesh, "output": format!(r"{form}\deep\er\o.cbvh")}).to_string(),
        );
        directory.cbvh("bake --manifest in.jsonl --out-manifest out.jsonl -q").done();
        fs::remove_dir_all(directory.join(r"a b\ü\deep")).unwrap();
        fs::remove_file(directory.join(r"a b\ü\o.cbvh")).unwrap();
    }
    assert_eq!(names(&directory.join("a b/ü")), ["cube.obj"]);
}

/// Longer than the 260 characters that Windows usually allows.
#[test]
fn paths_may_be_long() {
    let directory = &place();
    let deep = vec!["a folder with a long name"; 12].join("/");
    fs::create_dir_all(directory.join(&deep)).unwrap();
    let [mesh, out, link] = ["cube.obj", "o.cbvh", "a.gltf"].map(|name| format!("{deep}/{name}"));
    directory.write(&mesh, cube());
    cbvh_in(directory, &["bake", &mesh, "-o", &out, "--max-memory", "100MiB"]).done();
    cbvh_in(directory, &["validate", &out]).done();
    assert!(
        cbvh_in(directory, &["query", &out, &mesh, "--mode", "distance", "--pose", POSE])
            .done()
            .out
            .starts_with("distance 3.0\n")
    );
    let values = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    directory.write(&format!("{deep}/p.bin"), values.map(f32::to_le_bytes).concat());
    directory.write(&format!("{deep}/i.bin"), [0u32, 1, 2].map(u32::to_le_bytes).concat());
    if fs::canonicalize(directory.join(&mesh)).is_err() {
        return skip("Wine does not resolve long paths, which the buffers of glTF files need");
    }
    directory.write(&link, gltf(3, 3, "p.bin", "i.bin"));
    cbvh_in(directory, &["bake", &link, "-o", &out]).done();
}

/// Devices have names in every folder. They are refused at once, by each reader and each writer.
#[test]
fn devices_are_neither_inputs_nor_outputs() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.write("f.txt", POSE);
    directory.cbvh("bake cube.obj -o o.cbvh").done();
    for device in ["NUL", "CON", "con", r".\nul", "COM1", r"\\.\NUL", "CONIN$"] {
        for inputs in [
            &["bake", device, "-o", "x.cbvh"][..],
            &["bake", device, "-o", "x.cbvh", "--max-memory", "100MiB"],
            &["query", device, "cube.obj", "f.txt"],
            &["query", "o.cbvh", "o.cbvh", device],
            &["dump", device],
            &["validate", device],
            &["verify", "o.cbvh", device],
        ] {
            cbvh_in(directory, inputs)
                .failed(2, &[device, "expected a readable file, found a device or a pipe"]);
        }
        directory.write("in.jsonl", json!({"input": device, "output": "x.cbvh"}).to_string());
        let ended = directory.cbvh("bake --manifest in.jsonl --out-manifest out.jsonl");
        assert!(ended.code == 2 && ended.err.contains(device), "{ended:?}");
        let quoted = device.replace('\\', r"\\");
        directory.write("s.scene", format!("mesh m \"{quoted}\"\ninstance a m {POSE}\nmoving a\n"));
        directory.cbvh("scene s.scene f.txt").failed(2, &[device]);
    }
    for device in ["NUL", "con.cbvh", r".\nul", "COM1"] {
        cbvh_in(directory, &["bake", "cube.obj", "-o", device])
            .failed(2, &[device, "expected a regular file or none, found the name of a device"]);
        let out = ["query", "o.cbvh", "o.cbvh", "f.txt", "--json", "--out", device];
        cbvh_in(directory, &out).failed(2, &[device, "the name of a device"]);
    }
    for uri in
        ["NUL", "sub/nul.bin", "CON", r"..\\p.bin", r"C:\\p.bin", r"\\\\server\\share\\p.bin", r"\\p.bin"]
    {
        directory.write("a.gltf", gltf(3, 3, uri, "i.bin"));
        let ended = directory.cbvh("bake a.gltf -o x.cbvh");
        assert!(ended.code == 2 || ended.code == 3, "{uri}: {ended:?}");
        ended
            .err
            .lines()
            .for_each(|line| assert!(line.starts_with("cbvh: a.gltf: ") || ended.code == 2, "{uri}: {line}"));
    }
    assert_eq!(
        names(directory),
        ["a.gltf", "cube.obj", "f.txt", "in.jsonl", "o.cbvh", "out.jsonl", "s.scene"]
    );
}

#[link(name = "kernel32")]
unsafe extern "system" {
    /// Sends an event to all processes of a group that share the console of this process.
    safe fn GenerateConsoleCtrlEvent(event: u32, group: u32) -> i32;
}

#[test]
fn a_bake_that_the_console_stops_leaves_nothing() {
    const CTRL_BREAK: u32 = 1;
    const NEW_GROUP: u32 = 0x200;
    const STOPPED: i32 = 0xC000_013A_u32 as i32;
    let directory = &place();
    write_sheet(&directory.join("large.stl"), 600);
    directory.write("cube.obj", cube());
    directory.cbvh("bake cube.obj -o out.cbvh").done();
    let old = fs::read(directory.join("out.cbvh")).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_cbvh"))
        .args(["bake", "large.stl", "-o", "out.cbvh", "--max-memory", "120MiB"])
        .current_dir(directory)
        .creation_flags(NEW_GROUP)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(File::create(directory.join("said")).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    // Until the output has been begun.
    let is_unfinished = |name: &String| name.starts_with(".out.cbvh.");
    while !names(directory).iter().any(is_unfinished) {
        assert!(child.try_wait().unwrap().is_none(), "done before it could be stopped");
        assert!(start.elapsed() < Duration::from_secs(100), "no output");
        std::thread::sleep(Duration::from_millis(2));
    }
    if GenerateConsoleCtrlEvent(CTRL_BREAK, child.id()) == 0 {
        child.kill().unwrap();
        child.wait().unwrap();
        return skip("this process has no console");
    }
    assert_eq!(child.wait().unwrap().code(), Some(STOPPED));
    assert_eq!(directory.text("said"), "cbvh: stopped by the console; no unfinished file was left behind\n");
    assert_eq!(names(directory), ["cube.obj", "large.stl", "out.cbvh", "said"]);
    assert_eq!(fs::read(directory.join("out.cbvh")).unwrap(), old);
}
