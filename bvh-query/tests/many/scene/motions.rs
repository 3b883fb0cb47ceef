//! Motions in scenes: against each pair along its relative path, put together; and against poses along the way.

use super::{Triangle, shape};
use crate::common::shapes::{cube, plate, sphere, torus};
use crate::common::{Random, random_pose, translation as at};
use bvh_query::{
    Backend, Distance, Groups, InstanceId, Motion, MotionAnswer, MotionOptions, NumberError, OwnedShape,
    Pose, PoseError, Querier, QueryError, RelativePath, RigidPath, Scene, SceneError, SceneMotionAnswer,
};
use cbvh_testkit::depth::rounds;

/// An instance of a scene, and what it is given.
struct Placed {
    id: InstanceId,
    shape: OwnedShape,
    world: Pose,
    groups: Groups,
    path: Option<Motion>,
}

impl Placed {
    fn path(&self) -> &dyn RigidPath {
        self.path.as_ref().map_or(&self.world, |path| path)
    }
}

/// An answer that is not free: whether it is a hit, until when the ways are free, the time, the pair and its distance.
type Told = (bool, f64, f64, (InstanceId, InstanceId), Distance);

fn told(answer: SceneMotionAnswer) -> Option<Told> {
    match answer {
        SceneMotionAnswer::Free => None,
        SceneMotionAnswer::Hit { free_until, touching_at, pair, nearest } => {
            Some((true, free_until, touching_at, (pair.a, pair.b), nearest))
        }
        SceneMotionAnswer::Near { free_until, at, pair, nearest } => {
            Some((false, free_until, at, (pair.a, pair.b), nearest))
        }
    }
}

/// The answers about all pairs, put together: the earliest hit, else the earliest undecided pose.
fn pair_by_pair(placed: &[Placed], allowed: [InstanceId; 2], options: &MotionOptions) -> Option<Told> {
    let mut querier = Querier::new().unwrap();
    let mut answers: Vec<Told> = Vec::new();
    for (number, first) in placed.iter().enumerate() {
        for second in &placed[number + 1..] {
            let is_asked = first.groups.meet(second.groups) && [first.id, second.id] != allowed;
            if !is_asked || first.path.is_none() && second.path.is_none() {
                continue;
            }
            let is_second_still = first.path.is_some() && second.path.is_none();
            let (a, b) = if is_second_still { (second, first) } else { (first, second) };
            let path = RelativePath::new(a.path(), b.path());
            let pair = (a.id, b.id);
            answers.extend(match querier.motion(a.shape.shape(), b.shape.shape(), &path, options).unwrap() {
                MotionAnswer::Free => None,
                MotionAnswer::Hit { free_until, touching_at, nearest } => {
                    Some((true, free_until, touching_at, pair, nearest))
                }
                MotionAnswer::Near { free_until, at, nearest } => {
                    Some((false, free_until, at, pair, nearest))
                }
            });
        }
    }
    let free_until = answers.iter().map(|told| told.1).fold(f64::INFINITY, f64::min);
    let order = |told: &&Told| (!told.0, told.2, told.3);
    let first = answers.iter().min_by(|x, y| order(x).partial_cmp(&order(y)).unwrap())?;
    Some((first.0, free_until, first.2, first.3, first.4))
}

