//! Faithful bakes pass; each way of not being one is told.

use super::*;
use crate::{Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;

/// A wavy sheet of `2 * n * n` triangles in two objects, moved by `offset`.
fn sheet(n: u32, offset: f64) -> Mesh {
    let mut positions = Vec::new();
    for y in 0..=n {
        for x in 0..=n {
            let (x, y) = (f64::from(x) * 0.137, f64::from(y) * 0.211);
            positions.push([x + offset, y + offset, (3.0 * x).sin() * (2.0 * y).cos()]);
        }
    }
    let mut triangles = Vec::new();
    for y in 0..n {
        for x in 0..n {
            let at = y * (n + 1) + x;
            triangles.push([at, at + 1, at + n + 2]);
            triangles.push([at, at + n + 2, at + n + 1]);
        }
    }
    let mut mesh = Mesh::from_triangles(positions.clone(), triangles.clone());
    let first = triangles.len() as u32;
    // A second object, half of it duplicates of the first one's triangles, turned.
    let turned: Vec<_> = triangles.iter().step_by(2).map(|&[a, b, c]| [c, a, b]).collect();
    let moved = positions.iter().map(|p| [p[0], p[1], p[2] + 0.3]).collect::<Vec<_>>();
    let vertices = positions.len() as u32;
    let others: Vec<_> = triangles.iter().step_by(2).map(|t| t.map(|v| v + vertices)).collect();
    let count = (turned.len() + others.len()) as u32;
    mesh.objects.push(MeshObject {
        name: "second".into(),
        positions: [positions, moved].concat(),
        triangles: [turned, others].concat(),
        triangle_ids: (first..first + count).collect(),
    });
    mesh
}

fn bakes() -> impl Iterator<Item = (Mesh, Options)> {
    let encodings = [TriangleEncoding::F32, TriangleEncoding::Packed, TriangleEncoding::Quantized];
    let choices = encodings.into_iter().flat_map(|e| [(e, true), (e, false)]);
    let choices = choices.flat_map(|(e, ids)| [(e, ids, true), (e, ids, false)]);
    choices.flat_map(|(encoding, ids, split_objects)| {
        [0.0, 1e4 / 3.0, 3e9].map(|offset| {
            let triangles = Some(encoding);
            (sheet(12, offset), Options { triangles, ids, split_objects, ..Options::default() })
        })
    })
}

#[test]
fn faithful_bakes_pass() {
    for (mesh, options) in bakes() {
        let (bytes, baked) = to_bytes(&mesh, &options).unwrap();
        let report = verify(&bytes, &mesh).unwrap_or_else(|e| panic!("{}: {e}", options.stamp()));
        assert_eq!((report.triangles, report.duplicates), (baked.file.triangles, baked.file.duplicates));
        assert_eq!(report.by_id, options.ids);
        assert!(report.max_move <= baked.file.max_vertex_rounding + baked.file.max_quantization_error);
        assert!(options.split_objects || report.duplicates == 144);
    }
}

#[test]
fn an_axis_may_be_quantised_away() {
    let mut mesh = sheet(5, 0.0);
    for object in &mut mesh.objects {
        object.positions.iter_mut().for_each(|position| position[2] *= 1e-9);
    }
    let triangles = Some(TriangleEncoding::Quantized);
    let (bytes, _) = to_bytes(&mesh, &Options { triangles, ids: false, ..Options::default() }).unwrap();
    assert!(verify(&bytes, &mesh).is_ok());
}

#[test]
fn a_moved_vertex_is_found() {
    for (mesh, options) in bakes() {
        let (bytes, baked) = to_bytes(&mesh, &options).unwrap();
        let mut other = mesh.clone();
        let moved = 4.0 * (baked.file.max_vertex_rounding + baked.file.max_quantization_error) + 0.01;
        other.objects[0].positions[77][1] += moved;
        let error = verify(&bytes, &other).unwrap_err();
        assert!(matches!(error, VerifyError::Differs { .. }), "{}: {error}", options.stamp());
        assert!(!error.to_string().contains('\n'), "{error}");
    }
}

#[test]
fn missing_turned_and_swapped_triangles_are_found() {
    let mesh = sheet(6, 0.0).merged();
    let (bytes, _) = to_bytes(&mesh, &Options::default()).unwrap();
    let refused = |other: &Mesh| verify(&bytes, other).unwrap_err().to_string();
    let mut other = mesh.clone();
    other.objects[0].triangles.pop();
    other.objects[0].triangle_ids.pop();
    assert!(
        refused(&other).starts_with("triangles of the input: expected 143, found 144"),
        "{}",
        refused(&other)
    );
    let mut other = mesh.clone();
    other.objects[0].triangles.swap(3, 9);
    assert!(refused(&other).contains("triangle "), "{}", refused(&other));
    // The other way round is another surface.
    let mut other = mesh.clone();
    other.objects[0].triangles[5].swap(0, 1);
    assert!(refused(&other).starts_with("triangle 5, corner "), "{}", refused(&other));
    // A duplicate that is none.
    let mut other = mesh.clone();
    let last = other.objects[0].triangles.len() - 40;
    other.objects[0].triangles[last] = other.objects[0].triangles[1];
    assert!(refused(&other).contains("duplicate"), "{}", refused(&other));
}

#[test]
fn a_damaged_file_is_named_by_rule() {
    let mesh = sheet(6, 0.0);
    let (mut bytes, _) = to_bytes(&mesh, &Options::default()).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    assert!(matches!(verify(&bytes, &mesh), Err(VerifyError::Format(_))));
}
