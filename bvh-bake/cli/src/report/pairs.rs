//! Reads the list of pairs: a name, two meshes and, if there are any, files of poses, one pair a line.

use crate::error::Failure;
use std::path::{Path, PathBuf};

/// A pair of meshes and where they are to be placed.
#[derive(Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) name: String,
    pub(super) a: PathBuf,
    pub(super) b: PathBuf,
    /// Files of poses; if there are none, poses are made up.
    pub(super) poses: Vec<PathBuf>,
}

/// Reads a list. `meshes` is the folder of the meshes, if it is not that of the list; `poses` are names of files
/// of poses for all pairs, in which `%s` stands for the pair's name.
pub(super) fn read(list: &Path, meshes: Option<&Path>, poses: Option<&str>) -> Result<Vec<Pair>, Failure> {
    let bytes = std::fs::read(list).map_err(|error| Failure::from_input(list, &error))?;
    let beside = list.parent().unwrap_or(Path::new(""));
    let meshes = meshes.unwrap_or(beside);
    let mut pairs: Vec<Pair> = Vec::new();
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let wrong = |text: &str| Failure::invalid(list, format_args!("line {}: {text}", number + 1));
        let line = String::from_utf8_lossy(line);
        let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
        let (name, a, b) = match words[..] {
            [] => continue,
            [name, a, b] | [name, a, b, _] => (name, a, b),
            _ => {
                let count = words.len();
                return Err(wrong(&format!("expected NAME A B [POSES[,POSES...]], found {count} words")));
            }
        };
        if pairs.iter().any(|pair| pair.name == name) {
            return Err(wrong(&format!("expected a name of its own, found {name:?} again")));
        }
        let split = |text: &str| -> Vec<String> {
            text.split(',').filter(|file| !file.is_empty()).map(str::to_owned).collect()
        };
        let listed = words.get(3).map(|files| split(files)).unwrap_or_default();
        let mut files: Vec<PathBuf> = listed.iter().map(|file| beside.join(file)).collect();
        let given = poses.map(split).unwrap_or_default();
        files.extend(given.iter().map(|file| PathBuf::from(file.replace("%s", name))));
        pairs.push(Pair { name: name.to_owned(), a: meshes.join(a), b: meshes.join(b), poses: files });
    }
    if pairs.is_empty() {
        return Err(Failure::invalid(list, "expected lines NAME A B [POSES[,POSES...]], found none"));
    }
    Ok(pairs)
}
