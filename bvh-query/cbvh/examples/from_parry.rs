//! A parry user's queries: contact and distance of two meshes, a ray, and whether a point is inside.
//!
//! ```text
//! cargo run --release --example from_parry
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

// ANCHOR: program
use cbvh::bake::{Options, mesh::Mesh, to_bytes};
use cbvh::{Bvh, Pose, Querier, Ray, Side};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let mesh = Bvh::from_bytes(to_bytes(&Mesh::from_triangles(corners, faces), &Options::default())?.0)?;
    let mut querier = Querier::new()?;
    for x in [0.5, 1.0, 1.5] {
        let pose = Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0])?; // of B in the frame of A
        let touching = querier.collide(&mesh, &mesh, &pose)?;
        println!("x = {x}: {touching}, distance {}", querier.distance(&mesh, &mesh, &pose)?.distance);
    }
    let ray = Ray::new([0.1, 0.1, 2.0], [0.0, 0.0, -1.0]);
    println!("hit at {:?}", querier.first_hit(&mesh, &ray)?.map(|hit| hit.t));
    println!("inside: {}", querier.side(&mesh, [0.1, 0.1, 0.1])? == Side::Inside);
    Ok(())
}
// ANCHOR_END: program
