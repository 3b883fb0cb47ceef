//! Tells what a machine cannot test.

use std::fs::File;
use std::io::Write as _;

/// Says that something is not tested, and why. The standard error of a test that passes is hidden, so the line is also appended
/// to the file that the environment variable `CBVH_SKIPPED` names, if there is one. `.ci/run` prints that file at its end.
///
/// # Panics
///
/// Panics if the file cannot be written.
#[allow(clippy::print_stderr, reason = "what was not tested has to be said")]
pub fn skip(what: &str) {
    let line = format!("skipped: {what}\n");
    eprint!("{line}");
    if let Some(path) = std::env::var_os("CBVH_SKIPPED") {
        let mut file = File::options().create(true).append(true).open(path).unwrap();
        file.write_all(line.as_bytes()).unwrap();
    }
}
