//! A file that is read from its beginning to its end, a block at a time, as bytes or as words with their lines.
//!
//! Memory and files are read alike. What stops the reading that is no fault of the text, such as an error of the system,
//! is kept here (`stopped`) and looks like the end of the file until somebody asks.

use super::error::{Fault, Halt, Place, excerpt};
use super::input::Watched;
use super::text::{is_blank, number};
use crate::progress::Tally;
use std::io::Read;

/// Bytes that are read at a time.
const BLOCK: usize = 1 << 18;
/// The most bytes of a word, or of a line that is read whole.
const MOST_LETTERS: usize = 1 << 20;

/// Bytes from the beginning of a file to its end.
pub(crate) struct Feed<R> {
    source: R,
    length: u64,
    buffer: Vec<u8>,
    /// The bytes of the buffer that come next.
    start: usize,
    end: usize,
    /// Where in the file the buffer starts.
    offset: u64,
    stopped: Option<Halt>,
}

impl<'a> Feed<Watched<'a>> {
    /// Bytes in memory; what is read of them is counted.
    pub(crate) fn watched(bytes: &'a [u8], tally: &'a Tally<'a>) -> Self {
        Self::new(Watched { bytes, tally }, bytes.len() as u64)
    }
}

#[cfg(test)]
impl<'a> Feed<&'a [u8]> {
    fn of_bytes(bytes: &'a [u8]) -> Self {
        Self::new(bytes, bytes.len() as u64)
    }
}

impl<R: Read> Feed<R> {
    /// A file of so many bytes.
    pub(crate) fn new(source: R, length: u64) -> Self {
        let buffer = vec![0; BLOCK];
        Self { source, length, buffer, start: 0, end: 0, offset: 0, stopped: None }
    }

    /// Bytes of the whole file.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Where the next byte stands.
    pub(crate) fn position(&self) -> u64 {
        self.offset + self.start as u64
    }

    pub(crate) fn bytes_left(&self) -> u64 {
        self.length.saturating_sub(self.position())
    }

    /// What came of reading, unless something else stopped it. After a success the file is read to its end, whatever
    /// is there.
    pub(crate) fn finish<T>(&mut self, result: Result<T, Halt>) -> Result<T, Halt> {
        while result.is_ok() && self.has(1) {
            self.start = self.end;
        }
        self.stopped.take().map_or(result, Err)
    }

    /// Whether there are at least so many bytes more; then they are in the buffer.
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

    /// The next bytes, as many as there are up to `count`, which stay.
    pub(crate) fn peek(&mut self, count: usize) -> &[u8] {
        self.has(count);
        &self.buffer[self.start..self.end.min(self.start + count)]
    }

    /// The next bytes; none if there are not as many.
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

    /// Goes back over the byte last taken.
    pub(crate) fn step_back(&mut self) {
        self.start = self.start.saturating_sub(1);
    }
}

/// A word that is in the buffer until the next is read.
#[derive(Clone, Copy)]
pub(crate) struct Word {
    start: usize,
    end: usize,
}

/// Walks the words of a text across lines.
pub(crate) struct Words<R> {
    pub(crate) feed: Feed<R>,
    /// The line of the word last given, from 1.
    line: u64,
    at_line_start: bool,
}

impl<R: Read> Words<R> {
    pub(crate) fn new(mut feed: Feed<R>) -> Self {
        // A byte order mark says only that the file is UTF-8.
        if feed.peek(3) == b"\xef\xbb\xbf" {
            feed.skip(3);
        }
        Words { feed, line: 0, at_line_start: true }
    }

    /// The line of the word last given.
    pub(crate) fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// A word's letters.
    pub(crate) fn text(&self, word: Word) -> &[u8] {
        &self.feed.buffer[word.start..word.end]
    }

    /// The next byte, which counts its line; `None` at the end.
    #[inline]
    fn byte(&mut self) -> Option<u8> {
        if !self.feed.has(1) {
            return None;
        }
        if self.at_line_start {
            self.line += 1;
            self.at_line_start = false;
        }
        Some(self.feed.buffer[self.feed.start])
    }

