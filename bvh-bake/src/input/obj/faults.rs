//! Finds the error in an OBJ file by reading it a second time.
//!
//! The first reading parses blocks in parallel. It knows no line numbers, and at a face it does not know how many
//! vertices follow. The second reading goes line by line, first over all vertices and then over the faces, and reports
//! the first error.

use super::blocks::{TooLong, next_block};
use super::statements::{Index, Keyword, Statements, check_face, read_corner, read_vertex};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::input::byte_reader::ByteReader;
use crate::input::text::{Lines, words};
use crate::input::{COORDINATE, changed_meanwhile};
use crate::limits::MAX_VERTICES;
use std::io::Read;

/// Returns the error of the first malformed vertex or, if there is none, of the first malformed face. `open` opens the
/// file at its beginning.
pub(super) fn find<R: Read>(open: impl Fn() -> Result<ByteReader<R>, Halt>) -> Halt {
    match find_in(open) {
        Ok(()) => changed_meanwhile().into(),
        Err(halt) => halt,
    }
}

fn find_in<R: Read>(open: impl Fn() -> Result<ByteReader<R>, Halt>) -> Result<(), Halt> {
    let mut vertices = 0;
    walk(open()?, |keyword, statements, _| {
        if keyword == Keyword::Vertex {
            let line = statements.number;
            if vertices == MAX_VERTICES {
                return Err(
                    Fault::Limit { place: Place::Line(line), most: MAX_VERTICES, what: "vertices" }.into()
                );
            }
            read_vertex(statements.operands(), line)?;
            vertices += 1;
        }
        Ok(true)
    })?;
    let (mut above, mut triangles) = (0, 0);
    walk(open()?, |keyword, statements, _| {
        match keyword {
            Keyword::Vertex => above += 1,
            Keyword::Face => {
                let line = statements.number;
                let corners = || words(statements.operands()).take_while(|word| word[0] != b'#');
                let count = corners().count() as u64;
                for word in corners() {
                    // A face of fewer corners is left out, whatever vertices it names.
                    if count > 2 || !Index::is_valid(word) {
                        read_corner(word, line, above, vertices)?;
                    }
                }
                check_face(count, line, &mut triangles)?;
            }
            Keyword::Object | Keyword::Group | Keyword::LeftOut(_) => {}
        }
        Ok(true)
    })
}

/// Returns the error of a vertex that a face uses and that the format cannot hold, given the number of the vertex.
pub(super) fn misfit<R: Read>(reader: ByteReader<R>, vertex: u64) -> Halt {
    let mut seen = 0;
    let mut found = None;
    let walked = walk(reader, |keyword, statements, lines| {
        if keyword == Keyword::Vertex {
            if seen == vertex {
                let line = statements.number;
                found = Some(Fault::new(Place::Line(line), COORDINATE, lines.nth(line)));
            }
            seen += 1;
        }
        Ok(found.is_none())
    });
    match (walked, found) {
        (Err(halt), _) => halt,
        (Ok(()), Some(fault)) => fault.into(),
        (Ok(()), None) => changed_meanwhile().into(),
    }
}

/// The lines of the current block.
struct BlockLines<'a> {
    text: &'a [u8],
    /// The number of lines before the block.
    before: u64,
}

impl BlockLines<'_> {
    /// Returns a line, quoted, by its number in the file.
    fn nth(&self, line: u64) -> String {
        let line = Lines::continued(self.text, self.before).nth((line - self.before) as usize - 1);
        excerpt(line.unwrap_or_default().trim_ascii())
    }
}

/// Visits all statements that matter until `visit` returns false or an error.
fn walk<R: Read>(
    mut reader: ByteReader<R>,
    mut visit: impl FnMut(Keyword, &Statements, BlockLines) -> Result<bool, Halt>,
) -> Result<(), Halt> {
    reader.skip_mark();
    let mut before = 0;
    loop {
        let length = match next_block(&mut reader) {
            Ok(Some(length)) => length,
            Ok(None) => return reader.finish(Ok(())),
            Err(TooLong { most }) => {
                let place = Place::Line(before + 1);
                return Err(Fault::Limit { place, most, what: "bytes in a statement" }.into());
            }
        };
        let text = reader.peek(length);
        let mut statements = Statements::new(Lines::continued(text, before));
        let mut result = Ok(true);
        while let Ok(true) = result {
            let Some(keyword) = statements.advance() else { break };
            result = visit(keyword, &statements, BlockLines { text, before });
        }
        before = statements.line_number();
        if !matches!(result, Ok(true)) {
            return reader.finish(result.map(|_| ()));
        }
        reader.skip(length);
    }
}
