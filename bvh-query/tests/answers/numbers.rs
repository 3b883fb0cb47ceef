//! Numbers that mean nothing are refused by every question, with an error that names what was found and what is expected.

use crate::common::baked;
use bvh_query::{Bvh, DistanceOptions, PatchOptions, Pose, Querier, QueryError, Tracker};

const MEANINGLESS: [f64; 5] = [f64::NAN, -1.0, -f64::MIN_POSITIVE, f64::INFINITY, f64::NEG_INFINITY];

fn triangle() -> Bvh {
    baked(&[[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
}

/// Panics unless `answer` refuses `number`, given as `name`.
fn check_refused<T: std::fmt::Debug>(answer: Result<T, QueryError>, name: &str, number: f64) {
    let text = answer.unwrap_err().to_string();
    assert!(text.starts_with(&format!("{name}: expected a finite ")), "{text}");
    assert!(text.ends_with(&format!(" of at least 0, found {number}")), "{text}");
}

#[test]
fn distances_to_compare_with_are_finite_and_at_least_0() {
    let (mesh, pose) = (triangle(), Pose::IDENTITY);
    let (mut querier, mut tracker) = (Querier::new().unwrap(), Tracker::new());
    for d in MEANINGLESS {
        check_refused(querier.within(&mesh, &mesh, &pose, d), "d", d);
        check_refused(tracker.within(&mut querier, &mesh, &mesh, &pose, d), "d", d);
    }
    for d in [0.0, -0.0, f64::MIN_POSITIVE, f64::MAX] {
        assert_eq!(querier.within(&mesh, &mesh, &pose, d), Ok(true));
        assert_eq!(tracker.within(&mut querier, &mesh, &mesh, &pose, d), Ok(true));
    }
}

#[test]
#[cfg(feature = "parallel")]
fn batches_check_the_distance_even_without_poses() {
    let mesh = triangle();
    let batch = bvh_query::Batch::new(&mesh, &mesh).unwrap();
    for d in MEANINGLESS {
        check_refused(batch.within(&[Pose::IDENTITY], d), "d", d);
        check_refused(batch.within(&[], d), "d", d);
    }
}

#[test]
fn allowed_errors_are_finite_and_at_least_0() {
    let (mesh, pose) = (triangle(), Pose::IDENTITY);
    let mut querier = Querier::new().unwrap();
    for number in MEANINGLESS {
        let options = DistanceOptions::new().rel_err(number);
        check_refused(querier.distance_with(&mesh, &mesh, &pose, &options), "rel_err", number);
        let options = DistanceOptions::new().abs_err(number);
        check_refused(querier.distance_with(&mesh, &mesh, &pose, &options), "abs_err", number);
    }
    let options = DistanceOptions::new().rel_err(f64::MAX).abs_err(f64::MAX);
    assert_eq!(querier.distance_with(&mesh, &mesh, &pose, &options).unwrap().distance, 0.0);
}

#[test]
fn a_budget_of_0_is_no_answer() {
    let mesh = triangle();
    let mut querier = Querier::new().unwrap();
    querier.set_budget(0);
    assert_eq!(querier.collide(&mesh, &mesh, &Pose::IDENTITY), Err(QueryError::Budget { visits: 0 }));
}

#[test]
fn bytes_may_have_any_owner() {
    let mesh = triangle();
    let bytes = mesh.bytes().to_vec();
    let shared: std::sync::Arc<[u8]> = bytes.clone().into();
    let mut shifted = vec![0];
    shifted.extend_from_slice(&bytes);
    let leaked: &'static [u8] = shifted.leak();
    let mut querier = Querier::new().unwrap();
    let owners = [Bvh::from_bytes(bytes), Bvh::from_bytes(shared.clone()), Bvh::from_bytes(&leaked[1..])];
    for owner in owners {
        assert_eq!(querier.collide(&owner.unwrap(), &mesh, &Pose::IDENTITY), Ok(true));
    }
    assert_eq!(std::sync::Arc::strong_count(&shared), 1, "a closed file gives its bytes back");
}

#[test]
fn tolerances_of_patches_are_finite_and_at_least_0() {
    let (mesh, pose) = (triangle(), Pose::IDENTITY);
    let mut querier = Querier::new().unwrap();
    for number in MEANINGLESS {
        let options = PatchOptions::new().tolerance(number);
        check_refused(querier.patches(&mesh, &mesh, &pose, &options), "tolerance", number);
    }
    for number in [0.0, -0.0, f64::MIN_POSITIVE, f64::MAX] {
        let options = PatchOptions::new().tolerance(number);
        assert_eq!(querier.patches(&mesh, &mesh, &pose, &options).unwrap().patches.len(), 1);
    }
}
