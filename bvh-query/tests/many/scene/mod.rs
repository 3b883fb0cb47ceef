//! Scenes against brute force over all pairs, to the bit: every question, every frame, all backends, one thread and two.

mod attached;
mod files;
mod margins;
mod motions;
mod probes;
mod shared;
mod signed;
mod snapshots;
mod trackers;

use crate::common::shapes::{cube, moved, plate, sphere, torus};
use crate::common::{Random, Triangle, backends, bake, baked, mesh, random_pose};
use bvh_query::{
    Bvh, Contact, Distance, Groups, InstanceId, NumberError, OwnedShape, Pose, Querier, QueryError,
    QueryStats, Scene, SceneError, ScenePair,
};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::seal::section;
use std::ops::ControlFlow;

fn shape(triangles: &[Triangle]) -> OwnedShape {
    baked(triangles).into()
}

/// Shapes of different sizes, one of them far from its own origin, and one object of a file of two.
fn shapes() -> Vec<OwnedShape> {
    let mut two = mesh(&sphere(1));
    two.objects.extend(mesh(&moved(&torus(8, 6), 0.5, [3.0, 0.0, 0.0])).objects);
    let two = bake(&two, &bvh_bake::Options::default().split_objects(true));
    vec![
        shape(&sphere(2)),
        shape(&torus(12, 8)),
        shape(&plate(4)),
        shape(&moved(&sphere(1), 0.4, [100.0, -50.0, 7.0])),
        OwnedShape::object(two.clone(), 1).unwrap(),
        two.into(),
    ]
}

/// What a scene should hold.
#[derive(Clone)]
struct Placed {
    id: InstanceId,
    shape: OwnedShape,
    world: Pose,
    groups: Groups,
    allowed: Vec<InstanceId>,
}

/// A pose near others, for a shape whose middle may be anywhere.
fn place(random: &mut Random, shape: &OwnedShape, spread: f64) -> Pose {
    let turned = random_pose(random, 1.0);
    let record = shape.shape().objects()[0].record();
    let origin = shape.shape().objects()[0].origin();
    let centre = [0, 1, 2].map(|k| origin[k] + f64::from(record.sphere_centre[k].get()));
    let at = [(); 3].map(|()| spread * random.signed());
    let there = turned.rotation().map(|row| row[0] * centre[0] + row[1] * centre[1] + row[2] * centre[2]);
    Pose::new(*turned.rotation(), [0, 1, 2].map(|k| at[k] - there[k])).unwrap()
}

/// The answers about one frame.
#[derive(Debug, PartialEq, Default)]
struct Answers {
    in_contact: Vec<(InstanceId, InstanceId)>,
    within: Vec<(InstanceId, InstanceId)>,
    contacts: Vec<(InstanceId, InstanceId, Contact)>,
    distance: Option<(InstanceId, InstanceId, Distance)>,
}

const D: f64 = 0.3;

/// Asks about every pair by itself.
fn brute_force(placed: &[Placed], querier: &mut Querier) -> Answers {
    let (mut answers, mut distances) = (Answers::default(), Vec::new());
    for (number, a) in placed.iter().enumerate() {
        for b in &placed[number + 1..] {
            let (a, b) = if a.id < b.id { (a, b) } else { (b, a) };
            let groups = [a, b].map(|side| side.groups);
            let meet = groups[0].member & groups[1].meets != 0 && groups[1].member & groups[0].meets != 0;
            if !meet || a.allowed.contains(&b.id) {
                continue;
            }
            let pose = Pose::relative(&a.world, &b.world).unwrap();
            let ids = (a.id, b.id);
            if querier.collide(&a.shape, &b.shape, &pose).unwrap() {
                answers.in_contact.push(ids);
            }
            if querier.within(&a.shape, &b.shape, &pose, D).unwrap() {
                answers.within.push(ids);
            }
            let contacts = querier.contacts(&a.shape, &b.shape, &pose).unwrap();
            answers.contacts.extend(contacts.into_iter().map(|contact| (a.id, b.id, contact)));
            let distance = querier.distance(&a.shape, &b.shape, &pose).unwrap();
            distances.push((a.id, b.id, distance));
        }
    }
    answers.in_contact.sort_unstable();
    answers.within.sort_unstable();
    answers.contacts.sort_unstable();
    distances.sort_by(|x, y| (x.2.distance, x.0, x.1).partial_cmp(&(y.2.distance, y.0, y.1)).unwrap());
    answers.distance = distances.first().copied();
    answers
}

