//! Finds the files that a URDF names: by relative paths, by `file://`, and by `package://` in ROS packages. Tells which files it
//! may name.
//!
//! The author of a URDF need not be its reader, so that it may not name any file of the system. Meshes are in the robot's package,
//! beside the folder of the URDF, in another package, or in a folder that the reader named.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

/// The file in the folder of a ROS package that makes it one.
const PACKAGE: &str = "package.xml";

/// A file that a URDF names.
#[derive(Debug)]
pub(crate) struct Named {
    pub(crate) path: PathBuf,
    /// Whether it is in a folder in which a URDF may name files.
    pub(crate) is_inside: bool,
}

/// Returns the file that a URDF means, or the places where it was looked for.
///
/// Paths are taken as they are, and the names of URIs are looked for as they are and then with their percent-encoding decoded:
/// Pinocchio does the former, and ROS the latter, in packages too. The host `localhost` of a `file://` URI is left out. Any other first
/// part is one of a relative path, as in Pinocchio.
///
/// `package://NAME/REST` is looked for in the given folders, in those of `ROS_PACKAGE_PATH`, and in the folders above the URDF
/// file, first as `NAME/REST` and then, in a folder that is called NAME itself, as `REST`. Packages that are installed with a
/// Python module, like those of example-robot-data, are above their URDF files. `model://` is the same.
pub(crate) fn find(uri: &str, urdf: &Path, folders: &[PathBuf]) -> Result<Named, Vec<PathBuf>> {
    let mut tried = Vec::new();
    let mut look = |path: PathBuf| {
        let found = path.is_file();
        tried.push(path);
        found.then(|| tried[tried.len() - 1].clone())
    };
    let beside = urdf.parent().unwrap_or_else(|| Path::new(""));
    // WebAssembly has no lists of paths, and there the standard library panics when it splits one.
    let is_list = !cfg!(target_family = "wasm");
    let listed = std::env::var_os("ROS_PACKAGE_PATH").filter(|_| is_list);
    let listed = listed.iter().flat_map(|paths| std::env::split_paths(paths));
    let folders = folders.iter().cloned().chain(listed).filter(|folder| !folder.as_os_str().is_empty());
    let folders: Vec<PathBuf> = folders.collect();
    let mut package = None;
    let (scheme, rest) = match uri.split_once("://") {
        Some((scheme, rest)) => (scheme.to_ascii_lowercase(), rest),
        None => (String::new(), uri),
    };
    let found = match scheme.as_str() {
        "package" | "model" => names(rest.trim_start_matches('/')).into_iter().find_map(|rest| {
            let (name, in_package) = rest.split_once('/').unwrap_or((&rest, ""));
            let whole = absolute(urdf);
            let above = whole.ancestors().skip(1).map(Path::to_owned);
            folders.iter().cloned().chain(above).find_map(|folder| {
                let is_itself = folder.file_name() == Some(OsStr::new(name));
                let found = look(folder.join(&*rest)).map(|found| (folder.join(name), found));
                let found = found.or_else(|| {
                    let itself = is_itself.then(|| folder.join(in_package)).and_then(&mut look);
                    itself.map(|found| (folder.clone(), found))
                });
                found.map(|(folder, found)| {
                    package = Some(folder);
                    found
                })
            })
        }),
        "file" => {
            // The path begins with the slash behind the host or, on Windows, with the drive behind that slash.
            let path = rest.strip_prefix("localhost").filter(|path| path.starts_with('/')).unwrap_or(rest);
            let is_drive = |path: &&str| cfg!(windows) && path.as_bytes().get(1) == Some(&b':');
            let drive = path.strip_prefix('/').filter(is_drive);
            let path = drive.unwrap_or(path);
            names(path).into_iter().find_map(|path| look(beside.join(&*path)))
        }
        _ => look(beside.join(uri)),
    };
    let path = found.ok_or(tried)?;
    let is_inside = is_inside(&path, urdf, &folders, package.as_deref());
    Ok(Named { path, is_inside })
}

/// Returns the name that a part of a URI is, and the one that it encodes if that is another one.
fn names(part: &str) -> Vec<Cow<'_, str>> {
    [Some(Cow::Borrowed(part)), decoded(part).map(Cow::Owned)].into_iter().flatten().collect()
}

/// Returns the text that a percent-encoded one stands for, if it is another one and text.
fn decoded(part: &str) -> Option<String> {
    let mut pieces = part.split('%');
    let mut bytes = pieces.next()?.as_bytes().to_vec();
    for piece in pieces {
        let byte = piece.get(..2).filter(|digits| digits.bytes().all(|digit| digit.is_ascii_hexdigit()));
        match byte.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                bytes.extend_from_slice(&piece.as_bytes()[2..]);
            }
            // A sign of its own.
            None => {
                bytes.push(b'%');
                bytes.extend_from_slice(piece.as_bytes());
            }
        }
    }
    String::from_utf8(bytes).ok().filter(|text| text != part)
}

/// Returns whether a URDF may name a file: whether the file is in a folder that the reader named, links in it included; or, after
/// links are followed, beside the URDF's folder or below, in the URDF's package, or in another package in which it was found.
fn is_inside(file: &Path, urdf: &Path, named: &[PathBuf], package: Option<&Path>) -> bool {
    let by_name = without_dots(&absolute(file));
    if named.iter().any(|folder| by_name.starts_with(without_dots(&absolute(folder)))) {
        return true;
    }
    let Ok(file) = file.canonicalize() else { return false };
    // A workspace may hold links to the files of a package, one by one: the package is then where its links lead, too.
    let mut folders: Vec<PathBuf> = [Some(absolute(urdf)), urdf.canonicalize().ok()]
        .into_iter()
        .flatten()
        .flat_map(|urdf| own_folders(&urdf))
        .collect();
    if let Some(marker) = package.map(|package| package.join(PACKAGE)).filter(|marker| marker.is_file()) {
        folders.extend(marker.canonicalize().ok().and_then(|marker| Some(marker.parent()?.to_owned())));
        folders.extend(package.map(Path::to_owned));
    }
    folders.iter().filter_map(|folder| folder.canonicalize().ok()).any(|folder| file.starts_with(folder))
}

/// Returns the folder above that of a URDF, unless it is the root of a file system, and the package that holds the URDF.
fn own_folders(urdf: &Path) -> Vec<PathBuf> {
    let Some(beside) = urdf.parent() else { return Vec::new() };
    let above = beside.parent().filter(|above| above.parent().is_some());
    let package = beside.ancestors().find(|folder| folder.join(PACKAGE).is_file());
    let package = package.filter(|package| package.parent().is_some());
    [Some(beside), above, package].into_iter().flatten().map(Path::to_owned).collect()
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Returns a path whose `..` are resolved by names alone.
fn without_dots(path: &Path) -> PathBuf {
    let mut whole = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(whole.pop()),
            part => whole.push(part),
        }
    }
    whole
}

/// Returns the folders in which a URDF may name files, for people.
pub(crate) fn folders_of(urdf: &Path, named: &[PathBuf]) -> Vec<PathBuf> {
    let mut folders = own_folders(&absolute(urdf));
    // The last ones hold the first one.
    folders.reverse();
    folders.truncate(1);
    folders.extend(named.iter().cloned());
    folders
}
