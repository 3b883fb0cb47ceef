//! Poses of links against a second way to them: matrices of 4 x 4 numbers, with each turn by a rotation vector's series.

use cbvh_robot::{Base, Robot, RobotOptions};
use std::path::Path;

pub(crate) type Matrix = [[f64; 4]; 4];

pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let at = |i: usize, j: usize| (0..4).map(|k| a[i][k] * b[k][j]).sum();
    [0, 1, 2, 3].map(|i| [0, 1, 2, 3].map(|j| at(i, j)))
}

pub(crate) fn shift([x, y, z]: [f64; 3]) -> Matrix {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]]
}

/// The exponential of a rotation vector, summed term by term.
pub(crate) fn turn([x, y, z]: [f64; 3], angle: f64) -> Matrix {
    let cross = [[0.0, -z, y, 0.0], [z, 0.0, -x, 0.0], [-y, x, 0.0, 0.0], [0.0; 4]];
    let (mut sum, mut term) = (shift([0.0; 3]), shift([0.0; 3]));
    for step in 1..60 {
        term = product(&term, &cross).map(|row| row.map(|x| x * angle / f64::from(step)));
        sum = [0, 1, 2, 3].map(|i| [0, 1, 2, 3].map(|j| sum[i][j] + term[i][j]));
    }
    sum
}

pub(crate) fn read(text: &str, base: Base) -> Robot {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, text).unwrap();
    Robot::from_urdf(path, &RobotOptions::default().base(base)).unwrap()
}

fn check(robot: &Robot, joints: &[f64], link: &str, expected: &Matrix) {
    let place = robot.links().position(|name| name == link).unwrap();
    let pose = robot.link_poses(joints).unwrap()[place];
    for i in 0..3 {
        for j in 0..3 {
            assert!((pose.rotation()[i][j] - expected[i][j]).abs() < 1e-13, "{link}: {pose:?} {expected:?}");
        }
        assert!((pose.translation()[i] - expected[i][3]).abs() < 1e-13, "{link}: {pose:?} {expected:?}");
    }
}

pub(crate) const ALL_KINDS: &str = r#"<robot name="all">
  <link name="root"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/><link name="f"/>
  <joint name="turn" type="revolute">
    <parent link="root"/><child link="a"/><origin xyz="1 2 3" rpy="0.3 -0.4 0.5"/><axis xyz="0 3 4"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="fixed" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 1" rpy="1 0 0"/></joint>
  <joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 2"/></joint>
  <joint name="follow" type="continuous">
    <parent link="c"/><child link="d"/><origin xyz="0 1 0"/><mimic joint="turn" multiplier="-2" offset="0.25"/>
  </joint>
  <joint name="plane" type="planar"><parent link="root"/><child link="e"/><origin rpy="0 0 0.7"/></joint>
  <joint name="free" type="floating"><parent link="e"/><child link="f"/><origin xyz="0.1 0 0"/></joint>
</robot>"#;

#[test]
fn each_kind_of_joint_moves_its_child() {
    let robot = read(ALL_KINDS, Base::Fixed);
    let expected = [
        "turn",
        "slide",
        "plane/x",
        "plane/y",
        "plane/theta",
        "free/x",
        "free/y",
        "free/z",
        "free/qx",
        "free/qy",
        "free/qz",
        "free/qw",
    ];
    assert_eq!(robot.joints(), expected);
    assert_eq!(robot.limits()[..2], [[-1.0, 1.0], [f64::NEG_INFINITY, f64::INFINITY]]);
    let half = 0.4_f64;
    let q = [0.6, -0.7, 0.2, 0.3, 1.1, 4.0, 5.0, 6.0, 0.0, half.sin(), 0.0, half.cos()];
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let chain = |parts: &[Matrix]| parts.iter().fold(shift([0.0; 3]), |whole, part| product(&whole, part));
    let origin = [shift([1.0, 2.0, 3.0]), turn(z, 0.5), turn(y, -0.4), turn(x, 0.3)];
    let a = product(&chain(&origin), &turn([0.0, 0.6, 0.8], 0.6));
    let b = chain(&[a, shift([0.0, 0.0, 1.0]), turn(x, 1.0)]);
    let c = chain(&[b, shift([0.0, 0.0, -0.7])]);
    let d = chain(&[c, shift([0.0, 1.0, 0.0]), turn(x, -2.0 * 0.6 + 0.25)]);
    let e = chain(&[turn(z, 0.7), shift([0.2, 0.3, 0.0]), turn(z, 1.1)]);
    let f = chain(&[e, shift([0.1, 0.0, 0.0]), shift([4.0, 5.0, 6.0]), turn(y, 0.8)]);
    for (link, expected) in [("a", a), ("b", b), ("c", c), ("d", d), ("e", e), ("f", f)] {
        check(&robot, &q, link, &expected);
    }
    // A base that moves comes first.
    let robot = read(ALL_KINDS, Base::Planar);
    assert_eq!(robot.joints()[..4], ["base/x", "base/y", "base/theta", "turn"]);
    let moved: Vec<f64> = [1.0, 2.0, 0.3].into_iter().chain(q).collect();
    check(&robot, &moved, "d", &chain(&[shift([1.0, 2.0, 0.0]), turn(z, 0.3), d]));
    let robot = read(ALL_KINDS, Base::Floating);
    let moved: Vec<f64> = [1.0, 2.0, 3.0, half.sin(), 0.0, 0.0, half.cos()].into_iter().chain(q).collect();
    check(&robot, &moved, "root", &chain(&[shift([1.0, 2.0, 3.0]), turn(x, 0.8)]));
}

#[test]
fn the_semantics_name_groups_states_and_pairs_to_pass_over() {
    let folder = cbvh_testkit::folder();
    let srdf = folder.path().join("arm.srdf");
    let text = r#"<robot name="small_arm">
      <group name="arm"><chain base_link="base" tip_link="forearm"/></group>
      <group name="hand"><link name="hand"/></group>
      <group name="all"><group name="arm"/><joint name="wrist"/><joint name="of another robot"/></group>
      <group_state name="up" group="arm"><joint name="elbow" value="0.5"/></group_state>
      <disable_collisions link1="base" link2="turret" reason="Adjacent"/>
      <disable_default_collisions link="hand"/>
      <enable_collisions link1="hand" link2="base"/>
    </robot>"#;
    std::fs::write(&srdf, text).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/robot/robot.urdf");
    let mut robot = Robot::from_urdf(&path, &RobotOptions::default().srdf(srdf)).unwrap();
    let groups: Vec<_> = robot.groups().iter().map(|group| (&*group.name, group.joints.clone())).collect();
    assert_eq!(groups, [("arm", vec![0, 1, 2]), ("hand", vec![3]), ("all", vec![0, 1, 2, 3])]);
    assert_eq!(robot.states()[0].values, [(2, 0.5)]);
    let pairs = robot.pairs();
    let has = |a: &str, b: &str| pairs.contains(&[a.to_owned(), b.to_owned()]);
    assert!(
        has("base", "hand") && has("base", "upper_arm") && !has("base", "turret") && !has("forearm", "hand")
    );
    robot.disallow("base", "turret").unwrap();
    assert!(robot.pairs().contains(&["base".to_owned(), "turret".to_owned()]));
}