fn ask(scene: &mut Scene) -> Answers {
    let pairs = |pairs: Vec<ScenePair>| pairs.into_iter().map(|pair| (pair.a, pair.b)).collect();
    let contacts: Vec<_> = scene.contacts().unwrap();
    let mut visited = Vec::new();
    scene
        .visit_contacts(|pair, contacts| {
            visited.extend(contacts.iter().map(|&contact| (pair, contact)));
            ControlFlow::Continue(())
        })
        .unwrap();
    assert_eq!(visited, contacts.iter().map(|of| (of.pair, of.contact)).collect::<Vec<_>>());
    let mut first = None;
    scene
        .visit_contacts(|pair, contacts| {
            assert!(first.replace((pair, contacts[0])).is_none());
            ControlFlow::Break(())
        })
        .unwrap();
    assert_eq!(first, visited.first().copied());
    let answers = Answers {
        in_contact: pairs(scene.pairs_in_contact().unwrap()),
        within: pairs(scene.pairs_within(D).unwrap()),
        contacts: contacts.into_iter().map(|of| (of.pair.a, of.pair.b, of.contact)).collect(),
        distance: scene.distance().unwrap().map(|of| (of.pair.a, of.pair.b, of.nearest)),
    };
    assert_eq!(scene.collide().unwrap(), !answers.in_contact.is_empty());
    assert_eq!(scene.within(D).unwrap(), !answers.within.is_empty());
    assert_eq!(scene.pairs_within(0.0).unwrap(), scene.pairs_in_contact().unwrap());
    answers
}

/// Scenes with one thread and two on each backend, with trackers and without.
fn scenes() -> Vec<Scene> {
    let scene = |backend, (parallel, tracking)| {
        let mut scene = Scene::with_backend(backend);
        scene.set_parallel(parallel);
        scene.set_tracking(tracking);
        scene
    };
    let ways = [(false, false), (false, true), (true, false), (true, true)];
    backends().into_iter().flat_map(|backend| ways.map(|way| scene(backend, way))).collect()
}