#[test]
fn answers_are_those_of_the_pairs_put_together() {
    let random = &mut Random::new(31);
    let small = |triangles: &[Triangle]| {
        shape(&triangles.iter().map(|t| t.map(|p| p.map(|v| 0.4 * v))).collect::<Vec<_>>())
    };
    let shapes = [small(&cube()), small(&plate(4)), small(&sphere(2)), small(&torus(12, 6))];
    let mut kinds = [0; 3];
    for round in 0..rounds(40) {
        let mut scenes: Vec<Scene> = Backend::ALL
            .into_iter()
            .filter(|backend| backend.is_available())
            .map(Scene::with_backend)
            .collect();
        let mut parallel = Scene::new().unwrap();
        parallel.set_parallel(true);
        scenes.push(parallel);
        let count = 2 + random.below(6);
        let moves = 1 + random.below(3);
        let mut placed: Vec<Placed> = Vec::new();
        for number in 0..count {
            let shape = shapes[random.below(shapes.len())].clone();
            let [world, end] = [random_pose(random, 2.0), random_pose(random, 2.0)];
            let groups = if random.below(4) == 0 { Groups { member: 1, meets: 2 } } else { Groups::ALL };
            let path =
                (number % 2 == 0 && number / 2 < moves).then(|| Motion::between(&world, &end).unwrap());
            let mut id = None;
            for scene in &mut scenes {
                let added = scene.add(shape.clone(), world).unwrap();
                scene.set_groups(added, groups).unwrap();
                id = Some(added);
            }
            placed.push(Placed { id: id.unwrap(), shape, world, groups, path });
        }
        let allowed = [placed[0].id, placed[count - 1].id];
        let paths: Vec<(InstanceId, &(dyn RigidPath + Sync))> = placed
            .iter()
            .filter_map(|one| Some((one.id, one.path.as_ref()? as &(dyn RigidPath + Sync))))
            .collect();
        let options = MotionOptions::new()
            .clearance([0.0, 0.1][random.below(2)])
            .tolerance([1e-3, 0.3][random.below(2)]);
        let expected = pair_by_pair(&placed, allowed, &options);
        for scene in &mut scenes {
            scene.set_allowed(allowed[0], allowed[1], true).unwrap();
            let answer = scene.motion(&paths, &options).unwrap();
            assert_eq!(told(answer), expected, "round {round}");
            assert_eq!(scene.is_free(&paths, &options), Ok(expected.is_none()), "round {round}");
            // Nobody has moved.
            assert!(placed.iter().all(|one| scene.pose(one.id) == Ok(&one.world)));
        }
        check_by_samples(&mut scenes[0], &placed, &options, expected.map_or(2.0, |told| told.1));
        kinds[expected.map_or(0, |told| 1 + usize::from(told.0))] += 1;
    }
    assert!(kinds.iter().all(|&count| count > 0), "{kinds:?}");
}

/// No pair of which one moves is within the clearance at a time before `free_until`.
fn check_by_samples(scene: &mut Scene, placed: &[Placed], options: &MotionOptions, free_until: f64) {
    for step in 0..=60 {
        let time = f64::from(step) / 60.0;
        if time >= free_until {
            break;
        }
        scene.set_poses(placed.iter().map(|one| (one.id, one.path().pose(time)))).unwrap();
        let moves = |id| placed.iter().any(|one| one.id == id && one.path.is_some());
        // A pair may be nearer by what the poses of both frames are rounded by.
        let mut within = scene.pairs_within((options.clearance - 1e-12).max(0.0)).unwrap();
        within.retain(|pair| moves(pair.a) || moves(pair.b));
        assert_eq!(within, [], "at {time} of {free_until}");
    }
}

/// A small block meets a large plate as exactly as its own size asks for, whichever of both moves.
#[test]
fn the_default_tolerance_of_a_pair_is_that_of_the_smaller_shape() {
    let plate = shape(&[[[-500.0, -500.0, 0.0], [500.0, -500.0, 0.0], [0.0, 900.0, 0.0]]]);
    let mut scene = Scene::new().unwrap();
    let floor = scene.add(plate, Pose::IDENTITY).unwrap();
    let block = scene.add(shape(&cube()), at(0.0, 0.0, 10.0)).unwrap();
    for (id, from, to) in [(block, 10.0, -10.0), (floor, 0.0, 20.0)] {
        let way = Motion::between(&at(0.0, 0.0, from), &at(0.0, 0.0, to)).unwrap();
        let answer = scene.motion(&[(id, &way)], &MotionOptions::new()).unwrap();
        let Some((true, free_until, touching_at, ..)) = told(answer) else { panic!("{answer:?}") };
        assert!(free_until <= 0.45 + 1e-15 && touching_at >= 0.45 - 1e-15, "{answer:?}");
        assert!(20.0 * (touching_at - free_until) <= 4e-6, "{answer:?}");
    }
}

