//! Generates meshes. Every coordinate is an `f32`, so that baking rounds nothing.

use super::{Random, Triangle};

/// Rounds each coordinate to `f32`.
pub(crate) fn rounded(triangles: Vec<Triangle>) -> Vec<Triangle> {
    triangles.into_iter().map(|t| t.map(|p| p.map(|x| f64::from(x as f32)))).collect()
}

/// Scales the triangles, then moves them, and rounds to `f32`.
pub(crate) fn moved(triangles: &[Triangle], scale: f64, offset: [f64; 3]) -> Vec<Triangle> {
    let point = |p: [f64; 3]| [0, 1, 2].map(|axis| p[axis] * scale + offset[axis]);
    rounded(triangles.iter().map(|t| t.map(point)).collect())
}

/// Makes the cube from -1 to 1, of 12 triangles.
pub(crate) fn cube() -> Vec<Triangle> {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    faces.into_iter().flat_map(halves).map(|t| t.map(corner)).collect()
}

/// Makes the unit octahedron, whose faces are split `levels` times and pushed out to the sphere: 8 * 4^levels
/// triangles.
pub(crate) fn sphere(levels: u32) -> Vec<Triangle> {
    let axis = |i: usize, sign: f64| [0, 1, 2].map(|j| if i == j { sign } else { 0.0 });
    let mut faces = Vec::new();
    for signs in 0..8 {
        let [x, y, z] = [0, 1, 2].map(|i| axis(i, if signs >> i & 1 == 1 { -1.0 } else { 1.0 }));
        faces.push([x, y, z]);
    }
    let middle = |p: [f64; 3], q: [f64; 3]| {
        let sum = [p[0] + q[0], p[1] + q[1], p[2] + q[2]];
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        sum.map(|x| x / length)
    };
    for _ in 0..levels {
        let split = |[a, b, c]: Triangle| {
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    rounded(faces)
}

/// Makes a surface over a grid of `columns` by `rows` cells, with two triangles per cell.
fn sheet(columns: usize, rows: usize, point: impl Fn(f64, f64) -> [f64; 3]) -> Vec<Triangle> {
    let at = |i: usize, j: usize| point(i as f64 / columns as f64, j as f64 / rows as f64);
    let mut triangles = Vec::new();
    for i in 0..columns {
        for j in 0..rows {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    rounded(triangles)
}

/// Makes a torus of radius 1 around the z-axis, 0.3 thick.
pub(crate) fn torus(columns: usize, rows: usize) -> Vec<Triangle> {
    let turn = std::f64::consts::TAU;
    sheet(columns, rows, |u, v| {
        let ring = 1.0 + 0.3 * (turn * v).cos();
        [ring * (turn * u).cos(), ring * (turn * u).sin(), 0.3 * (turn * v).sin()]
    })
}

/// Makes the flat square from -1 to 1 in the plane z = 0, of 2 `cells`^2 triangles. The coordinates are exact if
/// `cells` is a power of two.
pub(crate) fn plate(cells: usize) -> Vec<Triangle> {
    sheet(cells, cells, |u, v| [2.0 * u - 1.0, 2.0 * v - 1.0, 0.0])
}

/// Makes a bumpy square.
pub(crate) fn terrain(cells: usize, seed: u64) -> Vec<Triangle> {
    let heights: Vec<f64> =
        (0..=cells * cells + 2 * cells).map(|i| Random::new(seed + i as u64).signed()).collect();
    sheet(cells, cells, |u, v| {
        let place = (u * cells as f64).round() as usize * (cells + 1) + (v * cells as f64).round() as usize;
        [2.0 * u - 1.0, 2.0 * v - 1.0, 0.1 * heights[place]]
    })
}

/// Makes a comb of teeth 2 long and 1e-5 wide, which span the mesh whatever box they are in.
pub(crate) fn comb(teeth: usize) -> Vec<Triangle> {
    let tooth = |i: usize| {
        let x = 2.0 * i as f64 / teeth as f64 - 1.0;
        [[x, -1.0, 0.0], [x + 1e-5, -1.0, 0.1], [x + 0.3, 1.0, 0.2]]
    };
    rounded((0..teeth).map(tooth).collect())
}

/// Makes triangles of all sizes anywhere between -1 and 1.
pub(crate) fn soup(count: usize, seed: u64) -> Vec<Triangle> {
    let mut random = Random::new(seed);
    let triangle = |_| {
        let (centre, scale) = (random.point(), 4f64.powi(-(random.below(6) as i32)));
        [(); 3].map(|()| {
            let offset = random.point();
            [0, 1, 2].map(|axis| 0.7 * centre[axis] + 0.3 * scale * offset[axis])
        })
    };
    rounded((0..count).map(triangle).collect())
}

/// Mixes points, segments and duplicates with their corners in another order into the mesh.
pub(crate) fn dirty(triangles: &[Triangle], seed: u64) -> Vec<Triangle> {
    let mut random = Random::new(seed);
    let mut all = Vec::new();
    for &[a, b, c] in triangles {
        all.push([a, b, c]);
        match random.below(8) {
            0 => all.push([c, a, b]),
            1 => all.extend([[b, a, c], [a, b, c]]),
            2 => all.push([a, a, a]),
            3 => all.push([a, b, a]),
            4 => all.push([b, c, [0, 1, 2].map(|axis| b[axis] + 0.5 * (c[axis] - b[axis]))]),
            _ => {}
        }
    }
    rounded(all)
}

/// Rounds to a lattice on which middles of edges and sums are exact, and which closes seams that rounding has opened.
pub(crate) fn on_lattice(triangles: Vec<Triangle>) -> Vec<Triangle> {
    triangles.into_iter().map(|t| t.map(|p| p.map(|v| (v * 1024.0).round() / 1024.0))).collect()
}

/// Turns the triangles of a mesh around the origin such that all look away from it.
pub(crate) fn outward(triangles: Vec<Triangle>) -> Vec<Triangle> {
    let is_outward = |[a, b, c]: &Triangle| {
        let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
        a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1) > 0.0
    };
    triangles.into_iter().map(|t| if is_outward(&t) { t } else { [t[0], t[2], t[1]] }).collect()
}