#[test]
fn answers_are_those_of_brute_force_while_instances_come_move_and_go() {
    let pool = cbvh_testkit::pool(2);
    let random = &mut Random::new(7);
    let shapes = shapes();
    let mut querier = Querier::new().unwrap();
    let (mut touching, mut apart) = (0, 0);
    for round in 0..rounds(3) {
        let mut scenes = scenes();
        let mut placed: Vec<Placed> = Vec::new();
        let spread = [2.0, 4.0, 9.0][round as usize % 3];
        for frame in 0..8 {
            // Some come, some go, most move; some change their groups and what they may touch.
            for _ in 0..if frame == 0 { 8 } else { random.below(3) } {
                let shape = shapes[random.below(shapes.len())].clone();
                let world = place(random, &shape, spread);
                let ids: Vec<_> =
                    scenes.iter_mut().map(|scene| scene.add(shape.clone(), world).unwrap()).collect();
                assert!(ids.iter().all(|id| *id == ids[0]));
                placed.push(Placed { id: ids[0], shape, world, groups: Groups::ALL, allowed: Vec::new() });
            }
            if frame > 2 && random.below(2) == 0 {
                let gone = placed.swap_remove(random.below(placed.len()));
                placed.iter_mut().for_each(|other| other.allowed.retain(|id| *id != gone.id));
                for scene in &mut scenes {
                    scene.remove(gone.id).unwrap();
                    assert_eq!(scene.pose(gone.id), Err(SceneError::NoInstance(gone.id)));
                }
            }
            let mut moves = Vec::new();
            for instance in &mut placed {
                if random.below(3) > 0 {
                    instance.world = place(random, &instance.shape, spread);
                    moves.push((instance.id, instance.world));
                }
                if random.below(4) == 0 {
                    let bits = |random: &mut Random| 1 + random.below(7) as u32;
                    instance.groups = Groups { member: bits(random), meets: bits(random) };
                    for scene in &mut scenes {
                        scene.set_groups(instance.id, instance.groups).unwrap();
                    }
                }
            }
            let (first, second) = (random.below(placed.len()), random.below(placed.len()));
            if first != second {
                let (a, b) = (placed[first].id, placed[second].id);
                let allows = random.below(3) > 0;
                for (own, other) in [(first, b), (second, a)] {
                    placed[own].allowed.retain(|id| *id != other);
                    if allows {
                        placed[own].allowed.push(other);
                    }
                }
                scenes.iter_mut().for_each(|scene| scene.set_allowed(a, b, allows).unwrap());
            }
            let expected = brute_force(&placed, &mut querier);
            touching += expected.in_contact.len();
            apart += usize::from(expected.distance.is_some_and(|(_, _, found)| found.distance > 0.0));
            for (number, scene) in scenes.iter_mut().enumerate() {
                scene.set_poses(moves.iter().copied()).unwrap();
                assert_eq!(scene.len(), placed.len());
                assert!(placed.iter().all(|of| scene.groups(of.id) == Ok(of.groups)));
                let mut allowed: Vec<_> =
                    placed.iter().flat_map(|a| a.allowed.iter().map(|&b| (a.id, b))).collect();
                allowed.retain(|(a, b)| a < b);
                allowed.sort_unstable();
                assert_eq!(scene.allowed().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>(), allowed);
                assert_eq!(pool.install(|| ask(scene)), expected, "scene {number}, frame {frame}");
                // Asked again, with what the scene remembers.
                assert_eq!(pool.install(|| ask(scene)), expected, "scene {number}, frame {frame}");
            }
        }
    }
    assert!(touching > 20 && apart > 3, "{touching} {apart}");
}

/// Many instances of which few are near each other: what the tree of boxes is for.
#[test]
fn a_tree_of_boxes_misses_no_pair_wherever_instances_move() {
    let random = &mut Random::new(9);
    let shape = shape(&sphere(1));
    let mut scene = Scene::new().unwrap();
    let count = 300;
    let grid = |number: usize| [number % 10, number / 10 % 10, number / 100].map(|k| 2.5 * k as f64);
    let at = |p: [f64; 3]| Pose::new(*Pose::IDENTITY.rotation(), p).unwrap();
    let mut places: Vec<[f64; 3]> = (0..count).map(grid).collect();
    let ids: Vec<_> = places.iter().map(|&p| scene.add(shape.clone(), at(p)).unwrap()).collect();
    let mut querier = Querier::new().unwrap();
    for _ in 0..rounds(20) {
        // Far more than once through the tree, so that it is built anew.
        for _ in 0..60 {
            let number = random.below(count);
            places[number] = [(); 3].map(|()| 12.5 + 14.0 * random.signed());
            scene.set_pose(ids[number], at(places[number])).unwrap();
        }
        let mut expected = Vec::new();
        for i in 0..count {
            for j in i + 1..count {
                let apart: f64 = (0..3).map(|k| (places[i][k] - places[j][k]).powi(2)).sum();
                if apart <= 4.1 {
                    let pose = Pose::relative(&at(places[i]), &at(places[j])).unwrap();
                    if querier.collide(&shape, &shape, &pose).unwrap() {
                        expected.push((ids[i], ids[j]));
                    }
                }
            }
        }
        let found: Vec<_> =
            scene.pairs_in_contact().unwrap().into_iter().map(|pair| (pair.a, pair.b)).collect();
        assert_eq!(found, expected);
        assert!(!expected.is_empty());
    }
}

