//! `cbvh validate`: checks the structure and the checksums of a whole file.

use super::breach::Breach;
use crate::console::{self, Failure, hex, plural};
use crate::options::size;
use crate::process::resident;
use bvh_bake::{FileError, StoredFile, validate_in_parallel};
use bvh_format::source::Source;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

const HELP: &str = "\
Example:
  cbvh validate rock.cbvh --json

An invalid file exits with code 3. With --json, the object then has the fields rule, rule_text, offset, expected and \
found.

The file is read piece by piece, in about 10 MiB of memory whatever its size. --max-memory SIZE keeps the process \
within SIZE; a SIZE that is too small exits with code 4.";

/// What `validate` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ValidateArguments {
    /// The .cbvh file
    file: PathBuf,
    /// Stay within this much memory, such as 64MiB
    #[arg(long, value_name = "SIZE", value_parser = size, allow_negative_numbers = true)]
    max_memory: Option<u64>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Checks a file, prints what it is, and fails if it is invalid.
pub(crate) fn validate(arguments: &ValidateArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let result = StoredFile::open(path, arguments.max_memory).and_then(|file| {
        let layout = validate_in_parallel(&file)?;
        Ok((layout, file.length()))
    });
    let file = path.display().to_string();
    match result {
        Ok((layout, bytes)) => {
            let records = || layout.objects.iter().map(|object| object.record());
            let valid = Valid {
                file,
                valid: true,
                format_version: bvh_format::header::version_name(layout.version),
                objects: layout.objects.len() as u64,
                pages: layout.page_count(),
                treelets: records().map(|record| record.treelets.get()).sum(),
                triangles: records().map(|record| record.triangles.get()).sum(),
                file_bytes: bytes,
                content_xxh3: hex(layout.content_checksum),
                peak_rss_bytes: resident::peak_bytes(),
            };
            if arguments.json { console::json(&valid) } else { console::text(&valid.to_text()) }
        }
        Err(FileError::Format(error)) => {
            if arguments.json {
                console::json(&Invalid { file, valid: false, breach: Breach::new(&error) })?;
            }
            Err(Failure::invalid(path, error))
        }
        Err(error) => Err(Failure::from_file(path, error)),
    }
}

#[derive(Serialize)]
struct Valid {
    file: String,
    valid: bool,
    format_version: String,
    objects: u64,
    pages: u32,
    treelets: u64,
    triangles: u64,
    file_bytes: u64,
    content_xxh3: String,
    peak_rss_bytes: Option<u64>,
}

impl Valid {
    fn to_text(&self) -> String {
        let Self { file, format_version, objects, pages, triangles, content_xxh3, .. } = self;
        format!(
            "{file}: valid, format {format_version}, {objects} {}, {pages} {}, {triangles} {}, content {content_xxh3}\n",
            plural(*objects, "object"),
            plural(u64::from(*pages), "page"),
            plural(*triangles, "triangle")
        )
    }
}

#[derive(Serialize)]
struct Invalid {
    file: String,
    valid: bool,
    #[serde(flatten)]
    breach: Breach,
}
