//! Finds the files that a URDF names: by relative paths, by `file://`, and by `package://` in ROS packages.

use std::path::{Path, PathBuf};

/// Returns the file that a URDF means, or the places where it was looked for.
///
/// `package://NAME/REST` is looked for in the given folders, in those of `ROS_PACKAGE_PATH`, and in the folders above the URDF
/// file, first as `NAME/REST` and then, in a folder that is called NAME itself, as `REST`. Packages that are installed with a
/// Python module, like those of example-robot-data, are above their URDF files. `model://` is the same.
pub(crate) fn find(uri: &str, urdf: &Path, folders: &[PathBuf]) -> Result<PathBuf, Vec<PathBuf>> {
    let mut tried = Vec::new();
    let mut look = |path: PathBuf| {
        let found = path.is_file();
        tried.push(path);
        found.then(|| tried[tried.len() - 1].clone())
    };
    let beside = urdf.parent().unwrap_or_else(|| Path::new(""));
    let found = match uri.strip_prefix("package://").or_else(|| uri.strip_prefix("model://")) {
        None => look(beside.join(uri.strip_prefix("file://").unwrap_or(uri))),
        Some(rest) => {
            let rest = rest.trim_start_matches('/');
            let (name, in_package) = rest.split_once('/').unwrap_or((rest, ""));
            // WebAssembly has no lists of paths, and there the standard library panics when it splits one.
            let is_list = !cfg!(target_family = "wasm");
            let listed = std::env::var_os("ROS_PACKAGE_PATH").filter(|_| is_list);
            let whole = std::path::absolute(urdf).unwrap_or_else(|_| urdf.to_owned());
            let folders = folders.iter().cloned();
            let folders = folders.chain(listed.iter().flat_map(|paths| std::env::split_paths(paths)));
            let folders = folders.chain(whole.ancestors().skip(1).map(Path::to_owned));
            folders.into_iter().find_map(|folder| {
                let itself = (folder.file_name() == Some(name.as_ref())).then(|| folder.join(in_package));
                look(folder.join(rest)).or_else(|| itself.and_then(&mut look))
            })
        }
    };
    found.ok_or(tried)
}
