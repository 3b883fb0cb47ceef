//! Checks that faithful bakes pass and that every way of being unfaithful is reported.

use bvh_bake::mesh::{Mesh, Object};
use bvh_bake::{FileError, Options, VerifyError, VerifyOptions, to_bytes, verify, verify_files};
use bvh_format::leaf::TriangleEncoding;
use cbvh_testkit::stored::stored;
use std::path::Path;

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
    // A second object: half of its triangles are duplicates of the first one's, with rotated corners.
    let turned: Vec<_> = triangles.iter().step_by(2).map(|&[a, b, c]| [c, a, b]).collect();
    let moved = positions.iter().map(|p| [p[0], p[1], p[2] + 0.3]).collect::<Vec<_>>();
    let vertices = positions.len() as u32;
    let others: Vec<_> = triangles.iter().step_by(2).map(|t| t.map(|v| v + vertices)).collect();
    let count = (turned.len() + others.len()) as u32;
    mesh.objects.push(Object {
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
            (sheet(12, offset), Options::default().triangles(triangles).ids(ids).split_objects(split_objects))
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
    let (bytes, _) = to_bytes(&mesh, &Options::default().triangles(triangles).ids(false)).unwrap();
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
    // The reversed triangle is another surface.
    let mut other = mesh.clone();
    other.objects[0].triangles[5].swap(0, 1);
    assert!(refused(&other).starts_with("triangle 5, corner "), "{}", refused(&other));
    // A triangle is stated as a duplicate but is not one.
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

/// Returns a mesh as an OBJ file, whose order gives the ids.
fn write_obj(mesh: &Mesh, path: &Path) {
    let (mut text, mut first) = (String::new(), 1);
    for object in &mesh.objects {
        text += &format!("o {}x\n", object.name);
        object.positions.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
        for [a, b, c] in object.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)) {
            text += &format!("f {a} {b} {c}\n");
        }
        first += object.positions.len() as u32;
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn files_are_told_as_meshes_in_memory() {
    let folder = cbvh_testkit::folder();
    let [file, obj] = ["f.cbvh", "m.obj"].map(|name| folder.path().join(name));
    let (mut fine, mut wrong) = (0, std::collections::BTreeSet::new());
    for (mesh, options) in bakes() {
        let (bytes, baked) = to_bytes(&mesh, &options).unwrap();
        let others: [fn(&mut Mesh, f64); 7] = [
            |_, _| (),
            |mesh, far| mesh.objects[0].positions[77][1] += far,
            |mesh, far| mesh.objects[1].positions[7][0] += far,
            |mesh, _| mesh.objects[0].triangles.swap(3, 9),
            |mesh, _| mesh.objects[0].triangles[5].swap(0, 1),
            |mesh, _| mesh.objects[1].triangles[0] = mesh.objects[1].triangles[1],
            |mesh, _| {
                // The first object's last triangle becomes the second's first.
                let triangle = mesh.objects[0].triangles.pop().unwrap();
                let id = mesh.objects[0].triangle_ids.pop().unwrap();
                mesh.objects[1].triangles.insert(0, triangle);
                mesh.objects[1].triangle_ids.insert(0, id);
            },
        ];
        for other in others {
            let mut mesh = mesh.clone();
            other(
                &mut mesh,
                4.0 * (baked.file.max_vertex_rounding + baked.file.max_quantization_error) + 0.01,
            );
            std::fs::write(&file, &bytes).unwrap();
            write_obj(&mesh, &obj);
            let in_memory = verify(&bytes, &mesh).map_err(|error| error.to_string());
            let here = VerifyOptions::default().scratch(folder.path().to_owned());
            for options in [here.clone(), here.max_memory(100 << 20)] {
                let streamed = verify_files(&file, std::slice::from_ref(&obj), &options);
                assert_eq!(streamed.map_err(|error| error.to_string()), in_memory);
            }
            match in_memory {
                Ok(_) => fine += 1,
                Err(error) => drop(wrong.insert(error)),
            }
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "no scratch file is left");
    }
    assert!(fine >= 36 && wrong.len() > 60, "{fine} fine, {wrong:#?}");
}

/// Of several differences, the first one in the order of the leaves is reported, whatever the ids.
#[test]
fn the_first_difference_is_told() {
    let mesh = sheet(12, 0.0);
    let (bytes, _) = to_bytes(&mesh, &Options::default()).unwrap();
    let mut other = mesh.clone();
    let all: Vec<(usize, u32)> = (0..mesh.objects.len())
        .flat_map(|object| mesh.objects[object].triangle_ids.iter().map(move |&id| (object, id)))
        .collect();
    for &(object, id) in &all {
        let first = mesh.objects[object].triangle_ids[0];
        other.objects[object].triangles[(id - first) as usize].reverse();
    }
    let error = verify(&bytes, &other).unwrap_err().to_string();
    assert!(error.starts_with(&format!("triangle {}, corner 0", stored(&bytes)[0].id)), "{error}");
}

#[test]
fn a_small_budget_is_refused() {
    let folder = cbvh_testkit::folder();
    let file = folder.path().join("f.cbvh");
    let (bytes, _) = to_bytes(&sheet(5, 0.0), &Options::default()).unwrap();
    std::fs::write(&file, bytes).unwrap();
    let check = |budget| {
        let options = VerifyOptions::default().max_memory(budget);
        verify_files(&file, &[folder.path().join("m.obj")], &options).unwrap_err()
    };
    let VerifyError::File(FileError::Memory { needed, .. }) = check(1) else { panic!("{}", check(1)) };
    assert!(matches!(check(needed - 1), VerifyError::File(FileError::Memory { .. })));
    assert!(!matches!(check(needed), VerifyError::File(FileError::Memory { .. })), "there is no m.obj");
}
