//! Reads glTF: nodes, buffers wherever they are, accessors of all kinds, and what is refused.

use super::{is_system, one_line, only, refusal, refused, try_bytes};
use bvh_bake::input::{MeshFormat, read};
use std::fs;

/// Returns a document with one buffer: three u8 indices, a zero, three f32 positions, one sparse index, three zeros
/// and one position. Another buffer claims as many bytes as memory can have at most.
pub(crate) fn gltf(nodes: &str, primitive: &str, uri: &str) -> String {
    let most = isize::MAX;
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
        "buffers":[{{"byteLength":56{uri}}},{{"byteLength":{most},"uri":"data:;base64,"}}]}}"#
    )
}

pub(crate) fn gltf_buffer() -> Vec<u8> {
    let mut bytes = vec![2u8, 1, 0, 0];
    [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes.extend([1, 0, 0, 0]);
    [9.0f32, 8.0, 7.0].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}

/// Returns a binary file of a document and the buffer.
pub(crate) fn glb(json: &str) -> Vec<u8> {
    crate::glb(json, &gltf_buffer())
}

pub(crate) const INDEXED: &str = r#"{"attributes":{"POSITION":1},"indices":0}"#;

#[test]
fn gltf_nodes_are_placed_in_f64() {
    let nodes = r#"{"children":[1],"translation":[10,0,0],"scale":[2,-2,2]},{"name":"n","mesh":0,"translation":[0,0,0.5]},
                   {"mesh":0,"rotation":[0,0,0.70710677,0.70710677]}"#;
    let mesh = try_bytes(&glb(&gltf(nodes, INDEXED, "")), MeshFormat::Gltf).unwrap();
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
    let directory = cbvh_testkit::folder();
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
    let long = format!(r#","uri":"dataapplication/octet-stream;base64,{}""#, "A".repeat(5000));
    let expected =
        "a name of a file of at most 4096 bytes, or a data URI, found dataapplication/octet-stream;";
    refused(gltf(r#"{"mesh":0}"#, INDEXED, &long).as_bytes(), MeshFormat::Gltf, expected);
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
        let mesh = try_bytes(&glb(&gltf(r#"{"mesh":0}"#, primitive, "")), MeshFormat::Gltf);
        match (mesh, expected) {
            (Ok(mesh), Some(position)) => assert_eq!(only(&mesh).positions[1], position, "{primitive}"),
            (Err(error), None) => drop(one_line(&error)),
            (other, _) => panic!("{primitive}: {other:?}"),
        }
    }
}

#[test]
fn gltf_that_is_no_tree_or_needs_an_extension_is_refused() {
    let with =
        |extra: &str, nodes: &str| glb(&gltf(nodes, INDEXED, "").replacen('{', &format!("{{{extra}"), 1));
    let (plain, cycle) = (r#"{"mesh":0}"#, r#"{"children":[1],"mesh":0},{"children":[0]}"#);
    for (extra, nodes, expected) in [
        ("", r#"{"children":[1]},{"mesh":0},{"children":[1]}"#, "node 1 twice"),
        ("", cycle, "at least one triangle"),
        (r#""scenes":[{"nodes":[0]}],"#, cycle, "node 0 twice"),
        (r#""extensionsRequired":["KHR_draco_mesh_compression"],"#, plain, "KHR_draco_mesh_compression"),
    ] {
        refused(&with(extra, nodes), MeshFormat::Gltf, expected);
    }
    let harmless = r#""extensionsRequired":["KHR_materials_unlit","KHR_mesh_quantization"],"#;
    assert_eq!(try_bytes(&with(harmless, plain), MeshFormat::Gltf).unwrap().triangle_count(), 1);
}

#[test]
fn gltf_that_breaks_its_schema_is_refused() {
    let plain = gltf(r#"{"mesh":0}"#, INDEXED, "");
    assert_eq!(try_bytes(&glb(&plain), MeshFormat::Gltf).unwrap().triangle_count(), 1);
    let scenes = r#"{"scenes":[{"nodes":[0]},{"nodes":[7]}],"#;
    for (from, to, expected) in [
        (r#""2.0""#, r#""1.0""#, "asset.version 2.0, found glTF of version 1.0; convert it to version 2.0"),
        (r#""2.0""#, r#""3.0""#, "asset.version 2.0, found 3.0"),
        (r#""asset":{"version":"2.0"},"#, "", "missing field `asset`"),
        (r#"{"mesh":0}"#, r#"{"mesh":1}"#, "1 in nodes[0].mesh"),
        (r#"{"mesh":0}"#, r#"{"mesh":0,"children":[4294967295]}"#, "4294967295 in nodes[0].children"),
        (r#"{"mesh":0}"#, r#"{"mesh":-1}"#, "invalid value: integer `-1`"),
        (r#"{"mesh":0}"#, r#"{"mesh":0,"scale":[1,1]}"#, "invalid length 2"),
        ("{", r#"{"scene":0,"#, "a scene below 0, found 0"),
        ("{", scenes, "7 in scenes[1].nodes"),
        (r#""POSITION":1"#, r#""POSITION":6"#, "6 in primitive 0 of meshes[0]"),
        (r#""indices":0"#, r#""indices":99"#, "99 in primitive 0 of meshes[0]"),
        (r#""indices":0"#, r#""indices":0,"mode":7"#, "mode 7, expected 0 to 6"),
        (r#"{"bufferView":0"#, r#"{"bufferView":9"#, "9 in accessors[0].bufferView"),
        // What is not read is not judged.
        (r#"{"bufferView":4}"#, r#"{"bufferView":5}"#, ""),
        ("5126", "5124", "componentType 5124"),
        ("VEC3", "VEC5", "found VEC5 of f32 in accessors[1]"),
        (r#"[{"buffer":0"#, r#"[{"buffer":2"#, "2 in bufferViews[0].buffer"),
        (r#""byteLength":36"#, r#""byteLength":36,"byteStride":0"#, ""),
        (
            r#""byteLength":36"#,
            r#""byteLength":36,"byteStride":8"#,
            "byteStride of at least 12, the bytes of a value of accessors[1], found 8",
        ),
        (
            r#""byteLength":36"#,
            r#""byteLength":36,"byteStride":256"#,
            "at most 36 bytes, which is what buffer view 1 holds",
        ),
        (r#""byteLength":36"#, r#""byteLength":36,"byteStride":18446744073709551615"#, "at most 36 bytes"),
        (
            r#""byteLength":36"#,
            r#""byteLength":36,"byteStride":-1"#,
            "invalid value: integer `-1`, expected a whole number from 0",
        ),
        (r#""byteLength":36"#, r#""byteLength":37"#, ""),
        (r#""byteLength":36"#, r#""byteLength":18446744073709551615"#, "at most 0 bytes"),
    ] {
        let broken = plain.replacen(from, to, 1);
        assert_ne!(broken, plain, "{from}");
        if expected.is_empty() {
            try_bytes(&glb(&broken), MeshFormat::Gltf).unwrap();
        } else {
            refused(&glb(&broken), MeshFormat::Gltf, expected);
        }
    }
}

#[test]
fn gltf_instances_have_a_limit() {
    // Many nodes place a mesh that draws its primitive many times.
    let nodes = vec![r#"{"mesh":0}"#; 20_000].join(",");
    let primitives = vec![INDEXED; 20_000].join(",");
    let error = try_bytes(&glb(&gltf(&nodes, &primitives, "")), MeshFormat::Gltf).unwrap_err();
    assert!(error.is_limit(), "{error}");
}
