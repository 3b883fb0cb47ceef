//! Reads PLY: text, or binary of either byte order, with any elements and properties in any order.
//!
//! The reader needs `x`, `y` and `z` of the element `vertex` and the list `vertex_indices` (or `vertex_index`) of the
//! elements `face` and `tristrips`. It reads and drops the rest. Without these elements and without lists, vertices are points,
//! which become triangles whose corners are equal; so are those of a `range_grid`. Faces of fewer than three corners are left out
//! and counted. All numbers are read as f64, which represents numbers of every type exactly, but for integers of 64 bits above
//! 2^53, which are rounded.
//!
//! Text is read word by word, wherever its lines end. Words after the last element are an error, because each row may then have
//! more numbers than the header declares, and all of them belong elsewhere. In a binary file, they are left out with a warning.

use super::byte_reader::{ByteReader, Words};
use super::indexed::IndexedFaces;
use super::input_file::InputFile;
use super::polygon::MAX_CORNERS;
use super::text::{is_filler, words};
use super::warnings::{LeftOut, SHORT_FACES};
use super::xyz::tell_dropped;
use super::{COORDINATE, changed_meanwhile, misfit};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::limits::{MAX_TRIANGLES, MAX_VERTICES, coordinate_fits};
use std::io::Read;

/// The most elements and properties of a header, which are kept in memory.
const MAX_DECLARED: u64 = 1 << 14;

/// The elements that make triangles.
const FACES: [&str; 2] = ["face", STRIPS];
/// Strips of triangles, in each of which -1 starts another.
const STRIPS: &str = "tristrips";
/// The cells of an image of depths, each with the number of a vertex or none.
const RANGE_GRID: &str = "range_grid";

/// What becomes of the vertices and faces of a file, of which either may come first.
enum Sink<'a> {
    Faces(&'a mut IndexedFaces),
    /// Nothing, but the place of a coordinate of this vertex that the format cannot hold is reported.
    MisfitOf(u64),
}

impl Sink<'_> {
    fn vertex(&mut self, position: [f64; 3]) -> Result<(), Halt> {
        match self {
            Self::Faces(faces) => Ok(faces.add_vertices(&[position])?),
            Self::MisfitOf(_) => Ok(()),
        }
    }

    /// Takes a face. Its vertices may come later.
    fn face(&mut self, corners: &[u32]) -> Result<(), Halt> {
        match self {
            Self::Faces(faces) => Ok(faces.add_run(corners.len() as u32, 1, 0, 0, corners)?),
            Self::MisfitOf(_) => Ok(()),
        }
    }
}

/// Reads a file into `faces`. After a success, all their corners are vertices that the format can hold. `open` opens
/// the file at its beginning.
pub(crate) fn read<R: Read>(
    open: impl Fn() -> Result<ByteReader<R>, Halt>,
    faces: &mut IndexedFaces,
    input: &InputFile,
) -> Result<(), Halt> {
    stream(open()?, Sink::Faces(faces), input)?;
    faces.finish()?;
    if let Some((_, corner)) = faces.first_out_of_range()? {
        let expected = format!("vertex numbers below {}", faces.vertex_count());
        return Err(Fault::new(Place::File, expected, corner.to_string()).into());
    }
    match faces.first_misfit(None)? {
        None => Ok(()),
        Some((_, vertex)) => {
            // The second reading meets the misfit again and reports its place.
            stream(open()?, Sink::MisfitOf(vertex.into()), input)?;
            Err(changed_meanwhile().into())
        }
    }
}

/// Reads a file from its beginning to its end.
fn stream<R: Read>(reader: ByteReader<R>, sink: Sink<'_>, input: &InputFile) -> Result<(), Halt> {
    let mut words = Words::new(reader);
    let header = match Header::read(&mut words) {
        Ok(header) => header,
        Err(fault) => return words.reader.finish(Err(fault.into())),
    };
    let (format, end_of_header) = (header.format, words.place());
    let mut body = Body { words, format, long_row: None };
    let mut reader = Reader::new(sink, &header, input);
    let result = header.elements.iter().try_for_each(|element| {
        body.expect_room(element)?;
        reader.read_element(element, &mut body)
    });
    let result = match format {
        Format::Ascii => body.end_text(result, &header, end_of_header),
        _ => result.map(|()| body.end_bytes(input)),
    };
    if result.is_ok() {
        reader.tell(&header, end_of_header);
    }
    body.words.reader.finish(result)
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    fn parse(word: &[u8]) -> Option<Kind> {
        Some(match word {
            b"char" | b"int8" => Kind::I8,
            b"uchar" | b"uint8" => Kind::U8,
            b"short" | b"int16" => Kind::I16,
            b"ushort" | b"uint16" => Kind::U16,
            b"int" | b"int32" => Kind::I32,
            b"uint" | b"uint32" => Kind::U32,
            b"int64" => Kind::I64,
            b"uint64" => Kind::U64,
            b"float" | b"float32" => Kind::F32,
            b"double" | b"float64" => Kind::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::I64 | Kind::U64 | Kind::F64 => 8,
        }
    }
}

/// The meaning of a property for a mesh.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Coordinate(usize),
    Corners,
    Other,
}

