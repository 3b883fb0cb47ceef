//! Goals to which joints without limits go the short way.

use crate::questions::at;
use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Bvh, MotionOptions, OwnedShape};
use cbvh_robot::{Edge, Robot, RobotError, RobotMotion, RobotOptions};
use cbvh_testkit::Random;
use std::f64::consts::{PI, TAU};

/// Joints that turn without limits and others, and joints that mimic them: by whole turns, by parts of one, and sliding.
const TURNING: &str = r#"<robot name="turning">
  <link name="root"/><link name="a"><collision><origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="b"/><link name="c"/><link name="d"/><link name="e"/><link name="f"/><link name="g"/><link name="h"/><link name="i"/>
  <joint name="turn" type="continuous"><parent link="root"/><child link="a"/><axis xyz="0 0 1"/></joint>
  <joint name="open" type="revolute"><parent link="root"/><child link="b"/><axis xyz="0 1 0"/></joint>
  <joint name="limited" type="revolute"><parent link="root"/><child link="c"/>
    <limit lower="-6.3" upper="6.3" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="root"/><child link="d"/></joint>
  <joint name="twice" type="continuous"><parent link="d"/><child link="e"/><mimic joint="turn" multiplier="-2" offset="1"/></joint>
  <joint name="geared" type="continuous"><parent link="root"/><child link="f"/></joint>
  <joint name="half" type="continuous"><parent link="f"/><child link="g"/><mimic joint="geared" multiplier="0.5"/></joint>
  <joint name="screw" type="continuous"><parent link="root"/><child link="h"/></joint>
  <joint name="nut" type="prismatic"><parent link="h"/><child link="i"/><mimic joint="screw"/></joint>
  <joint name="plane" type="planar"><parent link="root"/><child link="j"/></joint>
  <joint name="free" type="floating"><parent link="j"/><child link="k"/></joint>
  <link name="j"/><link name="k"/>
</robot>"#;

fn turning() -> Robot {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, TURNING).unwrap();
    Robot::from_urdf(path, &RobotOptions::default()).unwrap()
}

/// Zeros, and a quaternion at the end.
fn still(robot: &Robot) -> Vec<f64> {
    let mut still = vec![0.0; robot.joints().len()];
    *still.last_mut().unwrap() = 1.0;
    still
}

#[test]
fn the_nearest_goal_is_the_same_configuration_half_a_turn_away() {
    let robot = turning();
    let turns = ["turn", "open", "plane/theta"];
    let random = &mut Random::new(11);
    for round in 0..600 {
        let [mut start, mut goal] = [still(&robot), still(&robot)];
        let reach = [1.0, 4.0, 1e3, 4e8][round % 4];
        for number in 0..start.len() - 4 {
            (start[number], goal[number]) = (reach * random.signed(), reach * random.signed());
        }
        let nearest = robot.nearest_turns(&start, &goal).unwrap();
        for (number, joint) in robot.joints().iter().enumerate() {
            let apart = nearest[number] - start[number];
            if turns.contains(&joint.as_str()) {
                assert!(apart.abs() <= PI * (1.0 + 1e-6), "{joint}: {apart}");
            }
            if !turns.contains(&joint.as_str()) || (goal[number] - start[number]).abs() <= PI {
                assert_eq!(nearest[number].to_bits(), goal[number].to_bits(), "{joint}");
            }
        }
        // As far as f64 can say where a start and half a turn lie.
        let slack = 1e-14 + 1e-15 * reach;
        let [found, expected] = [&nearest, &goal].map(|q| robot.link_poses(q).unwrap());
        for (found, expected) in found.iter().zip(&expected) {
            let far = 1.0 + expected.translation().iter().map(|x| x.abs()).sum::<f64>();
            let turned = found.rotation().iter().flatten().zip(expected.rotation().iter().flatten());
            let moved = found.translation().into_iter().zip(expected.translation());
            assert!(turned.into_iter().all(|(a, b)| (a - b).abs() < slack), "{found:?} {expected:?}");
            assert!(moved.into_iter().all(|(a, b)| (a - b).abs() < slack * far), "{found:?} {expected:?}");
        }
    }
}

/// However many turns away a goal is, the nearest one is as exact. Not every system's own functions bear so many turns.
#[test]
fn many_turns_cost_no_digits() {
    let robot = turning();
    let (start, mut goal) = (still(&robot), still(&robot));
    for turns in [1.0, -7.0, 1e4, -1e6, 1.5e8] {
        goal[0] = 1.0 + turns * TAU;
        let near = robot.nearest_turns(&start, &goal).unwrap()[0];
        let [near_at, goal_at] = [near, goal[0]].map(libm::sincos);
        assert!((near_at.0 - goal_at.0).abs() < 1e-15 && (near_at.1 - goal_at.1).abs() < 1e-15);
        assert!(near.abs() <= PI, "{turns}: {near}");
    }
}

#[test]
fn the_short_way_is_free_where_the_long_one_is_not() {
    let mut robot = turning();
    let (bytes, _) = to_bytes(&shapes::point([0.0; 3]), &Options::default()).unwrap();
    let ball = OwnedShape::from(Bvh::from_bytes(bytes).unwrap()).rounded(0.3).unwrap();
    robot.add_obstacle("ball", ball, &at([1.0, 0.0, 0.0])).unwrap();
    let (mut start, mut goal) = (still(&robot), still(&robot));
    (start[0], goal[0]) = (3.0, -3.0);
    assert!(!robot.is_free(&start, &goal).unwrap());
    let nearest = robot.nearest_turns(&start, &goal).unwrap();
    assert!((nearest[0] - 3.283).abs() < 1e-3);
    assert!(robot.is_free(&start, &nearest).unwrap());
    let edge = Edge::straight(&start, &nearest).unwrap();
    assert_eq!(robot.motion(&edge, &MotionOptions::new()).unwrap(), RobotMotion::Free);
}

#[test]
fn angles_that_are_too_far_apart_are_refused() {
    let robot = turning();
    let (start, mut goal) = (still(&robot), still(&robot));
    assert!(matches!(robot.nearest_turns(&start[1..], &goal), Err(RobotError::Count { .. })));
    assert!(matches!(robot.nearest_turns(&start, &goal[1..]), Err(RobotError::Count { .. })));
    for angle in [f64::NAN, 1.1e9, -1e300, f64::MAX] {
        goal[0] = angle;
        let error = robot.nearest_turns(&start, &goal).unwrap_err();
        assert!(error.to_string().starts_with("joint turn: expected "), "{error}");
    }
    // Of other joints, no angle is too far.
    (goal[0], goal[2]) = (0.0, 1e300);
    assert_eq!(robot.nearest_turns(&start, &goal).unwrap(), goal);
}
