//! Moves a robot among obstacles, and tells what touches, how much room is left, and whether the motions between are free.
//!
//! ```text
//! cargo run --release -p cbvh-robot --example robot -- [URDF [SRDF]]
//! ```
//!
//! The default is a small arm from the folder `testdata` of the workspace. All joints follow a wave within their limits.
#![allow(clippy::print_stdout, reason = "a program prints its answers")]

use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Bvh, MotionOptions, OwnedShape, Pose};
use cbvh_robot::{Edge, Robot, RobotMotion, RobotOptions};
use std::error::Error;
use std::f64::consts::{PI, TAU};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let arm = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    let path = arguments.next().unwrap_or_else(|| arm.to_owned());
    let mut options = RobotOptions::new();
    options.srdf = arguments.next().map(Into::into);
    let mut robot = Robot::from_urdf(path, &options)?;
    for (pair, share) in robot.allow_frequent(1000, 0.1)? {
        println!(
            "{} and {} may touch: they do in {:.1} % of all configurations",
            pair[0],
            pair[1],
            100.0 * share
        );
    }
    // Two pillars, one of them in the way.
    let pillar = to_bytes(&shapes::block([0.1, 0.1, 1.0])?, &Options::default())?.0;
    let pillar = OwnedShape::from(Bvh::from_bytes(pillar)?).solid()?;
    for (name, [x, y]) in [("pillar", [0.3, 0.2]), ("other pillar", [-0.4, -0.1])] {
        robot.add_obstacle(name, pillar.clone(), &Pose::new(*Pose::IDENTITY.rotation(), [x, y, 0.5])?)?;
    }

    let wave = |robot: &Robot, time: f64| -> Vec<f64> {
        let value = |(number, [lower, upper]): (usize, &[f64; 2])| {
            let (lower, upper) = (lower.max(-PI), upper.min(PI));
            let wave = ((1.0 + number as f64) * TAU * time).sin();
            (lower + upper) / 2.0 + 0.4 * (upper - lower) * wave
        };
        robot.limits().iter().enumerate().map(value).collect()
    };
    // Some links slide along each other, less than a default tolerance apart: that is undecided at many moments.
    let options = MotionOptions::new().tolerance(1e-3);
    for step in 0..24 {
        let time = f64::from(step) / 24.0;
        let (from, to) = (wave(&robot, time), wave(&robot, time + 1.0 / 24.0));
        let touching = robot.pairs_in_contact(&from)?;
        if touching.is_empty()
            && let Some(found) = robot.distance(&from)?
        {
            let [a, b] = &found.bodies;
            println!("{time:.2}: free; {a} and {b} are {:.4} m apart", found.nearest.distance);
        }
        for [a, b] in touching {
            println!("{time:.2}: {a} touches {b}");
        }
        let edge = Edge::straight(&from, &to)?;
        if let RobotMotion::Hit { free_until, bodies: [a, b], .. } = robot.motion(&edge, &options)? {
            println!(
                "      the motion to the next step is free for {free_until:.4} of it, until {a} and {b} touch"
            );
        }
    }
    Ok(())
}
