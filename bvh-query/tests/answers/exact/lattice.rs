//! Compares triangles with small integer corners in exact poses: many pairs, most of them near contact, each decided
//! by the oracle in 64-bit integers alone.
//!
//! The pose is applied in integers too, so that no code of the library takes part in the expected answers. Placed
//! coordinates are below 2^12, so differences are below 2^13. The oracle has degree four in them and less than 2^8
//! terms, so it stays below 2^60.

use super::kinds::exact_turns;
use crate::common::tally::Tally;
use crate::common::{Random, Triangle, bake, mesh, options, queriers};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Contact, Pose};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::{Corners, meet};

/// The number of triangles per mesh.
const COUNT: usize = 48;
/// The number of poses per pair of meshes.
const POSES: usize = 12;

type Integers = Vec<Corners<i64>>;

/// Makes triangles, some with a common corner or plane and some without area. `spread` is the range of the
/// coordinates, `reach` the size of a triangle.
fn triangles(random: &mut Random, spread: usize, reach: usize) -> Integers {
    let mut number = |most: usize| random.below(2 * most + 1) as i64 - most as i64;
    let mut all: Integers = Vec::new();
    for i in 0..COUNT {
        let centre = [(); 3].map(|()| number(spread));
        let mut t = [(); 3].map(|()| centre.map(|x| x + number(reach)));
        match i % 8 {
            1 => t[0] = all[i - 1][1],
            2 => t = t.map(|p| [p[0], p[1], all[i - 1][0][2]]),
            3 => t = [all[i - 1][0], all[i - 1][2], t[0]],
            4 if number(2) == 0 => t[2] = t[1],
            5 if number(2) == 0 => t[2] = [0, 1, 2].map(|k| 2 * t[1][k] - t[0][k]),
            6 if number(4) == 0 => t = [t[0]; 3],
            _ => {}
        }
        all.push(t);
    }
    all
}

fn floats(triangles: &Integers, unit: f64) -> Vec<Triangle> {
    triangles.iter().map(|t| t.map(|p| p.map(|x| x as f64 * unit))).collect()
}

/// Returns all pairs that meet, by the oracle.
fn expected(a: &Integers, b: &Integers) -> Vec<Contact> {
    let ends = |t: &Corners<i64>, k: usize| {
        let x = [t[0][k], t[1][k], t[2][k]];
        (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]))
    };
    let boxes = |all: &Integers| all.iter().map(|t| [0, 1, 2].map(|k| ends(t, k))).collect::<Vec<_>>();
    let (boxes_a, boxes_b) = (boxes(a), boxes(b));
    let mut contacts = Vec::new();
    for (i, box_a) in boxes_a.iter().enumerate() {
        for (j, box_b) in boxes_b.iter().enumerate() {
            let overlap = (0..3).all(|k| box_a[k].0 <= box_b[k].1 && box_b[k].0 <= box_a[k].1);
            if overlap && meet(&a[i], &b[j]).unwrap() {
                contacts.push(Contact {
                    object_a: 0,
                    triangle_a: i as u32,
                    object_b: 0,
                    triangle_b: j as u32,
                });
            }
        }
    }
    contacts
}

#[test]
fn all_pairs_of_lattice_triangles() {
    let (mut tally, mut queriers, mut random) = (Tally::default(), queriers(), Random::new(31));
    let turns = exact_turns();
    let encodings = [TriangleEncoding::F32, TriangleEncoding::Packed];
    for round in 0..rounds(6) {
        // With the smallest spread nearly all pairs touch; with a spread over a hundred times as large, few do.
        let spread = 1 << random.below(8);
        let reach = 1 + random.below(4 * spread);
        // The units range from subnormal numbers to nearly the largest ones allowed.
        let unit = 2f64.powi(random.below(255) as i32 - 149);
        let [a, b] = [(); 2].map(|()| triangles(&mut random, spread, reach));
        let [file_a, file_b] = [&a, &b].map(|all| {
            let profile = Profile::ALL[random.below(Profile::ALL.len())];
            bake(&mesh(&floats(all, unit)), &options(profile, encodings[random.below(2)]))
        });
        for _ in 0..POSES {
            let turn = turns[random.below(turns.len())];
            let shift = [(); 3].map(|()| random.below(2 * reach + 1) as i64 - reach as i64);
            let place = |p: [i64; 3]| {
                [0, 1, 2].map(|k| (0..3).map(|j| turn[k][j] as i64 * p[j]).sum::<i64>() + shift[k])
            };
            let contacts = expected(&a, &b.iter().map(|t| t.map(place)).collect());
            let pose = Pose::new(turn, shift.map(|x| x as f64 * unit)).unwrap();
            tally.poses += 1;
            tally.pairs += (COUNT * COUNT) as u64;
            tally.decided.by_integers += (COUNT * COUNT) as u64;
            tally.contacts += contacts.len() as u64;
            for querier in &mut queriers {
                tally.queries += 3;
                let answer = querier.contacts(&file_a, &file_b, &pose).unwrap();
                let collide = querier.collide(&file_a, &file_b, &pose).unwrap();
                let distance = querier.distance(&file_a, &file_b, &pose).unwrap().distance;
                let touching = !contacts.is_empty();
                if answer != contacts || collide != touching || (distance == 0.0) != touching {
                    let backend = querier.backend();
                    let (found, right) = (answer.len(), contacts.len());
                    tally.wrong(format!(
                        "round {round}, {backend}, unit {unit:e}: {found} contacts, not {right}; collide {collide}, \
                         distance {distance:e}; {pose:?}"
                    ));
                }
            }
        }
        if tally.is_full() {
            break;
        }
    }
    tally.report("lattice");
}
