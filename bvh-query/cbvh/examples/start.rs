//! The first program of the book: bakes a room and a robot in memory, and computes how near the robot comes to the room.
//!
//! ```text
//! cargo run --release --example start
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

// ANCHOR: program
use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, Pose, Querier};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    let mesh = read_meshes(&[path.into()])?;
    let (bytes, _report) = to_bytes(&mesh, &Options::default())?;
    Ok(Bvh::from_bytes(bytes)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let room = load("testdata/fclenv.obj")?;
    let robot = load("testdata/fclrob.obj")?;
    let mut querier = Querier::new()?; // working memory: one per thread

    // The pose of the robot in the frame of the room: the rows of a rotation, and a translation in mesh units.
    let rotation = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
    for z in [-500.0, -440.0, -439.5] {
        let pose = Pose::new(rotation, [300.0, -1600.0, z])?;
        if querier.collide(&room, &robot, &pose)? {
            let contacts = querier.contacts(&room, &robot, &pose)?;
            println!("z = {z}: in contact, {} pairs of triangles", contacts.len());
        } else {
            let nearest = querier.distance(&room, &robot, &pose)?;
            println!(
                "z = {z}: {} apart, triangles {} and {}",
                nearest.distance, nearest.triangle_a, nearest.triangle_b
            );
        }
    }
    Ok(())
}
// ANCHOR_END: program
