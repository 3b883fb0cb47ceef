//! Scenes.

use super::{BUDGETS, Spent, dust, tetrahedron, text, use_this_thread, within_budget};
use crate::allocator::peak;
use crate::common::shapes::moved;
use crate::common::{Triangle, baked, mesh, translation};
use bvh_bake::{Options, to_bytes};
use bvh_format::instances::{Instance, write_instances};
use bvh_format::validate::validate;
use bvh_query::{
    Bvh, Contact, Distance, Files, Groups, InstanceId, Motion, MotionOptions, OwnedShape, Pose, Querier, Ray,
    Relation, RigidPath, Scene, SceneError, SceneMotionAnswer, ScenePair,
};
use cbvh_testkit::seal::{put_together, take_apart};
use std::ops::ControlFlow;

type AskScene<'a> = &'a dyn Fn(&mut Scene) -> Result<String, SceneError>;

/// Every question about a scene, with the paths of some instances.
fn each_scene_question(paths: &[(InstanceId, &Motion)], mut check: impl FnMut(&str, AskScene<'_>)) {
    let paths: Vec<(InstanceId, &(dyn RigidPath + Sync))> =
        paths.iter().map(|&(id, path)| (id, path as &(dyn RigidPath + Sync))).collect();
    let options = &MotionOptions::new();
    let (point, ray) = ([0.1, 0.2, 0.3], Ray::new([0.1, 0.2, -3.0], [0.3, 0.2, 1.0]));
    let asks: [(&str, AskScene<'_>); 18] = [
        ("collide", &|s| text(s.collide())),
        ("within", &|s| text(s.within(0.01))),
        ("pairs_in_contact", &|s| text(s.pairs_in_contact())),
        ("pairs_within", &|s| text(s.pairs_within(0.01))),
        ("relations", &|s| text(s.relations())),
        ("contacts", &|s| text(s.contacts())),
        ("distance", &|s| text(s.distance())),
        ("motion", &|s| text(s.motion(&paths, options))),
        ("is_free", &|s| text(s.is_free(&paths, options))),
        ("closest_points", &|s| text(s.closest_points(&[point], f64::INFINITY))),
        ("sides", &|s| text(s.sides(&[point]))),
        ("signed_point_distances", &|s| text(s.signed_point_distances(&[point], 9.0))),
        ("first_hits", &|s| text(s.first_hits(&[ray]))),
        ("any_hits", &|s| text(s.any_hits(&[ray]))),
        ("all_hits", &|s| text(s.all_hits(&[ray]))),
        ("segment_hits", &|s| text(s.segment_hits(&[[[9.0; 3], point]]))),
        ("visible", &|s| text(s.visible(&[[[9.0; 3], point]], 0.1))),
        ("visit_contacts", &|s| {
            let mut all = Vec::new();
            s.visit_contacts(|pair, contacts| {
                all.push((pair, contacts.len()));
                ControlFlow::Continue(())
            })?;
            Ok(format!("{all:?}"))
        }),
    ];
    for (name, ask) in asks {
        check(name, ask);
    }
}

/// A scene file that puts an object into so many places.
fn scene_file(triangles: &[Triangle], places: impl Iterator<Item = Instance>) -> Vec<u8> {
    let mut sections = take_apart(&to_bytes(&mesh(triangles), &Options::default()).unwrap().0);
    let at = sections.partition_point(|section| section.0 < 7);
    sections.insert(at, (7, 0, write_instances(&places.collect::<Vec<_>>())));
    let bytes = put_together(&sections);
    validate(&bytes).unwrap();
    bytes
}

/// Opens a scene file and checks the memory that it takes, also for the broad phase of the first question.
fn open_scene(bytes: Vec<u8>) -> Scene {
    let bvh = Bvh::from_bytes(bytes).unwrap();
    let section = bvh.layout().sections.iter().map(|section| section.range.len()).max().unwrap();
    let (bytes, scene) = peak(|| {
        let mut scene = Scene::of_file(bvh).unwrap();
        scene.set_budget(0);
        assert!(scene.pairs_in_contact().unwrap_err().is_spent(0));
        scene
    });
    assert!(bytes <= 16 * section + (1 << 20), "{bytes} bytes for {section} bytes of instances");
    scene
}

/// Four thousand instances in one place are eight million pairs.
#[test]
fn questions_about_coincident_instances_keep_to_their_budget() {
    use_this_thread();
    let count = 4000;
    let file = scene_file(&tetrahedron(1.0, [0.0; 3]), (0..count).map(|_| Instance::of_object(0)));
    let mut scene = open_scene(file);
    let ids: Vec<InstanceId> = scene.instances().collect();
    let path = Motion::between(&translation(-9.0, 0.0, 0.0), &translation(9.0, 1.0, 1.0)).unwrap();
    let paths: Vec<(InstanceId, &Motion)> = ids.iter().take(4).map(|&id| (id, &path)).collect();
    for tracking in [false, true] {
        scene.set_tracking(tracking);
        for budget in BUDGETS {
            scene.set_budget(budget);
            each_scene_question(&paths, |name, ask| {
                let answer = within_budget(name, budget, || ask(&mut scene.clone()));
                let needs_all_pairs = name.starts_with("pairs") || name.starts_with("visit");
                assert!(answer.is_err() || !needs_all_pairs, "{name}, budget {budget}: {answer:?}");
                let answer = within_budget(name, budget, || ask(&mut scene));
                assert!(answer.is_err() || !needs_all_pairs, "{name}, budget {budget}: {answer:?}");
                assert!(scene.pairs_asked() <= budget + 1, "{name}: {} pairs", scene.pairs_asked());
            });
        }
    }
}

/// Groups of which no two meet, but all unions do: nothing is asked about, and finding that out is charged.
#[test]
fn looking_for_pairs_is_charged_where_there_are_none() {
    let count = 3000;
    let place = |number: u32| {
        // Each is in a group, and meets another one, so that no two instances meet each other.
        let [member, meets] = [1 << (number % 3), 1 << ((number + 1) % 3)];
        Instance { member, meets, ..Instance::of_object(0) }
    };
    let mut scene = open_scene(scene_file(&tetrahedron(1.0, [0.0; 3]), (0..count).map(place)));
    for budget in BUDGETS {
        scene.set_budget(budget);
        assert!(within_budget("pairs_in_contact", budget, || scene.pairs_in_contact()).is_err());
        assert!(within_budget("collide", budget, || scene.collide()).is_err());
        assert!(within_budget("distance", budget, || scene.distance()).is_err());
    }
    scene.set_budget(u64::MAX);
    let (bytes, nearest) = peak(|| scene.distance());
    assert_eq!(nearest, Ok(None));
    assert!(bytes < 8 << 20, "{bytes} bytes to find no pair");
}

/// Instances whose boxes all meet though the surfaces are apart, but for some that touch: more pairs than are known at a time.
fn crowd(count: usize) -> (Scene, Vec<InstanceId>, OwnedShape) {
    let two = [tetrahedron(0.25, [0.0; 3]), moved(&tetrahedron(0.25, [0.0; 3]), 1.0, [600.0; 3])].concat();
    let shape = OwnedShape::from(baked(&two));
    let mut scene = Scene::new().unwrap();
    // Two are in one place, near the end.
    let at = |number: usize| if number == count - 3 { count - 7 } else { number } as f64;
    let place = |number: usize| translation(0.0, at(number) * 0.5 + 1e-3 * (at(number) * 0.7).sin(), 0.0);
    let ids = (0..count).map(|number| scene.add(shape.clone(), place(number)).unwrap()).collect();
    (scene, ids, shape)
}

/// Without a budget, the pairs of a scene are known piece by piece. The answers are those about each pair.
#[test]
fn pairs_in_pieces_are_all_pairs() {
    let count = 400;
    let (mut scene, ids, shape) = crowd(count);
    let mut querier = Querier::new().unwrap();
    let mut near = Vec::new();
    let mut contacts: Vec<(ScenePair, Vec<Contact>)> = Vec::new();
    let mut nearest: Option<(ScenePair, Distance)> = None;
    let poses: Vec<Pose> = ids.iter().map(|id| *scene.pose(*id).unwrap()).collect();
    let d = 0.2503;
    for a in 0..count {
        for b in a + 1..count {
            let pose = Pose::relative(&poses[a], &poses[b]).unwrap();
            let pair = ScenePair { a: ids[a], b: ids[b] };
            if querier.within(&shape, &shape, &pose, d).unwrap() {
                near.push(pair);
            }
            let found = querier.contacts(&shape, &shape, &pose).unwrap();
            if !found.is_empty() {
                nearest = Some((pair, querier.distance(&shape, &shape, &pose).unwrap()));
                contacts.push((pair, found));
            }
        }
    }
    assert!(
        near.len() > 20 && near.len() < count && contacts.len() == 1,
        "{} {}",
        near.len(),
        contacts.len()
    );
    for (threads, tracking) in [(1, false), (3, true)] {
        let pool = cbvh_testkit::pool(threads);
        scene.set_parallel(threads > 1);
        scene.set_tracking(tracking);
        // The second time, the scene knows which pair is likely.
        for _ in 0..2 {
            pool.install(|| {
                assert_eq!(scene.pairs_within(d).unwrap(), near);
                assert!(scene.pairs_asked() > 1 << 16, "{}", scene.pairs_asked());
                assert_eq!(scene.pairs_in_contact().unwrap(), [contacts[0].0]);
                assert_eq!(scene.relations().unwrap(), [(contacts[0].0, Relation::Touching)]);
                assert!(scene.collide().unwrap() && scene.within(d).unwrap());
                assert_eq!(scene.distance().unwrap().map(|at| (at.pair, at.nearest)), nearest);
                let mut all = Vec::new();
                scene
                    .visit_contacts(|pair, contacts| {
                        all.push((pair, contacts.to_vec()));
                        ControlFlow::Continue(())
                    })
                    .unwrap();
                assert_eq!(all, contacts);
                // A budget that suffices changes nothing, on any number of threads.
                scene.set_budget(1 << 40);
                assert_eq!(scene.pairs_within(d).unwrap(), near);
                scene.set_budget(100_000);
                assert!(scene.pairs_within(d).unwrap_err().is_spent(100_000));
                scene.set_budget(u64::MAX);
            });
        }
    }
    // With the two in one place apart, the nearest pair is another one.
    scene.set_pose(ids[count - 3], translation(0.0, 1e3, 0.0)).unwrap();
    let least = scene.distance().unwrap().unwrap();
    assert!(least.nearest.distance > 0.2 && near.contains(&least.pair), "{least:?}");
    assert!(!scene.collide().unwrap());
}

/// All instances are on paths, so that there are more pairs than are known at a time. One of them moves.
#[test]
fn motions_in_pieces_are_those_of_all_pairs() {
    let count = 400;
    let (mut scene, ids, _) = crowd(count);
    scene.remove(ids[count - 3]).unwrap();
    let last = ids[count - 1];
    let there: Vec<(InstanceId, Motion)> = scene
        .instances()
        .map(|id| {
            let pose = *scene.pose(id).unwrap();
            let [x, y, z] = pose.translation();
            let end = if id == last { translation(x, y - 150.1, z) } else { pose };
            (id, Motion::between(&pose, &end).unwrap())
        })
        .collect();
    let options = &MotionOptions::new();
    let paths: Vec<(InstanceId, &(dyn RigidPath + Sync))> =
        there.iter().map(|(id, path)| (*id, path as &(dyn RigidPath + Sync))).collect();
    let moving = *paths.last().unwrap();
    let alone = scene.motion(&[moving], options).unwrap();
    let SceneMotionAnswer::Hit { pair, .. } = alone else { panic!("{alone:?}") };
    assert_eq!(pair.b, last);
    assert_eq!(scene.is_free(&[moving], options), Ok(false));
    for threads in [1, 3] {
        let pool = cbvh_testkit::pool(threads);
        scene.set_parallel(threads > 1);
        pool.install(|| {
            assert_eq!(scene.motion(&paths, options).unwrap(), alone);
            assert!(scene.pairs_asked() > 1 << 16, "{}", scene.pairs_asked());
            assert_eq!(scene.is_free(&paths, options), Ok(false));
            assert_eq!(scene.is_free(&paths[..count - 2], options), Ok(true));
            scene.set_budget(50_000);
            assert!(scene.motion(&paths, options).unwrap_err().is_spent(50_000));
            assert!(scene.is_free(&paths[..count - 2], options).unwrap_err().is_spent(50_000));
            scene.set_budget(u64::MAX);
        });
    }
}

/// Without a budget, memory does not grow with the number of pairs.
#[test]
fn the_pairs_of_a_scene_are_not_all_kept() {
    let count = 2000;
    let file = scene_file(&tetrahedron(1.0, [0.0; 3]), (0..count).map(|_| Instance::of_object(0)));
    let mut scene = open_scene(file);
    scene.set_budget(u64::MAX);
    for tracking in [false, true] {
        scene.set_tracking(tracking);
        let mut pairs = 0;
        let (bytes, visited) = peak(|| {
            scene.visit_contacts(|_, _| {
                pairs += 1;
                if pairs == 200_000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        });
        assert_eq!((visited, pairs), (Ok(()), 200_000));
        let most = if tracking { 24 << 20 } else { 4 << 20 };
        assert!(bytes < most, "{bytes} bytes for {count} instances");
    }
}

/// A file that is opened for each question takes as much as opening it, and no more stay open than may.
#[test]
fn files_that_are_opened_for_a_question_are_closed_again() {
    let directory = cbvh_testkit::folder();
    let bytes = to_bytes(&mesh(&dust(10)), &Options::default()).unwrap().0;
    let files = Files::new(2);
    let mut scene = Scene::new().unwrap();
    for number in 0..20 {
        let path = directory.path().join(format!("{number}.cbvh"));
        std::fs::write(&path, &bytes).unwrap();
        let id = scene.add(files.shape(&path).unwrap(), Pose::IDENTITY).unwrap();
        scene.set_groups(id, Groups::ALL).unwrap();
    }
    for budget in BUDGETS {
        scene.set_budget(budget);
        let answer = within_budget("pairs_in_contact", budget, || scene.pairs_in_contact());
        assert_eq!(answer.is_ok(), budget == 10_000, "{answer:?}");
        assert!(files.open_count() <= 2);
    }
}
