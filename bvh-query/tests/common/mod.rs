//! The code that the tests share: meshes, poses, baked files and the triangles stored in them.

#![allow(dead_code, reason = "each test program uses a part of it")]

pub(crate) mod asked;
pub(crate) mod expected;
pub(crate) mod nearest;
pub(crate) mod shapes;
pub(crate) mod tally;
pub(crate) mod truth;

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Backend, Bvh, Pose, Querier};
pub(crate) use cbvh_testkit::{Random, Triangle};
use std::path::PathBuf;

/// Returns a random rotation with a translation of at most `reach` along each axis.
pub(crate) fn random_pose(random: &mut Random, reach: f64) -> Pose {
    Pose::new(rotation(random.quaternion()), random.point().map(|x| x * reach)).unwrap()
}

/// Returns the rows of the rotation of a unit quaternion (x, y, z, w).
pub(crate) fn rotation([x, y, z, w]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

pub(crate) fn translation(x: f64, y: f64, z: f64) -> Pose {
    Pose::new(*Pose::IDENTITY.rotation(), [x, y, z]).unwrap()
}

/// Makes a mesh of one object, with ids in the given order.
pub(crate) fn mesh(triangles: &[Triangle]) -> Mesh {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::from_triangles(triangles.iter().flatten().copied().collect(), indices)
}

pub(crate) fn options(profile: Profile, encoding: TriangleEncoding) -> Options {
    Options::default().profile(profile).triangles(encoding)
}

pub(crate) fn bake(mesh: &Mesh, options: &Options) -> Bvh {
    Bvh::from_bytes(to_bytes(mesh, options).unwrap().0).unwrap()
}

/// Bakes triangles of one object with the default options.
pub(crate) fn baked(triangles: &[Triangle]) -> Bvh {
    bake(&mesh(triangles), &Options::default())
}

/// A stored triangle, as queries see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stored {
    /// The number of the object in the file.
    pub(crate) object: u32,
    /// The id or, without ids, the place in the order of the leaves.
    pub(crate) id: u32,
    /// The corners: origin plus the stored coordinates.
    pub(crate) corners: Triangle,
}

/// Returns the triangles of a file by the reference decoder, including the duplicates that were left out.
pub(crate) fn stored(bvh: &Bvh) -> Vec<Stored> {
    let mut triangles = Vec::new();
    for cbvh_testkit::stored::Stored { object, id, corners, .. } in cbvh_testkit::stored::stored(bvh.bytes())
    {
        triangles.push(Stored { object, id, corners });
        triangles.extend(bvh.duplicates_of(id).unwrap().map(|id| Stored { object, id, corners }));
    }
    triangles.sort_by_key(|stored| (stored.object, stored.id));
    triangles
}

/// Returns the corners of the stored triangles, in the order of (object, id).
pub(crate) fn corners(stored: &[Stored]) -> Vec<Triangle> {
    stored.iter().map(|stored| stored.corners).collect()
}

/// Returns the triangles of B at the places that the pose gives them.
pub(crate) fn placed(triangles: &[Triangle], pose: &Pose) -> Vec<Triangle> {
    triangles.iter().map(|triangle| triangle.map(|corner| pose.place(corner))).collect()
}

/// Returns the diagonal of the box of both meshes.
pub(crate) fn size(a: &[Triangle], b: &[Triangle]) -> f64 {
    let side = |axis: usize| {
        let values = || a.iter().chain(b).flatten().map(move |corner| corner[axis]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    let sides = [side(0), side(1), side(2)];
    let longest = sides.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    longest * sides.iter().map(|side| (side / longest).powi(2)).sum::<f64>().sqrt()
}

/// Returns the backends of this CPU, and notes which ones it lacks.
pub(crate) fn backends() -> Vec<Backend> {
    let (here, missing): (Vec<_>, Vec<_>) = Backend::ALL.into_iter().partition(|b| b.is_available());
    missing.iter().for_each(|backend| cbvh_testkit::skip(&format!("this CPU has no {backend}")));
    here
}

pub(crate) fn queriers() -> Vec<Querier> {
    backends().into_iter().map(Querier::with_backend).collect()
}

#[allow(clippy::print_stderr, reason = "who looks for it sees how much was tested")]
pub(crate) fn note(line: &str) {
    eprintln!("{line}");
}

/// Returns a file of `shared/`, a folder beside the repository that not everyone has. Tests that need it are ignored for the
/// reason `needs ../shared`; `.ci/run` runs them where the folder is there.
pub(crate) fn shared(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(name);
    assert!(path.exists(), "{}: expected this file, found none", path.display());
    path
}

/// Returns a mesh of `shared/meshes` in `f32` coordinates, about which the labels of that folder are.
pub(crate) fn shared_mesh(name: &str) -> Mesh {
    let mut mesh = bvh_bake::input::read(&shared(&format!("meshes/{name}"))).unwrap();
    let positions = mesh.objects.iter_mut().flat_map(|object| &mut object.positions);
    positions.for_each(|position| *position = position.map(|value| f64::from(value as f32)));
    mesh
}

/// Returns a file of `testdata/`.
pub(crate) fn testdata(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../testdata").join(name)
}

/// Returns both meshes of FCL's test pair, which are in `testdata/`.
pub(crate) fn fcl_pair() -> [Mesh; 2] {
    ["fclenv.obj", "fclrob.obj"].map(|name| bvh_bake::input::read(&testdata(name)).unwrap())
}

/// Returns the lines of a text that say something, without comments of whole lines.
pub(crate) fn stated(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#'))
}
