//! Times certain edges of an arm among boxes and cylinders, and prints a hash of all answers, to compare two builds.
//!
//! ```text
//! taskset -c 0 cargo bench --bench edges -- URDF SRDF PACKAGES EDGES [ROUNDS]
//! ```
//!
//! EDGES has scenes one after the other: a line `kind number boxes cylinders configurations edges`, and then a line for each box (the
//! rows of a pose, 3 by 4, and half sizes), cylinder (a pose, radius and length), configuration (the first values of joints; others
//! are 0) and edge (start and goal). The fastest of some rounds counts for each scene, after a first one, which is told as well.

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Bvh, MotionOptions, OwnedShape, Pose};
use cbvh_robot::{Edge, Robot, RobotOptions};
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::hint::black_box;
use std::time::Instant;

/// A thousandth of a cylinder's radius.
const CYLINDER_ERROR: f64 = 1e-3;
/// States of an edge that a validator at intervals looks at.
const STATES: usize = 32;

struct Scene {
    robot: Robot,
    configurations: Vec<Vec<f64>>,
    edges: Vec<[Vec<f64>; 2]>,
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

fn read(text: &str, arm: &Robot) -> Vec<Scene> {
    let joints = arm.joints().len();
    let mut lines = text.lines();
    let mut scenes = Vec::new();
    while let Some(head) = lines.next() {
        let counts: Vec<usize> =
            head.split_whitespace().skip(2).map(|word| word.parse().expect("a count")).collect();
        let mut next = || -> Vec<f64> {
            let line = lines.next().expect("as many lines as the head says");
            line.split_whitespace().map(|word| word.parse().expect("a number")).collect()
        };
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
        let whole = |values: &[f64]| {
            let mut values = values.to_vec();
            values.resize(joints, 0.0);
            values
        };
        let configurations = (0..counts[2]).map(|_| whole(&next())).collect();
        let edge = |of: Vec<f64>| {
            let (start, goal) = of.split_at(of.len() / 2);
            [whole(start), whole(goal)]
        };
        let edges = (0..counts[3]).map(|_| edge(next())).collect();
        scenes.push(Scene { robot, configurations, edges });
    }
    scenes
}

/// Returns how long something takes, in seconds.
fn time(what: impl FnOnce()) -> f64 {
    let start = Instant::now();
    what();
    start.elapsed().as_secs_f64()
}

/// Returns the fastest of some rounds.
fn fastest(rounds: usize, mut what: impl FnMut()) -> f64 {
    (0..rounds).map(|_| time(&mut what)).fold(f64::INFINITY, f64::min)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [urdf, srdf, packages, edges, rounds @ ..] = &arguments[..] else {
        eprintln!("usage: edges URDF SRDF PACKAGES EDGES [ROUNDS]");
        std::process::exit(2);
    };
    let rounds: usize = rounds.first().map_or(5, |rounds| rounds.parse().expect("a number of rounds"));
    let options =
        RobotOptions { srdf: Some(srdf.into()), packages: vec![packages.into()], ..RobotOptions::default() };
    let arm = Robot::from_urdf(urdf, &options).expect("a robot");
    let text = std::fs::read_to_string(edges).expect("a file of edges");
    let mut hash = DefaultHasher::new();
    let mut times = [0.0; 6];
    let mut counts = [0usize; 3];
    for Scene { mut robot, configurations, edges } in read(&text, &arm) {
        let ask =
            |robot: &mut Robot, [start, goal]: &[Vec<f64>; 2]| robot.is_free(start, goal).expect("an answer");
        let mut free = Vec::new();
        times[0] += time(|| free = edges.iter().map(|edge| ask(&mut robot, edge)).collect());
        for (place, is_free) in [(1, true), (2, false)] {
            let some: Vec<_> = edges.iter().zip(&free).filter(|(_, free)| **free == is_free).collect();
            counts[place - 1] += some.len();
            times[place] += fastest(rounds, || {
                for (edge, _) in &some {
                    black_box(ask(&mut robot, edge));
                }
            });
        }
        counts[2] += configurations.len();
        let collide = |robot: &mut Robot, joints: &[f64]| robot.collide(joints).expect("an answer");
        times[3] += fastest(rounds, || {
            for joints in &configurations {
                black_box(collide(&mut robot, joints));
            }
        });
        times[4] += fastest(1, || {
            for [start, goal] in &edges {
                for state in 0..STATES {
                    let share = (state as f64 + 0.5) / STATES as f64;
                    let at: Vec<f64> = start.iter().zip(goal).map(|(a, b)| a + share * (b - a)).collect();
                    black_box(collide(&mut robot, &at));
                }
            }
        });
        let options = MotionOptions::default();
        for ([start, goal], free) in edges.iter().zip(&free) {
            let edge = Edge::straight(start, goal).expect("as many values");
            let mut motion = String::new();
            times[5] += time(|| motion = format!("{:?}", robot.motion(&edge, &options).expect("an answer")));
            (free, motion).hash(&mut hash);
        }
        for joints in &configurations {
            collide(&mut robot, joints).hash(&mut hash);
        }
    }
    let [free, hits, asked] = counts.map(|count| count.max(1) as f64);
    let micros = times.map(|seconds| 1e6 * seconds);
    let all = free + hits;
    println!("answers {:016x}; {} edges free, {} not", hash.finish(), counts[0], counts[1]);
    println!(
        "an edge, us: {:.1} in the mean, {:.1} free, {:.1} not free",
        (micros[1] + micros[2]) / all,
        micros[1] / free,
        micros[2] / hits
    );
    println!("an edge the first time: {:.1}; its first hit: {:.1}", micros[0] / all, micros[5] / all);
    println!("a configuration: {:.2}; {STATES} states of an edge: {:.1}", micros[3] / asked, micros[4] / all);
}
