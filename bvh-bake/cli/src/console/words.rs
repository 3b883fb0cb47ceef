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

/// Returns nanoseconds in a unit that gives few digits.
pub(crate) fn time(nanoseconds: u64) -> String {
    match nanoseconds as f64 {
        ns if ns < 1e3 => format!("{ns} ns"),
        ns if ns < 1e6 => format!("{:.1} µs", ns / 1e3),
        ns if ns < 1e9 => format!("{:.1} ms", ns / 1e6),
        ns => format!("{:.1} s", ns / 1e9),
    }
}

/// Returns paths separated by commas.
pub(crate) fn names(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        assert_eq!([999, 1_500, 2_000_000, 3_000_000_000].map(time), ["999 ns", "1.5 µs", "2.0 ms", "3.0 s"]);
    }
}
