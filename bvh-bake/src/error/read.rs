//! The errors of reading a mesh file, each told in one line.

use super::{BakeError, InputError};
use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// The most bytes of an offending text that an error quotes.
const EXCERPT_BYTES: usize = 60;

/// The reason why a mesh file could not be read. The message is one line that names the file and the place.
///
/// ```
/// use bvh_bake::input::{MeshFormat, Place, ReadError, read_bytes};
///
/// let found = read_bytes(b"v 0 0 zero\n", MeshFormat::Obj, "part.obj".as_ref()).unwrap_err();
/// assert!(matches!(found, ReadError::Invalid { place: Place::Line(1), .. }));
/// println!("{found}");
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused to read the file.
    #[error("{}: expected a readable file, found {source}", quoted(path))]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The bytes break the rules of the mesh format.
    #[error("{}: {place}expected {expected}, found {found}", quoted(path))]
    Invalid {
        /// The file.
        path: PathBuf,
        /// The place in the file.
        place: Place,
        /// What the format requires at that place.
        expected: Cow<'static, str>,
        /// What was found there, shortened and without control characters.
        found: String,
    },
    /// The file can be read, but its mesh breaks the input contract.
    #[error("{}: {source}", quoted(path))]
    Mesh {
        /// The file.
        path: PathBuf,
        /// The way in which it breaks the contract.
        source: InputError,
    },
    /// The file exceeds a limit of the reader.
    #[error("{}: {place}expected at most {most} {what}, found more", quoted(path))]
    Limit {
        /// The file.
        path: PathBuf,
        /// The place in the file.
        place: Place,
        /// The limit.
        most: u64,
        /// The things that are limited.
        what: &'static str,
    },
}

/// A place in a file.
///
/// [`ReadError`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A line, counted from 1.
    Line(u64),
    /// An offset in bytes, counted from 0.
    Byte(u64),
    /// The file as a whole.
    File,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(f, "line {line}: "),
            Place::Byte(byte) => write!(f, "byte {byte}: "),
            Place::File => Ok(()),
        }
    }
}

impl ReadError {
    /// Returns whether the file exceeds a limit of the reader or the format, rather than being malformed.
    pub fn is_limit(&self) -> bool {
        match self {
            ReadError::Limit { .. } => true,
            ReadError::Mesh { source, .. } => source.is_limit(),
            _ => false,
        }
    }
}

/// The reason why reading stopped.
#[derive(Debug)]
pub(crate) enum Halt {
    /// The file is wrong.
    Fault(Fault),
    /// The operating system refused to read the file.
    Io(io::Error),
    /// The data that were read could not be kept.
    Bake(Box<BakeError>),
    /// The file takes more memory at once than the budget allows.
    Memory {
        /// The bytes of the budget that are enough.
        needed: u64,
        budget: u64,
    },
}

impl From<ReadError> for Halt {
    fn from(error: ReadError) -> Self {
        Self::Bake(Box::new(error.into()))
    }
}

impl From<Fault> for Halt {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

impl From<BakeError> for Halt {
    fn from(error: BakeError) -> Self {
        Self::Bake(Box::new(error))
    }
}

impl Halt {
    pub(crate) fn in_file(self, path: &Path) -> BakeError {
        match self {
            Self::Fault(fault) => fault.in_file(path).into(),
            Self::Io(source) => ReadError::Io { path: path.to_owned(), source }.into(),
            Self::Bake(error) => *error,
            Self::Memory { needed, budget } => {
                BakeError::Memory { input: path.to_owned(), triangles: 0, needed, budget }
            }
        }
    }
}

/// A [`ReadError`] without the name of its file.
#[derive(Debug)]
pub(crate) enum Fault {
    Invalid {
        place: Place,
        expected: Cow<'static, str>,
        found: String,
    },
    Limit {
        place: Place,
        most: u64,
        what: &'static str,
    },
    /// The operating system refused to read another file that the mesh file names.
    Io {
        path: PathBuf,
        source: io::Error,
    },
}

impl Fault {
    pub(crate) fn new(
        place: Place,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<String>,
    ) -> Self {
        Fault::Invalid { place, expected: expected.into(), found: found.into() }
    }

    pub(crate) fn in_file(self, path: &Path) -> ReadError {
        let own = path.to_owned();
        match self {
            Fault::Invalid { place, expected, found } => {
                ReadError::Invalid { path: own, place, expected, found }
            }
            Fault::Limit { place, most, what } => ReadError::Limit { path: own, place, most, what },
            Fault::Io { path, source } => ReadError::Io { path, source },
        }
    }
}

/// Quotes text of a file for a message: one line, no control characters, at most about 60 bytes.
pub(crate) fn excerpt(text: &[u8]) -> String {
    let mut head = &text[..text.len().min(EXCERPT_BYTES)];
    // A quotation ends after a word, unless one word is most of it.
    let is_cut = text.get(EXCERPT_BYTES).is_some_and(|byte| !byte.is_ascii_whitespace());
    if let Some(end) =
        head.iter().rposition(u8::is_ascii_whitespace).filter(|&end| is_cut && end > EXCERPT_BYTES / 2)
    {
        head = &head[..end];
    }
    let mut quoted = String::from_utf8_lossy(head).escape_debug().to_string();
    if quoted.chars().count() > EXCERPT_BYTES {
        quoted = quoted.chars().take(EXCERPT_BYTES).collect();
    }
    if head.len() < text.len() {
        quoted.push('…');
    }
    quoted
}

/// The most letters of a parser's message that an error repeats.
const SENTENCE_LETTERS: usize = 240;

/// Repeats the message of a parser, on one line and without control characters. A message that is longer than any parser needs,
/// because it quotes the file, ends after a word.
pub(crate) fn sentence(message: &str) -> String {
    let whole = plain(message);
    match whole.char_indices().nth(SENTENCE_LETTERS) {
        None => whole,
        Some((end, _)) => {
            let head = &whole[..end];
            format!("{} …", head.rsplit_once(' ').map_or(head, |(words, _)| words))
        }
    }
}

/// Quotes a whole path without its control characters.
pub(crate) fn quoted(path: &Path) -> String {
    plain(&path.to_string_lossy())
}

/// Escapes control characters.
fn plain(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_debug().collect() } else { vec![c] }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_short_line() {
        let found = excerpt(&[b'\n'; 5000]);
        assert!(found.len() < 80, "{found}");
        let error = Fault::new(Place::Line(7), "a number", excerpt(b"a\x1b[31m\0\xff"))
            .in_file(Path::new("x\ny.obj"));
        let said = error.to_string();
        assert!(!said.chars().any(char::is_control), "{said}");
        assert!(said.starts_with("x\\ny.obj: line 7: expected a number, found a"), "{said}");
    }
}
