//! Checks a path, sampled by poses: is it free of collisions, and how much room is left along it?
//!
//! ```text
//! cargo run --release --example path -- [A B]
//! ```
//!
//! A and B are mesh files. By default they are a robot and its surroundings, from the folder `testdata` of the
//! workspace.
#![allow(clippy::print_stdout, reason = "a program prints its answers")]

use bvh_query::{Batch, Bvh, Pose, PoseError, Querier, Tracker};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = |default: &str| arguments.next().unwrap_or_else(|| default.to_owned());
    let walls = bake(next("testdata/fclenv.obj").as_ref())?;
    let robot = bake(next("testdata/fclrob.obj").as_ref())?;
    let path: Vec<Pose> = (0..=200).map(|step| pose(f64::from(step) / 200.0)).collect::<Result<_, _>>()?;

    // One pose after the other: a tracker reuses the previous answer, and the answers stay the same.
    let mut querier = Querier::new()?;
    let mut tracker = Tracker::new();
    let mut least = f64::INFINITY;
    for pose in &path {
        least = least.min(tracker.distance(&mut querier, &walls, &robot, pose)?.distance);
    }
    println!("the least distance along the path is {least}");

    // All poses at once, on all cores.
    let batch = Batch::new(&walls, &robot)?;
    match batch.first_collision(&path)? {
        Some(step) => println!("the path is free up to step {step}"),
        None => println!("the path is free"),
    }
    Ok(())
}

/// Returns where the robot is at time `t`, from 0 to 1: it turns about the z axis while it moves.
fn pose(t: f64) -> Result<Pose, PoseError> {
    let (sin, cos) = (0.9 + 0.5 * t).sin_cos();
    Pose::new([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], [300.0, -1600.0 + 400.0 * t, -500.0])
}

fn bake(path: &Path) -> Result<Bvh, Box<dyn Error>> {
    let mesh = bvh_bake::read_meshes(&[path.to_owned()])?;
    let (bytes, _) = bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?;
    Ok(Bvh::from_bytes(bytes)?)
}
