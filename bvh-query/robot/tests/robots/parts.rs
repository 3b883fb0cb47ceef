//! Robots as plain data, and robots made of it: their answers are the same to the bit.

use crate::questions::{at, block, random_values};
use bvh_query::{MotionOptions, Pose};
use cbvh_robot::{Base, Edge, Geometry, Robot, RobotError, RobotOptions};
use cbvh_testkit::Random;
use std::path::Path;

/// The arm with a flange that a fixed joint turns, and a link of two shapes.
fn described(folder: &Path) -> Robot {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/robot");
    for name in ["base.obj", "link.obj", "hand.obj"] {
        std::fs::copy(data.join(name), folder.join(name)).unwrap();
    }
    let more = r#"<link name="flange">
        <visual><geometry><sphere radius="0.01"/></geometry></visual>
        <visual><origin xyz="0 0 0.05"/><geometry><cylinder radius="0.01" length="0.05"/></geometry></visual>
      </link>
      <joint name="glue" type="fixed">
        <parent link="hand"/><child link="flange"/><origin xyz="0 0.01 0.1" rpy="0.3 -0.2 0.7"/>
      </joint></robot>"#;
    let text = std::fs::read_to_string(data.join("robot.urdf")).unwrap();
    let text = text.replace("</robot>", more).replace("collision>", "visual>");
    let (urdf, srdf) = (folder.join("arm.urdf"), folder.join("arm.srdf"));
    std::fs::write(&urdf, text).unwrap();
    let semantics = r#"<robot name="small_arm"><group name="all"><chain base_link="base" tip_link="hand"/></group>
      <group_state name="bent" group="all"><joint name="elbow" value="0.5"/></group_state>
      <disable_collisions link1="base" link2="turret"/><disable_collisions link1="turret" link2="upper_arm"/>
      <disable_collisions link1="upper_arm" link2="forearm"/><disable_collisions link1="forearm" link2="hand"/>
      <disable_collisions link1="base" link2="hand"/></robot>"#;
    std::fs::write(&srdf, semantics).unwrap();
    let options =
        RobotOptions::default().srdf(srdf).geometry(Geometry::Visual).base(Base::Planar).cylinder_error(1e-2);
    Robot::from_urdf(urdf, &options).unwrap()
}

/// The arm after all kinds of changes.
pub(crate) fn changed() -> Robot {
    let folder = cbvh_testkit::folder();
    let mut robot = described(folder.path());
    robot.add_obstacle("gone", block([1.0; 3]), &Pose::IDENTITY).unwrap();
    robot.add_obstacle("pillar", block([0.1, 0.1, 1.5]), &at([0.45, 0.0, 0.75])).unwrap();
    let tilted = Pose::from_quaternion([0.1, -0.5, 0.3, 0.8].map(|x| x / 0.99_f64.sqrt()), [0.01, 0.0, 0.1]);
    robot.attach("tool", block([0.02, 0.02, 0.2]), "flange", &at([1.0; 3]), &["forearm"]).unwrap();
    robot.add_obstacle("shelf", block([0.4, 1.0, 0.02]).rounded(0.01).unwrap(), &at([3.0; 3])).unwrap();
    robot.remove("gone").unwrap();
    robot.set_pose("tool", &tilted.unwrap()).unwrap();
    robot.set_pose("shelf", &at([-0.5, 0.0, 0.9])).unwrap();
    for (name, margin) in [("hand", 0.01), ("flange", 0.003), ("tool", 0.1 / 3.0), ("shelf", 1e-3)] {
        robot.set_margin(name, margin).unwrap();
    }
    robot.make_solid("upper_arm").unwrap();
    robot.disallow("base", "hand").unwrap();
    robot.allow("base", "shelf").unwrap();
    robot
}

#[test]
fn a_robot_of_parts_gives_the_same_answers() {
    let mut robot = changed();
    // The files are gone by now.
    let mut other = Robot::from_parts(robot.to_parts()).unwrap();
    assert_eq!(
        (other.name(), other.joints(), other.limits()),
        (robot.name(), robot.joints(), robot.limits())
    );
    assert!(other.links().eq(robot.links()));
    assert_eq!((other.groups(), other.states()), (robot.groups(), robot.states()));
    assert_eq!(other.pairs(), robot.pairs());
    let random = &mut Random::new(3);
    let (mut rows, mut touching) = (Vec::new(), 0);
    for _ in 0..100 {
        let [from, to] = [(); 2].map(|()| random_values(random, &robot));
        assert_eq!(other.link_poses(&from).unwrap(), robot.link_poses(&from).unwrap());
        assert_eq!(other.distance(&from).unwrap(), robot.distance(&from).unwrap());
        let edge = Edge::straight(&from, &to).unwrap();
        let found = other.motion(&edge, &MotionOptions::new()).unwrap();
        assert_eq!(found, robot.motion(&edge, &MotionOptions::new()).unwrap());
        touching += usize::from(robot.collide(&from).unwrap());
        rows.extend(from);
    }
    assert!((10..90).contains(&touching), "{touching}");
    assert_eq!(other.pairs_in_contact_many(&rows).unwrap(), robot.pairs_in_contact_many(&rows).unwrap());
    // And it holds what is needed to do so once more, and to be changed.
    let mut third = Robot::from_parts(other.to_parts()).unwrap();
    for robot in [&mut robot, &mut third] {
        robot.set_margin("tool", 0.0).unwrap();
        robot.set_pose("pillar", &at([0.3, 0.1, 0.5])).unwrap();
        robot.remove("shelf").unwrap();
        robot.allow("base", "hand").unwrap();
    }
    assert_eq!(third.pairs(), robot.pairs());
    assert_eq!(third.pairs_in_contact_many(&rows).unwrap(), robot.pairs_in_contact_many(&rows).unwrap());
    assert_eq!(third.distance_many(&rows).unwrap(), robot.distance_many(&rows).unwrap());
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let parts = changed().to_parts();
    let mut fewer = parts.clone();
    fewer.links.pop();
    let error = Robot::from_parts(fewer).unwrap_err().to_string();
    assert!(error.contains("arm.urdf: the shapes of its links: expected one for each"), "{error}");
    assert!(error.ends_with("found 6 shapes for 7 elements"), "{error}");
    let mut broken = parts.clone();
    broken.urdf.1.truncate(500);
    assert!(matches!(Robot::from_parts(broken), Err(RobotError::Description { .. })));
    let mut twice = parts.clone();
    twice.others.push(twice.others[0].clone());
    assert!(matches!(Robot::from_parts(twice), Err(RobotError::Taken(_))));
    let mut unknown = parts.clone();
    unknown.allowed.push(["base".to_owned(), "nothing".to_owned()]);
    assert!(matches!(Robot::from_parts(unknown), Err(RobotError::Unknown { .. })));
    let mut negative = parts;
    negative.margins.push(("base".to_owned(), -1.0));
    assert!(matches!(Robot::from_parts(negative), Err(RobotError::Query(_))));
}

/// Without obstacles and margins, nothing but what may touch is other than the files say.
#[test]
fn parts_keep_what_may_touch() {
    let folder = cbvh_testkit::folder();
    let mut robot = described(folder.path());
    robot.allow("turret", "hand").unwrap();
    let mut other = Robot::from_parts(robot.to_parts()).unwrap();
    assert_eq!(other.pairs(), robot.pairs());
}
