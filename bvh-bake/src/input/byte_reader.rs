//! Reads a file from its beginning to its end, block by block, as bytes or as words with their lines.
//!
//! Memory and files are read in the same way. An error that is no fault of the text, such as one of the system, is kept
//! in `stopped`. It looks like the end of the file until `finish` returns it.

use super::text::{is_blank, number, wrong_number};
use crate::error::{Fault, Halt, Place};
use std::io::Read;

/// The number of bytes that are read at a time.
const BLOCK: usize = 1 << 18;
/// The most bytes of a word, or of a line that is read as a whole.
const MAX_LETTERS: usize = 1 << 20;

/// The bytes of a file, from its beginning to its end.
pub(crate) struct ByteReader<R> {
    source: R,
    length: u64,
    buffer: Vec<u8>,
    /// The position in the buffer of the next byte.
    start: usize,
    end: usize,
    /// The offset in the file at which the buffer starts.
    offset: u64,
    stopped: Option<Halt>,
}

#[cfg(test)]
impl<'a> ByteReader<&'a [u8]> {
    fn of_bytes(bytes: &'a [u8]) -> Self {
        Self::new(bytes, bytes.len() as u64)
    }
}

impl<R: Read> ByteReader<R> {
    /// Makes a reader of a source of `length` bytes.
    pub(crate) fn new(source: R, length: u64) -> Self {
        let buffer = vec![0; BLOCK];
        Self { source, length, buffer, start: 0, end: 0, offset: 0, stopped: None }
    }

    /// Returns the number of bytes of the whole file.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Returns the offset of the next byte.
    pub(crate) fn position(&self) -> u64 {
        self.offset + self.start as u64
    }

    pub(crate) fn bytes_left(&self) -> u64 {
        self.length.saturating_sub(self.position())
    }

    /// Returns `result`, or what stopped the reading, if something other than the text did. After a success, the rest
    /// of the file is read without being looked at.
    pub(crate) fn finish<T>(&mut self, result: Result<T, Halt>) -> Result<T, Halt> {
        while result.is_ok() && self.has(1) {
            self.start = self.end;
        }
        self.stopped.take().map_or(result, Err)
    }

    /// Reads until the buffer has `count` more bytes. Returns whether the file has that many.
    #[inline]
    fn has(&mut self, count: usize) -> bool {
        self.end - self.start >= count || self.fill(count)
    }

    #[cold]
    fn fill(&mut self, count: usize) -> bool {
        self.buffer.copy_within(self.start..self.end, 0);
        self.offset += self.start as u64;
        (self.start, self.end) = (0, self.end - self.start);
        if self.buffer.len() < count {
            self.buffer.resize(count.next_power_of_two(), 0);
        }
        while self.end < self.buffer.len() && self.stopped.is_none() {
            match self.source.read(&mut self.buffer[self.end..]) {
                Ok(0) => break,
                Ok(more) => self.end += more,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => self.stopped = Some(Halt::Io(error)),
            }
        }
        self.end >= count && self.stopped.is_none()
    }

    /// Returns the next bytes without taking them: `count` of them, or as many as there are.
    pub(crate) fn peek(&mut self, count: usize) -> &[u8] {
        self.has(count);
        &self.buffer[self.start..self.end.min(self.start + count)]
    }

    /// Takes the next `N` bytes, or none if there are fewer.
    #[inline]
    pub(crate) fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        if !self.has(N) {
            return None;
        }
        let taken = self.buffer[self.start..self.end].first_chunk().copied();
        self.start += N;
        taken
    }

    pub(crate) fn skip(&mut self, count: usize) {
        if self.has(count) {
            self.start += count;
        }
    }

    /// Skips a byte order mark, which only states that the file is UTF-8.
    pub(crate) fn skip_mark(&mut self) {
        if self.peek(3) == b"\xef\xbb\xbf" {
            self.skip(3);
        }
    }

    /// Takes all bytes that are left. Returns their number, less the NUL, blanks and ends of lines at the end, with which some
    /// programs fill up a file.
    pub(crate) fn take_rest(&mut self) -> u64 {
        let (first, mut end) = (self.position(), self.position());
        while self.has(1) {
            let rest = &self.buffer[self.start..self.end];
            if let Some(last) = rest.iter().rposition(|byte| !b"\0 \t\r\n".contains(byte)) {
                end = self.position() + last as u64 + 1;
            }
            self.start = self.end;
        }
        end - first
    }

    /// Steps back over the byte that was taken last.
    pub(crate) fn step_back(&mut self) {
        self.start = self.start.saturating_sub(1);
    }
}

/// A word, which is in the buffer until the next one is read.
#[derive(Clone, Copy)]
pub(crate) struct Word {
    start: usize,
    end: usize,
}

/// Reads the words of a text across lines.
pub(crate) struct Words<R> {
    pub(crate) reader: ByteReader<R>,
    /// The line of the word that was returned last, from 1.
    line: u64,
    at_line_start: bool,
}

impl<R: Read> Words<R> {
    pub(crate) fn new(mut reader: ByteReader<R>) -> Self {
        reader.skip_mark();
        Words { reader, line: 0, at_line_start: true }
    }

    /// Returns the line of the word that was returned last.
    pub(crate) fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// Returns the letters of a word.
    pub(crate) fn text(&self, word: Word) -> &[u8] {
        &self.reader.buffer[word.start..word.end]
    }

