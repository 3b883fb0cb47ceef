//! Checks which files the command opens because a text or a folder names them, and that none of them makes it wait.

use crate::common::{Files as _, Place, cbvh_in, cube, gltf, place};
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
