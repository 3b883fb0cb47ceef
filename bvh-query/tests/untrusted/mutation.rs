//! Queries thousands of damaged files, the same ones in each run: bytes are flipped, files are spliced and truncated,
//! blocks are doubled, and checksums are corrected up to any level.
//!
//! Where no checksum was corrected, a query either is refused or gives the answer of the undamaged file. Where some
//! were, a query ends in little time with an answer or an error. `CBVH_TEST_DEPTH` increases the number of files.

use crate::common::asked::{Answers, ask, victims};
use crate::common::shapes::sphere;
use crate::common::{Random, mesh, queriers, random_pose, translation};
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes, verify};
use bvh_format::validate::validate;
use bvh_query::{Bvh, Pose, QueryError, Ray};
use cbvh_testkit::damage::damage;
use cbvh_testkit::depth::rounds;
use cbvh_testkit::forge::forge_any;
use cbvh_testkit::seal::Seal;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The number of files in an everyday run.
const FILES: u64 = 8000;

/// Returns the outcome for one file, as a row of the table that the test prints.
fn outcome(answers: &Option<[Answers; 2]>, expected: &[Answers; 2]) -> &'static str {
    match answers {
        None => "refused when opened",
        Some(answers) if answers.iter().any(Answers::is_refused) => "refused when asked",
        Some(answers) if answers == expected => "the same answers",
        Some(_) => "other answers",
    }
}

#[test]
fn no_mutation_does_harm() {
    let files = rounds(FILES);
    let cube: Mesh = mesh(&sphere(1));
    let good = Bvh::from_bytes(to_bytes(&cube, &Options::default()).unwrap().0).unwrap();
    let poses = [Pose::IDENTITY, translation(1.5, 0.25, 0.0), random_pose(&mut Random::new(3), 2.5)];
    let mut queriers = queriers();
    let mut random = Random::new(79);
    let victims = victims();
    let expected: Vec<_> = victims
        .iter()
        .map(|victim| poses.map(|pose| ask(&mut queriers[0], victim, &good, &pose).unwrap()))
        .collect();
    let mut table: BTreeMap<_, u64> = BTreeMap::new();
    let mut slowest = Duration::ZERO;
    for number in 0..files {
        let (which, pose) = (random.below(victims.len()), random.below(poses.len()));
        let mut bytes = victims[which].clone();
        let other = &victims[random.below(victims.len())];
        let mut how = damage(&mut bytes, other, &mut random);
        while random.below(4) == 0 && bytes.len() > 4096 {
            how = damage(&mut bytes, other, &mut random);
        }
        let seal = Seal::ALL[random.below(Seal::ALL.len())];
        seal.apply(&mut bytes);
        let whole = validate(&bytes);
        if number % 8 == 0 {
            assert!(verify(&bytes, &cube).is_err(), "file {number}: it is not a file of this mesh");
        }
        let backend = random.below(queriers.len());
        let start = Instant::now();
        let answers = ask(&mut queriers[backend], &bytes, &good, &poses[pose]);
        slowest = slowest.max(start.elapsed());
        let context = || format!("file {number}, {how}, {seal:?}, pose {pose}");
        assert!(answers.is_some() || whole.is_err(), "{}", context());
        let expected = &expected[which][pose];
        for (answers, expected) in answers.iter().flatten().zip(expected) {
            assert!(whole.is_err() || !answers.is_refused(), "{}: {answers:?}", context());
            let holds = seal != Seal::None || answers.are_refused_or(expected);
            assert!(holds, "{}: {answers:?}, not {expected:?}", context());
        }
        *table.entry((seal, outcome(&answers, expected))).or_default() += 1;
    }
    for ((seal, outcome), count) in &table {
        println!("{:<10} {outcome:<20} {count}", format!("{seal:?}"));
    }
    println!("{files} files, the slowest took {slowest:?}");
    let count = |seal, outcome| table.get(&(seal, outcome)).copied().unwrap_or(0);
    assert_eq!(count(Seal::None, "other answers"), 0);
    // Every way of damaging files occurs, and often.
    for (seal, outcome) in [
        (Seal::None, "refused when opened"),
        (Seal::None, "refused when asked"),
        (Seal::None, "the same answers"),
        (Seal::All, "refused when opened"),
        (Seal::All, "refused when asked"),
        (Seal::All, "other answers"),
    ] {
        assert!(count(seal, outcome) * 500 > files, "{seal:?}: {outcome}");
    }
    assert!(slowest < Duration::from_secs(20), "{slowest:?}");
}

