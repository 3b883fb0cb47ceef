//! Reads the JSON of a glTF file, which is kept in memory as a whole, after it has been charged.

use super::schema::{self, Asset, Document};
use super::version::Version;
use super::{data, extensions};
use crate::error::{Fault, Halt, Place, excerpt, sentence};
use crate::input::input_file::{InputFile, RandomAccess};
use crate::progress::Progress;
use crate::storage::resources::{Allowance, READING_BYTES};

/// Bytes of memory per byte of JSON: the text, the strings in it, and data URIs decoded.
const BYTES_PER_BYTE: u64 = 3;
/// Bytes of memory per object of the JSON, the most that one takes with what the scene knows of it. Lists that grow have
/// room for twice as many.
const BYTES_PER_OBJECT: u64 = 1280;
/// Bytes of memory per comma, which precedes an item of a list or a field.
const BYTES_PER_COMMA: u64 = 64;

const _: () = {
    assert!(size_of::<schema::Node>() <= BYTES_PER_OBJECT as usize / 3);
    assert!(size_of::<data::Accessor>() <= BYTES_PER_OBJECT as usize / 3);
    assert!(size_of::<schema::Primitive>() <= BYTES_PER_OBJECT as usize / 3);
};

/// A parsed document, and where the file has bytes embedded: their offset and number.
pub(super) struct Parsed {
    pub(super) document: Document,
    pub(super) blob: Option<(u64, u64)>,
    /// The memory that is left.
    pub(super) left: Allowance,
}

/// Reads and parses the JSON of a file, if there is memory for it.
pub(super) fn read(
    input: &InputFile,
    access: &RandomAccess,
    memory: Allowance,
    progress: &Progress,
) -> Result<Parsed, Halt> {
    let length = access.length();
    let memory = memory.less(input.bytes_in_memory());
    let part = |start: u64, bytes: u64| {
        memory.require(bytes.saturating_mul(BYTES_PER_BYTE))?;
        let mut part = vec![0; bytes as usize];
        let read = access.read_at(&mut part, start, progress);
        read.map_err(|source| Halt::from(Fault::Io { path: input.path().to_owned(), source }))?;
        Ok::<_, Halt>(part)
    };
    let head = part(0, length.min(12))?;
    let is_binary = head.starts_with(b"glTF");
    let (text, blob) = if is_binary {
        let [text, blob] = chunks(&head, length, |at| part(at, 8))?;
        let text = text.ok_or_else(|| Fault::new(Place::Byte(12), "a JSON chunk", "the end of the file"))?;
        (part(text.0, text.1)?, blob)
    } else {
        (part(0, length)?, None)
    };
    let count = |byte: u8| memchr::memchr_iter(byte, &text).count() as u64;
    let (objects, commas) = (count(b'{') * BYTES_PER_OBJECT, count(b',') * BYTES_PER_COMMA);
    memory.require(text.len() as u64 * BYTES_PER_BYTE + objects + commas)?;
    let document = parse(&text, blob.is_some())?;
    let buffers = document.buffers.iter().fold(0u64, |sum, buffer| sum.saturating_add(buffer.byte_length));
    let reading = (2 * buffers.min(READING_BYTES)).min(READING_BYTES);
    let taken = text.len() as u64 * BYTES_PER_BYTE + objects + commas + reading;
    memory.require(taken)?;
    Ok(Parsed { document, blob, left: memory.less(taken) })
}

/// Finds the chunks of a binary file: the offset and the number of bytes of its JSON and of the embedded bytes.
fn chunks(
    head: &[u8],
    length_of_file: u64,
    mut head_at: impl FnMut(u64) -> Result<Vec<u8>, Halt>,
) -> Result<[Option<(u64, u64)>; 2], Halt> {
    let word = |bytes: &[u8], at: usize| {
        let bytes = bytes.get(at..at + 4).and_then(|word| word.try_into().ok());
        bytes.map_or(0, u32::from_le_bytes)
    };
    let (version, length) = (word(head, 4), u64::from(word(head, 8)));
    if version != 2 {
        return Err(
            Fault::new(Place::Byte(4), "binary glTF of version 2", format!("version {version}")).into()
        );
    }
    if length > length_of_file {
        let expected = format!("a length of at most {length_of_file}");
        return Err(Fault::new(Place::Byte(8), expected, length.to_string()).into());
    }
    let mut chunks = [None; 2];
    let mut at = 12;
    for (chunk, kind) in chunks.iter_mut().zip([b"JSON", b"BIN\0"]) {
        if at + 8 > length {
            break;
        }
        let head = head_at(at)?;
        let (size, name) = (u64::from(word(&head, 0)), &head[4..]);
        if name != kind || at + 8 + size > length {
            let expected = format!("a chunk {} inside the file", excerpt(kind));
            let found = format!("{} of {size} bytes", excerpt(name));
            return Err(Fault::new(Place::Byte(at), expected, found).into());
        }
        *chunk = Some((at + 8, size));
        at += 8 + size;
    }
    Ok(chunks)
}

fn parse(text: &[u8], is_binary: bool) -> Result<Document, Fault> {
    // A byte order mark says that the text is UTF-8, as it must be. Writers of binary files fill the chunk up.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let is_filler = |byte: &u8| matches!(byte, 0 | 0x1a) || byte.is_ascii_whitespace();
    let text = &text[..text.iter().rposition(|byte| !is_filler(byte)).map_or(0, |last| last + 1)];
    let document: Document = serde_json::from_slice(text).map_err(|error| {
        // A file of another version may have other types, and its version says more than they do.
        if let Some(fault) = Version::of(text).and_then(Version::check) {
            return fault;
        }
        let place = if is_binary { Place::File } else { Place::Line(error.line() as u64) };
        Fault::new(place, "a glTF document", sentence(&error.to_string()))
    })?;
    let Asset { version, min_version } = &document.asset;
    let version = Version { stated: Some(version.clone()), least: min_version.clone() };
    if let Some(fault) = version.check() {
        return Err(fault);
    }
    extensions::check(&document)?;
    document.check()?;
    Ok(document)
}
