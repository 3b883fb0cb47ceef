//! Welded vertices: where they go, what the file states about it, and that neither threads nor budgets matter. Brute force on the
//! input's vertices is the oracle.

use super::mesh;
use bvh_bake::mesh::{Instance, Mesh, Object};
use bvh_bake::{
    BakeError, FileBake, Options, Outcome, Rounding, VerifyError, VerifyOptions, to_bytes, verify,
    verify_files,
};
use bvh_format::Layout;
use bvh_format::header::SectionKind;
use bvh_format::validate::validate;
use cbvh_testkit::stored::stored;
use cbvh_testkit::{Random, Triangle, folder, pool};
use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

type Point = [f64; 3];

/// Returns triangles whose vertices have been welded, and the greatest move. Compares each vertex with all others.
fn welded(triangles: &[Triangle], distance: f64) -> (Vec<Triangle>, f64) {
    let mut vertices: Vec<Point> = Vec::new();
    for corner in triangles.iter().flatten() {
        if !vertices.contains(corner) {
            vertices.push(*corner);
        }
    }
    let squared = |a: &Point, b: &Point| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>();
    let mut most = 0.0f64;
    let mut to: HashMap<[u64; 3], Point> = HashMap::new();
    for vertex in &vertices {
        let first = vertices.iter().find(|first| squared(first, vertex) <= distance * distance).unwrap();
        most = most.max(squared(first, vertex));
        to.insert(vertex.map(f64::to_bits), *first);
    }
    let place = |corner: &Point| to[&corner.map(f64::to_bits)];
    (triangles.iter().map(|triangle| [0, 1, 2].map(|corner| place(&triangle[corner]))).collect(), most.sqrt())
}

/// Returns all that a file states but its provenance and the rounding of vertices.
fn content(bytes: &[u8]) -> Vec<(u32, Vec<u8>)> {
    let layout = validate(bytes).unwrap();
    let kept = layout.sections.iter().filter(|section| section.kind != SectionKind::Provenance);
    let objects: Vec<_> = layout
        .objects
        .iter()
        .map(|object| {
            let mut record = *object.record();
            record.max_vertex_rounding = 0.0.into();
            zerocopy::IntoBytes::as_bytes(&record).to_vec()
        })
        .collect();
    let of_section = |kind: SectionKind, range: std::ops::Range<usize>| match kind {
        SectionKind::Objects => objects.concat(),
        _ => bytes[range].to_vec(),
    };
    kept.map(|section| (section.kind as u32, of_section(section.kind, section.range.clone()))).collect()
}

fn rounding(bytes: &[u8]) -> f64 {
    Layout::read(bytes).unwrap().objects[0].record().max_vertex_rounding.get()
}

/// Makes triangles whose corners are `f32` numbers, so that they are stored as they are.
fn soup(random: &mut Random, count: usize, mut coordinate: impl FnMut(&mut Random) -> f64) -> Vec<Triangle> {
    let mut corner = || [(); 3].map(|()| f64::from(coordinate(random) as f32));
    (0..count).map(|_| [(); 3].map(|()| corner())).collect()
}

/// A file is that of the mesh that brute force welds, and it states the greatest move.
#[test]
fn vertices_go_where_brute_force_takes_them() {
    let mut random = Random::new(11);
    for case in 0..60 {
        // On a lattice many vertices are equal, many are exactly at the distance, and many rows are chains.
        let triangles = match case % 3 {
            0 => soup(&mut random, 20 + case, |random| random.below(7) as f64),
            1 => soup(&mut random, 20 + 4 * case, |random| 8.0 * random.unit()),
            _ => soup(&mut random, 20 + 4 * case, |random| random.below(3) as f64 + 0.01 * random.unit()),
        };
        for distance in [1e-3, 0.02, 1.0, 2f64.sqrt(), 2.0, 3.0] {
            let options = Options::default().weld(distance);
            let (expected, most) = welded(&triangles, distance);
            for threads in [1, 2] {
                let (bytes, _) = pool(threads).install(|| to_bytes(&mesh(&triangles), &options).unwrap());
                let (plain, _) = to_bytes(&mesh(&expected), &Options::default()).unwrap();
                assert!(content(&bytes) == content(&plain), "case {case}, distance {distance}");
                let stated = rounding(&bytes);
                assert!(stated >= most && stated <= most * (1.0 + 1e-13), "{stated} for {most}");
                let report = verify(&bytes, &mesh(&triangles)).unwrap();
                assert!(report.max_move <= stated && report.max_move >= most * (1.0 - 1e-13));
            }
        }
    }
}

