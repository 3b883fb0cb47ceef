//! Trackers in scenes: they save work and change no answer.

use super::{Triangle, shape};
use crate::common::shapes::{cube, sphere, torus};
use bvh_query::{Pose, Scene};

/// Where instances move little, trackers save work, and no answer changes.
#[test]
fn trackers_save_work_where_steps_are_small() {
    let small: Vec<Triangle> =
        sphere(3).iter().map(|corners| corners.map(|corner| corner.map(|c| 0.4 * c))).collect();
    let (ring, ball) = (shape(&torus(24, 12)), shape(&small));
    let at = |x: f64, y: f64| Pose::new(*Pose::IDENTITY.rotation(), [x, y, 0.1]).unwrap();
    let mut scenes = [Scene::new().unwrap(), Scene::new().unwrap()];
    scenes[1].set_tracking(true);
    let ids: Vec<_> = scenes
        .iter_mut()
        .map(|scene| {
            let _still = scene.add(ring.clone(), at(0.0, 0.0)).unwrap();
            scene.add(ball.clone(), at(0.0, 0.0)).unwrap()
        })
        .collect();
    let (mut work, mut touching) = ([0, 0], 0);
    for step in 0..1000 {
        // Inside the hole of the ring, where its box is of no use, and into the ring and back.
        let angle = f64::from(step) / 1000.0 * std::f64::consts::TAU;
        let moved = at(0.35 * angle.sin(), 0.05 * angle.cos());
        let mut answers = Vec::new();
        for (number, scene) in scenes.iter_mut().enumerate() {
            scene.set_pose(ids[number], moved).unwrap();
            answers.push(scene.pairs_in_contact().unwrap());
            work[number] += scene.stats().node_tests;
        }
        assert_eq!(answers[0], answers[1], "step {step}");
        touching += answers[0].len();
    }
    assert!(touching > 100 && touching < 900 && 4 * work[1] < 3 * work[0], "{touching} {work:?}");
}

/// However many pairs are near, all of them are remembered, also by questions that ask about one pair after another.
#[test]
fn trackers_of_many_pairs_are_kept() {
    let small = shape(&cube());
    let turn = Pose::from_quaternion([0.0, 0.0, 0.1f64.sin(), 0.1f64.cos()], [0.0; 3]).unwrap();
    // In a grid with gaps between the cubes, turned so that boxes overlap.
    let place = |number: usize, shift: f64| {
        let on = [2.3 * (number % 30) as f64 + shift, 2.3 * (number / 30) as f64, 0.0];
        Pose::new(*turn.rotation(), on).unwrap()
    };
    let mut work = Vec::new();
    for tracking in [false, true] {
        let mut scene = Scene::new().unwrap();
        scene.set_tracking(tracking);
        let ids: Vec<_> =
            (0..900).map(|number| scene.add(small.clone(), place(number, 0.0)).unwrap()).collect();
        let mut tests = 0;
        for step in 0..12 {
            let moved = ids.iter().enumerate().step_by(2);
            let moved = moved.map(|(number, &id)| (id, place(number, 1e-9 * f64::from(step))));
            scene.set_poses(moved).unwrap();
            scene.pairs_within(0.01).unwrap();
            assert!(scene.pairs_asked() > 1500);
            tests += scene.stats().node_tests;
        }
        work.push(tests);
    }
    assert!(2 * work[1] < work[0], "{work:?}");
}
