//! Checks that a tracker gives the same answers as a querier without one, bit for bit, whatever it was asked before.

use crate::common::asked::victims;
use crate::common::shapes::{comb, cube, dirty, moved, outward, plate, soup, sphere, terrain, torus};
use crate::common::{Random, Triangle, bake, baked, mesh, options, queriers, rotation, translation};
use bvh_bake::mesh::Mesh;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Distance, Pose, Querier, Shape, Tracker};
use cbvh_testkit::damage::place_in_file;

const LOSSLESS: [TriangleEncoding; 2] = [TriangleEncoding::F32, TriangleEncoding::Packed];

/// Returns all fields as integers, so that zeros of different sign differ.
fn bits(answer: &Distance) -> ([u64; 9], [u32; 4]) {
    let Distance { distance, lower, upper, point_a: [x, y, z], point_b: [u, v, w], .. } = *answer;
    let numbers = [distance, lower, upper, x, y, z, u, v, w].map(f64::to_bits);
    (numbers, [answer.object_a, answer.triangle_a, answer.object_b, answer.triangle_b])
}

/// One tracker for each kind of query, and one for all kinds.
#[derive(Default)]
struct Trackers {
    collide: Tracker,
    distance: Tracker,
    within: Tracker,
    mixed: Tracker,
}

impl Trackers {
    /// Asks every query with a tracker and without one, and returns the distance.
    fn check(
        &mut self,
        querier: &mut Querier,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        what: &str,
    ) -> Distance {
        let touching = querier.collide(a, b, pose).unwrap();
        let apart = querier.distance(a, b, pose).unwrap();
        for tracker in [&mut self.collide, &mut self.mixed] {
            assert_eq!(tracker.collide(querier, a, b, pose).unwrap(), touching, "{what}");
        }
        let Distance { distance, lower, upper, .. } = apart;
        for d in [0.3, lower, distance, upper, upper.next_up(), 0.0, distance * 0.9, distance * 1.5] {
            let near = querier.within(a, b, pose, d).unwrap();
            for tracker in [&mut self.within, &mut self.mixed] {
                assert_eq!(tracker.within(querier, a, b, pose, d).unwrap(), near, "{what} within {d}");
            }
        }
        for tracker in [&mut self.distance, &mut self.mixed] {
            let tracked = tracker.distance(querier, a, b, pose).unwrap();
            assert_eq!(bits(&tracked), bits(&apart), "{what}: {tracked:?}, alone {apart:?}");
        }
        apart
    }
}

/// Makes a walk: small steps whose size changes at times, turns, steps on the spot, and now and then a jump.
fn walk(random: &mut Random, length: usize) -> Vec<Pose> {
    let (mut turn, mut at, mut step) = ([0.0, 0.0, 0.0, 1.0], [1.5, 0.2, -0.1], 0.02);
    let mut poses = Vec::new();
    for _ in 0..length {
        match random.below(24) {
            0 => at = random.point().map(|x| 3.0 * x),
            1 => step = 10f64.powi(-(random.below(7) as i32)),
            2 => turn = [(); 4].map(|()| random.signed() + 0.01),
            3 => {}
            4 => at = [0.0; 3],
            _ => {
                at = [0, 1, 2].map(|axis| at[axis] * (1.0 - 0.02 * step) + step * random.signed());
                turn = turn.map(|x| x + step * random.signed());
            }
        }
        let length = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
        poses.push(Pose::new(rotation(turn.map(|x| x / length)), at).unwrap());
    }
    poses
}

#[test]
fn walks_with_jumps_in_all_profiles_and_encodings_on_all_backends() {
    let meshes = [dirty(&sphere(2), 1), torus(12, 8), dirty(&soup(90, 4), 5), comb(64), terrain(10, 7)];
    let mut random = Random::new(5);
    let quantized = options(Profile::Dop14U8, TriangleEncoding::Quantized).max_error(1e-3);
    for querier in &mut queriers() {
        for (number, profile) in Profile::ALL.into_iter().enumerate() {
            for encoding in LOSSLESS {
                let a = bake(&mesh(&meshes[number % 5]), &options(profile, encoding));
                let b = bake(&mesh(&meshes[(number + 2) % 5]), &quantized);
                let mut trackers = Trackers::default();
                for (step, pose) in walk(&mut random, 60).iter().enumerate() {
                    let what = format!("{} {profile:?} {encoding:?} {step}", querier.backend());
                    trackers.check(querier, a.all(), b.all(), pose, &what);
                }
            }
        }
    }
}

