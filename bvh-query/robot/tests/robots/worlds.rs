//! Robots remember how far obstacles are away: the same answers as robots that remember nothing, while everything changes.

use crate::questions::{arm, at, block, random_values};
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Bvh, MotionOptions, OwnedShape, Pose};
use cbvh_robot::{Base, Edge, Robot, RobotMotion, RobotOptions};
use cbvh_testkit::Random;

/// An obstacle of some kind.
fn obstacle(random: &mut Random) -> OwnedShape {
    let shape = |mesh: &Mesh| -> OwnedShape {
        Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap().into()
    };
    let sides = [(); 3].map(|()| 0.02 + 0.2 * random.unit());
    match random.below(5) {
        0 => block(sides),
        1 => shape(&shapes::point([0.0; 3])).rounded(sides[0]).unwrap(),
        2 => shape(&shapes::cylinder(sides[0], sides[1], 1e-3).unwrap().mesh).solid().unwrap(),
        3 => {
            let cloud: Vec<_> = (0..50).map(|_| random.point().map(|x| 0.5 * x)).collect();
            shape(&shapes::cloud(&cloud)).rounded(0.02).unwrap()
        }
        // A room, of which only the walls count.
        _ => shape(&shapes::block([2.5, 2.5, 2.5]).unwrap()),
    }
}

/// Changes the world in one way.
fn change(robot: &mut Robot, random: &mut Random, names: &mut Vec<(String, bool)>, round: usize) {
    let single = random.below(2) == 0;
    let mut turned = random.quaternion();
    if single {
        // As programs do that compute in f32: not quite rigid.
        turned = turned.map(|x| f64::from(x as f32));
    }
    let pose = Pose::from_quaternion(turned, random.point().map(|x| 0.9 * x)).unwrap_or(at([0.5, 0.0, 0.5]));
    let any = (!names.is_empty()).then(|| random.below(names.len().max(1)));
    let kind = if names.len() > 3 { 3 } else { random.below(8) };
    match (kind, any) {
        (0 | 1, _) => {
            let name = format!("obstacle{round}");
            robot.add_obstacle(&name, obstacle(random), &pose).unwrap();
            names.push((name, false));
        }
        (2, _) => {
            let name = format!("tool{round}");
            robot
                .attach(&name, block([0.05, 0.1, 0.05]), "hand", &at([0.0, 0.0, 0.15]), &["forearm"])
                .unwrap();
            names.push((name, true));
        }
        (3, Some(any)) => robot.remove(&names.swap_remove(any).0).unwrap(),
        (4, Some(any)) if !names[any].1 => robot.set_pose(&names[any].0, &pose).unwrap(),
        (5, Some(any)) => robot.set_margin(&names[any].0, 0.1 * random.unit()).unwrap(),
        (6, Some(any)) => robot.allow(&names[any].0, "forearm").unwrap(),
        (7, Some(any)) if !names[any].1 => robot.disallow(&names[any].0, "forearm").unwrap(),
        _ => robot.set_margin("upper_arm", 0.02 * random.unit()).unwrap(),
    }
}

#[test]
fn answers_are_those_of_a_robot_that_remembers_nothing() {
    for (base, seed) in [(Base::Fixed, 61), (Base::Planar, 62), (Base::Floating, 63)] {
        let random = &mut Random::new(seed);
        let mut robot = arm(base);
        let mut names = Vec::new();
        let (mut free, mut hit) = (0, 0);
        for round in 0..60 {
            change(&mut robot, random, &mut names, round);
            // Others share what it remembers of the world as it was.
            let mut other = robot.snapshot();
            for question in 0..3 {
                let [from, mut to] = [(); 2].map(|()| random_values(random, &robot));
                if question > 0 {
                    to = from.iter().zip(&to).map(|(from, to)| from + 0.1 * (to - from)).collect();
                }
                if base == Base::Floating {
                    to[3..7].copy_from_slice(&[0.0, 0.6, 0.0, 0.8]);
                }
                let (mut from, to) = (from, to);
                if base == Base::Floating {
                    from[3..7].copy_from_slice(&random.quaternion());
                }
                let edge = Edge::straight(&from, &to).unwrap();
                let mut options = MotionOptions::default();
                options.clearance = [0.0, 0.0, 0.01][question];
                let mut anew = Robot::from_parts(robot.to_parts()).unwrap();
                let answers = [&mut robot, &mut other, &mut anew].map(|robot| {
                    let first = robot.motion(&edge, &options).unwrap();
                    (robot.is_edge_free(&edge, &options).unwrap(), first, robot.collide(&to).unwrap())
                });
                assert_eq!(answers[0], answers[1], "{base:?}, round {round}");
                assert_eq!(answers[0], answers[2], "{base:?}, round {round}");
                free += u32::from(answers[0].0);
                hit += u32::from(!answers[0].0);
            }
        }
        assert!(free > 20 && hit > 20, "{base:?}: {free} free, {hit} hit");
    }
}

