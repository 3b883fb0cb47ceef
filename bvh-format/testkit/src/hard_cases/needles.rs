//! Meshes of needles that go through each other, past each other, or through the eye of a ring.

use super::shapes::{axes, crowd, joined, moved, needle, octahedron, two};
use super::{Case, question};
use crate::Triangle;

const NEEDLE: &str =
    "a needle is two million times as long as thick: slabs overlap along all directions, few triangles meet";
const EYE: &str = "the needle's box crosses the ring's box, but the ring is open in the middle";

pub(super) fn cases() -> Vec<Case> {
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("needles", name, NEEDLE, a, b);
    let half = two(-18);
    let upright = || needle([0.0, 0.0, -8.0], [0.0, 0.0, 8.0], half);
    let along_x = || axes(&upright(), [2, 0, 1]);
    let slanted = |x: f64| needle([-8.0 + x, -8.0, -8.0], [8.0 + x, 8.0, 8.0], half);
    let ring = |reach: f64| -> Vec<Triangle> {
        let rim = |k: usize, far: f64| {
            [[far, 0.0, 0.0], [0.0, far, 0.0], [-far, 0.0, 0.0], [0.0, -far, 0.0]][k % 4]
        };
        (0..4)
            .flat_map(|k| {
                let (p, q) = (rim(k, reach), rim(k + 1, reach));
                [[p, q, rim(k, 4.0)], [q, rim(k, 4.0), rim(k + 1, 4.0)]]
            })
            .collect()
    };
    let mut cases = vec![
        ask("one through another", upright(), along_x()).touching(14),
        ask("one through another on the slant", upright(), slanted(0.0)).touching(16),
        ask("one past another", upright(), along_x()).moved([0.0, two(-16), 0.0]).above(1.144409088737943e-5),
        ask("one past another, by less than a thousandth of its width", upright(), along_x())
            .moved([0.0, two(-18) + two(-28), 0.0])
            .above(3.7243808035430885e-9),
        ask("one past another on the slant", upright(), slanted(two(-15))).above(1.6184379538422608e-5),
        ask("tip to tip", upright(), needle([0.0, 0.0, 24.0], [0.0, 0.0, 8.0], half)).touching(16),
        ask("tip short of tip by 2^-40", upright(), needle([0.0, 0.0, 24.0], [0.0, 0.0, 8.0], half))
            .moved([0.0, 0.0, two(-40)])
            .apart(two(-40), "tip to tip"),
        ask("tip in a face", octahedron(8.0), needle([8.0, 8.0, 8.0], [3.0, 3.0, 2.0], half)).touching(4),
        ask(
            "through a face, among others",
            joined(crowd(-0.5), vec![]),
            moved(&upright(), [-7.75, -4.75, 0.0]),
        )
        .touching(4),
    ];
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("needles", name, EYE, a, b);
    cases.extend([
        ask("through an eye 16 times as wide", ring(two(-14)), upright()).above(4.046097457045597e-5),
        ask("through an eye just as wide", ring(two(-18)), upright()).touching(8),
        ask("through an eye, off the middle", ring(two(-14)), upright())
            .moved([two(-15), 0.0, 0.0])
            .above(1.8881788132879452e-5),
    ]);
    cases
}
