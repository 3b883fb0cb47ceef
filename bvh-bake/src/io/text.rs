//! Lines and words of a text file, with the line numbers that errors need.
//!
//! A line ends at LF, CR LF or a CR alone: some files use the last, and the others never hold a CR inside a
//! line.

use super::error::{Fault, Place, excerpt};

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

    /// What follows the line last given.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end =
            self.rest.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(self.rest.len());
        let (line, after) = self.rest.split_at(end);
        let ending = if after.starts_with(b"\r\n") { 2 } else { after.len().min(1) };
        self.rest = &after[ending..];
        Some(line)
    }
}

/// Walks the words of a file across lines.
pub(crate) struct Words<'a> {
    lines: Lines<'a>,
    line: &'a [u8],
}

impl<'a> Words<'a> {
    pub(crate) fn new(lines: Lines<'a>) -> Self {
        Words { lines, line: &[] }
    }

    /// The line of the word last given.
    pub(crate) fn place(&self) -> Place {
        Place::Line(self.lines.number)
    }

    /// The rest of the current line, blanks trimmed; it counts as read.
    pub(crate) fn rest_of_line(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.line).trim_ascii()
    }

    /// The bytes that are left.
    pub(crate) fn bytes_left(&self) -> usize {
        self.line.len() + self.lines.rest().len()
    }

    /// The next word.
    pub(crate) fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            if let Some(start) = self.line.iter().position(|&byte| !is_blank(byte)) {
                let line = &self.line[start..];
                let end = line.iter().position(|&byte| is_blank(byte)).unwrap_or(line.len());
                self.line = &line[end..];
                return Some(&line[..end]);
            }
            self.line = self.lines.next()?;
        }
    }

    /// The next word, or a fault that says what should have come.
    pub(crate) fn expect(&mut self, expected: &'static str) -> Result<&'a [u8], Fault> {
        self.next().ok_or_else(|| Fault::new(self.place(), expected, "the end of the file"))
    }

    /// The next word as a number.
    pub(crate) fn number(&mut self) -> Result<f64, Fault> {
        let word = self.expect("a number")?;
        number(word).ok_or_else(|| Fault::new(self.place(), "a number", excerpt(word)))
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

    #[test]
    fn words_cross_lines() {
        let mut all = Words::new(Lines::new(b" a  b\n\n\tc \r\nd"));
        let read: Vec<_> = std::iter::from_fn(|| all.next().map(|word| (word[0], all.place()))).collect();
        let line = Place::Line;
        assert_eq!(read, [(b'a', line(1)), (b'b', line(1)), (b'c', line(3)), (b'd', line(4))]);
    }
}
