//! Rounding on request: each coordinate becomes the nearest `f32` number, and nothing else changes.

use super::mesh;
use bvh_bake::mesh::{Instance, Mesh};
use bvh_bake::{BakeError, FileBake, Options, Outcome, Rounding, to_bytes, verify};
use bvh_format::Layout;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::ObjectRecord;
use cbvh_testkit::seal::{put, seal, section};
use cbvh_testkit::stored::stored;
use cbvh_testkit::{Random, Triangle};
use std::fs;
use std::mem::offset_of;
use std::path::Path;

/// Returns the nearest multiple of the spacing of `f32` numbers at `x`, the even one of two. All steps are exact.
fn nearest(x: f64) -> f64 {
    // A power of two has the spacing of the numbers above it.
    let exponent = ((x.to_bits() >> 52 & 0x7ff) as i32 - 1023).max(-126);
    let spacing = 2f64.powi(exponent - 23);
    let steps = x.abs() / spacing;
    let (whole, rest) = (steps.floor(), steps.fract());
    let up = rest > 0.5 || rest == 0.5 && whole % 2.0 == 1.0;
    let rounded = (whole + f64::from(u8::from(up))) * spacing;
    if x < 0.0 { 0.0 - rounded } else { rounded }
}

/// Coordinates of all magnitudes that a file may have and of smaller ones, halfway between two `f32` numbers and beside that, and
/// decimals.
fn coordinate(random: &mut Random) -> f64 {
    let exponent = random.below(280) as i32 - 160;
    let small = f64::from(random.signed() as f32);
    let half = |value: f64| value + (f64::from((value as f32).next_up()) - value) / 2.0;
    match random.below(8) {
        0 => -0.0,
        1 => half(small),
        2 => half(small).next_up(),
        3 => half(small).next_down(),
        4 => (random.signed() * 1e7).round() / 1e3,
        5 => small,
        6 => half(f64::from(f32::from_bits(random.below(1 << 24) as u32))),
        _ => random.signed() * 2f64.powi(exponent),
    }
}

fn triangles(count: usize, seed: u64) -> Vec<Triangle> {
    let random = &mut Random::new(seed);
    (0..count).map(|_| [(); 3].map(|()| [(); 3].map(|()| coordinate(random)))).collect()
}

fn rounded(triangles: &[Triangle]) -> Vec<Triangle> {
    triangles.iter().map(|corners| corners.map(|corner| corner.map(nearest))).collect()
}

fn bake(triangles: &[Triangle], options: &Options) -> Vec<u8> {
    to_bytes(&mesh(triangles), options).unwrap().0
}

/// The bytes before the first record of an object.
const HEAD: usize = 16;

/// Returns a file of one object that states that no vertex was rounded.
fn without_rounding(mut bytes: Vec<u8>) -> Vec<u8> {
    let record = section(&bytes, 1).start + HEAD;
    put(&mut bytes, record + offset_of!(ObjectRecord, max_vertex_rounding), &[0; 8]);
    seal(&mut bytes);
    bytes
}

#[test]
fn vertices_are_the_nearest_numbers_and_the_move_is_stated() {
    // More than a part, so that full parts, which threads fill, and the rest are both there.
    for (count, seed) in [(1, 1), (50, 2), (40_000, 3)] {
        let given = triangles(count, seed);
        for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
            let options = Options::default().triangles(encoding).round(Rounding::F32);
            let (bytes, report) = to_bytes(&mesh(&given), &options).unwrap();
            assert_eq!(Layout::read(&bytes).unwrap().objects[0].origin(), [0.0; 3]);
            let mut moved = 0.0f64;
            for triangle in stored(&bytes) {
                for (given, found) in given[triangle.id as usize].iter().zip(triangle.corners) {
                    let expected = given.map(nearest);
                    assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{given:?}");
                    let by = [0, 1, 2].map(|k| given[k] - expected[k]);
                    moved = moved.max(by[0].hypot(by[1]).hypot(by[2]));
                }
            }
            let stated = report.file.max_vertex_rounding;
            assert!(moved <= stated && stated <= moved * (1.0 + 2f64.powi(-47)), "{moved:e} {stated:e}");
            verify(&bytes, &mesh(&given)).unwrap();
            let bytes = bake(&given, &options.ids(false));
            verify(&bytes, &mesh(&given)).unwrap();
        }
    }
}

