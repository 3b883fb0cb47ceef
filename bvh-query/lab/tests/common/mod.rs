//! Runs the laboratory.

use std::path::Path;
use std::process::{Command, Output};

/// Runs `cbvh-lab` with these arguments.
pub(crate) fn lab(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cbvh-lab"));
    command.args(arguments).env_remove("CBVH_ISA").output().unwrap()
}

/// Returns the sorted names in a folder.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort_unstable();
    names
}
