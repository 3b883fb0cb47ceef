//! Meshes with contact in a corner, along an edge or in a face: exactly touching, 2^-40 apart and 2^-40 deep.

use super::shapes::{axes, cuboid, moved, terrain, two, unit_cube};
use super::{Case, question};
use crate::Triangle;

const JUST: &str = "the meshes lie on opposite sides of a plane and share only points of it";
const OFF: &str = "the gap of 2^-40 is below the rounding of single precision at this size";
const DEEP: &str = "the overlap of 2^-40 is below the rounding of single precision at this size";
const SHARED: &str = "all triangles that meet at a shared corner, edge or face are in contact";

/// A quarter turn about x.
const QUARTER: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];

fn quarter_back([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, z, -y]
}

/// Returns names and pairs of triangles, with A in z <= 0 and B in z >= 0.
fn pairs() -> Vec<(&'static str, Triangle, Triangle)> {
    let below = [2.0, 3.0, -8.0];
    let (above, higher) = ([-4.0, 2.0, 8.0], [5.0, 1.0, 16.0]);
    let face = [[0.0; 3], [16.0, 0.0, 0.0], [0.0, 16.0, 0.0]];
    let (p, q) = ([-8.0, 0.0, 0.0], [8.0, 0.0, 0.0]);
    vec![
        ("corner on corner", [[0.0; 3], below, [-3.0, 1.0, -4.0]], [[0.0; 3], above, higher]),
        ("corner on edge", [p, q, below], [[2.0, 0.0, 0.0], above, higher]),
        ("corner on face", face, [[4.0, 4.0, 0.0], above, higher]),
        ("edge across edge", [p, q, below], [[0.0, -8.0, 0.0], [0.0, 8.0, 0.0], above]),
        ("edge along edge", [p, q, below], [[4.0, 0.0, 0.0], [12.0, 0.0, 0.0], above]),
        ("edge in face", face, [[2.0, 2.0, 0.0], [4.0, 8.0, 0.0], above]),
        ("face on face", face, [[2.0, 2.0, 0.0], [4.0, 8.0, 0.0], [8.0, 4.0, 0.0]]),
    ]
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let off = two(-40);
    for (name, a, b) in pairs() {
        let ask = |what: &str, hard| question("contact", format!("{name}, {what}"), hard, vec![a], vec![b]);
        cases.push(ask("touching", JUST).touching(1));
        cases.push(
            ask("2^-40 apart", OFF)
                .moved([0.0, 0.0, off])
                .apart(off, "straight up from where they would touch"),
        );
        let deep = ask("2^-40 deep", DEEP).moved([0.0, 0.0, -off]);
        // A face that sinks has no edge that crosses the other face.
        cases.push(match name {
            "face on face" => deep.apart(off, "straight down to the face"),
            _ => deep.touching(1),
        });
    }
    for (name, a, b) in pairs() {
        let stored = b.map(|p| quarter_back([p[0], p[1], p[2] - 64.0]));
        let turned =
            question("contact", format!("{name}, B turned and brought there"), JUST, vec![a], vec![stored]);
        cases.push(turned.turned(QUARTER).moved([0.0, 0.0, 64.0]).touching(1));
    }
    cases.extend(shared());
    cases
}

fn shared() -> Vec<Case> {
    let ask = |name: &str, a: Vec<Triangle>, b: Vec<Triangle>| question("shared", name, SHARED, a, b);
    let cube = unit_cube;
    let beside = |x: f64, y: f64, z: f64| moved(&unit_cube(), [x, y, z]);
    let hill = |x: usize, y: usize| ((x * x + 3 * y) % 5) as f64 / 4.0;
    let patch = |from: usize| moved(&terrain(4, |x, y| hill(x + from, y)), [from as f64, 0.0, 0.0]);
    let fan = |up: f64| -> Vec<Triangle> {
        let rim = |k: usize| [[1.0, 0.0, up], [0.0, 1.0, up], [-1.0, 0.0, up], [0.0, -1.0, up]][k % 4];
        (0..4).map(|k| [[0.0; 3], rim(k), rim(k + 1)]).collect()
    };
    vec![
        ask("cubes share a face", cube(), beside(1.0, 0.0, 0.0)).touching(62),
        ask("cubes share an edge", cube(), beside(1.0, 1.0, 0.0)).touching(26),
        ask("cubes share a corner", cube(), beside(1.0, 1.0, 1.0)).touching(9),
        ask("cubes share a part of a face", cube(), beside(0.5, 0.25, 1.0)).touching(13),
        ask("a cube's corner in a face", cuboid([-4.0, -4.0, -1.0], [4.0, 4.0, 0.0]), {
            let up: Vec<Triangle> =
                cube().iter().map(|t| t.map(|[x, y, z]| [x - y, y - z, x + y + z])).collect();
            moved(&up, [0.5, 0.25, 0.0])
        })
        .touching(3),
        ask("patches of one terrain, along a border", patch(0), patch(4)).touching(27),
        ask("patches of one terrain, 2^-20 apart", patch(0), patch(4))
            .moved([two(-20), 0.0, 0.0])
            .apart(two(-20), "from border to border along x"),
        ask("fans share their apex", fan(-1.0), fan(1.0)).touching(16),
        ask("fans share their apex, upright", axes(&fan(-1.0), [2, 0, 1]), axes(&fan(1.0), [2, 0, 1]))
            .touching(16),
    ]
}
