//! Cuts an OBJ file into blocks of whole statements.

use crate::input::byte_reader::ByteReader;
use std::io::Read;

/// The number of bytes in a block, unless a statement is longer.
pub(super) const BLOCK_BYTES: usize = 1 << 20;
/// The most bytes of a statement.
const MAX_STATEMENT_BYTES: usize = 1 << 24;

/// The error of a statement that exceeds the limit.
pub(super) struct TooLong {
    /// The most bytes of a statement.
    pub(super) most: u64,
}

/// Returns the length of the next block, which is then in the reader's buffer, or `None` at the end of the file.
pub(super) fn next_block<R: Read>(reader: &mut ByteReader<R>) -> Result<Option<usize>, TooLong> {
    let mut bytes = BLOCK_BYTES;
    loop {
        let text = reader.peek(bytes);
        if text.is_empty() {
            return Ok(None);
        }
        if text.len() < bytes {
            return Ok(Some(text.len()));
        }
        if let Some(length) = last_end(text) {
            return Ok(Some(length));
        }
        if bytes >= MAX_STATEMENT_BYTES {
            return Err(TooLong { most: MAX_STATEMENT_BYTES as u64 });
        }
        bytes *= 2;
    }
}

/// Returns the end of the last line that is known to be complete and that no other line continues.
fn last_end(text: &[u8]) -> Option<usize> {
    // A CR at the end may be followed by its LF.
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
