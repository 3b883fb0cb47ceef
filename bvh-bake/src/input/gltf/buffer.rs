//! Finds the bytes of glTF buffers: embedded in the file, in a base64 URI, or in a file beside it.

use crate::error::{Fault, Place, excerpt};
use crate::input::input_file::InputReader;
use crate::progress::Progress;
use gltf::Buffer;
use gltf::buffer::Source;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The buffers read so far.
pub(super) struct Buffers<'a> {
    blob: Option<&'a [u8]>,
    document: &'a Path,
    progress: &'a Progress,
    read: HashMap<usize, Cow<'a, [u8]>>,
    /// The number of bytes of all buffers.
    pub(super) total: u64,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(blob: Option<&'a [u8]>, document: &'a Path, progress: &'a Progress) -> Self {
        Buffers { blob, document, progress, read: HashMap::new(), total: 0 }
    }

    /// Returns the bytes of a buffer, exactly as many as it declares.
    pub(super) fn bytes(&mut self, buffer: &Buffer) -> Result<&[u8], Fault> {
        let index = buffer.index();
        if !self.read.contains_key(&index) {
            let bytes = self.find(buffer)?;
            self.total += bytes.len() as u64;
            self.read.insert(index, bytes);
        }
        let bytes = self.read.get(&index).map(|bytes| &bytes[..]).unwrap_or_default();
        bytes.get(..buffer.length()).ok_or_else(|| {
            let expected = format!("{} bytes in buffer {index}", buffer.length());
            Fault::new(Place::File, expected, bytes.len().to_string())
        })
    }

    fn find(&self, buffer: &Buffer) -> Result<Cow<'a, [u8]>, Fault> {
        let uri = match buffer.source() {
            Source::Bin => {
                let blob = self.blob.filter(|_| buffer.index() == 0).map(Cow::Borrowed);
                let missing = || {
                    Fault::new(Place::File, "a BIN chunk with buffer 0", format!("buffer {}", buffer.index()))
                };
                return blob.ok_or_else(missing);
            }
            Source::Uri(uri) => uri,
        };
        let refused = |expected: &'static str| Fault::new(Place::File, expected, excerpt(uri.as_bytes()));
        if let Some(data) = uri.strip_prefix("data:") {
            let encoded =
                data.split_once(";base64,").and_then(|(_, encoded)| decode_base64(encoded.as_bytes()));
            return encoded.map(Cow::Owned).ok_or_else(|| refused("a data URI in base64"));
        }
        let relative = decode_percent(uri).ok_or_else(|| refused("a percent-encoded URI"))?;
        let relative = PathBuf::from(relative);
        if uri.contains("://") || !relative.is_relative() {
            return Err(refused("a buffer in a file named relative to this one"));
        }
        let path = self.document.parent().unwrap_or(Path::new("")).join(relative);
        self.read_file(&path, buffer.length()).map(Cow::Owned).map_err(|source| Fault::Io { path, source })
    }

    /// Reads no more than `length` bytes, because the file may be one without an end.
    fn read_file(&self, path: &Path, length: usize) -> std::io::Result<Vec<u8>> {
        let mut input = InputReader::open(path, self.progress, 0)?;
        if !input.is_regular()? {
            return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a regular file"));
        }
        input.read_up_to(length as u64)
    }
}

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

fn decode_percent(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        if first == b'%' {
            let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &rest[2..];
        } else {
            bytes.push(first);
        }
    }
    String::from_utf8(bytes).ok()
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

    #[test]
    fn percent_signs_are_decoded() {
        assert_eq!(decode_percent("my%20mesh%C3%A9.bin").as_deref(), Some("my meshé.bin"));
        assert_eq!(decode_percent("a%2"), None);
        assert_eq!(decode_percent("a%zz"), None);
    }
}
