//! Formats numbers and names for people.

use std::path::PathBuf;

/// Returns `word` with an s, unless the count is one.
pub(crate) fn plural(count: u64, word: &str) -> String {
    if count == 1 { word.to_owned() } else { format!("{word}s") }
}

/// Returns a length in mesh units as an exponent, and zero as a plain 0.
pub(crate) fn length(length: f64) -> String {
    if length == 0.0 { "0".to_owned() } else { format!("{length:e}") }
}

/// Returns paths separated by commas.
pub(crate) fn names(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}