/// Of three vertices in a row, the third goes to the place of the second, from which that has gone to the first.
#[test]
fn welding_is_not_transitive() {
    let far = [0.0, 9.0, 0.0];
    let row = |x: f64| [x, 0.0, 0.0];
    let triangles = [[row(0.0), row(1.0), row(2.0)], [row(3.0), far, [9.0; 3]]];
    let (bytes, report) = to_bytes(&mesh(&triangles), &Options::default().weld(1.0)).unwrap();
    let all: HashMap<u32, Triangle> = stored(&bytes).into_iter().map(|of| (of.id, of.corners)).collect();
    assert_eq!(all[&0], [row(0.0), row(0.0), row(1.0)]);
    assert_eq!(all[&1], [row(2.0), far, [9.0; 3]]);
    assert_eq!((report.file.triangles, report.file.degenerate), (2, 1));
    // The vertex that a triangle uses first is the first, wherever it is.
    let turned = [[row(2.0), row(1.0), row(0.0)], [row(3.0), far, [9.0; 3]]];
    let (bytes, _) = to_bytes(&mesh(&turned), &Options::default().weld(1.0)).unwrap();
    let all: HashMap<u32, Triangle> = stored(&bytes).into_iter().map(|of| (of.id, of.corners)).collect();
    assert_eq!(all[&0], [row(2.0), row(2.0), row(1.0)]);
    assert_eq!(all[&1][0], row(2.0));
    // The end of the distance counts.
    let (bytes, _) = to_bytes(&mesh(&triangles), &Options::default().weld(1f64.next_down())).unwrap();
    assert_eq!(
        (rounding(&bytes), Layout::read(&bytes).unwrap().objects[0].record().degenerate.get()),
        (0.0, 1)
    );
}

/// Duplicates that arise are left out, with their orientation, and every check finds the file right.
#[test]
fn duplicates_that_arise_are_duplicates() {
    let mut random = Random::new(5);
    let near = |random: &mut Random| random.below(2) as f64 + f64::from(1e-4 * random.unit() as f32);
    for ids in [true, false] {
        let mut left_out = 0;
        for _ in 0..20 {
            let triangles = soup(&mut random, 60, near);
            let options = Options::default().weld(1e-3).ids(ids);
            let (bytes, report) = to_bytes(&mesh(&triangles), &options).unwrap();
            left_out += report.file.duplicates;
            let checked = verify(&bytes, &mesh(&triangles)).unwrap();
            assert_eq!((checked.duplicates, checked.by_id), (report.file.duplicates, ids));
            // A corner that has moved elsewhere is found.
            let mut other = triangles.clone();
            other[7][1][0] += 0.5;
            assert!(matches!(verify(&bytes, &mesh(&other)), Err(VerifyError::Differs { .. })));
        }
        assert!(left_out > 20, "{left_out}");
    }
}

/// Writes a mesh as an OBJ file, each triangle with its own vertices.
pub(super) fn write(path: &Path, triangles: &[Triangle]) {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    for [x, y, z] in triangles.iter().flatten() {
        writeln!(file, "v {x:?} {y:?} {z:?}").unwrap();
    }
    for first in (1..=3 * triangles.len()).step_by(3) {
        writeln!(file, "f {} {} {}", first, first + 1, first + 2).unwrap();
    }
    file.flush().unwrap();
}

/// A mesh larger than the memory for it has the same bytes, on one thread and on two.
#[test]
fn budgets_and_threads_do_not_matter() {
    let folder = folder();
    let (input, output) = (folder.path().join("cells.obj"), folder.path().join("cells.cbvh"));
    // Near some 60,000 points of a lattice there are many vertices each; the lattice has half a million triangles.
    let mut random = Random::new(23);
    let triangles: Vec<Triangle> = (0..400_000)
        .map(|_| {
            let cell = [(); 3].map(|()| random.below(40) as f64);
            let mut corner = |edge: usize| {
                let step = |axis: usize| if axis == edge { 1.0 } else { 0.0 };
                [0, 1, 2].map(|axis| cell[axis] + step(axis) + 1e-9 * random.signed())
            };
            [corner(0), corner(1), corner(2)]
        })
        .collect();
    write(&input, &triangles);
    let options = Options::default().weld(1e-8);
    let mut all: Vec<Vec<u8>> = Vec::new();
    for (threads, memory) in [(1, None), (2, None), (1, Some(128 << 20)), (2, Some(128 << 20))] {
        let outcome = pool(threads).install(|| {
            let bake = FileBake::new([&input], &output).options(options.clone()).force(true);
            bake.max_memory(memory).run().unwrap()
        });
        let Outcome::Baked(report) = outcome else { panic!() };
        assert_eq!(report.traffic.scratch_written > 0, memory.is_some());
        assert!(report.file.duplicates > 100_000 && report.file.max_vertex_rounding > 1e-9);
        all.push(std::fs::read(&output).unwrap());
    }
    assert!(all.windows(2).all(|pair| pair[0] == pair[1]));
    let text = Layout::read(&all[0]).unwrap().sections.iter().find_map(|section| {
        let text = || String::from_utf8(all[0][section.range.clone()].to_vec()).unwrap();
        (section.kind == SectionKind::Provenance).then(text)
    });
    let text = text.unwrap();
    assert!(text.lines().any(|line| line == "weld=1e-8"), "{text}");
    assert!(text.lines().any(|line| line.starts_with("options=") && line.contains(" weld=1e-8")), "{text}");
    let verified =
        verify_files(&output, std::slice::from_ref(&input), &VerifyOptions::default().max_memory(160 << 20));
    assert!(verified.unwrap().duplicates > 100_000);
    // Another distance is another bake.
    let again = |options: Options| FileBake::new([&input], &output).options(options).run().unwrap();
    assert!(matches!(again(options.clone()), Outcome::UpToDate(_)));
    assert!(matches!(again(options.weld(2e-8)), Outcome::Baked(_)));
}

