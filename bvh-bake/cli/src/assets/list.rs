//! Reads a manifest: one asset per line, as a JSON object with an input, an output and options.

use super::asset::{Asset, require_memory};
use super::shown;
use crate::bake;
use crate::console::Failure;
use crate::options;
use bvh_bake::Options;
use bvh_format::leaf::TriangleEncoding;
use serde::Deserialize;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The most bytes of a line. Paths that a system opens are much shorter.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// A line. The command line gives the defaults of its options.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    input: String,
    output: String,
    profile: Option<String>,
    triangles: Option<String>,
    max_error: Option<f64>,
    effort: Option<String>,
    split_objects: Option<bool>,
    scene: Option<bool>,
    ids: Option<bool>,
    topology: Option<bool>,
}

/// Returns all assets of a manifest, in order. Paths are relative to its folder. Empty lines are skipped, but counted.
pub(super) fn read(
    manifest: &Path,
    options: &Options,
    max_memory: Option<u64>,
) -> Result<Vec<Asset>, Failure> {
    let failed = |error| Failure::from_input(manifest, &error);
    let folder = manifest.parent().unwrap_or(Path::new(""));
    let (mut assets, mut known) = (Vec::new(), 0);
    let mut lines = BufReader::new(File::open(manifest).map_err(failed)?);
    for number in 1.. {
        let mut bytes = Vec::new();
        if lines.by_ref().take(MAX_LINE_BYTES + 1).read_until(b'\n', &mut bytes).map_err(failed)? == 0 {
            break;
        }
        bytes.pop_if(|last| *last == b'\n');
        if bytes.len() as u64 > MAX_LINE_BYTES {
            let what =
                format!("line {number}: expected at most {MAX_LINE_BYTES} bytes in a line, found more");
            return Err(Failure::Limit(format!("{}: {what}", shown(manifest))));
        }
        if bytes.trim_ascii().is_empty() {
            continue;
        }
        let wrong = |what: String| Failure::Invalid(format!("{}: line {number}: {what}", shown(manifest)));
        let line = parse(&bytes).map_err(wrong)?;
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
    }
    Ok(assets)
}

fn parse(bytes: &[u8]) -> Result<Line, String> {
    serde_json::from_slice(bytes).map_err(|error| {
        let (column, text) = (error.column(), error.to_string());
        // The parser sees one line, so that its line number is always 1.
        let text = text.split(" at line ").next().unwrap_or(&text);
        format!("column {column}: expected a JSON object with input, output and options, found: {text}")
    })
}

impl Line {
    fn options(&self, defaults: &Options) -> Result<Options, String> {
        let mut options = defaults.clone();
        let wrong =
            |field: &str, found: &str, expected: String| format!("{field}: {expected}, found {found:?}");
        if let Some(name) = &self.profile {
            options.profile =
                options::profile(name).map_err(|expected| wrong("profile", name, expected))?.named();
        }
        if let Some(name) = &self.triangles {
            options.triangles =
                options::triangles(name).map_err(|expected| wrong("triangles", name, expected))?.named();
        }
        if let Some(name) = &self.effort {
            options.effort = bake::effort(name).map_err(|expected| wrong("effort", name, expected))?;
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
        options.split_objects = self.split_objects.unwrap_or(options.split_objects);
        options.scene = self.scene.unwrap_or(options.scene);
        options.ids = self.ids.unwrap_or(options.ids);
        options.topology = self.topology.unwrap_or(options.topology);
        Ok(options)
    }
}
