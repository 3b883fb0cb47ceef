//! Which points, normals and depths does a contact give a simulator?
//!
//! It prints:
//!
//! ```text
//! a patch of 10 contacts, pushed along [0.0, 0.0, 1.0]
//!   at [0.25, -0.25, 0.1171875], 0.015625 deep
//!   at [-0.25, 0.25, 0.1171875], 0.015625 deep
//!   at [0.25, 0.25, 0.1171875], 0.015625 deep
//!   at [-0.25, -0.25, 0.1171875], 0.015625 deep
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{Options, shapes, to_bytes};
use cbvh::{Bvh, PatchOptions, Pose, Querier};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let block = |sides| -> Result<Bvh, Box<dyn Error>> {
        Ok(Bvh::from_bytes(to_bytes(&shapes::block(sides)?, &Options::default())?.0)?)
    };
    let (table, part) = (block([2.0, 1.0, 0.25])?, block([0.5, 0.5, 0.5])?);
    let mut querier = Querier::new()?;

    // The part stands on the table and has sunk into it by 1/64. The table pushes it along the normals.
    let pose = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 0.375 - 1.0 / 64.0])?;
    let found = querier.patches(&table, &part, &pose, &PatchOptions::new().max_points(4))?;
    for patch in &found.patches {
        println!("a patch of {} contacts, pushed along {:?}", patch.count, patch.normal);
        for point in &found.points[patch.first_point..][..patch.point_count] {
            println!("  at {:?}, {} deep", point.point, point.depth);
        }
    }
    Ok(())
}
