//! `cbvh validate` and `cbvh verify`: checks a file by itself, and against the mesh from which it was baked.

use crate::console::{self, Failure, Record, counted, hex, length, names, record};
use crate::options::size;
use crate::process;
use bvh_bake::{FileError, StoredFile, VerifyError, VerifyOptions, validate_in_parallel, verify_files};
use bvh_format::FormatError;
use bvh_format::header::version_name;
use bvh_format::source::Source;
use clap::Args;
use std::path::PathBuf;

const VALIDATE_HELP: &str = "\
Example:
  cbvh validate rock.cbvh --json

An invalid file exits with code 3. With --json, the object then has the fields rule, rule_text, offset, expected and \
found.

The file is read piece by piece, in about 10 MiB of memory whatever its size. --max-memory SIZE keeps the process \
within SIZE; a SIZE that is too small exits with code 4.";

/// What `validate` accepts.
#[derive(Debug, Args)]
#[command(after_help = VALIDATE_HELP)]
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
    let (layout, file_bytes) = match result {
        Ok(found) => found,
        Err(FileError::Format(error)) => {
            if arguments.json {
                console::json(&record! { file: file, valid: false }.with(breach(&error)))?;
            }
            return Err(Failure::invalid(path, error));
        }
        Err(error) => return Err(Failure::from_file(path, error)),
    };
    let records = || layout.objects.iter().map(|object| object.record());
    let (objects, pages) = (layout.objects.len() as u64, u64::from(layout.page_count()));
    let triangles = records().map(|record| record.triangles.get()).sum::<u64>();
    let (version, content) = (version_name(layout.version), hex(layout.content_checksum));
    if arguments.json {
        return console::json(&record! {
            file: file,
            valid: true,
            format_version: version,
            objects: objects,
            pages: pages,
            treelets: records().map(|record| record.treelets.get()).sum::<u64>(),
            triangles: triangles,
            file_bytes: file_bytes,
            content_xxh3: content,
            peak_rss_bytes: process::peak_bytes(),
        });
    }
    console::text(&format!(
        "{file}: valid, format {version}, {}, {}, {}, content {content}\n",
        counted(objects, "object"),
        counted(pages, "page"),
        counted(triangles, "triangle")
    ))
}

/// Returns the rule that a file breaks, and where.
fn breach(error: &FormatError) -> Record {
    record! {
        rule: error.rule.number(),
        rule_text: error.rule.text(),
        offset: error.offset,
        expected: error.expected,
        found: error.found,
    }
}

const VERIFY_HELP: &str = "\
Example:
  cbvh verify rock.cbvh rock.obj

Give the meshes in the same order as to bake. Any difference exits with code 3.

File and mesh are read piece by piece. What does not fit into 1.5 GiB of memory, or into \
--max-memory, goes to scratch files: up to 350 bytes per triangle. They have no names and vanish however the process \
ends. --max-memory SIZE keeps the whole process within SIZE; a SIZE that is too small exits with code 4.";

/// What `verify` accepts.
#[derive(Debug, Args)]
#[command(after_help = VERIFY_HELP)]
pub(crate) struct VerifyArguments {
    /// The .cbvh file
    file: PathBuf,
    /// The mesh or meshes it was baked from
    #[arg(required = true, value_name = "MESH")]
    meshes: Vec<PathBuf>,
    /// Stay within this much memory, such as 64MiB; the rest goes to scratch files
    #[arg(long, value_name = "SIZE", value_parser = size, allow_negative_numbers = true)]
    max_memory: Option<u64>,
    /// The folder for scratch files [default: the system's folder for temporary files]
    #[arg(long, value_name = "DIR")]
    scratch: Option<PathBuf>,
    /// Let glTF files name buffers outside their own folders, as for bake
    #[arg(long)]
    allow_outside: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Compares a file with its meshes, prints what was compared, and fails if they differ.
pub(crate) fn verify(arguments: &VerifyArguments) -> Result<(), Failure> {
    let (path, mesh) = (&arguments.file, names(&arguments.meshes));
    if let Some(folder) = &arguments.scratch {
        std::fs::read_dir(folder).map_err(|error| Failure::from_folder(folder, &error))?;
    }
    let options = VerifyOptions::default()
        .max_memory(arguments.max_memory)
        .scratch(arguments.scratch.clone())
        .allow_outside(arguments.allow_outside);
    if arguments.max_memory.is_some() {
        process::give_back();
    }
    let file = path.display().to_string();
    let report = match verify_files(path, &arguments.meshes, &options) {
        Ok(report) => report,
        Err(error) => {
            let difference = match &error {
                VerifyError::Format(error) => Some(breach(error)),
                VerifyError::Differs { what, expected, found } => {
                    Some(record! { what: what, expected: expected, found: found })
                }
                _ => None,
            };
            let compared = !matches!(error, VerifyError::Input(_) | VerifyError::File(_));
            if arguments.json && compared {
                let record = record! { file: file, mesh: mesh, valid: false, error: error.to_string() };
                console::json(&record.with(difference))?;
            }
            return Err(Failure::from_verify(path, &mesh, error));
        }
    };
    if arguments.json {
        return console::json(&record! {
            file: file,
            mesh: mesh,
            valid: true,
            triangles: report.triangles,
            duplicates: report.duplicates,
            objects: report.objects,
            by_id: report.by_id,
            max_move: report.max_move,
            nodes: report.inflation.nodes,
            width_inflation: report.inflation.mean_width(),
            volume_inflation: report.inflation.mean_volume(),
            peak_rss_bytes: process::peak_bytes(),
        });
    }
    let duplicates = match report.duplicates {
        0 => String::new(),
        count => format!(" and {}", counted(count, "exact duplicate")),
    };
    let how = if report.by_id { "compared by id" } else { "compared in any order" };
    console::text(&format!(
        "{file}: has the {}{duplicates} of {mesh}, {how}, moved by at most {}; every bound contains its triangles\n",
        counted(report.triangles, "triangle"),
        length(report.max_move)
    ))
}
