//! Pairs whose pose rounds a corner that it places, so that the public suite cannot hold them.
//!
//! The corners that decide are far enough from the border of contact, or are not rounded: the truth is the same in whatever way the
//! others are.

use super::case::{Case, Question, question};
use super::shapes::{axes, crowd, cube, cuboid, joined, moved, octahedron, plate, scaled, two, unit_cube};
use cbvh_testkit::Triangle;

const ANGLE: f64 = 1e-9;
/// The cosine of 1e-9 is 1 to the last bit.
const SLIGHTLY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, -ANGLE], [0.0, ANGLE, 1.0]];
const ALMOST_HALF: [[f64; 3]; 3] = [[-1.0, -ANGLE, 0.0], [ANGLE, -1.0, 0.0], [0.0, 0.0, 1.0]];
const BACKWARD: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, -1.0, -ANGLE], [0.0, ANGLE, -1.0]];
const PYTHAGORAS: [[f64; 3]; 3] = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn cases() -> Vec<Case> {
    [shifted(), turned()].concat()
}

fn ask(kind: &str, name: &str, a: Vec<Triangle>, b: Vec<Triangle>) -> Question {
    question(format!("{kind}: {name}"), a, b)
}

/// One unit in the last place of the pose decides whether the meshes touch, or triangles are of very different sizes.
fn shifted() -> Vec<Case> {
    let mut cases = Vec::new();
    for exponent in [0, -10, 20] {
        let size = two(exponent);
        let unit = size * two(-52);
        let cubes = |what: &str| {
            let cube = || cuboid([0.0; 3], [size; 3]);
            ask("one unit", &format!("cubes of side 2^{exponent}, {what}"), cube(), cube())
        };
        let to = |x: f64| [x, size / 4.0, size / 8.0];
        cases.push(cubes("a unit apart").moved(to(size + unit)).exactly(unit));
        cases.push(cubes("half a unit deep").moved(to(size - unit / 2.0)).touching(10));
    }
    let unit = two(-52);
    let octahedra = |what: &str| ask("one unit: octahedra", what, octahedron(1.0), octahedron(1.0));
    // The coordinates of B are far away, and the pose brings B back.
    let brought = |what: &str| ask("brought from 1024", what, unit_cube(), moved(&unit_cube(), [1024.0; 3]));
    let far = two(-43);
    let speck = || scaled(&unit_cube(), two(-66));
    let dust = |z: f64| {
        let speck = moved(&unit_cube(), [0.0, 0.0, z]);
        joined(scaled(&speck, two(-60)), moved(&crowd(0.0), [0.0, 0.0, if z < 0.0 { -4.0 } else { 4.0 }]))
    };
    cases.extend([
        octahedra("face a unit from face").moved([0.75, 0.75, 0.5 + unit / 2.0]).above(6.409875621278546e-17),
        octahedra("face half a unit deep").moved([0.75, 0.75, 0.5 - unit / 4.0]).touching(12),
        brought("a unit apart").moved([-1023.0 + far, -1024.0, -1024.0]).exactly(far),
        brought("a unit deep").moved([-1023.0 - far, -1024.0, -1024.0]).touching(52),
        ask("unequal sizes", "a speck in a hall", scaled(&cube(), two(50)), speck())
            .moved([two(50) - two(10), 0.0, 0.0])
            .above(1024.0),
        ask("mixed scales", "dust beside dust under large triangles", dust(-1.0), dust(0.0))
            .moved([0.0, 0.0, two(-70)])
            .exactly(two(-70)),
    ]);
    cases
}

/// A pose turns by almost nothing or almost half a turn, so that planes are nearly parallel, or by an angle without exact sines.
fn turned() -> Vec<Case> {
    let slightly = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| ask("turned by 1e-9", name, a, b);
    let high = [0.0, 0.0, two(-20)];
    let mut cases = vec![
        slightly("plates 2^-20 apart", plate(4), plate(4))
            .turned(SLIGHTLY)
            .moved(high)
            .above(9.5367431640625e-7),
        slightly("plates beyond where they would cross", plate(4), plate(4))
            .turned(SLIGHTLY)
            .moved([0.25, 0.25, two(-33)])
            .above(1.1641532182693481e-10),
        slightly("cubes 2^-20 apart", cube(), cube())
            .turned(SLIGHTLY)
            .moved([0.25, 0.5, 2.0 + two(-20)])
            .above(9.526743163235096e-7),
        slightly("cubes, edges 2^-31 deep", cube(), cube())
            .turned(SLIGHTLY)
            .moved([0.25, 0.5, 2.0])
            .touching(9),
        slightly("a cube in a cube", cuboid([-2.0; 3], [2.0; 3]), cube())
            .turned(SLIGHTLY)
            .above(0.9999999989999999),
        slightly("the same cubes", cube(), cube()).turned(SLIGHTLY).touching(56),
    ];
    let half = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| ask("half a turn less 1e-9", name, a, b);
    let upright = || axes(&moved(&plate(4), [-2.0, -2.0, 0.0]), [2, 0, 1]);
    cases.extend([
        half("plates 2^-20 apart", upright(), upright())
            .turned(ALMOST_HALF)
            .moved([two(-20), 0.25, 0.0])
            .above(9.5167431640625e-7),
        half("a plate turned over, 2^-20 apart", plate(4), plate(4))
            .turned(BACKWARD)
            .moved([0.0, 4.0, two(-20)])
            .above(9.5367431640625e-7),
        half("cubes 2^-20 apart", cube(), cube())
            .turned(ALMOST_HALF)
            .moved([2.0 + two(-20), 0.5, 0.25])
            .above(9.526743163235096e-7),
        half("cubes, edges 2^-31 deep", cube(), cube())
            .turned(ALMOST_HALF)
            .moved([2.0, 0.5, 0.25])
            .touching(9),
        half("a cube in a cube", cuboid([-2.0; 3], [2.0; 3]), cube())
            .turned(ALMOST_HALF)
            .above(0.9999999989999999),
    ]);
    let any = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| ask("any turn", name, a, b);
    cases.extend([
        any("a cube's edge 2^-20 off a face", cube(), cube())
            .turned(PYTHAGORAS)
            .moved([2.4 + two(-20), 0.2, 0.25])
            .above(9.5367431640625e-07),
        any("a cube's edge 2^-20 in a face", cube(), cube())
            .turned(PYTHAGORAS)
            .moved([2.4 - two(-20), 0.2, 0.25])
            .touching(9),
        any("an octahedron in a cube, tips 2^-20 short", cube(), octahedron(1.0 - two(-20)))
            .turned(PYTHAGORAS)
            .above(9.5367431640625e-7),
        any("two octahedra", octahedron(1.0), octahedron(1.0))
            .turned(PYTHAGORAS)
            .moved([2.0, 0.0, 0.0])
            .above(0.2828427124746189),
    ]);
    cases
}
