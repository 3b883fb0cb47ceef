//! Queries real meshes in poses whose answers are known: a small pair in `testdata/`, and larger ones in `shared/`.
//!
//! The labels were computed from the numbers in the OBJ text, whereas a file holds `f32`, so that a distance may
//! differ from its label by 1e-8 of the size. A sample of the answers is checked to 1e-12 by brute force on the
//! stored triangles.

use crate::common::expected::Expected;
use crate::common::truth::Surface;
use crate::common::{bake, fcl_pair, options, queriers, shared, shared_mesh, stated, stored, testdata};
use bvh_bake::Options;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, Querier};
use cbvh_testkit::depth::step;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// For each preset, the number of poses that are checked by brute force.
const PRESETS: [(&str, usize); 7] =
    [("d0pen", 0), ("d0sep", 2), ("d0.5", 2), ("d1", 1), ("d5", 1), ("d10", 1), ("overlap", 0)];

/// Returns a mesh of `shared/meshes`, which is baked once for all tests.
fn baked(name: &str) -> &'static Bvh {
    static BAKED: Mutex<Option<HashMap<String, &'static Bvh>>> = Mutex::new(None);
    let mut guard = BAKED.lock().unwrap_or_else(PoisonError::into_inner);
    let all = guard.get_or_insert_with(HashMap::new);
    let bake = || -> &'static Bvh { Box::leak(Box::new(bake(&shared_mesh(name), &Options::default()))) };
    all.entry(name.to_owned()).or_insert_with(bake)
}

fn pose(numbers: &str) -> Pose {
    let rows: Vec<f64> = numbers.split_whitespace().map(|number| number.parse().unwrap()).collect();
    Pose::from_rows(&rows.try_into().unwrap()).unwrap()
}

/// Returns the diagonal of the box of A.
fn diagonal(bvh: &Bvh) -> f64 {
    let record = bvh.objects()[0].record();
    let side = |axis: usize| f64::from(record.box_hi[axis].get()) - f64::from(record.box_lo[axis].get());
    (0..3).map(|axis| side(axis).powi(2)).sum::<f64>().sqrt()
}

/// Queries all backends. A distance of 0 must agree with collision, and any other must be within 1e-8 of the size of
/// `label`.
fn check(a: &Bvh, b: &Bvh, pose: &Pose, label: f64, size: f64, queriers: &mut [Querier], what: &str) {
    let first = queriers[0].distance(a, b, pose).unwrap();
    assert_eq!(first.distance == 0.0, label == 0.0, "{what}: {first:?}, not {label}");
    assert!((first.distance - label).abs() <= 1e-8 * size, "{what}: {first:?}, not {label}");
    for querier in queriers {
        let backend = querier.backend();
        assert_eq!(querier.collide(a, b, pose).unwrap(), label == 0.0, "{what} {backend}");
        assert_eq!(querier.distance(a, b, pose).unwrap(), first, "{what} {backend}");
        let near = first.upper;
        assert!(querier.within(a, b, pose, near).unwrap(), "{what} {backend} within {near}");
        let nearer = first.lower * (1.0 - 1e-9);
        assert_eq!(
            querier.within(a, b, pose, nearer).unwrap(),
            label == 0.0,
            "{what} {backend} within {nearer}"
        );
    }
}

/// Checks a line of a pose and its label, by all backends or the fastest of them.
fn check_line(a: &Bvh, b: &Bvh, line: &str, queriers: &mut [Querier], what: &str) -> (Pose, f64) {
    let (numbers, label) = line.split_once('#').unwrap();
    let label: f64 = label.trim().strip_prefix("dist ").unwrap().parse().unwrap();
    let pose = pose(numbers);
    check(a, b, &pose, label, diagonal(a), queriers, what);
    (pose, label)
}

/// Asserts that a preset has the label that its name promises.
fn check_preset(preset: &str, label: f64, what: &str) {
    assert_eq!(label == 0.0, matches!(preset, "d0pen" | "overlap"), "{what}");
}

/// Checks an answer by brute force on the stored triangles.
fn check_by_brute_force(surfaces: &[Surface; 2], a: &Bvh, b: &Bvh, pose: &Pose, querier: &mut Querier) {
    let answer = querier.distance(a, b, pose).unwrap();
    let [of_a, of_b] = surfaces;
    Expected::within(of_a, of_b, pose, 1.001 * answer.distance).check_distance(&answer);
}

fn check_pair(name: &str, mesh_a: &str, mesh_b: &str) {
    let (a, b) = (baked(mesh_a), baked(mesh_b));
    let surfaces = [a, b].map(|file| Surface::new(stored(file)));
    let mut queriers = queriers();
    let (small, fastest) = (surfaces[0].stored.len() < 100_000, queriers.len() - 1);
    for (preset, sample) in PRESETS {
        let text = std::fs::read_to_string(shared(&format!("poses/{name}_{preset}.txt"))).unwrap();
        // One file of a1hand has 99 poses.
        assert!(text.lines().count() >= 99);
        for (number, line) in text.lines().enumerate().step_by(step(20)) {
            let what = format!("{name} {preset} {number}");
            // Small meshes are queried on all backends. Others are queried on the fastest, and on every fourth pose
            // on all of them.
            let asked = if small || number % 4 == 0 { &mut queriers[..] } else { &mut queriers[fastest..] };
            let (pose, label) = check_line(a, b, line, asked, &what);
            check_preset(preset, label, &what);
            if number < sample {
                check_by_brute_force(&surfaces, a, b, &pose, &mut queriers[0]);
            }
        }
    }
}

