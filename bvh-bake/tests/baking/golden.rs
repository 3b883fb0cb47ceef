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

#[test]
fn the_baker_still_makes_the_frozen_files() {
    check("plain", plain());
    check("everything", everything());
    check("profiles", profiles());
    check("turning", turning());
    check("topology", topology());
    check("points", points());
}
