//! Shapes that are swapped, and scenes that some threads change while others ask: each answer is that of one of the scenes.

use super::{Answers, ask, place, scenes, shape, shapes};
use crate::common::shapes::{cube, plate, sphere, torus};
use crate::common::{Random, backends, translation as at};
use bvh_query::{Groups, Pose, Ray, Scene};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A scene whose shapes were swapped answers as one that had them from the start, with what it remembers of the others.
#[test]
fn a_swapped_shape_is_that_of_a_new_scene() {
    let pool = cbvh_testkit::pool(2);
    let random = &mut Random::new(81);
    let shapes = shapes();
    let worlds: Vec<Pose> = (0..8).map(|_| place(random, &shapes[0], 2.0)).collect();
    let mut of: Vec<usize> = (0..8).map(|_| random.below(shapes.len())).collect();
    let mut scenes = scenes();
    let mut ids = Vec::new();
    let settle = |scene: &mut Scene, ids: &[bvh_query::InstanceId]| {
        scene.set_margin(ids[1], 0.2).unwrap();
        scene.set_pair_margin(ids[2], ids[3], 0.4).unwrap();
        scene.set_allowed(ids[0], ids[4], true).unwrap();
        scene.set_groups(ids[5], Groups { member: 1, meets: 1 }).unwrap();
        scene.attach(ids[6], ids[7]).unwrap();
    };
    for scene in &mut scenes {
        ids = of
            .iter()
            .zip(&worlds)
            .map(|(&of, world)| scene.add(shapes[of].clone(), *world).unwrap())
            .collect();
        settle(scene, &ids);
    }
    let (mut expected, mut changes) = (Answers::default(), 0);
    for _ in 0..8 {
        let swapped = random.below(8);
        of[swapped] = random.below(shapes.len());
        let mut made = Scene::new().unwrap();
        let same: Vec<_> = of
            .iter()
            .zip(&worlds)
            .map(|(&of, world)| made.add(shapes[of].clone(), *world).unwrap())
            .collect();
        assert_eq!(same, ids);
        settle(&mut made, &ids);
        let before = std::mem::replace(&mut expected, ask(&mut made));
        changes += usize::from(before != expected);
        for scene in &mut scenes {
            scene.set_shape(ids[swapped], shapes[of[swapped]].clone()).unwrap();
            assert_eq!(pool.install(|| ask(scene)), expected);
            assert_eq!((scene.margin(ids[1]), scene.pair_margin(ids[3], ids[2])), (Ok(0.2), Ok(0.4)));
            assert_eq!(scene.parent(ids[6]).unwrap().map(|(parent, _)| parent), Some(ids[7]));
        }
    }
    assert!(changes > 3, "{changes}");
}

/// Clones share what they hold until one changes: no change of one is seen by another, whichever changes.
#[test]
fn a_snapshot_stays_as_it_was() {
    let random = &mut Random::new(82);
    let (block, ball) = (shape(&cube()), shape(&sphere(2)));
    let mut scene = Scene::new().unwrap();
    let ids: Vec<_> = (0..6)
        .map(|k| scene.add_named(format!("{k}"), block.clone(), at(1.5 * f64::from(k), 0.0, 0.0)).unwrap())
        .collect();
    let first = ask(&mut scene);
    let mut snapshot = scene.snapshot();
    let mut differ = 0;
    for step in 0..40 {
        let before = ask(&mut scene);
        let mut now = scene.snapshot();
        let id = ids[random.below(5)];
        match step % 8 {
            0 => scene.set_pose(id, at(3.0 * random.signed(), 0.0, 0.0)).unwrap(),
            1 => scene.set_margin(id, random.signed().abs()).unwrap(),
            2 => scene.set_shape(id, if step % 16 == 2 { ball.clone() } else { block.clone() }).unwrap(),
            3 => scene.set_allowed(ids[0], id, step % 16 == 3).unwrap(),
            4 => scene.attach(ids[5], id).unwrap(),
            5 => scene.set_pair_margin(ids[1], id, 0.3).unwrap(),
            6 => scene.set_groups(id, Groups { member: 1 + step % 3, meets: 1 }).unwrap(),
            _ => {
                // A snapshot that changes does not change the scene either.
                let mut other = scene.snapshot();
                other.remove(id).unwrap();
                other.add_named("more", ball.clone(), Pose::IDENTITY).unwrap();
                assert_eq!((scene.find("more"), scene.len()), (None, 6));
                assert_eq!(ask(&mut scene), before);
            }
        }
        differ += usize::from(ask(&mut scene) != before);
        assert_eq!(ask(&mut now), before, "step {step}");
    }
    assert_eq!(ask(&mut snapshot), first);
    assert!(differ > 8, "{differ}");
    // One that keeps its memory becomes the same scene, with another backend as well.
    for backend in backends() {
        let mut own = Scene::with_backend(backend);
        own.add(ball.clone(), Pose::IDENTITY).unwrap();
        own.collide().unwrap();
        own.clone_from(&scene);
        assert_eq!((ask(&mut own), own.len(), own.find("3")), (ask(&mut scene), 6, Some(ids[3])));
    }
}

