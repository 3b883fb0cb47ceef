//! Checks that a flag stops queries: before they begin, from another thread, and in batches and scenes; and that a flag that is
//! not set changes no answer and no budget.

use crate::common::shapes::{cube, moved, soup, torus};
use crate::common::{Random, Triangle, backends, baked, random_pose, translation};
use bvh_query::{
    Bvh, ClashOptions, DistanceOptions, Motion, MotionOptions, OwnedShape, PatchOptions, PenetrationOptions,
    Pose, Querier, QueryError, Ray, Scene, SceneError, Tracker,
};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

fn flag(is_set: bool) -> Arc<AtomicBool> {
    Arc::new(AtomicBool::new(is_set))
}

/// Triangles that all contain a point, each beside the others: of two such meshes, all pairs touch.
fn fan(count: usize) -> Vec<Triangle> {
    (0..count).map(|n| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [n as f64, 1.0, 0.0]]).collect()
}

#[test]
fn a_query_that_is_stopped_does_not_begin() {
    let (a, b) = (baked(&cube()), baked(&moved(&cube(), 0.75, [0.25, 0.0, 0.5])));
    let pose = &Pose::IDENTITY;
    let motion = Motion::between(&translation(9.0, 0.0, 0.0), pose).unwrap();
    for backend in backends() {
        let mut querier = Querier::with_backend(backend);
        let stop = flag(true);
        querier.set_stop(Some(stop.clone()));
        let stopped = QueryError::Stopped;
        assert_eq!(querier.collide(&a, &b, pose), Err(stopped.clone()));
        assert_eq!(querier.contacts(&a, &b, pose), Err(stopped.clone()));
        assert_eq!(querier.patches(&a, &b, pose, &PatchOptions::new()).err(), Some(stopped.clone()));
        assert_eq!(querier.distance(&a, &b, pose), Err(stopped.clone()));
        assert_eq!(querier.within(&a, &b, pose, 1.0), Err(stopped.clone()));
        assert_eq!(querier.relation(&a, &b, pose), Err(stopped.clone()));
        assert_eq!(
            querier.penetration(&a, &b, pose, &PenetrationOptions::new()).err(),
            Some(stopped.clone())
        );
        assert_eq!(querier.clash(&a, &b, pose, &ClashOptions::new()).err(), Some(stopped.clone()));
        assert_eq!(querier.self_contacts(&a), Err(stopped.clone()));
        assert_eq!(querier.is_free(&a, &b, &motion, &MotionOptions::new()), Err(stopped.clone()));
        assert_eq!(querier.closest_point(&a, [3.0; 3], f64::INFINITY), Err(stopped.clone()));
        assert_eq!(querier.side(&a, [0.1; 3]), Err(stopped.clone()));
        assert_eq!(querier.first_hit(&a, &Ray::new([9.0; 3], [-1.0; 3])), Err(stopped.clone()));
        assert_eq!(Tracker::new().collide(&mut querier, &a, &b, pose), Err(stopped.clone()));
        // It stops what the flag is set for, and a budget does not remove it.
        querier.set_budget(1 << 40);
        assert_eq!(querier.collide(&a, &b, pose), Err(stopped));
        stop.store(false, Ordering::Relaxed);
        assert_eq!(querier.collide(&a, &b, pose), Ok(true));
        stop.store(true, Ordering::Relaxed);
        querier.set_stop(None);
        assert_eq!(querier.collide(&a, &b, pose), Ok(true));
    }
}

#[test]
#[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads here")]
fn another_thread_stops_a_query_under_way() {
    const COUNT: usize = 512;
    let mesh = baked(&fan(COUNT));
    let stop = flag(false);
    let mut querier = Querier::new().unwrap();
    querier.set_stop(Some(stop.clone()));
    let mut contacts = 0;
    let asked = querier.visit_contacts(&mesh, &mesh, &Pose::IDENTITY, |_| {
        if contacts == 0 {
            let stop = stop.clone();
            std::thread::spawn(move || stop.store(true, Ordering::Relaxed)).join().unwrap();
        }
        contacts += 1;
        ControlFlow::Continue(())
    });
    assert_eq!(asked, Err(QueryError::Stopped));
    // The flag is read again after at most 256 visits, each of which reports at most 16 pairs.
    assert!((1..COUNT * COUNT / 8).contains(&contacts), "{contacts}");
    stop.store(false, Ordering::Relaxed);
    let all = querier.visit_contacts(&mesh, &mesh, &Pose::IDENTITY, |_| ControlFlow::Continue(()));
    assert_eq!(all, Ok((COUNT * COUNT) as u64));
}

