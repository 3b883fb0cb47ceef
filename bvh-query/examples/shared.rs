//! Shares one mesh in memory between threads, each of which asks its own questions.
//!
//! ```text
//! cargo run --release --example shared
//! ```
//!
//! The bytes may have any owner. Here an `Arc<[u8]>` holds them; a file that is part of the program is opened by
//! `bvh_query::include_cbvh!("path.cbvh")`.
#![allow(clippy::print_stdout, reason = "a program prints its answers")]

use bvh_bake::mesh::Mesh;
use bvh_query::{Bvh, Pose, Querier};
use std::error::Error;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn Error>> {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let mesh = Mesh::from_triangles(corners, faces);
    let bytes: Arc<[u8]> = bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0.into();
    let tetrahedron = Bvh::from_bytes(bytes.clone())?;

    let gaps = [0.25, 0.5, 1.0];
    let answers: Vec<Result<bool, bvh_query::Error>> = std::thread::scope(|scope| {
        let ask = |gap: f64| {
            let tetrahedron = &tetrahedron;
            scope.spawn(move || {
                // A pose of B in A's frame: here a shift along x, past the far corner.
                let pose = Pose::new(*Pose::IDENTITY.rotation(), [1.0 + gap, 0.0, 0.0])?;
                Ok(Querier::new()?.within(tetrahedron, tetrahedron, &pose, 0.5)?)
            })
        };
        let threads = gaps.map(ask);
        threads.into_iter().map(|thread| thread.join().expect("no thread panics")).collect()
    });
    for (gap, near) in gaps.into_iter().zip(answers) {
        println!("{gap} apart: {}", if near? { "at most 0.5" } else { "more than 0.5" });
    }
    Ok(())
}
