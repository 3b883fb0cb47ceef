//! Reads PCD, the files of the Point Cloud Library, version 0.7: as text, binary or compressed by LZF.
//!
//! The reader needs the fields x, y and z, and drops the others. It does not apply the viewpoint. Binary numbers are
//! little-endian. Compressed data have the values of one field after those of another, and are read as a whole.

use super::byte_reader::{ByteReader, Words};
use super::indexed::IndexedFaces;
use super::input_file::InputFile;
use super::text::{has_decimal_comma, number, words as words_of, wrong_number};
use super::xyz::Points;
use crate::error::{Fault, Halt, Place, excerpt};
use crate::limits::MAX_TRIANGLES;
use crate::storage::resources::Resources;
use std::io::Read;

/// The most numbers of a point, which are kept in memory with their types.
const MAX_FIELDS: usize = 1 << 10;
/// The most bytes to which LZF expands one.
const MAX_EXPANSION: u64 = 88;

/// The fields that a point needs.
const AXES: [&[u8]; 3] = [b"x", b"y", b"z"];

/// The type of a number: its letter in a header, and its bytes.
#[derive(Clone, Copy, PartialEq, Default)]
struct Kind {
    letter: u8,
    bytes: usize,
}

impl Kind {
    /// Reads the number at the beginning of some bytes.
    fn number(self, bytes: &[u8]) -> Option<f64> {
        Some(match (self.letter, self.bytes) {
            (b'F', 4) => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
            (b'F', 8) => f64::from_le_bytes(*bytes.first_chunk()?),
            (b'I', 1) => f64::from(*bytes.first()? as i8),
            (b'I', 2) => f64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            (b'I', 4) => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
            (b'U', 1) => f64::from(*bytes.first()?),
            (b'U', 2) => f64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            (b'U', 4) => f64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            _ => return None,
        })
    }
}

#[derive(Clone, Default)]
struct Field {
    name: Vec<u8>,
    kind: Kind,
    /// How many numbers it has.
    count: usize,
}

