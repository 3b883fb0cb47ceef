//! Poses that rotate by almost nothing, by almost half a turn, or by angles without exact sines.
//!
//! These poses round the corners that they place, so all cases are well on one side of contact.

use super::shapes::{axes, cube, cuboid, moved, octahedron, plate, two};
use super::{Case, question};
use crate::Triangle;

const SLIGHT: &str =
    "the pose turns by 1e-9 rad: planes are nearly parallel, and single precision loses the turn";
const HALF: &str =
    "the pose turns by half a turn less 1e-9 rad: planes are nearly parallel, with opposite normals";
const ANY: &str = "the rotation has the entries 0.6 and 0.8, so the placed corners are rounded";

const ANGLE: f64 = 1e-9;
/// The cosine of 1e-9 is 1 to the last bit.
const SLIGHTLY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, -ANGLE], [0.0, ANGLE, 1.0]];
const ALMOST_HALF: [[f64; 3]; 3] = [[-1.0, -ANGLE, 0.0], [ANGLE, -1.0, 0.0], [0.0, 0.0, 1.0]];
const BACKWARD: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, -1.0, -ANGLE], [0.0, ANGLE, -1.0]];
const PYTHAGORAS: [[f64; 3]; 3] = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn cases() -> Vec<Case> {
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("turned by 1e-9", name, SLIGHT, a, b);
    let high = [0.0, 0.0, two(-20)];
    let mut cases = vec![
        ask("plates 2^-20 apart", plate(4), plate(4)).turned(SLIGHTLY).moved(high).above(9.5367431640625e-7),
        ask(
            "plates that cross at 1e-9",
            moved(&plate(4), [-2.0, -2.0, 0.0]),
            moved(&plate(4), [-2.0, -2.0, 0.0]),
        )
        .turned(SLIGHTLY)
        .moved([0.25, 0.25, two(-31)])
        .touching(14),
        ask("plates beyond where they would cross", plate(4), plate(4))
            .turned(SLIGHTLY)
            .moved([0.25, 0.25, two(-33)])
            .above(1.1641532182693481e-10),
        ask("cubes 2^-20 apart", cube(), cube())
            .turned(SLIGHTLY)
            .moved([0.25, 0.5, 2.0 + two(-20)])
            .above(9.526743163235096e-7),
        ask("cubes, edges 2^-31 deep", cube(), cube()).turned(SLIGHTLY).moved([0.25, 0.5, 2.0]).touching(9),
        ask("a cube in a cube", cuboid([-2.0; 3], [2.0; 3]), cube())
            .turned(SLIGHTLY)
            .above(0.9999999989999999),
        ask("the same cubes", cube(), cube()).turned(SLIGHTLY).touching(56),
    ];
    let ask =
        |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("half a turn less 1e-9", name, HALF, a, b);
    let upright = || axes(&moved(&plate(4), [-2.0, -2.0, 0.0]), [2, 0, 1]);
    cases.extend([
        ask("plates 2^-20 apart", upright(), upright())
            .turned(ALMOST_HALF)
            .moved([two(-20), 0.25, 0.0])
            .above(9.5167431640625e-7),
        ask("plates that cross at 1e-9", upright(), upright())
            .turned(ALMOST_HALF)
            .moved([two(-31), 0.25, 0.25])
            .touching(14),
        ask("a plate turned over, 2^-20 apart", plate(4), plate(4))
            .turned(BACKWARD)
            .moved([0.0, 4.0, two(-20)])
            .above(9.5367431640625e-7),
        ask("cubes 2^-20 apart", cube(), cube())
            .turned(ALMOST_HALF)
            .moved([2.0 + two(-20), 0.5, 0.25])
            .above(9.526743163235096e-7),
        ask("cubes, edges 2^-31 deep", cube(), cube())
            .turned(ALMOST_HALF)
            .moved([2.0, 0.5, 0.25])
            .touching(9),
        ask("a cube in a cube", cuboid([-2.0; 3], [2.0; 3]), cube())
            .turned(ALMOST_HALF)
            .above(0.9999999989999999),
    ]);
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("any turn", name, ANY, a, b);
    cases.extend([
        ask("a cube's edge 2^-20 off a face", cube(), cube())
            .turned(PYTHAGORAS)
            .moved([2.4 + two(-20), 0.2, 0.25])
            .above(9.5367431640625e-07),
        ask("a cube's edge 2^-20 in a face", cube(), cube())
            .turned(PYTHAGORAS)
            .moved([2.4 - two(-20), 0.2, 0.25])
            .touching(9),
        ask("an octahedron in a cube, tips 2^-20 short", cube(), octahedron(1.0 - two(-20)))
            .turned(PYTHAGORAS)
            .above(9.5367431640625e-7),
        ask("two octahedra", octahedron(1.0), octahedron(1.0))
            .turned(PYTHAGORAS)
            .moved([2.0, 0.0, 0.0])
            .above(0.2828427124746189),
    ]);
    cases
}
