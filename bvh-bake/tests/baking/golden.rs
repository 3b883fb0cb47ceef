//! The frozen files `testdata/ok-*.cbvh`, made again in memory and compared byte for byte.
//!
//! With `CBVH_BLESS=1` missing files are written; none is ever overwritten. A baker that makes other bytes
//! on purpose leaves the frozen files as they are: they stay readable for ever. Raise `GENERATION` then and
//! bless; `bvh-format/tests/bytes/golden.rs` goes on testing the files of all generations.

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes, to_bytes_with};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::{ObjectRecord, write_objects};
use bvh_format::profile::Profile;
use bvh_format::{Layout, validate::validate};
use cbvh_testkit::seal;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// What ends the names of the files that today's baker makes.
const GENERATION: &str = "";

/// The cube from -1 to 1 around a point, 12 triangles.
fn cube(centre: [f64; 3]) -> Mesh {
    let corner = |i: usize| [0, 1, 2].map(|axis| centre[axis] + if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    Mesh::from_triangles((0..8).map(corner).collect(), faces.into_iter().flat_map(halves).collect())
}

/// The options of files that were frozen before there was a topology section.
fn without_topology(profile: Profile, triangles: TriangleEncoding) -> Options {
    Options::default().profile(profile).triangles(triangles).topology(false)
}

/// The least that a file can hold: one object, no ids.
fn plain() -> Vec<u8> {
    let options = without_topology(Profile::Dop14U8, TriangleEncoding::F32).ids(false);
    to_bytes(&cube([0.0; 3]), &options).unwrap().0
}

/// All sections: packed triangles around an origin, ids, duplicates, a zero-area triangle, provenance.
fn everything() -> Vec<u8> {
    let mut mesh = cube([1e6 + 0.1, -2e6 - 0.3, 0.0]);
    mesh.objects[0].name = "cube".to_owned();
    let object = &mut mesh.objects[0];
    object.triangles.extend([[2, 3, 0], [0, 0, 7], [3, 0, 2]]);
    object.triangle_ids.extend([12, 13, 14]);
    let options = without_topology(Profile::Dop14U8, TriangleEncoding::Packed);
    to_bytes_with(&mesh, &options, "generator=a test\ninput=a cube\n", &mut |_| ()).unwrap().0
}

/// Several objects: a cube in each profile, triangle encodings in turn, each of one page. The baker gives all
/// objects of a file the same options, so files of one object are joined here.
fn profiles() -> Vec<u8> {
    let (mut records, mut nodes, mut leaves) = (Vec::new(), Vec::new(), Vec::new());
    for (number, profile) in Profile::ALL.into_iter().enumerate() {
        let options = without_topology(profile, TriangleEncoding::ALL[number % 3]).max_error(1e-3).ids(false);
        let file = to_bytes(&cube([3.0 * number as f64, 0.0, 0.0]), &options).unwrap().0;
        let sections = seal::take_apart(&file);
        let record = *Layout::read(&file).unwrap().objects[0].record();
        assert_eq!(record.pages.get(), 1);
        let mut page = sections[1].2.clone();
        seal::put(&mut page, 24, &(leaves.len() as u64 / 64).to_le_bytes());
        seal::put(&mut page, 44, &(number as u32).to_le_bytes());
        records
            .push((profile.name().to_owned(), ObjectRecord { first_page: (number as u32).into(), ..record }));
        nodes.extend(page);
        leaves.extend_from_slice(&sections[2].2);
    }
    seal::put_together(&[(1, 1, write_objects(&records)), (2, 1, nodes), (3, 1, leaves)])
}

/// A ball of 48 triangles whose children have turning slabs.
fn turning() -> Vec<u8> {
    let (positions, triangles) = cbvh_testkit::ball::ball(48);
    let options = without_topology(Profile::Dop26U8Wide, TriangleEncoding::F32).ids(false);
    to_bytes(&Mesh::from_triangles(positions, triangles), &options).unwrap().0
}

/// Four objects: a cube, a cube without one triangle, two cubes of which the second lies in the first, is turned over and
/// is given three times, and 65 triangles that share no edge.
fn topology() -> Vec<u8> {
    let whole = || cube([0.0; 3]).objects.remove(0);
    let (mut open, mut shells, mut loose) = (whole(), whole(), whole());
    open.triangles.pop();
    for _ in 0..3 {
        let first = shells.positions.len() as u32;
        shells.positions.extend(whole().positions.iter().map(|position| position.map(|c| c / 2.0)));
        let turned = |&[a, b, c]: &[u32; 3]| [b, a, c].map(|corner| first + corner);
        shells.triangles.extend(whole().triangles.iter().map(turned));
    }
    loose.triangles = (0..65).map(|number| [3 * number, 3 * number + 1, 3 * number + 2]).collect();
    loose.positions = (0..3 * 65).map(|corner| [f64::from(corner), f64::from(corner % 3), 0.0]).collect();
    let mut objects = [("closed", whole()), ("open", open), ("shells", shells), ("loose", loose)];
    for (number, (name, object)) in (0..).zip(&mut objects) {
        object.name = (*name).to_owned();
        object.triangle_ids = (100 * number..).take(object.triangles.len()).collect();
    }
    let mesh = Mesh { objects: objects.map(|(_, object)| object).to_vec(), ..Mesh::default() };
    let options = Options::default().profile(Profile::Dop14U8).triangles(TriangleEncoding::Packed);
    to_bytes(&mesh, &options.split_objects(true)).unwrap().0
}

/// A cloud of 150 points with a radius, some of which coincide.
fn points() -> Vec<u8> {
    let at = |number: u32| [number % 7, number / 7 % 5, number % 3].map(|c| f64::from(c) / 10.0);
    let cloud = bvh_bake::shapes::cloud(&(0..150).map(at).collect::<Vec<_>>());
    to_bytes(&cloud, &Options::default().radius(0.05)).unwrap().0
}

/// Balls of 48 triangles whose coordinates are no `f32` numbers: one for each way in which they follow from offsets.
fn exact(options: Options) -> Vec<u8> {
    let (positions, triangles) = cbvh_testkit::ball::ball(48);
    let given = |change: &dyn Fn(f32, usize, usize) -> f64| {
        let of_vertex = |(number, position): (usize, &[f64; 3])| {
            // Without the tiny numbers that stand for 0 in a ball.
            let value = position.map(|c| if c.abs() < 1e-6 { 0.0 } else { c as f32 });
            [0, 1, 2].map(|axis| change(value[axis], axis, number))
        };
        positions.iter().enumerate().map(of_vertex).collect::<Vec<[f64; 3]>>()
    };
    let read = |text: String| -> f64 { text.parse().unwrap() };
    // Coordinates of all magnitudes, so that no number of digits after the point suits them.
    let wide = |value: f32, number: usize| value * [1.0, 37.0, 1e-3, 1e4][number % 4];
    let mut objects = [
        (
            "decimals",
            given(&|v, axis, _| [1_000_000.1, -2_000_000.3, 0.0][axis] + (f64::from(v) * 64.0).round()),
        ),
        ("significant", given(&|v, _, number| read(format!("{:.5e}", wide(v, number))))),
        ("shortest", given(&|v, _, number| read(format!("{:e}", wide(v, number))))),
        ("scaled", given(&|v, _, _| f64::from(v) * 0.0254)),
        // Another axis each: `f32` numbers, what computations leave behind, and a predictor that misses a few vertices.
        (
            "mixed",
            given(&|v, axis, number| match axis {
                0 => v.into(),
                1 => 1e5 + f64::from(v) / 3.0,
                _ => {
                    let missed = if number % 5 == 2 && v != 0.0 { 1000 * number as u64 } else { 0 };
                    f64::from_bits(read(format!("{:.8e}", wide(v, number))).to_bits() + missed)
                }
            }),
        ),
        // Vertices that are equal as `f32` numbers, and lie apart.
        ("twins", given(&|v, _, _| f64::from(v) * 0.7)),
    ]
    .map(|(name, positions)| {
        let object = Mesh::from_triangles(positions, triangles.clone()).objects.remove(0);
        bvh_bake::mesh::Object { name: name.to_owned(), ..object }
    });
    let twins = &mut objects[5];
    let first = twins.positions.len() as u32;
    twins.positions.extend_from_within(..);
    for coordinate in twins.positions[first as usize..].as_flattened_mut() {
        *coordinate = if *coordinate == 0.0 { 0.0 } else { coordinate.next_up() };
    }
    twins.triangles.extend(triangles.iter().map(|corners| corners.map(|corner| first + corner)));
    for (number, object) in (0..).zip(&mut objects) {
        object.triangle_ids = (100 * number..).take(object.triangles.len()).collect();
    }
    let mesh = Mesh { objects: objects.to_vec(), ..Mesh::default() };
    to_bytes(&mesh, &options.split_objects(true)).unwrap().0
}

/// Packed triangles with ids and topology.
fn exact_packed() -> Vec<u8> {
    exact(Options::default().profile(Profile::Dop14U8).triangles(TriangleEncoding::Packed))
}

/// Plain triangles below turning slabs.
fn exact_f32() -> Vec<u8> {
    exact(without_topology(Profile::Dop26U8Wide, TriangleEncoding::F32).ids(false))
}

fn check(name: &str, bytes: Vec<u8>) {
    validate(&bytes).unwrap();
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../testdata");
    let path = folder.join(format!("ok-{name}{GENERATION}.cbvh"));
    if !path.exists() && std::env::var_os("CBVH_BLESS").is_some() {
        std::fs::write(&path, &bytes).unwrap();
    }
    let frozen = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e} (CBVH_BLESS=1?)", path.display()));
    let differs = (0..).zip(frozen.iter().zip(&bytes)).find(|(_, (a, b))| a != b).map(|(at, _)| at);
    assert!(
        frozen == bytes,
        "{}: {} bytes, now {}, first other at {differs:?}",
        path.display(),
        frozen.len(),
        bytes.len()
    );
}

