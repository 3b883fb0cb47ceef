//! Tests meshes whose size is a few of the smallest f32 numbers, and dust beside large triangles. Products underflow
//! there and rounding is absolute, for which filters must allow.

use super::ask::Asked;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{Random, Triangle, bake, mesh, options, queriers, random_pose, stored};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::Pose;
use cbvh_testkit::depth::rounds;

/// The smallest positive f32.
const UNIT: f64 = f64::from_bits((1023 - 149) << 52);

fn in_units(t: [[i32; 3]; 3]) -> Triangle {
    times(UNIT, t)
}

fn times(unit: f64, t: [[i32; 3]; 3]) -> Triangle {
    t.map(|p| p.map(|x| f64::from(x) * unit))
}

/// A segment and a triangle cross by a fraction of a unit, in all profiles.
#[test]
fn two_triangles_that_cross_by_less_than_a_subnormal() {
    let a = in_units([[-2, 2, 1], [-2, 1, 0], [-2, 2, 1]]);
    let b = in_units([[-3, 1, 2], [-2, 1, 2], [-2, 1, 1]]);
    let turn = [
        [-0.7782324981544457, 0.581106485420201, 0.23805342135510743],
        [-0.2797401220596044, -0.6601900249860617, 0.6970613997482437],
        [0.5622273943222336, 0.4758827413465262, 0.6763401315626236],
    ];
    let translation = [-4.664441083274712, 0.506244522560243, 0.27601520414827774].map(|x| x * UNIT);
    let pose = Pose::new(turn, translation).unwrap();
    let (mut tally, mut queriers) = (Tally::default(), queriers());
    for (i, profile_a) in Profile::ALL.into_iter().enumerate() {
        for (j, profile_b) in Profile::ALL.into_iter().enumerate() {
            let file = |t, profile| bake(&mesh(&[t]), &options(profile, TriangleEncoding::F32));
            let (file_a, file_b) = (file(a, profile_a), file(b, profile_b));
            let surfaces = [&file_a, &file_b].map(|file| Surface::new(stored(file)));
            let truth = Truth::new(&surfaces[0], &surfaces[1], &pose);
            let mut asked = Asked { a: &file_a, b: &file_b, queriers: &mut queriers };
            if let Err(error) = asked.all(&truth, &pose, &mut tally) {
                tally.wrong(format!("profiles {i}, {j}: {error}"));
            }
        }
    }
    assert_eq!(tally.contacts, Profile::ALL.len().pow(2) as u64, "all pairs touch");
    tally.report("a subnormal pair");
}

/// Compares random triangles of a few units in any rotation.
#[test]
fn random_triangles_of_a_few_units() {
    let (mut tally, mut queriers, mut random) = (Tally::default(), queriers(), Random::new(51));
    for round in 0..rounds(30) {
        let (spread, reach) = (2 << random.below(4), 1 + random.below(3));
        let mut number = |most: usize| random.below(2 * most + 1) as i32 - most as i32;
        let mut triangles = || -> Vec<_> {
            let mut triangle = || {
                let centre = [(); 3].map(|()| number(spread));
                in_units([(); 3].map(|()| centre.map(|x| x + number(reach))))
            };
            (0..12).map(|_| triangle()).collect()
        };
        let (a, b) = (triangles(), triangles());
        let [file_a, file_b] = [a, b].map(|triangles| {
            let profile = Profile::ALL[random.below(Profile::ALL.len())];
            bake(&mesh(&triangles), &options(profile, TriangleEncoding::F32))
        });
        let surfaces = [&file_a, &file_b].map(|file| Surface::new(stored(file)));
        for _ in 0..4 {
            let pose = random_pose(&mut random, 2.5 * spread as f64 * UNIT);
            let truth = Truth::new(&surfaces[0], &surfaces[1], &pose);
            let mut asked = Asked { a: &file_a, b: &file_b, queriers: &mut queriers };
            if let Err(error) = asked.all(&truth, &pose, &mut tally) {
                tally.wrong(format!("round {round}: {error}, {pose:?}"));
            }
        }
        if tally.is_full() {
            break;
        }
    }
    tally.report("a few subnormal units");
}

/// Places triangles, far smaller than their meshes, near each other around the origin.
#[test]
fn dust_beside_large_triangles() {
    let (mut tally, mut queriers, mut random) = (Tally::default(), queriers(), Random::new(52));
    for round in 0..rounds(20) {
        let exponent = -(20 + random.below(130) as i32);
        let unit = 2f64.powi(exponent);
        let reach = 1 << random.below(12);
        let mut number = |most: usize| random.below(2 * most + 1) as i32 - most as i32;
        let mut triangles = |side: f64| -> Vec<Triangle> {
            let mut triangle = || {
                let centre = [(); 3].map(|()| number(4 * reach));
                times(unit, [(); 3].map(|()| centre.map(|x| x + number(reach))))
            };
            let mut all: Vec<_> = (0..8).map(|_| triangle()).collect();
            all.push([[side, 3.0, 0.0], [side, 4.0, 0.0], [side, 3.0, 1.0]]);
            all
        };
        let (a, b) = (triangles(1.0), triangles(-1.0));
        let [file_a, file_b] = [a, b].map(|triangles| {
            let profile = Profile::ALL[random.below(Profile::ALL.len())];
            bake(&mesh(&triangles), &options(profile, TriangleEncoding::F32))
        });
        let surfaces = [&file_a, &file_b].map(|file| Surface::new(stored(file)));
        for _ in 0..3 {
            let turned = random_pose(&mut random, 8.0 * reach as f64 * unit);
            let pose = Pose::new(*Pose::IDENTITY.rotation(), turned.translation()).unwrap();
            for pose in [turned, pose] {
                let truth = Truth::new(&surfaces[0], &surfaces[1], &pose);
                let mut asked = Asked { a: &file_a, b: &file_b, queriers: &mut queriers };
                if let Err(error) = asked.all(&truth, &pose, &mut tally) {
                    tally.wrong(format!("round {round}, unit 2^{exponent}: {error}, {pose:?}"));
                }
            }
        }
        if tally.is_full() {
            break;
        }
    }
    tally.report("dust");
}
