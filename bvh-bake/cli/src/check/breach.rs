//! A breach of the format as a JSON object.

use bvh_format::FormatError;
use serde::Serialize;

/// The rule that a file breaks, and where.
#[derive(Serialize)]
pub(super) struct Breach {
    /// The number of the rule in the specification.
    rule: u32,
    /// The rule in one phrase.
    rule_text: &'static str,
    /// The byte offset in the file.
    offset: u64,
    expected: String,
    found: String,
}

impl Breach {
    pub(super) fn new(error: &FormatError) -> Self {
        Self {
            rule: error.rule.number(),
            rule_text: error.rule.text(),
            offset: error.offset,
            expected: error.expected.clone(),
            found: error.found.clone(),
        }
    }
}