#[test]
fn a_flag_that_is_not_set_changes_no_answer_and_no_budget() {
    let (a, b, c) = (baked(&soup(2000, 4)), baked(&torus(40, 30)), baked(&torus(8, 6)));
    let mut random = Random::new(7);
    let mut plain = Querier::new().unwrap();
    let mut flagged = Querier::new().unwrap();
    flagged.set_stop(Some(flag(false)));
    let mut refused = 0;
    for budget in [u64::MAX, 3000, 1000, 300, 256, 255, 100, 10, 1, 0] {
        plain.set_budget(budget);
        flagged.set_budget(budget);
        for _ in 0..20 {
            let pose = &random_pose(&mut random, 1.5);
            let motion = Motion::between(pose, &random_pose(&mut random, 1.5)).unwrap();
            let ask = |querier: &mut Querier| {
                (
                    querier.contacts(&a, &b, pose),
                    querier.distance(&a, &b, pose),
                    querier.distance_with(&a, &b, pose, &DistanceOptions::new().rel_err(0.1)),
                    querier.penetration(&c, &c, pose, &PenetrationOptions::new()),
                    querier.is_free(&a, &b, &motion, &MotionOptions::new()),
                    querier.closest_point(&a, pose.translation(), f64::INFINITY),
                    querier.first_hit(&a, &Ray::new(pose.translation(), [-1.0, 0.5, 0.25])),
                )
            };
            let (expected, found) = (ask(&mut plain), ask(&mut flagged));
            assert_eq!(found, expected, "{budget}");
            refused += usize::from(matches!(expected.0, Err(QueryError::Budget { .. })));
        }
    }
    assert!((20..180).contains(&refused), "{refused}");
}

#[test]
fn scenes_are_stopped() {
    let shape: OwnedShape = baked(&cube()).into();
    let mut scene = Scene::new().unwrap();
    for x in 0..4 {
        scene.add(shape.clone(), translation(f64::from(x) / 2.0, 0.0, 0.0)).unwrap();
    }
    let expected = scene.pairs_in_contact().unwrap();
    assert!(!expected.is_empty());
    let stop = flag(true);
    scene.set_stop(Some(stop.clone()));
    let is_stopped = |error: &SceneError| match error {
        SceneError::Pair { source, .. } | SceneError::Query(source) => *source == QueryError::Stopped,
        _ => false,
    };
    assert!(scene.collide().is_err_and(|error| is_stopped(&error)));
    assert!(scene.pairs_in_contact().is_err_and(|error| is_stopped(&error)));
    assert!(scene.clone().distance().is_err_and(|error| is_stopped(&error)));
    stop.store(false, Ordering::Relaxed);
    assert_eq!(scene.pairs_in_contact().unwrap(), expected);
}

#[test]
#[cfg(feature = "parallel")]
fn batches_are_stopped() {
    let mesh = baked(&cube());
    let poses = vec![Pose::IDENTITY; 400];
    let rays = vec![Ray::new([9.0, 0.125, 0.25], [-1.0, 0.0, 0.0]); 400];
    for threads in [1, 3] {
        cbvh_testkit::pool(threads).install(|| {
            let stop = flag(true);
            let mut batch = bvh_query::Batch::new(&mesh, &mesh).unwrap();
            batch.set_stop(Some(stop.clone()));
            let mut probes = bvh_query::ProbeBatch::new(&mesh).unwrap();
            // Later, they walk along boxes, which makes no visits.
            for _ in 0..20 {
                assert!(probes.first_hits(&rays).is_ok());
            }
            probes.set_stop(Some(stop.clone()));
            assert_eq!(batch.collide(&poses), Err(QueryError::Stopped));
            assert_eq!(probes.first_hits(&rays), Err(QueryError::Stopped));
            assert_eq!(probes.closest_points(&[[9.0; 3]], f64::INFINITY), Err(QueryError::Stopped));
            stop.store(false, Ordering::Relaxed);
            assert_eq!(batch.collide(&poses), Ok(vec![true; 400]));
            assert!(probes.first_hits(&rays).is_ok());
        });
    }
}

#[test]
fn one_flag_stops_bakes_and_queries() {
    let mesh = bvh_bake::shapes::block([2.0; 3]).unwrap();
    let stop = flag(false);
    let options = bvh_bake::Options::default().stop(Some(stop.clone()));
    let (bytes, _) = bvh_bake::to_bytes(&mesh, &options).unwrap();
    let block = Bvh::from_bytes(bytes).unwrap();
    let mut querier = Querier::new().unwrap();
    querier.set_stop(options.stop.clone());
    assert_eq!(querier.collide(&block, &block, &Pose::IDENTITY), Ok(true));
    stop.store(true, Ordering::Relaxed);
    assert!(matches!(bvh_bake::to_bytes(&mesh, &options), Err(bvh_bake::BakeError::Stopped)));
    assert_eq!(querier.collide(&block, &block, &Pose::IDENTITY), Err(QueryError::Stopped));
    // Flags are equal only to themselves.
    assert_eq!(options, options.clone());
    assert_ne!(options, bvh_bake::Options::default().stop(Some(flag(true))));
}

#[test]
fn a_function_stops_a_query() {
    const COUNT: usize = 512;
    let mesh = baked(&fan(COUNT));
    let mut querier = Querier::new().unwrap();
    let all = querier.contacts(&mesh, &mesh, &Pose::IDENTITY).unwrap();
    assert_eq!(all.len(), COUNT * COUNT);
    let reads = Arc::new(AtomicUsize::new(0));
    let counted = reads.clone();
    querier.set_stop(Some(Arc::new(move || counted.fetch_add(1, Ordering::Relaxed) == 3)));
    assert_eq!(querier.contacts(&mesh, &mesh, &Pose::IDENTITY), Err(QueryError::Stopped));
    assert_eq!(reads.load(Ordering::Relaxed), 4);
    assert_eq!(querier.contacts(&mesh, &mesh, &Pose::IDENTITY), Ok(all));
    // A time that has passed.
    let end = Instant::now();
    querier.set_stop(Some(Arc::new(move || Instant::now() >= end)));
    assert_eq!(querier.collide(&mesh, &mesh, &Pose::IDENTITY), Err(QueryError::Stopped));
}
