//! Reads what experiments on pairs of meshes take: lists of pairs, poses, and meshes, which it bakes.

use crate::Failure;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_query::{Bvh, Pose};
use cbvh_measure::pairs::{self, Pair};
use std::fs;
use std::path::Path;

/// Reads a list of pairs; see [`pairs::parse`].
pub(crate) fn pairs(list: &Path, meshes: Option<&Path>, poses: Option<&str>) -> Result<Vec<Pair>, Failure> {
    let bytes = fs::read(list).map_err(|error| in_file(list, error))?;
    Ok(pairs::parse(&bytes, list, meshes, poses).map_err(|error| in_file(list, error))?)
}

/// Reads a mesh; its objects become one.
pub(crate) fn mesh(path: &Path) -> Result<Mesh, Failure> {
    Ok(bvh_bake::input::read(path)?.merged())
}

/// Bakes a mesh and checks all pages, so that no query does.
pub(crate) fn bake(mesh: &Mesh, options: &Options) -> Result<Bvh, Failure> {
    let bvh = Bvh::from_bytes(to_bytes(mesh, options)?.0)?;
    bvh.validate()?;
    Ok(bvh)
}

/// Reads 12 numbers per line, the rows of a 3 by 4 matrix; `#` starts a comment.
pub(crate) fn poses(path: &Path) -> Result<Vec<Pose>, Failure> {
    let text = fs::read_to_string(path).map_err(|error| in_file(path, error))?;
    let mut poses = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let numbers = words.iter().map(|word| word.parse()).collect::<Result<Vec<f64>, _>>()?;
        let wrong =
            |found: &str| in_file(path, format!("line {}: expected 12 numbers, found {found}", number + 1));
        let rows: [f64; 12] = numbers.try_into().map_err(|_| wrong(&words.len().to_string()))?;
        poses.push(Pose::from_rows(&rows).map_err(|error| wrong(&error.to_string()))?);
    }
    Ok(poses)
}

fn in_file(path: &Path, error: impl std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}
