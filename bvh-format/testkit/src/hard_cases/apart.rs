//! Meshes that are one rounding unit to either side of contact, in f64 and in f32.

use super::shapes::{crowd, cuboid, joined, moved, octahedron, two, unit_cube};
use super::{Case, question};
use crate::Triangle;

const UNIT: &str = "one unit in the last place of the pose decides whether the meshes touch";
const STORED: &str = "one unit in the last place of an f32 coordinate decides whether the meshes touch";
const CANCEL: &str = "the gap is the small difference of two large numbers";

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for exponent in [0, -10, 20] {
        let size = two(exponent);
        let unit = size * two(-52);
        let cube = || cuboid([0.0; 3], [size; 3]);
        let ask = |what: &str| {
            question("one unit", format!("cubes of side 2^{exponent}, {what}"), UNIT, cube(), cube())
        };
        let to = |x: f64| [x, size / 4.0, size / 8.0];
        cases.push(ask("touching").moved(to(size)).touching(13));
        cases.push(ask("a unit apart").moved(to(size + unit)).apart(unit, "from face to face"));
        cases.push(ask("half a unit deep").moved(to(size - unit / 2.0)).touching(10));
    }
    let unit = two(-23);
    let ask = |what: &str, by: f64| {
        let (a, b) =
            (joined(unit_cube(), crowd(-8.0)), joined(cuboid([0.25, 0.5, by], [1.25, 1.5, 2.0]), crowd(8.0)));
        question("one unit", format!("cubes in f32, {what}"), STORED, a, b)
    };
    cases.push(ask("touching", 1.0).touching(13));
    cases.push(ask("a unit apart", 1.0 + unit).apart(unit, "from face to face"));
    cases.push(ask("half a unit deep", 1.0 - unit / 2.0).touching(10));
    // Corners meet along a diagonal.
    let unit = two(-52);
    let ask = |what: &str| {
        question("one unit", format!("octahedra, {what}"), UNIT, octahedron(1.0), octahedron(1.0))
    };
    cases.push(ask("tip on tip").moved([0.0, 0.0, 2.0]).touching(16));
    cases
        .push(ask("tip a unit from tip").moved([0.0, 0.0, 2.0 + 2.0 * unit]).apart(2.0 * unit, "tip to tip"));
    cases.push(ask("face on face").moved([0.75, 0.75, 0.5]).touching(13));
    cases.push(
        ask("face a unit from face").moved([0.75, 0.75, 0.5 + unit / 2.0]).above(6.409875621278546e-17),
    );
    cases.push(ask("face half a unit deep").moved([0.75, 0.75, 0.5 - unit / 4.0]).touching(12));
    // The coordinates of B are far away, and the pose brings B back.
    let away = moved(&unit_cube(), [1024.0; 3]);
    let ask = |what: &str| {
        question("one unit", format!("brought from 1024, {what}"), CANCEL, unit_cube(), away.clone())
    };
    let unit = two(-43);
    cases.push(ask("touching").moved([-1023.0, -1024.0, -1024.0]).touching(62));
    cases
        .push(ask("a unit apart").moved([-1023.0 + unit, -1024.0, -1024.0]).apart(unit, "from face to face"));
    cases.push(ask("a unit deep").moved([-1023.0 - unit, -1024.0, -1024.0]).touching(52));
    // The gaps are far below all units of the coordinates and yet exact, because B's plane is at 0.
    let flat: Triangle = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for exponent in [-60, -100, -149, -200] {
        let ask = question("one unit", format!("triangles 2^{exponent} apart"), UNIT, vec![flat], vec![flat]);
        cases.push(
            ask.moved([0.0, 0.0, two(exponent)]).apart(two(exponent), "one is a lifted copy of the other"),
        );
    }
    cases
}
