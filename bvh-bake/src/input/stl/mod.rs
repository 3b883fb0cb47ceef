//! Reads STL: text with any number of solids, or binary.
//!
//! STL has no vertex numbers, so the reader joins vertices with equal coordinates and numbers them in the order in
//! which they first appear. A file whose length is exactly what its binary count requires is binary even if it starts
//! with `solid`, and so is a file with a zero byte near its start. Bytes after the last binary triangle are left out with a
//! warning, because some exporters write them, unless they tell that the file is mangled (module `leftover`). A file that is shorter than its count requires, or text that ends inside a solid,
//! is refused. In text, `end solid` and so on may be two words, and text without facets may follow the last solid. Normals are ignored.

mod leftover;

use super::byte_reader::{ByteReader, Word, Words};
use super::text::Lines;
use super::warnings::Warnings;
use super::{COORDINATE, next_ids, text};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::input::mesh::{Mesh, Object};
use crate::limits::{MAX_VERTICES, coordinate_fits};
use crate::threads;
use crate::triangles::TRIANGLES_PER_PART;
use leftover::Leftover;
use memchr::memchr;
use std::collections::HashMap;
use std::io::Read;

/// Bytes of a binary file before its first triangle: 80 for the header and 4 for the count.
const HEAD: usize = 84;
/// Bytes of a binary triangle: the normal, three vertices, and two bytes of attributes.
const TRIANGLE: usize = 50;
/// The number of bytes that decide between text and binary.
const TELLING: usize = 1024;

/// The number of bytes after the last triangle that are looked at at a time.
const REST_BYTES: usize = 1 << 16;

/// The number of triangles that are passed on at a time: several parts of a stream for each thread.
const BATCH_TRIANGLES: usize = 8 * TRIANGLES_PER_PART;

/// Takes the solids of a file in order.
pub(super) trait Solids {
    /// Begins a solid of about `expected` triangles.
    fn begin(&mut self, name: String, expected: usize) -> Result<(), Halt>;
    /// Takes the next triangles of the solid. `corners_of` returns their corners.
    fn triangles(
        &mut self,
        count: usize,
        corners_of: impl Fn(usize) -> [[f64; 3]; 3] + Sync,
    ) -> Result<(), Halt>;
}

/// Reads a file into a mesh in which equal vertices are joined.
pub(super) fn read_mesh<R: Read>(reader: ByteReader<R>, warnings: &Warnings) -> Result<Mesh, Halt> {
    let mut joined = Joined::default();
    read(reader, &mut joined, warnings)?;
    Ok(joined.mesh)
}

/// Reads a file from its beginning to its end.
pub(super) fn read<R: Read>(
    mut reader: ByteReader<R>,
    solids: &mut impl Solids,
    warnings: &Warnings,
) -> Result<(), Halt> {
    let length = reader.length();
    let head = reader.peek(TELLING);
    if is_ascii(head) && !is_exact_binary(head, length) {
        let mut words = Words::new(reader);
        let result = read_ascii(&mut words, solids, warnings);
        words.reader.finish(result)
    } else {
        let result = read_binary(&mut reader, solids, warnings);
        reader.finish(result)
    }
}

/// Returns whether a file of `length` bytes that starts with `head` has the exact length of a binary STL with its
/// count.
pub(super) fn is_exact_binary(head: &[u8], length: u64) -> bool {
    binary_count(head).is_some_and(|count| HEAD as u64 + u64::from(count) * TRIANGLE as u64 == length)
}

/// Returns whether the file starts like STL text.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(TELLING)];
    let first = Lines::new(head).find_map(|line| text::words(line).next());
    let is_text = memchr(0, head).is_none_or(|end| ends_solid(&head[..end]));
    is_text && first.is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

/// Returns whether some line of a text ends a solid, so that anything may follow to fill up the file.
fn ends_solid(head: &[u8]) -> bool {
    Lines::new(head).any(|line| {
        let mut words = text::words(line).map(<[u8]>::to_ascii_lowercase);
        match words.next().as_deref() {
            Some(b"endsolid") => true,
            Some(b"end") => words.next().as_deref() == Some(b"solid"),
            _ => false,
        }
    })
}

