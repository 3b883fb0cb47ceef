//! Reads motions: files with 24 numbers per line, and the motion on the command line.

use crate::console::Failure;
use crate::query::poses::{self, NUMBERS};
use bvh_query::Motion;
use std::path::Path;

/// What a motion looks like, as messages state it.
const EXPECTED: &str = "expected 24 numbers, two poses of 12 numbers each";

/// Reads a file of motions. `#` starts a comment, and blank lines are skipped.
pub(crate) fn read(path: &Path) -> Result<Vec<Motion>, Failure> {
    let bytes = std::fs::read(path).map_err(|error| Failure::from_input(path, &error))?;
    let mut motions = Vec::new();
    for (number, line) in (1..).zip(String::from_utf8_lossy(&bytes).lines()) {
        let motion = parse(line.split('#').next().unwrap_or(""));
        motions.extend(motion.map_err(|text| Failure::invalid(path, format_args!("line {number}: {text}")))?);
    }
    if motions.is_empty() {
        return Err(Failure::invalid(path, format_args!("{EXPECTED}, in at least one line, found none")));
    }
    Ok(motions)
}

/// Parses the motion of `--motion`. Commas may separate the numbers.
pub(super) fn parse_one(text: &str) -> Result<Motion, Failure> {
    let motion =
        parse(&text.replace(',', " ")).map_err(|text| Failure::Invalid(format!("--motion: {text}")))?;
    motion.ok_or_else(|| Failure::Invalid(format!("--motion: {EXPECTED}, found none")))
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
