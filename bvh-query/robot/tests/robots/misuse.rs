//! Files that are not as they should be, and numbers that no joint can have: one clear error each.

use bvh_query::{MotionOptions, PenetrationOptions, Pose};
use cbvh_robot::{Base, Edge, Robot, RobotError, RobotOptions};

fn read(text: &str) -> Result<Robot, RobotError> {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, text).unwrap();
    Robot::from_urdf(path, &RobotOptions::default())
}

/// Two links, and what is between them.
fn with(joint: &str, geometry: &str) -> String {
    format!(
        "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"><collision><geometry>{geometry}</geometry></collision></link>\n\
         {joint}</robot>"
    )
}

const JOINT: &str = "<joint name=\"j\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/></joint>";
const BALL: &str = "<sphere radius=\"1\"/>";

#[test]
fn each_mistake_in_a_file_is_named() {
    assert!(read(&with(JOINT, BALL)).is_ok());
    let joint = |inside: &str| JOINT.replace("</joint>", &format!("{inside}</joint>"));
    let cases = [
        ("<robot".to_owned(), "robot.urdf: line 1, column 1: expected XML"),
        ("<sdf/>".to_owned(), "expected the element <robot>, found <sdf>"),
        ("<robot/>".to_owned(), "expected one link that no joint moves, found 0 of 0 links"),
        (
            "<robot><link name=\"a\"/><link name=\"a\"/></robot>".to_owned(),
            "link a, <link>: expected a name of its own",
        ),
        ("<robot><link/></robot>".to_owned(), "<link>: expected name, found no such attribute"),
        (with("", BALL), "expected one link that no joint moves, found 2 of 2 links"),
        (with(&format!("{JOINT}{JOINT}"), BALL), "line 2, joint j, <joint>: expected a name of its own"),
        (
            with(&(JOINT.to_owned() + &JOINT.replace("\"j\"", "\"k\"")), BALL),
            "expected a child that no other joint moves, found b",
        ),
        (
            with(&JOINT.replace("\"b\"", "\"c\""), BALL),
            "joint j, <child>: expected the name of a link, found c",
        ),
        (with(&JOINT.replace("revolute", "screw"), BALL), "expected a joint type of URDF, found screw"),
        (with(&joint("<axis xyz=\"0 0 0\"/>"), BALL), "expected an axis of length 1"),
        (with(&joint("<axis xyz=\"0 0\"/>"), BALL), "expected three finite numbers, found xyz=\"0 0\""),
        (
            with(&joint("<origin xyz=\"0 nan 0\"/>"), BALL),
            "expected three finite numbers, found xyz=\"0 nan 0\"",
        ),
        (with(&joint("<mimic/>"), BALL), "joint j, <mimic>: expected joint, found no such attribute"),
        (
            with(&joint("<limit lower=\"nan\"/>"), BALL),
            "joint j, <limit>: expected a number, found lower=\"nan\"",
        ),
        (with(&joint("<limit upper=\"1,5\"/>"), BALL), "expected a number, found upper=\"1,5\""),
        (with(JOINT, ""), "link b, <collision>: expected a geometry, found none"),
        (with(JOINT, "<cone/>"), "expected a mesh, box, sphere, cylinder or capsule, found cone"),
        (with(JOINT, "<sphere radius=\"x\"/>"), "expected a finite number, found radius=\"x\""),
        (with(JOINT, "<sphere radius=\"-1\"/>"), "-1"),
        (with(JOINT, "<box size=\"1 0 1\"/>"), "link b: expected a shape of finite size"),
        (
            with(JOINT, "<mesh filename=\"package://p/x.stl\"/>"),
            "link b: expected the mesh package://p/x.stl, found none at",
        ),
        (with(JOINT, "<mesh filename=\"x.stl\" scale=\"1 0 1\"/>"), "a scale of factors other than 0"),
    ];
    for (text, expected) in cases {
        let message = read(&text).unwrap_err().to_string();
        assert!(message.contains(expected), "{text}: expected '{expected}', found '{message}'");
    }
    assert!(matches!(
        Robot::from_urdf("/nowhere.urdf", &RobotOptions::default()),
        Err(RobotError::Io { .. })
    ));
}

#[test]
fn a_circle_of_joints_has_no_root() {
    let text = "<robot><link name=\"r\"/><link name=\"a\"/><link name=\"b\"/>\
        <joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
        <joint name=\"k\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>";
    assert!(read(text).unwrap_err().to_string().contains("joints in a circle"));
}

