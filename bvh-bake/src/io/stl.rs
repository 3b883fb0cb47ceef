//! Reads STL: text with any number of solids, or binary.
//!
//! STL has no vertex numbers, so vertices with equal coordinates are joined, numbered in the order in which
//! they first appear. A file whose length is just what its binary count asks for is binary even if it starts
//! with `solid`, and so is one with a zero byte near its start. Bytes after the last binary triangle are
//! ignored, since exporters write some; a file shorter than its count, or text that ends inside a solid, is
//! refused. Normals are ignored.

use super::error::{Fault, Halt, Place, excerpt};
use super::feed::{Feed, Words};
use super::text::Lines;
use super::{COORDINATE, next_ids, text};
use crate::mesh::{MAX_VERTICES, Mesh, Object, coordinate_fits};
use std::hash::BuildHasher;
use std::io::Read;

/// Bytes of a binary file before its first triangle: 80 of header, 4 of count.
const HEAD: usize = 84;
/// Bytes of a binary triangle: normal, three vertices, two bytes of attributes.
const TRIANGLE: usize = 50;
/// Bytes that tell text from binary.
const TELLING: usize = 1024;

/// Takes the solids of a file in order.
pub(crate) trait Solids {
    /// A solid begins, of about so many triangles.
    fn begin(&mut self, name: String, expected: usize) -> Result<(), Halt>;
    /// The next triangle of the solid.
    fn triangle(&mut self, corners: [[f64; 3]; 3]) -> Result<(), Halt>;
    /// The solid is complete.
    fn end(&mut self) -> Result<(), Halt>;
}

pub(super) fn read<R: Read>(feed: Feed<R>) -> Result<Mesh, Halt> {
    let mut joined = Joined::default();
    stream(feed, &mut joined)?;
    Ok(joined.mesh)
}

/// Reads a file from its beginning to its end.
pub(crate) fn stream<R: Read>(mut feed: Feed<R>, solids: &mut impl Solids) -> Result<(), Halt> {
    let length = feed.length();
    let head = feed.peek(TELLING);
    if is_ascii(head) && !is_exact_binary(head, length) {
        let mut words = Words::new(feed);
        let result = read_ascii(&mut words, solids);
        words.feed.finish(result)
    } else {
        let result = read_binary(&mut feed, solids);
        feed.finish(result)
    }
}

/// Whether a file that starts with `head` and has `length` bytes is as long as a binary STL of its count is.
pub(super) fn is_exact_binary(head: &[u8], length: u64) -> bool {
    binary_count(head).is_some_and(|count| HEAD as u64 + u64::from(count) * TRIANGLE as u64 == length)
}

/// Whether the file starts like STL text.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(TELLING)];
    let first = Lines::new(head).find_map(|line| text::words(line).next());
    !head.contains(&0) && first.is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

fn binary_count(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEAD - 4..HEAD)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn read_binary<R: Read>(feed: &mut Feed<R>, solids: &mut impl Solids) -> Result<(), Halt> {
    let Some(count) = binary_count(feed.peek(HEAD)) else {
        let found = format!("{} bytes", feed.length());
        return Err(Fault::new(Place::File, "STL text, or at least 84 bytes of binary STL", found).into());
    };
    let room = (feed.length() - HEAD as u64) / TRIANGLE as u64;
    if u64::from(count) > room {
        let expected = format!("a count of at most {room} triangles, which is what fits the file");
        return Err(Fault::new(Place::Byte(HEAD as u64 - 4), expected, count.to_string()).into());
    }
    feed.skip(HEAD);
    solids.begin(String::new(), count as usize)?;
    for place in 0..u64::from(count) {
        let Some(triangle) = feed.take::<TRIANGLE>() else {
            let byte = HEAD as u64 + place * TRIANGLE as u64;
            return Err(Fault::new(Place::Byte(byte), "a triangle", "the end of the file").into());
        };
        let corners = triangle[12..48].as_chunks::<4>().0;
        for (corner, at) in corners.iter().zip(0..) {
            let value = f32::from_le_bytes(*corner);
            if !coordinate_fits(value.into()) {
                let byte = HEAD as u64 + place * TRIANGLE as u64 + 12 + 4 * at;
                return Err(Fault::new(Place::Byte(byte), COORDINATE, value.to_string()).into());
            }
        }
        let at =
            |corner: usize| [0, 1, 2].map(|axis| f64::from(f32::from_le_bytes(corners[3 * corner + axis])));
        solids.triangle([at(0), at(1), at(2)])?;
    }
    solids.end()
}

fn read_ascii<R: Read>(words: &mut Words<R>, solids: &mut impl Solids) -> Result<(), Halt> {
    const SOLID: &str = "facet or endsolid";
    while let Some(word) = words.next() {
        let word = words.text(word);
        if !word.eq_ignore_ascii_case(b"solid") {
            return Err(Fault::new(words.place(), "solid", excerpt(word)).into());
        }
        let name = words.rest_of_line();
        let name = name.map(|name| String::from_utf8_lossy(words.text(name).trim_ascii()).into_owned());
        solids.begin(name.unwrap_or_default(), 0)?;
        loop {
            let word = words.expect(SOLID)?;
            let word = words.text(word);
            if word.eq_ignore_ascii_case(b"endsolid") {
                words.rest_of_line();
                break;
            } else if !word.eq_ignore_ascii_case(b"facet") {
                return Err(Fault::new(words.place(), SOLID, excerpt(word)).into());
            }
            solids.triangle(read_facet(words)?)?;
        }
        solids.end()?;
    }
    Ok(())
}

