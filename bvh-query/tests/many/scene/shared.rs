//! Scenes of real meshes: every frame against brute force.

use super::{Answers, scenes};
use crate::common::{bake, shared};
use bvh_query::{Groups, InstanceId, OwnedShape, Pose, Querier, ScenePair};

/// A scene of `shared/scenes`: instances with their meshes and poses, what moves, what may touch, and the frames.
struct SharedScene {
    instances: Vec<(String, OwnedShape, Pose)>,
    moving: Vec<usize>,
    allowed: Vec<(usize, usize)>,
    frames: Vec<Vec<Pose>>,
}

fn numbers(words: &[&str]) -> Pose {
    let numbers: Vec<f64> = words.iter().map(|word| word.parse().unwrap()).collect();
    Pose::from_rows(numbers[..].try_into().unwrap()).unwrap()
}

impl SharedScene {
    fn read(name: &str) -> Self {
        let path = shared(&format!("scenes/{name}.scene"));
        let frames = std::fs::read_to_string(shared(&format!("scenes/{name}_frames.txt"))).unwrap();
        let lines = |text: &str| -> Vec<Vec<String>> {
            let words = |line: &str| {
                line.split('#').next().unwrap().split_whitespace().map(str::to_owned).collect::<Vec<_>>()
            };
            text.lines().map(words).filter(|words| !words.is_empty()).collect()
        };
        let mut meshes = std::collections::HashMap::new();
        let (mut instances, mut moving, mut allowed) = (Vec::new(), Vec::new(), Vec::new());
        let place = |instances: &[(String, OwnedShape, Pose)], name: &str| {
            instances.iter().position(|(held, ..)| held == name).unwrap()
        };
        for line in lines(&std::fs::read_to_string(&path).unwrap()) {
            let words: Vec<&str> = line.iter().map(String::as_str).collect();
            match words[..] {
                ["mesh", name, file] => {
                    let mesh = bvh_bake::input::read(&path.with_file_name(file)).unwrap().merged();
                    let shape = OwnedShape::from(bake(&mesh, &bvh_bake::Options::default()));
                    meshes.insert(name.to_owned(), shape);
                }
                ["instance", name, mesh, ..] => {
                    instances.push((name.to_owned(), meshes[mesh].clone(), numbers(&words[3..])));
                }
                ["moving", ref names @ ..] => {
                    moving.extend(names.iter().map(|name| place(&instances, name)));
                }
                ["allow", a, b] => allowed.push((place(&instances, a), place(&instances, b))),
                _ => panic!("{line:?}"),
            }
        }
        let frame = |line: &Vec<String>| {
            let words: Vec<&str> = line.iter().map(String::as_str).collect();
            words.chunks(12).map(numbers).collect()
        };
        Self { instances, moving, allowed, frames: lines(&frames).iter().map(frame).collect() }
    }
}

#[test]
#[ignore = "needs ../shared"]
fn open_scenes_have_the_answers_of_brute_force_in_every_frame() {
    let pool = cbvh_testkit::pool(2);
    // Least distances of all pairs take brute force long: one frame in so many.
    for (name, frames, every) in
        [("clutter60", 200, 20), ("clutter300", 200, 50), ("arm", 500, 50), ("many5k", 500, 250)]
    {
        let shared = SharedScene::read(name);
        assert!(shared.frames.len() >= frames, "{name}");
        let mut scenes = scenes();
        let mut ids = Vec::new();
        for scene in &mut scenes {
            ids = shared
                .instances
                .iter()
                .map(|(name, shape, world)| scene.add_named(name.clone(), shape.clone(), *world).unwrap())
                .collect::<Vec<_>>();
            for (number, &id) in ids.iter().enumerate() {
                let moves = shared.moving.contains(&number);
                let (member, meets) = if moves { (1, 3) } else { (2, 1) };
                scene.set_groups(id, Groups { member, meets }).unwrap();
            }
            shared.allowed.iter().for_each(|&(a, b)| scene.set_allowed(ids[a], ids[b], true).unwrap());
        }
        let mut worlds: Vec<Pose> = shared.instances.iter().map(|(_, _, world)| *world).collect();
        let mut querier = Querier::new().unwrap();
        let step = cbvh_testkit::depth::step(4);
        for (number, frame) in shared.frames.iter().enumerate().take(frames).step_by(step) {
            shared.moving.iter().zip(frame).for_each(|(&instance, pose)| worlds[instance] = *pose);
            let mut expected = Answers::default();
            let mut nearest: Option<(f64, InstanceId, InstanceId)> = None;
            let is_moving = |number: usize| shared.moving.contains(&number);
            let asks_distance = number % every == 0;
            for a in 0..ids.len() {
                // Of two that stand still, nothing is asked.
                let others: Vec<usize> = if is_moving(a) {
                    (a + 1..ids.len()).collect()
                } else {
                    shared.moving.iter().copied().filter(|&b| b > a).collect()
                };
                for b in others {
                    if shared.allowed.contains(&(a, b)) || shared.allowed.contains(&(b, a)) {
                        continue;
                    }
                    let pose = Pose::relative(&worlds[a], &worlds[b]).unwrap();
                    let shapes = [a, b].map(|number| &shared.instances[number].1);
                    if querier.collide(shapes[0], shapes[1], &pose).unwrap() {
                        expected.in_contact.push((ids[a], ids[b]));
                    }
                    if querier.within(shapes[0], shapes[1], &pose, 0.02).unwrap() {
                        expected.within.push((ids[a], ids[b]));
                    }
                    if asks_distance {
                        let distance = querier.distance(shapes[0], shapes[1], &pose).unwrap().distance;
                        if nearest.is_none_or(|held| (distance, ids[a], ids[b]) < held) {
                            nearest = Some((distance, ids[a], ids[b]));
                        }
                    }
                }
            }
            expected.in_contact.sort_unstable();
            expected.within.sort_unstable();
            let poses = shared.moving.iter().zip(frame).map(|(&instance, pose)| (ids[instance], *pose));
            for scene in &mut scenes {
                scene.set_poses(poses.clone()).unwrap();
                let pairs = |pairs: Vec<ScenePair>| -> Vec<_> {
                    pairs.into_iter().map(|pair| (pair.a, pair.b)).collect()
                };
                pool.install(|| {
                    assert_eq!(
                        pairs(scene.pairs_in_contact().unwrap()),
                        expected.in_contact,
                        "{name} {number}"
                    );
                    assert_eq!(pairs(scene.pairs_within(0.02).unwrap()), expected.within, "{name} {number}");
                    assert_eq!(scene.collide().unwrap(), !expected.in_contact.is_empty());
                    let found = scene.distance().unwrap().unwrap();
                    assert_eq!(found.nearest.distance == 0.0, !expected.in_contact.is_empty());
                    if asks_distance {
                        let found = (found.nearest.distance, found.pair.a, found.pair.b);
                        assert_eq!(Some(found), nearest, "{name} {number}");
                    }
                });
            }
        }
    }
}