#[test]
fn the_bytes_are_those_of_the_same_mesh_in_f32_numbers() {
    let near = |count, seed| -> Vec<Triangle> {
        let random = &mut Random::new(seed);
        let mut corner = |far: f64| [0, 1, 2].map(|_| far + (random.signed() * 1e6).round() / 1e3);
        (0..count).map(|_| [corner(0.1), corner(-0.3), corner(0.2)]).collect()
    };
    for given in [near(30, 4), near(20_000, 5), triangles(300, 6)] {
        let in_f32 = rounded(&given);
        for encoding in TriangleEncoding::ALL {
            let plain = Options::default().triangles(encoding);
            let round = plain.clone().round(Rounding::F32);
            let expected = bake(&in_f32, &plain);
            assert!(without_rounding(bake(&given, &round)) == expected, "{encoding:?}");
            // Rounding again changes nothing, nor does it count as a move.
            assert!(bake(&in_f32, &round) == expected, "{encoding:?}");
        }
    }
}

#[test]
fn files_are_rounded_in_any_memory_and_state_the_option() {
    let directory = cbvh_testkit::folder();
    let place = |name: &str| directory.path().join(name);
    let given: Vec<Triangle> = triangles(20_000, 7);
    let corners = given.iter().flatten().map(|[x, y, z]| format!("v {x:e} {y:e} {z:e}\n"));
    let faces = (0..given.len()).map(|n| format!("f {} {} {}\n", 3 * n + 1, 3 * n + 2, 3 * n + 3));
    fs::write(place("mesh.obj"), corners.chain(faces).collect::<String>()).unwrap();
    let options = Options::default().round(Rounding::F32);
    let run = |output: &Path, options: &Options, memory: Option<u64>| {
        let bake = FileBake::new([place("mesh.obj")], output).options(options.clone()).max_memory(memory);
        bake.run().unwrap()
    };
    let output = place("mesh.cbvh");
    assert!(matches!(run(&output, &options, None), Outcome::Baked(_)));
    assert!(matches!(run(&output, &options, None), Outcome::UpToDate(_)));
    let whole = fs::read(&output).unwrap();
    let provenance = String::from_utf8(whole[section(&whole, 6)].to_vec()).unwrap();
    assert!(provenance.contains(" round=f32\n"), "{provenance}");
    run(&place("small.cbvh"), &options, Some(bvh_bake::least_memory(20_000) + (64 << 20)));
    assert!(whole == fs::read(place("small.cbvh")).unwrap());
    let in_memory = bake(&given, &options);
    let content = |bytes: &[u8]| Layout::read(bytes).unwrap().content_checksum;
    assert_eq!(content(&whole), content(&in_memory));
    // A file of other options is not up to date.
    assert!(matches!(run(&output, &Options::default(), None), Outcome::Baked(_)));
}

#[test]
fn poses_stay_as_they_are_and_each_object_is_rounded() {
    let mut scene = mesh(&triangles(20, 8));
    scene.objects.extend(mesh(&triangles(30, 9)).objects);
    scene.objects[1].triangle_ids.iter_mut().for_each(|id| *id += 20);
    let placed = |object, x| Instance {
        translation: [x, 0.1, -1e9 / 3.0],
        rotation: [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]],
        margin: 0.1,
        name: format!("part {object} at {x}"),
        ..Instance::of_object(object)
    };
    scene.instances = vec![placed(0, 0.3), placed(1, 0.7), placed(0, 1e-9)];
    let (bytes, _) = to_bytes(&scene, &Options::default().radius(0.1).round(Rounding::F32)).unwrap();
    let layout = Layout::read(&bytes).unwrap();
    assert_eq!(layout.read_instances(&bytes[..]).unwrap(), scene.instances);
    assert_eq!(layout.objects[0].record().radius.get(), 0.1);
    for triangle in stored(&bytes) {
        let object = &scene.objects[triangle.object as usize];
        let place = object.triangle_ids.iter().position(|&id| id == triangle.id).unwrap();
        let corners = object.triangles[place].map(|vertex| object.positions[vertex as usize].map(nearest));
        assert_eq!(triangle.corners, corners);
    }
}

#[test]
fn coordinates_beyond_the_format_stay_errors() {
    for beyond in [1e300, 2f64.powi(120).next_up(), f64::NAN, f64::NEG_INFINITY] {
        let mesh = Mesh::from_triangles(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, beyond, 1.0]], vec![[0, 1, 2]]);
        let refused = to_bytes(&mesh, &Options::default().round(Rounding::F32));
        assert!(matches!(refused, Err(BakeError::Input(_))), "{beyond}: {refused:?}");
    }
    let most = 2f64.powi(120);
    let largest: [Triangle; 1] = [[[most, 0.0, 0.0], [-most, 0.1, 0.0], [0.0, most.next_down(), 0.0]]];
    let bytes = bake(&largest, &Options::default().round(Rounding::F32));
    assert_eq!(stored(&bytes)[0].corners, rounded(&largest)[0]);
}
