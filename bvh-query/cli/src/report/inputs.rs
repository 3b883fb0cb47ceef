//! The inputs of a report: a list of pairs, one per line, their meshes, and their files of poses or motions.

use super::{Kind, ReportArguments};
use crate::asking::files::{read_text, require_regular};
use crate::asking::mesh::{self, bake_in_memory, is_baked, refuse_scene, triangles};
use crate::console::Failure;
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeReport, Options};
use bvh_format::validate::validate;
use bvh_query::Bvh;
use std::path::{Path, PathBuf};

/// A pair of meshes and the files of what to ask about.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pair {
    pub(super) name: String,
    pub(super) a: PathBuf,
    /// The mesh that is placed or moved.
    pub(super) b: PathBuf,
    /// Files of poses or of motions; if there are none, some are made.
    pub(super) files: Vec<PathBuf>,
}

/// A pair with its items, of which there may be none, and its meshes.
pub(super) type Input<T> = (Pair, Vec<T>, [Mesh; 2]);

/// Reads the list, and what it names. `files` are further files of items for all pairs.
pub(super) fn read<T>(
    arguments: &ReportArguments,
    kind: &Kind<T>,
    files: Option<&str>,
) -> Result<Vec<Input<T>>, Failure> {
    let list: &Path = &arguments.pairs;
    let bytes = read_text(list)?;
    let pairs = parse(&bytes, list, arguments.meshes.as_deref(), files)
        .map_err(|error| Failure::invalid(list, error))?;
    let items = |pair: &Pair| -> Result<Vec<T>, Failure> {
        let mut items = Vec::new();
        for file in &pair.files {
            require_regular(file)?;
            items.extend((kind.read)(file)?);
        }
        Ok(items)
    };
    // Files of items are small, so that they come before the meshes of all pairs.
    let given = pairs.iter().map(items).collect::<Result<Vec<_>, _>>()?;
    let with_meshes = pairs.into_iter().zip(given).map(|(pair, given)| {
        let meshes = [read_mesh(&pair.a)?, read_mesh(&pair.b)?];
        Ok((pair, given, meshes))
    });
    with_meshes.collect()
}

/// The form of a line, for messages.
const LINE: &str = "NAME A B [FILE[,FILE...]]";

/// Parses the list in the file `list`, whose content is `bytes`. Meshes are in the folder `meshes`, by default that of
/// the list. `files` names further files for all pairs, separated by commas, in which `%s` stands for the pair's name.
fn parse(bytes: &[u8], list: &Path, meshes: Option<&Path>, files: Option<&str>) -> Result<Vec<Pair>, String> {
    let beside = list.parent().unwrap_or(Path::new(""));
    let meshes = meshes.unwrap_or(beside);
    let split = |text: &str| -> Vec<String> {
        text.split(',').filter(|file| !file.is_empty()).map(str::to_owned).collect()
    };
    let mut pairs: Vec<Pair> = Vec::new();
    for (number, line) in (1..).zip(String::from_utf8_lossy(bytes).lines()) {
        let wrong = |text: String| format!("line {number}: {text}");
        let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
        let (name, a, b) = match words[..] {
            [] => continue,
            [name, a, b] | [name, a, b, _] => (name, a, b),
            _ => return Err(wrong(format!("expected {LINE}, found {} words", words.len()))),
        };
        if pairs.iter().any(|pair| pair.name == name) {
            return Err(wrong(format!("expected a name that no other pair has, found {name:?} again")));
        }
        let listed = words.get(3).map(|files| split(files)).unwrap_or_default();
        let given = files.map(split).unwrap_or_default();
        let files = listed.iter().map(|file| beside.join(file));
        let files = files.chain(given.iter().map(|file| file.replace("%s", name).into())).collect();
        pairs.push(Pair { name: name.to_owned(), a: meshes.join(a), b: meshes.join(b), files });
    }
    if pairs.is_empty() { Err(format!("expected lines {LINE}, found none")) } else { Ok(pairs) }
}

/// Returns the mesh of a file, all its objects as one.
fn read_mesh(path: &Path) -> Result<Mesh, Failure> {
    require_regular(path)?;
    if is_baked(path)? {
        return unbaked(path);
    }
    Ok(mesh::read_mesh(path)?.merged())
}

/// Returns the triangles of a `.cbvh` file in the order of their ids, or in the order of the file if it has no ids. The
/// file stores only one of several exact duplicates, so the others are missing.
fn unbaked(path: &Path) -> Result<Mesh, Failure> {
    let bvh = crate::process::map(path, bvh_query::ReadAhead::Usual)?;
    refuse_scene(path, &bvh)?;
    validate(bvh.bytes()).map_err(|error| Failure::invalid(path, error))?;
    let mut triangles: Vec<_> = bvh.objects().iter().flat_map(|object| triangles(&bvh, object)).collect();
    if bvh.layout().has_ids() {
        triangles.sort_by_key(|&(id, _)| id);
    }
    let positions: Vec<[f64; 3]> = triangles.iter().flat_map(|&(_, corners)| corners).collect();
    let numbers = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Ok(Mesh::from_triangles(positions, numbers))
}

/// A baked mesh, and the report of the bake.
pub(super) type Baked = (Bvh, BakeReport);

/// Bakes both meshes of a pair. If it is a mesh and itself, the second is the first.
pub(super) fn bake_both(pair: &Pair, [a, b]: &[Mesh; 2], options: &Options) -> Result<[Baked; 2], Failure> {
    let baked_a = bake(&pair.a, a, options)?;
    let baked_b = if pair.a == pair.b { baked_a.clone() } else { bake(&pair.b, b, options)? };
    Ok([baked_a, baked_b])
}

/// Bakes the mesh of a file, and checks all pages, so that no timed query pays for the first touch of one.
fn bake(path: &Path, mesh: &Mesh, options: &Options) -> Result<Baked, Failure> {
    let baked = bake_in_memory(path, mesh, options)?;
    baked.0.validate().map_err(|error| Failure::invalid(path, error))?;
    Ok(baked)
}
