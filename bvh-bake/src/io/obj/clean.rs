//! Turns any OBJ file into the few statements that matter, each checked: first every `v x y z`, then every
//! `f i j k …` and `o NUMBER`, all as a stream that is made while it is read.
//!
//! The file is walked twice, once for the vertices and once for the faces, so that a face may refer to
//! vertices further down and is yet checked against their true number.

use crate::io::error::{Fault, Place, excerpt};
use crate::io::text::{Lines, is_blank, number, words};
use crate::io::{COORDINATE, polygon::MAX_CORNERS};
use crate::mesh::{MAX_TRIANGLES, MAX_VERTICES, coordinate_fits};
use crate::progress::Tally;
use std::collections::HashMap;
use std::io::{self, BufRead, Read, Write};

/// Clean bytes are made at least this many at a time.
const BLOCK: usize = 1 << 16;

/// A number of at most this many characters without an exponent is below 2^120.
const SHORT: usize = 30;

enum Pass {
    Vertices,
    Faces,
    Done,
}

/// The filter between the file and the parser.
pub(super) struct Cleaner<'a> {
    text: &'a [u8],
    statements: Statements<'a>,
    pass: Pass,
    /// Counts the bytes walked.
    walked: Tally<'a>,
    /// Bytes of the text that the walk had before it when they were last counted.
    left: usize,
    clean: Vec<u8>,
    taken: usize,
    /// Vertices seen: in the first pass all so far, in the second those above the current line.
    vertices: u64,
    all_vertices: u64,
    /// Vertices with a coordinate that the format can't hold, and their lines; most files have none.
    misfits: Vec<(u64, u64)>,
    triangles: u64,
    /// The statement that names objects: `o` if there is one in the file, else `g`.
    naming: u8,
    /// The names of the objects.
    pub(super) names: Names,
    /// Whether the current object has been announced.
    announced: bool,
    /// What is wrong with the file; then the parser is told that reading failed.
    pub(super) fault: Option<Fault>,
}

impl<'a> Cleaner<'a> {
    pub(super) fn new(text: &'a [u8], walked: Tally<'a>) -> Self {
        Cleaner {
            text,
            statements: Statements::new(Lines::new(text)),
            pass: Pass::Vertices,
            walked,
            left: text.len(),
            clean: Vec::with_capacity(2 * BLOCK),
            taken: 0,
            vertices: 0,
            all_vertices: 0,
            misfits: Vec::new(),
            triangles: 0,
            naming: b'g',
            names: Names::default(),
            announced: false,
            fault: None,
        }
    }

    /// Makes the next block of clean statements; an empty one is the end.
    fn fill(&mut self) -> Result<(), Fault> {
        self.clean.clear();
        self.taken = 0;
        while self.clean.len() < BLOCK {
            let statement = self.statements.advance();
            match (&self.pass, statement) {
                (Pass::Done, _) => break,
                (Pass::Vertices, None) => {
                    self.count();
                    self.left = self.text.len();
                    self.all_vertices = self.vertices;
                    self.vertices = 0;
                    self.statements = Statements::new(Lines::new(self.text));
                    self.pass = Pass::Faces;
                }
                (Pass::Faces, None) => {
                    self.pass = Pass::Done;
                    if self.triangles == 0 {
                        return Err(Fault::new(Place::File, "at least one face", "none"));
                    }
                }
                (Pass::Vertices, Some(Keyword::Vertex)) => self.vertex()?,
                (Pass::Vertices, Some(Keyword::Object)) => self.naming = b'o',
                (Pass::Faces, Some(Keyword::Vertex)) => self.vertices += 1,
                (Pass::Faces, Some(Keyword::Face)) => self.face()?,
                (Pass::Faces, Some(Keyword::Object)) if self.naming == b'o' => self.name(),
                (Pass::Faces, Some(Keyword::Group)) if self.naming == b'g' => self.name(),
                _ => {}
            }
        }
        self.count();
        Ok(())
    }

