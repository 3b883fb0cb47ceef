//! Reads STL: text with any number of solids, or binary.
//!
//! STL has no vertex numbers, so vertices with equal coordinates are joined, numbered in the order in which
//! they first appear. A file whose length is just what its binary count asks for is binary even if it starts
//! with `solid`, and so is one with a zero byte near its start. Bytes after the last binary triangle are
//! ignored, since exporters write some; a file shorter than its count, or text that ends inside a solid, is
//! refused. Normals are ignored.

use super::error::{Fault, Place, excerpt};
use super::text::{Lines, Words};
use super::{COORDINATE, next_ids};
use crate::mesh::{MAX_VERTICES, Mesh, Object, coordinate_fits};
use std::hash::BuildHasher;

/// Bytes of a binary file before its first triangle: 80 of header, 4 of count.
const HEAD: usize = 84;
/// Bytes of a binary triangle: normal, three vertices, two bytes of attributes.
const TRIANGLE: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    if is_ascii(bytes) && !is_exact_binary(bytes) { read_ascii(bytes) } else { read_binary(bytes) }
}

/// Whether the file is as long as a binary STL of its count is.
pub(super) fn is_exact_binary(bytes: &[u8]) -> bool {
    binary_count(bytes)
        .is_some_and(|count| HEAD as u64 + u64::from(count) * TRIANGLE as u64 == bytes.len() as u64)
}

/// Whether the file starts like STL text.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(1024)];
    let first = Words::new(Lines::new(head)).next();
    !head.contains(&0) && first.is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

fn binary_count(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEAD - 4..HEAD)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn read_binary(bytes: &[u8]) -> Result<Mesh, Fault> {
    let Some(count) = binary_count(bytes) else {
        let found = format!("{} bytes", bytes.len());
        return Err(Fault::new(Place::File, "STL text, or at least 84 bytes of binary STL", found));
    };
    let body = &bytes[HEAD..];
    let triangles = body.as_chunks::<TRIANGLE>().0;
    let Some(triangles) = triangles.get(..count as usize) else {
        let room = format!("a count of at most {} triangles, which is what fits the file", triangles.len());
        return Err(Fault::new(Place::Byte(HEAD as u64 - 4), room, count.to_string()));
    };
    let mut solid = Solid::new(String::new(), triangles.len());
    for (place, triangle) in triangles.iter().enumerate() {
        let corners = triangle[12..48].as_chunks::<4>().0;
        for (corner, at) in corners.iter().zip(0..) {
            let value = f32::from_le_bytes(*corner);
            if !coordinate_fits(value.into()) {
                let byte = HEAD + place * TRIANGLE + 12 + 4 * at;
                return Err(Fault::new(Place::Byte(byte as u64), COORDINATE, value.to_string()));
            }
        }
        let at =
            |corner: usize| [0, 1, 2].map(|axis| f64::from(f32::from_le_bytes(corners[3 * corner + axis])));
        solid.push([at(0), at(1), at(2)])?;
    }
    Ok(Mesh { objects: vec![solid.finish(&mut 0)?] })
}

fn read_ascii(bytes: &[u8]) -> Result<Mesh, Fault> {
    const SOLID: &str = "facet or endsolid";
    let mut words = Words::new(Lines::new(bytes));
    let mut mesh = Mesh::default();
    let mut next_id = 0;
    while let Some(word) = words.next() {
        if !word.eq_ignore_ascii_case(b"solid") {
            return Err(Fault::new(words.place(), "solid", excerpt(word)));
        }
        let mut solid = Solid::new(String::from_utf8_lossy(words.rest_of_line()).into_owned(), 0);
        loop {
            let word = words.expect(SOLID)?;
            if word.eq_ignore_ascii_case(b"endsolid") {
                words.rest_of_line();
                break;
            } else if !word.eq_ignore_ascii_case(b"facet") {
                return Err(Fault::new(words.place(), SOLID, excerpt(word)));
            }
            solid.push(read_facet(&mut words)?)?;
        }
        mesh.objects.push(solid.finish(&mut next_id)?);
    }
    Ok(mesh)
}

/// Reads from behind `facet` to behind `endfacet`.
fn read_facet(words: &mut Words) -> Result<[[f64; 3]; 3], Fault> {
    keyword(words, "normal")?;
    // Whatever stands for the normal is skipped, three numbers or not.
    let mut skipped = 0;
    loop {
        let word = words.expect("outer loop")?;
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

fn keyword(words: &mut Words, expected: &'static str) -> Result<(), Fault> {
    let word = words.expect(expected)?;
    if word.eq_ignore_ascii_case(expected.as_bytes()) {
        Ok(())
    } else {
        Err(Fault::new(words.place(), expected, excerpt(word)))
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
