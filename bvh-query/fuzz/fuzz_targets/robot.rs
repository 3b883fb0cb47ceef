//! Reads any text as a URDF and, after a zero byte, as an SRDF. Without shapes of meshes, no file is read.
#![no_main]

use cbvh_robot::{Base, Geometry, Robot, RobotParts};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut texts = bytes.splitn(2, |byte| *byte == 0).map(|text| String::from_utf8_lossy(text).into_owned());
    let parts = RobotParts {
        urdf: ("fuzz.urdf".into(), texts.next().unwrap_or_default()),
        srdf: texts.next().map(|text| ("fuzz.srdf".into(), text)),
        geometry: Geometry::Visual,
        base: Base::Floating,
        mesh_warnings: Vec::new(),
        links: Vec::new(),
        others: Vec::new(),
        margins: Vec::new(),
        allowed: Vec::new(),
    };
    if let Ok(mut robot) = Robot::from_parts(parts) {
        let q = vec![0.25; robot.joints().len()];
        let _ = robot.collide(&q);
        let _ = robot.nearest_turns(&q, &q);
    }
});
