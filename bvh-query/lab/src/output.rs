//! Prints the summary of an experiment and its progress.

use crate::Failure;
use std::io::{self, Write};

/// Prints to standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    Ok(io::stdout().lock().write_all(text.as_bytes())?)
}

/// Prints progress or an error to standard error.
pub(crate) fn tell(line: &str) {
    // If standard error cannot be written, the work goes on.
    let _ = writeln!(io::stderr(), "{line}");
}
