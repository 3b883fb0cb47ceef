//! Lists of assets: manifests, with one JSON object per line, and folders of meshes. Each asset is a mesh file with an output
//! that no other asset has.

use super::journal;
use crate::asking::files::{each_json_line, files_below, place, refuse_overwriting};
use crate::console::Failure;
use crate::{bake, options};
use bvh_bake::Options;
use bvh_bake::input::MeshFormat;
use bvh_format::leaf::TriangleEncoding;
use serde::Deserialize;
use std::collections::HashMap;
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
            "{}: expected a list of assets that fits into {budget} bytes of memory, found a longer one; raise --max-memory or \
             split the list",
            list.display()
        ))),
        _ => Ok(()),
    }
}

/// Refuses two assets with the same output, and outputs that are an input, the manifest or the output manifest.
pub(super) fn refuse_shared_outputs(
    assets: &[Asset],
    manifest: Option<&Path>,
    results: Option<&Path>,
) -> Result<(), Failure> {
    // What is at a place: the manifest, the output manifest, or the output of an asset.
    let mut taken: HashMap<PathBuf, Result<&Asset, &str>> = HashMap::new();
    for (path, what) in [(manifest, "the manifest"), (results, "the output manifest")] {
        let Some(path) = path else { continue };
        if taken.insert(place(path), Err(what)).is_some() {
            let path = path.display();
            return Err(Failure::Usage(format!(
                "{path}: expected an output manifest other than the manifest"
            )));
        }
    }
    let label = |asset: &Asset| format!("asset {} ({})", asset.line, asset.input.display());
    for asset in assets {
        if let Some(other) = taken.insert(place(&asset.output), Ok(asset)) {
            let other = other.map_or_else(str::to_owned, label);
            let what = format!(
                "expected an output of one asset only, found it used by {other} and by {}",
                label(asset)
            );
            return Err(Failure::invalid(&asset.output, what));
        }
    }
    for asset in assets {
        // The bake refuses an asset that is its own output, and the others go on.
        let writer = taken.get(&place(&asset.input)).and_then(|of| of.ok());
        if let Some(other) = writer.filter(|other| other.line != asset.line) {
            let (other, line) = (label(other), asset.line);
            let what = format!("found the output of {other}, as the input of asset {line}");
            let what = format!("expected an input that no asset writes, {what}");
            return Err(Failure::invalid(&asset.input, what));
        }
    }
    let inputs = assets.iter().map(|asset| &*asset.input).chain(manifest);
    let results = results.map(|path| [path.to_owned(), journal::part(path)]);
    refuse_overwriting(results.iter().flatten(), inputs)
}

/// A line. The command line gives the defaults of its options.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    input: String,
    output: String,
    profile: Option<String>,
    triangles: Option<String>,
    max_error: Option<f64>,
    round: Option<String>,
    weld: Option<f64>,
    effort: Option<String>,
    split_objects: Option<bool>,
    scene: Option<bool>,
    drop_nan: Option<bool>,
    ids: Option<bool>,
    topology: Option<bool>,
    radius: Option<f64>,
    solid: Option<bool>,
}

/// Returns all assets of a manifest, in order. Paths are relative to its folder. Empty lines are skipped, but counted.
pub(super) fn read_manifest(
    manifest: &Path,
    options: &Options,
    max_memory: Option<u64>,
) -> Result<Vec<Asset>, Failure> {
    let folder = manifest.parent().unwrap_or(Path::new(""));
    let (mut assets, mut known) = (Vec::new(), 0);
    let expected = "a JSON object with input, output and options";
    each_json_line(manifest, expected, |number, line: Line| {
        let wrong = |what: String| Failure::invalid(manifest, format_args!("line {number}: {what}"));
        let options = line.options(options).map_err(wrong)?;
        let place = |name: &str| match name {
            "" => Err(wrong("expected the name of a file, found an empty one".into())),
            name => Ok(folder.join(name)),
        };
        let (input, output): (PathBuf, PathBuf) = (place(&line.input)?, place(&line.output)?);
        let (named_input, named_output) = (line.input, line.output);
        let asset = Asset { line: number, input, output, named_input, named_output, options };
        known += asset.bytes();
        require_memory(manifest, known, max_memory)?;
        assets.push(asset);
        Ok(())
    })?;
    Ok(assets)
}

/// Parses the choice that a field names.
fn choice<T>(field: &str, name: &str, parse: fn(&str) -> Result<T, String>) -> Result<T, String> {
    parse(name).map_err(|expected| format!("{field}: {expected}, found {name:?}"))
}

