//! The provenance text of a file: where its mesh came from, and whether a bake would give it again.

use crate::io::{self, Input, MeshFormat, ReadError};
use crate::options::Options;
use crate::progress::Progress;
use crate::summary::FileSummary;
use crate::target::Source;
use bvh_format::Layout;
use bvh_format::checksum::checksum;
use bvh_format::header::{MAJOR, MINOR, SectionKind};
use bvh_format::source::Source as _;
use bvh_format::validate::check_sections;
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Raised whenever a bake of the same mesh with the same options gives other bytes, so that files of
/// an earlier revision do not count as up to date.
const REVISION: u32 = 3;

/// What tells whether an input is still as it was.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Checksums {
    /// Of its bytes.
    pub(crate) file: u64,
    /// Of the mesh, where the bytes do not tell all: a glTF file may name others.
    pub(crate) mesh: Option<u64>,
}

/// The lines `key=value` of the provenance section.
pub(super) struct Provenance {
    /// Names of the input files, for people.
    input: String,
    /// What a bake's result depends on, as lines.
    stamp: Vec<(&'static str, String)>,
}

impl Provenance {
    pub(super) fn new(inputs: &[PathBuf], options: &Options, checksums: &[Checksums]) -> Self {
        // Directories say more of the machine than of the mesh.
        let name = |path: &PathBuf| path.file_name().map(|name| plain(&name.to_string_lossy()));
        let names: Vec<String> = inputs.iter().filter_map(name).collect();
        let generator = format!("cbvh {}, revision {REVISION}", env!("CARGO_PKG_VERSION"));
        let files: Vec<u64> = checksums.iter().map(|checksums| checksums.file).collect();
        let input = format!("{:016x}", joined(&files));
        let mut stamp = vec![("generator", generator), ("options", options.stamp()), ("input_xxh3", input)];
        let meshes: Vec<u64> = checksums.iter().filter_map(|checksums| checksums.mesh).collect();
        if !meshes.is_empty() {
            stamp.push(("mesh_xxh3", format!("{:016x}", joined(&meshes))));
        }
        Self { input: names.join(", "), stamp }
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

impl Checksums {
    /// Reads a file for nothing else; that is no part of the work that progress is counted in.
    pub(super) fn of_file(path: &Path, format: MeshFormat, progress: &Progress) -> Result<Self, ReadError> {
        if format == MeshFormat::Gltf {
            return Ok(io::read_gltf(path, progress, 0)?.1);
        }
        let file = file_checksum(path, progress);
        let file = file.map_err(|source| ReadError::Io { path: path.to_owned(), source })?;
        Ok(Self { file, mesh: None })
    }
}

fn file_checksum(path: &Path, progress: &Progress) -> std::io::Result<u64> {
    let checksum = OnceLock::new();
    let file = Input::open(path, progress, 0)?.with_checksum(&checksum);
    std::io::copy(&mut BufReader::with_capacity(READ_BYTES, file), &mut std::io::sink())?;
    checksum.into_inner().ok_or_else(|| ErrorKind::UnexpectedEof.into())
}
