//! The signed distance of a scene is the least one of all pairs.

use super::{place, scenes, shape};
use crate::common::Random;
use crate::common::shapes::{cube, moved, outward, plate, sphere};
use bvh_query::{PenetrationOptions, Pose, Querier, Scene, SceneError, ScenePair};

#[test]
fn the_least_signed_distance_is_that_of_all_pairs() {
    let (mut random, mut querier, options) =
        (Random::new(31), Querier::new().unwrap(), PenetrationOptions::new());
    // Two of them are convex, one has two parts, and one is open.
    let mut parts = outward(cube());
    parts.extend(moved(&outward(sphere(1)), 0.5, [2.0, 0.0, 0.0]));
    let shapes = [&outward(sphere(2)), &outward(cube()), &parts, &plate(4)].map(|triangles| shape(triangles));
    let mut kinds = [0; 2];
    for round in 0..6 {
        let spread = if round % 2 == 0 { 6.0 } else { 2.5 };
        let placed: Vec<_> =
            (0..6).map(|k| (shapes[k % 4].clone(), place(&mut random, &shapes[k % 4], spread))).collect();
        let mut answers = Vec::new();
        for mut scene in scenes() {
            assert_eq!(scene.signed_distance(&options).unwrap(), None);
            let ids: Vec<_> =
                placed.iter().map(|(shape, at)| scene.add(shape.clone(), *at).unwrap()).collect();
            answers.push((scene.signed_distance(&options).unwrap().unwrap(), ids));
        }
        let (found, ids) = answers[0].clone();
        assert!(answers.iter().all(|(other, _)| *other == found), "round {round}");
        let mut least = f64::INFINITY;
        for (a, (shape_a, at_a)) in placed.iter().enumerate() {
            for (b, (shape_b, at_b)) in placed.iter().enumerate().skip(a + 1) {
                let pose = Pose::relative(at_a, at_b).unwrap();
                let of_pair = querier.signed_distance(shape_a, shape_b, &pose, &options).unwrap();
                if found.pair == (ScenePair { a: ids[a], b: ids[b] }) {
                    assert_eq!(found.nearest, of_pair, "round {round}");
                }
                least = least.min(of_pair.lower);
            }
        }
        assert_eq!(found.nearest.lower, least, "round {round}");
        kinds[usize::from(least < 0.0)] += 1;
    }
    assert!(kinds[0] > 0 && kinds[1] > 0, "{kinds:?}");
    let refused = Scene::new().unwrap().signed_distance(&options.relative_gap(-1.0));
    assert!(matches!(refused, Err(SceneError::Query(_))));
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
