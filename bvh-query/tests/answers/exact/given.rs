//! Asks about meshes in numbers that people write: decimals of any digits, `f32` printed with nine, results of computations.
//!
//! The truth is about the numbers given, not about what a file stores of them. Meshes share corners, edges and faces by
//! construction, or are a unit in the last place off.

use super::ask::Asked;
use super::kinds::exact_turns;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{Random, Stored, Triangle, bake, mesh, queriers, stored};
use bvh_bake::Options;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::vertex::LEAST_UNIT;
use bvh_query::{Pose, Side};
use cbvh_testkit::depth::rounds;

/// How a number is written.
#[derive(Clone, Copy, Debug)]
enum Style {
    /// Digits after the point.
    After(usize),
    /// Significant digits.
    Significant(usize),
    /// An `f32`, printed with nine digits.
    NineOfF32,
    /// An `f32` in as few digits as tell it apart.
    ShortestOfF32,
    /// An `f32` times a thousandth.
    Scaled,
    /// An `f32`.
    F32,
    /// Any `f64`.
    F64,
    /// Six digits, or noise of 1e-17.
    Noisy,
}

const STYLES: [Style; 14] = [
    Style::After(1),
    Style::After(3),
    Style::After(6),
    Style::After(9),
    Style::After(15),
    Style::Significant(6),
    Style::Significant(7),
    Style::Significant(12),
    Style::NineOfF32,
    Style::ShortestOfF32,
    Style::Scaled,
    Style::F32,
    Style::F64,
    Style::Noisy,
];

fn parsed(text: &str) -> f64 {
    text.parse().unwrap()
}

/// Writes a number and reads it back.
fn written(style: Style, value: f64, random: &mut Random) -> f64 {
    match style {
        Style::After(digits) => parsed(&format!("{value:.digits$}")),
        Style::Significant(digits) => parsed(&format!("{value:.*e}", digits - 1)),
        Style::NineOfF32 => parsed(&format!("{:.8e}", f64::from(value as f32))),
        Style::ShortestOfF32 => parsed(&format!("{:e}", value as f32)),
        Style::Scaled => f64::from((value * 1000.0) as f32) * 0.001,
        Style::F32 => f64::from(value as f32),
        Style::F64 => value,
        Style::Noisy if random.below(3) == 0 => 1e-17 * random.signed(),
        Style::Noisy => parsed(&format!("{value:.5e}")),
    }
}

/// Two meshes that share corners, whose triangles are given in one frame.
fn pair(style: Style, random: &mut Random) -> [Vec<Triangle>; 2] {
    let size = [0.01, 1.0, 300.0][random.below(3)];
    let centre = [0.0, 1.0, 100.3, 1e5, 1e6][random.below(5)] * size;
    let middle = random.point().map(|x| x * centre);
    let corner = |random: &mut Random| {
        let at = random.point();
        [0, 1, 2].map(|axis| written(style, middle[axis] + size * at[axis], random) + 0.0)
    };
    let pool: Vec<[f64; 3]> = (0..6).map(|_| corner(random)).collect();
    let triangles = |random: &mut Random| -> Vec<Triangle> {
        (0..1 + random.below(5))
            .map(|_| {
                [(); 3].map(|()| {
                    let shared = pool[random.below(pool.len())];
                    match random.below(8) {
                        0..=3 => shared,
                        // A unit in the last place off, along one axis.
                        4 => {
                            let axis = random.below(3);
                            let other = if random.below(2) == 0 { f64::next_up } else { f64::next_down };
                            // Beside 0, the unit of the format is the last place.
                            let beside =
                                |x: f64| if x == 0.0 { other(0.0).signum() * LEAST_UNIT } else { other(x) };
                            let off = |k: usize| if k == axis { beside(shared[k]) } else { shared[k] };
                            [0, 1, 2].map(off)
                        }
                        _ => corner(random),
                    }
                })
            })
            .collect()
    };
    [triangles(random), triangles(random)]
}

/// The triangles as they were given, in the order of their ids.
fn given(triangles: &[Triangle]) -> Surface {
    let numbered = (0..).zip(triangles).map(|(id, &corners)| Stored { object: 0, id, corners });
    Surface::new(numbered.collect())
}

/// Applies the inverse rotation, which is exact because these rotations are orthonormal to the bit.
fn apply_back(turn: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| turn[0][k] * p[0] + turn[1][k] * p[1] + turn[2][k] * p[2] + 0.0)
}

