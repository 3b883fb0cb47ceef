//! Reads scenes of boxes and cylinders around an arm.
//!
//! A file has scenes one after the other: a line `kind number boxes cylinders configurations edges`, and then a line for each box (the
//! rows of a pose, 3 by 4, and half sizes), cylinder (a pose, radius and length), configuration (the first values of joints; others
//! are 0) and edge (start and goal).

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Bvh, OwnedShape, Pose};
use cbvh_robot::{Robot, RobotOptions};

/// A thousandth of a cylinder's radius.
const CYLINDER_ERROR: f64 = 1e-3;

/// An arm among obstacles, and what is checked there.
pub struct Scene {
    /// The kind and the number.
    pub name: [String; 2],
    /// The arm, with the obstacles.
    pub robot: Robot,
    /// Values of all joints.
    pub configurations: Vec<Vec<f64>>,
    /// The start and the goal of each edge.
    pub edges: Vec<[Vec<f64>; 2]>,
}

/// Reads a robot with the pairs that its SRDF disables, whose meshes are found in a folder of packages.
pub fn arm([urdf, srdf, packages]: [&str; 3]) -> Robot {
    let options = RobotOptions::new().srdf(srdf).packages([packages]);
    Robot::from_urdf(urdf, &options).expect("a robot")
}

fn shape(mesh: &Mesh) -> OwnedShape {
    let (bytes, _) = to_bytes(mesh, &Options::default()).expect("a shape bakes");
    OwnedShape::from(Bvh::from_bytes(bytes).expect("a baked file")).solid().expect("a closed shape")
}

/// Returns the pose of rows that were rounded to some digits: the nearest rotation with the first direction kept.
fn pose(rows: &[f64]) -> Pose {
    let column = |k: usize| [rows[k], rows[4 + k], rows[8 + k]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |v: [f64; 3]| v.map(|x| x / dot(v, v).sqrt());
    let (x, y) = (unit(column(0)), column(1));
    let along = dot(x, y);
    let y = unit([0, 1, 2].map(|k| y[k] - along * x[k]));
    let z = [0, 1, 2].map(|k| x[(k + 1) % 3] * y[(k + 2) % 3] - x[(k + 2) % 3] * y[(k + 1) % 3]);
    Pose::new([0, 1, 2].map(|k| [x[k], y[k], z[k]]), column(3)).expect("a pose")
}

/// Reads scenes around an arm.
pub fn read(text: &str, arm: &Robot) -> Vec<Scene> {
    let mut lines = text.lines();
    let mut scenes = Vec::new();
    while let Some(head) = lines.next() {
        let mut words = head.split_whitespace();
        let name = [(); 2].map(|()| words.next().expect("a kind and a number").to_owned());
        let counts: Vec<usize> = words.map(|word| word.parse().expect("a count")).collect();
        let mut next = || numbers(lines.next().expect("as many lines as the head says"));
        let mut robot = arm.clone();
        for number in 0..counts[0] {
            let of = next();
            let block = shapes::block([12, 13, 14].map(|k| 2.0 * of[k])).expect("a block");
            robot.add_obstacle(format!("box {number}"), shape(&block), &pose(&of)).expect("a new name");
        }
        for number in 0..counts[1] {
            let of = next();
            let cylinder = shapes::cylinder(of[12], of[13], CYLINDER_ERROR * of[12]).expect("a cylinder");
            let name = format!("cylinder {number}");
            robot.add_obstacle(name, shape(&cylinder.mesh), &pose(&of)).expect("a new name");
        }
        let whole = |values: &[f64]| whole(values, arm);
        let configurations = (0..counts[2]).map(|_| whole(&next())).collect();
        let edge = |of: Vec<f64>| {
            let (start, goal) = of.split_at(of.len() / 2);
            [whole(start), whole(goal)]
        };
        let edges = (0..counts[3]).map(|_| edge(next())).collect();
        scenes.push(Scene { name, robot, configurations, edges });
    }
    scenes
}

/// Returns the numbers of a line.
pub fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace().map(|word| word.parse().expect("a number")).collect()
}

/// Returns values of all joints, given the first ones.
fn whole(values: &[f64], arm: &Robot) -> Vec<f64> {
    let mut values = values.to_vec();
    values.resize(arm.joints().len(), 0.0);
    values
}
