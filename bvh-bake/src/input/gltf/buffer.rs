//! Finds the bytes of glTF buffers: embedded in the file, in a base64 URI, or in a file beside it.
//!
//! Bytes are read where and when an accessor needs them, so that no buffer of a file is in memory.

use super::beside::{Beside, Folder};
use super::data::View;
use super::schema::{Document, part};
use crate::error::{Fault, Place, excerpt};
use crate::input::input_file::RandomAccess;
use crate::progress::Progress;
use crate::storage::read_exact_at;
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// The most files that are open at the same time, because systems limit that.
const MAX_OPEN_FILES: usize = 64;

/// The buffers of a document.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    path: &'a Path,
    blob: Option<Bytes<'a>>,
    folder: Folder<'a>,
    progress: &'a Progress,
    /// The decoded URIs, by the number of the buffer.
    decoded: HashMap<usize, Rc<Vec<u8>>>,
    /// The open files, by the number of the buffer.
    open: HashMap<usize, Bytes<'a>>,
    /// The files that count in `total`, and the buffers in memory that do.
    counted: HashSet<PathBuf>,
    counted_in_memory: HashSet<usize>,
    /// The bytes of all buffers found so far. A file that several buffers name counts once.
    pub(super) total: u64,
}

/// The bytes of a buffer.
#[derive(Clone)]
pub(super) struct Bytes<'a> {
    place: Found<'a>,
    /// The offset of the first byte.
    start: u64,
    pub(super) length: u64,
    progress: &'a Progress,
    /// The file for messages.
    path: Rc<Path>,
}

#[derive(Clone)]
enum Found<'a> {
    Document(&'a RandomAccess<'a>),
    Decoded(Rc<Vec<u8>>),
    File(Rc<File>),
}

impl Bytes<'_> {
    /// Reads bytes from an offset on. The caller has compared their end with `length`.
    pub(super) fn read(&self, offset: u64, into: &mut [u8]) -> Result<(), Fault> {
        let offset = self.start + offset;
        let read = match &self.place {
            Found::Document(document) => document.read_at(into, offset, self.progress),
            Found::Decoded(bytes) => {
                into.copy_from_slice(&bytes[offset as usize..][..into.len()]);
                Ok(())
            }
            Found::File(file) => {
                self.progress.add_input_read(into.len() as u64);
                self.progress.go_on_with_io().and_then(|()| read_exact_at(file, into, offset))
            }
        };
        read.map_err(|source| Fault::Io { path: self.path.to_path_buf(), source })
    }
}

impl<'a> Buffers<'a> {
    /// Makes the buffers of a document. `blob` is where the document has bytes embedded: their offset and number.
    pub(super) fn new(
        document: &'a Document,
        path: &'a Path,
        access: &'a RandomAccess<'a>,
        blob: Option<(u64, u64)>,
        allows_outside: bool,
        progress: &'a Progress,
    ) -> Self {
        let blob = blob.map(|(start, length)| Bytes {
            place: Found::Document(access),
            start,
            length,
            progress,
            path: path.into(),
        });
        Buffers {
            document,
            path,
            blob,
            folder: Folder::of(path, allows_outside),
            progress,
            decoded: HashMap::new(),
            open: HashMap::new(),
            counted: HashSet::new(),
            counted_in_memory: HashSet::new(),
            total: 0,
        }
    }

    /// Returns a view that an accessor needs.
    pub(super) fn view(&self, view: usize, accessor: usize) -> Result<&'a View, Fault> {
        part(&self.document.buffer_views, "bufferViews", view, || format!("accessors[{accessor}].bufferView"))
    }

    /// Returns the bytes of a view's buffer, exactly as many as that declares.
    pub(super) fn bytes(&mut self, view: usize, accessor: usize) -> Result<Bytes<'a>, Fault> {
        let buffer = self.view(view, accessor)?.buffer;
        let user = || format!("bufferViews[{view}].buffer");
        let declared = part(&self.document.buffers, "buffers", buffer, user)?.byte_length;
        let mut bytes = self.find(buffer)?;
        if bytes.length < declared {
            let expected = format!("{declared} bytes in buffer {buffer}");
            return Err(Fault::new(Place::File, expected, bytes.length.to_string()));
        }
        bytes.length = declared;
        Ok(bytes)
    }

    fn find(&mut self, index: usize) -> Result<Bytes<'a>, Fault> {
        let Some(uri) = &self.document.buffers[index].uri else {
            let missing = || Fault::new(Place::File, "a BIN chunk with buffer 0", format!("buffer {index}"));
            let blob = self.blob.clone().filter(|_| index == 0).ok_or_else(missing)?;
            self.count_in_memory(index, blob.length);
            return Ok(blob);
        };
        if let Some(data) = uri.strip_prefix("data:") {
            let bytes = match self.decoded.get(&index) {
                Some(bytes) => bytes.clone(),
                None => {
                    let encoded = data
                        .split_once(";base64,")
                        .and_then(|(_, encoded)| decode_base64(encoded.as_bytes()));
                    let refused = || Fault::new(Place::File, "a data URI in base64", excerpt(uri.as_bytes()));
                    let bytes = Rc::new(encoded.ok_or_else(refused)?);
                    self.decoded.insert(index, bytes.clone());
                    bytes
                }
            };
            let length = bytes.len() as u64;
            self.count_in_memory(index, length);
            let (path, progress) = (self.path.into(), self.progress);
            return Ok(Bytes { place: Found::Decoded(bytes), start: 0, length, progress, path });
        }
        if let Some(bytes) = self.open.get(&index) {
            return Ok(bytes.clone());
        }
        if self.open.len() == MAX_OPEN_FILES {
            self.open.clear();
        }
        let Beside { file, path, length } = self.folder.open(uri)?;
        let bytes = Bytes {
            place: Found::File(Rc::new(file)),
            start: 0,
            length,
            progress: self.progress,
            path: path.as_path().into(),
        };
        if self.counted.insert(path) {
            self.total += length;
        }
        self.open.insert(index, bytes.clone());
        Ok(bytes)
    }

    fn count_in_memory(&mut self, index: usize, length: u64) {
        if self.counted_in_memory.insert(index) {
            self.total += length;
        }
    }
}

/// Decodes base64, with or without padding, in the usual alphabet or the one for URLs.
fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.strip_suffix(b"=").unwrap_or(text);
    let text = text.strip_suffix(b"=").unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for &character in group {
            let six = match character {
                b'A'..=b'Z' => character - b'A',
                b'a'..=b'z' => character - b'a' + 26,
                b'0'..=b'9' => character - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(six);
        }
        bits <<= 6 * (4 - group.len());
        match group.len() {
            1 => return None,
            length => bytes.extend_from_slice(&bits.to_be_bytes()[1..length]),
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_decoded() {
        for (text, plain) in [("", ""), ("TQ==", "M"), ("TWE=", "Ma"), ("TWFu", "Man"), ("TWFuTQ", "ManM")] {
            assert_eq!(decode_base64(text.as_bytes()).as_deref(), Some(plain.as_bytes()), "{text}");
        }
        for text in ["T", "TWF=u", "TW\n", "====="] {
            assert_eq!(decode_base64(text.as_bytes()), None, "{text}");
        }
    }
}
