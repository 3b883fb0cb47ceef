//! Reads PLY: text, or binary of either byte order, with any elements and properties in any order.
//!
//! Wanted are `x`, `y` and `z` of the element `vertex` and the list `vertex_indices` (or `vertex_index`) of
//! the element `face`; the rest is read and dropped. Numbers of every type are exact in f64, so that is how
//! all are read. Text is read word by word, wherever its lines end. What follows the last element is ignored.

use super::error::{Fault, Halt, Place, excerpt};
use super::feed::{Feed, Words};
use super::polygon::{self, MAX_CORNERS};
use super::text::words;
use super::{COORDINATE, next_ids};
use crate::mesh::{MAX_TRIANGLES, MAX_VERTICES, Mesh, Object, coordinate_fits};
use std::io::Read;

/// Takes the vertices and faces of a file in order. Either may come first.
pub(crate) trait Faces {
    /// Vertices taken.
    fn vertices(&self) -> u64;
    /// The next vertex.
    fn vertex(&mut self, position: [f64; 3]) -> Result<(), Halt>;
    /// The next vertex has a coordinate that the format can't hold, which stands in that place.
    fn misfit(&mut self, place: Place, found: f64) -> Result<(), Halt>;
    /// The next face, of vertices that may be yet to come.
    fn face(&mut self, corners: &[u32]) -> Result<(), Halt>;
}

pub(super) fn read<R: Read>(feed: Feed<R>) -> Result<Mesh, Halt> {
    let mut parts = Parts::default();
    stream(feed, &mut parts)?;
    Ok(parts.finish()?)
}

/// Reads a file from its beginning to its end.
pub(crate) fn stream<R: Read>(feed: Feed<R>, faces: &mut impl Faces) -> Result<(), Halt> {
    let mut words = Words::new(feed);
    let header = match Header::read(&mut words) {
        Ok(header) => header,
        Err(fault) => return words.feed.finish(Err(fault.into())),
    };
    let format = header.format;
    let mut body = Body { words, format };
    let mut reader = Reader { faces, corners: Vec::new(), triangles: 0 };
    let result = header.elements.iter().try_for_each(|element| {
        body.expect_room(element)?;
        reader.read_element(element, &mut body)
    });
    body.words.feed.finish(result)
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
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
            Kind::F64 => 8,
        }
    }
}

/// What a property is to a mesh.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Coordinate(usize),
    Corners,
    Other,
}

struct Property {
    /// The type of the count, if this is a list.
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
    fn read<R: Read>(words_of_file: &mut Words<R>) -> Result<Header, Fault> {
        let lines = words_of_file;
        let head = lines.feed.peek(16).to_vec();
        if lines.line().is_none_or(|(line, _)| line != b"ply") {
            return Err(Fault::new(Place::Line(1), "ply", excerpt(&head)));
        }
        let only_returns = head.get(3..5).is_some_and(|ending| ending[0] == b'\r' && ending[1] != b'\n');
        let mut elements: Vec<Element> = Vec::new();
        let mut format = None;
        let ended_by_both = loop {
            let Some((line, both)) = lines.line() else {
                return Err(Fault::new(lines.place(), "end_header", "the end of the file"));
            };
            let (line, place) = (&line[..], lines.place());
            let invalid = |expected: &'static str| Fault::new(place, expected, excerpt(line));
            // No statement is longer, and a list has five words.
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
        for (name, roles) in [
            ("vertex", &[Role::Coordinate(0), Role::Coordinate(1), Role::Coordinate(2)][..]),
            ("face", &[Role::Corners]),
        ] {
            let element = elements.iter().find(|element| element.name == name);
            let has = |role: &Role| element.is_some_and(|e| e.properties.iter().any(|p| p.role == *role));
            if !roles.iter().all(has) {
                let expected =
                    "an element vertex with x, y and z, and an element face with a list vertex_indices";
                return Err(Fault::new(lines.place(), expected, format!("no such {name}")));
            }
        }
        // Where lines end in CR alone, an LF behind the last belongs to the body.
        if format != Format::Ascii && only_returns && ended_by_both {
            lines.feed.step_back();
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
        ("face", b"vertex_indices" | b"vertex_index", Some(_)) => Role::Corners,
        _ => Role::Other,
    };
    Some(Property { count, kind: Kind::parse(kind)?, role }).filter(|_| !name.is_empty())
}

/// What follows the header.
struct Body<R> {
    words: Words<R>,
    format: Format,
}

impl<R: Read> Body<R> {
    /// Where the next number stands (in text, the line of the last one).
    fn place(&self) -> Place {
        match self.format {
            Format::Ascii => self.words.place(),
            _ => Place::Byte(self.words.feed.position()),
        }
    }

    /// Refuses an element that declares more rows than the file can hold.
    fn expect_room(&self, element: &Element) -> Result<(), Fault> {
        let least: u64 = match self.format {
            // A character and a blank for each number, but for the last blank.
            Format::Ascii => 2 * element.properties.len() as u64,
            _ => element
                .properties
                .iter()
                .map(|property| property.count.unwrap_or(property.kind).bytes() as u64)
                .sum(),
        };
        let left = self.words.feed.bytes_left() + 1;
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
            Kind::F32 => self.take().map(|b| f64::from(f32::from_le_bytes(b))),
            Kind::F64 => self.take().map(f64::from_le_bytes),
        };
        number.ok_or_else(|| Fault::new(self.place(), "a number", "the end of the file"))
    }

    /// The next `N` bytes, in little-endian order.
    #[inline]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut taken: [u8; N] = self.words.feed.take()?;
        if self.format == Format::BigEndian {
            taken.reverse();
        }
        Some(taken)
    }