/// The pair that was in contact in the last question is asked first, but only where its boxes still meet.
#[test]
fn a_pair_that_has_parted_is_not_asked() {
    let at = |x: f64| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]).unwrap();
    for mut scene in scenes() {
        let cube = shape(&cube());
        scene.add(cube.clone(), at(0.0)).unwrap();
        let moving = scene.add(cube.clone(), at(1.5)).unwrap();
        for (x, is_hit, asked) in [(1.5, true, 1), (9.0, false, 0), (2.0, true, 1), (2.5, false, 0)] {
            scene.set_pose(moving, at(x)).unwrap();
            assert_eq!((scene.collide().unwrap(), scene.pairs_asked()), (is_hit, asked), "{x}");
            assert_eq!(scene.within(3.0).unwrap(), x < 9.0);
        }
    }
}

/// Three in a row at equal distances: the first pair is the answer, whichever was nearest before. A question about pairs that
/// need no asking costs nothing.
#[test]
fn of_equally_near_pairs_the_first_is_the_answer() {
    let at = |x: f64| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]).unwrap();
    for mut scene in scenes() {
        let cube = shape(&cube());
        let ids: Vec<_> = (0..3).map(|k| scene.add(cube.clone(), at(3.0 * f64::from(k))).unwrap()).collect();
        let first = ScenePair { a: ids[0], b: ids[1] };
        assert_eq!(scene.distance().unwrap().unwrap().pair, first);
        // Now the later pair is nearer.
        scene.set_pose(ids[2], at(5.5)).unwrap();
        assert_eq!(scene.distance().unwrap().unwrap().pair, ScenePair { a: ids[1], b: ids[2] });
        scene.set_pose(ids[2], at(6.0)).unwrap();
        let found = scene.clone().distance().unwrap().unwrap();
        assert_eq!((found.pair, found.nearest.distance), (first, 1.0));
        assert_eq!(scene.distance().unwrap(), Some(found));
        // Of the pair that was nearest in the last question, the answer is kept; the other one is asked about.
        assert_eq!((scene.distance().unwrap(), scene.pairs_asked()), (Some(found), 2));
        scene.remove(ids[2]).unwrap();
        assert_eq!((scene.distance().unwrap(), scene.pairs_asked()), (Some(found), 1));
        let mut querier = Querier::new().unwrap();
        querier.distance(&cube, &cube, &at(3.0)).unwrap();
        assert_eq!(scene.stats(), querier.stats());
    }
}

/// Cubes whose corners meet far from the origin, turned at random: what the boxes round, and the relative pose too.
#[test]
fn turned_cubes_that_touch_far_from_the_origin_are_found() {
    let random = &mut Random::new(12);
    let cube = shape(&cube());
    let mut querier = Querier::new().unwrap();
    let (mut touching, mut apart) = (0, 0);
    for _ in 0..rounds(3000) {
        let far = 2f64.powi(random.below(50) as i32);
        let [r, s] = [(); 2].map(|()| *random_pose(random, 1.0).rotation());
        let turned =
            |r: &[[f64; 3]; 3], p: [f64; 3]| r.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
        // The corner of A that is farthest along x, and that of B that is farthest against it.
        let corner = |r: &[[f64; 3]; 3], sign: f64| turned(r, r[0].map(|entry| sign * entry.signum()));
        let from = [(); 3].map(|()| far * random.signed());
        let (end_a, end_b) = (corner(&r, 1.0), corner(&s, -1.0));
        let to = [0, 1, 2].map(|k| from[k] + end_a[k] - end_b[k]);
        let (a, b) = (Pose::new(r, from).unwrap(), Pose::new(s, to).unwrap());
        let expected = querier.collide(&cube, &cube, &Pose::relative(&a, &b).unwrap()).unwrap();
        let mut scene = Scene::new().unwrap();
        scene.add(cube.clone(), a).unwrap();
        scene.add(cube.clone(), b).unwrap();
        assert_eq!(scene.pairs_in_contact().unwrap().len(), usize::from(expected), "{a:?} {b:?}");
        *(if expected { &mut touching } else { &mut apart }) += 1;
    }
    assert!(touching > 300 && apart > 300, "{touching} {apart}");
}

