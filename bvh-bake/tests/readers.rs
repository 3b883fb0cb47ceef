//! Tests every reader, on small files that are written here and on a folder of malformed ones.

use bvh_bake::input::{MeshFormat, Place, ReadError, read, read_bytes};
use bvh_bake::mesh::{Mesh, Object};
use cbvh_testkit::depth::rounds;
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

fn try_bytes(bytes: &[u8], format: MeshFormat) -> Result<Mesh, ReadError> {
    read_bytes(bytes, format, Path::new("test"))
}

#[track_caller]
fn obj(text: &str) -> Mesh {
    try_bytes(text.as_bytes(), MeshFormat::Obj).unwrap()
}

/// Returns the error message of a file that must be refused as invalid.
#[track_caller]
fn refusal(bytes: &[u8], format: MeshFormat) -> String {
    let error = try_bytes(bytes, format).unwrap_err();
    assert!(!is_system(&error) && !error.is_limit(), "{error}");
    one_line(&error)
}

fn is_system(error: &ReadError) -> bool {
    matches!(error, ReadError::Io { .. })
}

#[track_caller]
fn one_line(error: &ReadError) -> String {
    let said = error.to_string();
    assert!(!said.chars().any(char::is_control), "{said:?}");
    assert!(said.len() < 400, "{said}");
    said
}

fn only(mesh: &Mesh) -> &Object {
    assert_eq!(mesh.objects.len(), 1);
    &mesh.objects[0]
}

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn obj_numbers_are_the_nearest_f64() {
    let numbers = ["0.1", "1e-7", "5.", "+.5", "123456789.123456789", "1.7976931348623157e30", "4.9e-324"];
    for number in numbers {
        let mesh = obj(&format!("v {number} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3"));
        assert_eq!(only(&mesh).positions[0][0], number.parse::<f64>().unwrap(), "{number}");
    }
    let mesh = obj("v -0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3");
    assert_eq!(only(&mesh).positions[0][0].to_bits(), 0, "-0.0 is read as 0.0");
}

#[test]
fn obj_objects_are_named_and_ids_follow_the_file() {
    let faces = "f 1 2 3\no b\nf 1 2 3 4\ng c\no a\nf 2 3 4\no b\nf -1 -2 -3\n";
    let mesh = obj(&format!("{CORNERS}{faces}"));
    let ids = |name: &str| &mesh.objects.iter().find(|object| object.name == name).unwrap().triangle_ids[..];
    assert_eq!(mesh.objects.iter().map(|object| &object.name[..]).collect::<Vec<_>>(), ["", "b", "a"]);
    assert_eq!((ids(""), ids("b"), ids("a")), (&[0][..], &[1, 2, 4][..], &[3][..]));
    assert_eq!(mesh.clone().merged().objects[0].triangle_ids, [0, 1, 2, 3, 4]);

    let mesh = obj(&format!("{CORNERS}g  left arm \nf 1 2 3\ng right\\\nf 1 3 4"));
    assert_eq!(
        mesh.objects.iter().map(|object| &object.name[..]).collect::<Vec<_>>(),
        ["left arm", "right\\"]
    );
}

#[test]
fn obj_faces_may_come_before_vertices_of_any_object() {
    let mesh = obj("o a\nf 1 2 3\no b\nf 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0");
    assert_eq!(mesh.objects.len(), 2);
    assert_eq!(mesh.triangle_count(), 2);
}

