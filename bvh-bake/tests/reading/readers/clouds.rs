//! Points: XYZ, PCD, and PLY without faces.

use super::{only, refusal, try_bytes};
use bvh_bake::input::{MeshFormat, read};
use bvh_bake::mesh::Mesh;
use cbvh_testkit::Random;

/// Asserts that all triangles are points, and returns these.
fn points(mesh: &Mesh) -> Vec<[f64; 3]> {
    let object = only(mesh);
    let is_point = |corners: &&[u32; 3]| corners[0] == corners[1] && corners[1] == corners[2];
    object
        .triangles
        .iter()
        .inspect(|t| assert!(is_point(t)))
        .map(|t| object.positions[t[0] as usize])
        .collect()
}

const THREE: [[f64; 3]; 3] = [[0.0, 0.5, -1.25], [1e3, 2.0, 3.0], [1e3, 2.0, 3.0]];

#[test]
fn xyz_has_a_point_per_line() {
    for text in [
        "0 .5 -1.25\n1e3 2 3\n1e3 2 3\n",
        "\u{feff}# x y z\r\n\t0,\t0.5, -1.25 ,255\r\n\r\n// more\r\n1000;2;3;nan\r\n  1e3  2  3",
        "0 0.5 -1.25\r1e3 2 3\r1e3 2 3",
    ] {
        assert_eq!(points(&try_bytes(text.as_bytes(), MeshFormat::Xyz).unwrap()), THREE, "{text:?}");
    }
    let finite = "a finite coordinate of at most 2^120 in magnitude";
    for (text, expected) in [
        ("0 0 0\n\n1 nan 2\n".to_owned(), format!("test: line 3: expected {finite}, found NaN")),
        ("0 0 inf".to_owned(), format!("test: line 1: expected {finite}, found inf")),
        ("0 0 0\n1 2 -1e37".to_owned(), format!("test: line 2: expected {finite}, found -1")),
        ("0 0\n".to_owned(), "test: line 1: expected a point: three numbers, found 0 0".to_owned()),
        (
            "12\nwater\nO 0 0 0".to_owned(),
            "line 3: expected a point: three numbers, found O 0 0 0".to_owned(),
        ),
        ("12 7\n0 0 0".to_owned(), "line 1: expected a point: three numbers, found 12 7".to_owned()),
        ("0 0 0\n1 2 z".to_owned(), "line 2: expected a point: three numbers, found 1 2 z".to_owned()),
        ("# none\n".to_owned(), "test: expected at least one point, found none".to_owned()),
    ] {
        let said = refusal(text.as_bytes(), MeshFormat::Xyz);
        assert!(said.contains(&expected), "{said}");
    }
}

pub(super) fn ply_of_points(format: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty double y\nproperty float z\n\
         property uchar red\nend_header\n"
    )
    .into_bytes();
    for [x, y, z] in THREE {
        match format {
            "ascii" => bytes.extend(format!("{x} {y} {z} 7\n").bytes()),
            _ => {
                bytes.extend((x as f32).to_le_bytes());
                bytes.extend(y.to_le_bytes());
                bytes.extend((z as f32).to_le_bytes());
                bytes.push(7);
            }
        }
    }
    bytes
}

#[test]
fn ply_without_faces_has_points() {
    for format in ["ascii", "binary_little_endian"] {
        let bytes = ply_of_points(format);
        assert_eq!(points(&try_bytes(&bytes, MeshFormat::Ply).unwrap()), THREE);
    }
    let text = String::from_utf8(ply_of_points("ascii")).unwrap();
    let said = refusal(text.replace("-1.25", "nan").as_bytes(), MeshFormat::Ply);
    assert!(said.contains("line 9: expected a finite coordinate"), "{said}");
    // A mesh without a face is no cloud.
    let empty =
        text.replace("end_header", "element face 0\nproperty list uchar int vertex_indices\nend_header");
    assert!(refusal(empty.as_bytes(), MeshFormat::Ply).contains("at least one triangle"));
    let other = text.replace("end_header", "element face 0\nproperty list uchar int corners\nend_header");
    assert!(refusal(other.as_bytes(), MeshFormat::Ply).contains("no such face"));
}

