//! Bakes a mesh from a build script.

use crate::bake::files::{FileBake, Outcome};
use crate::error::BakeError;
use std::path::{Path, PathBuf};

/// Bakes a mesh file into the directory of a build script's outputs, with default options, and tells
/// Cargo to run the script again when the mesh changes, and the warnings of the bake. Returns the path of the baked file.
///
/// In `build.rs`:
///
/// ```no_run
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     bvh_bake::build_rs::bake("assets/rock.obj", "rock.cbvh")?;
///     Ok(())
/// }
/// ```
///
/// In the program, `include_bytes!(concat!(env!("OUT_DIR"), "/rock.cbvh"))` gives the bytes. For a glTF file, Cargo
/// watches only the file itself, not the buffers that it names.
///
/// # Errors
/// [`BakeError::NoOutDir`] outside a build script, and the errors of [`FileBake::run`].
pub fn bake(input: impl AsRef<Path>, output_name: impl AsRef<Path>) -> Result<PathBuf, BakeError> {
    let input = input.as_ref();
    tell_cargo(&format!("rerun-if-changed={}", input.display()));
    let directory = std::env::var_os("OUT_DIR").ok_or(BakeError::NoOutDir)?;
    let output = Path::new(&directory).join(output_name);
    if let Outcome::Baked(report) = FileBake::new([input], &output).run()? {
        report.warnings.iter().for_each(|warning| tell_cargo(&format!("warning={warning}")));
    }
    Ok(output)
}

#[allow(clippy::print_stdout, reason = "a build script speaks to Cargo by printing lines")]
fn tell_cargo(line: &str) {
    println!("cargo:{line}");
}