/// Cubes face to face, where the boxes round and the pose of one in the frame of the other does not.
#[test]
fn cubes_that_touch_far_from_the_origin_are_found() {
    let random = &mut Random::new(11);
    let cube = shape(&cube());
    let mut querier = Querier::new().unwrap();
    let (mut touching, mut apart) = (0, 0);
    for _ in 0..rounds(3000) {
        let far = 2f64.powi(random.below(60) as i32);
        let from = [(); 3].map(|()| far * random.signed());
        let (axis, turn) = (random.below(3), random.below(4));
        let (sin, cos) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][turn];
        let rotation = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
        // One unit in the last place more or less, or none.
        let mut to = from;
        to[axis] += 2.0;
        to[axis] = [to[axis].next_down(), to[axis], to[axis].next_up()][random.below(3)];
        let (a, b) = (Pose::new(rotation, from).unwrap(), Pose::new(*Pose::IDENTITY.rotation(), to).unwrap());
        let expected = querier.collide(&cube, &cube, &Pose::relative(&a, &b).unwrap()).unwrap();
        let mut scene = Scene::new().unwrap();
        scene.add(cube.clone(), a).unwrap();
        scene.add(cube.clone(), b).unwrap();
        assert_eq!(scene.pairs_in_contact().unwrap().len(), usize::from(expected), "{a:?} {b:?}");
        *(if expected { &mut touching } else { &mut apart }) += 1;
    }
    assert!(touching > 500 && apart > 100, "{touching} {apart}");
}

/// Pages are read, and checked, when an instance is near another one: before that, damage goes unnoticed.
#[test]
fn only_what_is_near_is_touched() {
    let whole = shape(&sphere(3));
    let mut bytes = whole.bvh().bytes().to_vec();
    // The header and the object table stay whole.
    for kind in [2, 3] {
        let at = section(&bytes, kind).start + 100;
        bytes[at] ^= 1;
    }
    let damaged = OwnedShape::from(Bvh::from_bytes(bytes).unwrap());
    let at = |x: f64| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]).unwrap();
    for parallel in [false, true] {
        let mut scene = Scene::new().unwrap();
        scene.set_parallel(parallel);
        let ids: Vec<_> = (0..50)
            .map(|number| {
                let shape = if number < 25 { &whole } else { &damaged };
                scene.add_named(format!("i{number}"), shape.clone(), at(3.0 * f64::from(number))).unwrap()
            })
            .collect();
        // All are three apart, and have a radius of one.
        assert!(!scene.collide().unwrap());
        assert_eq!(scene.pairs_in_contact().unwrap(), []);
        assert_eq!(scene.contacts().unwrap(), []);
        assert_eq!((scene.pairs_asked(), scene.stats()), (0, QueryStats::default()));
        assert_eq!(scene.pairs_within(0.9).unwrap(), []);
        scene.set_pose(ids[0], at(3.5)).unwrap();
        assert_eq!(scene.pairs_in_contact().unwrap(), [ScenePair { a: ids[0], b: ids[1] }]);
        // The error is that of the first pair that has one, on any number of threads.
        for (moved, beside) in [(1, 40), (2, 30), (3, 45)] {
            scene.set_pose(ids[moved], at(3.0 * f64::from(beside) + 0.5)).unwrap();
        }
        let said = scene.pairs_in_contact().unwrap_err();
        assert!(
            matches!(&said, SceneError::Pair { a, b, source: QueryError::Damaged(_) } if (a.id, b.id) == (ids[1], ids[40])),
            "{said}"
        );
    }
}

