//! Reads OBJ files of any size: what the filter in front of `tobj` accepts and refuses, without keeping it.
//!
//! The file is walked twice, once for the vertices and once for the faces, some lines at a time.

use super::clean::{Keyword, Names, Statements as Walk, check_face, read_corner, read_vertex};
use crate::io::error::{Fault, Halt, Place, excerpt};
use crate::io::feed::Feed;
use crate::io::text::{Lines, number, words};
use crate::mesh::MAX_VERTICES;
use std::io::Read;

/// Bytes of lines that are read at a time.
const BLOCK: usize = 1 << 20;
/// The most bytes of a statement.
const MOST_BYTES: usize = 1 << 24;

/// Takes the statements of a file: all vertices, then all faces.
pub(crate) trait Statements {
    /// The next vertex.
    fn vertex(&mut self, position: [f64; 3]) -> Result<(), Halt>;
    /// The next face of an object. `group` counts the statements that name objects. A face of less than three
    /// corners is followed by an error.
    fn face(&mut self, corners: &[u32], object: u32, group: u32) -> Result<(), Halt>;
}

/// Reads a file; returns the names of its objects, by number. Whether the format can hold a vertex is not looked at.
pub(crate) fn stream<R: Read>(
    open: impl Fn() -> Result<Feed<R>, Halt>,
    out: &mut impl Statements,
) -> Result<Vec<String>, Halt> {
    let mut vertices = 0;
    let mut naming = Keyword::Group;
    walk(open()?, |keyword, walk, _| {
        match keyword {
            Keyword::Vertex => {
                if vertices == MAX_VERTICES {
                    let (place, most) = (Place::Line(walk.number), MAX_VERTICES);
                    return Err(Fault::Limit { place, most, what: "vertices" }.into());
                }
                let (words, _) = read_vertex(walk.operands(), walk.number)?;
                // All have been found to be numbers.
                out.vertex(words.map(|word| number(word).unwrap_or(f64::NAN)))?;
                vertices += 1;
            }
            Keyword::Object => naming = Keyword::Object,
            _ => {}
        }
        Ok(true)
    })?;
    let (mut above, mut triangles) = (0, 0);
    let mut names = Names::default();
    let mut current = None;
    let mut group = 0;
    let mut corners = Vec::new();
    walk(open()?, |keyword, walk, _| {
        match keyword {
            Keyword::Vertex => above += 1,
            Keyword::Face => {
                let object = *current.get_or_insert_with(|| names.number(b"")) as u32;
                corners.clear();
                let line = walk.number;
                let given = words(walk.operands()).take_while(|word| word[0] != b'#');
                let read =
                    given.map(|word| read_corner(word, line, above, vertices)).try_for_each(|corner| {
                        let (_, vertex) = corner?;
                        corners.push(vertex as u32);
                        Ok::<_, Fault>(())
                    });
                let checked = read.and_then(|()| check_face(corners.len() as u64, line, &mut triangles));
                if !corners.is_empty() {
                    out.face(&corners, object, group)?;
                }
                checked?;
            }
            keyword if keyword == naming => {
                current = Some(names.number(walk.operands().trim_ascii()));
                group += 1;
            }
            _ => {}
        }
        Ok(true)
    })?;
    if triangles == 0 {
        return Err(Fault::new(Place::File, "at least one face", "none").into());
    }
    Ok(names.names)
}

/// What is wrong with a vertex, by number, that the format cannot hold.
pub(crate) fn misfit<R: Read>(feed: Feed<R>, vertex: u64) -> Result<Halt, Halt> {
    let mut seen = 0;
    let mut found = None;
    walk(feed, |keyword, walk, lines| {
        if keyword == Keyword::Vertex {
            if seen == vertex {
                let line = lines.nth(walk.number);
                found = Some(Fault::new(Place::Line(walk.number), crate::io::COORDINATE, line));
            }
            seen += 1;
        }
        Ok(found.is_none())
    })?;
    let changed = || Fault::new(Place::File, "the file as it was at first", "another");
    Ok(found.unwrap_or_else(changed).into())
}

/// The lines that are in memory.
struct Block<'a> {
    text: &'a [u8],
    /// Lines before it.
    before: u64,
}

impl Block<'_> {
    /// A line by its number in the file, quoted.
    fn nth(&self, line: u64) -> String {
        let line = Lines::continued(self.text, self.before).nth((line - self.before) as usize - 1);
        excerpt(line.unwrap_or_default().trim_ascii())
    }
}

/// Visits all statements that matter, until `visit` has enough.
fn walk<R: Read>(
    mut feed: Feed<R>,
    mut visit: impl FnMut(Keyword, &Walk, Block) -> Result<bool, Halt>,
) -> Result<(), Halt> {
    if feed.peek(3) == b"\xef\xbb\xbf" {
        feed.skip(3);
    }
    let (mut before, mut bytes) = (0, BLOCK);
    loop {
        let text = feed.peek(bytes);
        if text.is_empty() {
            return feed.finish(Ok(()));
        }
        let cut = if text.len() < bytes { Some(text.len()) } else { last_end(text) };
        let Some(cut) = cut else {
            if bytes >= MOST_BYTES {
                let (place, most) = (Place::Line(before + 1), MOST_BYTES as u64);
                return Err(Fault::Limit { place, most, what: "bytes in a statement" }.into());
            }
            bytes *= 2;
            continue;
        };
        let text = &text[..cut];
        let mut statements = Walk::new(Lines::continued(text, before));
        let mut result = Ok(true);
        while let Ok(true) = result {
            let Some(keyword) = statements.advance() else { break };
            result = visit(keyword, &statements, Block { text, before });
        }
        before = statements.line_number();
        if !matches!(result, Ok(true)) {
            return feed.finish(result.map(|_| ()));
        }
        feed.skip(cut);
        bytes = BLOCK;
    }
}

/// Where the last line ends that no other continues and that is known to be whole.
fn last_end(text: &[u8]) -> Option<usize> {
    // A CR that is last may have its LF behind.
    let mut end = if text.ends_with(b"\r") { text.len() - 1 } else { text.len() };
    loop {
        end = 1 + text[..end].iter().rposition(|&byte| byte == b'\n' || byte == b'\r')?;
        let line = &text[..end];
        let line =
            line.strip_suffix(b"\r\n").or_else(|| line.strip_suffix(b"\n")).unwrap_or(&line[..end - 1]);
        let goes_on = line.ends_with(b"\\");
        let is_half = text[end - 1] == b'\r' && text.get(end) == Some(&b'\n');
        if !goes_on && !is_half {
            return Some(end);
        }
        end -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_end_where_statements_do() {
        for (text, end) in [
            ("v 1\nv 2", Some(4)),
            ("v 1\r\nv 2", Some(5)),
            ("v 1\r", None),
            ("v 1\rv 2\r", Some(4)),
            ("v 1\nv \\\n 2", Some(4)),
            ("v 1\nv \\\r\n 2", Some(4)),
            ("v \\\n 2 3", None),
        ] {
            assert_eq!(last_end(text.as_bytes()), end, "{text:?}");
        }
    }
}