    /// Goes behind the end of a line, LF, CR LF or a CR alone, of which `byte` is the first.
    fn end_line(&mut self, byte: u8) {
        self.feed.start += 1;
        if byte == b'\r' && self.feed.has(1) && self.feed.buffer[self.feed.start] == b'\n' {
            self.feed.start += 1;
        }
        self.at_line_start = true;
    }

    /// The next word.
    pub(crate) fn next(&mut self) -> Option<Word> {
        loop {
            match self.byte()? {
                byte @ (b'\n' | b'\r') => self.end_line(byte),
                byte if is_blank(byte) => self.feed.start += 1,
                _ => return self.until(|byte| is_blank(byte) || byte == b'\n' || byte == b'\r'),
            }
        }
    }

    /// Takes letters up to one that ends them.
    #[inline]
    fn until(&mut self, ends: impl Fn(u8) -> bool) -> Option<Word> {
        let mut length = 0;
        loop {
            let letters = &self.feed.buffer[self.feed.start + length..self.feed.end];
            if let Some(more) = letters.iter().position(|&byte| ends(byte)) {
                length += more;
                break;
            }
            length += letters.len();
            if length > MOST_LETTERS {
                let (place, most) = (self.place(), MOST_LETTERS as u64);
                self.feed.stopped =
                    Some(Fault::Limit { place, most, what: "bytes in a word or line" }.into());
                return None;
            }
            if !self.feed.has(length + 1) {
                break;
            }
        }
        let start = self.feed.start;
        self.feed.start += length;
        Some(Word { start, end: start + length })
    }

    /// The rest of the current line; its end is not taken.
    pub(crate) fn rest_of_line(&mut self) -> Option<Word> {
        if self.at_line_start {
            return Some(Word { start: 0, end: 0 });
        }
        self.until(|byte| byte == b'\n' || byte == b'\r')
    }

    /// The next line, from its first letter, and whether CR LF ended it.
    pub(crate) fn line(&mut self) -> Option<(Vec<u8>, bool)> {
        self.byte()?;
        let line = self.until(|byte| byte == b'\n' || byte == b'\r')?;
        let line = self.text(line).to_vec();
        let both = self.feed.peek(2) == b"\r\n";
        if let Some(byte) = self.byte() {
            self.end_line(byte);
        }
        Some((line, both))
    }

    /// The next word, or a fault that says what should have come.
    pub(crate) fn expect(&mut self, expected: &'static str) -> Result<Word, Fault> {
        self.next().ok_or_else(|| Fault::new(self.place(), expected, "the end of the file"))
    }

    /// The next word as a number.
    pub(crate) fn number(&mut self) -> Result<f64, Fault> {
        let word = self.expect("a number")?;
        let text = self.text(word);
        number(text).ok_or_else(|| Fault::new(self.place(), "a number", excerpt(text)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_cross_lines() {
        let mut all = Words::new(Feed::of_bytes(b"\xef\xbb\xbf a  b\n\n\tc \r\nd\re"));
        let next = |all: &mut Words<&[u8]>| all.next().map(|word| (all.text(word)[0], all.place()));
        let read: Vec<_> = std::iter::from_fn(|| next(&mut all)).collect();
        let line = Place::Line;
        let expected = [(b'a', line(1)), (b'b', line(1)), (b'c', line(3)), (b'd', line(4)), (b'e', line(5))];
        assert_eq!(read, expected);
    }

    #[test]
    fn words_are_whole_wherever_blocks_end() {
        let text: String = (0..200_000).map(|i| format!("{i}{}", ["\n", " ", "\r\n"][i % 3])).collect();
        let mut words = Words::new(Feed::of_bytes(text.as_bytes()));
        for i in 0..200_000 {
            assert_eq!(words.number().unwrap(), f64::from(i));
        }
        assert!(words.next().is_none());
        assert_eq!(words.feed.position(), text.len() as u64);
    }

    #[test]
    fn a_word_without_end_is_a_limit() {
        let text = vec![b'x'; 3 << 20];
        let mut words = Words::new(Feed::of_bytes(&text));
        assert!(words.next().is_none());
        assert!(matches!(words.feed.finish(Ok(())), Err(Halt::Fault(Fault::Limit { .. }))));
    }
}