#[test]
fn an_empty_scene_and_one_instance_have_no_pairs() {
    let mut scene = Scene::new().unwrap();
    assert_eq!(ask(&mut scene), Answers::default());
    assert!(scene.is_empty());
    let id = scene.add(shape(&sphere(1)), Pose::IDENTITY).unwrap();
    assert_eq!(ask(&mut scene), Answers::default());
    scene.remove(id).unwrap();
    assert_eq!(ask(&mut scene), Answers::default());
    // The place is taken again, under another identifier.
    let next = scene.add(shape(&sphere(1)), Pose::IDENTITY).unwrap();
    assert!(next != id && scene.remove(id) == Err(SceneError::NoInstance(id)));
    assert_eq!(scene.instances().collect::<Vec<_>>(), [next]);
    // Numbers stand for identifiers, removed ones included.
    assert_eq!([id, next].map(|id| InstanceId::from_bits(id.to_bits())), [id, next]);
    assert_eq!((id.to_bits(), next.to_bits()), (0, 1 << 32));
    let never = InstanceId::from_bits(u64::MAX);
    assert_eq!(scene.remove(never), Err(SceneError::NoInstance(never)));
}

#[test]
fn bad_instances_are_refused_and_change_nothing() {
    let shape = shape(&sphere(1));
    let mut scene = Scene::new().unwrap();
    let other = Scene::new().unwrap().add(shape.clone(), Pose::IDENTITY).unwrap();
    let base = scene.add_named("base", shape.clone(), Pose::IDENTITY).unwrap();
    assert_eq!((scene.find("base"), scene.find("tip")), (Some(base), None));
    assert_eq!(scene.name(base), Ok(Some("base")));
    let again = scene.add_named("base", shape.clone(), Pose::IDENTITY);
    assert_eq!(again, Err(SceneError::NameTaken("base".into())));
    assert_eq!(scene.len(), 1);
    let sheared = Pose::new([[1.0, 1.5e-7, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]).unwrap();
    let far = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 2f64.powi(118).next_up(), 0.0]).unwrap();
    for (pose, words) in [(sheared, "a rotation within 2^-23"), (far, "at most 2^118")] {
        let said = scene.add_named("arm", shape.clone(), pose).unwrap_err().to_string();
        assert!(said.starts_with("instance arm: expected ") && said.contains(words), "{said}");
        assert_eq!(scene.find("arm"), None);
        let near = Pose::new(*Pose::IDENTITY.rotation(), [5.0, 0.0, 0.0]).unwrap();
        let said = scene.set_poses([(base, near), (base, pose)]).unwrap_err().to_string();
        assert!(said.starts_with("instance base: expected ") && said.contains(words), "{said}");
        assert_eq!(scene.pose(base), Ok(&Pose::IDENTITY));
    }
    let tip = scene.add_named("tip", shape.clone(), Pose::IDENTITY).unwrap();
    scene.remove(tip).unwrap();
    for refused in [
        scene.set_pose(tip, Pose::IDENTITY),
        scene.set_groups(tip, Groups::ALL),
        scene.set_allowed(base, tip, true),
        scene.set_allowed(tip, base, true),
        scene.remove(tip),
    ] {
        assert_eq!(refused, Err(SceneError::NoInstance(tip)));
    }
    assert_eq!(scene.find("tip"), None);
    // An identifier of another scene may by chance be one of this scene.
    assert!(scene.pose(other).is_ok());
    for d in [f64::NAN, -1.0, f64::INFINITY] {
        for refused in [scene.within(d).map(drop), scene.pairs_within(d).map(drop)] {
            assert!(matches!(refused, Err(SceneError::Query(QueryError::Number(NumberError::Distance(_))))));
        }
    }
    scene.add_named("tip", shape, Pose::IDENTITY).unwrap();
    // The broad phase compares each box with those behind it, and looks at one pair that this leaves.
    scene.set_budget(2);
    let said = scene.pairs_in_contact().unwrap_err().to_string();
    assert!(said.starts_with("expected an answer within 2 visits"), "{said}");
    scene.set_budget(4);
    let said = scene.pairs_in_contact().unwrap_err().to_string();
    assert!(said.starts_with("instances base and tip: expected an answer within 4 visits"), "{said}");
    scene.set_budget(u64::MAX);
    assert_eq!(scene.pairs_in_contact().unwrap().len(), 1);
}
