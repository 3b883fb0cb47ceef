//! `cbvh verify`: compares a file with the mesh it was baked from.

use super::breach::Breach;
use crate::console::{self, Failure, length, names, plural};
use crate::options::size;
use crate::process::resident;
use bvh_bake::{VerifyError, VerifyOptions, verify_files};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

const HELP: &str = "\
Example:
  cbvh verify rock.cbvh rock.obj

Give the meshes in the same order as to bake. Any difference exits with code 3.

File and mesh are read piece by piece. What does not fit into 1.5 GiB of memory, or into \
--max-memory, goes to scratch files: up to 350 bytes per triangle. They have no names and vanish however the process \
ends. --max-memory SIZE keeps the whole process within SIZE; a SIZE that is too small exits with code 4.";

/// What `verify` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
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
    let path = &arguments.file;
    if let Some(folder) = &arguments.scratch {
        std::fs::read_dir(folder).map_err(|error| Failure::from_folder(folder, &error))?;
    }
    let meshes = names(&arguments.meshes);
    let options = VerifyOptions::default()
        .max_memory(arguments.max_memory)
        .scratch(arguments.scratch.clone())
        .allow_outside(arguments.allow_outside);
    if arguments.max_memory.is_some() {
        resident::give_back();
    }
    let result = verify_files(path, &arguments.meshes, &options);
    let file = path.display().to_string();
    match result {
        Ok(report) => {
            let faithful = Faithful {
                file,
                mesh: meshes,
                valid: true,
                triangles: report.triangles,
                duplicates: report.duplicates,
                objects: report.objects,
                by_id: report.by_id,
                max_move: report.max_move,
                nodes: report.inflation.nodes,
                width_inflation: report.inflation.mean_width(),
                volume_inflation: report.inflation.mean_volume(),
                peak_rss_bytes: resident::peak_bytes(),
            };
            if arguments.json { console::json(&faithful) } else { console::text(&faithful.to_text()) }
        }
        Err(error) => {
            let compared = !matches!(error, VerifyError::Input(_) | VerifyError::File(_));
            if arguments.json && compared {
                console::json(&Unfaithful::new(file, meshes.clone(), &error))?;
            }
            Err(Failure::from_verify(path, &meshes, error))
        }
    }
}

#[derive(Serialize)]
struct Faithful {
    file: String,
    mesh: String,
    valid: bool,
    triangles: u64,
    duplicates: u64,
    objects: u64,
    by_id: bool,
    max_move: f64,
    nodes: u64,
    width_inflation: f64,
    volume_inflation: f64,
    peak_rss_bytes: Option<u64>,
}

impl Faithful {
    fn to_text(&self) -> String {
        let duplicates = match self.duplicates {
            0 => String::new(),
            count => format!(" and {count} exact {}", plural(count, "duplicate")),
        };
        let how = if self.by_id { "compared by id" } else { "compared in any order" };
        format!(
            "{}: has the {} {}{duplicates} of {}, {how}, moved by at most {}; every bound contains its triangles\n",
            self.file,
            self.triangles,
            plural(self.triangles, "triangle"),
            self.mesh,
            length(self.max_move)
        )
    }
}

#[derive(Serialize)]
struct Unfaithful {
    file: String,
    mesh: String,
    valid: bool,
    /// The difference in words.
    error: String,
    /// The rule, if the file breaks the format.
    #[serde(flatten)]
    breach: Option<Breach>,
    /// The difference, if the file is valid but is not the mesh's.
    #[serde(flatten)]
    difference: Option<Difference>,
}

#[derive(Serialize)]
struct Difference {
    what: String,
    expected: String,
    found: String,
}

impl Unfaithful {
    fn new(file: String, mesh: String, error: &VerifyError) -> Self {
        let (mut breach, mut difference) = (None, None);
        match error {
            VerifyError::Format(error) => breach = Some(Breach::new(error)),
            VerifyError::Differs { what, expected, found } => {
                let (what, expected, found) = (what.clone(), expected.clone(), found.clone());
                difference = Some(Difference { what, expected, found });
            }
            _ => {}
        }
        Self { file, mesh, valid: false, error: error.to_string(), breach, difference }
    }
}
