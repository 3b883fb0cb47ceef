//! Parses a block of an OBJ file by itself, so that several threads can parse blocks at the same time.
//!
//! A block consists of whole statements. The number of vertices above it is not known while it is parsed. Corners that
//! count back from their face are therefore listed separately, and get their vertex numbers when the block is appended
//! to the earlier ones. The parser records only that something is malformed; `faults` finds out what it is.

use super::statements::{Index, Keyword, Kind, Statements, read_vertex};
use crate::input::polygon::MAX_CORNERS;
use crate::input::text::{Lines, is_blank, leading_decimal};

/// The content of a block, in its order.
pub(super) enum Event {
    /// A number of faces, and the number of corners of each.
    Faces { corners: u32, faces: u32 },
    /// The name that `o` or `g` gives to the faces below.
    Name { is_object: bool, name: Vec<u8> },
}

/// The parsed content of a block.
#[derive(Default)]
pub(super) struct Block {
    pub(super) vertices: Vec<[f64; 3]>,
    /// The corners of all faces, as vertex numbers from 0. Those in the list `relative` are filled in later.
    pub(super) corners: Vec<u32>,
    /// Positions in `corners`, each with the number of the vertex counted from the first vertex of the block.
    pub(super) relative: Vec<(usize, i64)>,
    pub(super) events: Vec<Event>,
    /// The number of statements of each kind that are left out, and the line of the first, counted from 1 at the beginning of
    /// the block.
    pub(super) left_out: [(u64, u64); Kind::ALL.len()],
    /// The number of lines.
    pub(super) lines: u64,
    /// Whether a vertex is malformed. Nothing after it has been parsed.
    pub(super) has_wrong_vertex: bool,
    /// Whether a face is malformed. No face after it has been parsed, and `corners` ends before the first malformed
    /// corner.
    pub(super) has_wrong_face: bool,
}

impl Block {
    pub(super) fn parse(text: &[u8]) -> Self {
        let mut block = Self::default();
        let mut statements = Statements::new(Lines::continued(text, 0));
        let mut has_objects = false;
        while let Some(keyword) = statements.advance() {
            let operands = statements.operands();
            match keyword {
                Keyword::Vertex => match plain_vertex(operands).or_else(|| read_vertex(operands, 0).ok()) {
                    Some(position) => block.vertices.push(position),
                    None => {
                        block.has_wrong_vertex = true;
                        break;
                    }
                },
                Keyword::Face if block.has_wrong_face => {}
                Keyword::Face => match block.face(operands) {
                    Some(true) => {}
                    Some(false) => block.leave_out(Kind::ShortFace, statements.number),
                    None => block.has_wrong_face = true,
                },
                Keyword::LeftOut(kind) => block.leave_out(kind, statements.number),
                Keyword::Group if has_objects => {}
                Keyword::Object | Keyword::Group => {
                    let is_object = keyword == Keyword::Object;
                    has_objects |= is_object;
                    block.events.push(Event::Name { is_object, name: operands.trim_ascii().to_vec() });
                }
            }
        }
        block.lines = statements.line_number();
        block
    }

    fn leave_out(&mut self, kind: Kind, line: u64) {
        let (count, first) = &mut self.left_out[kind as usize];
        *first = if *count == 0 { line } else { *first };
        *count += 1;
    }

    /// Adds a face. Returns false if it has fewer than three corners, so that it is left out, and `None` if it is malformed.
    fn face(&mut self, operands: &[u8]) -> Option<bool> {
        let first = self.corners.len();
        let mut at = 0;
        loop {
            while operands.get(at).is_some_and(|&byte| is_blank(byte)) {
                at += 1;
            }
            let start = at;
            let mut number = 0u64;
            while let Some(digit) =
                operands.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10)
            {
                number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
                at += 1;
            }
            let is_plain = operands.get(at).is_none_or(|&byte| is_blank(byte)) && at - start <= 9;
            if is_plain && at > start {
                // A number of nine digits fits in 32 bits.
                self.corners.push((number as u32).checked_sub(1)?);
                continue;
            }
            match operands.get(start) {
                None | Some(b'#') => break,
                Some(_) => {}
            }
            let rest = &operands[start..];
            let length = rest.iter().position(|&byte| is_blank(byte)).unwrap_or(rest.len());
            at = start + length;
            match Index::parse(&rest[..length])?.0 {
                0 => return None,
                number @ 1.. => self.corners.push(u32::try_from(number - 1).ok()?),
                number => {
                    self.relative.push((self.corners.len(), self.vertices.len() as i64 + number));
                    self.corners.push(0);
                }
            }
        }
        let corners = self.corners.len() - first;
        if corners > MAX_CORNERS {
            return None;
        }
        if corners < 3 {
            self.corners.truncate(first);
            let kept = self.relative.partition_point(|&(place, _)| place < first);
            self.relative.truncate(kept);
            return Some(false);
        }
        let corners = corners as u32;
        match self.events.last_mut() {
            Some(Event::Faces { corners: last, faces }) if *last == corners && *faces < u32::MAX => {
                *faces += 1
            }
            _ => self.events.push(Event::Faces { corners, faces: 1 }),
        }
        Some(true)
    }
}

/// Reads the first three numbers after `v` if they are plain decimals.
#[inline]
fn plain_vertex(operands: &[u8]) -> Option<[f64; 3]> {
    let mut position = [0.0; 3];
    let mut rest = operands;
    for coordinate in &mut position {
        let start = rest.iter().position(|&byte| !is_blank(byte))?;
        let (value, length) = leading_decimal(&rest[start..])?;
        *coordinate = value;
        rest = &rest[start + length..];
    }
    Some(position)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_that_count_back_are_listed() {
        let text =
            "v 0 0 0 1 1 1\rv 1 0 \\\r\n 0\nvt 1 1\no a\\\nfo -1 -2 +3\no b \nf 3 2/1 1//2 # c\ng x\nv 1 1 1";
        let block = Block::parse(text.as_bytes());
        assert_eq!(block.vertices, [[0.0; 3], [1.0, 0.0, 0.0], [1.0; 3]]);
        assert_eq!(block.corners, [0, 0, 2, 2, 1, 0]);
        assert_eq!(block.relative, [(0, 1), (1, 0)]);
        let names: Vec<&[u8]> = block
            .events
            .iter()
            .filter_map(|event| match event {
                Event::Name { name, .. } => Some(&name[..]),
                Event::Faces { .. } => None,
            })
            .collect();
        assert_eq!(names, [&b"a\\"[..], b"b"]);
        assert!(!block.has_wrong_face && !block.has_wrong_vertex);
    }

    #[test]
    fn corners_end_where_a_face_is_wrong() {
        for (text, corners) in [("f 1 2 3\nf 1 0 1\nf 1 1 1", 4), ("f 1 2 3 x", 3), ("f 1 99999999999 1", 1)]
        {
            let block = Block::parse(text.as_bytes());
            assert!(block.has_wrong_face, "{text}");
            assert_eq!(block.corners.len(), corners, "{text}");
        }
        let block = Block::parse(b"f 1 2 3\n\nf 1 -2\nf -1 -2 -3\nf\n");
        assert_eq!((block.left_out[Kind::ShortFace as usize], block.lines), ((2, 3), 5));
        assert_eq!((block.corners.len(), block.relative.len(), block.has_wrong_face), (6, 3, false));
        let block = Block::parse(b"v 1 1 1\nv 1 x 1\nf 1 1 1");
        assert!(block.has_wrong_vertex && block.corners.is_empty());
    }
}
