//! Points, rays and segments in the world: a scene answers as all its instances together do.

use super::{place, shape};
use crate::common::shapes::{moved, on_lattice, outward, plate, sphere, torus};
use crate::common::{Random, backends};
use bvh_query::{
    Backend, InstanceId, OwnedShape, Pose, Querier, QueryError, Ray, Relation, Scene, SceneError, Side,
};
use cbvh_testkit::depth::rounds;

/// A scene of instances in random places, and the instances.
fn scene(backend: Backend, seed: u64) -> (Scene, Vec<(InstanceId, OwnedShape, Pose)>) {
    let mut scene = Scene::with_backend(backend);
    let ball = outward(on_lattice(sphere(2)));
    let ring = on_lattice(torus(12, 8));
    let shapes = [shape(&ball), shape(&ring), shape(&plate(4)), shape(&moved(&ball, 2.0, [64.0, 0.0, 0.0]))];
    let random = &mut Random::new(seed);
    let mut instances: Vec<(InstanceId, OwnedShape, Pose)> = (0..25)
        .map(|_| {
            let shape = shapes[random.below(shapes.len())].clone();
            let world = place(random, &shape, 4.0);
            (scene.add(shape.clone(), world).unwrap(), shape, world)
        })
        .collect();
    // Some have moved, so that they are in the other tree of the broad phase, and one is gone.
    for number in [3, 7, 20] {
        let world = place(random, &instances[number].1, 3.0);
        scene.set_pose(instances[number].0, world).unwrap();
        instances[number].2 = world;
    }
    scene.remove(instances.remove(11).0).unwrap();
    // Twins: what both answer alike, the first answers.
    let (_, shape, world) = instances[5].clone();
    instances.push((scene.add(shape.clone(), world).unwrap(), shape, world));
    (scene, instances)
}

#[test]
fn probes_of_a_scene_are_those_of_its_instances() {
    let random = &mut Random::new(61);
    let mut points = Vec::new();
    for _ in 0..rounds(120) {
        let spread = [1.0, 4.0, 9.0][random.below(3)];
        points.push(random.point().map(|v| spread * v));
    }
    let rays: Vec<Ray> = points.iter().map(|point| Ray::new(*point, random.point())).collect();
    let segments: Vec<[[f64; 3]; 2]> =
        points.iter().map(|point| [*point, [0, 1, 2].map(|k| point[k] + 2.0 * random.signed())]).collect();
    for backend in backends() {
        let (mut scene, instances) = scene(backend, 7);
        let mut querier = Querier::with_backend(backend);
        for parallel in [false, true] {
            scene.set_parallel(parallel);
            let closest = scene.closest_points(&points, f64::INFINITY).unwrap();
            let near = scene.closest_points(&points, 0.3).unwrap();
            let sides = scene.sides(&points).unwrap();
            let signed = scene.signed_point_distances(&points, f64::INFINITY).unwrap();
            let first = scene.first_hits(&rays).unwrap();
            let any = scene.any_hits(&rays).unwrap();
            let all = scene.all_hits(&rays).unwrap();
            let meet = scene.segment_hits(&segments).unwrap();
            let (mut inside, mut hit) = (0, 0);
            for number in 0..points.len() {
                let (point, ray, [from, to]) = (points[number], rays[number], segments[number]);
                let mut nearest: Option<(f64, InstanceId, u32)> = None;
                let mut side = Side::Outside;
                let (mut t, mut hits, mut met) = (f64::INFINITY, 0, false);
                for (id, shape, world) in &instances {
                    let at = shape.shape().at(world);
                    let found = querier.closest_point(at, point, f64::INFINITY).unwrap().unwrap();
                    let found = (found.distance, *id, found.triangle);
                    if nearest.is_none_or(|nearest| found < nearest) {
                        nearest = Some(found);
                    }
                    side = match (side, querier.side(at, point).unwrap()) {
                        (_, Side::Inside) => Side::Inside,
                        // An open instance has no say about points outside of its box.
                        (side, Side::Undefined) => side,
                        (Side::Outside, found) => found,
                        (side, _) => side,
                    };
                    if let Some(found) = querier.first_hit(at, &ray).unwrap() {
                        t = t.min(found.t);
                    }
                    hits += querier.all_hits(at, &ray).unwrap().len();
                    met |= querier.segment_hit(at, from, to).unwrap();
                }
                let (distance, id, triangle) = nearest.unwrap();
                let found = closest[number].unwrap();
                assert_eq!(
                    (found.closest.distance, found.instance, found.closest.triangle),
                    (distance, id, triangle)
                );
                assert!(found.closest.lower <= distance && distance <= found.closest.upper);
                assert_eq!(
                    near[number].map(|near| near.closest.distance),
                    (distance <= 0.3).then_some(distance)
                );
                if sides[number] == Side::Undefined {
                    assert_ne!(side, Side::Inside);
                } else {
                    assert_eq!(sides[number], side, "{point:?}");
                }
                let (instance, of) = signed[number].unwrap();
                assert_eq!((instance, of.side, of.closest), (found.instance, sides[number], found.closest));
                assert_eq!(first[number].map_or(f64::INFINITY, |hit| hit.hit.t), t);
                assert_eq!(any[number], t < f64::INFINITY);
                assert_eq!(all[number].first().copied(), first[number]);
                // The twin hits at the same parameters.
                assert!(all[number].len() <= hits && all[number].is_empty() == (hits == 0));
                assert!(all[number].is_sorted_by(|x, y| x.hit.t <= y.hit.t));
                assert_eq!(meet[number], met);
                inside += u32::from(sides[number] == Side::Inside);
                hit += u32::from(any[number]);
            }
            assert!(inside > 0 && hit > 10, "{inside} {hit}");
        }
    }
}

