//! Meshes whose surfaces lie inside each other, and meshes that are the same.

use super::shapes::{crowd, cube, cuboid, joined, moved, octahedron, plate, scaled, terrain, two, unit_cube};
use super::{Case, question};
use crate::Triangle;

const INSIDE: &str = "meshes are surfaces: a mesh inside another one does not touch it";
const SAME: &str =
    "the meshes are the same: each triangle touches its copy and the copy's neighbours, in their planes";
const LIFTED: &str = "each triangle is nearest to its own copy, and many pairs are equally near";

pub(super) fn cases() -> Vec<Case> {
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("inside", name, INSIDE, a, b);
    let shells = |from: i32| (0..4).flat_map(|k| scaled(&cube(), two(from + 2 * k))).collect::<Vec<_>>();
    let tetrahedron = |s: f64| -> Vec<Triangle> {
        let p = [[s, s, s], [s, -s, -s], [-s, s, -s], [-s, -s, s]];
        [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]].map(|t: [usize; 3]| t.map(|k| p[k])).to_vec()
    };
    let mut cases = vec![
        ask("a cube in a cube", scaled(&cube(), 2.0), cube()).apart(1.0, "from face to face"),
        ask("a cube in a cube, 2^-30 off a face", scaled(&cube(), 2.0), cube())
            .moved([1.0 - two(-30), 0.0, 0.0])
            .apart(two(-30), "from face to face"),
        ask("a cube in a cube, at a face from inside", scaled(&cube(), 2.0), cube())
            .moved([1.0, 0.0, 0.0])
            .touching(18),
        ask("a cube in an octahedron", octahedron(4.0), cube()).above(0.5773502691896257),
        ask("an octahedron in a cube, tips at its faces", cube(), octahedron(1.0)).touching(48),
        ask("an octahedron in a tetrahedron", tetrahedron(4.0), octahedron(1.0)).above(1.7320508075688772),
        ask("a speck in a cube", scaled(&cube(), two(20)), scaled(&cube(), two(-20)))
            .apart(two(20) - two(-20), "from face to face"),
        ask("shells between shells", shells(0), shells(1)).apart(1.0, "between the two innermost shells"),
        ask("shells between shells, moved to contact", shells(0), shells(1))
            .moved([1.0, 0.0, 0.0])
            .touching(18),
    ];
    let ask = |name: &str, mesh: Vec<Triangle>| question("identical", name, SAME, mesh.clone(), mesh);
    let hills = || terrain(4, |x, y| ((x * 7 + y * 3) % 4) as f64 / 8.0);
    let corner: Triangle = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let sliver = || vec![[[0.0; 3], [1.0, 1.0, 1.0], [0.5, 0.5, 0.5 + two(-24)]]];
    cases.extend([
        ask("one triangle", vec![corner]).touching(1),
        ask("one sliver", sliver()).touching(1),
        ask("one point", vec![[[3.0, 5.0, 7.0]; 3]]).touching(1),
        ask("cubes", unit_cube()).touching(108),
        ask("octahedra", octahedron(3.0)).touching(56),
        ask("plates", plate(4)).touching(298),
        ask("hills", hills()).touching(298),
        ask("hills 2^-70 large", scaled(&hills(), two(-70))).touching(298),
    ]);
    let ask = |name: &str, mesh: Vec<Triangle>, by: f64| {
        question("identical", name, LIFTED, mesh.clone(), mesh).moved([0.0, 0.0, by])
    };
    let lifted = "each point is this far from its copy, and the planes are as far apart";
    cases.extend([
        ask("plates, lifted by 2^-52", plate(4), two(-52)).apart(two(-52), lifted),
        ask("plates, lifted by 2^-10", plate(4), two(-10)).apart(two(-10), lifted),
        ask("hills, lifted by 2^-52", hills(), two(-52)).above(1.9616579662846074e-16),
        ask("hills, lifted by 2^-10", hills(), two(-10)).above(0.0008627462974597385),
        ask("crowds, lifted by 2^-52", crowd(0.0), two(-52)).apart(two(-52), lifted),
        ask(
            "boxes, lifted by 2^-52",
            joined(cuboid([0.0; 3], [1.0; 3]), moved(&unit_cube(), [2.0, 0.0, 0.0])),
            two(-52),
        )
        .touching(104),
    ]);
    cases
}
