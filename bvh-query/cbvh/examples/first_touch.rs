//! When does a moving body first touch, and is its path free at every moment?
//!
//! It prints:
//!
//! ```text
//! clearance 0: free true
//! clearance 2000: free false
//! free until 0.386574, touching at 0.386574
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, Motion, MotionAnswer, MotionOptions, Pose, Querier};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (room, robot) = (load("testdata/fclenv.obj")?, load("testdata/fclrob.obj")?);
    let at = |translation| Pose::new(*Pose::IDENTITY.rotation(), translation);
    let mut querier = Querier::new()?;

    // For planners: free or not, with a clearance.
    let aside = Motion::between(&at([0.0, 0.0, 5000.0])?, &at([500.0, 0.0, 5000.0])?)?;
    for clearance in [0.0, 2000.0] {
        let options = MotionOptions::new().clearance(clearance);
        println!("clearance {clearance}: free {}", querier.is_free(&room, &robot, &aside, &options)?);
    }
    // For stops: the time until which it is certainly free, and one at which it touches.
    let fall = Motion::between(&at([500.0, 0.0, 5000.0])?, &at([500.0, 0.0, -400.0])?)?;
    match querier.motion(&room, &robot, &fall, &MotionOptions::new())? {
        MotionAnswer::Free => println!("free"),
        MotionAnswer::Hit { free_until, touching_at, .. } => {
            println!("free until {free_until:.6}, touching at {touching_at:.6}");
        }
        MotionAnswer::Near { free_until, .. } => println!("free until {free_until:.6}, then undecided"),
    }
    Ok(())
}
