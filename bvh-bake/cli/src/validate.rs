//! `cbvh validate`: structure and checksums of a whole file.

use crate::arguments::ValidateArguments;
use crate::bake::plural;
use crate::error::Failure;
use crate::opened::Breach;
use crate::output::{self, hex};
use crate::resident;
use bvh_bake::{FileError, StoredFile, validate_in_parallel};
use bvh_format::source::Source;
use serde::Serialize;

pub(crate) fn run(arguments: &ValidateArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let result = StoredFile::open(path, arguments.max_memory).and_then(|file| {
        let layout = validate_in_parallel(&file)?;
        Ok((layout, file.length()))
    });
    let file = path.display().to_string();
    match result {
        Ok((layout, bytes)) => {
            let records = || layout.objects.iter().map(|object| &object.record);
            let valid = Valid {
                file,
                valid: true,
                format_version: format!("{}.{}", layout.version.0, layout.version.1),
                objects: layout.objects.len() as u64,
                pages: layout.page_count(),
                treelets: records().map(|record| record.treelets.get()).sum(),
                triangles: records().map(|record| record.triangles.get()).sum(),
                file_bytes: bytes,
                content_xxh3: hex(layout.content_checksum),
                peak_rss_bytes: resident::peak_bytes(),
            };
            if arguments.json { output::json(&valid) } else { output::text(&valid.to_text()) }
        }
        Err(FileError::Format(error)) => {
            if arguments.json {
                output::json(&Invalid { file, valid: false, breach: Breach::new(&error) })?;
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