/// Checks poses of FCL's test pair, some of each preset, and some for which at least one well-known library answers wrongly.
#[test]
fn labelled_poses_of_a_small_pair() {
    let meshes = fcl_pair();
    let [a, b] = [0, 1].map(|k| bake(&meshes[k], &Options::default()));
    let surfaces = [&a, &b].map(|file| Surface::new(stored(file)));
    let compressed = options(Profile::Dop6U8, TriangleEncoding::Packed);
    let small = [0, 1].map(|k| bake(&meshes[k], &compressed));
    let mut queriers = queriers();
    let mut counts = HashMap::new();
    for line in stated(&std::fs::read_to_string(testdata("labelled/poses.txt")).unwrap()) {
        let (preset, line) = line.split_once(' ').unwrap();
        let number = counts.entry(preset.to_owned()).or_insert(0);
        let what = format!("{preset} {number}");
        let (pose, label) = check_line(&a, &b, line, &mut queriers, &what);
        match PRESETS.iter().find(|(name, _)| *name == preset) {
            Some((_, sample)) => {
                check_preset(preset, label, &what);
                if *number < *sample {
                    check_by_brute_force(&surfaces, &a, &b, &pose, &mut queriers[0]);
                }
            }
            None => {
                check_line(&small[0], &small[1], line, &mut queriers, &what);
                let answers = [&[a.clone(), b.clone()], &small]
                    .map(|[a, b]| queriers[0].distance(a, b, &pose).unwrap());
                assert!(label == 0.0 || answers[0] == answers[1], "{what}: {answers:?}");
            }
        }
        *number += 1;
    }
    let expected =
        PRESETS.iter().map(|(preset, _)| ((*preset).to_owned(), 6)).chain([("hard".to_owned(), 24)]);
    assert_eq!(counts, expected.collect());
}

#[test]
#[ignore = "needs ../shared"]
fn every_pair_is_tested() {
    let pairs = std::fs::read_to_string(shared("poses/pairs.txt")).unwrap();
    let names: Vec<_> = pairs.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(names, ["bunny", "dragon", "nao", "a1hand", "apollo", "piano", "fcl"]);
}

#[test]
#[ignore = "needs ../shared"]
fn bunny() {
    check_pair("bunny", "bunny.obj", "bunny.obj");
}

#[test]
#[ignore = "needs ../shared"]
fn dragon() {
    check_pair("dragon", "dragon.obj", "dragon.obj");
}

#[test]
#[ignore = "needs ../shared"]
fn nao() {
    check_pair("nao", "nao.obj", "nao.obj");
}

#[test]
#[ignore = "needs ../shared"]
fn a1hand() {
    check_pair("a1hand", "a1.obj", "hand.obj");
}

#[test]
#[ignore = "needs ../shared"]
fn apollo() {
    check_pair("apollo", "apollo.obj", "apollo.obj");
}

#[test]
#[ignore = "needs ../shared"]
fn piano() {
    check_pair("piano", "apartment.obj", "piano.obj");
}

#[test]
#[ignore = "needs ../shared"]
fn fcl() {
    check_pair("fcl", "fclenv.obj", "fclrob.obj");
}

/// Checks poses for which at least one well-known library answers wrongly. The labels show that the list's bunny has
/// coordinates of six decimals, namely those of `bunny.obj` printed so: without the rounding, the labels are off by
/// 3e-6 of the size, and with it by 3e-9.
#[test]
#[ignore = "needs ../shared"]
fn poses_on_which_libraries_disagree() {
    let text = std::fs::read_to_string(shared("disagree/poses.txt")).unwrap();
    assert_eq!(text.lines().count(), 462);
    let load = |name: &str| {
        let mut mesh = shared_mesh(name);
        if name == "bunny.obj" {
            let six_decimals = |x: f64| f64::from(format!("{:.6}", x as f32).parse::<f32>().unwrap());
            let positions = mesh.objects.iter_mut().flat_map(|object| &mut object.positions);
            positions.for_each(|position| *position = position.map(six_decimals));
        }
        let compressed = options(Profile::Dop6U8, TriangleEncoding::Packed);
        (name.to_owned(), [bake(&mesh, &Options::default()), bake(&mesh, &compressed)])
    };
    let files: HashMap<String, [Bvh; 2]> = ["bunny.obj", "fclenv.obj", "fclrob.obj"].map(load).into();
    let mut queriers = queriers();
    for line in text.lines() {
        let (head, numbers) = line.split_once('|').unwrap();
        let head: Vec<_> = head.split_whitespace().collect();
        let field = |key: &str| -> f64 {
            head.iter().find_map(|word| word.strip_prefix(key)).unwrap().parse().unwrap()
        };
        let names = if head[0] == "bunny" { ["bunny.obj"; 2] } else { ["fclenv.obj", "fclrob.obj"] };
        let [a, b] = names.map(|name| &files[name]);
        let what = head[..3].join(" ");
        let (mut label, size, pose) = (field("dist="), field("size="), pose(numbers));
        if what == "bunny d0pen 148" {
            // The stated penetration is 1e-9 of the size. Six decimals lose more when they become `f32`, so the
            // meshes are apart.
            let answer = queriers[0].distance(&a[0], &b[0], &pose).unwrap();
            let [of_a, of_b] = [&a[0], &b[0]].map(|file| Surface::new(stored(file)));
            Expected::within(&of_a, &of_b, &pose, 2.0 * answer.distance).check_distance(&answer);
            assert!(answer.distance < 2e-9 * size, "{answer:?}");
            label = answer.distance;
        }
        let mut answers = Vec::new();
        for (a, b) in a.iter().zip(b) {
            check(a, b, &pose, label, size, &mut queriers, &what);
            answers.push(queriers[0].distance(a, b, &pose).unwrap());
        }
        // When the meshes touch, it depends on the tree which triangles are named.
        assert!(label == 0.0 || answers[0] == answers[1], "{what}: {answers:?}");
    }
}
