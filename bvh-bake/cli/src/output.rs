//! Standard output: text, or a JSON object a line.

use crate::error::Failure;
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
    // Only maps whose keys are no strings fail to serialise, and there are none.
    let line = serde_json::to_string(value).map_err(|error| Failure::System(format!("JSON: {error}")))?;
    text(&format!("{line}\n"))
}

/// A checksum as scripts compare it.
pub(crate) fn hex(sum: u64) -> String {
    format!("{sum:016x}")
}
