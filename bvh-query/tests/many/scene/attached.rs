//! Attached instances: every question equals that of a scene whose poses are set by hand, and motions are those of all that moves.

use super::{Answers, ask, place, scenes, shape, shapes};
use crate::common::shapes::{cube, plate, sphere, torus};
use crate::common::{Random, random_pose, translation as at};
use bvh_query::{
    InstanceId, Motion, MotionOptions, OwnedShape, Pose, PoseError, Ray, RigidPath, Scene, SceneError,
    SceneMotionAnswer,
};
use cbvh_testkit::depth::rounds;
use std::collections::BTreeMap;

/// An instance of the scene by hand: its pose, and with which parent it moves at which pose.
#[derive(Clone)]
struct Placed {
    id: InstanceId,
    shape: OwnedShape,
    world: Pose,
    attached: Option<(InstanceId, Pose)>,
}

/// The definition: the pose in the parent's frame. All rotations here are orthonormal to a few roundings.
fn kept(child: &Pose, parent: &Pose) -> Pose {
    Pose::relative(parent, child).unwrap()
}

/// Moves instances by the definition: those that are named, and then what follows, from parents to children.
fn move_by_hand(placed: &mut [Placed], named: &BTreeMap<InstanceId, Pose>) {
    let of = |placed: &[Placed], id| placed.iter().position(|one| one.id == id).unwrap();
    let depth = |placed: &[Placed], number: usize| {
        std::iter::successors(Some(number), |&number| Some(of(placed, placed[number].attached?.0))).count()
    };
    let mut order: Vec<usize> = (0..placed.len()).collect();
    order.sort_by_key(|&number| depth(placed, number));
    for number in order {
        let given = named.get(&placed[number].id);
        placed[number].world = match (placed[number].attached, given) {
            (None, None) => continue,
            (None, Some(world)) => *world,
            (Some((parent, held)), given) => {
                let above = placed[of(placed, parent)].world;
                let held = given.map_or(held, |world| kept(world, &above));
                placed[number].attached = Some((parent, held));
                held.then(&above).unwrap()
            }
        };
    }
}