/// Reads from behind `facet` to behind `endfacet`.
fn read_facet<R: Read>(words: &mut Words<R>) -> Result<[[f64; 3]; 3], Fault> {
    keyword(words, "normal")?;
    // Whatever stands for the normal is skipped, three numbers or not.
    let mut skipped = 0;
    loop {
        let word = words.expect("outer loop")?;
        let word = words.text(word);
        if word.eq_ignore_ascii_case(b"outer") {
            break;
        }
        skipped += 1;
        if skipped > 3 {
            return Err(Fault::new(words.place(), "outer loop", excerpt(word)));
        }
    }
    keyword(words, "loop")?;
    let mut corners = [[0.0; 3]; 3];
    for coordinates in &mut corners {
        keyword(words, "vertex")?;
        for coordinate in coordinates {
            *coordinate = words.number()?;
            if !coordinate_fits(*coordinate) {
                return Err(Fault::new(words.place(), COORDINATE, coordinate.to_string()));
            }
        }
    }
    keyword(words, "endloop")?;
    keyword(words, "endfacet")?;
    Ok(corners)
}

fn keyword<R: Read>(words: &mut Words<R>, expected: &'static str) -> Result<(), Fault> {
    let word = words.expect(expected)?;
    let word = words.text(word);
    if word.eq_ignore_ascii_case(expected.as_bytes()) {
        Ok(())
    } else {
        Err(Fault::new(words.place(), expected, excerpt(word)))
    }
}

/// Makes a mesh of which equal vertices are one.
#[derive(Default)]
struct Joined {
    mesh: Mesh,
    solid: Option<Solid>,
    next_id: u32,
}

impl Solids for Joined {
    fn begin(&mut self, name: String, expected: usize) -> Result<(), Halt> {
        self.solid = Some(Solid::new(name, expected));
        Ok(())
    }

    fn triangle(&mut self, corners: [[f64; 3]; 3]) -> Result<(), Halt> {
        self.solid.as_mut().map_or(Ok(()), |solid| solid.push(corners))?;
        Ok(())
    }

    fn end(&mut self) -> Result<(), Halt> {
        if let Some(solid) = self.solid.take() {
            self.mesh.objects.push(solid.finish(&mut self.next_id)?);
        }
        Ok(())
    }
}

/// An object that grows triangle by triangle, joining equal vertices.
struct Solid {
    object: Object,
    /// An open-addressed hash table of vertex numbers; its length is a power of two.
    table: Vec<u32>,
    /// Drawn at random, so that no file can be made whose vertices all collide. Numbers don't depend on it.
    seed: u64,
}

const FREE: u32 = u32::MAX;

impl Solid {
    /// `expected` triangles, which the file is long enough to hold.
    fn new(name: String, expected: usize) -> Self {
        let mut object = Object { name, ..Object::default() };
        object.triangles.reserve_exact(expected);
        // A closed surface has half as many vertices as triangles; a table half full.
        let table = vec![FREE; expected.next_power_of_two().max(64)];
        Solid { object, table, seed: std::hash::RandomState::new().hash_one(0) }
    }

    fn push(&mut self, corners: [[f64; 3]; 3]) -> Result<(), Fault> {
        let mut triangle = [0; 3];
        for (corner, position) in triangle.iter_mut().zip(corners) {
            *corner = self.number(position)?;
        }
        self.object.triangles.push(triangle);
        Ok(())
    }

    /// The number of the vertex with this position, a new one if there is none.
    fn number(&mut self, position: [f64; 3]) -> Result<u32, Fault> {
        // -0.0 and 0.0 are one.
        let position = position.map(|coordinate| coordinate + 0.0);
        let slot = self.slot(position);
        if self.table[slot] != FREE {
            return Ok(self.table[slot]);
        }
        let number = self.object.positions.len() as u32;
        if u64::from(number) == MAX_VERTICES {
            return Err(Fault::Limit { place: Place::File, most: MAX_VERTICES, what: "vertices" });
        }
        self.table[slot] = number;
        self.object.positions.push(position);
        if self.object.positions.len() * 3 > self.table.len() * 2 {
            self.grow();
        }
        Ok(number)
    }

    /// The slot of this position, or the free one where it belongs.
    fn slot(&self, position: [f64; 3]) -> usize {
        let hash = xxhash_rust::xxh3::xxh3_64_with_seed(bytemuck::bytes_of(&position), self.seed);
        let mut slot = hash as usize & (self.table.len() - 1);
        loop {
            match self.table[slot] {
                FREE => return slot,
                number if self.object.positions[number as usize] == position => return slot,
                _ => slot = (slot + 1) & (self.table.len() - 1),
            }
        }
    }

    fn grow(&mut self) {
        self.table = vec![FREE; self.table.len() * 4];
        for number in 0..self.object.positions.len() {
            let slot = self.slot(self.object.positions[number]);
            self.table[slot] = number as u32;
        }
    }

    fn finish(mut self, next_id: &mut u32) -> Result<Object, Fault> {
        self.object.triangle_ids = next_ids(next_id, self.object.triangles.len())?;
        Ok(self.object)
    }
}
