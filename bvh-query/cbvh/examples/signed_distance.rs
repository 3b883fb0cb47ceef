//! How far are points from a surface, with a sign?
//!
//! It prints:
//!
//! ```text
//! 149 of 2000 points are inside
//! the deepest 0.048798 deep
//! no distance is off by 1e-13: true
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, ProbeBatch, Side};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let link = load("testdata/robot/link.obj")?;

    // A grid of 2,000 points around the mesh, on all cores.
    let axis = |k: u32| 0.025 * f64::from(k) - 0.1;
    let points: Vec<[f64; 3]> = (0..2000).map(|n| [axis(n % 10), axis(n / 10 % 10), axis(n / 100)]).collect();
    let found = ProbeBatch::new(&link)?.signed_point_distances(&points, f64::INFINITY)?;

    // The side is decided exactly; the distance has certified bounds.
    let inside = found.iter().flatten().filter(|of| of.side == Side::Inside);
    println!("{} of {} points are inside", inside.clone().count(), points.len());
    let deepest = inside.map(|of| of.closest.distance).fold(0.0, f64::max);
    println!("the deepest {deepest:.6} deep");
    let error = found.iter().flatten().map(|of| of.closest.upper - of.closest.lower).fold(0.0, f64::max);
    println!("no distance is off by 1e-13: {}", error < 1e-13);
    Ok(())
}