#[test]
fn numbers_that_no_joint_can_have_are_refused() {
    let mut robot = read(&with(JOINT, BALL)).unwrap();
    assert!(matches!(robot.collide(&[]), Err(RobotError::Count { expected: 1, found: 0 })));
    assert!(matches!(robot.collide_many(&[0.0; 3]), Ok(answers) if answers.len() == 3));
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(matches!(robot.collide(&[bad]), Err(RobotError::Value { .. })));
        for threads in [1, 3] {
            // A bad row among good ones is named, however many threads ask.
            cbvh_testkit::here::pool(threads).install(|| {
                let error = robot.collide_many(&[0.0, 0.1, bad, bad]).unwrap_err();
                assert!(matches!(&error, RobotError::Row { row: 2, source } if matches!(**source, RobotError::Value { .. })));
                assert!(error.to_string().starts_with("row 2: joint j: expected a finite value, found "));
                let edges = [0.0, bad].map(|to| Edge::straight(&[0.0], &[to]).unwrap());
                let free = robot.are_free(&edges, &MotionOptions::new());
                assert!(matches!(free, Err(RobotError::Row { row: 1, .. })));
                let wrong = [Edge::polynomials(vec![]), edges[0].clone()];
                assert!(matches!(robot.motions(&wrong, &MotionOptions::new()), Err(RobotError::Row { row: 0, .. })));
            });
        }
        assert!(matches!(robot.is_free(&[0.0], &[bad]), Err(RobotError::Value { .. })));
        assert!(matches!(robot.link_poses(&[bad]), Err(RobotError::Value { .. })));
    }
    assert!(matches!(robot.is_free(&[0.0], &[]), Err(RobotError::Count { .. })));
    assert!(matches!(
        robot.motion(&Edge::polynomials(vec![]), &MotionOptions::new()),
        Err(RobotError::Count { .. })
    ));
    // Far, and too far.
    let slide = read(&with(&JOINT.replace("revolute", "prismatic"), BALL).replace(
        "<link name=\"a\"/>",
        &format!("<link name=\"a\"><collision><geometry>{BALL}</geometry></collision></link>"),
    ));
    let mut slide = slide.unwrap();
    assert!(slide.is_free(&[3.0], &[1e6]).unwrap() && !slide.is_free(&[0.0], &[1e6]).unwrap());
    assert!(matches!(slide.is_free(&[3.0], &[1e40]), Err(RobotError::Pose(_))));
    // Many turns take their time, and too many are refused.
    for radians in [1e3, 1.6e4, 1.7e4, 1e12, 1e308] {
        let answer = two_balls().is_free(&[0.0], &[radians]);
        let is_refused = matches!(answer, Err(RobotError::Value { .. }));
        assert!(is_refused && radians > 16384.0 || answer.is_ok(), "{radians}: {answer:?}");
    }
    // Also without pairs.
    let options = PenetrationOptions::new();
    assert!(matches!(robot.signed_distance(&[0.0], &options), Ok(None)));
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        for options in [options.relative_gap(bad), options.tolerance(bad)] {
            assert!(matches!(robot.signed_distance(&[0.0], &options), Err(RobotError::Query(_))));
            assert!(matches!(robot.signed_distance_many(&[0.0], &options), Err(RobotError::Query(_))));
        }
    }
    // Also if no pair comes near.
    robot.add_obstacle("o", robot_shape(), &Pose::IDENTITY).unwrap();
    robot
        .add_obstacle("far", robot_shape(), &Pose::new(*Pose::IDENTITY.rotation(), [9.0; 3]).unwrap())
        .unwrap();
    let edge = Edge::straight(&[0.0], &[1.0]).unwrap();
    for near in ["o", "far"] {
        for bad in [-1.0, f64::NAN, f64::INFINITY] {
            for options in [MotionOptions::new().clearance(bad), MotionOptions::new().tolerance(bad)] {
                assert!(matches!(robot.is_edge_free(&edge, &options), Err(RobotError::Query(_))), "{near}");
                assert!(matches!(robot.motion(&edge, &options), Err(RobotError::Query(_))), "{near}");
            }
        }
        robot.allow("b", "o").unwrap();
    }
    assert!(robot.is_edge_free(&edge, &MotionOptions::new().clearance(1.0).tolerance(0.1)).unwrap());
    assert!(robot.is_edge_free(&edge, &MotionOptions::new().tolerance(0.0)).is_err());
    assert!(matches!(robot.add_obstacle("o", robot_shape(), &Pose::IDENTITY), Err(RobotError::Taken(_))));
    assert!(matches!(robot.set_margin("o", f64::NAN), Err(RobotError::Query(_))));
    for result in [robot.allow("a", "nothing"), robot.remove("a"), robot.set_pose("b", &Pose::IDENTITY)] {
        assert!(matches!(result, Err(RobotError::Unknown { .. })));
    }
    assert!(robot.attach("t", robot_shape(), "nothing", &Pose::IDENTITY, &[]).is_err());
}

/// A ball that passes another one once in a turn, with a gap.
fn two_balls() -> Robot {
    let ball = |at: f64| {
        format!(
            "<collision><origin xyz=\"{at} 0 0\"/><geometry><sphere radius=\"1\"/></geometry></collision>"
        )
    };
    let joint = JOINT.replace("</joint>", "<axis xyz=\"0 0 1\"/></joint>");
    let (a, b) = (ball(6.0), ball(3.0));
    read(&format!("<robot><link name=\"a\">{a}</link><link name=\"b\">{b}</link>{joint}</robot>")).unwrap()
}

fn robot_shape() -> bvh_query::OwnedShape {
    let (bytes, _) =
        bvh_bake::to_bytes(&bvh_bake::shapes::block([1.0; 3]).unwrap(), &bvh_bake::Options::default())
            .unwrap();
    bvh_query::Bvh::from_bytes(bytes).unwrap().into()
}

#[test]
fn a_quaternion_without_length_is_refused() {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, with(JOINT, BALL)).unwrap();
    let mut robot = Robot::from_urdf(path, &RobotOptions::default().base(Base::Floating)).unwrap();
    assert!(matches!(robot.collide(&[0.0; 8]), Err(RobotError::Value { .. })));
    let mut q = [0.0; 8];
    q[6] = 1.0;
    assert!(!robot.collide(&q).unwrap());
    // Opposite quaternions are the same turn; a curve has to be straight there.
    let mut other = q;
    other[6] = -1.0;
    assert!(robot.is_free(&q, &other).unwrap());
    let mut curved: Vec<Vec<f64>> = q.iter().map(|x| vec![*x]).collect();
    curved[4] = vec![0.0, 0.1, 0.1];
    assert!(matches!(
        robot.is_edge_free(&Edge::polynomials(curved), &MotionOptions::new()),
        Err(RobotError::Value { .. })
    ));
}
