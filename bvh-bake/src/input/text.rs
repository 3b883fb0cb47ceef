//! Splits a text in memory into lines and words, with the line numbers that errors need.
//!
//! A line ends at LF, CR LF or a CR alone. Some files use CR alone, and the others never have a CR inside a line.

use crate::error::excerpt;
use memchr::{memchr, memchr2};

/// Returns whether a byte is a blank, which separates words within a line.
pub(crate) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

/// Returns whether a word only fills up a file: Ctrl-Z, which ends text on old systems, and NUL.
pub(crate) fn is_filler(word: &[u8]) -> bool {
    word.iter().all(|byte| [0, 0x1a].contains(byte))
}

/// Returns the words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|&byte| is_blank(byte)).filter(|word| !word.is_empty())
}

/// Reads a number as the nearest f64. NaN and infinity count as numbers here, also as the libraries of C compilers write them.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    match leading_decimal(word) {
        Some((value, length)) if length == word.len() => Some(value),
        _ => {
            let word = std::str::from_utf8(word).ok()?;
            word.parse().ok().or_else(|| no_number(word))
        }
    }
}

/// Reads `-nan(ind)`, `1.#QNAN`, `-1.#INF00` and their like.
fn no_number(word: &str) -> Option<f64> {
    let word = word.strip_prefix(['-', '+']).unwrap_or(word).to_ascii_lowercase();
    let is_name =
        |name: &str| name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-_".contains(&byte));
    if let Some(kind) = word.strip_prefix("nan(").and_then(|kind| kind.strip_suffix(')')) {
        return is_name(kind).then_some(f64::NAN);
    }
    let kind = word.strip_prefix("1.#").filter(|kind| is_name(kind))?;
    let is_nan = ["qnan", "snan", "ind"].iter().any(|name| kind.starts_with(name));
    match kind.starts_with("inf") {
        true => Some(f64::INFINITY),
        false => is_nan.then_some(f64::NAN),
    }
}

/// Quotes a word that is no number for a message, with the remedy if it has a decimal comma.
pub(crate) fn wrong_number(word: &[u8]) -> String {
    let remedy = if has_decimal_comma(word) { "; write a decimal point, not a comma" } else { "" };
    format!("{}{remedy}", excerpt(word))
}

/// Returns whether a word would be a number if it had a point for its comma.
pub(crate) fn has_decimal_comma(word: &[u8]) -> bool {
    memchr(b',', word).is_some_and(|at| {
        let mut with_point = word.to_vec();
        with_point[at] = b'.';
        number(&with_point).is_some()
    })
}

/// The powers of ten that f64 holds exactly.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];
/// The most digits, so that the number is below 10^18 and fits in 64 bits.
const MAX_DIGITS: usize = 18;

/// Reads the decimal number at the beginning of a text, up to a blank or the end of the text. Returns the nearest f64
/// and the number of bytes read, or `None` if only the standard library can find the nearest f64.
///
/// A decimal is an integer times a power of ten. If f64 represents both exactly, one multiplication or division gives
/// the nearest f64 (Clinger, How to Read Floating Point Numbers Accurately, 1990, section 3).
#[inline]
pub(crate) fn leading_decimal(text: &[u8]) -> Option<(f64, usize)> {
    let is_negative = text.first() == Some(&b'-');
    let start = usize::from(is_negative);
    let (mut at, mut integer, mut fraction) = (start, 0u64, 0);
    let mut digits = |at: &mut usize| {
        let first = *at;
        while let Some(digit) = text.get(*at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10)
        {
            // Numbers with too many digits are refused below.
            integer = integer.wrapping_mul(10).wrapping_add(u64::from(digit));
            *at += 1;
        }
        *at - first
    };
    let mut count = digits(&mut at);
    if text.get(at) == Some(&b'.') {
        at += 1;
        fraction = digits(&mut at);
        count += fraction;
    }
    if count == 0 || count > MAX_DIGITS || integer > 1 << 53 {
        return None;
    }
    let mut exponent = -(fraction as i32);
    if let Some(b'e' | b'E') = text.get(at) {
        let sign = text.get(at + 1);
        at += 1 + usize::from(matches!(sign, Some(b'-' | b'+')));
        let first = at;
        let mut written = 0;
        while let Some(digit) = text.get(at).filter(|byte| byte.is_ascii_digit()) {
            written = written * 10 + i32::from(digit - b'0');
            at += 1;
            if at - first > 3 {
                return None;
            }
        }
        if at == first {
            return None;
        }
        exponent += if sign == Some(&b'-') { -written } else { written };
    }
    if text.get(at).is_some_and(|&byte| !is_blank(byte)) {
        return None;
    }
    let power = POWERS_OF_TEN.get(exponent.unsigned_abs() as usize)?;
    let value = if exponent < 0 { integer as f64 / power } else { integer as f64 * power };
    Some((if is_negative { -value } else { value }, at))
}