#[test]
fn every_answer_is_that_of_poses_set_by_hand() {
    let pool = cbvh_testkit::pool(2);
    let random = &mut Random::new(71);
    let shapes = shapes();
    let (mut followed, mut touching, mut refused) = (0, 0, 0);
    for round in 0..rounds(3) {
        let mut scenes = scenes();
        let spread = [2.0, 4.0, 9.0][round as usize % 3];
        let mut placed: Vec<Placed> = (0..9)
            .map(|_| {
                let shape = shapes[random.below(shapes.len())].clone();
                let world = place(random, &shape, spread);
                let ids = scenes.iter_mut().map(|scene| scene.add(shape.clone(), world).unwrap());
                Placed { id: ids.last().unwrap(), shape, world, attached: None }
            })
            .collect();
        for frame in 0..8 {
            for _ in 0..3 {
                let (child, parent) = (random.below(placed.len()), random.below(placed.len()));
                let (child, above) = (placed[child].id, placed[parent].id);
                let of = |id| placed.iter().position(|one| one.id == id).unwrap();
                let up = |number: &usize| Some(of(placed[*number].attached?.0));
                let is_cycle =
                    std::iter::successors(Some(parent), up).any(|number| placed[number].id == child);
                for scene in &mut scenes {
                    assert_eq!(scene.attach(child, above).is_err(), is_cycle);
                }
                refused += usize::from(is_cycle);
                if !is_cycle {
                    let number = of(child);
                    let world = placed[number].world;
                    placed[number].attached = Some((above, Pose::IDENTITY));
                    move_by_hand(&mut placed, &BTreeMap::from([(child, world)]));
                }
            }
            if random.below(2) == 0 {
                let one = random.below(placed.len());
                placed[one].attached = None;
                scenes.iter_mut().for_each(|scene| scene.detach(placed[one].id).unwrap());
            }
            if frame == 5 {
                let gone = placed.swap_remove(random.below(placed.len())).id;
                scenes.iter_mut().for_each(|scene| scene.remove(gone).unwrap());
                let left =
                    placed.iter_mut().filter(|one| one.attached.is_some_and(|(parent, _)| parent == gone));
                left.for_each(|one| one.attached = None);
            }
            // Some twice, and parents and children in any order.
            let moves: Vec<(InstanceId, Pose)> = (0..3)
                .map(|_| {
                    let one = &placed[random.below(placed.len())];
                    (one.id, place(random, &one.shape, spread))
                })
                .collect();
            let named: BTreeMap<InstanceId, Pose> = moves.iter().copied().collect();
            move_by_hand(&mut placed, &named);
            followed +=
                placed.iter().filter(|one| one.attached.is_some() && !named.contains_key(&one.id)).count();
            // Ids of the scenes are those of a scene by hand in the same order of places.
            let mut by_hand = Scene::new().unwrap();
            let mut ids = BTreeMap::new();
            placed.sort_by_key(|one| one.id);
            for one in &placed {
                ids.insert(by_hand.add(one.shape.clone(), one.world).unwrap(), one.id);
            }
            let expected = ask(&mut by_hand);
            let expected = Answers {
                in_contact: expected.in_contact.iter().map(|(a, b)| (ids[a], ids[b])).collect(),
                within: expected.within.iter().map(|(a, b)| (ids[a], ids[b])).collect(),
                contacts: expected.contacts.iter().map(|(a, b, of)| (ids[a], ids[b], *of)).collect(),
                distance: expected.distance.map(|(a, b, of)| (ids[&a], ids[&b], of)),
            };
            touching += expected.in_contact.len();
            let points: Vec<[f64; 3]> = (0..20).map(|_| random.point().map(|v| spread * v)).collect();
            let rays: Vec<Ray> = points.iter().map(|point| Ray::new(*point, random.point())).collect();
            let closest = by_hand.closest_points(&points, f64::INFINITY).unwrap();
            let hits = by_hand.first_hits(&rays).unwrap();
            let relations: Vec<_> =
                by_hand.relations().unwrap().into_iter().map(|(_, found)| found).collect();
            for (number, scene) in scenes.iter_mut().enumerate() {
                scene.set_poses(moves.iter().copied()).unwrap();
                for one in &placed {
                    assert_eq!(scene.pose(one.id), Ok(&one.world), "scene {number}, frame {frame}");
                    assert_eq!(
                        scene.parent(one.id).map(|held| held.map(|(parent, kept)| (parent, *kept))),
                        Ok(one.attached)
                    );
                }
                assert_eq!(pool.install(|| ask(scene)), expected, "scene {number}, frame {frame}");
                let found = scene.closest_points(&points, f64::INFINITY).unwrap();
                for (found, expected) in found.iter().flatten().zip(closest.iter().flatten()) {
                    assert_eq!((found.instance, found.closest), (ids[&expected.instance], expected.closest));
                }
                let found = scene.first_hits(&rays).unwrap();
                let named = |hit: &bvh_query::SceneRayHit| (ids[&hit.instance], hit.hit);
                let expected: Vec<_> = hits.iter().map(|hit| hit.as_ref().map(named)).collect();
                assert_eq!(
                    found.iter().map(|hit| hit.map(|hit| (hit.instance, hit.hit))).collect::<Vec<_>>(),
                    expected
                );
                let found: Vec<_> = scene.relations().unwrap().into_iter().map(|(_, found)| found).collect();
                assert_eq!(found, relations);
            }
        }
    }
    assert!(followed > 20 && touching > 20 && refused > 3, "{followed} {touching} {refused}");
}