/// What a clone remembers is of its own world: one of two robots that shared it moves an obstacle.
#[test]
#[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads here")]
fn a_robot_forgets_what_it_moves_and_others_do_not() {
    let mut robot = arm(Base::Fixed);
    robot.add_obstacle("pillar", block([0.1, 0.1, 1.5]), &at([0.45, 0.0, 0.75])).unwrap();
    let random = &mut Random::new(64);
    let edges: Vec<_> = (0..40)
        .map(|_| Edge::straight(&random_values(random, &robot), &random_values(random, &robot)).unwrap())
        .collect();
    let options = MotionOptions::default();
    let before = robot.are_free(&edges, &options).unwrap();
    let mut still = robot.snapshot();
    std::thread::scope(|scope| {
        let asking =
            scope.spawn(|| (0..20).map(|_| still.are_free(&edges, &options).unwrap()).collect::<Vec<_>>());
        for step in 0..20 {
            robot.set_pose("pillar", &at([0.45 + 0.2 * f64::from(step), 0.0, 0.75])).unwrap();
            let mut anew = Robot::from_parts(robot.to_parts()).unwrap();
            assert_eq!(robot.are_free(&edges, &options).unwrap(), anew.are_free(&edges, &options).unwrap());
        }
        robot.remove("pillar").unwrap();
        assert!(asking.join().unwrap().iter().all(|answers| *answers == before));
    });
    let after = robot.are_free(&edges, &options).unwrap();
    assert!(after != before && before.iter().zip(&after).all(|(before, after)| *after || !before));
}

/// Whether an edge is free does not depend on how a test of a pair places it: far from the origin, places in the world are rounded much
/// more than those of one link seen from another.
#[test]
fn a_base_far_away_does_not_matter_to_what_it_carries() {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("far.urdf");
    let text = r#"<robot name="far"><link name="base"/>
      <link name="left"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
      <link name="right"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
      <joint name="one" type="prismatic"><parent link="base"/><child link="left"/><axis xyz="1 0 0"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
      <joint name="two" type="prismatic"><parent link="base"/><child link="right"/><axis xyz="1 0 0"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"#;
    std::fs::write(&path, text).unwrap();
    let mut robot = Robot::from_urdf(&path, &RobotOptions::default().base(Base::Planar)).unwrap();
    let random = &mut Random::new(65);
    let options = MotionOptions::default();
    let (mut free, mut hit) = (0, 0);
    for round in 0..400 {
        let far = 1e9 * random.signed();
        // They are 4e-8 apart or overlap, and the tolerance is 2e-8.
        let apart = 0.02 + [4e-8, -1e-9][round % 2];
        let start = [far, 1e9 * random.signed(), random.signed(), 0.0, apart];
        let to = [far + 0.1, start[1], start[2], 0.0, apart];
        let edge = Edge::straight(&start, &to).unwrap();
        let is_free = robot.is_edge_free(&edge, &options).unwrap();
        assert_eq!(is_free, robot.motion(&edge, &options).unwrap() == RobotMotion::Free, "round {round}");
        assert_eq!(is_free, round % 2 == 0, "round {round}");
        free += u32::from(is_free);
        hit += u32::from(!is_free);
    }
    assert_eq!((free, hit), (200, 200));
}

/// The same where a place is not quite rigid: what a part looks like then depends on the frame in which a pair is tested.
#[test]
fn tests_of_pairs_are_made_in_the_frame_of_the_exact_questions() {
    let larger = Pose::IDENTITY.rotation().map(|row| row.map(|x| x * (1.0 + 2f64.powi(-22))));
    let options = MotionOptions::default();
    let mut free = 0;
    for step in -40..40 {
        let mut robot = arm(Base::Floating);
        robot.attach("tool", block([0.01; 3]), "hand", &at([0.0, 0.0, 1.0]), &[]).unwrap();
        let mut values = vec![0.0; robot.joints().len()];
        values[6] = 1.0;
        // A wall above the tool.
        let tip = robot.link_poses(&values).unwrap()[4].place([0.0, 0.0, 1.005]);
        let gap = 1e-8 * f64::from(step);
        let wall = Pose::new(larger, [tip[0], tip[1], tip[2] + gap + 1.0]).unwrap();
        robot.add_obstacle("wall", block([2.0; 3]), &wall).unwrap();
        let edge = Edge::straight(&values, &values).unwrap();
        let is_free = robot.is_edge_free(&edge, &options).unwrap();
        assert_eq!(is_free, robot.motion(&edge, &options).unwrap() == RobotMotion::Free, "gap {gap}");
        free += u32::from(is_free);
    }
    assert!((1..80).contains(&free), "{free}");
}