    /// Counts what has been walked since the last time.
    fn count(&mut self) {
        let left = self.statements.bytes_left();
        self.walked.add((self.left - left) as u64);
        self.left = left;
    }

    /// Passes on the first three numbers of a vertex. A fourth is a weight or the first of a colour.
    fn vertex(&mut self) -> Result<(), Fault> {
        let line = self.statements.number;
        if self.vertices == MAX_VERTICES {
            return Err(Fault::Limit { place: Place::Line(line), most: MAX_VERTICES, what: "vertices" });
        }
        let (words, fits) = read_vertex(self.statements.operands(), line)?;
        self.clean.push(b'v');
        for word in words {
            self.clean.push(b' ');
            self.clean.extend_from_slice(word);
        }
        self.clean.push(b'\n');
        if !fits {
            self.misfits.push((self.vertices, line));
        }
        self.vertices += 1;
        Ok(())
    }

    /// Passes on the position numbers of a face, counted from 1.
    fn face(&mut self) -> Result<(), Fault> {
        let line = self.statements.number;
        if !self.announced {
            // Faces above the first name.
            self.enter(b"");
        }
        self.clean.push(b'f');
        let mut corners: u64 = 0;
        for word in words(self.statements.operands()).take_while(|word| word[0] != b'#') {
            let (index, vertex) = read_corner(word, line, self.vertices, self.all_vertices)?;
            if !self.misfits.is_empty()
                && let Ok(place) = self.misfits.binary_search_by_key(&vertex, |misfit| misfit.0)
            {
                let (_, at) = self.misfits[place];
                let found = self.quote_line(at);
                return Err(Fault::new(Place::Line(at), COORDINATE, found));
            }
            self.clean.push(b' ');
            if index.number > 0 {
                self.clean.extend_from_slice(index.digits);
            } else {
                // Writing to memory doesn't fail.
                let _ = write!(self.clean, "{}", vertex + 1);
            }
            corners += 1;
        }
        self.clean.push(b'\n');
        check_face(corners, line, &mut self.triangles)
    }

    fn quote_line(&self, number: u64) -> String {
        let line = Lines::new(self.text).nth(number as usize - 1).unwrap_or_default();
        excerpt(line.trim_ascii())
    }

    fn name(&mut self) {
        let name = self.statements.operands().trim_ascii().to_vec();
        self.enter(&name);
    }

    /// Makes the object of this name the current one; objects are passed on by number.
    fn enter(&mut self, name: &[u8]) {
        let number = self.names.number(name);
        let _ = writeln!(self.clean, "o {number}");
        self.announced = true;
    }
}

/// The first three words behind `v`, which are numbers, and whether the format can hold them.
pub(super) fn read_vertex(operands: &[u8], line: u64) -> Result<([&[u8]; 3], bool), Fault> {
    const EXPECTED: &str = "three numbers after v";
    let mut coordinates = words(operands);
    let mut read: [&[u8]; 3] = [b""; 3];
    let mut fits = true;
    for given in 0..3 {
        let Some(word) = coordinates.next() else {
            return Err(Fault::new(Place::Line(line), EXPECTED, given.to_string()));
        };
        if !is_plain_number(word) {
            let value = number(word).ok_or_else(|| Fault::new(Place::Line(line), EXPECTED, excerpt(word)))?;
            fits &= coordinate_fits(value);
        }
        read[given] = word;
    }
    Ok((read, fits))
}

/// A corner of a face with `above` vertices above it, of `all`: as written, and its vertex, counted from 0.
pub(super) fn read_corner(word: &[u8], line: u64, above: u64, all: u64) -> Result<(Index<'_>, u64), Fault> {
    let index = Index::parse(word).ok_or_else(|| {
        Fault::new(Place::Line(line), "vertex numbers such as 7, 7/1 or 7//1", excerpt(word))
    })?;
    match index.resolve(above).filter(|&vertex| vertex < all) {
        Some(vertex) => Ok((index, vertex)),
        None => {
            let expected = match index.number {
                ..0 => format!("a number that counts back over at most {above} vertices"),
                _ => format!("a vertex number from 1 to {all}"),
            };
            Err(Fault::new(Place::Line(line), expected, excerpt(word)))
        }
    }
}

