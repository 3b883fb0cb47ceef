//! The error of a faulty file: the rule it breaks, the place, what was expected, what was found, and the remedy.

use crate::rule::Rule;

/// A breach of the format. Its text is one line, which names the byte offset in the file, the rule, what was expected
/// there, what was found, and the remedy.
///
/// ```
/// use bvh_format::{Layout, Rule};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let mut damaged = bytes.clone();
/// damaged[16] ^= 1; // in the length of the file, which the checksum of the header covers
/// let error = Layout::read(&damaged).unwrap_err();
/// assert_eq!(error.rule, Rule::HeaderChecksum);
/// println!("{error}"); // names the byte, what was expected there, and what to do
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("byte {offset}: {rule}: expected {expected}, found {found}; {}", .rule.remedy())]
#[non_exhaustive]
pub struct FormatError {
    /// The rule of the specification that does not hold.
    pub rule: Rule,
    /// Byte offset from the start of the file.
    pub offset: u64,
    /// What the rule asks for at this place.
    pub expected: String,
    /// What the file has at this place.
    pub found: String,
}

impl FormatError {
    /// Builds an error from its rule, its byte offset and two short texts.
    #[cold]
    pub fn new(rule: Rule, offset: u64, expected: impl ToString, found: impl ToString) -> Self {
        Self { rule, offset, expected: expected.to_string(), found: found.to_string() }
    }
}

/// Returns `Ok` if `found` equals `expected`, else the error of `rule` at `offset`.
pub(crate) fn require<T: PartialEq + ToString>(
    rule: Rule,
    offset: u64,
    expected: T,
    found: T,
) -> Result<(), FormatError> {
    if expected == found { Ok(()) } else { Err(FormatError::new(rule, offset, expected, found)) }
}

/// Returns `Ok` if `holds`, else the error of `rule` at `offset`. The texts are made only for an error.
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

#[cfg(test)]
mod tests {
    use crate::validate::validate;

    #[test]
    fn errors_name_the_remedy() {
        let text = |bytes: &[u8]| validate(bytes).unwrap_err().to_string();
        assert_eq!(
            text(b"solid cube"),
            "byte 0: R01 (the file starts with the magic bytes): expected the magic bytes of a .cbvh file, \
             found \"solid cu\"; this is not a .cbvh file: bake it first"
        );
        assert!(text(b"").contains("found an empty file; this is not a .cbvh file"));
        let mut newer = [0; 4096];
        newer[..10].copy_from_slice(b"\x89cbvh\r\n\x1a\x05\0");
        assert_eq!(
            text(&newer),
            "byte 8: R02 (the major version is one that this reader knows): expected version 1.x, found 5.0; \
             bake it again, or use a newer cbvh"
        );
    }
}
