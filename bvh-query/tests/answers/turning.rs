//! Checks that turning slabs change no answer and save tests: the same meshes with and without them, against brute force,
//! on all backends.

use crate::common::expected::Expected;
use crate::common::shapes::{dirty, moved, plate, sphere, torus};
use crate::common::truth::Surface;
use crate::common::{Random, Triangle, mesh, options, queriers, random_pose, stored};
use bvh_bake::{prove_bounds, to_bytes};
use bvh_format::Layout;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, Querier};
use cbvh_testkit::ball::ball;
use cbvh_testkit::loosen::without_turning_slabs;

const PROFILE: Profile = Profile::Dop26U8Wide;

/// A file and the same without turning slabs. Another baker may leave them out.
fn with_and_without(triangles: &[Triangle]) -> [Bvh; 2] {
    let (bytes, _) = to_bytes(&mesh(triangles), &options(PROFILE, TriangleEncoding::F32)).unwrap();
    let without = without_turning_slabs(&bytes);
    prove_bounds(&Layout::read(&without).unwrap(), &without[..]).unwrap();
    [bytes, without].map(|bytes| Bvh::from_bytes(bytes).unwrap())
}

fn bumpy(triangles: u64) -> Vec<Triangle> {
    let (positions, indices) = ball(triangles);
    indices.iter().map(|triangle| triangle.map(|index| positions[index as usize])).collect()
}

/// A pose in which the meshes are about `gap` apart along a random direction.
fn apart(random: &mut Random, files: [&Bvh; 2], querier: &mut Querier, gap: f64) -> Pose {
    let turned = *random_pose(random, 1.0).rotation();
    let towards = random.point();
    let length = towards.iter().map(|c| c * c).sum::<f64>().sqrt();
    let at = |far: f64| Pose::new(turned, towards.map(|c| c / length * far)).unwrap();
    let (mut near, mut far) = (0.0, 10.0);
    for _ in 0..50 {
        let middle = 0.5 * (near + far);
        let distance = querier.distance(files[0], files[1], &at(middle)).unwrap().distance;
        *(if distance > gap { &mut far } else { &mut near }) = middle;
    }
    at(far)
}

#[test]
fn answers_are_those_without_and_those_of_brute_force() {
    let random = &mut Random::new(3);
    let meshes = [
        bumpy(700),
        dirty(&sphere(2), 5),
        torus(16, 10),
        dirty(&plate(8), 2),
        moved(&bumpy(300), 1.0, [1e4, -1e3, 77.0]),
    ];
    let files: Vec<_> = meshes.iter().map(|triangles| with_and_without(triangles)).collect();
    let mut queriers = queriers();
    for (a, b) in [(0, 0), (0, 1), (1, 2), (2, 3), (3, 0), (4, 1), (1, 4)] {
        let [of_a, of_b] = [a, b].map(|side| Surface::new(stored(&files[side][0])));
        for gap in [0.0, 1e-6, 1e-3, 0.05, 0.3] {
            let mut pose = apart(random, [&files[a][0], &files[b][0]], &mut queriers[0], gap);
            if a == 4 || b == 4 {
                // The centres of the others are at the origin.
                let r = pose.rotation();
                let far = [1e4, -1e3, 77.0];
                let back =
                    if b == 4 { r.map(|row| -(0..3).map(|i| row[i] * far[i]).sum::<f64>()) } else { far };
                let near = [0, 1, 2].map(|i| back[i] + 2.2 * random.point()[i]);
                pose = Pose::new(*r, near).unwrap();
            }
            let expected = Expected::new(&of_a, &of_b, &pose);
            let mut answers = Vec::new();
            for with_a in 0..2 {
                for with_b in 0..2 {
                    answers.push(expected.check(&files[a][with_a], &files[b][with_b], &pose, &mut queriers));
                }
            }
            assert!(answers.iter().all(|answer| *answer == answers[0]), "{answers:?}");
        }
    }
}

#[test]
fn slabs_save_tests() {
    let [with, without] = with_and_without(&bumpy(20_000));
    for mut querier in queriers() {
        let random = &mut Random::new(8);
        let mut tests = [0; 2];
        for gap in [0.02, 0.05, 0.1, 0.2, 0.4].repeat(5) {
            let pose = apart(random, [&with, &with], &mut querier, gap);
            let answers = [&with, &without].map(|file| {
                let answer = querier.distance(file, file, &pose).unwrap();
                (answer, querier.stats().node_tests + querier.stats().packet_tests)
            });
            assert_eq!(answers[0].0, answers[1].0);
            tests = [0, 1].map(|which| tests[which] + answers[which].1);
        }
        assert!((tests[0] as f64) < 0.9 * tests[1] as f64, "{}: {tests:?}", querier.backend());
    }
}