#[test]
fn cycles_and_strangers_are_refused_and_change_nothing() {
    let block = shape(&cube());
    let mut scene = Scene::new().unwrap();
    let ids: Vec<_> = (0..4)
        .map(|k| scene.add_named(format!("{k}"), block.clone(), at(3.0 * f64::from(k), 0.0, 0.0)).unwrap())
        .collect();
    scene.attach(ids[1], ids[0]).unwrap();
    scene.attach(ids[2], ids[1]).unwrap();
    for (child, parent) in [(0, 0), (0, 1), (0, 2), (1, 2), (2, 2)] {
        let error = scene.attach(ids[child], ids[parent]).unwrap_err();
        let expected =
            format!("instance {child}: expected a parent that does not move with it, found {parent}");
        assert_eq!(error.to_string(), expected);
        assert!(matches!(error, SceneError::Cycle { .. }));
    }
    let gone = scene.add(block.clone(), Pose::IDENTITY).unwrap();
    scene.remove(gone).unwrap();
    for refused in [
        scene.attach(gone, ids[0]),
        scene.attach(ids[0], gone),
        scene.detach(gone),
        scene.set_shape(gone, block.clone()),
        scene.parent(gone).map(drop),
    ] {
        assert_eq!(refused, Err(SceneError::NoInstance(gone)));
    }
    let parents = |scene: &Scene| {
        ids.iter().map(|&id| scene.parent(id).unwrap().map(|(parent, _)| parent)).collect::<Vec<_>>()
    };
    assert_eq!(parents(&scene), [None, Some(ids[0]), Some(ids[1]), None]);
    // Another parent takes the place of the first; what is not attached may be detached.
    scene.attach(ids[2], ids[3]).unwrap();
    scene.detach(ids[0]).unwrap();
    assert_eq!(parents(&scene), [None, Some(ids[0]), Some(ids[3]), None]);
    scene.set_pose(ids[0], at(0.0, 5.0, 0.0)).unwrap();
    assert_eq!(scene.pose(ids[1]), Ok(&at(3.0, 5.0, 0.0)));
    assert_eq!(scene.pose(ids[2]), Ok(&at(6.0, 0.0, 0.0)));
    // At a pose in the parent's frame, and there again in a scene that is made anew.
    let mut again = scene.clone();
    again.attach_at(ids[2], ids[0], at(0.0, 0.0, 7.0)).unwrap();
    assert_eq!(again.pose(ids[2]), Ok(&at(0.0, 5.0, 7.0)));
    assert_eq!(again.parent(ids[2]), Ok(Some((ids[0], &at(0.0, 0.0, 7.0)))));
    assert!(again.attach_at(ids[0], ids[2], Pose::IDENTITY).is_err());
    // Without its parent, an instance stays; another one in the place of the parent does not take it along.
    scene.remove(ids[0]).unwrap();
    let next = scene.add(block, at(9.0, 9.0, 9.0)).unwrap();
    scene.set_pose(next, Pose::IDENTITY).unwrap();
    assert_eq!((scene.parent(ids[1]), scene.pose(ids[1])), (Ok(None), Ok(&at(3.0, 5.0, 0.0))));
}

#[test]
fn a_pose_out_of_range_moves_nobody() {
    let block = shape(&cube());
    let far = 2f64.powi(118);
    let mut scene = Scene::new().unwrap();
    let ids = [0.0, 0.75 * far, 5.0].map(|x| scene.add(block.clone(), at(x, 0.0, 0.0)).unwrap());
    scene.attach(ids[1], ids[0]).unwrap();
    scene.attach(ids[2], ids[1]).unwrap();
    let before = ids.map(|id| *scene.pose(id).unwrap());
    for poses in
        [vec![(ids[0], at(far, 0.0, 0.0))], vec![(ids[2], Pose::IDENTITY), (ids[0], at(far, 0.0, 0.0))]]
    {
        let error = scene.set_poses(poses).unwrap_err();
        let SceneError::Pose { instance, source } = error else { panic!("{error}") };
        assert_eq!((instance.id, source), (ids[1], PoseError::TooFarInWorld(1.75 * far)));
        assert_eq!(ids.map(|id| *scene.pose(id).unwrap()), before);
    }
    let through = Motion::between(&Pose::IDENTITY, &at(far, 0.0, 0.0)).unwrap();
    let error = scene.motion(&[(ids[0], &through)], &MotionOptions::new()).unwrap_err();
    assert!(matches!(&error, SceneError::Pose { instance, .. } if instance.id == ids[1]));
    // What is kept is still the same.
    scene.set_pose(ids[0], at(0.0, 4.0, 0.0)).unwrap();
    assert_eq!(scene.pose(ids[1]), Ok(&at(0.75 * far, 4.0, 0.0)));
}

