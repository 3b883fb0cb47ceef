//! Writes the files of an experiment, its summary and its progress.

use crate::Failure;
use cbvh_measure::table;
use serde::Serialize;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

/// Creates the folder for the results before the work, so that a wrong name is found early.
pub(crate) fn make_folder(out: &Path) -> Result<(), Failure> {
    let failed = |error| format!("{}: expected a folder to write to, found {error}", out.display());
    Ok(fs::create_dir_all(out).map_err(failed)?)
}

/// Writes files into a folder.
pub(crate) fn write(out: &Path, files: &[(&str, String)]) -> Result<(), Failure> {
    for (name, text) in files {
        let path = out.join(name);
        fs::write(&path, text).map_err(|error| format!("{}: cannot write: {error}", path.display()))?;
    }
    Ok(())
}

/// Writes a report as JSON.
pub(crate) fn json(report: &impl Serialize) -> Result<String, Failure> {
    Ok(table::json(report)?)
}

/// Prints to standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    Ok(io::stdout().lock().write_all(text.as_bytes())?)
}

/// Prints progress or an error to standard error.
pub(crate) fn tell(line: &str) {
    // If standard error cannot be written, the work goes on.
    let _ = writeln!(io::stderr(), "{line}");
}