/// Fills trees of the right shape with arbitrary content, and queries them in pairs.
#[test]
fn forged_pairs_do_no_harm() {
    let pairs = rounds(FILES / 10);
    let mut queriers = queriers();
    let mut random = Random::new(80);
    let (mut opened, mut answered, mut slowest) = (0, 0, Duration::ZERO);
    for _ in 0..pairs {
        let (a, b) = (forge_any(&mut random), forge_any(&mut random));
        let (a_valid, b_valid) = (validate(&a).is_ok(), validate(&b).is_ok());
        let Ok(b) = Bvh::from_bytes(b) else { continue };
        let closed = b.is_closed(0);
        assert!(matches!(closed, Ok(_) | Err(QueryError::NoTopology)) || !b_valid, "valid, but {closed:?}");
        let pose = random_pose(&mut random, 4.0);
        let backend = random.below(queriers.len());
        let start = Instant::now();
        let answers = ask(&mut queriers[backend], &a, &b, &pose);
        slowest = slowest.max(start.elapsed());
        opened += u64::from(answers.is_some());
        if let Some(answers) = answers {
            let refused = answers.iter().any(Answers::is_refused);
            assert!(!refused || !a_valid || !b_valid, "valid, but {answers:?}");
            answered += u64::from(!refused);
        }
    }
    println!("{pairs} forged pairs: {opened} opened, {answered} answered, the slowest took {slowest:?}");
    assert!(opened * 2 > pairs && answered * 20 > pairs, "{opened} opened, {answered} answered");
    assert!(slowest < Duration::from_secs(20), "{slowest:?}");
}

/// Asks so often about forged and damaged files that rays have trees of boxes, if there can be any.
#[test]
fn rays_along_trees_of_forged_files_do_no_harm() {
    let files = rounds(FILES / 8);
    let (mut random, victims) = (Random::new(81), victims());
    let mut queriers = queriers();
    let (mut opened, mut answered, mut slowest) = (0, 0, Duration::ZERO);
    for number in 0..files {
        let mut bytes = victims[random.below(victims.len())].clone();
        if number % 2 == 0 {
            bytes = forge_any(&mut random);
        } else {
            let other = &victims[random.below(victims.len())];
            damage(&mut bytes, other, &mut random);
            Seal::All.apply(&mut bytes);
        }
        let Ok(bvh) = Bvh::from_bytes(bytes) else { continue };
        opened += 1;
        let which = random.below(queriers.len());
        let querier = &mut queriers[which];
        let start = Instant::now();
        for round in 0..60 {
            let origin = random.point().map(|x| x * 2f64.powi(3 * (round % 5)));
            let direction = [(); 3].map(|()| random.below(5) as f64 - 2.0);
            let direction = if direction == [0.0; 3] { [1.0; 3] } else { direction };
            let ray = Ray::new(origin, direction);
            let segment = querier.segment_hit(&bvh, origin, direction);
            let rounded = bvh.all().rounded(0.25).unwrap();
            answered += u64::from(querier.first_hit(&bvh, &ray).is_ok() && segment.is_ok());
            let _ = (querier.any_hit(rounded, &ray), querier.first_hit(rounded, &ray));
        }
        slowest = slowest.max(start.elapsed());
    }
    println!("{files} files: {opened} opened, {answered} rays answered, the slowest took {slowest:?}");
    assert!(opened * 4 > files && answered > files, "{opened} opened, {answered} answered");
    assert!(slowest < Duration::from_secs(20), "{slowest:?}");
}