#[test]
fn two_that_change_places_meet_and_two_side_by_side_do_not() {
    let block = shape(&cube());
    let mut scene = Scene::new().unwrap();
    let ids = [-9.0, 9.0].map(|x| scene.add(block.clone(), at(x, 0.0, 0.0)).unwrap());
    let way = |from: Pose, to: Pose| Motion::between(&from, &to).unwrap();
    // They meet halfway, when each has gone 8 of 18.
    let [there, back] =
        [way(at(-9.0, 0.0, 0.0), at(9.0, 0.0, 0.0)), way(at(9.0, 0.0, 0.0), at(-9.0, 0.0, 0.0))];
    let options = MotionOptions::new();
    let answer = scene.motion(&[(ids[0], &there), (ids[1], &back)], &options).unwrap();
    let Some((true, free_until, touching_at, pair, nearest)) = told(answer) else { panic!("{answer:?}") };
    assert!(free_until <= 8.0 / 18.0 && touching_at >= 8.0 / 18.0 - 1e-15 && touching_at - free_until < 1e-6);
    assert_eq!((pair, nearest.distance), ((ids[0], ids[1]), 0.0));
    // What stands still is A.
    let answer = scene.motion(&[(ids[0], &there)], &options).unwrap();
    let Some((true, _, touching_at, pair, _)) = told(answer) else { panic!("{answer:?}") };
    assert!((touching_at - 16.0 / 18.0).abs() < 1e-6 && pair == (ids[1], ids[0]));
    // Side by side, a thousandth of the size apart, all the way and turning about the same axis.
    let axis = [0.3, -0.2, 1.0];
    let starts = [at(0.0, 0.0, 0.0), at(2.002, 0.0, 0.0)];
    let turns = starts.map(|start| Motion::screw(&start, [5.0, 1.0, 0.0], axis, 4.0, 3.0).unwrap());
    let paths = [(ids[0], &turns[0] as &(dyn RigidPath + Sync)), (ids[1], &turns[1])];
    assert_eq!(scene.motion(&paths, &options), Ok(SceneMotionAnswer::Free));
    assert_eq!(scene.is_free(&paths, &options), Ok(true));
    // A path that is named later counts; nobody on a path is no motion.
    let stays = at(50.0, 0.0, 0.0);
    assert_eq!(scene.motion(&[(ids[0], &there), (ids[0], &stays)], &options), Ok(SceneMotionAnswer::Free));
    scene.set_pose(ids[1], at(-9.0, 0.0, 0.0)).unwrap();
    assert_eq!(scene.motion(&[], &options), Ok(SceneMotionAnswer::Free));
}

