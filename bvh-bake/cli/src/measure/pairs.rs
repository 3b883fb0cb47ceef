//! Reads a list of pairs, one per line: a name, two meshes and, optionally, files of poses or motions.

use std::path::{Path, PathBuf};

/// A pair of meshes and the files of what to ask about.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Its name in reports.
    pub name: String,
    /// The first mesh.
    pub a: PathBuf,
    /// The mesh that is placed or moved.
    pub b: PathBuf,
    /// Files of poses or of motions; if there are none, some are made.
    pub files: Vec<PathBuf>,
}

/// The form of a line, for messages.
const LINE: &str = "NAME A B [FILE[,FILE...]]";

/// Parses the list in the file `list`, whose content is `bytes`. Meshes are in the folder `meshes`, by default that of
/// the list. `files` names further files for all pairs, separated by commas, in which `%s` stands for the pair's name.
///
/// # Errors
/// Returns a message that names the line, what was expected and what was found.
pub fn parse(
    bytes: &[u8],
    list: &Path,
    meshes: Option<&Path>,
    files: Option<&str>,
) -> Result<Vec<Pair>, String> {
    let beside = list.parent().unwrap_or(Path::new(""));
    let meshes = meshes.unwrap_or(beside);
    let mut pairs: Vec<Pair> = Vec::new();
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let wrong = |text: String| format!("line {}: {text}", number + 1);
        let line = String::from_utf8_lossy(line);
        let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
        let (name, a, b) = match words[..] {
            [] => continue,
            [name, a, b] | [name, a, b, _] => (name, a, b),
            _ => return Err(wrong(format!("expected {LINE}, found {} words", words.len()))),
        };
        if pairs.iter().any(|pair| pair.name == name) {
            return Err(wrong(format!("expected a name that no other pair has, found {name:?} again")));
        }
        let split = |text: &str| -> Vec<String> {
            text.split(',').filter(|file| !file.is_empty()).map(str::to_owned).collect()
        };
        let listed = words.get(3).map(|files| split(files)).unwrap_or_default();
        let mut all: Vec<PathBuf> = listed.iter().map(|file| beside.join(file)).collect();
        let given = files.map(split).unwrap_or_default();
        all.extend(given.iter().map(|file| PathBuf::from(file.replace("%s", name))));
        pairs.push(Pair { name: name.to_owned(), a: meshes.join(a), b: meshes.join(b), files: all });
    }
    if pairs.is_empty() { Err(format!("expected lines {LINE}, found none")) } else { Ok(pairs) }
}

/// Returns at most `count` items, spread evenly over all; 0 returns all.
pub fn spread_evenly<T: Clone>(all: &[T], count: usize) -> Vec<T> {
    if count == 0 || all.len() <= count {
        return all.to_vec();
    }
    (0..count).map(|number| all[number * all.len() / count].clone()).collect()
}
