//! What uses what: no file of a crate uses one that uses it, directly or through others, and no folder uses one that uses it. A circle
//! can only be understood as a whole.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The sources of all crates, beside the repository's root.
const CRATES: [&str; 10] = [
    "bvh-format/src",
    "bvh-bake/src",
    "bvh-query/cli/src",
    "bvh-query/src",
    "bvh-query/cbvh/src",
    "bvh-query/robot/src",
    "bvh-query/view/src",
    "bvh-query/python/src",
    "bvh-query/capi/src",
    "bvh-query/web/src",
];

/// A file by its path in the crate, such as `page::writer`; the root of the crate is empty.
type Module = Vec<String>;

/// Returns the files of a crate, but for those of unit tests.
fn files(folder: &Path, above: &[String], found: &mut BTreeMap<Module, PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let own = [above, std::slice::from_ref(&name)].concat();
        if path.is_dir() {
            files(&path, &own, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let is_root = matches!(name.as_str(), "mod" | "lib" | "main");
            found.insert(if is_root { above.to_vec() } else { own }, path);
        }
    }
    found.retain(|module, _| !module.iter().any(|part| part == "tests"));
}

/// Returns the paths that a file names in its `use` declarations, from the root of the crate.
fn used(module: &Module, is_folder: bool, text: &str) -> Vec<Module> {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let mut all = Vec::new();
    let starts = text.match_indices("use ").filter(|(at, _)| text[..*at].ends_with(['\n', ' ']) || *at == 0);
    for (at, _) in starts {
        let Some((declared, _)) = text[at + 4..].split_once(';') else { continue };
        let (path, list) = declared.split_once('{').unwrap_or((declared, ""));
        let mut parts: Vec<String> = path.split("::").map(|part| part.trim().to_owned()).collect();
        parts.retain(|part| !part.is_empty());
        let mut base = match parts.first().map(String::as_str) {
            Some("crate") => Vec::new(),
            Some("super") if is_folder || module.is_empty() => {
                module.split_last().map_or(Vec::new(), |(_, above)| above.to_vec())
            }
            Some("super") => module[..module.len() - 1].to_vec(),
            Some("self") => module.clone(),
            _ => continue,
        };
        base.extend(parts.drain(1..));
        let names = list.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|name| !name.is_empty());
        all.extend(names.map(|name| [base.clone(), vec![name.to_owned()]].concat()));
        all.push(base);
    }
    all
}

/// Returns a circle, if there is one.
fn circle<T: Ord + Clone>(uses: &BTreeMap<T, BTreeSet<T>>) -> Option<Vec<T>> {
    fn go<T: Ord + Clone>(
        at: &T,
        uses: &BTreeMap<T, BTreeSet<T>>,
        way: &mut Vec<T>,
        done: &mut BTreeSet<T>,
    ) -> Option<Vec<T>> {
        if let Some(start) = way.iter().position(|before| before == at) {
            return Some(way[start..].to_vec());
        }
        if done.contains(at) {
            return None;
        }
        way.push(at.clone());
        let found = uses.get(at).into_iter().flatten().find_map(|next| go(next, uses, way, done));
        way.pop();
        done.insert(at.clone());
        found
    }
    let mut done = BTreeSet::new();
    uses.keys().find_map(|start| go(start, uses, &mut Vec::new(), &mut done))
}

#[test]
fn no_file_and_no_folder_uses_what_uses_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut count = 0;
    for sources in CRATES {
        let mut all = BTreeMap::new();
        files(&root.join(sources), &[], &mut all);
        let (mut uses, mut of_folders) = (BTreeMap::new(), BTreeMap::<_, BTreeSet<_>>::new());
        for (module, path) in &all {
            let is_folder = path.ends_with("mod.rs");
            let own: &mut BTreeSet<Module> = uses.entry(module.clone()).or_default();
            for mut path in used(module, is_folder, &fs::read_to_string(path).unwrap()) {
                // What a path names is in the longest part of it that is a file.
                while !path.is_empty() && !all.contains_key(&path) {
                    path.pop();
                }
                if path.is_empty() || path == *module {
                    continue;
                }
                count += 1;
                if let Some(folder) = module.first().filter(|folder| **folder != path[0]) {
                    of_folders.entry(folder.clone()).or_default().insert(path[0].clone());
                }
                own.insert(path);
            }
        }
        let named = |module: &Module| module.join("::");
        let found = circle(&uses).map(|of| of.iter().map(named).collect::<Vec<_>>());
        assert_eq!(found, None, "{sources}: files that use each other");
        assert_eq!(circle(&of_folders), None, "{sources}: folders that use each other");
    }
    assert!(count > 1000, "{count} uses");
}