#[test]
fn what_means_nothing_is_refused() {
    let block = shape(&cube());
    let mut scene = Scene::new().unwrap();
    let still = scene.add_named("wall", block.clone(), at(0.0, 0.0, 0.0)).unwrap();
    let id = scene.add_named("part", block, at(9.0, 0.0, 0.0)).unwrap();
    let through = Motion::between(&at(9.0, 0.0, 0.0), &at(-9.0, 0.0, 0.0)).unwrap();
    let mut refused = |path: &(dyn RigidPath + Sync), options: MotionOptions| {
        let error = scene.motion(&[(id, path)], &options).unwrap_err();
        assert_eq!(scene.is_free(&[(id, path)], &options).unwrap_err().to_string(), error.to_string());
        error
    };
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        let error = refused(&through, MotionOptions::new().clearance(wrong));
        assert!(matches!(error, SceneError::Query(QueryError::Number(NumberError::Clearance(_)))), "{error}");
        let error = refused(&through, MotionOptions::new().tolerance(wrong));
        assert!(matches!(error, SceneError::Query(QueryError::Number(NumberError::Tolerance(_)))), "{error}");
    }
    let error = refused(&at(f64::from(2f32.powi(119)), 0.0, 0.0), MotionOptions::new());
    assert!(error.to_string().starts_with("instance part: expected a translation"), "{error}");
    let SceneError::Pose { instance, source } = error else { panic!("{error}") };
    assert_eq!((instance.id, source), (id, PoseError::TooFarInWorld(2f64.powi(119))));
    /// In the middle, less rigid than a scene's poses are.
    struct Gap;
    impl RigidPath for Gap {
        fn pose(&self, t: f64) -> Pose {
            let sheared = [[1.0, 9e-7, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let rotation = if t == 0.5 { sheared } else { *Pose::IDENTITY.rotation() };
            Pose::new(rotation, [5.0, 0.0, 0.0]).unwrap()
        }
        fn sagitta(&self, _radius: f64, _t0: f64, _t1: f64) -> f64 {
            1e-9
        }
    }
    // A shear that queries take, and scenes do not: it moves nothing far enough to matter, and has a relative pose.
    assert_eq!(scene.motion(&[(id, &Gap)], &MotionOptions::new()), Ok(SceneMotionAnswer::Free));
    // The broad phase looks at the path and at three boxes.
    for budget in [3, 7] {
        scene.set_budget(budget);
        let source = QueryError::Budget { visits: budget };
        let error = scene.motion(&[(id, &through)], &MotionOptions::new()).unwrap_err();
        let is_about_a_pair =
            matches!(&error, SceneError::Pair { source: of_pair, .. } if *of_pair == source);
        assert!(is_about_a_pair || budget == 3 && error == SceneError::Query(source), "{error}");
    }
    scene.set_budget(u64::MAX);
    scene.remove(still).unwrap();
    assert_eq!(scene.motion(&[(id, &through)], &MotionOptions::new()), Ok(SceneMotionAnswer::Free));
    let error = scene.motion(&[(still, &through)], &MotionOptions::new()).unwrap_err();
    assert_eq!(error, SceneError::NoInstance(still));
}

/// A path along x whose bound is lost from some time on.
struct Lost {
    from: f64,
    until: f64,
}

impl RigidPath for Lost {
    fn pose(&self, t: f64) -> Pose {
        at(self.from + t, 0.0, 0.0)
    }
    fn sagitta(&self, _radius: f64, _t0: f64, t1: f64) -> f64 {
        if t1 > self.until { f64::INFINITY } else { 1e-12 }
    }
}

/// An error after the earliest hit does not matter, in whatever order pairs are asked about; one before it does.
#[test]
fn an_error_matters_if_it_comes_before_the_hit() {
    let block = shape(&cube());
    for parallel in [false, true] {
        for (until, is_error) in [(0.9, false), (0.25, true)] {
            let mut scene = Scene::new().unwrap();
            scene.set_parallel(parallel);
            // The first pair never touches, and its boxes are near all the time; the second hits halfway.
            let first = scene.add(block.clone(), at(0.0, 2.5, 0.0)).unwrap();
            let mover = scene.add(block.clone(), at(0.0, 0.0, 0.0)).unwrap();
            let wall = scene.add(block.clone(), at(2.5, 0.0, 0.0)).unwrap();
            let groups = |bits: u32| Groups { member: bits, meets: u32::MAX };
            scene.set_groups(first, groups(1)).unwrap();
            scene.set_groups(wall, groups(2)).unwrap();
            let path = Lost { from: 0.0, until };
            let answer = scene.motion(&[(mover, &path)], &MotionOptions::new());
            if is_error {
                assert!(matches!(answer, Err(SceneError::Pair { .. })), "{answer:?}");
            } else {
                let Some((true, _, touching_at, pair, _)) = told(answer.unwrap()) else { panic!("a hit") };
                assert!((touching_at - 0.5).abs() < 1e-6 && pair == (wall, mover));
            }
        }
    }
}

/// Far from the world's origin, poses have fewer digits, and motions have answers as long as those resolve the tolerance.
#[test]
fn motions_far_from_the_origin_have_answers() {
    let block = shape(&cube());
    for far in [0.0, 1e6, 5e6] {
        let mut scene = Scene::new().unwrap();
        let still = scene.add(block.clone(), at(far, -far, 0.0)).unwrap();
        let mover = scene.add(block.clone(), at(far, -far, 5.0)).unwrap();
        let past = |x: f64| Motion::between(&at(far + x, -far, 5.0), &at(far + x, -far, -5.0)).unwrap();
        let answer = scene.motion(&[(mover, &past(0.5))], &MotionOptions::new()).unwrap();
        let Some((true, _, touching_at, pair, _)) = told(answer) else { panic!("{answer:?} at {far}") };
        assert!((touching_at - 0.3).abs() < 1e-6 && pair == (still, mover));
        assert_eq!(scene.motion(&[(mover, &past(2.1))], &MotionOptions::new()), Ok(SceneMotionAnswer::Free));
        let turned = Pose::from_quaternion([0.0, 0.0, 0.6, 0.8], [far, -far, 0.0]).unwrap();
        let turns = Motion::between(&at(far, -far, 0.0), &turned).unwrap();
        let away = Motion::between(&at(far + 3.0, -far, 0.0), &at(far + 3.5, -far, 1.0)).unwrap();
        let answer = scene.motion(&[(still, &turns), (mover, &away)], &MotionOptions::new());
        assert_eq!(answer, Ok(SceneMotionAnswer::Free), "at {far}");
    }
}
