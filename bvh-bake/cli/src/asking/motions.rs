//! Reads motions: files with 24 numbers per line, and the motion on the command line.

use super::files::{self, read_lines};
use super::poses::{self, NUMBERS};
use crate::console::Failure;
use bvh_query::Motion;
use std::path::Path;

/// The form of a motion, as messages state it.
const EXPECTED: &str = "expected 24 numbers, two poses of 12 numbers each";
/// The message for a file without motions.
const NONE: &str = "expected 24 numbers, two poses of 12 numbers each, in at least one line, found none";

/// Reads a file of motions. `#` starts a comment, and blank lines are skipped.
pub(crate) fn read(path: &Path) -> Result<Vec<Motion>, Failure> {
    read_lines(path, NONE, parse)
}

/// Parses the motion of `--motion`. Commas may separate the numbers.
pub(crate) fn parse_one(text: &str) -> Result<Motion, Failure> {
    files::parse_one("--motion", text, EXPECTED, parse)
}

/// Parses a motion. Returns `None` if the text is blank.
fn parse(text: &str) -> Result<Option<Motion>, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    if words.is_empty() {
        return Ok(None);
    }
    if words.len() != 2 * NUMBERS {
        return Err(format!("{EXPECTED}, found {}", words.len()));
    }
    let pose = |words: &[&str], which: &str| match poses::parse(&words.join(" ")) {
        Ok(pose) => pose.ok_or_else(|| format!("{which}: {EXPECTED}, found none")),
        Err(text) => Err(format!("{which}: {text}")),
    };
    let (start, end) = (pose(&words[..NUMBERS], "start")?, pose(&words[NUMBERS..], "end")?);
    Motion::between(&start, &end).map(Some).map_err(|error| error.to_string())
}