/// Many vertices within one distance take no quadratic time: comparing a million of them with each other would take an hour.
#[test]
fn dense_vertices_take_no_quadratic_time() {
    let mut random = Random::new(31);
    let count = 340_000;
    let in_cluster = soup(&mut random, count, |random| random.unit());
    // All within a ball of the distance, all on a sphere about one of them, and two clusters at about the distance.
    let on_sphere: Vec<Triangle> = in_cluster
        .iter()
        .map(|triangle| {
            triangle.map(|corner| {
                let length = corner.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-9);
                corner.map(|c| f64::from((c / length) as f32))
            })
        })
        .collect();
    let split: Vec<Triangle> = (0..)
        .zip(&in_cluster)
        .map(|(number, triangle)| {
            let x = if number % 2 == 0 { 1.0 } else { 0.0 };
            triangle
                .map(|corner| [f64::from((x + 1e-3 * corner[0]) as f32), corner[1] * 1e-3, corner[2] * 1e-3])
        })
        .collect();
    for (name, triangles, distance) in
        [("ball", &in_cluster, 1.0), ("sphere", &on_sphere, 1.0), ("clusters", &split, 0.9999)]
    {
        let options = Options::default().weld(distance).effort(bvh_bake::Effort::Quick);
        let (_, report) = to_bytes(&mesh(triangles), &options).unwrap();
        assert!(report.file.degenerate > 0, "{name}");
    }
}

/// Each object is welded by itself, in its own units, and instances stay where they are.
#[test]
fn each_object_of_a_scene_is_welded_by_itself() {
    let triangle = |x: f64| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
    let crack = 1e-6;
    let object = |name: &str, triangles: &[Triangle], first: u32| Object {
        name: name.to_owned(),
        triangle_ids: (first..first + triangles.len() as u32).collect(),
        ..mesh(triangles).objects[0].clone()
    };
    let (a, b) = ([triangle(0.0), triangle(1.0 + crack)], [triangle(crack)]);
    let point = [[[5.0, 5.0, 5.0]; 3]];
    let objects = vec![object("a", &a, 0), object("b", &b, 2), object("point", &point, 3)];
    let instances = (0..3).map(Instance::of_object).collect::<Vec<_>>();
    let scene = Mesh { objects, instances, ..mesh(&a) };
    let (bytes, _) = to_bytes(&scene, &Options::default().weld(1e-5)).unwrap();
    let all: HashMap<u32, Triangle> = stored(&bytes).into_iter().map(|of| (of.id, of.corners)).collect();
    assert_eq!(all[&1][0], [1.0, 0.0, 0.0], "a vertex of the same object");
    assert!((all[&2][0][0] - crack).abs() < 1e-12, "the vertex at 0 is of another object");
    assert_eq!(verify(&bytes, &scene).unwrap().objects, 3);
    // As one object, both meet.
    let joined = Mesh { instances: Vec::new(), ..scene };
    let (bytes, report) = to_bytes(&joined, &Options::default().weld(1e-5)).unwrap();
    assert!(report.file.duplicates == 1 && stored(&bytes).iter().all(|of| of.id != 2));
    verify(&bytes, &joined).unwrap();
}

