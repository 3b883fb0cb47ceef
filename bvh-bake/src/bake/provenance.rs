//! Writes and compares the provenance text of a file: the origin of its mesh, and what a repeated bake depends on.

use crate::bake::report::FileSummary;
use crate::check::provenance::{text_of, value_of};
use crate::input::{self, Checksums};
use crate::options::Options;
use crate::progress::Progress;
use crate::storage::output::OutputSource;
use bvh_format::Layout;
use bvh_format::checksum::checksum;
use bvh_format::header::{MAJOR, MINOR};
use bvh_format::validate::check_sections;
use std::fs::File;
use std::path::{Path, PathBuf};

/// The revision of the baker. It is raised whenever a bake of the same file with the same options gives other bytes or an
/// error, so that files of an earlier revision do not count as up to date.
const REVISION: u32 = 11;

/// Returns the name of this baker, its version and its revision, as files state them. Bakes of equal meshes with equal options
/// ([`Options::stamp`]) by bakers of the same name have the same bytes, so that all three make the key of a cache.
pub fn generator() -> String {
    format!("cbvh {}, revision {REVISION}", env!("CARGO_PKG_VERSION"))
}

/// The lines `key=value` of the provenance section.
pub(super) struct Provenance {
    /// The names of the input files, for people.
    input: String,
    /// The values that the result of a bake depends on, as lines.
    stamp: Vec<(&'static str, String)>,
}

impl Provenance {
    pub(super) fn new(inputs: &[PathBuf], options: &Options, checksums: &[Checksums]) -> Self {
        // Directories describe the machine rather than the mesh.
        let name = |path: &PathBuf| path.file_name().map(|name| plain(&name.to_string_lossy()));
        let names: Vec<String> = inputs.iter().filter_map(name).collect();
        let files: Vec<u64> = checksums.iter().map(|checksums| checksums.file).collect();
        let input = format!("{:016x}", joined(&files));
        let mut stamp = vec![("generator", generator()), ("options", options.stamp()), ("input_xxh3", input)];
        let meshes: Vec<u64> = checksums.iter().filter_map(|checksums| checksums.mesh).collect();
        if !meshes.is_empty() {
            stamp.push(("mesh_xxh3", format!("{:016x}", joined(&meshes))));
        }
        if options.split_objects || options.scene {
            // Objects without a name are named after their files.
            let stems: Vec<String> = inputs.iter().map(|file| plain(&input::stem(file))).collect();
            stamp.push(("names", stems.join(", ")));
        }
        Self { input: names.join(", "), stamp }
    }

    pub(super) fn to_text(&self) -> String {
        let mut text = format!("input={}\n", self.input);
        self.stamp.iter().for_each(|(key, value)| text.push_str(&format!("{key}={value}\n")));
        text
    }

    /// Returns true if a provenance text has all lines of the stamp and no other checksum.
    fn matches(&self, text: &str) -> bool {
        self.stamp.iter().all(|(key, value)| value_of(text, key) == Some(value))
            && (value_of(text, "mesh_xxh3").is_none()
                || self.stamp.iter().any(|(key, _)| *key == "mesh_xxh3"))
    }
}

/// Returns the checksum of a single input, or the checksum of the checksums of several inputs in order.
fn joined(checksums: &[u64]) -> u64 {
    match checksums {
        [one] => *one,
        several => checksum(&several.iter().flat_map(|sum| sum.to_le_bytes()).collect::<Vec<_>>()),
    }
}

/// Replaces control characters, so that a line stays a line.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// Returns the summary of an existing output if a bake with this provenance would give the same content.
pub(super) fn up_to_date(output: &Path, provenance: &Provenance, progress: &Progress) -> Option<FileSummary> {
    let file = File::open(output).ok()?;
    let length = file.metadata().ok()?.len();
    let source = OutputSource::File { file: &file, path: output, length, progress };
    let layout = Layout::read_from(&source).ok()?;
    let text = text_of(&layout, &source).ok()??;
    let same = layout.version == (MAJOR, MINOR) && provenance.matches(&text);
    // A damaged file is baked again.
    if !same || check_sections(&layout, &source).is_err() {
        return None;
    }
    let instances = layout.read_instances(&source).ok()?.len() as u64;
    let topology = layout.read_topology(&source).ok()?;
    Some(FileSummary::new(&layout, length, instances, &topology))
}
