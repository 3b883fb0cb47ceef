//! Which of many placed meshes touch, frame by frame?
//!
//! It prints:
//!
//! ```text
//! frame 0: pairs in contact: 0; ["room", "standing"] are 480.5 apart
//! frame 1: pairs in contact: 0; ["room", "standing"] are 480.5 apart
//! frame 2: pairs in contact: 0; ["standing", "right"] are 190.0 apart
//! frame 3: pairs in contact: 1; ["standing", "right"] are 0.0 apart
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, Pose, Scene};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut scene = Scene::new()?;
    scene.set_tracking(true); // earlier results about each pair save time; no answer changes
    scene.add_named("room", load("testdata/fclenv.obj")?, Pose::IDENTITY)?;
    let robot = load("testdata/fclrob.obj")?;
    let mut robots = Vec::new();
    for name in ["standing", "left", "right"] {
        robots.push(scene.add_named(name, robot.clone(), Pose::IDENTITY)?);
    }
    scene.set_allowed(robots[0], robots[1], true)?; // may touch
    for frame in 0..4 {
        let step = 300.0 * f64::from(frame);
        for (robot, y) in robots.iter().zip([0.0, step - 1800.0, 2000.0 - step]) {
            scene.set_pose(*robot, Pose::new(*Pose::IDENTITY.rotation(), [2000.0, y, 900.0])?)?;
        }
        let touching = scene.pairs_in_contact()?.len();
        let nearest = scene.distance()?.ok_or("there are pairs")?;
        let names = [scene.name(nearest.pair.a)?, scene.name(nearest.pair.b)?].map(Option::unwrap_or_default);
        println!(
            "frame {frame}: pairs in contact: {touching}; {names:?} are {:.1} apart",
            nearest.nearest.distance
        );
    }
    Ok(())
}
