//! Certified motions against motions whose ends are known: labels of meshes on paths, and exact translations of triangles.

use crate::common::{bake, baked, fcl_pair, queriers, shared, shared_mesh, stated, testdata};
use bvh_bake::mesh::Mesh;
use bvh_query::{Motion, MotionAnswer, MotionOptions, Pose, Querier};
use cbvh_testkit::depth::rounds;
use std::path::Path;

#[test]
fn labelled_motions_of_a_small_pair_are_answered_rightly() {
    let text = std::fs::read_to_string(testdata("labelled/motions.txt")).unwrap();
    let answers = check_labelled("fcl", fcl_pair(), stated(&text));
    assert!(answers.all >= 40 && answers.hits >= 10 && answers.all - answers.hits >= 10, "{answers:?}");
    assert_eq!(answers.near, 0);
}

#[test]
#[ignore = "needs ../shared"]
fn labelled_motions_are_answered_rightly() {
    for (name, mesh_a, mesh_b) in [
        ("fcl", "fclenv", "fclrob"),
        ("bunny", "bunny", "bunny"),
        ("apollo", "apollo", "apollo"),
        ("a1hand", "a1", "hand"),
    ] {
        let texts = ["long", "short", "slide", "spin"]
            .map(|kind| std::fs::read_to_string(shared(&format!("motions/{name}_{kind}.txt"))).unwrap());
        let step = if rounds(1) > 1 { 1 } else { 10 };
        let lines = texts.iter().flat_map(|text| stated(text).step_by(step));
        let meshes = [mesh_a, mesh_b].map(|mesh| shared_mesh(&format!("{mesh}.obj")));
        let answers = check_labelled(name, meshes, lines);
        assert!(answers.all >= 40 && 1000 * answers.near <= answers.all, "{name}: {answers:?}");
    }
}

/// How many motions were answered, how many of them hit, and how many are near.
#[derive(Debug, Default)]
struct Answered {
    all: u32,
    hits: u32,
    near: u32,
}

/// Checks motions of a pair of meshes with labels: `# hit T clear C` or `# free? D [proven]`. The labels are about coordinates
/// rounded to f32.
fn check_labelled<'a>(name: &str, meshes: [Mesh; 2], lines: impl Iterator<Item = &'a str>) -> Answered {
    let [a, b] = meshes.map(|mut mesh| {
        for object in &mut mesh.objects {
            object.positions.iter_mut().for_each(|p| *p = p.map(|v| f64::from(v as f32)));
        }
        bake(&mesh, &bvh_bake::Options::default())
    });
    let mut querier = Querier::new().unwrap();
    let mut answers = Answered::default();
    for line in lines {
        let (numbers, label) = line.split_once('#').unwrap();
        let numbers: Vec<f64> = numbers.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let pose = |at: usize| Pose::from_rows(numbers[at..at + 12].try_into().unwrap()).unwrap();
        let motion = Motion::between(&pose(0), &pose(12)).unwrap();
        let answer = querier.motion(&a, &b, &motion, &MotionOptions::new()).unwrap();
        let words: Vec<&str> = label.split_whitespace().collect();
        let is_free = querier.is_free(&a, &b, &motion, &MotionOptions::new()).unwrap();
        assert_eq!(is_free, answer == MotionAnswer::Free);
        answers.all += 1;
        match (words[0], answer) {
            // Ten digits are printed.
            ("hit", MotionAnswer::Hit { free_until, touching_at, .. }) => {
                let [contact, clear] = [words[1], words[3]].map(|word| word.parse::<f64>().unwrap());
                assert!(free_until <= contact + 1e-8 && touching_at >= clear - 1e-10, "{name}: {line}");
                answers.hits += 1;
            }
            ("free?", MotionAnswer::Free) => {}
            (_, MotionAnswer::Near { .. }) => answers.near += 1,
            (_, answer) => panic!("{name}: {line}, found {answer:?}"),
        }
    }
    answers
}

/// Translations of one triangle past another, which may be segments or points, with labels from rational arithmetic. Those
/// whose vertices are f32 are baked; many touch at the start, or only just. The search itself has a test with all of them.
#[test]
fn exact_translations_are_answered() {
    check_translations(&testdata("labelled/translations.txt"));
}

#[test]
#[ignore = "needs ../shared"]
fn more_exact_translations_are_answered() {
    check_translations(&shared("motions/ccd/translations.txt"));
}

fn check_translations(path: &Path) {
    let text = std::fs::read_to_string(path).unwrap();
    let (mut answered, mut hit, mut near) = (0, 0, 0);
    for line in stated(&text) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (hits, is_f32) = (words[2] == "1", words[3] == "1");
        if !is_f32 {
            continue;
        }
        let numbers: Vec<f64> = words[4..].iter().map(|word| word.parse().unwrap()).collect();
        let points = numbers.as_chunks::<3>().0;
        let [a, b] = [0, 3].map(|first| baked(&[[points[first], points[first + 1], points[first + 2]]]));
        let moved = Pose::new(*Pose::IDENTITY.rotation(), points[6]).unwrap();
        let motion = Motion::between(&Pose::IDENTITY, &moved).unwrap();
        for querier in &mut queriers() {
            let answer = querier.motion(&a, &b, &motion, &MotionOptions::new().tolerance(1e-11)).unwrap();
            match answer {
                MotionAnswer::Free => assert!(!hits, "{line}"),
                MotionAnswer::Hit { .. } => assert!(hits, "{line}"),
                // A point meets a triangle at one instant, which may be no f64. Its two neighbours are apart.
                MotionAnswer::Near { nearest, .. } => {
                    assert!(hits && nearest.distance <= 1e-11, "{line}");
                    near += 1;
                }
            }
            answered += 1;
            hit += u32::from(hits);
        }
    }
    assert!(answered >= 70 && hit >= 30 && 2 * near < answered, "{near} of {answered} are near, {hit} hit");
}
