//! Meshes of triangles in one plane, or in parallel planes.

use super::shapes::{axes, moved, plate, scaled, two};
use super::{Case, question};
use crate::Triangle;
// The f64 nearest to the root of 2 is above the root.
use std::f64::consts::SQRT_2;

const PLANE: &str =
    "in one plane nothing is above or below: signs are zero, and overlap must be decided in 2D";
const SLANT: &str =
    "in a slanted plane, heights are zero because terms cancel, not because coordinates are equal";
const PARALLEL: &str =
    "the planes are parallel, so no corner or edge is nearer to the other plane than the rest";

/// Returns a point in the plane x + y + z = 0.
fn slanted(x: f64, y: f64) -> [f64; 3] {
    [x, y, -x - y]
}

pub(super) fn cases() -> Vec<Case> {
    let kind = "coplanar";
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question(kind, name, PLANE, a, b);
    let corner = [[0.0; 3], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0]];
    let small = [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0]];
    let opposite = |gap: f64| [[8.0 + gap, 8.0, 0.0], [gap, 8.0, 0.0], [8.0 + gap, 0.0, 0.0]];
    let star = [[3.0, 3.0, 0.0], [-5.0, 3.0, 0.0], [3.0, -5.0, 0.0]];
    let upright = |mesh: Vec<Triangle>| axes(&mesh, [2, 0, 1]);
    let mut cases = vec![
        ask("one within the other", vec![corner], vec![small]).touching(1),
        ask("a star of two", vec![corner], vec![star]).touching(1),
        ask("they share an edge", vec![corner], vec![opposite(0.0)]).touching(1),
        ask("they share a corner", vec![corner], vec![moved(&[corner], [8.0, 0.0, 0.0])[0]]).touching(1),
        ask("edges overlap on one line", vec![corner], vec![corner.map(|[x, y, z]| [x + 5.0, -y, z])])
            .touching(1),
        ask("slanted edges apart", vec![corner], vec![opposite(two(-10))]).above(0.0006905339660024878),
        ask("straight edges apart", vec![corner], moved(&[corner], [0.0, -8.0 - two(-20), 0.0]))
            .apart(two(-20), "corner to edge along y"),
        ask("two plates overlap", plate(4), moved(&plate(4), [0.5, 0.25, 0.0])).touching(129),
        ask("two plates share an edge", plate(4), moved(&plate(4), [4.0, 0.0, 0.0])).touching(27),
        ask("two plates share a corner", plate(4), moved(&plate(4), [4.0, 4.0, 0.0])).touching(1),
        ask("two plates side by side", plate(4), moved(&plate(4), [4.0 + two(-10), 0.5, 0.0]))
            .apart(two(-10), "from edge to parallel edge"),
        ask(
            "two plates corner to corner",
            plate(4),
            moved(&plate(4), [4.0 + 3.0 * two(-10), 4.0 + two(-8), 0.0]),
        )
        .apart(5.0 * two(-10), "2^-10 times the hypotenuse of 3 and 4, from corner to corner"),
        ask("two plates in x, 2^-149 apart", upright(plate(4)), {
            moved(&upright(plate(4)), [two(-149), 0.5, 0.25])
        })
        .apart(two(-149), "from plane to plane"),
    ];
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question(kind, name, SLANT, a, b);
    let large = [slanted(0.0, 0.0), slanted(1.0, 7.0), slanted(9.0, 2.0)];
    let inside = [slanted(3.0, 3.0), slanted(4.0, 3.0), slanted(3.0, 4.0)];
    let outside = [slanted(-1.0, 0.0), slanted(-3.0, 1.0), slanted(-2.0, -5.0)];
    cases.extend([
        ask("slanted, one within the other", vec![large], vec![inside]).touching(1),
        ask("slanted, sharing an edge", vec![large], vec![[large[0], large[1], slanted(-3.0, 2.0)]])
            .touching(1),
        ask("slanted, apart", vec![large], vec![outside]).above(SQRT_2.next_down()),
        ask("slanted, one within the other, 2^-40 as large", scaled(&[large], two(-40)), {
            scaled(&[inside], two(-40))
        })
        .touching(1),
    ]);
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("parallel", name, PARALLEL, a, b);
    let at = |x: f64, y: f64, z: f64| moved(&plate(4), [x, y, z]);
    cases.extend([
        ask("plates a unit of f32 apart", at(0.0, 0.0, 1.0), at(0.5, 0.25, 1.0 + two(-23)))
            .apart(two(-23), "from plane to plane"),
        ask("plates a unit of f64 apart", plate(4), plate(4))
            .moved([0.5, 0.25, two(-52)])
            .apart(two(-52), "from plane to plane"),
        ask("a plate beside the edge of another", plate(4), plate(4))
            .moved([7.0, 0.5, 4.0])
            .apart(5.0, "the hypotenuse of 3 and 4, from edge to edge"),
        ask("slanted, 2^-20 of z apart", vec![large], vec![inside])
            .moved([0.0, 0.0, two(-20)])
            .above(5.506041232963807e-7),
    ]);
    cases
}
