//! Writes JSON that may stand in a `script` element: it has no `<`, and no line separators of Unicode.

use serde::Serialize;
use serde_json::ser::{Formatter, Serializer};
use std::io::{self, Write};

/// Writes a value as JSON on one line. Finite numbers have the fewest digits that give back the same `f64`.
pub(crate) fn write(value: &impl Serialize, out: impl Write) -> io::Result<()> {
    value.serialize(&mut Serializer::with_formatter(out, ForScript)).map_err(io::Error::from)
}

/// Returns whether a flag is left out.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "the form that serde calls")]
pub(crate) fn is_false(flag: &bool) -> bool {
    !flag
}

/// Writes compact JSON, and escapes more than JSON asks for.
struct ForScript;

/// Returns the escape of a character that must not stand in a page as it is. `<` may end the element, or begin a comment
/// in it. U+2028 and U+2029 end a line in old JavaScript.
fn escape_of(character: char) -> Option<&'static [u8]> {
    match character {
        '<' => Some(b"\\u003c"),
        '\u{2028}' => Some(b"\\u2028"),
        '\u{2029}' => Some(b"\\u2029"),
        _ => None,
    }
}

impl Formatter for ForScript {
    fn write_string_fragment<W: Write + ?Sized>(&mut self, out: &mut W, fragment: &str) -> io::Result<()> {
        let mut rest = fragment;
        while let Some((at, escape)) = rest.char_indices().find_map(|(at, c)| Some((at, escape_of(c)?))) {
            out.write_all(&rest.as_bytes()[..at])?;
            out.write_all(escape)?;
            // The character that was found is the first of the rest.
            let mut after = rest[at..].chars();
            after.next();
            rest = after.as_str();
        }
        out.write_all(rest.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(value: &impl Serialize) -> String {
        let mut bytes = Vec::new();
        write(value, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn nothing_ends_the_element() {
        let hostile = "</script><!-- \u{2028}\u{2029} \"quoted\" \\ \u{1} \u{fffd} é";
        let written = text(&hostile);
        assert_eq!(
            written,
            "\"\\u003c/script>\\u003c!-- \\u2028\\u2029 \\\"quoted\\\" \\\\ \\u0001 \u{fffd} é\""
        );
        assert_eq!(serde_json::from_str::<String>(&written).unwrap(), hostile);
        assert_eq!(text(&"<<"), "\"\\u003c\\u003c\"");
        assert_eq!(text(&""), "\"\"");
    }

    #[test]
    fn numbers_come_back_with_the_same_bits() {
        let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
        let random = std::iter::repeat_with(|| {
            bits = bits.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            f64::from_bits(bits)
        });
        let edges = [0.0, -0.0, 0.1, 1e23, 5e-324, f64::MAX, f64::MIN_POSITIVE, 1.0 / 3.0, -60.5];
        let numbers: Vec<f64> =
            edges.into_iter().chain(random.filter(|x| x.is_finite()).take(1000)).collect();
        let read: Vec<f64> = serde_json::from_str(&text(&numbers)).unwrap();
        assert!(numbers.iter().zip(&read).all(|(one, other)| one.to_bits() == other.to_bits()));
    }
}
