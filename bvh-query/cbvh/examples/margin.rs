//! Does a robot keep a safety margin?
//!
//! It prints:
//!
//! ```text
//! within 60: false
//! within 60.5: true
//! padded by 60: 0.5 left
//! a margin of 40: touching false
//! and 20.5 for the pair: touching true
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, Pose, Querier, Scene};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (room, robot) = (load("testdata/fclenv.obj")?, load("testdata/fclrob.obj")?);
    let pose = Pose::from_rows(&[0.6, -0.8, 0.0, 300.0, 0.8, 0.6, 0.0, -1600.0, 0.0, 0.0, 1.0, -500.0])?;
    let mut querier = Querier::new()?;

    // A threshold for a query. A gap of exactly that size counts.
    for d in [60.0, 60.5] {
        println!("within {d}: {}", querier.within(&room, &robot, &pose, d)?);
    }
    // A robot that is larger by its padding, with round edges. Nothing is baked again.
    let padded = robot.all().rounded(60.0)?;
    println!("padded by 60: {} left", querier.distance(&room, padded, &pose)?.distance);

    // Margins of the bodies of a scene, which add up.
    let mut scene = Scene::new()?;
    let room = scene.add_named("room", room, Pose::IDENTITY)?;
    let robot = scene.add_named("robot", robot, pose)?;
    scene.set_margin(robot, 40.0)?;
    println!("a margin of 40: touching {}", scene.collide()?);
    scene.set_pair_margin(room, robot, 20.5)?;
    println!("and 20.5 for the pair: touching {}", scene.collide()?);
    Ok(())
}
