//! What is read otherwise than its author may have meant: told in warnings, which robots keep as plain data.

use crate::files::{of_texts, row};
use cbvh_robot::{Geometry, Robot, RobotOptions};
use std::fs;
use std::path::Path;

/// Checks that warnings are some, of which each has a beginning behind its file, and an end.
fn check(robot: &Robot, expected: &[(&str, &str)]) {
    let warnings = robot.warnings();
    assert_eq!(warnings.len(), expected.len(), "{warnings:?}");
    for (warning, (place, what)) in warnings.iter().zip(expected) {
        assert!(warning.contains(place) && warning.ends_with(what), "{warning}");
    }
}

/// Sliding joints `j0` and so on, each with an element and of a type. Each moves a ball away from the same place.
fn joints(of: &[(&str, &str)]) -> String {
    let mut text = row(of.len(), 0);
    for (number, (kind, inside)) in of.iter().enumerate() {
        let joint = format!("<joint name=\"j{number}\" type=\"prismatic\">");
        text = text.replace(&joint, &format!("\n<joint name=\"j{number}\" type=\"{kind}\">{inside}"));
    }
    text
}

const SLIDE: &str = "prismatic";

/// Returns where the links are along x.
fn places(robot: &Robot, q: &[f64]) -> Vec<f64> {
    let poses = robot.link_poses(q).unwrap();
    let by_name: std::collections::BTreeMap<_, _> =
        robot.links().zip(poses.iter().map(|pose| pose.translation()[0])).collect();
    by_name.into_iter().filter(|(name, _)| *name != "base").map(|(_, x)| x).collect()
}

#[test]
fn joints_that_cannot_follow_have_a_value_of_their_own() {
    let mimic = |joint: &str| format!("<mimic joint=\"{joint}\" multiplier=\"2\" offset=\"1\"/>");
    let own = "it has a value of its own";
    let read = |of: &[(&str, &str)]| of_texts(joints(of), None).unwrap();
    // A joint that is not there, and one that follows a joint that cannot follow.
    let robot = read(&[(SLIDE, &mimic("gone")), (SLIDE, &mimic("j0"))]);
    check(&robot, &[("line 2, <mimic>: joint 'j0' mimics 'gone', which the robot does not have", own)]);
    assert_eq!((robot.joints(), places(&robot, &[3.0])), (&["j0".to_owned()][..], vec![3.0, 7.0]));
    let robot = read(&[(SLIDE, &mimic("j0"))]);
    check(&robot, &[("joint 'j0' mimics 'j0', itself", own)]);
    assert_eq!(places(&robot, &[3.0]), [3.0]);
    // A circle, and a joint that hangs on it.
    let robot = read(&[(SLIDE, &mimic("j1")), (SLIDE, &mimic("j2")), (SLIDE, &mimic("j1"))]);
    check(
        &robot,
        &[("joint 'j1' mimics 'j2', which follows it in turn", own), ("joint 'j2' mimics 'j1'", own)],
    );
    assert_eq!(robot.joints(), ["j1", "j2"]);
    assert_eq!(places(&robot, &[3.0, 5.0]), [7.0, 3.0, 5.0]);
    // Leaders of other types, and joints that cannot follow.
    let robot = read(&[
        ("fixed", ""),
        ("planar", ""),
        (SLIDE, &mimic("j0")),
        (SLIDE, &mimic("j1")),
        ("planar", &mimic("j2")),
    ]);
    check(
        &robot,
        &[
            ("joint 'j2' mimics 'j0', which neither turns nor slides", own),
            ("joint 'j3' mimics 'j1', which neither", own),
            ("joint 'j4' mimics 'j2', and a joint with several values follows none", own),
        ],
    );
    assert_eq!(robot.joints(), ["j1/x", "j1/y", "j1/theta", "j2", "j3", "j4/x", "j4/y", "j4/theta"]);
    // What follows as it should: a leader that comes later, through others, of another type; a fixed joint has nothing to follow with.
    let robot =
        read(&[(SLIDE, &mimic("j2")), ("fixed", &mimic("gone")), (SLIDE, &mimic("j3")), ("continuous", "")]);
    check(&robot, &[]);
    assert_eq!((robot.joints(), places(&robot, &[3.0])), (&["j3".to_owned()][..], vec![15.0, 0.0, 7.0, 0.0]));
}