/// However often a parent moves, a pose that it had before gives its children the poses that they had, and rotations of `f32` do
/// not add up along a chain.
#[test]
fn nothing_drifts_and_rounded_rotations_do_not_add_up() {
    let random = &mut Random::new(72);
    let block = shape(&cube());
    let mut scene = Scene::new().unwrap();
    let rounded = |random: &mut Random| {
        let pose = random_pose(random, 3.0);
        Pose::new(pose.rotation().map(|row| row.map(|v| f64::from(v as f32))), pose.translation()).unwrap()
    };
    let ids: Vec<_> = (0..12).map(|_| scene.add(block.clone(), rounded(random)).unwrap()).collect();
    for two in ids.windows(2) {
        let before = *scene.pose(two[1]).unwrap();
        scene.attach(two[1], two[0]).unwrap();
        let after = scene.pose(two[1]).unwrap();
        for (was, is) in before.rotation().as_flattened().iter().zip(after.rotation().as_flattened()) {
            assert!((was - is).abs() < 2f64.powi(-21), "{was} {is}");
        }
        for (was, is) in before.translation().iter().zip(after.translation()) {
            assert!((was - is).abs() < 1e-14, "{was} {is}");
        }
    }
    // What is kept can be put into another scene, to the bit.
    let mut again = Scene::new().unwrap();
    let same: Vec<_> =
        ids.iter().map(|&id| again.add(block.clone(), *scene.pose(id).unwrap()).unwrap()).collect();
    for &child in ids.iter().rev() {
        if let Some((parent, kept)) = scene.parent(child).unwrap() {
            again.attach_at(child, parent, *kept).unwrap();
        }
    }
    assert_eq!(same, ids);
    let poses = |scene: &Scene| ids.iter().map(|&id| *scene.pose(id).unwrap()).collect::<Vec<_>>();
    assert_eq!(poses(&again), poses(&scene));
    let (first, start) = (poses(&scene), *scene.pose(ids[0]).unwrap());
    for _ in 0..2000 {
        scene.set_pose(ids[0], rounded(random)).unwrap();
    }
    assert_ne!(poses(&scene), first);
    scene.set_pose(ids[0], start).unwrap();
    assert_eq!(poses(&scene), first);
}

/// A path by hand of what is attached: what a user would write, with a generous bound.
struct Follows<'a> {
    body: &'a (dyn RigidPath + Sync),
    kept: Vec<Pose>,
}

impl RigidPath for Follows<'_> {
    fn pose(&self, t: f64) -> Pose {
        self.kept.iter().fold(self.body.pose(t), |parent, kept| kept.then(&parent).unwrap())
    }
    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        let away: f64 = self.kept.iter().flat_map(Pose::translation).map(f64::abs).sum();
        self.body.sagitta(1.0001 * radius + 1.0001 * away, t0, t1) + 1e-11
    }
}

