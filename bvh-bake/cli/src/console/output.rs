//! Standard output: text, answers line by line, or one JSON object per line.

use super::Failure;
use serde::Serialize;
use std::fmt::Display;
use std::io::{self, BufWriter, Write};

/// Prints text as it is.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(|error| Failure::from_output(&error))
}

/// Prints many lines through a buffer.
pub(crate) fn lines(lines: impl IntoIterator<Item = impl Display>) -> Result<(), Failure> {
    let mut stdout = BufWriter::new(io::stdout().lock());
    let written = lines.into_iter().try_for_each(|line| writeln!(stdout, "{line}"));
    written.and_then(|()| stdout.flush()).map_err(|error| Failure::from_output(&error))
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