#[test]
fn questions_are_about_the_numbers_given() {
    let (mut tally, mut queriers, mut random) = (Tally::default(), queriers(), Random::new(64));
    let turns = exact_turns();
    for round in 0..rounds(40 * STYLES.len() as u64) as usize {
        let style = STYLES[round % STYLES.len()];
        let [a, b] = pair(style, &mut random);
        let turn = turns[random.below(24)];
        let b: Vec<Triangle> = b.iter().map(|t| t.map(|p| apply_back(turn, p))).collect();
        let encoding = [TriangleEncoding::F32, TriangleEncoding::Packed][round / STYLES.len() % 2];
        let surfaces = [&a, &b].map(|triangles| given(triangles));
        let files = [&a, &b].map(|t| bake(&mesh(t), &Options::default().triangles(encoding)));
        for (file, surface) in files.iter().zip(&surfaces) {
            let found = stored(file);
            assert_eq!(found.len(), surface.stored.len());
            for (found, expected) in found.iter().zip(&surface.stored) {
                let bits = |t: &Stored| t.corners.map(|corner| corner.map(f64::to_bits));
                let same = found.id == expected.id && same_corners(bits(found), bits(expected));
                assert!(same, "{style:?}: {found:?}, given {expected:?}");
            }
        }
        let pose = Pose::new(turn, [0.0; 3]).unwrap();
        let mut asked = Asked { a: &files[0], b: &files[1], queriers: &mut queriers };
        let mut check = |pose: &Pose| {
            let truth = Truth::new(&surfaces[0], &surfaces[1], pose);
            if let Err(error) = asked.all(&truth, pose, &mut tally) {
                tally.wrong(format!("{style:?}, round {round}, {encoding:?}: {error}"));
            }
        };
        check(&pose);
        // One unit beyond, and anywhere.
        let near = a[0][0].map(|x| x.abs().next_up() - x.abs());
        check(&Pose::new(turn, near).unwrap());
        let far = Pose::new(crate::common::rotation(random.quaternion()), random.point()).unwrap();
        check(&far);
        if tally.is_full() {
            break;
        }
    }
    tally.report("numbers as given");
}

/// A duplicate that was left out has the corners of the one that is stored, in its order.
fn same_corners(mut a: [[u64; 3]; 3], mut b: [[u64; 3]; 3]) -> bool {
    a.sort_unstable();
    b.sort_unstable();
    a == b
}

/// The faces of a box in decimals are where they were given: a point on a face is on the surface, and the next number is not.
#[test]
fn sides_change_at_the_numbers_given() {
    let (mut queriers, mut random) = (queriers(), Random::new(17));
    for round in 0..rounds(300) as usize {
        let style = STYLES[round % STYLES.len()];
        let centre = random.point().map(|x| x * [0.0, 10.0, 1e6][random.below(3)]);
        let mut ends = |axis: usize| {
            let lo = written(style, centre[axis] + 0.3 * random.signed(), &mut random);
            let hi = written(style, lo + 1.0 + random.signed().abs(), &mut random);
            [lo, hi].map(|end| end + 0.0)
        };
        let ends = [ends(0), ends(1), ends(2)];
        if ends.iter().any(|[lo, hi]| lo >= hi) {
            continue;
        }
        let corner = |i: usize| [0, 1, 2].map(|axis| ends[axis][i >> axis & 1]);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let triangles: Vec<Triangle> = triangles.map(|t| t.map(corner)).collect();
        let encoding = [TriangleEncoding::F32, TriangleEncoding::Packed][round % 2];
        let file = bake(&mesh(&triangles), &Options::default().triangles(encoding));
        let inner = [0, 1, 2].map(|axis| ends[axis][0] + (ends[axis][1] - ends[axis][0]) * 0.37);
        for axis in 0..3 {
            for (end, way) in [(0, 1.0), (1, -1.0)] {
                let face = ends[axis][end];
                let beside = |way: f64| match face {
                    // Coordinates of points below 2^-213 count as 0.
                    0.0 => way * 2f64.powi(-213),
                    _ if way > 0.0 => face.next_up(),
                    _ => face.next_down(),
                };
                let cases = [(face, Side::On), (beside(way), Side::Inside), (beside(-way), Side::Outside)];
                for (value, expected) in cases {
                    let mut point = inner;
                    point[axis] = value;
                    for querier in &mut queriers {
                        let side = querier.side(&file, point).unwrap();
                        assert_eq!(side, expected, "{style:?}, round {round}: {point:?} beside {ends:?}");
                    }
                }
            }
        }
    }
}
