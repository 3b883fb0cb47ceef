//! Asks two forged files every query in any pose, on every backend, and a forged scene the questions over its pairs. Answers may be wrong, but each query must end.
#![no_main]

use bvh_query::{Backend, Bvh, DistanceOptions, PenetrationOptions, Pose, Querier, Ray, Scene};
use cbvh_testkit::forge::{Input, forge};
use libfuzzer_sys::fuzz_target;
use std::ops::ControlFlow;

/// Rotations that are exact, and one that is not.
const TURNS: [[[f64; 3]; 3]; 4] = [
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]],
];

fuzz_target!(|bytes: &[u8]| {
    let mut input = Input(bytes);
    let turn = TURNS[input.below(TURNS.len())];
    let Ok(pose) = Pose::new(turn, [(); 3].map(|()| f64::from(input.value()))) else { return };
    let (near, allowed) = (f64::from(input.value()), f64::from(input.value()).abs());
    let forged = Bvh::from_bytes(forge(&mut Input(input.0))).ok();
    if let Some(mut scene) = forged.and_then(|bvh| Scene::of_file(bvh).ok()) {
        scene.set_budget(1 << 16);
        let _ = (scene.pairs_in_contact(), scene.distance(), scene.pairs_within(near));
        let _ = (scene.closest_points(&[[near; 3]], f64::INFINITY), scene.sides(&[[near; 3]]));
    }
    let (Ok(a), Ok(b)) = (Bvh::from_bytes(forge(&mut input)), Bvh::from_bytes(forge(&mut input))) else {
        return;
    };
    for backend in Backend::ALL {
        let mut querier = Querier::with_backend(backend);
        let _ = (a.is_closed(0), querier.collide(&a, &b, &pose));
        let mut contacts = 0;
        let _ = querier.visit_contacts(&a, &b, &pose, |_| {
            contacts += 1;
            if contacts < 100 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        let _ = querier.distance(&a, &b, &pose);
        let options = DistanceOptions::new().rel_err(allowed).abs_err(allowed);
        let _ = querier.distance_with(&a, &b, &pose, &options);
        let _ = querier.within(&a, &b, &pose, near);
        let _ = querier.relation(&a, &b, &pose);
        querier.set_budget(1 << 16);
        let _ = querier.intersection(&a, &b, &pose);
        let _ = querier.intersection_surface(&a, &b, &pose);
        let options = PenetrationOptions::new().tolerance(allowed);
        let _ = querier.signed_distance(&a, &b, &pose, &options);
        let _ = querier.signed_distance_within(&a, &b, &pose, near, &options);
        querier.set_budget(u64::MAX);
        let (shape, point, away) = (a.all().at(&pose), [near, 0.0, allowed], pose.translation());
        let _ = (querier.closest_point(shape, point, f64::INFINITY), querier.side(shape, point));
        let _ = (querier.all_hits(shape, &Ray::new(point, away)), querier.segment_hit(shape, point, away));
    }
});
