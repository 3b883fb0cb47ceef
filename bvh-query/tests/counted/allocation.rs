//! Checks that a warm query allocates nothing. The allocator itself counts.

use crate::allocator::allocations;
use crate::common::baked;
use crate::common::shapes::{moved, terrain};
use bvh_query::{Pose, Querier, Ray, Tracker};
use std::ops::ControlFlow;

#[test]
fn warm_queries_allocate_nothing() {
    let bvh = baked(&moved(&terrain(40, 1), 20.0, [20.0, 20.0, 0.0]));
    let mut querier = Querier::new().unwrap();
    let poses: Vec<Pose> = (0..20)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * 0.3).sin_cos();
            let turn = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
            Pose::new(turn, [f64::from(i), -3.0, f64::from(i % 5) * 0.2]).unwrap()
        })
        .collect();
    let mut ask = |poses: &[Pose]| {
        let mut answers = 0.0;
        let mut tracker = Tracker::new();
        for pose in poses {
            answers += f64::from(u8::from(querier.collide(&bvh, &bvh, pose).unwrap()));
            answers += querier.distance(&bvh, &bvh, pose).unwrap().distance;
            answers += f64::from(u8::from(querier.within(&bvh, &bvh, pose, 0.1).unwrap()));
            answers +=
                querier.visit_contacts(&bvh, &bvh, pose, |_| ControlFlow::Continue(())).unwrap() as f64;
            let (at, point) = (bvh.all().at(pose), [0.3, 0.2, 0.7]);
            answers += querier.closest_point(at, point, f64::INFINITY).unwrap().unwrap().distance;
            answers += f64::from(querier.side(at, point).unwrap() as u8);
            answers +=
                querier.first_hit(at, &Ray::new(point, [0.1, 0.2, -0.9])).unwrap().map_or(0.0, |hit| hit.t);
            answers += f64::from(u8::from(querier.segment_hit(at, point, [0.9, -0.7, -0.8]).unwrap()));
            answers += f64::from(u8::from(tracker.collide(&mut querier, &bvh, &bvh, pose).unwrap()));
            answers += tracker.distance(&mut querier, &bvh, &bvh, pose).unwrap().distance;
            answers += f64::from(u8::from(tracker.within(&mut querier, &bvh, &bvh, pose, 0.1).unwrap()));
        }
        answers
    };
    // Often enough for rays to have their tree.
    let cold = (0..40).map(|_| ask(&poses)).fold(0.0, |_, answers| answers);
    let before = allocations();
    let warm = ask(&poses);
    assert_eq!(allocations(), before);
    assert_eq!(warm, cold);
    // The counter counts.
    drop(std::hint::black_box(vec![0u8; 100]));
    assert!(allocations() > before);
}
