//! Poses and answers come back from JSON as they were, to the bit, and numbers that make no pose are refused.

use crate::common::shapes::{cube, moved, soup};
use crate::common::{Random, baked, random_pose, translation};
use bvh_query::{ClashOptions, Motion, MotionOptions, PenetrationOptions, Pose, Querier, Ray};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: T) {
    let text = serde_json::to_string(&value).unwrap();
    assert_eq!(serde_json::from_str::<T>(&text).unwrap(), value, "{text}");
}

#[test]
fn poses_come_back_and_numbers_that_make_none_are_refused() {
    let mut random = Random::new(1);
    for _ in 0..100 {
        let pose = random_pose(&mut random, 1e3);
        comes_back(pose);
        // The text is that of the rows, which `from_rows` reads.
        let rows: [f64; 12] = serde_json::from_str(&serde_json::to_string(&pose).unwrap()).unwrap();
        assert_eq!(Pose::from_rows(&rows), Ok(pose));
    }
    let refused = |text: &str| serde_json::from_str::<Pose>(text).unwrap_err().to_string();
    let scaled = Pose::from_rows(&[2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0]).unwrap_err();
    assert_eq!(refused("[2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0]"), scaled.to_string());
    assert!(serde_json::from_str::<Pose>("[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]").is_err());
}

#[test]
fn answers_come_back() {
    let (a, b) = (baked(&cube()), baked(&moved(&cube(), 0.75, [0.25, 0.0, 0.5])));
    let mut querier = Querier::new().unwrap();
    let (deep, far) = (&Pose::IDENTITY, &translation(9.0, 1.0 / 3.0, 0.0));
    let motion = Motion::between(far, deep).unwrap();
    for pose in [deep, far] {
        comes_back(querier.contacts(&a, &b, pose).unwrap());
        comes_back(querier.distance(&a, &b, pose).unwrap());
        comes_back(querier.stats());
        comes_back(querier.relation(&a, &b, pose).unwrap());
        comes_back(querier.penetration(&a, &b, pose, &PenetrationOptions::new()).unwrap());
        comes_back(querier.signed_distance(&a, &b, pose, &PenetrationOptions::new()).unwrap());
        comes_back(querier.clash(&a, &b, pose, &ClashOptions::new().clearance(20.0)).unwrap());
    }
    comes_back(querier.self_contacts(&baked(&soup(50, 3))).unwrap());
    comes_back(querier.motion(&a, &b, &motion, &MotionOptions::new()).unwrap());
    comes_back(querier.closest_point(&a, [1.0 / 3.0, 7.0, 3.0], f64::INFINITY).unwrap());
    comes_back(querier.signed_point_distance(&a, [1.0 / 3.0, 0.1, 0.2], f64::INFINITY).unwrap());
    comes_back(querier.first_hit(&a, &Ray::new([9.0, 0.1, 0.2], [-1.0, 0.0, 0.0])).unwrap());
}
