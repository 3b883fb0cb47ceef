//! Robots at random, for tests.

use crate::options::{Base, RobotOptions};
use crate::robot::Robot;
use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Bvh, OwnedShape};
use cbvh_testkit::Random;
use std::fmt::Write;

/// Writes a tree of links, each a ball, with joints of all kinds.
pub(crate) fn tree(random: &mut Random, links: usize) -> String {
    scaled_tree(random, links, 1.0)
}

/// Writes such a tree in another unit.
pub(crate) fn scaled_tree(random: &mut Random, links: usize, scale: f64) -> String {
    let mut text = String::from("<robot name=\"tree\">\n");
    let mut single = Vec::new();
    let point = |random: &mut Random, far: f64| {
        let [x, y, z] = random.point().map(|x| far * x);
        format!("{x} {y} {z}")
    };
    for link in 0..links {
        let (at, radius) = (point(random, 0.2 * scale), scale * (0.02 + 0.05 * random.unit()));
        let origin = format!("<origin xyz=\"{at}\" rpy=\"{}\"/>", point(random, 3.0));
        let shape = format!("<geometry><sphere radius=\"{radius}\"/></geometry>");
        writeln!(text, "<link name=\"link{link}\"><collision>{origin}{shape}</collision></link>").unwrap();
        if link == 0 {
            continue;
        }
        let kinds = ["revolute", "continuous", "prismatic", "fixed", "planar", "floating", "revolute"];
        let kind = kinds[random.below(kinds.len())];
        let parent = random.below(link);
        write!(text, "<joint name=\"joint{link}\" type=\"{kind}\"><parent link=\"link{parent}\"/>").unwrap();
        let (at, turned) = (point(random, 0.5 * scale), point(random, 3.0));
        write!(text, "<child link=\"link{link}\"/><origin xyz=\"{at}\" rpy=\"{turned}\"/>").unwrap();
        write!(text, "<axis xyz=\"{}\"/>", point(random, 1.0)).unwrap();
        if matches!(kind, "revolute" | "continuous" | "prismatic") {
            write!(text, "<limit lower=\"-2\" upper=\"2\" effort=\"1\" velocity=\"1\"/>").unwrap();
            if !single.is_empty() && random.below(4) == 0 {
                let leader: usize = single[random.below(single.len())];
                let (by, plus) = (2.0 * random.signed(), random.signed());
                write!(text, "<mimic joint=\"joint{leader}\" multiplier=\"{by}\" offset=\"{plus}\"/>")
                    .unwrap();
            }
            single.push(link);
        }
        writeln!(text, "</joint>").unwrap();
    }
    text + "</robot>\n"
}

/// Reads a robot from text.
pub(crate) fn robot(text: &str, base: Base) -> Robot {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, text).unwrap();
    Robot::from_urdf(path, &RobotOptions::default().base(base)).unwrap()
}

/// Returns joint values within some range, with quaternions of length 1.
pub(crate) fn values(random: &mut Random, robot: &Robot, far: f64) -> Vec<f64> {
    let mut values: Vec<f64> = robot.joints().iter().map(|_| far * random.signed()).collect();
    for first in (0..values.len()).filter(|&place| robot.joints()[place].ends_with("/qx")) {
        values[first..first + 4].copy_from_slice(&random.quaternion());
    }
    values
}

/// Makes a ball about the origin.
pub(crate) fn ball(radius: f64) -> OwnedShape {
    let (bytes, _) = to_bytes(&shapes::point([0.0; 3]), &Options::default()).unwrap();
    OwnedShape::from(Bvh::from_bytes(bytes).unwrap()).rounded(radius).unwrap()
}

/// Makes a robot without shapes, whose only joint slides along y from a place on x.
pub(crate) fn slider(at: f64) -> Robot {
    let text = "<robot name=\"slider\"><link name=\"base\"/><link name=\"hand\"/><joint name=\"slide\" type=\"prismatic\">\
                <parent link=\"base\"/><child link=\"hand\"/><origin xyz=\"AT 0 0\"/><axis xyz=\"0 1 0\"/>\
                <limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint></robot>";
    robot(&text.replace("AT", &at.to_string()), Base::Fixed)
}
