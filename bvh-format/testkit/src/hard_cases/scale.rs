//! Meshes that are far from the origin, very small, very large, of very different sizes, or at the limits of number
//! formats.

use super::shapes::{crowd, cube, joined, moved, octahedron, scaled, two, unit_cube};
use super::{Case, question};
use crate::Triangle;

const FAR: &str =
    "far from the origin, few bits of a coordinate are left for the shape, and none in single precision";
const FAR_F32: &str =
    "far from the origin, but all coordinates are f32 numbers, so all precisions hold the same meshes";
const SMALL: &str = "products of three such lengths underflow in single precision";
const LARGE: &str = "products of three such lengths overflow in single precision";
const UNEQUAL: &str = "one mesh is at least 2^80 times as large as the other";
const MIXED: &str = "the triangles of a mesh differ in size by a factor of 2^40 or more, around one point";
const SUBNORMAL: &str =
    "coordinates are small multiples of 2^-149: their products are zero in single precision";
const OVER: &str = "coordinates reach or exceed the largest f16 number, 65504";
const UNDER: &str = "coordinates are as small as the smallest positive f16 number, 2^-24, or smaller";

pub(super) fn cases() -> Vec<Case> {
    [far(), sizes(), unequal(), mixed(), subnormal(), half_precision()].concat()
}

fn far() -> Vec<Case> {
    let far = [1e7, -1e7, 1e7];
    let gap = two(-20);
    let out = |mesh: &[Triangle]| moved(mesh, far);
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("offset 1e7", name, FAR, a, b);
    let beside = |x: f64| moved(&unit_cube(), [x, 0.25, 0.125]);
    // A half turn about z takes the stored triangles to the other side.
    let half_turn = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
    let other_side =
        |mesh: &[Triangle]| mesh.iter().map(|t| t.map(|[x, y, z]| [-x, -y, z])).collect::<Vec<_>>();
    let mut cases = vec![
        ask("cubes, touching", out(&unit_cube()), out(&beside(1.0))).touching(13),
        ask("cubes, 2^-20 apart", out(&unit_cube()), out(&beside(1.0 + gap))).apart(gap, "from face to face"),
        ask("cubes, 2^-20 deep", out(&unit_cube()), out(&beside(1.0 - gap))).touching(10),
        ask("octahedra, tips 2^-20 apart", out(&octahedron(1.0)), {
            out(&moved(&octahedron(1.0), [2.0 + gap, 0.0, 0.0]))
        })
        .apart(gap, "tip to tip"),
        ask(
            "a small cube in a cube",
            out(&unit_cube()),
            out(&moved(&scaled(&unit_cube(), 0.5), [0.125, 0.25, 0.25])),
        )
        .apart(0.125, "from face to face"),
        ask("brought there by the pose, 2^-20 apart", out(&unit_cube()), unit_cube())
            .moved([1e7 + 1.0 + gap, -1e7, 1e7])
            .apart(gap, "from face to face"),
        ask("brought back by the pose, touching", unit_cube(), out(&unit_cube()))
            .moved([1.0 - 1e7, 1e7, -1e7])
            .touching(62),
        ask("turned by half a turn, 2^-20 apart", out(&unit_cube()), other_side(&out(&beside(1.0 + gap))))
            .turned(half_turn)
            .apart(gap, "from face to face"),
    ];
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("offset 1e7", name, FAR_F32, a, b);
    let big = |x: f64| out(&moved(&scaled(&unit_cube(), 8.0), [x, 2.0, 4.0]));
    cases.extend([
        ask("cubes of side 8, touching", big(0.0), big(8.0)).touching(62),
        ask("cubes of side 8, 1 apart", big(0.0), big(9.0)).apart(1.0, "from face to face"),
        ask("cubes of side 8, 1 deep", big(0.0), big(7.0)).touching(52),
    ]);
    cases
}

fn sizes() -> Vec<Case> {
    let mut cases = Vec::new();
    let tilted = |size: f64| -> Vec<Triangle> {
        scaled(&[[[0.0, 0.0, 0.0], [7.0, 1.0, 2.0], [1.0, 5.0, -3.0]]], size)
    };
    for (kind, hard, exponent) in [
        ("size 1e-20", SMALL, -66),
        ("size 1e-36", SMALL, -120),
        ("size 1e+15", LARGE, 50),
        ("size 1e+33", LARGE, 110),
    ] {
        let size = two(exponent);
        let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| {
            question(kind, format!("{name} ({kind})"), hard, a, b)
        };
        let cube = |x: f64| scaled(&moved(&unit_cube(), [x, 0.25, 0.125]), size);
        let octahedra = || (scaled(&octahedron(4.0), size), scaled(&octahedron(1.0), size));
        let ((outer, inner), gap) = (octahedra(), size * two(-20));
        cases.extend([
            ask("cubes, touching", cube(0.0), cube(1.0)).touching(62),
            ask("cubes, 2^-20 of their side apart", cube(0.0), cube(1.0 + two(-20)))
                .apart(gap, "from face to face"),
            ask("cubes, 2^-20 of their side deep", cube(0.0), cube(1.0 - two(-20))).touching(52),
            ask("an octahedron in another", outer.clone(), inner).above(1.7320508075688772 * size),
            ask("tilted triangles, apart", tilted(size), tilted(size))
                .moved([0.0, 0.0, size])
                .above(0.7896307495304999 * size),
            ask("the same octahedra", outer.clone(), outer).touching(56),
        ]);
    }
    cases
}

