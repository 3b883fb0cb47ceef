//! A mesh file and the output that it is baked into, which is nobody else's.

use super::shown;
use crate::error::Failure;
use bvh_bake::Options;
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// One of many bakes.
pub(super) struct Asset {
    /// Its line in the manifest, or its number in a folder; from 1 on.
    pub(super) line: u64,
    pub(super) input: PathBuf,
    pub(super) output: PathBuf,
    /// The input as it was named.
    pub(super) named_input: String,
    /// The output as it was named.
    pub(super) named_output: String,
    pub(super) options: Options,
}

/// Refuses two assets with one output, and outputs that are an input, the manifest or the file of results.
///
/// Names are compared as the system resolves their folders; those that are not there yet have no links in them.
pub(super) fn refuse_shared_outputs(
    assets: &[Asset],
    manifest: Option<&Path>,
    results: Option<&Path>,
) -> Result<(), Failure> {
    let mut folders = Folders::default();
    let mut taken: HashMap<PathBuf, String> = HashMap::new();
    for (path, what) in [(manifest, "the manifest"), (results, "the output manifest")] {
        let Some(path) = path else { continue };
        if taken.insert(folders.place(path), what.to_owned()).is_some() {
            return Err(Failure::Usage(format!(
                "{}: expected an output manifest other than the manifest",
                shown(path)
            )));
        }
    }
    let taken_by = |asset: &Asset, whose: &str| {
        let output = shown(&asset.output);
        let what = format!("expected an output of its own for asset {}, found that of {whose}", asset.line);
        Failure::Invalid(format!("{output}: {what}"))
    };
    for asset in assets {
        let place = folders.place(&asset.output);
        if let Some(whose) = taken.insert(place, format!("asset {}", asset.line)) {
            return Err(taken_by(asset, &whose));
        }
    }
    for asset in assets {
        let Some(whose) = taken.get(&folders.place(&asset.input)) else { continue };
        // An asset that is its own output is refused by the bake, and the others go on.
        if whose.starts_with("asset ") && *whose != format!("asset {}", asset.line) {
            let input = shown(&asset.input);
            let what = format!("expected an input that is no output, found that of {whose}");
            return Err(Failure::Invalid(format!("{input}: {what}, as the input of asset {}", asset.line)));
        }
    }
    Ok(())
}

/// Folders as the system resolves them, each asked for once.
#[derive(Default)]
struct Folders {
    resolved: HashMap<PathBuf, PathBuf>,
}

impl Folders {
    /// One path for each file, however it is named, but for links to the file itself.
    fn place(&mut self, path: &Path) -> PathBuf {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return path };
        if let Some(resolved) = self.resolved.get(folder) {
            return resolved.join(name);
        }
        let resolved = resolve(folder);
        let place = resolved.join(name);
        self.resolved.insert(folder.to_owned(), resolved);
        place
    }
}

/// A folder without links, and without `.` and `..`, whether it is there or not.
fn resolve(folder: &Path) -> PathBuf {
    if let Ok(resolved) = fs::canonicalize(folder) {
        return resolved;
    }
    match (folder.parent(), folder.file_name()) {
        (Some(parent), Some(name)) => resolve(parent).join(name),
        // It ends in `..`: back from what is above, which is not there.
        (Some(parent), None) => resolve(parent).parent().map(Path::to_owned).unwrap_or_default(),
        (None, _) => folder.to_owned(),
    }
}