    /// Takes the next byte and counts lines; `None` at the end.
    #[inline]
    fn byte(&mut self) -> Option<u8> {
        if !self.reader.has(1) {
            return None;
        }
        if self.at_line_start {
            self.line += 1;
            self.at_line_start = false;
        }
        Some(self.reader.buffer[self.reader.start])
    }

    /// Takes the rest of a line's end, which is LF, CR LF or a CR alone. `byte` is its first byte.
    fn end_line(&mut self, byte: u8) {
        self.reader.start += 1;
        if byte == b'\r' && self.reader.has(1) && self.reader.buffer[self.reader.start] == b'\n' {
            self.reader.start += 1;
        }
        self.at_line_start = true;
    }

    /// Returns the next word.
    pub(crate) fn next(&mut self) -> Option<Word> {
        loop {
            match self.byte()? {
                byte @ (b'\n' | b'\r') => self.end_line(byte),
                byte if is_blank(byte) => self.reader.start += 1,
                _ => return self.until(|byte| is_blank(byte) || byte == b'\n' || byte == b'\r'),
            }
        }
    }

    /// Takes letters up to one for which `ends` is true.
    #[inline]
    fn until(&mut self, ends: impl Fn(u8) -> bool) -> Option<Word> {
        let mut length = 0;
        loop {
            let letters = &self.reader.buffer[self.reader.start + length..self.reader.end];
            if let Some(more) = letters.iter().position(|&byte| ends(byte)) {
                length += more;
                break;
            }
            length += letters.len();
            if length > MAX_LETTERS {
                let (place, most) = (self.place(), MAX_LETTERS as u64);
                self.reader.stopped =
                    Some(Fault::Limit { place, most, what: "bytes in a word or line" }.into());
                return None;
            }
            if !self.reader.has(length + 1) {
                break;
            }
        }
        let start = self.reader.start;
        self.reader.start += length;
        Some(Word { start, end: start + length })
    }

    /// Returns the rest of the current line. Its end is not taken.
    pub(crate) fn rest_of_line(&mut self) -> Option<Word> {
        if self.at_line_start {
            return Some(Word { start: 0, end: 0 });
        }
        self.until(|byte| byte == b'\n' || byte == b'\r')
    }

    /// Returns the next word if it is on the line of the last one, without taking it.
    pub(crate) fn more_on_line(&mut self) -> Option<Word> {
        while !self.at_line_start && self.reader.has(1) && is_blank(self.reader.buffer[self.reader.start]) {
            self.reader.start += 1;
        }
        let ends = |byte: u8| byte == b'\n' || byte == b'\r';
        if self.at_line_start || !self.reader.has(1) || ends(self.reader.buffer[self.reader.start]) {
            return None;
        }
        let word = self.until(|byte| is_blank(byte) || ends(byte))?;
        self.reader.start = word.start;
        Some(word)
    }

    /// Returns the next line from its first letter, and whether CR LF ended it.
    pub(crate) fn line(&mut self) -> Option<(Vec<u8>, bool)> {
        self.byte()?;
        let line = self.until(|byte| byte == b'\n' || byte == b'\r')?;
        let line = self.text(line).to_vec();
        let both = self.reader.peek(2) == b"\r\n";
        if let Some(byte) = self.byte() {
            self.end_line(byte);
        }
        Some((line, both))
    }

    /// Returns the next word, or a fault that states what was expected.
    pub(crate) fn expect(&mut self, expected: &'static str) -> Result<Word, Fault> {
        self.next().ok_or_else(|| Fault::new(self.place(), expected, "the end of the file"))
    }

    /// Returns the next word as a number.
    pub(crate) fn number(&mut self) -> Result<f64, Fault> {
        let word = self.expect("a number")?;
        let text = self.text(word);
        number(text).ok_or_else(|| Fault::new(self.place(), "a number", wrong_number(text)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_cross_lines() {
        let mut all = Words::new(ByteReader::of_bytes(b"\xef\xbb\xbf a  b\n\n\tc \r\nd\re"));
        let next = |all: &mut Words<&[u8]>| all.next().map(|word| (all.text(word)[0], all.place()));
        let read: Vec<_> = std::iter::from_fn(|| next(&mut all)).collect();
        let line = Place::Line;
        let expected = [(b'a', line(1)), (b'b', line(1)), (b'c', line(3)), (b'd', line(4)), (b'e', line(5))];
        assert_eq!(read, expected);
    }

    #[test]
    fn words_are_whole_wherever_blocks_end() {
        let text: String = (0..200_000).map(|i| format!("{i}{}", ["\n", " ", "\r\n"][i % 3])).collect();
        let mut words = Words::new(ByteReader::of_bytes(text.as_bytes()));
        for i in 0..200_000 {
            assert_eq!(words.number().unwrap(), f64::from(i));
        }
        assert!(words.next().is_none());
        assert_eq!(words.reader.position(), text.len() as u64);
    }

    #[test]
    fn a_word_without_end_is_a_limit() {
        let text = vec![b'x'; 3 << 20];
        let mut words = Words::new(ByteReader::of_bytes(&text));
        assert!(words.next().is_none());
        assert!(matches!(words.reader.finish(Ok(())), Err(Halt::Fault(Fault::Limit { .. }))));
    }
}
