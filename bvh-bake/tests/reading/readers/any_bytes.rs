//! Reads malformed files: a folder of them, random bytes and damaged files.

use super::clouds::{pcd, ply_of_points};
use super::collada::{HERE, faces, square};
use super::gltf::{INDEXED, glb, gltf};
use super::gltf_model::Model;
use super::{CORNERS, TWO, binary_stl, one_line, ply};
use bvh_bake::Options;
use bvh_bake::input::{MeshFormat, read, read_bytes_with};
use cbvh_testkit::Random;
use cbvh_testkit::depth::rounds;
use std::fs;
use std::panic::catch_unwind;
use std::path::Path;

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
    ("tinyobjloader__test-nan.obj", Err("line 12: expected a finite coordinate")),
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
#[ignore = "needs ../shared"]
fn hard_files_are_read_or_refused_as_expected() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/hard");
    let mut seen = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let result = read(&path);
        let expected = HARD.iter().find(|(file, _)| *file == name).map(|(_, expected)| *expected);
        match (&result, expected) {
            (Ok(mesh), Some(Ok(triangles))) => assert_eq!(mesh.triangle_count(), triangles, "{name}"),
            (Err(error), Some(Err(part))) => assert!(error.to_string().contains(part), "{name}: {error}"),
            (_, Some(_)) => panic!("{name}: {:?}", result.map(|mesh| mesh.triangle_count())),
            (_, None) => {}
        }
        seen += usize::from(expected.is_some());
        match result {
            Ok(mesh) => assert_eq!(mesh.check(), Ok(()), "{name}"),
            Err(error) => drop(one_line(&error)),
        }
    }
    assert_eq!(seen, HARD.len());
}

