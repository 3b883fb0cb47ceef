//! Which parts of an assembly clash, and by how much?
//!
//! It prints:
//!
//! ```text
//! ["base", "upright"]: protruding, 0.0500 to 0.0500 deep, 3.810e-4 in common
//! ["base", "beside"]: near, 0.0707 apart
//! ["upright", "beside"]: near, 0.0573 apart
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, ClashOptions, Pose, Scene};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (base, link) = (load("testdata/robot/base.obj")?, load("testdata/robot/link.obj")?);
    let at = |translation| Pose::new(*Pose::IDENTITY.rotation(), translation);
    let mut assembly = Scene::new()?; // or Scene::of_file, of a file that cbvh bake --scene made
    assembly.add_named("base", base, Pose::IDENTITY)?;
    assembly.add_named("upright", link.clone(), at([0.0, 0.0, 0.2])?)?;
    assembly.add_named("beside", link, at([0.15, 0.0, 0.3])?)?;

    for found in assembly.clashes(&ClashOptions::new().clearance(0.1).magnitudes(true))? {
        let names =
            [assembly.name(found.pair.a)?, assembly.name(found.pair.b)?].map(Option::unwrap_or_default);
        let clash = found.clash;
        print!("{names:?}: {}", clash.class.name());
        match (clash.depth, clash.magnitudes) {
            (Some(depth), Some(common)) => {
                print!(", {:.4} to {:.4} deep, {:.3e} in common", depth.lower, depth.upper, common.volume);
            }
            _ => print!(", {:.4} apart", clash.distance),
        }
        println!();
    }
    Ok(())
}
