//! The probes that are hard to decide, and meshes on which they are.

use crate::common::shapes::{cube, dirty, moved, on_lattice, outward, plate, soup, sphere, torus};
use crate::common::{Random, Stored, Triangle, placed, random_pose, stored};
use bvh_query::{Bvh, Pose};

/// A mesh for hard probes.
pub(crate) struct Mesh {
    pub(crate) name: &'static str,
    pub(crate) triangles: Vec<Triangle>,
    /// It is closed and consistently oriented, its duplicates counted.
    pub(crate) is_closed: bool,
}

pub(crate) fn reversed(triangles: &[Triangle]) -> Vec<Triangle> {
    triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
}

/// Triangles with corners among few points: most of their planes, edges and corners meet.
fn lattice_soup(random: &mut Random, count: usize) -> Vec<Triangle> {
    (0..count).map(|_| [(); 3].map(|()| [(); 3].map(|()| random.below(4) as f64 - 1.5))).collect()
}

pub(crate) fn meshes(random: &mut Random) -> Vec<Mesh> {
    let closed = |name, triangles| Mesh { name, triangles, is_closed: true };
    let open = |name, triangles| Mesh { name, triangles, is_closed: false };
    let (ball, cube) = (outward(on_lattice(sphere(1))), outward(cube()));
    let ring = on_lattice(torus(8, 5));
    let nested = [cube.clone(), moved(&reversed(&ball), 0.5, [0.0; 3])].concat();
    let one = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    // Two cubes in one place count twice, and one that is inside out undoes the other.
    let twice = [cube.clone(), cube.clone()].concat();
    let undone = [cube.clone(), reversed(&cube), moved(&ball, 1.5, [0.0; 3])].concat();
    // A leaf without thickness, and an edge split by triangles without area.
    let leaf = [cube.clone(), vec![one], reversed(&[one])].concat();
    let (a, b, m) = ([1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 0.0]);
    let mut needles = cube.clone();
    needles.extend([[a, m, b], [a, b, m], [a, a, b], [m, m, m]]);
    vec![
        closed("cube", cube.clone()),
        closed("ball", ball.clone()),
        closed("ring", ring.clone()),
        closed("nested", nested),
        closed("inside out", reversed(&ring)),
        closed("twice", twice),
        closed("undone", undone),
        closed("leaf", leaf),
        closed("needles", needles),
        closed("far", moved(&cube, 1.0, [1e6, -3e6, 2e6])),
        closed("tiny", moved(&ball, 2f64.powi(-40), [0.0; 3])),
        closed("huge", moved(&ring, 2f64.powi(60), [0.0; 3])),
        open("plate", plate(3)),
        open("dirty", dirty(&on_lattice(sphere(1)), 5)),
        open("soup", soup(24, 7)),
        open("lattice", lattice_soup(random, 30)),
        open("one", vec![one]),
        open("points", vec![[[0.5; 3]; 3], [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]]]),
    ]
}

/// Returns all meshes where they are and in poses, among them turns that keep coordinates exact.
pub(crate) fn in_poses(random: &mut Random) -> Vec<(Mesh, Pose)> {
    let quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let mut all = Vec::new();
    for pose in [
        Pose::IDENTITY,
        Pose::new(quarter, [0.5, -2.0, 8.0]).unwrap(),
        random_pose(random, 3.0),
        random_pose(random, 1e5),
    ] {
        all.extend(meshes(random).into_iter().map(|mesh| (mesh, pose)));
    }
    all
}

/// Returns the stored triangles of a file where a pose puts them.
pub(crate) fn stored_at(bvh: &Bvh, pose: &Pose) -> Vec<Stored> {
    let at = |t: Stored| Stored { corners: t.corners.map(|corner| pose.place(corner)), ..t };
    stored(bvh).into_iter().map(at).collect()
}

impl Mesh {
    /// The mesh where a pose puts it.
    pub(crate) fn placed(self, pose: &Pose) -> Self {
        Self { triangles: placed(&self.triangles, pose), ..self }
    }
}

/// Returns a point on a corner, an edge or a face of a mesh, or one that shares coordinates with such a point, or that is some
/// roundings off it, or any.
pub(crate) fn point(random: &mut Random, mesh: &Mesh) -> [f64; 3] {
    let on = feature_point(random, mesh);
    match random.below(6) {
        0 | 1 => on,
        2 => {
            // On an axis-parallel line through it.
            let mut point = feature_point(random, mesh);
            let axis = random.below(3);
            (point[(axis + 1) % 3], point[(axis + 2) % 3]) = (on[(axis + 1) % 3], on[(axis + 2) % 3]);
            point
        }
        3 => {
            let mut point = on;
            let axis = random.below(3);
            point[axis] = if random.below(2) == 0 { point[axis].next_up() } else { point[axis].next_down() };
            // Neighbours of 0 are too small to count.
            point.map(|v| if v.abs() < 1e-60 { 0.0 } else { v })
        }
        4 => {
            // Halfway to another one: often inside, and exact.
            let other = feature_point(random, mesh);
            [0, 1, 2].map(|k| (on[k] + other[k]) / 2.0)
        }
        _ => {
            let other = feature_point(random, mesh);
            [0, 1, 2].map(|k| on[k] + 1.7 * random.signed() * (other[k] - on[k]))
        }
    }
}

fn feature_point(random: &mut Random, mesh: &Mesh) -> [f64; 3] {
    let [a, b, c] = mesh.triangles[random.below(mesh.triangles.len())];
    let mix = |w: [f64; 3]| [0, 1, 2].map(|k| w[0] * a[k] + w[1] * b[k] + w[2] * c[k]);
    match random.below(5) {
        0 => a,
        1 => mix([0.0, 0.5, 0.5]),
        2 => mix([0.25, 0.0, 0.75]),
        3 => mix([0.5, 0.25, 0.25]),
        _ => mix([0.125, 0.75, 0.125]),
    }
}

/// Returns a direction from a point: to a feature, along an edge or an axis, in the plane of a triangle, or any.
pub(crate) fn direction(random: &mut Random, mesh: &Mesh, from: &[f64; 3]) -> [f64; 3] {
    loop {
        let [a, b, c] = mesh.triangles[random.below(mesh.triangles.len())];
        let along = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| q[k] - p[k]);
        let mut direction = match random.below(6) {
            0 | 1 => along(*from, feature_point(random, mesh)),
            2 => along(a, b),
            3 => {
                let (u, v) = (along(a, b), along(a, c));
                let share = random.below(5) as f64 - 2.0;
                [0, 1, 2].map(|k| u[k] + share * v[k])
            }
            4 => {
                let mut axis = [0.0; 3];
                axis[random.below(3)] = 1.0;
                axis
            }
            _ => random.point(),
        };
        let factor = [1.0, 1.0, 1.0, -1.0, 3.0, 1e-9, -(2f64.powi(300))][random.below(7)];
        direction = direction.map(|v| v * factor);
        let largest = direction.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        if largest > 0.0 {
            return direction.map(|v| if v.abs() < 1e-50 * largest { 0.0 } else { v });
        }
    }
}
