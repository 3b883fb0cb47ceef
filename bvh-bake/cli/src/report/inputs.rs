//! Reads all that a list names before the first pair is measured, so that an error in the last one shows at once.

use super::arguments::ReportArguments;
use super::kind::Kind;
use super::source;
use crate::asking::files::require_regular;
use crate::console::Failure;
use bvh_bake::mesh::Mesh;
use cbvh_measure::pairs::{self, Pair};
use std::path::{Path, PathBuf};

/// A pair with what its files hold.
pub(super) struct Input<T> {
    pub(super) pair: Pair,
    /// Empty if the pair has no files.
    pub(super) given: Vec<T>,
    pub(super) meshes: [Mesh; 2],
}

/// Reads the list, and what it names. `files` are further files of items for all pairs.
pub(super) fn read<K: Kind>(
    arguments: &ReportArguments,
    files: Option<&str>,
) -> Result<Vec<Input<K::Item>>, Failure> {
    let list: &Path = &arguments.pairs;
    let bytes = std::fs::read(list).map_err(|error| Failure::from_input(list, &error))?;
    let pairs = pairs::parse(&bytes, list, arguments.meshes.as_deref(), files)
        .map_err(|error| Failure::invalid(list, error))?;
    // Files of items are small, so that they come before the meshes of all pairs.
    let given = pairs.iter().map(items::<K>).collect::<Result<Vec<_>, _>>()?;
    let with_meshes = pairs.into_iter().zip(given).map(|(pair, given)| {
        require_regular(&pair.a)?;
        require_regular(&pair.b)?;
        let meshes = [source::mesh(&pair.a)?, source::mesh(&pair.b)?];
        Ok(Input { pair, given, meshes })
    });
    with_meshes.collect()
}

/// Reads the files of a pair.
fn items<K: Kind>(pair: &Pair) -> Result<Vec<K::Item>, Failure> {
    let read = |file: &PathBuf| require_regular(file).and_then(|()| K::read(file));
    let read = pair.files.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    Ok(read.into_iter().flatten().collect())
}