impl Line {
    fn options(&self, defaults: &Options) -> Result<Options, String> {
        let mut options = defaults.clone();
        if let Some(name) = &self.profile {
            options.profile = choice("profile", name, options::profile)?;
        }
        if let Some(name) = &self.triangles {
            options.triangles = choice("triangles", name, options::triangles)?;
        }
        if let Some(name) = &self.round {
            options.round = choice("round", name, options::rounding)?;
        }
        if let Some(name) = &self.effort {
            options.effort = choice("effort", name, bake::effort)?;
        }
        let is_quantized = options.triangles == Some(TriangleEncoding::Quantized);
        match self.max_error {
            Some(length) if !(length.is_finite() && length > 0.0) => {
                return Err(format!("max_error: expected a finite number above 0, found {length}"));
            }
            Some(_) if !is_quantized => {
                return Err(
                    "max_error: expected \"triangles\": \"quantized\", found another encoding".to_owned()
                );
            }
            Some(length) => options.max_error = Some(length),
            None if !is_quantized => options.max_error = None,
            None => {}
        }
        options.weld = self.weld.unwrap_or(options.weld);
        options.split_objects = self.split_objects.unwrap_or(options.split_objects);
        options.scene = self.scene.unwrap_or(options.scene);
        options.drop_nan = self.drop_nan.unwrap_or(options.drop_nan);
        options.ids = self.ids.unwrap_or(options.ids);
        options.topology = self.topology.unwrap_or(options.topology);
        options.radius = self.radius.unwrap_or(options.radius);
        options.solid = self.solid.unwrap_or(options.solid);
        Ok(options)
    }
}

/// Returns all files with the extension of a mesh, sorted by path.
pub(super) fn read_folder(
    folder: &Path,
    output: &Path,
    options: &Options,
    max_memory: Option<u64>,
) -> Result<Vec<Asset>, Failure> {
    if output.exists() && !output.is_dir() {
        let output = output.display();
        return Err(Failure::Usage(format!("{output}: expected a folder, existing or new, found a file")));
    }
    let inputs = files_below(folder, |path| MeshFormat::from_extension(path).is_some())?;
    if inputs.is_empty() {
        // Most likely the name is wrong, so that this counts as a missing file.
        let what = "expected a mesh or a folder with files named .obj, .stl, .ply, .gltf, .glb, .dae, .xyz or .pcd, found none";
        return Err(Failure::system(folder, what));
    }
    let below: Vec<&Path> = inputs.iter().map(|input| input.strip_prefix(folder).unwrap_or(input)).collect();
    let outputs: Vec<PathBuf> = distinct_outputs(&below).iter().map(|below| output.join(below)).collect();
    let asset = |(line, (input, output)): (u64, (PathBuf, PathBuf))| {
        let [named_input, named_output] = [&input, &output].map(|path| path.display().to_string());
        Asset { line, input, output, named_input, named_output, options: options.clone() }
    };
    let mut known = 0;
    let assets = (1..).zip(inputs.into_iter().zip(outputs)).map(asset).map(|asset| {
        known += asset.bytes();
        require_memory(folder, known, max_memory).map(|()| asset)
    });
    assets.collect()
}

/// Returns an output for each input of a folder: `part.cbvh` for `part.obj`, or `part.obj.cbvh` where another input would
/// have the same output. This depends on nothing but the names. The case of letters does not tell outputs apart, because
/// on some systems it does not tell files apart.
fn distinct_outputs(inputs: &[&Path]) -> Vec<PathBuf> {
    let long = |input: &Path| {
        let mut name = input.as_os_str().to_owned();
        name.push(".cbvh");
        PathBuf::from(name)
    };
    let mut outputs: Vec<PathBuf> = inputs.iter().map(|input| input.with_extension("cbvh")).collect();
    loop {
        let mut by_name: HashMap<String, Vec<usize>> = HashMap::new();
        for (number, output) in outputs.iter().enumerate() {
            by_name.entry(output.to_string_lossy().to_lowercase()).or_default().push(number);
        }
        // A long name may be the short one of a third input, which then gets its own long one.
        let shared = by_name.into_values().filter(|numbers| numbers.len() > 1).flatten();
        let to_lengthen: Vec<usize> =
            shared.filter(|&number| outputs[number] != long(inputs[number])).collect();
        if to_lengthen.is_empty() {
            return outputs;
        }
        to_lengthen.into_iter().for_each(|number| outputs[number] = long(inputs[number]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs(inputs: &[&str]) -> Vec<String> {
        let inputs: Vec<&Path> = inputs.iter().map(Path::new).collect();
        distinct_outputs(&inputs).iter().map(|path| path.display().to_string().replace('\\', "/")).collect()
    }

    #[test]
    fn only_outputs_that_clash_keep_the_extension_of_their_input() {
        let inputs = ["a/part.obj", "a/part.stl", "b/part.obj", "c.d.ply", "rock.obj"];
        let expected = ["a/part.obj.cbvh", "a/part.stl.cbvh", "b/part.cbvh", "c.d.cbvh", "rock.cbvh"];
        assert_eq!(outputs(&inputs), expected);
    }

    #[test]
    fn a_long_name_may_be_the_short_one_of_another_input() {
        let expected = ["part.obj.cbvh", "part.obj.stl.cbvh", "part.stl.cbvh"];
        assert_eq!(outputs(&["part.obj", "part.obj.stl", "part.stl"]), expected);
        assert_eq!(outputs(&["x.cbvh.stl", "x.stl"]), ["x.cbvh.cbvh", "x.cbvh"]);
    }

    #[test]
    fn the_case_of_letters_does_not_tell_outputs_apart() {
        assert_eq!(outputs(&["Part.STL", "part.obj"]), ["Part.STL.cbvh", "part.obj.cbvh"]);
        // Where there are both, the system tells them apart.
        assert_eq!(outputs(&["Part.obj", "part.obj"]), ["Part.obj.cbvh", "part.obj.cbvh"]);
    }
}
