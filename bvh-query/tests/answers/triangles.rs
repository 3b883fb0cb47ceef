//! The triangles that a shape visits are those that were baked.

use crate::common::Triangle;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, TriangleEncoding, to_bytes};
use bvh_query::{Bvh, QueryError};

/// A strip of triangles, each third of which is there twice. Its coordinates are exact as `f32` offsets.
fn strip() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let corners = (0..200).map(|k| [f64::from(k) * 0.25, f64::from(k % 2), f64::from(k % 7)]).collect();
    let faces = (0..198).flat_map(|k| vec![[k, k + 1, k + 2]; if k % 3 == 0 { 2 } else { 1 }]).collect();
    (corners, faces)
}

/// The triangle whose first corner is the least.
fn turned(triangle: Triangle) -> Triangle {
    let turns = (0..3).map(|by| [0, 1, 2].map(|k| triangle[(k + by) % 3]));
    turns.min_by(|a, b| a.partial_cmp(b).unwrap()).unwrap()
}

#[test]
fn every_id_has_the_corners_of_the_input() {
    let (corners, faces) = strip();
    let mesh = Mesh::from_triangles(corners.clone(), faces.clone());
    for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
        let options = Options::default().triangles(encoding);
        let bvh = Bvh::from_bytes(to_bytes(&mesh, &options).unwrap().0).unwrap();
        let mut found = vec![Vec::new(); faces.len()];
        bvh.all().visit_triangles(|id, triangle| found[id as usize].push(turned(triangle))).unwrap();
        for (id, face) in faces.iter().enumerate() {
            assert_eq!(found[id], [turned(face.map(|k| corners[k as usize]))], "{id}");
        }
    }
}

#[test]
fn without_ids_each_triangle_has_a_place_of_its_own() {
    let (corners, faces) = strip();
    let mesh = Mesh::from_triangles(corners.clone(), faces);
    let (bytes, report) = to_bytes(&mesh, &Options::default().ids(false)).unwrap();
    let bvh = Bvh::from_bytes(bytes).unwrap();
    let mut found = std::collections::HashMap::new();
    bvh.all()
        .visit_triangles(|place, triangle| assert_eq!(found.insert(place, turned(triangle)), None))
        .unwrap();
    assert_eq!(found.len() as u64, report.file.triangles);
    let mut triangles: Vec<_> = found.into_values().collect();
    triangles.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let mut expected: Vec<_> =
        (0..198).map(|k: usize| turned([corners[k], corners[k + 1], corners[k + 2]])).collect();
    expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
    assert_eq!(triangles, expected);
}

#[test]
fn a_damaged_page_is_an_error() {
    let (corners, faces) = strip();
    let (mut bytes, _) = to_bytes(&Mesh::from_triangles(corners, faces), &Options::default()).unwrap();
    let bvh = Bvh::from_bytes(bytes.clone()).unwrap();
    let at = bvh.layout().page_offset(0) as usize + 100;
    bytes[at] ^= 1;
    let damaged = Bvh::from_bytes(bytes).unwrap();
    assert!(matches!(damaged.all().visit_triangles(|_, _| ()), Err(QueryError::Damaged(_))));
}
