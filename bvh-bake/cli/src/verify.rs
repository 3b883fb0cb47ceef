//! `cbvh verify`: a file against the mesh it was baked from.

use crate::arguments::VerifyArguments;
use crate::bake::{names, plural};
use crate::error::Failure;
use crate::opened::Breach;
use crate::{output, resident};
use bvh_bake::{VerifyError, VerifyOptions, verify_files};
use serde::Serialize;

pub(crate) fn run(arguments: &VerifyArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let meshes = names(&arguments.meshes);
    let options = VerifyOptions { max_memory: arguments.max_memory, scratch: arguments.scratch.clone() };
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
            if arguments.json { output::json(&faithful) } else { output::text(&faithful.to_text()) }
        }
        Err(error) => {
            let compared = !matches!(error, VerifyError::Input(_) | VerifyError::File(_));
            if arguments.json && compared {
                output::json(&Unfaithful::new(file, meshes.clone(), &error))?;
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
        let how = if self.by_id { "each by its id" } else { "as multisets" };
        format!(
            "{}: the {} {}{duplicates} of {}, {how}, moved by at most {:e}; every bound contains its triangles\n",
            self.file,
            self.triangles,
            plural(self.triangles, "triangle"),
            self.mesh,
            self.max_move
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
    /// If the file breaks the format.
    #[serde(flatten)]
    breach: Option<Breach>,
    /// If it does not, but is not the mesh's.
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