/// Writes a file of two strips, of which the first has two parts, and a face of two corners.
fn strips(format: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement tristrips 2\n\
         property list int64 int64 vertex_indices\nelement face 1\nproperty list int64 int64 vertex_index\nend_header\n"
    )
    .into_bytes();
    let mut put = |value: i64, is_real: bool| match (format, is_real) {
        ("ascii", _) => bytes.extend(format!("{value}\n").bytes()),
        (_, true) => bytes.extend((value as f64).to_be_bytes()),
        (_, false) => bytes.extend(value.to_be_bytes()),
    };
    [0, 0, 0, 1, 0, 0, 0, 1, 0].into_iter().for_each(|value| put(value, true));
    for list in [&[0, 1, 2, -1, 2, 1, 0, 0][..], &[2, 1, 0], &[0, 1]] {
        put(list.len() as i64, false);
        list.iter().for_each(|&value| put(value, false));
    }
    bytes
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
        (MeshFormat::Ply, ply_of_points("ascii")),
        (MeshFormat::Ply, strips("ascii")),
        (MeshFormat::Ply, strips("binary_big_endian")),
        (MeshFormat::Stl, [&binary_stl(b"", 2, &TWO)[..], b"a rest\r\n"].concat()),
        (MeshFormat::Xyz, b"x;y;z\n2\n0;1;2\n1 2 nan\n".to_vec()),
        (MeshFormat::Xyz, b"# points\n0 1 2, 7\n1e3;-.5;3\n".to_vec()),
        (MeshFormat::Pcd, pcd(&[[0.0, 1.0, 2.0], [0.5, 1.0, 2.0]], "ascii")),
        (MeshFormat::Pcd, pcd(&[[0.0, 1.0, 2.0], [0.5, 1.0, 2.0]], "binary")),
        (MeshFormat::Pcd, pcd(&[[0.0, 1.0, 2.0]; 9], "binary_compressed")),
        (MeshFormat::Collada, collada().into_bytes()),
        (MeshFormat::Collada, collada().encode_utf16().flat_map(u16::to_le_bytes).collect()),
        (MeshFormat::Gltf, glb(&gltf(r#"{"children":[1]},{"mesh":0}"#, sparse, ""))),
        (MeshFormat::Gltf, Model::everything().glb()),
        (MeshFormat::Gltf, gltf(r#"{"mesh":0}"#, INDEXED, r#","uri":"data:;base64,AgEAAAAA""#).into_bytes()),
    ]
}

/// Returns a file with every kind of primitive and of transform.
fn collada() -> String {
    let all = [
        faces("triangles", "<p>9 0 9 1 9 2</p>"),
        faces("polylist", "<vcount>4 3</vcount><p>9 0 9 1 9 2 9 3 9 0 9 1 9 2</p>"),
        faces("polygons", "<p>9 0 9 1 9 2 9 3</p><ph><p>9 0 9 1 9 2 9 3</p><h>9 0 9 1 9 2</h></ph>"),
        faces("tristrips", "<p>9 0 9 1 9 3 9 2</p>"),
        faces("trifans", "<p>9 0 9 1 9 2 9 3</p>"),
    ];
    let transforms = "<matrix>0 -1 0 5 1 0 0 0 0 0 1 0 0 0 0 1</matrix><lookat>5 0 0 0 0 0 0 0 1</lookat><rotate>0 0 1 30</rotate>\
                      <scale>1 -2 3</scale><skew>45 0 1 0 1 0 0</skew><translate>1 2 3</translate>";
    let nodes = format!(
        "{HERE}<node><!-- &amp; -->{transforms}<instance_node url=\"#n\"/><instance_geometry url=\"#g\"/></node>"
    );
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><!DOCTYPE COLLADA [<!ENTITY a \"b\">]>{}",
        square(&all.concat(), &nodes)
    )
}

const FORMATS: [MeshFormat; 7] = [
    MeshFormat::Obj,
    MeshFormat::Stl,
    MeshFormat::Ply,
    MeshFormat::Gltf,
    MeshFormat::Collada,
    MeshFormat::Xyz,
    MeshFormat::Pcd,
];

/// Asserts what must hold for any bytes.
fn survives(bytes: &[u8], format: MeshFormat) {
    MeshFormat::from_content(bytes);
    for drop_nan in [false, true] {
        match read_bytes_with(bytes, format, Path::new("test"), &Options::default().drop_nan(drop_nan)) {
            Ok(mesh) => {
                assert_eq!(mesh.check(), Ok(()));
                assert!(mesh.warnings.len() < 8 && !mesh.warnings.concat().chars().any(char::is_control));
            }
            Err(error) => drop(one_line(&error)),
        }
    }
}

#[test]
fn seeds_are_read() {
    // The document of the last glTF seed names more bytes than it has.
    for (format, bytes) in seeds().into_iter().filter(|(format, _)| *format != MeshFormat::Gltf) {
        let dropping = Options::default().drop_nan(true);
        let read = read_bytes_with(&bytes, format, Path::new("test"), &dropping);
        assert!(read.is_ok(), "{:?} {format:?}", read.err());
    }
}

/// Asserts that reading survives random files, each of which a call of `file` makes.
fn all_survive(seed: u64, mut file: impl FnMut(&mut Random) -> (MeshFormat, Vec<u8>)) {
    let random = &mut Random::new(seed);
    for round in 0..rounds(200) {
        let (format, bytes) = file(random);
        let survived = catch_unwind(|| survives(&bytes, format));
        assert!(survived.is_ok(), "round {round}, {format:?}: {}", bytes.escape_ascii());
    }
}

/// Returns a random element.
fn any<T>(mut of: Vec<T>, random: &mut Random) -> T {
    of.swap_remove(random.below(of.len()))
}

#[test]
fn random_bytes_never_panic() {
    for (seed, format) in FORMATS.into_iter().enumerate() {
        all_survive(seed as u64, |random| {
            let length = random.below(300);
            (format, (0..length).map(|_| random.bits() as u8).collect())
        });
    }
}

#[test]
fn statements_at_random_never_panic() {
    let few = b"-0123456789./ ";
    all_survive(10, |random| {
        let mut text = Vec::new();
        for _ in 0..random.below(61) {
            match random.below(5) {
                0 => text.extend([b"vfog"[random.below(4)], b' ']),
                1 => (0..=random.below(9)).for_each(|_| text.push(few[random.below(few.len())])),
                2 => text.extend(b"nan"),
                3 => text.extend(b"1e999"),
                _ => text.push(b"\\\n\r#"[random.below(4)]),
            }
        }
        (MeshFormat::Obj, text)
    });
}

#[test]
fn elements_at_random_never_panic() {
    let places = |text: &str| text.match_indices('<').map(|(at, _)| at).collect::<Vec<_>>();
    all_survive(11, |random| {
        let mut text = collada();
        for _ in 0..=random.below(5) {
            // An element and what follows it up to the next one goes elsewhere.
            let all = places(&text);
            let start = all[random.below(all.len())];
            let end = all.iter().copied().find(|&at| at > start).unwrap_or(text.len());
            let piece = text[start..end].to_owned();
            text.replace_range(start..end, "");
            let rest = places(&text);
            if rest.is_empty() {
                break;
            }
            text.insert_str(rest[random.below(rest.len())], &piece);
        }
        (MeshFormat::Collada, text.into_bytes())
    });
}

#[test]
fn mutated_files_never_panic() {
    all_survive(12, |random| {
        let (format, mut bytes) = any(seeds(), random);
        for _ in 0..=random.below(5) {
            if bytes.is_empty() {
                break;
            }
            let (place, value) = (random.below(bytes.len()), random.bits() as u8);
            match random.below(4) {
                0 => bytes[place] = value,
                1 => bytes[place] ^= 1 << (value % 8),
                2 => drop(bytes.remove(place)),
                _ => bytes.truncate(place),
            }
        }
        (format, bytes)
    });
}

#[test]
fn digits_changed_in_a_document_never_panic() {
    all_survive(13, |random| {
        let mut documents = seeds();
        documents
            .retain(|(format, _)| matches!(format, MeshFormat::Gltf | MeshFormat::Collada | MeshFormat::Pcd));
        let (format, mut bytes) = any(documents, random);
        let digits: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at].is_ascii_digit()).collect();
        for _ in 0..=random.below(4) {
            bytes[digits[random.below(digits.len())]] = b'0' + random.below(10) as u8;
        }
        (format, bytes)
    });
}
