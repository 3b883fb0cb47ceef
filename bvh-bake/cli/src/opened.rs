//! Opening a `.cbvh` file, and the few words that all commands have for one.

use crate::error::Failure;
use bvh_format::FormatError;
use bvh_query::Bvh;
use serde::Serialize;
use std::path::Path;

/// Maps a file.
pub(crate) fn open(path: &Path) -> Result<Bvh, Failure> {
    Ok(Bvh::open(path)?)
}

/// A breach of the format in JSON.
#[derive(Serialize)]
pub(crate) struct Breach {
    /// Number of the rule in the specification.
    rule: u32,
    /// The rule in one phrase.
    rule_text: &'static str,
    /// Byte offset in the file.
    offset: u64,
    expected: String,
    found: String,
}

impl Breach {
    pub(crate) fn new(error: &FormatError) -> Self {
        Self {
            rule: error.rule.number(),
            rule_text: error.rule.text(),
            offset: error.offset,
            expected: error.expected.clone(),
            found: error.found.clone(),
        }
    }
}
