//! Turns the bytes of an XML file into text, in the encoding that the file has or declares.
//!
//! What a program needs of such a file, its elements and numbers, is ASCII. Names may be in any language, and one bad byte
//! in a name is no reason to refuse a file: it is replaced by U+FFFD.

use std::borrow::Cow;

/// The most bytes from the beginning of a file in which its encoding is declared. Comments may stand before the declaration.
const DECLARATION_BYTES: usize = 1024;

/// An encoding, which decides how many bytes the text takes at most for each byte of the file.
#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Utf8,
    /// Each byte is one character.
    Latin1,
    Utf16 {
        is_big_endian: bool,
    },
}

/// Returns the text of an XML file without its byte order mark. UTF-16 is recognised by the mark or by the zero byte of the first
/// character, which is ASCII; ISO-8859-1 must be declared, and Windows-1252 counts as ISO-8859-1. Every other encoding is read as UTF-8, and bytes that are none
/// are replaced, so that only names can differ from what was meant.
pub fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    match encoding(bytes) {
        Encoding::Utf8 => {
            let mut bytes = bytes;
            while let Some(rest) = bytes.strip_prefix(b"\xef\xbb\xbf") {
                bytes = rest;
            }
            let mut text = match str::from_utf8(bytes) {
                Ok(text) => return Cow::Borrowed(text),
                Err(_) => String::with_capacity(3 * bytes.len()),
            };
            for chunk in bytes.utf8_chunks() {
                text += chunk.valid();
                if !chunk.invalid().is_empty() {
                    text.push(char::REPLACEMENT_CHARACTER);
                }
            }
            Cow::Owned(text)
        }
        Encoding::Latin1 if bytes.is_ascii() => String::from_utf8_lossy(bytes),
        Encoding::Latin1 => {
            let mut text = String::with_capacity(2 * bytes.len());
            text.extend(bytes.iter().map(|&byte| char::from(byte)));
            Cow::Owned(text)
        }
        Encoding::Utf16 { is_big_endian } => {
            let unit = if is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            let units = bytes.as_chunks::<2>().0.iter().map(|&pair| unit(pair));
            let mut text = String::with_capacity(3 * bytes.len().div_ceil(2));
            let characters =
                char::decode_utf16(units).map(|found| found.unwrap_or(char::REPLACEMENT_CHARACTER));
            text.extend(characters.skip_while(|&character| character == '\u{feff}'));
            Cow::Owned(text)
        }
    }
}

/// Returns the bytes of memory that the text of a file takes beside the file.
pub(crate) fn bytes_of_text(bytes: &[u8]) -> u64 {
    let length = bytes.len() as u64;
    match encoding(bytes) {
        Encoding::Utf8 if str::from_utf8(bytes).is_ok() => 0,
        Encoding::Latin1 if bytes.is_ascii() => 0,
        Encoding::Utf8 => 3 * length,
        Encoding::Latin1 | Encoding::Utf16 { .. } => 2 * length,
    }
}

fn encoding(bytes: &[u8]) -> Encoding {
    match bytes {
        [0xff, 0xfe, ..] | [1..0x80, 0, ..] => return Encoding::Utf16 { is_big_endian: false },
        [0xfe, 0xff, ..] | [0, 1..0x80, ..] => return Encoding::Utf16 { is_big_endian: true },
        _ => {}
    }
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(DECLARATION_BYTES)]).to_ascii_lowercase();
    let declaration = head.split("<?xml").nth(1).and_then(|rest| rest.split("?>").next());
    let value = declaration.and_then(|declaration| declaration.split("encoding").nth(1));
    let value = value.map(|value| value.trim_start_matches([' ', '\t', '\r', '\n', '=', '"', '\'']));
    let name = value.and_then(|value| value.split(['"', '\'']).next()).unwrap_or_default();
    match name {
        "iso-8859-1" | "iso8859-1" | "iso_8859-1" | "latin1" | "latin-1" | "windows-1252" | "cp1252" => {
            Encoding::Latin1
        }
        _ => Encoding::Utf8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_the_same_in_each_encoding() {
        let text = |encoding: &str| {
            format!("<?xml version=\"1.0\" encoding=\"{encoding}\"?>\n<a b='Gr\u{fc}\u{df}e'/>")
        };
        let latin = |text: &str| text.chars().map(|character| character as u8).collect::<Vec<u8>>();
        for encoding in ["UTF-8", "utf8", "US-ASCII", "GBK", "UTF-16"] {
            assert_eq!(text_of(text(encoding).as_bytes()), text(encoding));
        }
        for encoding in ["ISO-8859-1", "iso-8859-1", "latin1", "Windows-1252"] {
            let bytes = latin(&text(encoding));
            assert_eq!(text_of(&bytes), text(encoding));
            assert!(text_of(&bytes).len() as u64 <= bytes_of_text(&bytes));
        }
        // Blank lines and comments before the declaration.
        for before in ["\n\n", "<!-- made by hand -->\n", &format!("<!-- {} -->", "long ".repeat(150))] {
            let said = before.to_owned() + &text("ISO-8859-1");
            assert_eq!(text_of(&latin(&said)), said);
        }
        for mark in ["\u{feff}", "", "\n", "\r\n \t"] {
            let said = mark.trim_start_matches('\u{feff}').to_owned() + &text("UTF-16");
            let units: Vec<u16> = (mark.to_owned() + &text("UTF-16")).encode_utf16().collect();
            assert_eq!(text_of(&units.iter().flat_map(|unit| unit.to_le_bytes()).collect::<Vec<_>>()), said);
            assert_eq!(text_of(&units.iter().flat_map(|unit| unit.to_be_bytes()).collect::<Vec<_>>()), said);
        }
        assert_eq!(text_of(b"\xef\xbb\xbf\xef\xbb\xbf<a/>"), "<a/>");
    }

    #[test]
    fn bad_bytes_are_replaced() {
        assert_eq!(text_of(b"<a b='Gr\xfc\xdfe'/>"), "<a b='Gr\u{fffd}\u{fffd}e'/>");
        assert_eq!(bytes_of_text(b"<a b='\xfc'/>"), 30);
        assert_eq!(text_of(b"\xff\xfe<\0a\0\x01\xd8/\0>\0"), "<a\u{fffd}/>");
        assert_eq!(text_of(b""), "");
    }
}