/// Reads the lines of a text.
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    /// The number of the line that was returned last, from 1.
    pub(crate) number: u64,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(text: &'a [u8]) -> Self {
        // A byte order mark only states that the file is UTF-8.
        Lines { rest: text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text), number: 0 }
    }

    /// Reads a text that follows after `number` lines.
    pub(crate) fn continued(text: &'a [u8], number: u64) -> Self {
        Lines { rest: text, number }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end = memchr2(b'\n', b'\r', self.rest).unwrap_or(self.rest.len());
        let (line, after) = self.rest.split_at(end);
        let ending = if after.starts_with(b"\r\n") { 2 } else { after.len().min(1) };
        self.rest = &after[ending..];
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    #[test]
    fn short_decimals_are_what_the_standard_library_reads() {
        let mut random = Random::new(1);
        let mut random = |below: u64| random.below(below as usize) as u64;
        let mut fast = 0;
        for _ in 0..100_000 {
            let digits = |count: u64, random: &mut dyn FnMut(u64) -> u64| -> String {
                (0..count).map(|_| char::from(b'0' + random(10) as u8)).collect()
            };
            let (before, after) = (random(11), random(11));
            let mut word = ["", "-", "+"][random(3) as usize].to_owned() + &digits(before, &mut random);
            if random(4) > 0 {
                word += ".";
                word += &digits(after, &mut random);
            }
            if random(3) == 0 {
                word += ["e", "E", "e-", "e+"][random(4) as usize];
                let count = random(4);
                word += &digits(count, &mut random);
            }
            let expected: Option<f64> = word.parse().ok();
            let bits = |value: Option<f64>| value.map(f64::to_bits);
            assert_eq!(bits(number(word.as_bytes())), bits(expected), "{word}");
            let line = word.clone() + " 7";
            if let Some((value, length)) = leading_decimal(line.as_bytes()) {
                fast += 1;
                assert_eq!((bits(Some(value)), length), (bits(expected), word.len()), "{word}");
            }
        }
        assert!(fast > 20_000, "{fast}");
        for word in ["", ".", "-", "e5", "1e", "1.e", "--1", "1,5", "1..2", "0x1"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        for word in ["nan", "-nan(ind)", "NAN(snan)", "1.#QNAN", "-1.#IND00", "1.#qnan0e+000"] {
            assert!(number(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        for word in ["inf", "1.#INF", "-1.#INF00"] {
            assert!(number(word.as_bytes()).is_some_and(f64::is_infinite), "{word}");
        }
        for word in ["nan(", "nan()x", "1.#", "1.#x", "2.#INF", "1.#INF/"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        assert_eq!(wrong_number(b"0,5"), "0,5; write a decimal point, not a comma");
        assert_eq!(wrong_number(b"a,5"), "a,5");
    }

    #[test]
    fn every_line_ending_counts_once() {
        let mut lines = Lines::new(b"\xef\xbb\xbfa\nb\r\nc\r\rd");
        let all: Vec<_> = lines.by_ref().collect();
        assert_eq!(all, [&b"a"[..], b"b", b"c", b"", b"d"]);
        assert_eq!(lines.number, 5);
    }
}
