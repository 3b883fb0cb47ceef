//! Asks two meshes in one pose: do they touch, where, how far apart are they?
//!
//! ```text
//! cargo run --release --example collide -- [A B]
//! ```
//!
//! A and B are `.cbvh` files, or meshes that are baked in memory first. By default they are a robot and its
//! surroundings, from the folder `testdata` of the workspace.
#![allow(clippy::print_stdout, reason = "a program prints its answers")]

use bvh_query::{Bvh, Pose, Querier};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = |default: &str| arguments.next().unwrap_or_else(|| default.to_owned());
    let walls = open(next("testdata/fclenv.obj").as_ref())?;
    let robot = open(next("testdata/fclrob.obj").as_ref())?;

    // B is placed in A's frame: turned about the z axis, then moved. Lengths are in mesh units.
    let (sin, cos) = (0.8, 0.6);
    let rotation = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let pose = Pose::new(rotation, [300.0, -1600.0, -500.0])?;

    // A querier keeps the memory that queries work in: create it once per thread.
    let mut querier = Querier::new()?;
    if querier.collide(&walls, &robot, &pose)? {
        let contacts = querier.contacts(&walls, &robot, &pose)?;
        println!("the meshes touch: {} pairs of triangles, the first {:?}", contacts.len(), contacts[0]);
    } else {
        let nearest = querier.distance(&walls, &robot, &pose)?;
        println!("the meshes are {} apart", nearest.distance);
        println!("  between triangle {} at {:?}", nearest.triangle_a, nearest.point_a);
        println!("  and triangle {} at {:?}", nearest.triangle_b, nearest.point_b);
    }
    Ok(())
}

/// Opens a `.cbvh` file, or bakes a mesh file in memory.
fn open(path: &Path) -> Result<Bvh, Box<dyn Error>> {
    if path.extension().is_some_and(|extension| extension == "cbvh") {
        // Large files are better mapped than copied, with `unsafe { Bvh::map(path)? }`: nobody may change them meanwhile.
        return Ok(Bvh::read(path)?);
    }
    let mesh = bvh_bake::read_meshes(&[path.to_owned()])?;
    let (bytes, _) = bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?;
    Ok(Bvh::from_bytes(bytes)?)
}