#[test]
fn motions_take_along_what_is_attached() {
    let random = &mut Random::new(73);
    let small = |triangles: Vec<super::Triangle>| {
        shape(&triangles.iter().map(|t| t.map(|p| p.map(|v| 0.4 * v))).collect::<Vec<_>>())
    };
    let shapes = [small(cube()), small(plate(4)), small(sphere(2)), small(torus(12, 6))];
    let (mut kinds, mut hit_by_children, mut samples) = ([0; 3], 0, 0);
    for round in 0..rounds(60) {
        let mut scene = Scene::new().unwrap();
        scene.set_parallel(round % 2 == 1);
        let ids: Vec<_> = (0..7)
            .map(|_| scene.add(shapes[random.below(4)].clone(), random_pose(random, 2.5)).unwrap())
            .collect();
        // 0 moves, with 1 and 2 in a chain and 3 beside; 4 has a path of its own, which 5 follows in some rounds; 6 stands still.
        let mut held = BTreeMap::new();
        for (child, parent) in [(1, 0), (2, 1), (3, 0), (4, 2), (5, 4)] {
            if child < 5 || round % 3 == 0 {
                held.insert(child, kept(scene.pose(ids[child]).unwrap(), scene.pose(ids[parent]).unwrap()));
                scene.attach(ids[child], ids[parent]).unwrap();
            }
        }
        // What is held together may touch, or every motion would hit at its start.
        for (a, b) in (0..7).flat_map(|a| (0..a).map(move |b| (a, b))) {
            let start = [ids[a], ids[b]].map(|id| *scene.pose(id).unwrap());
            let apart =
                (0..3).map(|k| (start[0].translation()[k] - start[1].translation()[k]).powi(2)).sum::<f64>();
            if apart < 1.4 {
                scene.set_allowed(ids[a], ids[b], true).unwrap();
            }
        }
        let starts = [0, 4].map(|number| *scene.pose(ids[number]).unwrap());
        let turn = 2.5 * random.signed();
        let body =
            Motion::screw(&starts[0], random.point(), random.point(), turn, 0.5 * random.signed()).unwrap();
        let own = Motion::between(&starts[1], &random_pose(random, 2.5)).unwrap();
        let mut paths: Vec<(InstanceId, &(dyn RigidPath + Sync))> = vec![(ids[0], &body)];
        if round % 4 < 3 {
            paths.push((ids[4], &own));
        }
        let options = MotionOptions::new()
            .clearance([0.0, 0.05][random.below(2)])
            .tolerance([1e-3, 0.2][random.below(2)]);
        let before: Vec<Pose> = ids.iter().map(|&id| *scene.pose(id).unwrap()).collect();
        let answer = scene.motion(&paths, &options).unwrap();
        assert_eq!(scene.is_free(&paths, &options), Ok(answer == SceneMotionAnswer::Free));
        assert_eq!(ids.iter().map(|&id| *scene.pose(id).unwrap()).collect::<Vec<_>>(), before);

        // By hand: the same paths for instances that are attached to nothing.
        let mut loose = scene.clone();
        ids.iter().for_each(|&id| loose.detach(id).unwrap());
        let mut by_hand: Vec<(InstanceId, Follows<'_>)> = vec![
            (ids[0], Follows { body: &body, kept: vec![] }),
            (ids[1], Follows { body: &body, kept: vec![held[&1]] }),
            (ids[2], Follows { body: &body, kept: vec![held[&1], held[&2]] }),
            (ids[3], Follows { body: &body, kept: vec![held[&3]] }),
        ];
        let to_four = [held[&1], held[&2], held[&4]];
        let four = |more: Vec<Pose>| match paths.len() {
            2 => Follows { body: &own, kept: more },
            _ => Follows { body: &body, kept: to_four.iter().copied().chain(more).collect() },
        };
        by_hand.push((ids[4], four(vec![])));
        if round % 3 == 0 {
            by_hand.push((ids[5], four(vec![held[&5]])));
        }
        let given: Vec<(InstanceId, &(dyn RigidPath + Sync))> =
            by_hand.iter().map(|(id, path)| (*id, path as &(dyn RigidPath + Sync))).collect();
        let expected = loose.motion(&given, &options).unwrap();
        let until = |answer: &SceneMotionAnswer| match *answer {
            SceneMotionAnswer::Free => (0, 2.0, None),
            SceneMotionAnswer::Near { free_until, at, .. } => (1, free_until, Some(at)),
            SceneMotionAnswer::Hit { free_until, touching_at, .. } => (2, free_until, Some(touching_at)),
        };
        let (kind, free_until, at) = until(&answer);
        let (kind_by_hand, free_by_hand, at_by_hand) = until(&expected);
        // Bounds differ a little, so cells may, and what is undecided in one may be clear in the other.
        if kind == 2 || kind_by_hand == 2 {
            assert_eq!(kind, kind_by_hand, "round {round}");
            let (at, by_hand) = (at.unwrap(), at_by_hand.unwrap());
            assert!((at - by_hand).abs() < 0.05, "round {round}: {at} {by_hand}");
            // What hits is certain: for neither may be free where the other touches.
            assert!(free_until <= by_hand && free_by_hand <= at, "round {round}");
        }
        kinds[kind] += 1;

        // By samples: whatever is said to be free is, and a hit is one.
        let moving = |id: InstanceId| by_hand.iter().any(|(moves, _)| *moves == id);
        for step in 0..=100 {
            let time = f64::from(step) / 100.0;
            let mut scene = scene.clone();
            if paths.len() == 2 {
                scene.detach(ids[4]).unwrap();
            }
            scene.set_poses(paths.iter().map(|(id, path)| (*id, path.pose(time)))).unwrap();
            for (id, path) in &by_hand {
                assert_eq!(scene.pose(*id), Ok(&path.pose(time)), "round {round} at {time}");
            }
            if time < free_until {
                let mut within = scene.pairs_within((options.clearance - 1e-12).max(0.0)).unwrap();
                within.retain(|pair| moving(pair.a) || moving(pair.b));
                assert_eq!(within, [], "round {round} at {time} of {free_until}");
                samples += 1;
            }
        }
        if let SceneMotionAnswer::Hit { touching_at, pair, .. } = answer {
            scene.set_poses(paths.iter().map(|(id, path)| (*id, path.pose(touching_at)))).unwrap();
            let within = scene.pairs_within(options.clearance + 1e-12).unwrap();
            assert!(
                within.iter().any(|of| [of.a, of.b] == [pair.a, pair.b] || [of.b, of.a] == [pair.a, pair.b])
            );
            hit_by_children +=
                usize::from(![ids[0], ids[4]].contains(&pair.a) && ![ids[0], ids[4]].contains(&pair.b));
        }
    }
    assert!(
        kinds[0] > 3 && kinds[2] > 3 && hit_by_children > 2 && samples > 500,
        "{kinds:?} {hit_by_children} {samples}"
    );
}