fn binary_count(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEAD - 4..HEAD)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn read_binary<R: Read>(
    reader: &mut ByteReader<R>,
    solids: &mut impl Solids,
    warnings: &Warnings,
) -> Result<(), Halt> {
    let Some(count) = binary_count(reader.peek(HEAD)) else {
        let found = format!("{} bytes", reader.length());
        return Err(Fault::new(Place::File, "STL text, or at least 84 bytes of binary STL", found).into());
    };
    let room = (reader.length() - HEAD as u64) / TRIANGLE as u64;
    if u64::from(count) > room {
        let expected = format!("a count of at most {room} triangles, which is what fits the file");
        return Err(Fault::new(Place::Byte(HEAD as u64 - 4), expected, count.to_string()).into());
    }
    let end = HEAD as u64 + u64::from(count) * TRIANGLE as u64;
    let mut leftover = Some(reader.length() - end).filter(|&left| left > 0).map(Leftover::new);
    leftover.iter_mut().for_each(|leftover| leftover.look(reader.peek(HEAD)));
    reader.skip(HEAD);
    solids.begin(String::new(), count as usize)?;
    let mut before = 0;
    while before < count as usize {
        let now = (count as usize - before).min(BATCH_TRIANGLES);
        let bytes = reader.peek(now * TRIANGLE);
        let triangles = bytes.as_chunks::<TRIANGLE>().0;
        let at = |place: usize| HEAD as u64 + (before + place) as u64 * TRIANGLE as u64;
        let misfit = threads::first(triangles.len(), |place| first_misfit(&triangles[place]).is_some());
        if let Some(place) = misfit {
            let (corner, value) = first_misfit(&triangles[place]).unwrap_or_default();
            let byte = at(place) + 12 + 4 * corner as u64;
            let found = match &leftover {
                Some(leftover) if leftover.is_ragged() => {
                    let left = reader.length() - end;
                    format!(
                        "{value:e}, and {left} bytes after the last triangle; is the file mangled? copy it again as binary"
                    )
                }
                _ => format!("{value:e}"),
            };
            return Err(Fault::new(Place::Byte(byte), COORDINATE, found).into());
        }
        if triangles.len() < now {
            let place = Place::Byte(at(triangles.len()));
            return Err(Fault::new(place, "a triangle", "the end of the file").into());
        }
        solids.triangles(now, |place| coordinates(&triangles[place]).map(|corner| corner.map(f64::from)))?;
        if let Some(leftover) = &mut leftover {
            leftover.look(bytes);
            triangles.iter().for_each(|triangle| leftover.count(&coordinates(triangle)));
        }
        reader.skip(now * TRIANGLE);
        before += now;
    }
    if let Some(mut leftover) = leftover {
        while let rest = reader.peek(REST_BYTES)
            && !rest.is_empty()
        {
            let length = rest.len();
            leftover.look(rest);
            reader.skip(length);
        }
        warnings.add(Place::Byte(end), leftover.judge(Place::Byte(end))?);
    }
    Ok(())
}

/// Returns the corners of a binary triangle.
#[inline]
fn coordinates(triangle: &[u8; TRIANGLE]) -> [[f32; 3]; 3] {
    let values = triangle[12..48].as_chunks::<4>().0;
    let value = |place: usize| f32::from_le_bytes(values[place]);
    [0, 3, 6].map(|corner| [corner, corner + 1, corner + 2].map(value))
}

/// Returns the first coordinate of a triangle that the format cannot hold, and its place among the nine.
fn first_misfit(triangle: &[u8; TRIANGLE]) -> Option<(usize, f32)> {
    let corners = coordinates(triangle);
    let mut values = corners.as_flattened().iter().copied().enumerate();
    values.find(|&(_, value)| !coordinate_fits(value.into()))
}

fn read_ascii<R: Read>(
    words: &mut Words<R>,
    solids: &mut impl Solids,
    warnings: &Warnings,
) -> Result<(), Halt> {
    const SOLID: &str = "facet or endsolid";
    let mut has_solid = false;
    while let Some(word) = words.next() {
        let text = words.text(word);
        if !text.eq_ignore_ascii_case(b"solid") {
            let fault = Fault::new(words.place(), "solid", excerpt(text));
            return if has_solid { pass_over_rest(words, word, fault, warnings) } else { Err(fault.into()) };
        }
        has_solid = true;
        let name = words.rest_of_line();
        let name = name.map(|name| String::from_utf8_lossy(words.text(name).trim_ascii()).into_owned());
        solids.begin(name.unwrap_or_default(), 0)?;
        let mut batch = Vec::new();
        loop {
            let word = words.expect(SOLID)?;
            let word = words.text(word);
            if word.eq_ignore_ascii_case(b"endsolid") || word.eq_ignore_ascii_case(b"end") {
                if word.len() == 3 {
                    keyword(words, "solid")?;
                }
                words.rest_of_line();
                break;
            } else if !word.eq_ignore_ascii_case(b"facet") {
                return Err(Fault::new(words.place(), SOLID, excerpt(word)).into());
            }
            batch.push(read_facet(words)?);
            if batch.len() == BATCH_TRIANGLES {
                solids.triangles(batch.len(), |place| batch[place])?;
                batch.clear();
            }
        }
        solids.triangles(batch.len(), |place| batch[place])?;
    }
    Ok(())
}