/// Many threads ask while one swaps a shape, its pose and its margin back and forth: each answer is one of two.
#[test]
#[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads here")]
fn threads_that_ask_get_one_scene_or_the_other() {
    let shapes = [shape(&torus(24, 12)), shape(&plate(6))];
    let ball = shape(&sphere(3));
    let mut scene = Scene::new().unwrap();
    scene.set_tracking(true);
    for k in 0..12 {
        scene.add(ball.clone(), at(2.3 * f64::from(k % 4), 2.3 * f64::from(k / 4), 0.0)).unwrap();
    }
    let swapped = scene.add(shapes[0].clone(), Pose::IDENTITY).unwrap();
    let carried = scene.add(ball, at(0.0, 0.0, 2.5)).unwrap();
    scene.attach(carried, swapped).unwrap();
    let change = |scene: &mut Scene, which: usize| {
        scene.set_shape(swapped, shapes[which].clone()).unwrap();
        scene.set_pose(swapped, at(3.0 * which as f64, 1.0, 0.25)).unwrap();
        scene.set_margin(swapped, 0.25 * which as f64).unwrap();
    };
    let rays = [Ray::new([3.0, 1.0, 9.0], [0.0, 0.0, -1.0]), Ray::new([0.5, 1.0, 9.0], [0.0, 0.1, -1.0])];
    let all = |scene: &mut Scene| (ask(scene), scene.first_hits(&rays).unwrap());
    let expected = [0, 1].map(|which| {
        change(&mut scene, which);
        all(&mut scene)
    });
    assert_ne!(expected[0].0, expected[1].0);
    assert_ne!(expected[0].1, expected[1].1);
    let shared = Mutex::new(scene);
    let (is_over, seen) = (AtomicBool::new(false), [AtomicUsize::new(0), AtomicUsize::new(0)]);
    std::thread::scope(|threads| {
        for _ in 0..4 {
            threads.spawn(|| {
                let mut own = Scene::new().unwrap();
                while !is_over.load(Ordering::Relaxed) {
                    let snapshot = shared.lock().unwrap().snapshot();
                    own.clone_from(&snapshot);
                    drop(snapshot);
                    let found = all(&mut own);
                    let which =
                        expected.iter().position(|of| *of == found).expect("the answers of one scene");
                    seen[which].fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        let enough = |of: &AtomicUsize| of.load(Ordering::Relaxed) >= 20;
        for step in 0.. {
            // All three changes under one lock: nobody sees one without the others.
            change(&mut shared.lock().unwrap(), step % 2);
            std::thread::yield_now();
            if seen.iter().all(enough) || step > 10_000_000 {
                break;
            }
        }
        is_over.store(true, Ordering::Relaxed);
    });
    assert!(seen.iter().all(|of| of.load(Ordering::Relaxed) >= 20), "{seen:?}");
}
