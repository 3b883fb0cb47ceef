//! How deep do two parts overlap, and which move takes them apart?
//!
//! It prints:
//!
//! ```text
//! depth from 0.050000 to 0.050000
//! after the move: Apart
//! at 0.2: from -0.050000 to -0.050000
//! at 0.24: from -0.010000 to -0.010000
//! at 0.3: from 0.050000 to 0.050000
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, PenetrationOptions, Pose, Querier};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (base, link) = (load("testdata/robot/base.obj")?, load("testdata/robot/link.obj")?);
    let at = |translation| Pose::new(*Pose::IDENTITY.rotation(), translation);
    let mut querier = Querier::new()?;
    let options = PenetrationOptions::new();

    // Certified bounds of the shortest translation after which the insides are disjoint, and one of the upper length.
    let deep = querier.penetration(&base, &link, &at([0.0, 0.0, 0.2])?, &options)?;
    println!("depth from {:.6} to {:.6}", deep.lower, deep.upper);
    let [x, y, z] = deep.translation;
    println!("after the move: {:?}", querier.relation(&base, &link, &at([x, y, 0.2 + z])?)?);

    // One number for parts that are apart or overlap: the distance, or minus the depth.
    for z in [0.2, 0.24, 0.3] {
        let signed = querier.signed_distance(&base, &link, &at([0.0, 0.0, z])?, &options)?;
        println!("at {z}: from {:.6} to {:.6}", signed.lower, signed.upper);
    }
    Ok(())
}
