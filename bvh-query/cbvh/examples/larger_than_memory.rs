//! How is a mesh baked that is larger than memory? With a budget; the rest goes to scratch files.
//!
//! It prints:
//!
//! ```text
//! a billion triangles need at least 234 MiB
//! baked 2180 triangles
//! itself: true
//! ```
#![allow(clippy::print_stdout, reason = "a program prints its results")]

use cbvh::bake::{FileBake, Outcome, least_memory};
use cbvh::{Bvh, Pose, Querier};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("cbvh-example-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let output = folder.join("room.cbvh");

    // 64 MiB for the whole process, whatever the size of the input. The bytes of the output are those of any other budget.
    println!("a billion triangles need at least {} MiB", least_memory(1_000_000_000) >> 20);
    match FileBake::new(["testdata/fclenv.obj"], &output).max_memory(64 << 20).run()? {
        Outcome::Baked(report) => println!("baked {} triangles", report.file.triangles),
        Outcome::UpToDate(_) => println!("nothing to do"),
    }
    // SAFETY: nobody changes the file while it is mapped.
    let room = unsafe { Bvh::map(&output)? };
    println!("itself: {}", Querier::new()?.collide(&room, &room, &Pose::IDENTITY)?);
    drop(room);
    Ok(std::fs::remove_dir_all(&folder)?)
}
