//! Makes small meshes of dyadic coordinates, and changes them exactly.

use cbvh_testkit::Triangle;

/// Returns a power of two.
pub(super) fn two(exponent: i32) -> f64 {
    2f64.powi(exponent)
}

/// Returns the surface of a box, which has 12 triangles.
pub(super) fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<Triangle> {
    let corner = |bits: usize| [0, 1, 2].map(|k| if bits >> k & 1 == 1 { high[k] } else { low[k] });
    let face = |[p, q, r, s]: [usize; 4]| [[p, q, r].map(corner), [r, q, s].map(corner)];
    [[0, 2, 1, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 6, 3, 7], [0, 4, 2, 6], [1, 3, 5, 7]]
        .into_iter()
        .flat_map(face)
        .collect()
}

/// Returns the box from -1 to 1.
pub(super) fn cube() -> Vec<Triangle> {
    cuboid([-1.0; 3], [1.0; 3])
}

/// Returns the box from 0 to 1.
pub(super) fn unit_cube() -> Vec<Triangle> {
    cuboid([0.0; 3], [1.0; 3])
}

/// Returns n x n squares of two triangles each, in the plane z = 0 from 0 to n.
pub(super) fn plate(n: usize) -> Vec<Triangle> {
    let square = |k: usize| {
        let at = |x: usize, y: usize| [(k % n + x) as f64, (k / n + y) as f64, 0.0];
        [[at(0, 0), at(1, 0), at(0, 1)], [at(0, 1), at(1, 0), at(1, 1)]]
    };
    (0..n * n).flat_map(square).collect()
}

/// Returns the octahedron of 8 triangles whose corners are on the axes, at the distance `reach` from the origin.
pub(super) fn octahedron(reach: f64) -> Vec<Triangle> {
    let sign = |bits: usize, k: usize| if bits >> k & 1 == 1 { -reach } else { reach };
    (0..8)
        .map(|bits| [[sign(bits, 0), 0.0, 0.0], [0.0, sign(bits, 1), 0.0], [0.0, 0.0, sign(bits, 2)]])
        .collect()
}

/// Scales a mesh by a power of two.
pub(super) fn scaled(mesh: &[Triangle], power: f64) -> Vec<Triangle> {
    mesh.iter().map(|t| t.map(|p| p.map(|x| x * power))).collect()
}

/// Moves a mesh, exactly if the sums are f64 numbers.
pub(super) fn moved(mesh: &[Triangle], by: [f64; 3]) -> Vec<Triangle> {
    mesh.iter().map(|t| t.map(|p| [0, 1, 2].map(|k| p[k] + by[k]))).collect()
}

/// Reorders the axes: x becomes the coordinate number `order[0]`, and so on.
pub(super) fn axes(mesh: &[Triangle], order: [usize; 3]) -> Vec<Triangle> {
    mesh.iter().map(|t| t.map(|p| order.map(|k| p[k]))).collect()
}

/// Returns both meshes as one.
pub(super) fn joined(one: Vec<Triangle>, other: Vec<Triangle>) -> Vec<Triangle> {
    [one, other].concat()
}

/// Returns forty triangles of size 1 on a grid in the plane z = `z`, so that the tree has several levels.
pub(super) fn crowd(z: f64) -> Vec<Triangle> {
    let one = |k: usize| {
        let (x, y) = ((k % 8) as f64 * 2.0 - 8.0, (k / 8) as f64 * 2.0 - 5.0);
        [[x, y, z], [x + 1.0, y, z], [x, y + 1.0, z]]
    };
    (0..40).map(one).collect()
}
