//! What does a sensor see? Rays and lines of sight in a room.
//!
//! It prints:
//!
//! ```text
//! 346 of 360 rays hit something
//! the nearest 902.101 away, on triangle 457
//! all in sight: true
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, read_meshes, to_bytes};
use cbvh::{Bvh, ProbeBatch, Ray};
use std::error::Error;

/// Bakes a mesh file in memory.
fn load(path: &str) -> Result<Bvh, Box<dyn Error>> {
    Ok(Bvh::from_bytes(to_bytes(&read_meshes(&[path.into()])?, &Options::default())?.0)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let room = load("testdata/fclenv.obj")?;
    let eye = [0.0, 0.0, 600.0];

    // A ring of rays of unit length, so that t is in mesh units.
    let ring = (0..360).map(|degree| f64::from(degree).to_radians().sin_cos());
    let rays: Vec<Ray> = ring.map(|(sin, cos)| Ray::new(eye, [cos, sin, 0.0]).until(4000.0)).collect();
    let batch = ProbeBatch::new(&room)?; // all cores
    let hits = batch.first_hits(&rays)?;
    let nearest = hits.iter().flatten().min_by(|a, b| a.t.total_cmp(&b.t)).ok_or("nothing is there")?;
    println!("{} of {} rays hit something", hits.iter().flatten().count(), rays.len());
    println!("the nearest {:.3} away, on triangle {}", nearest.t, nearest.triangle);

    // The eye sees each of these points, but for a margin of one mesh unit in front of it.
    let pairs: Vec<_> = hits.iter().flatten().map(|hit| [eye, hit.point]).collect();
    println!("all in sight: {}", batch.visible(&pairs, 1.0)?.iter().all(|seen| *seen));
    Ok(())
}
