//! Standard output: text, or one JSON object per line.

use super::Failure;
use serde::Serialize;
use std::io::{self, Write};

/// Prints text as it is.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(|error| Failure::from_output(&error))
}

/// Prints one JSON object and a line feed.
pub(crate) fn json(value: &impl Serialize) -> Result<(), Failure> {
    // Serialisation fails only for maps whose keys are not strings, and there are none.
    let line = serde_json::to_string(value).map_err(|error| Failure::System(format!("JSON: {error}")))?;
    text(&format!("{line}\n"))
}

/// Returns a checksum in the form that scripts compare.
pub(crate) fn hex(sum: u64) -> String {
    format!("{sum:016x}")
}
