//! Lines and words of a text in memory, with the line numbers that errors need.
//!
//! A line ends at LF, CR LF or a CR alone: some files use the last, and the others never hold a CR inside a
//! line.

use memchr::memchr2;

/// Blanks separate words within a line.
pub(crate) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

/// The words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|&byte| is_blank(byte)).filter(|word| !word.is_empty())
}

/// Reads a number as the nearest f64; NaN and infinity are numbers here.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Walks the lines of a file.
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    /// The number of the line last given, from 1.
    pub(crate) number: u64,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(text: &'a [u8]) -> Self {
        // A byte order mark says only that the file is UTF-8.
        Lines { rest: text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text), number: 0 }
    }

    /// A text that goes on behind so many lines.
    pub(crate) fn continued(text: &'a [u8], number: u64) -> Self {
        Lines { rest: text, number }
    }

    /// Bytes behind the line last given.
    pub(crate) fn bytes_left(&self) -> usize {
        self.rest.len()
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end = memchr2(b'\n', b'\r', self.rest).unwrap_or(self.rest.len());
        let (line, after) = self.rest.split_at(end);
        let ending = if after.starts_with(b"\r\n") { 2 } else { after.len().min(1) };
        self.rest = &after[ending..];
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_ending_counts_once() {
        let mut lines = Lines::new(b"\xef\xbb\xbfa\nb\r\nc\r\rd");
        let all: Vec<_> = lines.by_ref().collect();
        assert_eq!(all, [&b"a"[..], b"b", b"c", b"", b"d"]);
        assert_eq!(lines.number, 5);
    }
}