/// Compresses by LZF: bytes as they are, and copies of what was 1 to 300 bytes before.
fn lzf(bytes: &[u8]) -> Vec<u8> {
    let (mut packed, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let matching = |distance: usize| {
            let pairs = bytes[at..].iter().zip(&bytes[at - distance..]);
            pairs.take(264).take_while(|(a, b)| a == b).count()
        };
        let best = (1..=at.min(300)).max_by_key(|&distance| matching(distance));
        match best.map(|distance| (distance, matching(distance))) {
            Some((distance, length)) if length > 2 => {
                let far = distance - 1;
                match length - 2 {
                    short @ ..7 => packed.push((short << 5 | far >> 8) as u8),
                    long => packed.extend([(7 << 5 | far >> 8) as u8, (long - 7) as u8]),
                }
                packed.push(far as u8);
                at += length;
            }
            _ => {
                packed.extend([0, bytes[at]]);
                at += 1;
            }
        }
    }
    packed
}

/// Returns the bytes of a field of a point.
type FieldOf = fn(&[f64; 3]) -> Vec<u8>;

/// Writes points as PCD, with a field of two numbers before them and one between y and z.
pub(super) fn pcd(points: &[[f64; 3]], data: &str) -> Vec<u8> {
    let count = points.len();
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS spare x y rgb z\nSIZE 2 4 8 4 4\n\
         TYPE U F F U F\nCOUNT 2 1 1 1 1\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {data}\n"
    )
    .into_bytes();
    let fields: [FieldOf; 5] = [
        |_| vec![1, 0, 2, 0],
        |p| (p[0] as f32).to_le_bytes().into(),
        |p| p[1].to_le_bytes().into(),
        |_| vec![9; 4],
        |p| (p[2] as f32).to_le_bytes().into(),
    ];
    match data {
        "ascii" => points.iter().for_each(|[x, y, z]| bytes.extend(format!("1 2 {x} {y} 99 {z}\n").bytes())),
        "binary" => {
            points.iter().for_each(|point| bytes.extend(fields.iter().flat_map(|field| field(point))))
        }
        _ => {
            let whole: Vec<u8> =
                fields.iter().flat_map(|field| points.iter().flat_map(field).collect::<Vec<_>>()).collect();
            let packed = lzf(&whole);
            bytes.extend((packed.len() as u32).to_le_bytes());
            bytes.extend((whole.len() as u32).to_le_bytes());
            bytes.extend(packed);
        }
    }
    bytes
}

#[test]
fn pcd_is_read_in_all_three_forms() {
    let mut random = Random::new(3);
    let many: Vec<[f64; 3]> =
        (0..2000).map(|n| [f64::from(n % 50), random.signed(), f64::from(random.signed() as f32)]).collect();
    for data in ["ascii", "binary", "binary_compressed"] {
        for all in [&THREE[..], &many] {
            let bytes = pcd(all, data);
            assert_eq!(MeshFormat::from_content(&bytes), Some(MeshFormat::Pcd));
            assert_eq!(points(&try_bytes(&bytes, MeshFormat::Pcd).unwrap()), all, "{data}");
        }
        let mut nan = THREE;
        nan[1][2] = f64::NAN;
        let said = refusal(&pcd(&nan, data), MeshFormat::Pcd);
        let place = if data == "ascii" { "line 13" } else { "byte " };
        assert!(said.contains(place) && said.contains("finite coordinate"), "{said}");
        assert!(refusal(&pcd(&[], data), MeshFormat::Pcd).contains("at least one point"));
        let whole = pcd(&many, data);
        // Text may end within a number.
        let ends = if data == "ascii" { 1000..1001 } else { 1..40 };
        for end in ends {
            assert!(try_bytes(&whole[..whole.len() - end], MeshFormat::Pcd).is_err(), "{data} {end}");
        }
    }
}

