//! Tests every reader, on small files that are written here and on a folder of malformed ones.

mod any_bytes;
mod as_found;
mod clouds;
mod collada;
mod gltf;
mod gltf_found;
mod gltf_instances;
mod gltf_model;
mod gltf_moved;
/// Windows lets few users make links, and has no pipes in folders.
#[cfg(unix)]
mod named_files;
mod tables;

use bvh_bake::input::{MeshFormat, Place, ReadError, read, read_bytes};
use bvh_bake::mesh::{Mesh, Object};
use cbvh_testkit::Random;
use gltf::{INDEXED, glb, gltf};
use std::fs;
use std::path::Path;

fn try_bytes(bytes: &[u8], format: MeshFormat) -> Result<Mesh, ReadError> {
    read_bytes(bytes, format, Path::new("test"))
}

#[track_caller]
fn obj(text: &str) -> Mesh {
    try_bytes(text.as_bytes(), MeshFormat::Obj).unwrap()
}

/// Asserts that a file is refused as invalid, by a message that contains `expected`.
#[track_caller]
fn refused(bytes: &[u8], format: MeshFormat, expected: &str) {
    let said = refusal(bytes, format);
    assert!(said.contains(expected), "{said}, not {expected}");
}

fn names(mesh: &Mesh) -> Vec<&str> {
    mesh.objects.iter().map(|object| &object.name[..]).collect()
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
    assert_eq!(names(&mesh), ["", "b", "a"]);
    assert_eq!((ids(""), ids("b"), ids("a")), (&[0][..], &[1, 2, 4][..], &[3][..]));
    assert_eq!(mesh.clone().merged().objects[0].triangle_ids, [0, 1, 2, 3, 4]);

    let mesh = obj(&format!("{CORNERS}g  left arm \nf 1 2 3\ng right\\\nf 1 3 4"));
    assert_eq!(names(&mesh), ["left arm", "right\\"]);
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
        (
            "v 0 0 0\r\rf 1 1",
            "test: expected at least one face, found none but 1 face of fewer than three corners",
        ),
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
            assert_eq!(mesh.warnings.is_empty(), bytes.len() == 184, "{:?}", mesh.warnings);
            bytes.extend(b"trailing bytes are left out");
        }
    }
    let mut infinite = TWO;
    infinite[1][2][1] = f32::INFINITY;
    for (bytes, expected) in [
        (
            binary_stl(b"", 3, &TWO),
            "byte 80: expected a count of at most 2 triangles, which is what fits the file, found 3",
        ),
        (binary_stl(b"", u32::MAX, &TWO), "at most 2 triangles"),
        (binary_stl(b"", 2, &infinite), &format!("byte {}:", 84 + 50 + 12 + 7 * 4)),
    ] {
        refused(&bytes, MeshFormat::Stl, expected);
    }
}

/// Puts a CR before each LF, as a copy in text mode does.
fn copied_as_text(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().flat_map(|&byte| if byte == b'\n' { vec![b'\r', byte] } else { vec![byte] }).collect()
}

#[test]
fn bytes_after_the_last_triangle_are_told_or_show_that_the_file_is_mangled() {
    let mut random = Random::new(8);
    let mut triangles = vec![[[0f32; 3]; 3]; 300];
    triangles.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|c| *c = random.signed() as f32);
    let bytes = binary_stl(b"by hand", 300, &triangles);
    for (rest, said) in [
        (&b"x"[..], "test: byte 15084: left out 1 more byte after the last triangle"),
        (b"\r\n", "test: byte 15084: left out 2 more bytes after the last triangle"),
        (&[0; 50], "test: byte 15084: left out 50 more bytes after the last triangle"),
    ] {
        let mesh = try_bytes(&[&bytes, rest].concat(), MeshFormat::Stl).unwrap();
        assert_eq!((mesh.warnings, mesh.objects[0].triangles.len()), (vec![said.to_owned()], 300));
    }
    let line_feeds = bytes.iter().filter(|&&byte| byte == b'\n').count();
    assert!(line_feeds > 20);
    let said = refusal(&copied_as_text(&bytes), MeshFormat::Stl);
    assert!(said.contains("mangled") && said.contains("copy it again as binary"), "{said}");
    // One LF, so that all numbers keep their sizes, or are far off.
    for at in [84 + 12, 84 + 50 * 299 + 47] {
        let mut one: Vec<u8> = bytes.iter().map(|&byte| if byte == b'\n' { 11 } else { byte }).collect();
        one[at] = b'\n';
        let said = refusal(&copied_as_text(&one), MeshFormat::Stl);
        assert!(said.contains("mangled"), "{said}");
    }
    // Bytes that were read as Latin-1 and written as UTF-8.
    let utf_8: String = bytes.iter().map(|&byte| char::from(byte)).collect();
    let said = refusal(utf_8.as_bytes(), MeshFormat::Stl);
    assert!(said.contains("mangled"), "{said}");
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
    assert_eq!(names(&mesh), ["left arm", ""]);
    assert_eq!(mesh.objects[0].triangles, [[0, 1, 2], [3, 1, 2]]);
    assert_eq!(mesh.objects[1].triangle_ids, [2]);

    for (was, is, expected) in [
        ("EndSolid", "", "expected facet or endsolid, found the end of the file"),
        ("VERTEX 1 0 0", "VERTEX 1 inf 0", "line 5: expected a finite"),
        ("endloop", "vertex 1 1 1 endloop", "expected endloop, found vertex"),
    ] {
        refused(text.replace(was, is).as_bytes(), MeshFormat::Stl, expected);
    }
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
        refused(&bytes[..bytes.len() - 3], MeshFormat::Ply, "the end of the file");
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
    for (body, expected) in [
        ("0 0 0 1 0 0 0 1 0 3 0 1 3", "line 11: expected a vertex number from 0 to 2, found 3"),
        ("0 0 0 1 0 0 0 1 0 3 0 1 -1", "line 11: expected a vertex number from 0 to 2, found -1"),
        ("0 0 0 1 0 0 0 1 0 3 0 1 1e300", "line 11: expected a vertex number from 0 to 2, found 1e300"),
        ("0 0 0 1 0 0 0 1 0 3 0 1 1e-300", "line 11: expected a vertex number from 0 to 2, found 1e-300"),
        (
            "0 0 0 1 0 0 0 1e300 0 3 0 1 2",
            "line 11: expected a finite coordinate of at most 2^120 in magnitude, found 1e300",
        ),
        ("0 0 0 1 0 0 0 1 0 3 0 1 0.5", "found 0.5"),
        ("0 0 0 1 0 0 0 1 0 3 0 1 nan", "found NaN"),
        ("0 0 0 1 0 0 0 1 0 2 0 1", "expected at least one triangle, found none"),
        ("0 0 0 1 0 0 0 1 0 2 0 x", "line 11: expected a number, found x"),
        ("0 0 0\n1 nan 0\n0 1 0\n3 0 1 2", "line 12: expected a finite coordinate"),
    ] {
        refused(format!("{header}{body}").as_bytes(), MeshFormat::Ply, expected);
    }
}

#[test]
fn the_format_is_told_by_name_or_content() {
    let directory = cbvh_testkit::folder();
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
        assert!(at(name, &glb(&gltf(r#"{"mesh":0}"#, INDEXED, ""))).is_ok());
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