/// Whether a solid is inside another one is asked after the tracker has looked ahead.
#[test]
fn walks_of_solids_around_and_into_each_other() {
    let mut random = Random::new(6);
    for querier in &mut queriers() {
        let [ball, cube] = [outward(sphere(3)), outward(cube())]
            .map(|of| bake(&mesh(&of), &options(Profile::Dop14U8, TriangleEncoding::Packed)));
        let (ball, cube) = (ball.all().solid().unwrap(), cube.all().solid().unwrap());
        let mut trackers = [(); 2].map(|()| Trackers::default());
        for (step, pose) in walk(&mut random, 400).iter().enumerate() {
            let what = format!("{} {step}", querier.backend());
            trackers[0].check(querier, ball, cube, pose, &what);
            trackers[1].check(querier, ball, ball, pose, &what);
        }
    }
}

#[test]
fn down_to_contact_along_it_and_through() {
    let mut poses = Vec::new();
    // A cube comes down on a cube, slides on its face, over the edge, and back inside.
    poses.extend((0..40).map(|i| translation(0.25, -0.125, 2.5 - f64::from(i) / 64.0)));
    poses.extend((0..40).map(|i| translation(0.25 + f64::from(i) / 16.0, -0.125, 2.0)));
    poses.extend((0..40).map(|i| translation(2.0, f64::from(i) / 8.0 - 2.0, 2.0)));
    poses.extend((0..40).map(|i| translation(2.5 - f64::from(i) / 32.0, 0.0, 0.5)));
    // The cube is one rounding unit to either side of contact.
    poses.extend([2.0f64, 2.0f64.next_up(), 2.0f64.next_down(), 2.0].map(|x| translation(x, 0.3, 0.7)));
    for querier in &mut queriers() {
        for profile in [Profile::Dop14U8, Profile::Dop6F16, Profile::Dop26U4] {
            let cube = bake(&mesh(&cube()), &options(profile, TriangleEncoding::Packed));
            let plate = bake(&mesh(&dirty(&plate(8), 2)), &options(profile, TriangleEncoding::F32));
            let mut trackers = [(); 2].map(|()| Trackers::default());
            let mut contacts = 0;
            for pose in &poses {
                let what = format!("{pose:?}");
                let apart = trackers[0].check(querier, cube.all(), cube.all(), pose, &what);
                contacts += usize::from(apart.distance == 0.0);
                trackers[1].check(querier, plate.all(), cube.all(), pose, &what);
            }
            assert!(contacts > 60 && contacts < poses.len() - 30, "{contacts}");
        }
    }
}

/// Bakes a file in which each of these meshes is an object of its own.
fn several(objects: &[Vec<Triangle>], profile: Profile) -> Bvh {
    let mut split = Mesh::default();
    let mut ids = 0;
    for triangles in objects {
        let mut object = mesh(triangles).objects.remove(0);
        object.name = format!("object {ids}");
        object.triangle_ids = (ids..).take(triangles.len()).collect();
        ids += triangles.len() as u32;
        split.objects.push(object);
    }
    bake(&split, &options(profile, TriangleEncoding::Packed).split_objects(true))
}

#[test]
fn several_objects_and_meshes_that_change_under_the_tracker() {
    let parts = [
        moved(&sphere(2), 0.5, [-1.0, 0.0, 0.0]),
        moved(&torus(9, 6), 0.4, [1.0, 0.5, 0.0]),
        moved(&cube(), 0.3, [0.0, -1.0, 0.25]),
    ];
    let a = several(&parts, Profile::Dop14U8);
    let same = Bvh::from_bytes(a.bytes().to_vec()).unwrap();
    let fewer = several(&parts[1..], Profile::Dop26U4);
    let b = several(&[parts[2].clone(), parts[0].clone()], Profile::Dop6U8);
    let small = baked(&cube()[..1]);
    let large = baked(&soup(900, 3));
    let sides = [
        (a.all(), b.all()),
        (same.all(), b.all()),
        (a.object(1).unwrap(), b.all()),
        (a.object(2).unwrap(), b.object(0).unwrap()),
        (b.all(), a.all()),
        (fewer.all(), a.object(0).unwrap()),
        (small.all(), large.all()),
        (large.all(), small.all()),
        (large.all(), large.all()),
    ];
    let mut random = Random::new(23);
    for querier in &mut queriers() {
        let mut trackers = Trackers::default();
        let mut number = 0;
        for (step, pose) in walk(&mut random, 400).iter().enumerate() {
            // The tracker is given other meshes in the same pose, and in the next one.
            if random.below(4) == 0 {
                number = random.below(sides.len());
            }
            let (a, b) = sides[number];
            trackers.check(querier, a, b, pose, &format!("{} sides {number} step {step}", querier.backend()));
        }
    }
}