struct Property {
    /// The type of the count if this is a list.
    count: Option<Kind>,
    kind: Kind,
    role: Role,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

struct Header {
    elements: Vec<Element>,
    format: Format,
}

impl Header {
    /// Returns the number of rows of numbers.
    fn rows(&self) -> u64 {
        let has_numbers = |element: &&Element| !element.properties.is_empty();
        self.elements.iter().filter(has_numbers).map(|element| element.count).fold(0, u64::saturating_add)
    }

    fn read<R: Read>(words_of_file: &mut Words<R>) -> Result<Header, Fault> {
        let lines = words_of_file;
        let head = lines.reader.peek(16).to_vec();
        if lines.line().is_none_or(|(line, _)| line != b"ply") {
            return Err(Fault::new(Place::Line(1), "ply", excerpt(&head)));
        }
        let only_returns = head.get(3..5).is_some_and(|ending| ending[0] == b'\r' && ending[1] != b'\n');
        let mut elements: Vec<Element> = Vec::new();
        let (mut format, mut declared) = (None, 0);
        let ended_by_both = loop {
            let Some((line, both)) = lines.line() else {
                return Err(Fault::new(lines.place(), "end_header", "the end of the file"));
            };
            let (line, place) = (&line[..], lines.place());
            let invalid = |expected: &'static str| Fault::new(place, expected, excerpt(line));
            if line.starts_with(b"element") || line.starts_with(b"property") {
                declared += 1;
            }
            if declared > MAX_DECLARED {
                return Err(Fault::Limit { place, most: MAX_DECLARED, what: "elements and properties" });
            }
            // No statement has more words; a list has five.
            let mut parts: [&[u8]; 6] = [b""; 6];
            parts.iter_mut().zip(words(line)).for_each(|(part, word)| *part = word);
            match parts {
                [b"comment" | b"obj_info", ..] | [b"", ..] => {}
                [b"format", name, b"1.0", ..] => {
                    format = Some(match name {
                        b"ascii" => Format::Ascii,
                        b"binary_little_endian" => Format::LittleEndian,
                        b"binary_big_endian" => Format::BigEndian,
                        _ => return Err(invalid("format ascii, binary_little_endian or binary_big_endian")),
                    });
                }
                [b"element", name, count, ..] => {
                    let count = std::str::from_utf8(count).ok().and_then(|count| count.parse().ok());
                    let count = count.ok_or_else(|| invalid("element NAME COUNT"))?;
                    let name = String::from_utf8_lossy(name).into_owned();
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                [b"property", ref kinds @ ..] => {
                    let element =
                        elements.last_mut().ok_or_else(|| invalid("an element before its properties"))?;
                    let property = read_property(&element.name, kinds);
                    element
                        .properties
                        .push(property.ok_or_else(|| invalid("property [list COUNT] TYPE NAME"))?);
                }
                [b"end_header", ..] => break both,
                _ => return Err(invalid("format 1.0, comment, element, property or end_header")),
            }
        };
        let format = format.ok_or_else(|| Fault::new(lines.place(), "a format above end_header", "none"))?;
        let has = |element: &Element, role| element.properties.iter().any(|property| property.role == role);
        let is_vertex = |element: &&Element| {
            element.name == "vertex" && [0, 1, 2].iter().all(|&axis| has(element, Role::Coordinate(axis)))
        };
        let makes_faces = |element: &&Element| FACES.contains(&&element.name[..]);
        // A file of points has no lists but those of the cells of a grid.
        let has_list = |element: &Element| {
            element.name != RANGE_GRID && element.properties.iter().any(|property| property.count.is_some())
        };
        let has_faces = match elements.iter().any(|element| makes_faces(&element)) {
            true => elements.iter().filter(makes_faces).all(|element| has(element, Role::Corners)),
            false => !elements.iter().any(has_list),
        };
        let has_vertices =
            elements.iter().find(|element| element.name == "vertex").is_some_and(|of| is_vertex(&of));
        if let (false, _) | (_, false) = (has_vertices, has_faces) {
            let expected =
                "an element vertex with x, y and z, and no element face or one with a list vertex_indices";
            let found = if has_vertices { "no such face" } else { "no such vertex" };
            return Err(Fault::new(lines.place(), expected, found));
        }
        // If lines end in CR alone, an LF after the last CR belongs to the body.
        if format != Format::Ascii && only_returns && ended_by_both {
            lines.reader.step_back();
        }
        Ok(Header { elements, format })
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

fn read_property(element: &str, words: &[&[u8]; 5]) -> Option<Property> {
    let (count, kind, name) = match *words {
        [b"list", count, kind, name, _] => {
            let count = Kind::parse(count).filter(|kind| !matches!(kind, Kind::F32 | Kind::F64));
            (Some(count?), kind, name)
        }
        [kind, name, ..] => (None, kind, name),
    };
    let role = match (element, name, count) {
        ("vertex", b"x", None) => Role::Coordinate(0),
        ("vertex", b"y", None) => Role::Coordinate(1),
        ("vertex", b"z", None) => Role::Coordinate(2),
        ("face" | "tristrips", b"vertex_indices" | b"vertex_index", Some(_)) => Role::Corners,
        _ => Role::Other,
    };
    Some(Property { count, kind: Kind::parse(kind)?, role }).filter(|_| !name.is_empty())
}

/// The part of the file after the header.
struct Body<R> {
    words: Words<R>,
    format: Format,
    /// The fault of the first row of text that does not end with its line.
    long_row: Option<Fault>,
}

impl<R: Read> Body<R> {
    /// Returns the place of the next number; in text, the line of the last word.
    fn place(&self) -> Place {
        match self.format {
            Format::Ascii => self.words.place(),
            _ => Place::Byte(self.words.reader.position()),
        }
    }

    /// Notes the first row of text that does not end with its line.
    fn end_row(&mut self, element: &Element) {
        if self.format != Format::Ascii || self.long_row.is_some() {
            return;
        }
        if let Some(more) = self.words.more_on_line() {
            let name = excerpt(element.name.as_bytes());
            let expected = format!("a row of element {name} with as many numbers as the header declares");
            let found =
                format!("more, from {} on; declare them as properties", excerpt(self.words.text(more)));
            self.long_row = Some(Fault::new(self.words.place(), expected, found));
        }
    }

    /// Refuses words after the last element. Rows may have more numbers than the header declares, which shifts all others; the
    /// first such row is then the fault, and not what the shift leads to.
    fn end_text(
        &mut self,
        result: Result<(), Halt>,
        header: &Header,
        end_of_header: Place,
    ) -> Result<(), Halt> {
        let rest = match &result {
            Ok(()) => self.next_no_filler(),
            Err(Halt::Fault(Fault::Invalid { .. })) if self.long_row.is_some() => None,
            Err(_) => return result,
        };
        if result.is_ok() && rest.is_none() {
            return result;
        }
        let place = self.words.place();
        if result.is_err() {
            while self.words.next().is_some() {}
            // Rows that share lines are shifted by nothing.
            let (Place::Line(first), Place::Line(last)) = (end_of_header, self.words.place()) else {
                return result;
            };
            if last - first < header.rows() {
                return result;
            }
        }
        let end = || {
            let found = rest.clone().unwrap_or_default();
            Fault::new(place, "the end of the file after the last row that the header declares", found)
        };
        Err(self.long_row.take().unwrap_or_else(end).into())
    }

    /// Returns the next word that does not fill up the file.
    fn next_no_filler(&mut self) -> Option<String> {
        loop {
            let word = self.words.next()?;
            let letters = self.words.text(word);
            if !is_filler(letters) {
                return Some(excerpt(letters));
            }
        }
    }

    /// Passes over what follows the last element, and warns of it.
    fn end_bytes(&mut self, input: &InputFile) {
        let (place, rest) = (self.place(), self.words.reader.take_rest());
        if rest > 0 {
            input
                .warnings()
                .add(place, format!("left out {rest} bytes after the last row that the header declares"));
        }
    }

    /// Refuses an element that declares more rows than the file can hold.
    fn expect_room(&self, element: &Element) -> Result<(), Fault> {
        let least: u64 = match self.format {
            // Each number takes a character and a blank; only the last blank may be missing.
            Format::Ascii => 2 * element.properties.len() as u64,
            _ => element
                .properties
                .iter()
                .map(|property| property.count.unwrap_or(property.kind).bytes() as u64)
                .sum(),
        };
        let left = self.words.reader.bytes_left() + 1;
        if element.count.saturating_mul(least) > left {
            let expected = format!(
                "at most {} rows of element {}, which is what fits the file",
                left / least,
                excerpt(element.name.as_bytes())
            );
            return Err(Fault::new(self.place(), expected, element.count.to_string()));
        }
        Ok(())
    }

    #[inline]
    fn number(&mut self, kind: Kind) -> Result<f64, Fault> {
        if self.format == Format::Ascii {
            return self.words.number();
        }
        let number = match kind {
            Kind::I8 => self.take().map(|b| f64::from(i8::from_le_bytes(b))),
            Kind::U8 => self.take().map(|b| f64::from(u8::from_le_bytes(b))),
            Kind::I16 => self.take().map(|b| f64::from(i16::from_le_bytes(b))),
            Kind::U16 => self.take().map(|b| f64::from(u16::from_le_bytes(b))),
            Kind::I32 => self.take().map(|b| f64::from(i32::from_le_bytes(b))),
            Kind::U32 => self.take().map(|b| f64::from(u32::from_le_bytes(b))),
            Kind::I64 => self.take().map(|b| i64::from_le_bytes(b) as f64),
            Kind::U64 => self.take().map(|b| u64::from_le_bytes(b) as f64),
            Kind::F32 => self.take().map(|b| f64::from(f32::from_le_bytes(b))),
            Kind::F64 => self.take().map(f64::from_le_bytes),
        };
        number.ok_or_else(|| Fault::new(self.place(), "a number", "the end of the file"))
    }

    /// Takes the next `N` bytes, in little-endian order.
    #[inline]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut taken: [u8; N] = self.words.reader.take()?;
        if self.format == Format::BigEndian {
            taken.reverse();
        }
        Some(taken)
    }

    /// Returns a whole number from 0 to `most`.
    fn whole(&mut self, kind: Kind, most: u64, what: &'static str) -> Result<u32, Fault> {
        let before = self.place();
        let number = self.number(kind)?;
        self.to_whole(number, most, what, before)
    }

    /// Returns a number that was read after a place as a whole number from 0 to `most`.
    fn to_whole(&self, number: f64, most: u64, what: &'static str, before: Place) -> Result<u32, Fault> {
        if number >= 0.0 && number <= most as f64 && number.fract() == 0.0 {
            return Ok(number as u32);
        }
        let place = if self.format == Format::Ascii { self.place() } else { before };
        // With an exponent where there would be many digits.
        let found = format!("{number:?}");
        Err(Fault::new(place, format!("{what} from 0 to {most}"), found.trim_end_matches(".0")))
    }
}

/// Reads the elements of a body.
struct Reader<'a> {
    sink: Sink<'a>,
    /// The corners of the current face.
    corners: Vec<u32>,
    /// How many vertices and triangles there were.
    vertices: u64,
    triangles: u64,
    /// Whether there is an element of faces. Without it, vertices are points.
    has_faces: bool,
    input: &'a InputFile<'a>,
    /// The faces of fewer than three corners, and the points without a position.
    short: LeftOut,
    dropped: LeftOut,
}

impl<'a> Reader<'a> {
    fn new(sink: Sink<'a>, header: &Header, input: &'a InputFile<'a>) -> Self {
        let has_faces = header.elements.iter().any(|element| FACES.contains(&&element.name[..]));
        let (short, dropped) = (LeftOut::default(), LeftOut::default());
        Self { sink, corners: Vec::new(), vertices: 0, triangles: 0, has_faces, input, short, dropped }
    }