/// Each joint was followed to its end anew, so that there was a limit of 64.
#[test]
fn a_long_chain_of_mimic_joints_is_followed_once() {
    let mimics: Vec<String> = (1..=20_000).map(|next| format!("<mimic joint=\"j{next}\"/>")).collect();
    let mut of: Vec<(&str, &str)> = mimics.iter().map(|mimic| (SLIDE, mimic.as_str())).collect();
    of.push((SLIDE, ""));
    let text = |of: &[(&str, &str)]| {
        let joints = of.iter().enumerate().map(|(k, (kind, inside))| {
            format!(
                "<link name=\"l{k}\"/><joint name=\"j{k}\" type=\"{kind}\"><parent link=\"base\"/><child link=\"l{k}\"/>{inside}</joint>"
            )
        });
        format!("<robot><link name=\"base\"/>{}</robot>", joints.collect::<String>())
    };
    assert_eq!(of_texts(text(&of), None).unwrap().joints(), ["j20000"]);
    // In a circle, which is told a hundred times.
    of[20_000].1 = "<mimic joint=\"j0\"/>";
    let robot = of_texts(text(&of), None).unwrap();
    assert_eq!((robot.joints().len(), robot.warnings().len()), (20_001, 101));
    assert!(robot.warnings()[100].ends_with("a warning is left out, and maybe others after it"));
    // A factor that grows beyond all numbers.
    let mimics = mimics.iter().map(|mimic| mimic.replace("/>", " multiplier=\"10\"/>")).collect::<Vec<_>>();
    let mut of: Vec<(&str, &str)> = mimics.iter().map(|mimic| (SLIDE, mimic.as_str())).collect();
    of.push((SLIDE, ""));
    let told = of_texts(text(&of), None).unwrap_err().to_string();
    assert!(told.contains("expected a finite multiplier and offset"), "{told}");
}

#[test]
fn limits_are_read_as_they_are_meant() {
    let (none, inf) = ([f64::NEG_INFINITY, f64::INFINITY], f64::INFINITY);
    let wrong = "it is read without limits";
    for (kind, limit, expected, warned) in [
        ("revolute", "lower=\"-1\" upper=\"2\"", [-1.0, 2.0], ""),
        (
            "revolute",
            "lower=\"2\" upper=\"-1\"",
            none,
            "joint 'j0' has the lower limit 2 above the upper limit -1",
        ),
        (SLIDE, "lower=\"0.5\"", none, "joint 'j0' has the lower limit 0.5 above the upper limit 0"),
        (
            SLIDE,
            "lower=\"inf\" upper=\"-inf\"",
            none,
            "joint 'j0' has the lower limit inf above the upper limit -inf",
        ),
        (SLIDE, "lower=\"-inf\" upper=\"inf\"", none, ""),
        (SLIDE, "lower=\"-INF\" upper=\"1\"", [-inf, 1.0], ""),
        (SLIDE, "lower=\"0\" upper=\"0\"", none, ""),
        (SLIDE, "effort=\"1\" velocity=\"nan\"", none, ""),
        // A continuous joint has none, whatever they are.
        ("continuous", "lower=\"-1\" upper=\"2\"", none, ""),
        ("continuous", "lower=\"nan\" upper=\"x\"", none, ""),
    ] {
        let robot = of_texts(joints(&[(kind, &format!("<limit {limit}/>"))]), None).unwrap();
        assert_eq!(robot.limits(), [expected], "{kind} {limit}");
        let place = format!("robot.urdf: line 2, <limit>: {warned}");
        check(&robot, &[(place.as_str(), wrong)][..usize::from(!warned.is_empty())]);
    }
    // Those of a joint that follows are not read.
    let follows = "<limit lower=\"nan\" upper=\"-1\"/><mimic joint=\"j0\"/>";
    check(&of_texts(joints(&[(SLIDE, ""), (SLIDE, follows)]), None).unwrap(), &[]);
}