/// The files of exact vertices have each predictor, and each form of corrections.
#[test]
fn exact_vertices_are_stated_in_each_way() {
    for bytes in [exact_packed(), exact_f32()] {
        let layout = Layout::read(&bytes).unwrap();
        let mut found = BTreeSet::new();
        for object in &layout.objects {
            let vertices = object.vertices();
            found.extend(vertices.predictors.map(|predictor| predictor.parts().0));
            assert_eq!(object.record().max_vertex_rounding.get(), 0.0);
            assert_eq!(
                vertices.origin != [0.0; 3],
                ["decimals", "mixed"].contains(&object.name()),
                "{vertices:?}"
            );
            let corrected = match object.name() {
                "twins" => [true; 3],
                "scaled" | "mixed" => [false, true, true],
                _ => [false; 3],
            };
            assert_eq!(vertices.corrected, corrected, "{}: {vertices:?}", object.name());
        }
        assert_eq!(found, BTreeSet::from([0, 1, 2, 3, 4]));
    }
}

#[test]
fn the_baker_still_makes_the_frozen_files() {
    check("plain", plain());
    check("everything", everything());
    check("profiles", profiles());
    check("turning", turning());
    check("topology", topology());
    check("points", points());
    check("exact", exact_packed());
    check("exact-f32", exact_f32());
}
