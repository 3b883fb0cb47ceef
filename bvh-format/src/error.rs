//! What is wrong with a file: the rule broken, where, what was expected and what was found.

use crate::rule::Rule;

/// A breach of the format. One line of text says the rule, the byte offset in the file, what was
/// expected there and what was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("byte {offset}: {rule}: expected {expected}, found {found}")]
pub struct FormatError {
    /// The rule of the specification that does not hold.
    pub rule: Rule,
    /// Byte offset from the start of the file.
    pub offset: u64,
    /// What the rule asks for at this place.
    pub expected: String,
    /// What stands there.
    pub found: String,
}

impl FormatError {
    /// Builds an error; the texts are made only on the failing path.
    #[cold]
    pub fn new(rule: Rule, offset: u64, expected: impl ToString, found: impl ToString) -> Self {
        Self { rule, offset, expected: expected.to_string(), found: found.to_string() }
    }
}

/// `Ok` if `found` equals `expected`, else the error of `rule` at `offset`.
pub(crate) fn require<T: PartialEq + ToString>(
    rule: Rule,
    offset: u64,
    expected: T,
    found: T,
) -> Result<(), FormatError> {
    if expected == found { Ok(()) } else { Err(FormatError::new(rule, offset, expected, found)) }
}

/// `Ok` if `holds`, else the error of `rule` at `offset` with lazily made texts.
pub(crate) fn ensure(
    holds: bool,
    rule: Rule,
    offset: u64,
    texts: impl FnOnce() -> (String, String),
) -> Result<(), FormatError> {
    if holds {
        return Ok(());
    }
    let (expected, found) = texts();
    Err(FormatError::new(rule, offset, expected, found))
}
