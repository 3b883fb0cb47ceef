//! Meshes of triangles without area, which are points or segments, and of slivers, which are nearly segments.

use super::shapes::{crowd, joined, scaled, two};
use super::{Case, question};
use crate::Triangle;
// The f64 nearest to the root of 2 is above the root.
use std::f64::consts::SQRT_2;

const POINT: &str = "a triangle with three equal corners is a point and has neither a normal nor edges";
const SEGMENT: &str = "a triangle with three collinear corners is a segment and has no normal";
const SLIVER: &str = "a triangle is 17 million times as long as wide: single precision loses its normal";

const FACE: Triangle = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

fn point(p: [f64; 3]) -> Triangle {
    [p; 3]
}

/// Returns a segment from p to q as a triangle. `place` is the place of the corner in the middle.
fn segment(p: [f64; 3], q: [f64; 3], place: usize) -> Triangle {
    let middle = [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0);
    [[middle, p, q], [p, middle, q], [p, q, middle]][place]
}

pub(super) fn cases() -> Vec<Case> {
    [points(), segments(), slivers()].concat()
}

fn points() -> Vec<Case> {
    let kind = "zero area: points";
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question(kind, name, POINT, a, b);
    let cloud = |start: f64| -> Vec<Triangle> {
        let at = |k: usize| [k % 3, k / 3 % 3, k / 9].map(|i| i as f64 + start);
        (0..27).map(|k| point(at(k))).collect()
    };
    vec![
        ask("a point in a face", vec![FACE], vec![point([1.0, 1.0, 0.0])]).touching(1),
        ask("a point on an edge", vec![FACE], vec![point([2.0, 2.0, 0.0])]).touching(1),
        ask("a point on a corner", vec![FACE], vec![point([4.0, 0.0, 0.0])]).touching(1),
        ask("a point 2^-30 above a face", vec![FACE], vec![point([1.0, 1.0, two(-30)])])
            .apart(two(-30), "straight down to the face"),
        ask("a point 5 beside a corner", vec![FACE], vec![point([7.0, 0.0, 4.0])])
            .apart(5.0, "the hypotenuse of 3 and 4, to the corner"),
        ask("a point on a point", vec![point([1.0, 2.0, 3.0])], vec![point([1.0, 2.0, 3.0])]).touching(1),
        ask("a point beside a point", vec![point([1.0, 2.0, 3.0])], vec![point([1.0, 2.0, 3.0 + two(-20)])])
            .apart(two(-20), "the points differ only in z"),
        ask("27 points and 27 between them", cloud(0.0), cloud(0.5)).above(0.8660254037844386),
        ask("27 points and the same points", cloud(0.0), cloud(0.0)).touching(27),
        ask(
            "a point in a face, among others",
            joined(crowd(-8.0), vec![FACE]),
            joined(vec![point([1.0, 1.0, 0.0])], crowd(8.0)),
        )
        .touching(1),
    ]
}

fn segments() -> Vec<Case> {
    let kind = "zero area: segments";
    let ask =
        |name: &str, a: Triangle, b: Triangle| question(kind, name.to_owned(), SEGMENT, vec![a], vec![b]);
    let (left, right) = ([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let mut cases = Vec::new();
    for (place, which) in ["first", "second", "third"].into_iter().enumerate() {
        let across = segment([0.5, -1.0, 0.0], [0.5, 3.0, 0.0], place);
        cases.push(
            ask(&format!("across a segment, middle corner {which}"), segment(left, right, 2), across)
                .touching(1),
        );
        cases.push(
            ask(
                &format!("over a segment, middle corner {which}"),
                segment(left, right, place),
                segment([0.5, -1.0, two(-30)], [0.5, 3.0, two(-30)], place),
            )
            .apart(two(-30), "straight down where they cross as seen from above"),
        );
    }
    let straight = segment(left, right, 1);
    cases.extend([
        ask("through a face", FACE, segment([1.0, 1.0, -3.0], [1.0, 1.0, 5.0], 1)).touching(1),
        ask("down to a face", FACE, segment([1.0, 1.0, 0.0], [1.0, 2.0, 4.0], 1)).touching(1),
        ask("in a face", FACE, segment([1.0, 1.0, 0.0], [2.0, 1.0, 0.0], 1)).touching(1),
        ask("along an edge of a face", FACE, segment([1.0, 0.0, 0.0], [9.0, 0.0, 0.0], 1)).touching(1),
        ask("past a corner of a face", FACE, segment([4.0, -3.0, 3.0], [4.0, -3.0, -5.0], 1))
            .apart(3.0, "straight along y to the corner"),
        ask("end to end", straight, segment(right, [3.0, 4.0, 0.0], 1)).touching(1),
        ask("on one line, overlapping", straight, segment([0.5, 0.0, 0.0], [8.0, 0.0, 0.0], 0)).touching(1),
        ask("on one line, 2^-20 apart", straight, segment([1.0 + two(-20), 0.0, 0.0], [8.0, 0.0, 0.0], 0))
            .apart(two(-20), "end to end along x"),
        ask("parallel, 5 apart", straight, segment([-7.0, 3.0, 4.0], [7.0, 3.0, 4.0], 1))
            .apart(5.0, "the hypotenuse of 3 and 4, straight across"),
        ask("skew", straight, segment([0.0, 1.0, 1.0], [1.0, 2.0, 3.0], 1)).above(SQRT_2.next_down()),
    ]);
    cases
}

fn slivers() -> Vec<Case> {
    let kind = "slivers";
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question(kind, name, SLIVER, a, b);
    let width = two(-24);
    let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.5, width, 0.0]];
    let upright = |y: f64| [[0.5, y, -1.0], [0.5, y, 1.0], [0.5 + width, y, 0.0]];
    let lifted = flat.map(|[x, y, _]| [x, y, width]);
    let oblique = [[0.0; 3], [1.0, 1.0, 1.0], [0.5, 0.5, 0.5 + width]];
    let crossing = |z: f64| [[0.0, 1.0, z], [1.0, 0.0, z], [0.5, 0.5 + width, z]];
    let fan = |z: f64| -> Vec<Triangle> {
        let rim = |k: usize| [1.0, k as f64 * width, z];
        (0..24).map(|k| [[0.0, 0.0, z], rim(k), rim(k + 1)]).collect()
    };
    vec![
        ask("one through another", vec![flat], vec![upright(width / 4.0)]).touching(1),
        ask("2^-30 beside the tip", vec![flat], vec![upright(width + two(-30))])
            .apart(two(-30), "from the tip straight to the edge beside it"),
        ask("at the tip", vec![flat], vec![upright(width)]).touching(1),
        ask("as far apart as wide", vec![flat], vec![lifted])
            .apart(width, "one is a lifted copy of the other"),
        ask("across on the slant", vec![oblique], vec![crossing(0.5)]).touching(1),
        ask("past each other on the slant", vec![oblique], vec![crossing(1.0)]).above(0.4082482336857107),
        ask("two fans, one in the other's plane", fan(0.0), fan(0.0)).touching(576),
        ask("two fans, lifted by their width", fan(0.0), fan(width))
            .apart(width, "one is a lifted copy of the other"),
        ask(
            "one through another, 2^40 as large",
            scaled(&[flat], two(40)),
            scaled(&[upright(width / 4.0)], two(40)),
        )
        .touching(1),
        ask("one through another, among others", joined(crowd(-8.0), vec![flat]), {
            joined(crowd(8.0), vec![upright(width / 4.0)])
        })
        .touching(1),
    ]
}
