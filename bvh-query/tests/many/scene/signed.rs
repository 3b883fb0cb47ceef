//! The signed distance of a scene is the least one of all pairs.

use super::{place, scenes, shape};
use crate::common::Random;
use crate::common::shapes::{cube, moved, outward, plate, sphere};
use bvh_query::{PenetrationOptions, Pose, Querier, Scene, SceneError, ScenePair};

/// Up to this far apart, pairs are near.
const MARGIN: f64 = 0.75;

#[test]
fn the_least_signed_distance_is_that_of_all_pairs() {
    let (mut random, mut querier, options) =
        (Random::new(31), Querier::new().unwrap(), PenetrationOptions::new());
    // Two of them are convex, one has two parts, and one is open.
    let mut parts = outward(cube());
    parts.extend(moved(&outward(sphere(1)), 0.5, [2.0, 0.0, 0.0]));
    let shapes = [&outward(sphere(2)), &outward(cube()), &parts, &plate(4)].map(|triangles| shape(triangles));
    let (mut kinds, mut some_are_far) = ([0; 2], 0);
    for round in 0..6 {
        let spread = if round % 2 == 0 { 6.0 } else { 2.5 };
        let placed: Vec<_> =
            (0..6).map(|k| (shapes[k % 4].clone(), place(&mut random, &shapes[k % 4], spread))).collect();
        let mut answers = Vec::new();
        for mut scene in scenes() {
            assert_eq!(scene.signed_distance(&options).unwrap(), None);
            let ids: Vec<_> =
                placed.iter().map(|(shape, at)| scene.add(shape.clone(), *at).unwrap()).collect();
            let least = scene.signed_distance(&options).unwrap().unwrap();
            answers.push((least, scene.near_pairs(MARGIN, &options).unwrap(), ids));
        }
        let (found, near, ids) = answers[0].clone();
        assert!(answers.iter().all(|(least, all, _)| (least, all) == (&found, &near)), "round {round}");
        let (mut least, mut expected) = (f64::INFINITY, Vec::new());
        for (a, (shape_a, at_a)) in placed.iter().enumerate() {
            for (b, (shape_b, at_b)) in placed.iter().enumerate().skip(a + 1) {
                let pose = Pose::relative(at_a, at_b).unwrap();
                let of_pair = querier.signed_distance(shape_a, shape_b, &pose, &options).unwrap();
                let pair = ScenePair { a: ids[a], b: ids[b] };
                if found.pair == pair {
                    assert_eq!(found.nearest, of_pair, "round {round}");
                }
                if of_pair.upper <= MARGIN {
                    expected.push((pair, of_pair));
                }
                assert!(of_pair.upper <= MARGIN || of_pair.lower > MARGIN, "too near to tell: {of_pair:?}");
                least = least.min(of_pair.lower);
            }
        }
        assert_eq!(found.nearest.lower, least, "round {round}");
        let near: Vec<_> = near.iter().map(|of| (of.pair, of.nearest)).collect();
        assert_eq!(near, expected, "round {round}");
        some_are_far += usize::from((1..15).contains(&near.len()));
        kinds[usize::from(least < 0.0)] += 1;
    }
    assert!(kinds[0] > 0 && kinds[1] > 0 && some_are_far > 2, "{kinds:?} {some_are_far}");
    let refused = Scene::new().unwrap().signed_distance(&options.relative_gap(-1.0));
    assert!(matches!(refused, Err(SceneError::Query(_))));
    for (margin, options) in [-1.0, f64::NAN, f64::INFINITY]
        .map(|bad| (bad, options))
        .into_iter()
        .chain([(1.0, options.relative_gap(-1.0))])
    {
        let refused = Scene::new().unwrap().near_pairs(margin, &options);
        assert!(matches!(refused, Err(SceneError::Query(_))), "{margin}: {refused:?}");
    }
}

/// Allowed pairs and groups that do not meet are left out, a body inside a closed one is near, and margins count.
#[test]
fn near_pairs_are_those_that_a_scene_is_asked_about() {
    let options = PenetrationOptions::new();
    let unit = shape(&outward(cube()));
    let room = shape(&moved(&outward(cube()), 8.0, [0.0; 3]));
    let at = |x: f64| crate::common::translation(x, 0.0, 0.0);
    for mut scene in scenes() {
        let room = scene.add(room.clone(), at(0.0)).unwrap();
        let [a, b, c] = [-3.0, 0.0, 3.0].map(|x| scene.add(unit.clone(), at(x)).unwrap());
        let near = |scene: &mut Scene, margin| {
            let found = scene.near_pairs(margin, &options).unwrap();
            found.into_iter().map(|of| ((of.pair.a, of.pair.b), of.nearest.distance)).collect::<Vec<_>>()
        };
        // All are inside the room, and the way out of it is the shorter, the nearer they are to its wall.
        let inside = near(&mut scene, 0.0);
        assert_eq!(
            inside.iter().map(|(pair, _)| *pair).collect::<Vec<_>>(),
            [(room, a), (room, b), (room, c)]
        );
        for ((_, distance), expected) in inside.iter().zip([-6.0, -9.0, -6.0]) {
            assert!((distance - expected).abs() < 0.1, "{distance} {expected}");
        }
        scene.set_allowed(room, a, true).unwrap();
        scene.set_allowed(room, b, true).unwrap();
        scene.remove(c).unwrap();
        assert_eq!(near(&mut scene, 0.875), []);
        assert_eq!(near(&mut scene, 1.0), [((a, b), 1.0)]);
        scene.set_margin(b, 0.25).unwrap();
        assert_eq!(near(&mut scene, 0.875), [((a, b), 0.75)]);
        scene.set_allowed(a, b, true).unwrap();
        assert_eq!(near(&mut scene, 9.0), []);
    }
}

/// A body in the middle of a solid touches it, although other pairs are nearer than its surface.
#[test]
fn a_body_in_a_solid_is_at_distance_zero() {
    let [rod, unit, room] = [block([8.0, 0.125, 0.125]), block([1.0; 3]), block([16.0; 3])];
    let turned = |y: f64| Pose::from_quaternion([0.0, 0.0, 0.5, 0.75f64.sqrt()], [100.0, y, 0.0]).unwrap();
    for mut scene in scenes() {
        scene.add(rod.clone(), turned(0.0)).unwrap();
        scene.add(rod.clone(), turned(1.0)).unwrap();
        let near = scene.distance().unwrap().unwrap().nearest.distance;
        assert!(near > 0.0 && near < 1.0, "{near}");
        let room = scene.add(room.clone(), Pose::IDENTITY).unwrap();
        let inner = scene.add(unit.clone(), Pose::IDENTITY).unwrap();
        let found = scene.distance().unwrap().unwrap();
        assert_eq!((found.pair, found.nearest.distance), (ScenePair { a: room, b: inner }, 0.0));
    }
}

fn block(sides: [f64; 3]) -> bvh_query::OwnedShape {
    let block = bvh_bake::shapes::block(sides).unwrap();
    let (bytes, _) = bvh_bake::to_bytes(&block, &bvh_bake::Options::default()).unwrap();
    bvh_query::OwnedShape::from(bvh_query::Bvh::from_bytes(bytes).unwrap()).solid().unwrap()
}
