//! Answers about robots come back from JSON as they were, to the bit.

use crate::questions::{cell, random_values};
use bvh_query::{MotionOptions, PenetrationOptions};
use cbvh_robot::{Base, Edge, NearPair, RobotDistance, RobotMotion, RobotSignedDistance};
use cbvh_testkit::Random;
use std::collections::BTreeSet;

/// Checks that a value comes back.
macro_rules! comes_back {
    ($type:ty, $value:expr) => {{
        let (value, text) = ($value, serde_json::to_string(&$value).unwrap());
        assert_eq!(serde_json::from_str::<$type>(&text).unwrap(), value, "{text}");
    }};
}

#[test]
fn answers_come_back() {
    let mut robot = cell(Base::Fixed);
    let mut random = Random::new(5);
    let (mut kinds, mut pairs) = (BTreeSet::new(), 0);
    for _ in 0..30 {
        let (q, end) = (random_values(&mut random, &robot), random_values(&mut random, &robot));
        let depth = PenetrationOptions::new();
        comes_back!(Option<RobotDistance>, robot.distance(&q).unwrap());
        comes_back!(Option<RobotSignedDistance>, robot.signed_distance(&q, &depth).unwrap());
        let near = robot.near_pairs(&q, 0.3, &depth).unwrap();
        pairs += near.len();
        comes_back!(Vec<NearPair>, near.clone());
        for options in [MotionOptions::new(), MotionOptions::new().tolerance(0.3)] {
            let motion = robot.motion(&Edge::straight(&q, &end).unwrap(), &options).unwrap();
            kinds.insert(match motion {
                RobotMotion::Free => "free",
                RobotMotion::Hit { .. } => "hit",
                _ => "near",
            });
            comes_back!(RobotMotion, motion.clone());
        }
    }
    assert!(pairs > 0 && kinds.len() == 3, "{pairs} pairs, {kinds:?}");
}