#[test]
fn obj_fourth_numbers_and_colours_are_ignored() {
    let mesh = obj("v 2 0 0 2\nv 1 0 0 nan nan nan\nv 0 1 0 0\nf 1 2 3 # a comment");
    assert_eq!(only(&mesh).positions, [[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
}

#[test]
fn obj_errors_name_the_line() {
    for (text, expected) in [
        ("v 0 0 0\nv 0 0\n", "test: line 2: expected three numbers after v, found 2"),
        ("v 0 0\\\n 0\n\nv 0 x 0\n", "test: line 4: expected three numbers after v, found x"),
        ("v 0 0 0\r\rf 1 1", "test: line 3: expected a face of at least three vertices, found 2"),
        ("v 0 0 0\nf 1 0 1", "test: line 2: expected a vertex number from 1 to 1, found 0"),
        ("v 0 0 0\nf 1 1/x 1", "test: line 2: expected vertex numbers such as 7, 7/1 or 7//1, found 1/x"),
        (
            "v 1e37 0 0\nf 1 1 1",
            "test: line 1: expected a finite coordinate of at most 2^120 in magnitude, found v 1e37 0 0",
        ),
    ] {
        assert_eq!(refusal(text.as_bytes(), MeshFormat::Obj), expected);
    }
}

fn binary_stl(header: &[u8], count: u32, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(count.to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        triangle.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const TWO: [[[f32; 3]; 3]; 2] =
    [[[0.0, -0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0], [0.0; 3], [0.5, 0.5, 7.0]]];

#[test]
fn binary_stl_joins_equal_vertices_in_order() {
    for header in ["solid", "", "\n"] {
        let mut bytes = binary_stl(header.as_bytes(), 2, &TWO);
        for _ in 0..2 {
            let mesh = try_bytes(&bytes, MeshFormat::Stl).unwrap();
            assert_eq!(only(&mesh).triangles, [[0, 1, 2], [1, 0, 3]]);
            assert_eq!(only(&mesh).positions[3], [0.5, 0.5, 7.0]);
            bytes.extend(b"trailing bytes are ignored");
        }
    }
    let said = refusal(&binary_stl(b"", 3, &TWO), MeshFormat::Stl);
    assert!(said.contains("byte 80:") && said.ends_with("found 3"), "{said}");
    let said = refusal(&binary_stl(b"", u32::MAX, &TWO), MeshFormat::Stl);
    assert!(said.contains("at most 2 triangles"), "{said}");
    let mut infinite = TWO;
    infinite[1][2][1] = f32::INFINITY;
    let said = refusal(&binary_stl(b"", 2, &infinite), MeshFormat::Stl);
    assert!(said.contains(&format!("byte {}:", 84 + 50 + 12 + 7 * 4)), "{said}");
}

#[test]
fn ascii_stl_has_many_solids_and_any_case() {
    let facet = |x: f64| {
        format!(
            "FACET Normal 0 nan 1\n Outer LOOP\nvertex {x} 0 0\nVERTEX 1 0 0\r\nvertex 0 1 0\nendloop endfacet\n"
        )
    };
    let text =
        format!("Solid left arm \n{}{}endsolid x\n\nsolid\n{}EndSolid", facet(0.0), facet(2.0), facet(3.0));
    let mesh = try_bytes(text.as_bytes(), MeshFormat::Stl).unwrap();
    assert_eq!(mesh.objects.iter().map(|object| &object.name[..]).collect::<Vec<_>>(), ["left arm", ""]);
    assert_eq!(mesh.objects[0].triangles, [[0, 1, 2], [3, 1, 2]]);
    assert_eq!(mesh.objects[1].triangle_ids, [2]);

    let cut_off = &text[..text.len() - "EndSolid".len()];
    assert!(
        refusal(cut_off.as_bytes(), MeshFormat::Stl)
            .contains("expected facet or endsolid, found the end of the file")
    );
    let wrong = text.replace("VERTEX 1 0 0", "VERTEX 1 inf 0");
    assert!(refusal(wrong.as_bytes(), MeshFormat::Stl).contains("line 5: expected a finite"));
    let wrong = text.replace("endloop", "vertex 1 1 1 endloop");
    assert!(refusal(wrong.as_bytes(), MeshFormat::Stl).contains("expected endloop, found vertex"));
}

/// Returns a square and a triangle, with properties before, between and after those that matter.
fn ply(format: &str) -> Vec<u8> {
    let header = format!(
        "ply\r\nformat {format} 1.0\r\ncomment made by hand\r\nelement extra 2\r\nproperty list uint8 int16 what\r\n\
         element vertex 4\r\nproperty uchar red\r\nproperty double z\r\nproperty float x\r\nproperty short y\r\n\
         element face 2\r\nproperty list uchar float weights\r\nproperty list ushort uint vertex_index\r\n\
         property float quality\r\nend_header\r\n"
    );
    let mut bytes = header.into_bytes();
    let (text, big) = (format == "ascii", format == "binary_big_endian");
    let mut put = |value: f64, binary: &[u8]| match (text, big) {
        (true, _) => bytes.extend(format!("{value} ").bytes()),
        (_, true) => bytes.extend(binary.iter().rev()),
        _ => bytes.extend(binary),
    };
    for list in [&[10i16, 20][..], &[]] {
        put(list.len() as f64, &[list.len() as u8]);
        list.iter().for_each(|&value| put(value.into(), &value.to_le_bytes()));
    }
    for (x, y) in [(0i16, 0i16), (1, 0), (1, 1), (0, 1)] {
        put(10.0, b"\n");
        put(-2.5, &(-2.5f64).to_le_bytes());
        put(x.into(), &f32::from(x).to_le_bytes());
        put(y.into(), &y.to_le_bytes());
    }
    for face in [&[0u32, 1, 2, 3][..], &[3, 2, 1]] {
        put(1.0, &[1]);
        put(0.5, &0.5f32.to_le_bytes());
        put(face.len() as f64, &(face.len() as u16).to_le_bytes());
        face.iter().for_each(|&corner| put(corner.into(), &corner.to_le_bytes()));
        put(1.0, &1.0f32.to_le_bytes());
    }
    bytes
}

#[test]
fn ply_is_read_in_every_format() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let bytes = ply(format);
        let mesh = try_bytes(&bytes, MeshFormat::Ply).unwrap();
        assert_eq!(
            only(&mesh).positions,
            [[0.0, 0.0, -2.5], [1.0, 0.0, -2.5], [1.0, 1.0, -2.5], [0.0, 1.0, -2.5]]
        );
        assert_eq!(only(&mesh).triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]], "{format}");
        let cut_off = &bytes[..bytes.len() - 3];
        assert!(refusal(cut_off, MeshFormat::Ply).contains("the end of the file"), "{format}");
    }
}

#[test]
fn ply_counts_are_checked_before_anything_is_read() {
    for count in ["1000", "4294967296", "18446744073709551615"] {
        for format in ["ascii", "binary_little_endian"] {
            let text = String::from_utf8_lossy(&ply(format)).replace("vertex 4", &format!("vertex {count}"));
            let said = refusal(text.as_bytes(), MeshFormat::Ply);
            assert!(said.contains("which is what fits the file") && said.ends_with(count), "{said}");
        }
    }
    let header = "ply\nformat ascii 1.0\nelement nothing 18446744073709551615\nelement vertex 3\nproperty float x\n\
                  property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let whole = format!("{header}0 0 0 1 0 0 0 1 0 3 0 1 2");
    assert_eq!(try_bytes(whole.as_bytes(), MeshFormat::Ply).unwrap().triangle_count(), 1);
    for (face, expected) in [
        ("3 0 1 3", "line 11: expected a vertex number from 0 to 2, found 3"),
        ("3 0 1 0.5", "found 0.5"),
        ("3 0 1 nan", "found NaN"),
        ("2 0 1", "expected a face of at least three vertices, found 2"),
    ] {
        let said = refusal(format!("{header}0 0 0 1 0 0 0 1 0 {face}").as_bytes(), MeshFormat::Ply);
        assert!(said.contains(expected), "{said}");
    }
    let said = refusal(format!("{header}0 0 0\n1 nan 0\n0 1 0\n3 0 1 2").as_bytes(), MeshFormat::Ply);
    assert!(said.contains("line 12: expected a finite coordinate"), "{said}");
}

/// Returns a document with one buffer: three u8 indices, a zero, three f32 positions, one sparse index, three zeros
/// and one position.
fn gltf(nodes: &str, primitive: &str, uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"name":"m","primitives":[{primitive}]}}],
        "accessors":[
            {{"bufferView":0,"componentType":5121,"count":3,"type":"SCALAR"}},
            {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"}},
            {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3","sparse":{{"count":1,
                "indices":{{"bufferView":2,"componentType":5121}},"values":{{"bufferView":3}}}}}},
            {{"bufferView":1,"componentType":5126,"count":4000000000,"type":"VEC3"}},
            {{"componentType":5126,"count":4000000000,"type":"VEC3","sparse":{{"count":1,
                "indices":{{"bufferView":2,"componentType":5121}},"values":{{"bufferView":4}}}}}},
            {{"componentType":5126,"count":3,"type":"VEC3","sparse":{{"count":1,
                "indices":{{"bufferView":2,"componentType":5121}},"values":{{"bufferView":3}}}}}}],
        "bufferViews":[{{"buffer":0,"byteLength":3}},{{"buffer":0,"byteOffset":4,"byteLength":36}},
            {{"buffer":0,"byteOffset":40,"byteLength":1}},{{"buffer":0,"byteOffset":44,"byteLength":12}},
            {{"buffer":1,"byteLength":12}}],
        "buffers":[{{"byteLength":56{uri}}},{{"byteLength":9000000000000000000,"uri":"data:;base64,"}}]}}"#
    )
}