    /// Warns of what was left out.
    fn tell(&self, header: &Header, end_of_header: Place) {
        self.short.tell(self.input.warnings(), SHORT_FACES);
        tell_dropped(&self.dropped, self.input);
        if !self.has_faces && header.elements.iter().any(|element| element.name == RANGE_GRID) {
            let told = "read the points of a range_grid, and left out the surface between them";
            self.input.warnings().add(end_of_header, told);
        }
    }

    fn read_element<R: Read>(&mut self, element: &Element, body: &mut Body<R>) -> Result<(), Halt> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let (is_vertex, is_strip) = (element.name == "vertex", element.name == STRIPS);
        for _ in 0..element.count {
            let mut position = [0.0; 3];
            for property in &element.properties {
                let place = body.place();
                match (property.count, property.role) {
                    (Some(count), Role::Corners) if is_strip => {
                        self.read_strip(count, property.kind, body)?
                    }
                    (Some(count), Role::Corners) => self.read_face(count, property.kind, body)?,
                    (Some(count), _) => {
                        for _ in 0..body.whole(count, u64::from(u32::MAX), "a length of a list")? {
                            body.number(property.kind)?;
                        }
                    }
                    (None, Role::Coordinate(axis)) => {
                        position[axis] = body.number(property.kind)?;
                        // A misfit is an error only if a face uses it.
                        if !coordinate_fits(position[axis])
                            && matches!(self.sink, Sink::MisfitOf(vertex) if vertex == self.vertices)
                        {
                            let place = if body.format == Format::Ascii { body.place() } else { place };
                            let found = misfit(position[axis], !self.has_faces);
                            return Err(Fault::new(place, COORDINATE, found).into());
                        }
                    }
                    (None, _) => {
                        body.number(property.kind)?;
                    }
                }
            }
            body.end_row(element);
            let lacks_position = || position.iter().any(|coordinate| !coordinate.is_finite());
            if is_vertex && !self.has_faces && self.input.drops_nan() && lacks_position() {
                self.dropped.add(body.place());
            } else if is_vertex {
                if self.vertices == MAX_VERTICES {
                    let (place, most) = (body.place(), MAX_VERTICES);
                    return Err(Fault::Limit { place, most, what: "vertices" }.into());
                }
                let number = self.vertices;
                self.vertices += 1;
                self.sink.vertex(position)?;
                if !self.has_faces {
                    if number == MAX_TRIANGLES {
                        let (place, most) = (body.place(), MAX_TRIANGLES);
                        return Err(Fault::Limit { place, most, what: "points" }.into());
                    }
                    self.sink.face(&[number as u32; 3])?;
                }
            }
        }
        Ok(())
    }