/// Passes over what follows the last solid, which starts with a word, and warns of it unless it only fills up the file. Returns
/// the fault if there are facets in it.
fn pass_over_rest<R: Read>(
    words: &mut Words<R>,
    first: Word,
    fault: Fault,
    warnings: &Warnings,
) -> Result<(), Halt> {
    let (place, mut word, mut is_filler) = (words.place(), Some(first), true);
    while let Some(letters) = word.map(|word| words.text(word)) {
        if letters.eq_ignore_ascii_case(b"facet") || letters.eq_ignore_ascii_case(b"vertex") {
            return Err(fault.into());
        }
        is_filler &= text::is_filler(letters);
        word = words.next();
    }
    if !is_filler {
        warnings.add(place, "left out the text after the last solid");
    }
    Ok(())
}

/// Reads from after `facet` up to and including `endfacet`.
fn read_facet<R: Read>(words: &mut Words<R>) -> Result<[[f64; 3]; 3], Fault> {
    keyword(words, "normal")?;
    // The words of the normal are skipped, whether they are three numbers or not.
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
                return Err(Fault::new(words.place(), COORDINATE, format!("{coordinate:e}")));
            }
        }
    }
    keyword(words, "endloop")?;
    keyword(words, "endfacet")?;
    Ok(corners)
}

/// Takes a keyword. One that starts with `end` may be two words.
fn keyword<R: Read>(words: &mut Words<R>, expected: &'static str) -> Result<(), Fault> {
    let word = words.expect(expected)?;
    let word = words.text(word);
    if word.eq_ignore_ascii_case(expected.as_bytes()) {
        Ok(())
    } else if let (true, Some(ended)) = (word.eq_ignore_ascii_case(b"end"), expected.strip_prefix("end")) {
        keyword(words, ended)
    } else {
        Err(Fault::new(words.place(), expected, excerpt(word)))
    }
}

/// Collects a mesh in which equal vertices are joined.
#[derive(Default)]
struct Joined {
    mesh: Mesh,
    /// The vertices of the last object by the bits of their positions. The map's hashes are random, so that nobody can
    /// make a file whose vertices all collide.
    numbers: HashMap<[u64; 3], u32>,
    next_id: u32,
}

impl Solids for Joined {
    fn begin(&mut self, name: String, expected: usize) -> Result<(), Halt> {
        let mut object = Object { name, ..Object::default() };
        // The file is long enough to hold that many.
        object.triangles.reserve_exact(expected);
        object.triangle_ids.reserve_exact(expected);
        self.mesh.objects.push(object);
        // A closed surface has half as many vertices as triangles.
        self.numbers = HashMap::with_capacity(expected / 2);
        Ok(())
    }

    fn triangles(
        &mut self,
        count: usize,
        corners_of: impl Fn(usize) -> [[f64; 3]; 3] + Sync,
    ) -> Result<(), Halt> {
        let object = self.mesh.objects.last_mut().expect("the solid has begun");
        for place in 0..count {
            let mut triangle = [0; 3];
            for (corner, position) in triangle.iter_mut().zip(corners_of(place)) {
                *corner = number(object, &mut self.numbers, position)?;
            }
            object.triangles.push(triangle);
        }
        object.triangle_ids.append(&mut next_ids(&mut self.next_id, count)?);
        Ok(())
    }
}

/// Returns the number of the vertex with this position, and adds the vertex if there is none.
fn number(
    object: &mut Object,
    numbers: &mut HashMap<[u64; 3], u32>,
    position: [f64; 3],
) -> Result<u32, Fault> {
    // -0.0 and 0.0 are the same position. No coordinate is NaN.
    let position = position.map(|coordinate| coordinate + 0.0);
    let next = object.positions.len() as u32;
    let number = *numbers.entry(position.map(f64::to_bits)).or_insert(next);
    if number < next {
        return Ok(number);
    }
    if u64::from(number) == MAX_VERTICES {
        return Err(Fault::Limit { place: Place::File, most: MAX_VERTICES, what: "vertices" });
    }
    object.positions.push(position);
    Ok(number)
}
