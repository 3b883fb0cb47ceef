//! The provenance text of a file: where its mesh came from, and whether a bake would give it again.

use crate::io::Input;
use crate::options::Options;
use crate::progress::Progress;
use crate::summary::FileSummary;
use crate::target::Source;
use bvh_format::Layout;
use bvh_format::checksum::{Hasher, checksum};
use bvh_format::header::{MAJOR, MINOR, SectionKind};
use bvh_format::source::Source as _;
use bvh_format::validate::check_sections;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Raised whenever a bake of the same mesh with the same options gives other bytes, so that files of
/// an earlier revision do not count as up to date.
const REVISION: u32 = 3;

/// The lines `key=value` of the provenance section.
pub(super) struct Provenance {
    /// Names of the input files, for people.
    input: String,
    /// What a bake's result depends on, as lines.
    stamp: Vec<(&'static str, String)>,
}

impl Provenance {
    pub(super) fn new(inputs: &[PathBuf], options: &Options) -> Self {
        // Directories say more of the machine than of the mesh.
        let name = |path: &PathBuf| path.file_name().map(|name| plain(&name.to_string_lossy()));
        let names: Vec<String> = inputs.iter().filter_map(name).collect();
        let generator = format!("cbvh {}, revision {REVISION}", env!("CARGO_PKG_VERSION"));
        let stamp = vec![("generator", generator), ("options", options.stamp())];
        Self { input: names.join(", "), stamp }
    }

    /// Notes the checksums of the inputs' bytes, and of the meshes of those whose bytes do not tell all.
    pub(super) fn with(mut self, files: &[u64], meshes: &[u64]) -> Self {
        self.stamp.push(("input_xxh3", format!("{:016x}", joined(files))));
        if !meshes.is_empty() {
            self.stamp.push(("mesh_xxh3", format!("{:016x}", joined(meshes))));
        }
        self
    }

    pub(super) fn to_text(&self) -> String {
        let mut text = format!("input={}\n", self.input);
        self.stamp.iter().for_each(|(key, value)| text.push_str(&format!("{key}={value}\n")));
        text
    }

    /// True if a provenance text has all lines of the stamp and no other checksum.
    fn matches(&self, text: &str) -> bool {
        let found = |key: &str| {
            text.lines().filter_map(|line| line.split_once('=')).find(|(k, _)| *k == key).map(|(_, v)| v)
        };
        self.stamp.iter().all(|(key, value)| found(key) == Some(value))
            && (found("mesh_xxh3").is_none() || self.stamp.iter().any(|(key, _)| *key == "mesh_xxh3"))
    }
}

/// One input's checksum is its own; of several, that of their checksums in order.
fn joined(checksums: &[u64]) -> u64 {
    match checksums {
        [one] => *one,
        several => checksum(&several.iter().flat_map(|sum| sum.to_le_bytes()).collect::<Vec<_>>()),
    }
}

/// Text without control characters: a line stays a line.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// What an existing output says of itself, if a bake with this provenance would give the same content.
pub(super) fn up_to_date(output: &Path, provenance: &Provenance, progress: &Progress) -> Option<FileSummary> {
    let file = File::open(output).ok()?;
    let length = file.metadata().ok()?.len();
    let source = Source::File { file: &file, path: output, length, progress };
    let layout = Layout::read_from(&source).ok()?;
    let section = layout.sections.iter().find(|section| section.kind == SectionKind::Provenance)?;
    // Those that are baked here are short.
    let range = section.range.start..section.range.end.min(section.range.start + MOST_TEXT);
    let text = source.read(range).ok()?;
    let same = layout.version == (MAJOR, MINOR) && provenance.matches(std::str::from_utf8(&text).ok()?);
    // A damaged file is baked again.
    (same && check_sections(&layout, &source).is_ok()).then(|| FileSummary::new(&layout, length))
}

/// The most bytes of a provenance text that are read.
const MOST_TEXT: usize = 1 << 20;
/// Bytes that are read at a time.
const READ_BYTES: usize = 1 << 20;

/// The checksum of a file's bytes, which are not kept. Reading them is a pass of so much weight.
pub(super) fn file_checksum(path: &Path, progress: &Progress, weight: u64) -> io::Result<u64> {
    let mut file = Input::open(path, progress, weight)?;
    let (mut hasher, mut bytes) = (Hasher::default(), vec![0; READ_BYTES]);
    loop {
        match file.read(&mut bytes) {
            Ok(0) => return Ok(hasher.finish()),
            Ok(count) => hasher.update(&bytes[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}