    /// A whole number from 0 to `most`.
    fn whole(&mut self, kind: Kind, most: u64, what: &'static str) -> Result<u32, Fault> {
        let before = self.place();
        let number = self.number(kind)?;
        if number >= 0.0 && number <= most as f64 && number.fract() == 0.0 {
            return Ok(number as u32);
        }
        let place = if self.format == Format::Ascii { self.place() } else { before };
        Err(Fault::new(place, format!("{what} from 0 to {most}"), number.to_string()))
    }
}

/// Reads the elements of a body.
struct Reader<'a, F> {
    faces: &'a mut F,
    /// Of the face at hand.
    corners: Vec<u32>,
    triangles: u64,
}

impl<F: Faces> Reader<'_, F> {
    fn read_element<R: Read>(&mut self, element: &Element, body: &mut Body<R>) -> Result<(), Halt> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let is_vertex = element.name == "vertex";
        for _ in 0..element.count {
            let mut position = [0.0; 3];
            for property in &element.properties {
                let place = body.place();
                match (property.count, property.role) {
                    (Some(count), Role::Corners) => self.read_face(count, property.kind, body)?,
                    (Some(count), _) => {
                        for _ in 0..body.whole(count, u64::from(u32::MAX), "a length of a list")? {
                            body.number(property.kind)?;
                        }
                    }
                    (None, Role::Coordinate(axis)) => {
                        position[axis] = body.number(property.kind)?;
                        if !coordinate_fits(position[axis]) {
                            let place = if body.format == Format::Ascii { body.place() } else { place };
                            self.faces.misfit(place, position[axis])?;
                        }
                    }
                    (None, _) => {
                        body.number(property.kind)?;
                    }
                }
            }
            if is_vertex {
                if self.faces.vertices() == MAX_VERTICES {
                    let (place, most) = (body.place(), MAX_VERTICES);
                    return Err(Fault::Limit { place, most, what: "vertices" }.into());
                }
                self.faces.vertex(position)?;
            }
        }
        Ok(())
    }

    fn read_face<R: Read>(&mut self, count: Kind, kind: Kind, body: &mut Body<R>) -> Result<(), Halt> {
        let place = body.place();
        let arity = body.whole(count, u64::from(u32::MAX), "a number of corners")?;
        if arity < 3 {
            return Err(Fault::new(place, "a face of at least three vertices", arity.to_string()).into());
        }
        if arity as usize > MAX_CORNERS {
            return Err(Fault::Limit { place, most: MAX_CORNERS as u64, what: "vertices in a face" }.into());
        }
        self.triangles += u64::from(arity) - 2;
        if self.triangles > MAX_TRIANGLES {
            return Err(Fault::Limit { place, most: MAX_TRIANGLES, what: "triangles" }.into());
        }
        // Where the vertices come first, a wrong number is reported where it stands.
        let vertices = self.faces.vertices();
        let last = if vertices > 0 { vertices - 1 } else { MAX_VERTICES - 1 };
        self.corners.clear();
        for _ in 0..arity {
            self.corners.push(body.whole(kind, last, "a vertex number")?);
        }
        self.faces.face(&self.corners)
    }
}

/// What a vertex number beyond the last is told as.
pub(crate) fn out_of_range(vertices: u64, corner: u32) -> Fault {
    Fault::new(Place::File, format!("vertex numbers below {vertices}"), corner.to_string())
}

/// A whole file in memory.
#[derive(Default)]
struct Parts {
    positions: Vec<[f64; 3]>,
    corners: Vec<u32>,
    arities: Vec<u32>,
    /// Places in `positions` that the format can't hold, and where the first such coordinate stood in the file.
    misfits: Vec<(u32, Place, f64)>,
}

impl Faces for Parts {
    fn vertices(&self) -> u64 {
        self.positions.len() as u64
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<(), Halt> {
        self.positions.push(position);
        Ok(())
    }

    fn misfit(&mut self, place: Place, found: f64) -> Result<(), Halt> {
        let vertex = self.positions.len() as u32;
        if self.misfits.last().is_none_or(|last| last.0 != vertex) {
            self.misfits.push((vertex, place, found));
        }
        Ok(())
    }

    fn face(&mut self, corners: &[u32]) -> Result<(), Halt> {
        self.corners.extend_from_slice(corners);
        self.arities.push(corners.len() as u32);
        Ok(())
    }
}

impl Parts {
    fn finish(self) -> Result<Mesh, Fault> {
        let vertices = self.positions.len();
        if let Some(corner) = self.corners.iter().find(|&&corner| corner as usize >= vertices) {
            return Err(out_of_range(vertices as u64, *corner));
        }
        if !self.misfits.is_empty() {
            let misfit = |corner| self.misfits.binary_search_by_key(corner, |misfit| misfit.0).ok();
            if let Some(place) = self.corners.iter().find_map(misfit) {
                let (_, place, found) = self.misfits[place];
                return Err(Fault::new(place, COORDINATE, found.to_string()));
            }
        }
        let triangles = polygon::triangulate(&self.positions, self.corners, &self.arities)?;
        let triangle_ids = next_ids(&mut 0, triangles.len())?;
        let name = String::new();
        Ok(Mesh { objects: vec![Object { name, positions: self.positions, triangles, triangle_ids }] })
    }
}
