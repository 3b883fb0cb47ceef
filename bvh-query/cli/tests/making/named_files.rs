//! Checks which files the command opens because a text or a folder names them, that none of them makes it wait, and which files
//! outputs replace whose names are links.

use crate::common::{Files as _, Place, cbvh_in, cube, gltf, names, place};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

/// Returns a folder with a cube and with a named pipe that nobody writes to, under several names.
fn with_pipes() -> Place {
    let place = place();
    fs::write(place.join("cube.obj"), cube()).unwrap();
    for name in ["pipe", "pipe.obj", "pipe.cbvh", "pipe.txt"] {
        assert!(Command::new("mkfifo").arg(place.join(name)).status().unwrap().success());
    }
    place
}

/// Returns whether a name is that of a link.
fn is_link(path: &Path) -> bool {
    path.symlink_metadata().unwrap().is_symlink()
}

#[test]
fn an_output_goes_where_its_links_lead() {
    let directory = &place();
    directory.write("cube.obj", cube());
    fs::create_dir(directory.join("far")).unwrap();
    symlink("far/out.cbvh", directory.join("link")).unwrap();
    symlink(directory.join("link"), directory.join("far/links")).unwrap();
    directory.write("far/.out.cbvh.123-4.tmp", "left by a process that was killed");
    let bake = "bake cube.obj -o far/links --json -q";
    assert_eq!(directory.cbvh(bake).done().json()["skipped"], false);
    assert_eq!(directory.cbvh(bake).done().json()["skipped"], true);
    // The file is replaced, not written to: another name of the old one keeps its content.
    directory.write("far/out.cbvh", "old");
    fs::hard_link(directory.join("far/out.cbvh"), directory.join("old")).unwrap();
    for more in ["", " --force --max-memory 512MiB"] {
        directory.cbvh(&format!("{bake}{more}")).done();
    }
    directory.cbvh("validate far/out.cbvh").done();
    assert_eq!(directory.text("old"), "old");
    // Other outputs are written in the same way.
    directory.cbvh("query cube.obj cube.obj --mode distance --witness link").done();
    assert!(directory.text("far/out.cbvh").contains("v "));
    assert!(is_link(&directory.join("link")) && is_link(&directory.join("far/links")));
    assert_eq!(names(directory), ["cube.obj", "far", "link", "old"]);
    assert_eq!(names(&directory.join("far")), ["links", "out.cbvh"]);
}

#[test]
fn names_that_lead_to_one_file_are_one_output() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.write("p.txt", format!("{POSE}\n"));
    symlink("p.txt", directory.join("poses")).unwrap();
    symlink("new.csv", directory.join("link")).unwrap();
    let asked = |poses: &str, out: &str| {
        directory.cbvh(&format!("query cube.obj cube.obj {poses} --bench --out {out}"))
    };
    asked("p.txt", "poses").failed(1, &["poses: expected an output other than the inputs"]);
    asked("poses", "p.txt").failed(1, &["p.txt: expected an output other than the inputs"]);
    directory.cbvh("clash cube.obj cube.obj --csv link --bcf new.csv").failed(1, &["for each output"]);
    let line = |output: &str| format!("{{\"input\": \"cube.obj\", \"output\": \"{output}\"}}\n");
    directory.write("in.jsonl", line("link") + &line("new.csv"));
    directory.cbvh("bake --manifest in.jsonl --out-manifest out").failed(3, &["an output of one asset only"]);
    assert_eq!(names(directory), ["cube.obj", "in.jsonl", "link", "p.txt", "poses"]);
}

#[cfg(target_os = "linux")]
#[test]
fn links_into_the_system_are_no_outputs() {
    let directory = &with_pipes();
    // Standard output is a regular file here, which the links must not make an output.
    symlink("/proc/self/fd/1", directory.join("out")).unwrap();
    symlink("/proc/self/fd", directory.join("fd")).unwrap();
    symlink("out", directory.join("again")).unwrap();
    symlink("/dev/none.cbvh", directory.join("none")).unwrap();
    symlink("pipe", directory.join("piped")).unwrap();
    symlink("cycle", directory.join("cycle")).unwrap();
    let before = names(directory);
    for output in ["out", "fd/1", "again", "none", "piped", "cycle"] {
        let words = [output, "expected a regular file or none, found a special file"];
        directory.cbvh(&format!("bake cube.obj -o {output}")).failed(2, &words);
        let query = "query cube.obj cube.obj --mode distance --witness";
        directory.cbvh(&format!("{query} {output}")).failed(2, &words);
    }
    assert!(["out", "again", "none", "piped"].iter().all(|link| is_link(&directory.join(link))));
    assert_eq!(names(directory), before);
}

const POSE: &str = "1 0 0 0 0 1 0 0 0 0 1 0";