    fn read_face<R: Read>(&mut self, count: Kind, kind: Kind, body: &mut Body<R>) -> Result<(), Halt> {
        let before = body.place();
        let arity = body.whole(count, u64::from(u32::MAX), "a number of corners")?;
        let place = if body.format == Format::Ascii { body.place() } else { before };
        if arity < 3 {
            self.short.add(place);
            for _ in 0..arity {
                body.number(kind)?;
            }
            return Ok(());
        }
        if arity as usize > MAX_CORNERS {
            return Err(Fault::Limit { place, most: MAX_CORNERS as u64, what: "vertices in a face" }.into());
        }
        self.count_triangles(u64::from(arity) - 2, place)?;
        let last = self.last_vertex();
        self.corners.clear();
        for _ in 0..arity {
            self.corners.push(body.whole(kind, last, VERTEX)?);
        }
        self.sink.face(&self.corners)
    }

    /// Reads strips of triangles. Each corner makes a triangle with the two before it, and every other one turns the other way.
    fn read_strip<R: Read>(&mut self, count: Kind, kind: Kind, body: &mut Body<R>) -> Result<(), Halt> {
        let last = self.last_vertex();
        let (mut before, mut length) = ([0; 2], 0u32);
        for _ in 0..body.whole(count, u64::from(u32::MAX), "a length of a list")? {
            let place = body.place();
            let number = body.number(kind)?;
            if number == -1.0 {
                length = 0;
                continue;
            }
            let corner = body.to_whole(number, last, VERTEX, place)?;
            let [a, b] = before;
            let triangle = if length % 2 == 0 { [a, b, corner] } else { [b, a, corner] };
            // Triangles without area join the parts of a strip, and are not part of the surface.
            if length > 1 && a != b && b != corner && corner != a {
                self.count_triangles(1, place)?;
                self.sink.face(&triangle)?;
            }
            (before, length) = ([b, corner], length + 1);
        }
        Ok(())
    }

    fn count_triangles(&mut self, more: u64, place: Place) -> Result<(), Fault> {
        self.triangles += more;
        if self.triangles > MAX_TRIANGLES {
            return Err(Fault::Limit { place, most: MAX_TRIANGLES, what: "triangles" });
        }
        Ok(())
    }

    /// Returns the largest number that a vertex may have. If the vertices come first, a wrong one is reported at its place.
    fn last_vertex(&self) -> u64 {
        if self.vertices > 0 { self.vertices - 1 } else { MAX_VERTICES - 1 }
    }
}

const VERTEX: &str = "a vertex number";
