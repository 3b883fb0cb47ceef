//! Bakes mesh files into one `.cbvh` file, and prints what came out.
//!
//! ```sh
//! cargo run --release --example bake -- rock.obj --output rock.cbvh --max-memory 512
//! ```
//!
//! `--max-memory` is in MiB; without it the bake takes what it needs. Without arguments, the program bakes a mesh of the
//! folder `testdata` of the workspace to a file in the temporary folder.
#![allow(clippy::print_stdout, reason = "a program prints what came out")]

use bvh_bake::{FileBake, Outcome};
use std::path::PathBuf;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut inputs = Vec::new();
    let (mut output, mut max_memory) = (None, None);
    let mut arguments = std::env::args_os().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or("expected a value behind the option, found none");
        match argument.to_str() {
            Some("--output") => output = Some(PathBuf::from(value()?)),
            Some("--max-memory") => max_memory = Some(value()?.to_string_lossy().parse::<u64>()? << 20),
            _ => inputs.push(PathBuf::from(argument)),
        }
    }
    if inputs.is_empty() {
        inputs.push("testdata/fclenv.obj".into());
    }
    let output = output.unwrap_or_else(|| std::env::temp_dir().join("example.cbvh"));
    let start = Instant::now();
    match FileBake::new(inputs, &output).max_memory(max_memory).run()? {
        Outcome::Baked(report) => {
            println!(
                "{} triangles in {} bytes: {}",
                report.file.triangles, report.file.file_bytes, report.reason
            );
            println!("content {:016x}, {:.3} s", report.file.content_xxh3, start.elapsed().as_secs_f64());
        }
        Outcome::UpToDate(_) => println!("{} is up to date", output.display()),
    }
    Ok(())
}
