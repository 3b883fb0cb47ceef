//! One mesh in every input format bakes to the same content, in every profile and with every encoding.
//!
//! Text holds each coordinate to the last digit of f64: fewer would be another number.

use bvh_bake::input::{MeshFormat, read_bytes};
use bvh_bake::{Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use std::fmt::Write;
use std::path::Path;

type Triangle = [[f32; 3]; 3];

/// A bumpy sheet with a duplicate, a triangle without area and coordinates that f32 holds exactly.
fn sheet() -> Vec<Triangle> {
    let at = |i: u32, j: u32| {
        let height = ((i * 37 + j * 91) % 23) as f32 * 0.03125;
        [i as f32 * 0.1 - 1.0, j as f32 * 0.3, height]
    };
    let squares = (0..20).flat_map(|i| (0..15).map(move |j| (i, j)));
    let mut triangles: Vec<Triangle> = squares
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
            [[a, b, c], [c, b, d]]
        })
        .collect();
    triangles.push(triangles[17]);
    triangles.push([at(3, 3); 3]);
    triangles
}

fn obj(triangles: &[Triangle]) -> Vec<u8> {
    let mut text = String::new();
    for [x, y, z] in triangles.as_flattened().iter().map(|p| p.map(f64::from)) {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for first in (1..=3 * triangles.len()).step_by(3) {
        writeln!(text, "f {first} {} {}", first + 1, first + 2).unwrap();
    }
    text.into_bytes()
}

fn stl_text(triangles: &[Triangle]) -> Vec<u8> {
    let mut text = String::from("solid\n");
    for triangle in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in triangle.map(|p| p.map(f64::from)) {
            writeln!(text, "vertex {x} {y} {z}").unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

fn stl_binary(triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        triangle.as_flattened().iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ply(triangles: &[Triangle], format: &str) -> Vec<u8> {
    let corners = 3 * triangles.len();
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex {corners}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        triangles.len()
    );
    let mut bytes = header.into_bytes();
    let mut put = |text: String, binary: &[u8]| match format {
        "ascii" => bytes.extend(format!("{text}\n").bytes()),
        "binary_big_endian" => bytes.extend(binary.iter().rev()),
        _ => bytes.extend(binary),
    };
    triangles
        .as_flattened()
        .as_flattened()
        .iter()
        .for_each(|c| put(f64::from(*c).to_string(), &c.to_le_bytes()));
    for first in (0..corners as u32).step_by(3) {
        put("3".into(), &[3]);
        (first..first + 3).for_each(|index| put(index.to_string(), &index.to_le_bytes()));
    }
    bytes
}

fn glb(triangles: &[Triangle]) -> Vec<u8> {
    let mut blob = Vec::new();
    triangles.as_flattened().as_flattened().iter().for_each(|c| blob.extend(c.to_le_bytes()));
    let (length, count) = (blob.len(), 3 * triangles.len());
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"buffers":[{{"byteLength":{length}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],"accessors":[{{"bufferView":0,"componentType":5126,
        "count":{count},"type":"VEC3","min":[-9,-9,-9],"max":[9,9,9]}}]}}"#
    );
    crate::glb(&json, &blob)
}

/// The mesh in units of half a metre, and with y pointing up.
fn dae(triangles: &[Triangle]) -> Vec<u8> {
    let mut numbers = String::new();
    for [x, y, z] in triangles.as_flattened().iter().map(|p| p.map(|c| 2.0 * f64::from(c))) {
        write!(numbers, "{x} {z} {} ", -y).unwrap();
    }
    let corners: Vec<String> = (0..3 * triangles.len()).map(|corner| corner.to_string()).collect();
    let (count, values, corners) = (triangles.len(), 9 * triangles.len(), corners.join(" "));
    format!(
        "<COLLADA><asset><unit meter=\"0.5\"/></asset><library_geometries><geometry><mesh><source id=\"s\"><float_array id=\"a\" \
         count=\"{values}\">{numbers}</float_array><technique_common><accessor source=\"#a\" stride=\"3\"/></technique_common></source>\
         <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices><triangles count=\"{count}\"><input \
         semantic=\"VERTEX\" source=\"#v\"/><p>{corners}</p></triangles></mesh></geometry></library_geometries></COLLADA>"
    )
    .into_bytes()
}

#[test]
fn every_format_gives_the_same_content() {
    let triangles = sheet();
    let files = [
        ("obj", MeshFormat::Obj, obj(&triangles)),
        ("text stl", MeshFormat::Stl, stl_text(&triangles)),
        ("binary stl", MeshFormat::Stl, stl_binary(&triangles)),
        ("text ply", MeshFormat::Ply, ply(&triangles, "ascii")),
        ("little-endian ply", MeshFormat::Ply, ply(&triangles, "binary_little_endian")),
        ("big-endian ply", MeshFormat::Ply, ply(&triangles, "binary_big_endian")),
        ("glb", MeshFormat::Gltf, glb(&triangles)),
        ("dae", MeshFormat::Collada, dae(&triangles)),
    ];
    let meshes = files.map(|(name, format, bytes)| {
        let mesh = read_bytes(&bytes, format, Path::new("mesh")).unwrap_or_else(|e| panic!("{name}: {e}"));
        (name, mesh)
    });
    let mut contents = Vec::new();
    for profile in Profile::ALL.map(Some).into_iter().chain([None]) {
        for encoding in TriangleEncoding::ALL {
            let options = Options::default().profile(profile).triangles(encoding);
            let bake = |mesh| to_bytes(mesh, &options).unwrap();
            let (bytes, report) = bake(&meshes[0].1);
            assert_eq!((report.file.triangles, report.file.duplicates, report.file.degenerate), (601, 1, 1));
            for (name, mesh) in &meshes[1..] {
                assert!(bake(mesh).0 == bytes, "{name}, {}", options.stamp());
            }
            contents.push(report.file.content_xxh3);
        }
    }
    contents.sort_unstable();
    contents.dedup();
    assert!(contents.len() >= 3 * Profile::ALL.len(), "different options give different contents");
}