/// Checks the number of corners of a face, and that of all triangles, which it adds to.
pub(super) fn check_face(corners: u64, line: u64, triangles: &mut u64) -> Result<(), Fault> {
    let place = Place::Line(line);
    if corners < 3 {
        return Err(Fault::new(place, "a face of at least three vertices", corners.to_string()));
    }
    if corners > MAX_CORNERS as u64 {
        return Err(Fault::Limit { place, most: MAX_CORNERS as u64, what: "vertices in a face" });
    }
    *triangles += corners - 2;
    if *triangles > MAX_TRIANGLES {
        return Err(Fault::Limit { place, most: MAX_TRIANGLES, what: "triangles" });
    }
    Ok(())
}

/// The names of objects, each with the number of its first mention.
#[derive(Default)]
pub(super) struct Names {
    /// By number.
    pub(super) names: Vec<String>,
    numbers: HashMap<Vec<u8>, usize>,
}

impl Names {
    /// The number of a name, a new one if it is new.
    pub(super) fn number(&mut self, name: &[u8]) -> usize {
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        self.names.push(String::from_utf8_lossy(name).into_owned());
        self.numbers.insert(name.to_vec(), self.names.len() - 1);
        self.names.len() - 1
    }
}

impl Read for Cleaner<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Cleaner<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.clean.len()
            && let Err(fault) = self.fill()
        {
            self.fault = Some(fault);
            self.clean.clear();
            return Err(io::ErrorKind::InvalidData.into());
        }
        Ok(&self.clean[self.taken..])
    }

    fn consume(&mut self, count: usize) {
        self.taken = (self.taken + count).min(self.clean.len());
    }
}

/// The statements that matter.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Keyword {
    Vertex,
    Face,
    Object,
    Group,
}

/// Walks the statements, each of one line or of several joined by `\`.
pub(super) struct Statements<'a> {
    lines: Lines<'a>,
    /// The line on which the current statement starts.
    pub(super) number: u64,
    line: &'a [u8],
    joined: Vec<u8>,
    is_joined: bool,
}

impl<'a> Statements<'a> {
    pub(super) fn new(lines: Lines<'a>) -> Self {
        Statements { lines, number: 0, line: &[], joined: Vec::new(), is_joined: false }
    }

    /// The line last read.
    pub(super) fn line_number(&self) -> u64 {
        self.lines.number
    }

    /// Bytes behind the line last read.
    fn bytes_left(&self) -> usize {
        self.lines.bytes_left()
    }

    /// What follows the keyword.
    pub(super) fn operands(&self) -> &[u8] {
        if self.is_joined { &self.joined } else { self.line }
    }

    /// Goes to the next statement that matters.
    pub(super) fn advance(&mut self) -> Option<Keyword> {
        loop {
            let line = self.lines.next()?;
            let start = line.iter().position(|&byte| !is_blank(byte)).unwrap_or(line.len());
            let (word, operands) = match &line[start..] {
                [word, next, ..] if is_blank(*next) => (*word, &line[start + 1..]),
                [word] => (*word, &[][..]),
                // The old name of a face.
                [b'f', b'o', next, ..] if is_blank(*next) => (b'f', &line[start + 2..]),
                _ => continue,
            };
            let keyword = match word {
                b'v' => Keyword::Vertex,
                b'f' => Keyword::Face,
                b'o' => Keyword::Object,
                b'g' => Keyword::Group,
                _ => continue,
            };
            self.number = self.lines.number;
            self.line = operands;
            self.is_joined = false;
            // Comments and names may end in a `\` that means nothing, as in a path.
            if matches!(keyword, Keyword::Vertex | Keyword::Face) && operands.ends_with(b"\\") {
                self.join(operands);
            }
            return Some(keyword);
        }
    }

