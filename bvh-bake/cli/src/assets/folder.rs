//! Finds the meshes in a folder and its subfolders, and gives each an output at the same place in another folder.

use super::asset::{Asset, require_memory};
use super::shown;
use crate::console::Failure;
use bvh_bake::Options;
use bvh_bake::input::MeshFormat;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns all files with the extension of a mesh, sorted by path. Links to folders are not followed, because they may
/// form a cycle.
pub(super) fn read(
    folder: &Path,
    output: &Path,
    options: &Options,
    max_memory: Option<u64>,
) -> Result<Vec<Asset>, Failure> {
    if output.exists() && !output.is_dir() {
        return Err(Failure::Usage(format!(
            "{}: expected a folder, existing or new, found a file",
            shown(output)
        )));
    }
    let mut inputs = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let failed = |error| Failure::from_folder(&folder, &error);
        for entry in fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let path = entry.path();
            if entry.file_type().map_err(failed)?.is_dir() {
                folders.push(path);
            } else if MeshFormat::from_extension(&path).is_some() && !path.is_dir() {
                inputs.push(path);
            }
        }
    }
    if inputs.is_empty() {
        // Most likely the name is wrong, so that this counts as a missing file.
        let what = "expected a mesh or a folder with files named .obj, .stl, .ply, .gltf or .glb, found none";
        return Err(Failure::System(format!("{}: {what}", shown(folder))));
    }
    inputs.sort();
    let asset = |(line, input): (u64, PathBuf)| {
        let below = input.strip_prefix(folder).unwrap_or(&input);
        let output = output.join(below).with_extension("cbvh");
        let (named_input, named_output) = (shown(&input), shown(&output));
        Asset { line, input, output, named_input, named_output, options: options.clone() }
    };
    let mut known = 0;
    let assets = (1..).zip(inputs).map(asset).map(|asset| {
        known += asset.bytes();
        require_memory(folder, known, max_memory).map(|()| asset)
    });
    assets.collect()
}
