//! Parses the statements of an OBJ file that matter to a mesh: `v`, `f`, `o`, `g`, and those whose content is left out.

use crate::error::{Fault, Place, excerpt};
use crate::input::polygon::MAX_CORNERS;
use crate::input::text::{Lines, is_blank, number, words, wrong_number};
use crate::input::warnings::SHORT_FACES;
use crate::limits::MAX_TRIANGLES;

/// Reads the first three numbers after `v`. A fourth number is a weight or the first component of a colour.
pub(super) fn read_vertex(operands: &[u8], line: u64) -> Result<[f64; 3], Fault> {
    const EXPECTED: &str = "three numbers after v";
    let mut coordinates = words(operands);
    let mut read = [0.0; 3];
    for given in 0..3 {
        let Some(word) = coordinates.next() else {
            return Err(Fault::new(Place::Line(line), EXPECTED, given.to_string()));
        };
        let value = number(word);
        read[given] = value.ok_or_else(|| Fault::new(Place::Line(line), EXPECTED, wrong_number(word)))?;
    }
    Ok(read)
}

/// Reads a corner of a face. The face has `above` vertices above it, and the file has `all` vertices. Returns the
/// number of the corner's vertex, counted from 0.
pub(super) fn read_corner(word: &[u8], line: u64, above: u64, all: u64) -> Result<u64, Fault> {
    let index = Index::parse(word).ok_or_else(|| {
        Fault::new(Place::Line(line), "vertex numbers such as 7, 7/1 or 7//1", excerpt(word))
    })?;
    match index.resolve(above).filter(|&vertex| vertex < all) {
        Some(vertex) => Ok(vertex),
        None => {
            let expected = match index.0 {
                ..0 => format!("a number that counts back over at most {above} vertices"),
                _ => format!("a vertex number from 1 to {all}"),
            };
            Err(Fault::new(Place::Line(line), expected, excerpt(word)))
        }
    }
}

/// Checks the number of corners of a face, and adds the face's triangles to `triangles`, which it checks as well.
pub(super) fn check_face(corners: u64, line: u64, triangles: &mut u64) -> Result<(), Fault> {
    let place = Place::Line(line);
    if corners > MAX_CORNERS as u64 {
        return Err(Fault::Limit { place, most: MAX_CORNERS as u64, what: "vertices in a face" });
    }
    *triangles += corners.saturating_sub(2);
    if *triangles > MAX_TRIANGLES {
        return Err(Fault::Limit { place, most: MAX_TRIANGLES, what: "triangles" });
    }
    Ok(())
}

/// The keywords of the statements that matter.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Keyword {
    Vertex,
    Face,
    Object,
    Group,
    LeftOut(Kind),
}

/// What is left out and counted, because it has no triangles or has them elsewhere.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    ShortFace,
    LineOrPoint,
    FreeForm,
    Call,
}

impl Kind {
    pub(super) const ALL: [Self; 4] = [Self::ShortFace, Self::LineOrPoint, Self::FreeForm, Self::Call];

    /// Returns the words for one and for several.
    pub(super) fn words(self) -> [&'static str; 2] {
        match self {
            Self::ShortFace => SHORT_FACES,
            Self::LineOrPoint => ["statement of lines or points", "statements of lines or points"],
            Self::FreeForm => ["free-form curve or surface", "free-form curves or surfaces"],
            Self::Call => ["call of another file", "calls of other files"],
        }
    }

    /// Returns the kind of a keyword of several letters.
    fn of_word(line: &[u8]) -> Option<Self> {
        match line.split(|&byte| is_blank(byte)).next()? {
            b"curv" | b"curv2" | b"surf" => Some(Self::FreeForm),
            b"call" => Some(Self::Call),
            _ => None,
        }
    }
}

/// Visits the statements, each of which is one line or several lines joined by `\`.
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

    /// Returns the number of the line that was read last.
    pub(super) fn line_number(&self) -> u64 {
        self.lines.number
    }

    /// Returns the part of the statement after the keyword.
    pub(super) fn operands(&self) -> &[u8] {
        if self.is_joined { &self.joined } else { self.line }
    }

    /// Advances to the next statement that matters.
    pub(super) fn advance(&mut self) -> Option<Keyword> {
        loop {
            let line = self.lines.next()?;
            let start = line.iter().position(|&byte| !is_blank(byte)).unwrap_or(line.len());
            let (word, operands) = match &line[start..] {
                [word, next, ..] if is_blank(*next) => (*word, &line[start + 1..]),
                [word] => (*word, &[][..]),
                // `fo` is the old keyword for a face.
                [b'f', b'o', next, ..] if is_blank(*next) => (b'f', &line[start + 2..]),
                [word @ (b'c' | b's'), ..] => (*word, &[][..]),
                _ => continue,
            };
            let keyword = match word {
                b'v' => Keyword::Vertex,
                b'f' => Keyword::Face,
                b'o' => Keyword::Object,
                b'g' => Keyword::Group,
                b'l' | b'p' => Keyword::LeftOut(Kind::LineOrPoint),
                _ => match Kind::of_word(&line[start..]) {
                    Some(kind) => Keyword::LeftOut(kind),
                    None => continue,
                },
            };
            self.number = self.lines.number;
            self.line = operands;
            self.is_joined = false;
            // Comments and names may end in a `\` without a meaning, as in a path.
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

/// The position number of a corner as the file states it: from 1, or negative if it counts back from the face.
pub(super) struct Index(pub(super) i64);

impl Index {
    /// Parses a corner and skips its texture coordinates and normals.
    pub(super) fn parse(word: &[u8]) -> Option<Self> {
        let end = word.iter().position(|&byte| byte == b'/').unwrap_or(word.len());
        let (digits, rest) = word.split_at(end);
        // Some programs end a corner in one more slash.
        let rest = rest.strip_suffix(b"/").unwrap_or(rest);
        let rest_is_numbers = rest.iter().all(|byte| matches!(byte, b'/' | b'-' | b'+' | b'0'..=b'9'));
        if !rest_is_numbers || rest.iter().filter(|&&byte| byte == b'/').count() > 2 {
            return None;
        }
        let (negative, magnitude) = match digits {
            [b'-', magnitude @ ..] => (true, magnitude),
            [b'+', magnitude @ ..] => (false, magnitude),
            magnitude => (false, magnitude),
        };
        // Eighteen digits are more than any vertex number has, and do not overflow.
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
        Some(Self(if negative { -number } else { number }))
    }

    /// Returns whether a word states a corner, though perhaps of no vertex of the file.
    pub(super) fn is_valid(word: &[u8]) -> bool {
        Self::parse(word).is_some_and(|index| index.0 != 0)
    }

    /// Returns the number of the vertex, counted from 0. `above` is the number of vertices above the face.
    fn resolve(&self, above: u64) -> Option<u64> {
        match self.0 {
            0 => None,
            number @ 1.. => Some(number as u64 - 1),
            number => above.checked_sub(number.unsigned_abs()),
        }
    }
}