    fn join(&mut self, first: &[u8]) {
        self.is_joined = true;
        self.joined.clear();
        let mut part = first;
        while let Some(head) = part.strip_suffix(b"\\") {
            self.joined.extend_from_slice(head);
            self.joined.push(b' ');
            part = self.lines.next().unwrap_or_default();
        }
        self.joined.extend_from_slice(part);
    }
}

/// A corner of a face: its position number as written, without texture coordinates and normals.
pub(super) struct Index<'a> {
    digits: &'a [u8],
    number: i64,
}

impl<'a> Index<'a> {
    fn parse(word: &'a [u8]) -> Option<Index<'a>> {
        let end = word.iter().position(|&byte| byte == b'/').unwrap_or(word.len());
        let (digits, rest) = word.split_at(end);
        let rest_is_numbers = rest.iter().all(|byte| matches!(byte, b'/' | b'-' | b'+' | b'0'..=b'9'));
        if !rest_is_numbers || rest.iter().filter(|&&byte| byte == b'/').count() > 2 {
            return None;
        }
        let (negative, magnitude) = match digits {
            [b'-', magnitude @ ..] => (true, magnitude),
            [b'+', magnitude @ ..] => (false, magnitude),
            magnitude => (false, magnitude),
        };
        // More digits than any vertex number has, and fewer than overflow.
        if magnitude.is_empty() || magnitude.len() > 18 {
            return None;
        }
        let mut number = 0;
        for &digit in magnitude {
            if !digit.is_ascii_digit() {
                return None;
            }
            number = number * 10 + i64::from(digit - b'0');
        }
        Some(Index { digits, number: if negative { -number } else { number } })
    }

    /// The vertex, counted from 0, given how many there are above the face.
    fn resolve(&self, above: u64) -> Option<u64> {
        match self.number {
            0 => None,
            number @ 1.. => Some(number as u64 - 1),
            number => above.checked_sub(number.unsigned_abs()),
        }
    }
}

/// Whether the word is a decimal without exponent that is short enough to need no closer look.
fn is_plain_number(word: &[u8]) -> bool {
    let digits = word.strip_prefix(b"-").unwrap_or(word);
    let mut points = 0;
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {}
            b'.' => points += 1,
            _ => return false,
        }
    }
    points <= 1 && digits.len() > points && word.len() <= SHORT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::{Progress, Step};

    fn clean(text: &str) -> Result<String, String> {
        let progress = Progress::default();
        let tally = progress.tally(Step::Read, 1, 0, 0);
        let mut cleaner = Cleaner::new(text.as_bytes(), tally);
        let mut out = String::new();
        match cleaner.read_to_string(&mut out) {
            Ok(_) => Ok(out),
            Err(_) => Err(format!("{:?}", cleaner.fault)),
        }
    }

    #[test]
    fn vertices_come_first_and_faces_are_bare() {
        assert!(clean("f 1 2 -1\nv 0 0 0\nv 0 0 0").unwrap_err().contains("at most 0 vertices"));
        let text = "v 0 0 0 1 1 1\rv 1 0 \\\r\n 0\nvt 1 1\no a\\\nfo -1 -2 +3\no b \nf 3 2/1 1//2 # c\no a\\\nf 1 2 3\nv 1 1 1";
        let expected = "v 0 0 0\nv 1 0 0\nv 1 1 1\no 0\nf 2 1 +3\no 1\nf 3 2 1\no 0\nf 1 2 3\n";
        assert_eq!(clean(text).unwrap(), expected);
    }

    #[test]
    fn numbers_are_told_apart() {
        for plain in ["1", "-1.5", ".5", "5.", "00001"] {
            assert!(is_plain_number(plain.as_bytes()), "{plain}");
        }
        for other in ["", "-", ".", "1..2", "1e5", "nan", "--1", "1,5", "1111111111111111111111111111111"] {
            assert!(!is_plain_number(other.as_bytes()), "{other}");
        }
    }
}