/// What has moved is asked about once, where it is now.
#[test]
fn instances_that_moved_cost_no_more() {
    let ball = shape(&outward(on_lattice(sphere(2))));
    let mut scene = Scene::with_backend(Backend::Scalar);
    let at = |x: usize| Pose::new(*Pose::IDENTITY.rotation(), [3.0 * x as f64, 0.0, 0.0]).unwrap();
    let ids: Vec<InstanceId> = (0..40).map(|x| scene.add(ball.clone(), at(x)).unwrap()).collect();
    let ray = Ray::new([-5.0, 0.1, 0.2], [1.0, 0.0, 0.0]);
    // Often enough for rays to have their tree.
    scene.all_hits(&[ray; 100]).unwrap();
    let expected = (scene.all_hits(&[ray]).unwrap(), scene.stats());
    assert_eq!(expected.0[0].len(), 80);
    ids.iter().step_by(2).zip((0..).step_by(2)).for_each(|(id, x)| scene.set_pose(*id, at(x)).unwrap());
    assert_eq!((scene.all_hits(&[ray]).unwrap(), scene.stats()), expected);
}

#[test]
fn relations_of_a_scene_are_those_of_its_pairs() {
    let backend = Backend::ALL.into_iter().find(|backend| backend.is_available()).unwrap();
    let (mut scene, instances) = scene(backend, 9);
    let ball = shape(&moved(&outward(on_lattice(sphere(2))), 0.25, [0.0; 3]));
    // A ball in the middle of each instance, inside it where that is a ball.
    let mut all = instances;
    for (_, _, world) in all.clone() {
        let world = Pose::new(*Pose::IDENTITY.rotation(), world.translation()).unwrap();
        all.push((scene.add(ball.clone(), world).unwrap(), ball.clone(), world));
    }
    // The lower one of a pair is A.
    all.sort_by_key(|(id, ..)| *id);
    let mut querier = Querier::with_backend(backend);
    let mut counts = [0; 6];
    for parallel in [false, true] {
        scene.set_parallel(parallel);
        let found = scene.relations().unwrap();
        for (number, (a, shape_a, world_a)) in all.iter().enumerate() {
            for (b, shape_b, world_b) in &all[number + 1..] {
                let pose = Pose::relative(world_a, world_b).unwrap();
                let expected = querier.relation(shape_a, shape_b, &pose).unwrap();
                let found = found.iter().find(|(pair, _)| (pair.a, pair.b) == (*a, *b));
                match found {
                    Some((_, relation)) => assert_eq!(*relation, expected),
                    // Apart by their boxes in the world.
                    None => assert!(matches!(expected, Relation::Apart | Relation::Undefined)),
                }
                counts[expected as usize] += 1;
            }
        }
    }
    assert!(counts[0] > 0 && counts[1] > 0 && counts[3] > 0, "{counts:?}");
}

#[test]
fn what_no_instance_can_answer_is_an_error() {
    let (mut scene, _) = scene(Backend::Scalar, 8);
    assert!(matches!(scene.closest_points(&[[f64::NAN; 3]], 1.0), Err(SceneError::Query(_))));
    assert!(matches!(scene.closest_points(&[], -1.0), Err(SceneError::Query(_))));
    assert!(matches!(scene.first_hits(&[Ray::new([0.0; 3], [0.0; 3])]), Err(SceneError::Query(_))));
    assert_eq!(scene.closest_points(&[], 1.0), Ok(vec![]));
    // The broad phase looks at some boxes before there is an instance to ask.
    let mut spent = |budget: u64| {
        scene.set_budget(budget);
        scene.closest_points(&[[0.0; 3]], 9.0).unwrap_err()
    };
    let source = QueryError::Budget { visits: 1 };
    assert_eq!(spent(1), SceneError::Query(source));
    assert!((2..20).map(spent).any(|error| matches!(error, SceneError::Instance { .. })));
    let mut empty = Scene::with_backend(Backend::Scalar);
    assert_eq!(empty.closest_points(&[[0.0; 3]], f64::INFINITY), Ok(vec![None]));
    assert_eq!(empty.sides(&[[0.0; 3]]), Ok(vec![Side::Outside]));
    assert_eq!(empty.first_hits(&[Ray::new([0.0; 3], [1.0, 0.0, 0.0])]), Ok(vec![None]));
}