#[test]
fn a_file_that_is_closed_leaves_nothing_behind() {
    let mut querier = Querier::new().unwrap();
    let mut tracker = Tracker::new();
    let cube = baked(&cube());
    // A file may take the memory address of the one before. The cubes have different sizes.
    for size in [1.0, 0.25, 2.0, 0.125] {
        let other = baked(&moved(&crate::common::shapes::cube(), size, [0.0; 3]));
        for x in [3.5, 3.25] {
            let answer = tracker.distance(&mut querier, &cube, &other, &translation(x, 0.0, 0.0)).unwrap();
            assert_eq!(answer.distance, x - 1.0 - size);
        }
        assert_eq!(
            tracker.within(&mut querier, &cube, &other, &translation(3.25, 0.0, 0.0), 1.0),
            Ok(size > 1.0)
        );
        assert_eq!(
            tracker.collide(&mut querier, &cube, &other, &translation(3.0, 0.0, 0.0)),
            Ok(size == 2.0)
        );
    }
}

/// With one tracker for all files, damage either is refused or leaves the answers as they were.
#[test]
fn damaged_files_are_refused_or_answer_as_before() {
    let good = baked(&sphere(1));
    let mut querier = Querier::new().unwrap();
    let mut random = Random::new(9);
    let mut tracker = Tracker::new();
    let (mut refused, mut answered) = (0, 0);
    for file in victims() {
        let sound = Bvh::from_bytes(file.clone()).unwrap();
        for _ in 0..100 {
            let mut bytes = file.clone();
            let at = place_in_file(&bytes, &mut random);
            bytes[at] ^= 1 << random.below(8);
            let Ok(damaged) = Bvh::from_bytes(bytes) else { continue };
            for pose in walk(&mut random, 8) {
                let distance = tracker.distance(&mut querier, &damaged, &good, &pose);
                let touching = tracker.collide(&mut querier, &damaged, &good, &pose);
                let near = tracker.within(&mut querier, &damaged, &good, &pose, 0.25);
                let failed = distance.is_err() || touching.is_err() || near.is_err();
                (refused, answered) = (refused + usize::from(failed), answered + usize::from(!failed));
                assert!(touching.is_err() || touching == querier.collide(&sound, &good, &pose));
                assert!(near.is_err() || near == querier.within(&sound, &good, &pose, 0.25));
                assert!(distance.is_err() || distance == querier.distance(&sound, &good, &pose));
            }
        }
    }
    assert!(refused > 100 && answered > 100, "{refused} {answered}");
}

/// Checks the savings that a tracker is meant to bring, as far as they do not depend on the machine.
#[test]
fn small_steps_cost_less() {
    let a = baked(&terrain(40, 7));
    let b = baked(&sphere(4));
    let mut querier = Querier::new().unwrap();
    let poses: Vec<_> = (0..200).map(|i| translation(-0.5 + f64::from(i) / 400.0, 0.25, 1.6)).collect();
    let [mut alone, mut tracked] = [[0; 3]; 2];
    let mut without_a_walk = 0;
    let mut trackers = Trackers::default();
    for pose in &poses {
        querier.collide(&a, &b, pose).unwrap();
        alone[0] += querier.stats().node_tests;
        let near = querier.distance(&a, &b, pose).unwrap().distance;
        alone[1] += querier.stats().node_tests;
        querier.within(&a, &b, pose, 0.9 * near).unwrap();
        alone[2] += querier.stats().node_tests;
        trackers.collide.collide(&mut querier, &a, &b, pose).unwrap();
        tracked[0] += querier.stats().node_tests;
        without_a_walk += usize::from(querier.stats().node_tests == 0);
        trackers.distance.distance(&mut querier, &a, &b, pose).unwrap();
        tracked[1] += querier.stats().node_tests;
        trackers.within.within(&mut querier, &a, &b, pose, 0.9 * near).unwrap();
        tracked[2] += querier.stats().node_tests;
    }
    assert!(without_a_walk > 100, "{without_a_walk}");
    assert!(tracked[1] < alone[1] && tracked[2] < alone[2], "{tracked:?} {alone:?}");
}