/// A distance that is no length, or that exceeds an object, is refused before anything is written.
#[test]
fn distances_that_are_no_lengths_or_too_long_are_refused() {
    let triangles = [[[0.0; 3], [3.0, 4.0, 0.0], [3.0, 0.0, 0.0]]];
    let refused = |distance: f64| match to_bytes(&mesh(&triangles), &Options::default().weld(distance)) {
        Err(error @ BakeError::Weld { .. }) => error.to_string(),
        other => panic!("{distance}: {other:?}"),
    };
    for (distance, found) in [(-1.0, "-1e0"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let text = refused(distance);
        assert!(text.contains(&format!("found {found}")) && text.contains("weld within"), "{text}");
    }
    let text = refused(5f64.next_up());
    assert!(text.contains("from 0 to the diagonal 5.00e0 of the object's box, found 5.0"), "{text}");
    let folder = folder();
    let (input, output) = (folder.path().join("one.obj"), folder.path().join("one.cbvh"));
    write(&input, &triangles);
    for distance in [f64::NAN, 6.0] {
        let bake = FileBake::new([&input], &output).options(Options::default().weld(distance));
        assert!(matches!(bake.run(), Err(BakeError::Weld { .. })) && !output.exists());
    }
    // At the diagonal, all collapses to points.
    let (bytes, report) = to_bytes(&mesh(&triangles), &Options::default().weld(5.0)).unwrap();
    assert_eq!((report.file.triangles, report.file.degenerate), (1, 1));
    assert_eq!(stored(&bytes)[0].corners, [[0.0; 3]; 3]);
    assert!(rounding(&bytes) >= 5.0 && rounding(&bytes) < 5.000_001);
    verify(&bytes, &mesh(&triangles)).unwrap();
    // -0 and 0 weld nothing, and leave no trace.
    let (plain, _) = to_bytes(&mesh(&triangles), &Options::default()).unwrap();
    for none in [0.0, -0.0] {
        assert!(to_bytes(&mesh(&triangles), &Options::default().weld(none)).unwrap().0 == plain);
    }
    // A single point has nothing to weld, at any distance.
    let point = mesh(&[[[1.0, 2.0, 3.0]; 3]]);
    assert_eq!(rounding(&to_bytes(&point, &Options::default().weld(7.0)).unwrap().0), 0.0);
}

/// A sphere as three.js makes it: rows of vertices, whose first and last column differ by the rounding of the sine of 2 pi, and
/// whose poles are a vertex for each column.
pub(super) fn three_js_sphere(columns: u32, rows: u32) -> Mesh {
    let mut positions = Vec::new();
    for row in 0..=rows {
        let v = f64::from(row) / f64::from(rows);
        for column in 0..=columns {
            let u = f64::from(column) / f64::from(columns);
            let (around, down) = (u * std::f64::consts::TAU, v * std::f64::consts::PI);
            positions.push([-around.cos() * down.sin(), down.cos(), around.sin() * down.sin()]);
        }
    }
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let at = |row: u32, column: u32| row * (columns + 1) + column;
            let [a, b] = [at(row, column + 1), at(row, column)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            if row != 0 {
                triangles.push([a, b, d]);
            }
            if row != rows - 1 {
                triangles.push([b, c, d]);
            }
        }
    }
    Mesh::from_triangles(positions, triangles)
}

/// Coordinates are rounded first, so that a weld joins what it would join of the rounded mesh.
#[test]
fn coordinates_are_rounded_before_they_are_welded() {
    let sphere = three_js_sphere(32, 16);
    let mut rounded = sphere.clone();
    for position in &mut rounded.objects[0].positions {
        *position = position.map(|x| f64::from(x as f32));
    }
    for distance in [1e-9, 1e-7, 0.05] {
        let both = Options::default().round(Rounding::F32).weld(distance);
        let (bytes, _) = to_bytes(&sphere, &both).unwrap();
        let (of_rounded, _) = to_bytes(&rounded, &Options::default().weld(distance)).unwrap();
        let corners = |bytes: &[u8]| stored(bytes).iter().map(|of| (of.id, of.corners)).collect::<Vec<_>>();
        assert_eq!(corners(&bytes), corners(&of_rounded), "{distance}");
        let moved = verify(&bytes, &sphere).unwrap().max_move;
        assert!(moved > 0.0 && moved <= rounding(&bytes), "{distance}: {moved}");
    }
}

#[test]
fn a_sphere_with_a_seam_closes() {
    let sphere = three_js_sphere(32, 16);
    let closed = |distance: f64| {
        let (bytes, report) = to_bytes(&sphere, &Options::default().weld(distance)).unwrap();
        verify(&bytes, &sphere).unwrap();
        (report.file.closed, report.file.degenerate, rounding(&bytes) <= distance)
    };
    assert_eq!(closed(0.0).0, Some(0));
    assert_eq!(closed(1e-12).0, Some(1));
    let solid = Options::default().solid(true);
    assert!(matches!(to_bytes(&sphere, &solid), Err(BakeError::NotClosed { .. })));
    assert!(to_bytes(&sphere, &solid.weld(1e-12)).is_ok());
}
