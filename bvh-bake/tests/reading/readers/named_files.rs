//! Checks which files a mesh file makes its reader open, with symbolic links and named pipes.

use super::gltf::{INDEXED, gltf, gltf_buffer};
use super::{CORNERS, is_system, one_line};
use bvh_bake::input::{ReadError, read};
use bvh_bake::mesh::Mesh;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

/// Reads a file on a thread of its own, because a reader that waits for a pipe waits for ever.
fn read_in_time(path: &Path) -> Result<Mesh, ReadError> {
    let (send, receive) = std::sync::mpsc::channel();
    let path = path.to_owned();
    std::thread::spawn(move || send.send(read(&path)));
    receive.recv_timeout(std::time::Duration::from_secs(60)).expect("the reader waits for ever")
}

#[test]
fn gltf_names_lead_to_files_below_its_folder_only() {
    let directory = cbvh_testkit::folder();
    let (outside, inside) = (directory.path().join("secret.bin"), directory.path().join("models"));
    fs::create_dir_all(inside.join("sub")).unwrap();
    fs::write(&outside, gltf_buffer()).unwrap();
    fs::write(inside.join("sub/b.bin"), gltf_buffer()).unwrap();
    symlink("../secret.bin", inside.join("link.bin")).unwrap();
    symlink("..", inside.join("up")).unwrap();
    symlink("/dev/zero", inside.join("zero.bin")).unwrap();
    symlink("sub/b.bin", inside.join("inner.bin")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(inside.join("pipe")).status().unwrap().success());
    let path = inside.join("a.gltf");
    let read_with = |uri: &str| {
        fs::write(&path, gltf(r#"{"mesh":0}"#, INDEXED, &format!(r#","uri":"{uri}""#))).unwrap();
        read_in_time(&path)
    };
    for uri in ["sub/b.bin", "sub/../sub/b.bin", "sub%2fb.bin", "inner.bin", "up/models/sub/b.bin"] {
        assert_eq!(read_with(uri).unwrap().triangle_count(), 1, "{uri}");
    }
    for uri in [
        "../secret.bin",
        "..%2fsecret.bin",
        "%2e%2e/secret.bin",
        "sub/../../secret.bin",
        "link.bin",
        "up/secret.bin",
        "zero.bin",
        outside.to_str().unwrap(),
        "/dev/zero",
        "file:///dev/zero",
        "C:/secret.bin",
        "C:secret.bin",
        "sub/b.bin%00",
    ] {
        let error = read_with(uri).unwrap_err();
        assert!(!is_system(&error) && one_line(&error).contains("expected a "), "{uri}: {error}");
    }
    for uri in ["pipe", "sub", "..%5csecret.bin"] {
        let error = read_with(uri).unwrap_err();
        assert!(is_system(&error), "{uri}: {error}");
    }
}

/// Textures, and the materials of OBJ files, are none of a reader's business.
#[test]
fn what_no_triangle_needs_is_not_opened() {
    let directory = cbvh_testkit::folder();
    let pipe = directory.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let path = directory.path().join("a.obj");
    fs::write(&path, format!("mtllib pipe\n{CORNERS}usemtl a\nmap_Kd pipe\nf 1 2 3\n")).unwrap();
    assert_eq!(read_in_time(&path).unwrap().triangle_count(), 1);
    fs::write(directory.path().join("b.bin"), gltf_buffer()).unwrap();
    let path = directory.path().join("a.gltf");
    let document = gltf(r#"{"mesh":0}"#, INDEXED, r#","uri":"b.bin""#);
    // A third buffer, which no accessor of a triangle uses, and a texture.
    let document =
        document.replace(r#""data:;base64,"}"#, r#""data:;base64,"},{"byteLength":9,"uri":"pipe"}"#);
    let document = document.replacen('{', r#"{"images":[{"uri":"pipe"}],"textures":[{"source":0}],"#, 1);
    fs::write(&path, document).unwrap();
    assert_eq!(read_in_time(&path).unwrap().triangle_count(), 1);
}