fn gltf_buffer() -> Vec<u8> {
    let mut bytes = vec![2u8, 1, 0, 0];
    [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes.extend([1, 0, 0, 0]);
    [9.0f32, 8.0, 7.0].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}

fn glb(json: &str, blob: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((12 + 8 + json.len() as u32 + 8 + blob.len() as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(&json);
    bytes.extend((blob.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(blob);
    bytes
}

const INDEXED: &str = r#"{"attributes":{"POSITION":1},"indices":0}"#;

#[test]
fn gltf_nodes_are_placed_in_f64() {
    let nodes = r#"{"children":[1],"translation":[10,0,0],"scale":[2,-2,2]},{"name":"n","mesh":0,"translation":[0,0,0.5]},
                   {"mesh":0,"rotation":[0,0,0.70710677,0.70710677]}"#;
    let mesh = try_bytes(&glb(&gltf(nodes, INDEXED, ""), &gltf_buffer()), MeshFormat::Gltf).unwrap();
    assert_eq!(mesh.objects.len(), 2);
    assert_eq!((&mesh.objects[0].name[..], &mesh.objects[1].name[..]), ("n", "m"));
    assert_eq!(mesh.objects[0].positions, [[10.0, 0.0, 1.0], [12.0, 0.0, 1.0], [10.0, -2.0, 1.0]]);
    assert_eq!(mesh.objects[0].triangles, [[2, 0, 1]], "mirrored, so turned");
    assert_eq!(mesh.objects[1].triangles, [[2, 1, 0]]);
    let [x, y, _] = mesh.objects[1].positions[1];
    assert!(x.abs() < 1e-15 && (y - 1.0).abs() < 1e-15, "a quarter turn, normalised: {x} {y}");
}

#[test]
fn gltf_buffers_are_found_wherever_they_are() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("my buffer.bin"), gltf_buffer()).unwrap();
    let path = directory.path().join("a.gltf");
    fs::write(&path, gltf(r#"{"mesh":0}"#, INDEXED, r#","uri":"my%20buffer.bin""#)).unwrap();
    assert_eq!(read(&path).unwrap().triangle_count(), 1);

    fs::write(&path, gltf(r#"{"mesh":0}"#, INDEXED, r#","uri":"missing.bin""#)).unwrap();
    let error = read(&path).unwrap_err();
    assert!(is_system(&error) && one_line(&error).contains("missing.bin"), "{error}");

    let uri = r#","uri":"data:application/octet-stream;base64,AgEAAAAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAEAAAAAABBBAAAAQQAA4EA=""#;
    let mesh = try_bytes(gltf(r#"{"mesh":0}"#, INDEXED, uri).as_bytes(), MeshFormat::Gltf).unwrap();
    assert_eq!(only(&mesh).positions[2], [0.0, 1.0, 0.0]);
    for uri in [r#","uri":"/etc/passwd""#, r#","uri":"http://x/y""#, r#","uri":"data:,x""#, ""] {
        refusal(gltf(r#"{"mesh":0}"#, INDEXED, uri).as_bytes(), MeshFormat::Gltf);
    }
}

/// Reads a file on a thread of its own, because a reader that waits for a pipe waits for ever.
#[cfg(unix)]
fn read_in_time(path: &Path) -> Result<Mesh, ReadError> {
    let (send, receive) = std::sync::mpsc::channel();
    let path = path.to_owned();
    std::thread::spawn(move || send.send(read(&path)));
    receive.recv_timeout(std::time::Duration::from_secs(60)).expect("the reader waits for ever")
}

#[cfg(unix)]
#[test]
fn gltf_names_lead_to_files_below_its_folder_only() {
    use std::os::unix::fs::symlink;
    let directory = tempfile::tempdir().unwrap();
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
#[cfg(unix)]
#[test]
fn what_no_triangle_needs_is_not_opened() {
    let directory = tempfile::tempdir().unwrap();
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

#[test]
fn gltf_reads_sparse_accessors_strips_and_no_indices() {
    for (primitive, expected) in [
        (r#"{"attributes":{"POSITION":2},"indices":0}"#, Some([9.0, 8.0, 7.0])),
        (r#"{"attributes":{"POSITION":1},"mode":5}"#, Some([1.0, 0.0, 0.0])),
        (r#"{"attributes":{"POSITION":1},"mode":6}"#, Some([1.0, 0.0, 0.0])),
        (r#"{"attributes":{"POSITION":1},"mode":0}"#, None),
        (r#"{"attributes":{"POSITION":3}}"#, None),
        (r#"{"attributes":{"POSITION":4}}"#, None),
        (r#"{"attributes":{"POSITION":5}}"#, Some([9.0, 8.0, 7.0])),
        (r#"{"attributes":{"POSITION":77}}"#, None),
        (r#"{"attributes":{"POSITION":0}}"#, None),
        (r#"{"attributes":{"POSITION":1},"indices":1}"#, None),
        (r#"{"attributes":{}}"#, None),
    ] {
        let mesh = try_bytes(&glb(&gltf(r#"{"mesh":0}"#, primitive, ""), &gltf_buffer()), MeshFormat::Gltf);
        match (mesh, expected) {
            (Ok(mesh), Some(position)) => assert_eq!(only(&mesh).positions[1], position, "{primitive}"),
            (Err(error), None) => drop(one_line(&error)),
            (other, _) => panic!("{primitive}: {other:?}"),
        }
    }
}

#[test]
fn gltf_that_is_no_tree_or_needs_an_extension_is_refused() {
    let refused = |nodes: &str| refusal(&glb(&gltf(nodes, INDEXED, ""), &gltf_buffer()), MeshFormat::Gltf);
    assert!(refused(r#"{"children":[1]},{"mesh":0},{"children":[1]}"#).contains("node 1 twice"));
    assert!(refused(r#"{"children":[1],"mesh":0},{"children":[0]}"#).contains("at least one triangle"));
    let scenes =
        |json: String, extra: &str| glb(&json.replacen('{', &format!("{{{extra},"), 1), &gltf_buffer());
    let cycle = gltf(r#"{"children":[1],"mesh":0},{"children":[0]}"#, INDEXED, "");
    assert!(
        refusal(&scenes(cycle, r#""scenes":[{"nodes":[0]}]"#), MeshFormat::Gltf).contains("node 0 twice")
    );
    let plain = || gltf(r#"{"mesh":0}"#, INDEXED, "");
    let draco = scenes(plain(), r#""extensionsRequired":["KHR_draco_mesh_compression"]"#);
    assert!(refusal(&draco, MeshFormat::Gltf).contains("KHR_draco_mesh_compression"));
    let harmless = scenes(plain(), r#""extensionsRequired":["KHR_materials_unlit","KHR_mesh_quantization"]"#);
    assert_eq!(try_bytes(&harmless, MeshFormat::Gltf).unwrap().triangle_count(), 1);
}

#[test]
fn gltf_instances_have_a_limit() {
    // Many nodes place a mesh that draws its primitive many times.
    let nodes = vec![r#"{"mesh":0}"#; 20_000].join(",");
    let primitives = vec![INDEXED; 20_000].join(",");
    let error =
        try_bytes(&glb(&gltf(&nodes, &primitives, ""), &gltf_buffer()), MeshFormat::Gltf).unwrap_err();
    assert!(error.is_limit(), "{error}");
}

#[test]
fn the_format_is_told_by_name_or_content() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str, bytes: &[u8]| {
        let path = directory.path().join(name);
        fs::write(&path, bytes).unwrap();
        read(&path)
    };
    let text = format!("# by hand\n{CORNERS}f 1 2 3");
    assert!(at("A.OBJ", text.as_bytes()).is_ok());
    for name in ["plain", "a.mesh"] {
        assert!(at(name, text.as_bytes()).is_ok());
        assert!(at(name, &binary_stl(b"", 2, &TWO)).is_ok());
        assert!(at(name, &ply("binary_big_endian")).is_ok());
        assert!(at(name, &glb(&gltf(r#"{"mesh":0}"#, INDEXED, ""), &gltf_buffer())).is_ok());
    }
    let error = at("a.off", b"OFF\n3 1 0\n").unwrap_err();
    assert!(one_line(&error).ends_with("found an unsupported format, .off"), "{error}");
    assert!(at("a.stl", text.as_bytes()).is_err());
    let error = read(&directory.path().join("none.obj")).unwrap_err();
    assert!(is_system(&error), "{error}");
    assert!(is_system(&read(directory.path()).unwrap_err()));
    let error = at("b.obj", b"v 0 0").unwrap_err();
    assert!(matches!(error, ReadError::Invalid { place: Place::Line(1), .. }));
}

/// A strip that is folded to and fro, turned by 45 degrees, so that all its edges are near each other along both axes.
fn folded(corners: usize) -> String {
    let mut text = String::new();
    for i in 0..corners {
        let (step, lift) = if i < corners / 2 { (i, 0) } else { (corners - 1 - i, 1) };
        let (x, y) = (step, lift + if step % 2 == 0 { 0 } else { 1_000_000 });
        text += &format!("v {} {} 0\n", x as i64 - y, x as i64 + y);
    }
    let face: Vec<String> = (1..=corners).map(|corner| corner.to_string()).collect();
    text + "f " + &face.join(" ") + "\n"
}

#[test]
fn faces_that_take_too_long_to_cut_are_refused() {
    for corners in [1000, 60_000] {
        let error = try_bytes(folded(corners).as_bytes(), MeshFormat::Obj);
        if corners == 1000 {
            assert_eq!(error.unwrap().triangle_count(), 998);
            continue;
        }
        let error = error.unwrap_err();
        assert!(error.is_limit() && one_line(&error).contains("cut it into smaller faces"), "{error}");
    }
}

#[test]
fn ply_headers_have_a_limit() {
    let declared = "element nothing 0\nproperty char x\n".repeat(20_000);
    let text = String::from_utf8(ply("ascii")).unwrap().replacen(
        "element extra",
        &format!("{declared}element extra"),
        1,
    );
    let error = try_bytes(text.as_bytes(), MeshFormat::Ply).unwrap_err();
    assert!(error.is_limit(), "{error}");
}

/// For each file, the number of triangles if it can be read, or else a part of the error message.
const HARD: &[(&str, Result<u64, &str>)] = &[
    ("assimp__3DSMaxExport.STL", Ok(2000)),
    ("assimp__Spider_ascii.stl", Ok(1368)),
    ("assimp__OutOfMemory.off", Err("an unsupported format, .off")),
    ("assimp__box_longline.obj", Ok(944)),
    ("assimp__concave_polygon.obj", Ok(64)),
    ("assimp__cube_binary_header_with_RN_newline.ply", Ok(12)),
    ("assimp__cube_binary_starts_with_nl.ply", Ok(12)),
    ("assimp__cube_uv.ply", Ok(12)),
    ("assimp__crash-30d6d0f7c529b3b66b4131700b7a4580cd7082df.ply", Err("line 7: expected property")),
    ("assimp__empty.obj", Err("expected at least one face, found none")),
    ("assimp__issue623.ply", Err("line 13: expected an element vertex")),
    ("assimp__malformed.obj", Err("line 23: expected a vertex number from 1 to 8, found 12")),
    ("assimp__number_formats.obj", Err("line 11: expected three numbers after v, found 3.1+e2")),
    ("assimp__testline.obj", Err("expected at least one face, found none")),
    ("assimp__testmixed.obj", Ok(12)),
    ("assimp__triangle_with_two_solids.stl", Ok(2)),
    ("syn_ascii.stl", Ok(1)),
    ("syn_ascii_trunc.stl", Err("line 5: expected a number, found the end of the file")),
    ("syn_be.ply", Ok(1)),
    ("syn_bin_count_high.stl", Err("byte 80: expected a count of at most 2 triangles")),
    ("syn_bin_nan.stl", Err("byte 196: expected a finite coordinate")),
    ("syn_bin_solid_header.stl", Ok(2)),
    ("syn_bin_trunc.stl", Err("byte 80: ")),
    ("syn_bom.obj", Ok(1)),
    ("syn_comma.obj", Err("line 1: expected three numbers after v, found 0,5")),
    ("syn_continuation.obj", Ok(1)),
    ("syn_cr.obj", Ok(1)),
    ("syn_hexfloat.obj", Err("line 1: expected three numbers after v, found 0x1p0")),
    ("syn_huge_coords.obj", Err("line 1: expected a finite coordinate")),
    ("syn_index_big.obj", Err("line 4: expected a vertex number from 1 to 3, found 4")),
    ("syn_index_forward.obj", Ok(1)),
    (
        "syn_index_neg_big.obj",
        Err("line 4: expected a number that counts back over at most 3 vertices, found -4"),
    ),
    ("syn_long_name.obj", Ok(1)),
    ("syn_nan.obj", Err("line 4: expected a finite coordinate")),
    ("syn_nan_unused.obj", Ok(1)),
    ("syn_neg_ok.obj", Ok(2)),
    ("syn_negidx.ply", Err("byte 214: expected a vertex number from 0 to 2, found -1")),
    ("syn_ngon255.ply", Ok(85)),
    ("syn_nofaces.obj", Err("expected at least one face, found none")),
    ("syn_nonl.obj", Ok(1)),
    ("syn_nul.obj", Ok(1)),
    ("syn_overflow.obj", Err("line 4: expected a finite coordinate")),
    ("syn_quads.obj", Ok(2048)),
    ("syn_same_tri_100k.obj", Ok(100_000)),
    ("syn_short.stl", Err("line 1: expected facet or endsolid, found the end of the file")),
    ("syn_slashes.obj", Ok(5)),
    ("syn_trunc.ply", Err("byte 206: expected a number, found the end of the file")),
    ("syn_v2.obj", Err("line 1: expected three numbers after v, found 2")),
    ("syn_zero_area_line.obj", Ok(2)),
    ("tinyobjloader__invalid-relative-vertex-index.obj", Err("line 1: ")),
    (
        "tinyobjloader__issue-140-zero-face-idx.obj",
        Err("line 16: expected a vertex number from 1 to 4, found 0/0/0"),
    ),
    ("tinyobjloader__issue-161-inconsistent-f.obj", Ok(12)),
    ("tinyobjloader__test-nan.obj", Err("line 14: ")),
    ("tobj__invalid_index.obj", Err("line 12: expected a vertex number from 1 to 6, found 7")),
    ("trimesh__empty.ply", Err("expected at least one triangle, found none")),
    ("trimesh__multibody.stl", Ok(32)),
    ("trimesh__nancolor.obj", Ok(12)),
    ("trimesh__negative_indices.obj", Ok(12)),
    ("trimesh__polygonfaces.obj", Ok(3)),
    ("trimesh__stl_empty_bin.stl", Err("expected at least one triangle, found none")),
    ("trimesh__two_objects_mixed_case_names.stl", Ok(24)),
];

#[test]
fn hard_files_are_read_or_refused_as_expected() {
    let Some(files) = hard_files() else { return };
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let result = read(&path);
        let expected = HARD.iter().find(|(file, _)| *file == name).map(|(_, expected)| *expected);
        match (&result, expected) {
            (Ok(mesh), Some(Ok(triangles))) => assert_eq!(mesh.triangle_count(), triangles, "{name}"),
            (Err(error), Some(Err(part))) => assert!(error.to_string().contains(part), "{name}: {error}"),
            (_, Some(_)) => panic!("{name}: {:?}", result.map(|mesh| mesh.triangle_count())),
            (_, None) => {}
        }
        match result {
            Ok(mesh) => assert_eq!(mesh.check(), Ok(()), "{name}"),
            Err(error) => drop(one_line(&error)),
        }
    }
}

#[allow(clippy::print_stderr, reason = "a test that was skipped should say so")]
fn hard_files() -> Option<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/hard");
    match fs::read_dir(&folder) {
        Ok(entries) => Some(entries.map(|entry| entry.unwrap().path()).collect()),
        Err(_) => {
            eprintln!("skipped: there is no {}", folder.display());
            None
        }
    }
}

fn seeds() -> Vec<(MeshFormat, Vec<u8>)> {
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let sparse = r#"{"attributes":{"POSITION":2},"indices":0}"#;
    vec![
        (
            MeshFormat::Obj,
            format!("o a\n{CORNERS}f 1/1 2// 3 -1\n\\\nv 0 0 \\\n 1e3\ng b\nf 1 2 3 4 5\n").into_bytes(),
        ),
        (MeshFormat::Stl, text.into()),
        (MeshFormat::Stl, binary_stl(b"solid", 2, &TWO)),
        (MeshFormat::Ply, ply("ascii")),
        (MeshFormat::Ply, ply("binary_little_endian")),
        (MeshFormat::Ply, ply("binary_big_endian")),
        (MeshFormat::Gltf, glb(&gltf(r#"{"children":[1]},{"mesh":0}"#, sparse, ""), &gltf_buffer())),
        (MeshFormat::Gltf, gltf(r#"{"mesh":0}"#, INDEXED, r#","uri":"data:;base64,AgEAAAAA""#).into_bytes()),
    ]
}

const FORMATS: [MeshFormat; 4] = [MeshFormat::Obj, MeshFormat::Stl, MeshFormat::Ply, MeshFormat::Gltf];

/// Asserts what must hold for any bytes.
fn survives(bytes: &[u8], format: MeshFormat) {
    MeshFormat::from_content(bytes);
    match try_bytes(bytes, format) {
        Ok(mesh) => assert_eq!(mesh.check(), Ok(())),
        Err(error) => drop(one_line(&error)),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: rounds(200) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        FORMATS.iter().for_each(|&format| survives(&bytes, format));
    }

    #[test]
    fn statements_at_random_never_panic(text in "([vfog] |[-0-9./ ]{1,9}|nan|1e999|[\\\\\n\r#]){0,60}") {
        survives(text.as_bytes(), MeshFormat::Obj);
    }

    #[test]
    fn mutated_files_never_panic(
        seed in 0usize..8,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..4), 1..6),
    ) {
        let (format, mut bytes) = seeds().swap_remove(seed);
        for (at, value, kind) in edits {
            if bytes.is_empty() {
                break;
            }
            let place = at.index(bytes.len());
            match kind {
                0 => bytes[place] = value,
                1 => bytes[place] ^= 1 << (value % 8),
                2 => drop(bytes.remove(place)),
                _ => bytes.truncate(place),
            }
        }
        survives(&bytes, format);
    }

    #[test]
    fn digits_changed_in_a_document_never_panic(
        seed in 6usize..8,
        edits in prop::collection::vec((any::<prop::sample::Index>(), b'0'..=b'9'), 1..5),
    ) {
        let (format, mut bytes) = seeds().swap_remove(seed);
        let digits: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at].is_ascii_digit()).collect();
        for (at, digit) in edits {
            bytes[digits[at.index(digits.len())]] = digit;
        }
        survives(&bytes, format);
    }
}