#[test]
fn no_named_file_makes_the_command_wait() {
    let directory = &with_pipes();
    let write = |name: &str, text: &str| directory.write(name, text);
    for pipe in ["pipe.obj", "pipe.cbvh", "pipe"] {
        write(
            "cell.scene",
            &format!("mesh a cube.obj\nmesh b {pipe}\ninstance a a {POSE}\ninstance b b {POSE}\nmoving a\n"),
        );
        write("frames.txt", &format!("{POSE}\n"));
        directory.cbvh("scene cell.scene frames.txt").failed(2, &[pipe, "not a regular file"]);
        write("pairs.txt", &format!("one cube.obj {pipe}\n"));
        directory.cbvh("report pairs.txt --out report").failed(2, &[pipe, "not a regular file"]);
    }
    write("pairs.txt", "one cube.obj cube.obj pipe.txt\n");
    directory.cbvh("report pairs.txt --out report").failed(2, &["pipe.txt", "not a regular file"]);
    for check in
        [&["validate", "pipe.cbvh"][..], &["dump", "pipe.cbvh"], &["verify", "pipe.cbvh", "cube.obj"]]
    {
        cbvh_in(directory, check).failed(2, &["pipe.cbvh", "not a regular file"]);
    }
    cbvh_in(directory, &["query", "pipe.cbvh", "cube.obj", "--pose", POSE])
        .failed(2, &["pipe.cbvh", "not a regular file"]);
}

/// The assets beside the pipe are baked.
#[test]
fn no_asset_makes_the_command_wait() {
    let directory = &with_pipes();
    let manifest = r#"{"input":"pipe.obj","output":"out/a.cbvh"}
{"input":"cube.obj","output":"out/b.cbvh"}
{"input":"/dev/zero","output":"out/c.cbvh"}
"#;
    directory.write("in.jsonl", manifest);
    let ended = directory.cbvh("bake --manifest in.jsonl --out-manifest out.jsonl -q");
    assert_eq!(ended.code, 2, "{ended:?}");
    assert_eq!(ended.err.matches("not a regular file").count(), 2, "{ended:?}");
    assert!(directory.join("out/b.cbvh").is_file());
    fs::create_dir(directory.join("meshes")).unwrap();
    fs::rename(directory.join("pipe.obj"), directory.join("meshes/pipe.obj")).unwrap();
    fs::copy(directory.join("cube.obj"), directory.join("meshes/cube.obj")).unwrap();
    symlink("/dev/zero", directory.join("meshes/zero.stl")).unwrap();
    let ended = directory.cbvh("bake meshes -o baked -q");
    assert_eq!(ended.code, 2, "{ended:?}");
    assert_eq!(ended.err.matches("not a regular file").count(), 2, "{ended:?}");
    assert!(directory.join("baked/cube.cbvh").is_file());
}

/// What the command line itself names may be a pipe.
#[test]
fn arguments_may_be_pipes() {
    let directory = &with_pipes();
    directory.write("p.txt", format!("{POSE}\n"));
    let piped = |input: &str, arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_cbvh"))
            .args(arguments)
            .current_dir(directory)
            .stdin(Stdio::from(cat(&directory.join(input))))
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
    };
    piped("p.txt", &["query", "cube.obj", "cube.obj", "/dev/stdin", "--json"]);
    piped("cube.obj", &["query", "/dev/stdin", "cube.obj", "p.txt", "--json"]);
    piped("cube.obj", &["bake", "/dev/stdin", "-o", "out.cbvh", "--max-memory", "200MiB"]);
    directory.cbvh("verify out.cbvh cube.obj").done();
}

/// A pipe has no end that could be known beforehand.
#[test]
fn a_pipe_keeps_to_the_budget() {
    let directory = &place();
    directory.write("long.obj", "# nothing\n".repeat(4 << 20));
    let output = Command::new(env!("CARGO_BIN_EXE_cbvh"))
        .args(["bake", "/dev/stdin", "-o", "out.cbvh", "--max-memory", "24MiB"])
        .current_dir(directory)
        .stdin(Stdio::from(cat(&directory.join("long.obj"))))
        .output()
        .unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(4), "{told}");
    assert!(told.contains("/dev/stdin: expected a mesh that bakes in at most 25165824 bytes"), "{told}");
}

/// Starts to write a file to a pipe, and returns the end to read.
fn cat(path: &Path) -> std::process::ChildStdout {
    Command::new("cat").arg(path).stdout(Stdio::piped()).spawn().unwrap().stdout.unwrap()
}

#[test]
fn buffers_outside_are_read_if_that_is_allowed() {
    let directory = &place();
    fs::create_dir(directory.join("models")).unwrap();
    let values = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    directory.write("p.bin", values.map(f32::to_le_bytes).concat());
    directory.write("models/i.bin", [0u32, 1, 2].map(u32::to_le_bytes).concat());
    symlink("../p.bin", directory.join("models/link.bin")).unwrap();
    for uri in ["../p.bin", "link.bin"] {
        directory.write("models/a.gltf", gltf(3, 3, uri, "i.bin"));
        let bake = ["bake", "models/a.gltf", "-o", "a.cbvh", "--force", "-q"];
        cbvh_in(directory, &bake)
            .failed(3, &["models/a.gltf", uri, "below the folder", "allow files outside"]);
        cbvh_in(directory, &[&bake[..], &["--allow-outside"]].concat()).done();
        let verify = ["verify", "a.cbvh", "models/a.gltf"];
        cbvh_in(directory, &verify).failed(3, &["models/a.gltf", uri]);
        cbvh_in(directory, &[&verify[..], &["--allow-outside"]].concat()).done();
    }
}