impl Field {
    /// Returns the bytes that it has in a point.
    fn bytes(&self) -> usize {
        self.kind.bytes * self.count
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Data {
    Text,
    Binary,
    Compressed,
}

struct Header {
    fields: Vec<Field>,
    points: u64,
    data: Data,
}

/// Reads a file from its beginning to its end.
pub(super) fn read<R: Read>(
    reader: ByteReader<R>,
    faces: &mut IndexedFaces,
    input: &InputFile,
    resources: &Resources,
) -> Result<(), Halt> {
    let mut words = Words::new(reader);
    let mut points = Points::new(faces, input);
    let result = Header::read(&mut words).map_err(Halt::from).and_then(|header| match header.data {
        Data::Text => header.read_text(&mut words, &mut points).map(|()| words.place()),
        Data::Binary => {
            header.read_binary(&mut words.reader, &mut points)?;
            Ok(Place::Byte(words.reader.position()))
        }
        Data::Compressed => {
            header.read_compressed(&mut words.reader, &mut points, resources)?;
            Ok(Place::Byte(words.reader.position()))
        }
    });
    if let Ok(place) = &result {
        let rest = words.reader.take_rest();
        if rest > 0 {
            input.warnings().add(*place, format!("left out {rest} bytes after the last point"));
        }
    }
    words.reader.finish(result)?;
    points.finish()
}

impl Header {
    fn read<R: Read>(words: &mut Words<R>) -> Result<Self, Fault> {
        let (mut fields, mut points, mut size) = (Vec::<Field>::new(), None, [1u64; 2]);
        loop {
            let Some((line, _)) = words.line() else {
                return Err(Fault::new(
                    words.place(),
                    "DATA ascii, binary or binary_compressed",
                    "the end of the file",
                ));
            };
            let invalid = |expected: &'static str| Fault::new(words.place(), expected, excerpt(&line));
            let mut values = words_of(&line);
            let Some(key) = values.next() else { continue };
            let whole = |word: &[u8]| std::str::from_utf8(word).ok()?.parse::<u64>().ok();
            let mut of_fields = |set: &dyn Fn(&mut Field, &[u8]) -> Option<()>| {
                let mut fields = fields.iter_mut();
                let all =
                    values.by_ref().all(|word| fields.next().and_then(|field| set(field, word)).is_some());
                (all && fields.next().is_none()).then_some(())
            };
            match key {
                _ if key.starts_with(b"#") => {}
                b"VERSION" | b"VIEWPOINT" => {}
                b"FIELDS" | b"COLUMNS" => {
                    let field = |name: &[u8]| Field { name: name.to_vec(), count: 1, ..Field::default() };
                    fields = values.take(MAX_FIELDS + 1).map(field).collect();
                    if fields.len() > MAX_FIELDS {
                        return Err(invalid("at most 1024 fields"));
                    }
                }
                b"SIZE" => {
                    let size = |word: &[u8]| whole(word).filter(|size| [1, 2, 4, 8].contains(size));
                    of_fields(&|field, word| size(word).map(|size| field.kind.bytes = size as usize))
                        .ok_or_else(|| invalid("SIZE and 1, 2, 4 or 8 for each of the FIELDS above"))?;
                }
                b"TYPE" => {
                    let letter = |word: &[u8]| {
                        word.first().copied().filter(|_| [&b"F"[..], b"I", b"U"].contains(&word))
                    };
                    of_fields(&|field, word| letter(word).map(|letter| field.kind.letter = letter))
                        .ok_or_else(|| invalid("TYPE and F, I or U for each of the FIELDS above"))?;
                }
                b"COUNT" => {
                    let count = |word: &[u8]| whole(word).filter(|&count| count <= MAX_FIELDS as u64);
                    of_fields(&|field, word| count(word).map(|count| field.count = count as usize))
                        .ok_or_else(|| {
                            invalid("COUNT and a number up to 1024 for each of the FIELDS above")
                        })?;
                }
                b"WIDTH" | b"HEIGHT" | b"POINTS" => {
                    let value = values.next().and_then(whole).filter(|&value| value <= MAX_TRIANGLES);
                    let value = value.ok_or_else(|| invalid("a number of points below 2^32 - 1"))?;
                    match key {
                        b"WIDTH" => size[0] = value,
                        b"HEIGHT" => size[1] = value,
                        _ => points = Some(value),
                    }
                }
                b"DATA" => {
                    let data = match values.next() {
                        Some(b"ascii") => Data::Text,
                        Some(b"binary") => Data::Binary,
                        Some(b"binary_compressed") => Data::Compressed,
                        _ => return Err(invalid("DATA ascii, binary or binary_compressed")),
                    };
                    let is_number = |field: &Field| field.count == 1 && field.kind.number(&[0; 8]).is_some();
                    let has =
                        |axis: &[u8]| fields.iter().find(|field| field.name == axis).is_some_and(is_number);
                    if !AXES.into_iter().all(has) {
                        return Err(invalid(
                            "FIELDS x y z, each of one number of a known SIZE and TYPE, above DATA",
                        ));
                    }
                    let points = points.unwrap_or(size[0].saturating_mul(size[1]));
                    return Ok(Self { fields, points, data });
                }
                _ => {
                    return Err(invalid(
                        "VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS or DATA",
                    ));
                }
            }
        }
    }

    /// Returns the bytes of a point.
    fn point_bytes(&self) -> usize {
        self.fields.iter().map(Field::bytes).sum()
    }

    /// Returns for each coordinate the sum of a size over all fields before its own, and its type.
    fn axes(&self, size: fn(&Field) -> usize) -> [(Kind, usize); 3] {
        AXES.map(|axis| {
            let own = self.fields.iter().position(|field| field.name == axis);
            let own = own.expect("a checked header has the field");
            (self.fields[own].kind, self.fields[..own].iter().map(size).sum())
        })
    }

    fn read_text<R: Read>(&self, words: &mut Words<R>, points: &mut Points) -> Result<(), Halt> {
        let count = self.fields.iter().map(|field| field.count).sum::<usize>();
        let axes = self.axes(|field| field.count);
        while points.count() < self.points {
            let Some((line, _)) = words.line() else {
                let expected = format!("{} points", self.points);
                return Err(Fault::new(
                    words.place(),
                    expected,
                    format!("{} and the end of the file", points.count()),
                )
                .into());
            };
            let numbers: Vec<&[u8]> = words_of(&line).take(count + 1).collect();
            if numbers.is_empty() {
                continue;
            }
            let [x, y, z] = axes.map(|(_, place)| numbers.get(place).and_then(|word| number(word)));
            let (Some(x), Some(y), Some(z), true) = (x, y, z, numbers.len() == count) else {
                let expected = format!("a point: {count} numbers, as FIELDS and COUNT state");
                let wrong = numbers.iter().find(|word| has_decimal_comma(word));
                let found = wrong.map_or_else(|| excerpt(&line), |word| wrong_number(word));
                return Err(Fault::new(words.place(), expected, found).into());
            };
            points.add([x, y, z], words.place())?;
        }
        Ok(())
    }

    fn read_binary<R: Read>(&self, reader: &mut ByteReader<R>, points: &mut Points) -> Result<(), Halt> {
        let (bytes, axes) = (self.point_bytes(), self.axes(Field::bytes));
        self.expect_room(reader, reader.bytes_left() / bytes as u64)?;
        for _ in 0..self.points {
            let place = Place::Byte(reader.position());
            let record = reader.peek(bytes);
            let number = |(kind, at): (Kind, usize)| kind.number(record.get(at..)?);
            let [x, y, z] = axes.map(number);
            let (Some(x), Some(y), Some(z)) = (x, y, z) else {
                return Err(Fault::new(place, "a point", "the end of the file").into());
            };
            points.add([x, y, z], place)?;
            reader.skip(bytes);
        }
        Ok(())
    }

    fn read_compressed<R: Read>(
        &self,
        reader: &mut ByteReader<R>,
        points: &mut Points,
        resources: &Resources,
    ) -> Result<(), Halt> {
        let place = Place::Byte(reader.position());
        let sizes = [reader.take(), reader.take()].map(|size| size.map_or(0, u32::from_le_bytes));
        let [packed, whole] = sizes.map(u64::from);
        let left = reader.bytes_left();
        if packed > left || whole > packed * MAX_EXPANSION {
            let expected =
                format!("at most {left} bytes of compressed data, and {MAX_EXPANSION} times as many in all");
            return Err(Fault::new(place, expected, format!("{packed} and {whole}")).into());
        }
        self.expect_room(reader, whole / self.point_bytes() as u64)?;
        resources.keep(packed + whole)?;
        let data = expand(reader.peek(packed as usize), whole as usize);
        let data = data.ok_or_else(|| Fault::new(place, format!("LZF data of {whole} bytes"), "others"))?;
        reader.skip(packed as usize);
        let count = self.points as usize;
        // The values of a field follow each other.
        let axes = self.axes(Field::bytes).map(|(kind, at)| (kind, at * count));
        for number in 0..count {
            let value = |(kind, at): (Kind, usize)| kind.number(data.get(at + number * kind.bytes..)?);
            let [x, y, z] = axes.map(value);
            let (Some(x), Some(y), Some(z)) = (x, y, z) else {
                return Err(Fault::new(place, "all values of a field", "the end of the data").into());
            };
            points.add([x, y, z], place)?;
        }
        Ok(())
    }

    /// Refuses a file that declares more points than it has room for.
    fn expect_room<R: Read>(&self, reader: &ByteReader<R>, room: u64) -> Result<(), Fault> {
        if self.points <= room {
            return Ok(());
        }
        let expected = format!("at most {room} points, which is what fits the file");
        Err(Fault::new(Place::Byte(reader.position()), expected, self.points.to_string()))
    }
}

/// Expands data that LZF compressed to exactly `length` bytes, or returns `None` for other data.
///
/// A byte below 32 states how many bytes follow as they are, less one. Any other starts a copy of earlier bytes: three bits
/// for its length, of which 7 stands for the next byte and 7, less two; five bits and a byte for the distance, less one.
fn expand(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    // Room is made for what the data hold, not for what they state.
    let mut whole = Vec::new();
    let mut bytes = packed.iter();
    while let Some(&control) = bytes.next() {
        let control = usize::from(control);
        if control < 32 {
            let (plain, rest) = bytes.as_slice().split_at_checked(control + 1)?;
            whole.extend_from_slice(plain);
            bytes = rest.iter();
        } else {
            let mut count = control >> 5;
            if count == 7 {
                count += usize::from(*bytes.next()?);
            }
            let distance = (control & 31) << 8 | usize::from(*bytes.next()?);
            let start = whole.len().checked_sub(distance + 1)?;
            // The copy may reach into itself.
            for at in start..start + count + 2 {
                whole.push(whole[at]);
            }
        }
        if whole.len() > length {
            return None;
        }
    }
    (whole.len() == length).then_some(whole)
}
