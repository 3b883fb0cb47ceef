//! Pairs that are near: which ones are asked about, many configurations at once, and bad numbers.

use crate::questions::{arm, at, block, cell, random_values};
use bvh_query::{Backend, NumberError, PenetrationOptions, QueryError};
use cbvh_robot::{Base, NearPair, Robot, RobotError};
use cbvh_testkit::Random;

fn near(robot: &mut Robot, q: &[f64], margin: f64) -> Vec<NearPair> {
    robot.near_pairs(q, margin, &PenetrationOptions::new()).unwrap()
}

fn bodies(pairs: &[NearPair]) -> Vec<[String; 2]> {
    pairs.iter().map(|pair| pair.bodies.clone()).collect()
}

#[test]
fn near_pairs_agree_with_other_questions() {
    let (random, options) = (&mut Random::new(61), PenetrationOptions::new());
    for base in [Base::Fixed, Base::Planar, Base::Floating] {
        let mut robot = cell(base);
        let (mut rows, mut answers, mut counts) = (Vec::new(), Vec::new(), [0; 3]);
        for round in 0..60 {
            let mut q = random_values(random, &robot);
            if base == Base::Floating {
                q[3..7].copy_from_slice(&random.quaternion());
            }
            let found = near(&mut robot, &q, 0.1);
            // The pairs in contact are among them, and are those at a margin of 0.
            let touching = robot.pairs_in_contact(&q).unwrap();
            let at_zero = near(&mut robot, &q, 0.0);
            assert!(touching.iter().all(|pair| bodies(&at_zero).contains(pair)), "round {round}");
            assert!(at_zero.iter().all(|pair| found.contains(pair)), "round {round}");
            // So is the pair with the least signed distance, to the bit.
            let least = robot.signed_distance(&q, &options).unwrap().unwrap();
            if least.nearest.upper < 0.1 {
                let same = found.iter().find(|pair| pair.bodies == least.bodies).unwrap();
                assert_eq!(same.nearest, least.nearest, "round {round}");
            } else {
                assert_eq!(found, []);
            }
            // With a large margin, all pairs are near.
            assert_eq!(bodies(&near(&mut robot, &q, 99.0)), robot.pairs());
            for pair in &found {
                counts[usize::from(pair.nearest.distance <= 0.0)] += 1;
                counts[2] += usize::from(pair.gradient.iter().any(|slope| *slope != 0.0));
            }
            rows.extend(q);
            answers.push(found);
        }
        assert!(counts.iter().all(|&count| count > 10), "{counts:?}");
        for threads in [1, 3] {
            let pool = cbvh_testkit::pool(threads);
            let many = pool.install(|| robot.near_pairs_many(&rows, 0.1, &options)).unwrap();
            assert_eq!(many, answers);
        }
        robot.set_backend(Backend::Scalar);
        assert_eq!(robot.near_pairs_many(&rows, 0.1, &options).unwrap(), answers);
    }
}

#[test]
fn near_pairs_follow_what_is_added_removed_and_allowed() {
    let mut robot = arm(Base::Fixed);
    for pair in robot.pairs() {
        robot.allow(&pair[0], &pair[1]).unwrap();
    }
    let q = [0.0; 4];
    assert_eq!(near(&mut robot, &q, 9.0), []);
    // A cube of side 0.02 hangs 0.1 above the hand, which carries a tool as long as that.
    let top = near_top(&mut robot, &q);
    robot.add_obstacle("lamp", block([0.02; 3]), &at([0.0, 0.0, top + 0.11])).unwrap();
    let [pair] = &near(&mut robot, &q, 0.15)[..] else { panic!("expected one pair") };
    assert_eq!(pair.bodies, ["hand", "lamp"]);
    assert!((pair.nearest.distance - 0.1).abs() < 1e-9 && pair.nearest.normal[2] > 1.0 - 1e-9, "{pair:?}");
    assert_eq!(near(&mut robot, &q, 0.09), []);
    // Margins of bodies are a part of them.
    robot.set_margin("lamp", 0.02).unwrap();
    let [pair] = &near(&mut robot, &q, 0.09)[..] else { panic!("expected one pair") };
    assert!((pair.nearest.distance - 0.08).abs() < 1e-9, "{pair:?}");
    robot.set_margin("lamp", 0.0).unwrap();
    robot.attach("tool", block([0.01, 0.01, 0.06]), "hand", &at([0.0, 0.0, 0.0]), &[]).unwrap();
    let all = near(&mut robot, &q, 9.0);
    assert!(bodies(&all).contains(&["lamp", "tool"].map(str::to_owned)));
    assert!(!bodies(&all).contains(&["hand", "tool"].map(str::to_owned)));
    robot.allow("hand", "lamp").unwrap();
    robot.remove("tool").unwrap();
    assert_eq!(near(&mut robot, &q, 0.15), []);
    robot.disallow("hand", "lamp").unwrap();
    assert_eq!(near(&mut robot, &q, 0.15).len(), 1);
    robot.remove("lamp").unwrap();
    assert_eq!(near(&mut robot, &q, 9.0), []);
}

/// Returns how high the hand reaches.
fn near_top(robot: &mut Robot, q: &[f64]) -> f64 {
    robot.add_obstacle("sky", block([9.0, 9.0, 1.0]), &at([0.0, 0.0, 5.5])).unwrap();
    let distance = robot.signed_distance(q, &PenetrationOptions::new()).unwrap().unwrap().nearest.distance;
    robot.remove("sky").unwrap();
    5.0 - distance
}

#[test]
fn bad_numbers_are_refused() {
    let options = PenetrationOptions::new();
    let mut robot = cell(Base::Fixed);
    for bad in [-1.0, -1e-300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let margin = |answer: Option<RobotError>| {
            matches!(answer, Some(RobotError::Query(QueryError::Number(NumberError::Margin(_)))))
        };
        assert!(margin(robot.near_pairs(&[0.0; 4], bad, &options).err()), "{bad}");
        assert!(margin(robot.near_pairs_many(&[], bad, &options).err()), "{bad}");
        for options in [options.relative_gap(bad), options.tolerance(bad)] {
            assert!(matches!(robot.near_pairs(&[0.0; 4], 1.0, &options), Err(RobotError::Query(_))), "{bad}");
            assert!(matches!(robot.near_pairs_many(&[], 1.0, &options), Err(RobotError::Query(_))), "{bad}");
        }
        if !bad.is_finite() {
            assert!(matches!(
                robot.near_pairs(&[0.0, bad, 0.0, 0.0], 1.0, &options),
                Err(RobotError::Value { .. })
            ));
        }
    }
    assert!(matches!(robot.near_pairs(&[0.0; 3], 1.0, &options), Err(RobotError::Count { .. })));
    assert!(matches!(robot.near_pairs_many(&[0.0; 6], 1.0, &options), Err(RobotError::Count { .. })));
    assert_eq!(robot.near_pairs_many(&[], 1.0, &options).unwrap(), Vec::<Vec<NearPair>>::new());
    // A margin that is beyond all numbers of the world is only large.
    assert_eq!(robot.near_pairs(&[0.0; 4], f64::MAX, &options).unwrap().len(), robot.pairs().len());
}
