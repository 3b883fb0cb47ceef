//! One of many assets: a mesh file, and an output that no other asset has.

use super::shown;
use crate::console::Failure;
use bvh_bake::Options;
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// One of many bakes.
pub(super) struct Asset {
    /// Its line in the manifest, or its number in the folder, counted from 1.
    pub(super) line: u64,
    pub(super) input: PathBuf,
    pub(super) output: PathBuf,
    /// The input as the manifest names it.
    pub(super) named_input: String,
    /// The output as the manifest names it.
    pub(super) named_output: String,
    pub(super) options: Options,
}

/// The most bytes of memory per asset for what is known of it besides its paths: its options, and its line of results until
/// the end.
const BYTES_PER_ASSET: u64 = 4096;
/// The copies of its paths: as they are named, as they are opened, compared and told.
const COPIES_OF_PATHS: u64 = 4;

impl Asset {
    /// Returns the bytes of memory that the asset takes until the end.
    pub(super) fn bytes(&self) -> u64 {
        let paths = [self.input.as_os_str().len(), self.output.as_os_str().len()];
        BYTES_PER_ASSET + COPIES_OF_PATHS * paths.iter().sum::<usize>() as u64
    }
}

/// Refuses more assets than there is memory for. They take `known` bytes so far.
pub(super) fn require_memory(list: &Path, known: u64, max_memory: Option<u64>) -> Result<(), Failure> {
    match max_memory {
        Some(budget) if known > budget => Err(Failure::Limit(format!(
            "{}: expected assets that are listed in at most {budget} bytes of memory, found more; raise --max-memory, or \
             divide the list",
            shown(list)
        ))),
        _ => Ok(()),
    }
}

/// Refuses two assets with the same output, and outputs that are an input, the manifest or the output manifest.
///
/// Paths are compared after the system has resolved their folders; folders that do not exist yet contain no links.
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
    let label = |asset: &Asset| format!("asset {} ({})", asset.line, shown(&asset.input));
    let taken_by = |asset: &Asset, whose: &str| {
        let output = shown(&asset.output);
        let first = assets.iter().find(|first| format!("asset {}", first.line) == whose);
        let whose = first.map_or_else(|| whose.to_owned(), label);
        let what = format!("expected an output of its own for {}, found that of {whose}", label(asset));
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
        // The bake refuses an asset that is its own output, and the others go on.
        if whose.starts_with("asset ") && *whose != format!("asset {}", asset.line) {
            let input = shown(&asset.input);
            let what = format!("expected an input that is no output, found that of {whose}");
            return Err(Failure::Invalid(format!("{input}: {what}, as the input of asset {}", asset.line)));
        }
    }
    Ok(())
}

/// Folders as the system resolves them. Each is resolved once.
#[derive(Default)]
struct Folders {
    resolved: HashMap<PathBuf, PathBuf>,
}

impl Folders {
    /// Returns the same path for a file however it is named, except through links to the file itself.
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

/// Returns a folder without links, `.` and `..`, whether it exists or not.
fn resolve(folder: &Path) -> PathBuf {
    if let Ok(resolved) = fs::canonicalize(folder) {
        return resolved;
    }
    match (folder.parent(), folder.file_name()) {
        (Some(parent), Some(name)) => resolve(parent).join(name),
        // The path ends in `..`, and the folder above does not exist: drop its last part.
        (Some(parent), None) => resolve(parent).parent().map(Path::to_owned).unwrap_or_default(),
        (None, _) => folder.to_owned(),
    }
}