#[test]
fn pcd_headers_are_checked() {
    let good = String::from_utf8(pcd(&THREE, "ascii")).unwrap();
    for (was, is, expected) in [
        ("FIELDS spare x y rgb z", "FIELDS spare x y rgb w", "line 11: expected FIELDS x y z"),
        ("SIZE 2 4 8 4 4", "SIZE 2 4 8 4", "line 4: expected SIZE"),
        ("SIZE 2 4 8 4 4", "SIZE 2 4 3 4 4", "line 4: expected SIZE"),
        ("SIZE 2 4 8 4 4", "SIZE 2 4 8 4 1", "line 11: expected FIELDS x y z"),
        ("FIELDS spare x y rgb z", "FIELDS x x y rgb z", "line 11: expected FIELDS x y z"),
        ("TYPE U F F U F", "TYPE U F F U X", "line 5: expected TYPE"),
        ("TYPE U F F U F", "TYPE U F F U F F", "line 5: expected TYPE"),
        ("COUNT 2 1 1 1 1", "COUNT 2 1 1 1 2", "line 11: expected FIELDS x y z"),
        ("COUNT 2 1 1 1 1", "COUNT 9999 1 1 1 1", "line 6: expected COUNT"),
        ("WIDTH 3", "WIDTH -3", "line 7: expected a number of points"),
        ("POINTS 3", "POINTS 4", "line 14: expected 4 points, found 3 and the end of the file"),
        ("POINTS 3", "POINTS 4294967295", "line 10: expected a number of points"),
        ("DATA ascii", "DATA text", "line 11: expected DATA ascii"),
        ("DATA ascii", "COLOUR red", "line 11: expected VERSION"),
        ("VERSION 0.7\n", "", ""),
        ("COUNT 2 1 1 1 1\n", "", "line 11: expected a point: 5 numbers"),
        ("99 3", "3", "line 13: expected a point: 6 numbers"),
    ] {
        let text = good.replace(was, is);
        match try_bytes(text.as_bytes(), MeshFormat::Pcd) {
            Ok(_) => assert_eq!(expected, "", "{is}"),
            Err(error) => assert!(!expected.is_empty() && error.to_string().contains(expected), "{error}"),
        }
    }
    for (data, was, is) in [("binary", "POINTS 3", "POINTS 4"), ("binary_compressed", "POINTS 3", "POINTS 9")]
    {
        let bytes = pcd(&THREE, data);
        let at = bytes.windows(was.len()).position(|part| part == was.as_bytes()).unwrap();
        let mut more = bytes.clone();
        more[at..at + was.len()].copy_from_slice(is.as_bytes());
        let said = refusal(&more, MeshFormat::Pcd);
        assert!(said.contains("points, which is what fits the file"), "{said}");
    }
}

#[test]
fn clouds_bake_alike_whatever_their_format() {
    let folder = cbvh_testkit::folder();
    let files = [
        ("a.xyz", b"0 0.5 -1.25\n1e3 2 3\n1e3 2 3\n".to_vec()),
        ("b.PCD", pcd(&THREE, "binary_compressed")),
        ("c.ply", ply_of_points("binary_little_endian")),
        ("d", pcd(&THREE, "binary")),
    ];
    let options = bvh_bake::Options::default();
    let mut contents = Vec::new();
    for (name, bytes) in files {
        let (input, output) = (folder.path().join(name), folder.path().join(format!("{name}.cbvh")));
        std::fs::write(&input, bytes).unwrap();
        assert_eq!(points(&read(&input).unwrap()), THREE);
        bvh_bake::FileBake::new([&input], &output).options(options.clone()).run().unwrap();
        let baked = std::fs::read(&output).unwrap();
        contents.push(bvh_format::Layout::read(&baked).unwrap().content_checksum);
    }
    assert!(contents.iter().all(|content| *content == contents[0]), "{contents:?}");
}