#[test]
fn a_robot_without_shapes_is_told() {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("r.urdf");
    let read = |text: &str, geometry| {
        fs::write(&path, text).unwrap();
        Robot::from_urdf(&path, &RobotOptions::default().geometry(geometry)).unwrap()
    };
    let (no_collision, no_visual) =
        ("no link has a <collision>, so that the robot touches nothing", "no link has a <visual>, so that");
    let one = "<?xml version=\"1.0\"?>\n<robot name=\"r\"><link name=\"base\"><visual><geometry><box size=\"1 1 1\"/></geometry></visual></link></robot>";
    let two = joints(&[(SLIDE, ""), (SLIDE, "")]).replace("collision>", "visual>");
    for (text, joints) in [(one, 0), (two.as_str(), 2)] {
        let mut robot = read(text, Geometry::Collision);
        check(&robot, &[(no_collision, "; the option for visual geometry reads its <visual> elements")]);
        assert!(robot.pairs().is_empty() && !robot.collide(&vec![0.0; joints]).unwrap());
        let mut robot = read(text, Geometry::Visual);
        check(&robot, &[]);
        robot.add_obstacle("o", crate::questions::block([0.1; 3]), &bvh_query::Pose::IDENTITY).unwrap();
        assert!(robot.collide(&vec![0.0; joints]).unwrap());
        let text = text.replace("visual>", "collision>");
        let to_visual = "; the option for collision geometry reads its <collision> elements";
        check(&read(&text, Geometry::Visual), &[(no_visual, to_visual)]);
    }
    check(
        &read("<robot><link name=\"a\"/></robot>", Geometry::Collision),
        &[("line 1, <robot>: no link has", "touches nothing")],
    );
    check(&read("<robot><link name=\"a\"/></robot>", Geometry::Visual), &[(no_visual, "touches nothing")]);
    // Links without shapes beside one with a shape are usual.
    check(&of_texts(row(1, 1), None).unwrap(), &[]);
}

/// Writes a triangle as binary STL with bytes after it.
fn write_mesh(path: &Path, rest: &[u8]) {
    let corners =
        [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0_f32].map(f32::to_le_bytes).concat();
    fs::write(path, [&[0; 80][..], &1_u32.to_le_bytes(), &corners, &[0; 2], rest].concat()).unwrap();
}

#[test]
fn the_warnings_of_meshes_are_those_of_the_robot() {
    let folder = cbvh_testkit::folder();
    let folder = folder.path();
    for (name, rest) in [("good.stl", &[][..]), ("long.stl", &[0; 3][..]), ("other.stl", &[0; 7][..])] {
        write_mesh(&folder.join(name), rest);
    }
    let mesh = |name: &str, scale: &str| {
        format!(
            "<collision><geometry><mesh filename=\"{name}.stl\" scale=\"{scale} 1 1\"/></geometry></collision>"
        )
    };
    let text = format!(
        "<robot><link name=\"a\">{}{}</link><link name=\"b\">{}{}</link><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/>\
         <child link=\"b\"/><limit lower=\"1\"/></joint></robot>",
        mesh("good", "1"),
        mesh("long", "1"),
        mesh("long", "2"),
        mesh("other", "1"),
    );
    fs::write(folder.join("r.urdf"), text).unwrap();
    fs::write(folder.join("r.srdf"), "<robot><disable_collisions link1=\"a\" link2=\"c\"/></robot>").unwrap();
    let options = RobotOptions::default().srdf(folder.join("r.srdf")).cache(folder.join("cache"));
    let expected = [
        ("r.urdf: line 1, <limit>: joint 'j' has the lower limit 1", "without limits"),
        ("r.urdf: link a: ", "long.stl: byte 134: left out 3 more bytes after the last triangle"),
        ("r.urdf: link b: ", "other.stl: byte 134: left out 7 more bytes after the last triangle"),
        ("r.srdf: line 1, <disable_collisions>: the robot has no link 'c'", "passed over"),
    ];
    // Also if they were baked before, and in a robot that is made of plain data.
    for _ in 0..2 {
        let robot = Robot::from_urdf(folder.join("r.urdf"), &options).unwrap();
        check(&robot, &expected);
        let (clone, again) = (robot.clone(), Robot::from_parts(robot.to_parts()).unwrap());
        assert_eq!((clone.warnings(), again.warnings()), (robot.warnings(), robot.warnings()));
    }
}