/// A gripper and its part, and two parts of a tray, keep their distance on the way: one query for each pair, however much they
/// turn and however near they are.
#[test]
fn what_is_held_together_takes_one_query() {
    let block = shape(&cube());
    let mut scene = Scene::new().unwrap();
    let gap = 1e-9;
    let gripper = scene.add(block.clone(), at(0.0, 0.0, 0.0)).unwrap();
    let parts = [2.0 + gap, -2.0 - gap].map(|x| scene.add(block.clone(), at(x, 0.0, 0.0)).unwrap());
    let turn = Motion::screw(&Pose::IDENTITY, [5.0, 1.0, 0.0], [0.3, -0.2, 1.0], 3.0, 1.0).unwrap();
    for part in parts {
        scene.attach(part, gripper).unwrap();
    }
    // Much nearer than the tolerance, and yet free, from the start to the end.
    let near = MotionOptions::new();
    assert_eq!(scene.motion(&[(gripper, &turn)], &near), Ok(SceneMotionAnswer::Free));
    assert!(scene.pairs_asked() >= 2 && scene.stats().node_tests < 200, "{:?}", scene.stats());
    // In touch: a hit, unless that is allowed.
    scene.set_pose(parts[0], at(2.0, 0.0, 0.0)).unwrap();
    let answer = scene.motion(&[(gripper, &turn)], &MotionOptions::new().clearance(1e-12)).unwrap();
    let SceneMotionAnswer::Hit { free_until: 0.0, pair, .. } = answer else { panic!("{answer:?}") };
    assert_eq!([pair.a, pair.b], [gripper, parts[0]]);
    scene.set_allowed(parts[0], gripper, true).unwrap();
    assert_eq!(scene.motion(&[(gripper, &turn)], &near), Ok(SceneMotionAnswer::Free));
}