fn unequal() -> Vec<Case> {
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("unequal sizes", name, UNEQUAL, a, b);
    let wall = || scaled(&[[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]]], two(50));
    let speck = |x: f64, z: f64| scaled(&moved(&unit_cube(), [x, 0.0, z]), two(-66));
    vec![
        ask("a speck on a wall", wall(), speck(0.0, 0.0)).touching(10),
        ask("a speck its size above a wall", wall(), speck(0.0, 1.0))
            .apart(two(-66), "straight down to the wall"),
        ask("a speck halfway through a wall", wall(), speck(0.0, -0.5)).touching(8),
        ask("a speck in a hall", scaled(&cube(), two(50)), speck(0.0, 0.0))
            .moved([two(50) - two(10), 0.0, 0.0])
            .above(1024.0),
    ]
}

fn mixed() -> Vec<Case> {
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("mixed scales", name, MIXED, a, b);
    // Cubes of sides 2, 2^-11, 2^-23 and so on around the origin.
    let shells = |from: i32| (0..5).flat_map(|k| scaled(&cube(), two(from - 12 * k))).collect::<Vec<_>>();
    let dust = |z: f64| {
        let speck = moved(&unit_cube(), [0.0, 0.0, z]);
        joined(scaled(&speck, two(-60)), moved(&crowd(0.0), [0.0, 0.0, if z < 0.0 { -4.0 } else { 4.0 }]))
    };
    vec![
        ask("shells of all scales between each other", shells(0), shells(-6))
            .apart(two(-48) - two(-54), "between the two innermost shells"),
        ask("shells of all scales, the same", shells(0), shells(0)).touching(540),
        ask("shells of all scales, the innermost in contact", shells(0), shells(-6))
            .moved([two(-48) - two(-54), 0.0, 0.0])
            .touching(18),
        ask("dust on dust under large triangles", dust(-1.0), dust(0.0)).touching(62),
        ask("dust beside dust under large triangles", dust(-1.0), dust(0.0))
            .moved([0.0, 0.0, two(-70)])
            .apart(two(-70), "from face to face"),
    ]
}

fn subnormal() -> Vec<Case> {
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("subnormal", name, SUBNORMAL, a, b);
    let units = |t: &[Triangle]| scaled(t, two(-149));
    let face: Triangle = [[0.0; 3], [8.0, 0.0, 1.0], [0.0, 8.0, 2.0]];
    let through: Triangle = [[1.0, 1.0, -4.0], [2.0, 2.0, 5.0], [1.0, 2.0, 5.0]];
    let beside: Triangle = [[4.0, 4.0, 2.0], [4.0, 4.0, 9.0], [5.0, 7.0, 9.0]];
    vec![
        ask("one through another", units(&[face]), units(&[through])).touching(1),
        ask("over another", units(&[face]), units(&[beside])).above(6.9792825399138576e-46),
        ask("cubes of side 1, touching", units(&unit_cube()), units(&moved(&unit_cube(), [1.0, 0.0, 0.0])))
            .touching(62),
        ask(
            "cubes of side 1, a unit apart",
            units(&unit_cube()),
            units(&moved(&unit_cube(), [2.0, 0.0, 0.0])),
        )
        .apart(two(-149), "from face to face"),
        ask("an octahedron in another", units(&octahedron(9.0)), units(&octahedron(2.0)))
            .above(5.663280319150595e-45),
        ask("the same octahedra", units(&octahedron(5.0)), units(&octahedron(5.0))).touching(56),
    ]
}

fn half_precision() -> Vec<Case> {
    let mut cases = Vec::new();
    for exponent in [16, 20, 40] {
        let size = two(exponent);
        let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| {
            question("range of f16", format!("{name}, size 2^{exponent}"), OVER, a, b)
        };
        let mesh =
            |z: f64| joined(scaled(&crowd(z / size * 8.0), size / 8.0), moved(&unit_cube(), [0.0, 0.0, z]));
        cases.push(
            ask("a small cube among large triangles", mesh(0.0), mesh(0.0))
                .moved([0.25, 0.25, 1.0])
                .touching(15),
        );
        cases.push(
            ask("a small cube over large triangles", scaled(&crowd(0.0), size / 8.0), unit_cube())
                .moved([size / 32.0, -size * 3.0 / 32.0, two(-10)])
                .apart(two(-10), "straight down to a face"),
        );
    }
    let edge = |reach: f64| [[reach, 0.0, 0.0], [-reach, 0.0, 0.0], [0.0, reach, 0.0]];
    for reach in [65504.0, 65505.0, 65520.0, 65536.0] {
        let ask = question(
            "range of f16",
            format!("from -{reach} to {reach}"),
            OVER,
            vec![edge(reach)],
            vec![edge(reach)],
        );
        cases.push(ask.moved([0.0, 0.0, two(-10)]).apart(two(-10), "one is a lifted copy of the other"));
    }
    for exponent in [-24, -25, -40] {
        let size = two(exponent);
        let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| {
            question("range of f16", format!("{name}, size 2^{exponent}"), UNDER, a, b)
        };
        let small = |z: f64| {
            joined(
                scaled(&moved(&unit_cube(), [0.0, 0.0, z]), size),
                vec![edge(1.0).map(|[x, y, _]| [x, y - 2.0, z])],
            )
        };
        cases.push(ask("tiny cubes beside large triangles, touching", small(-1.0), small(0.0)).touching(62));
        cases.push(
            ask("tiny cubes beside large triangles, a size apart", small(-1.0), small(1.0))
                .apart(size, "from face to face"),
        );
        cases.push(
            ask("tiny cubes alone", scaled(&unit_cube(), size), scaled(&unit_cube(), size))
                .moved([2.0 * size, 0.0, 0.0])
                .apart(size, "from face to face"),
        );
    }
    cases
}
