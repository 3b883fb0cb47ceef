//! Reads XYZ: text with a point per line, and passes points on as triangles whose corners are equal.
//!
//! The first three numbers of a line are x, y and z, between blanks, commas or semicolons. What follows them, such as colours
//! or normals, is ignored. Empty lines and those that start with `#` or `//` are skipped.

use super::COORDINATE;
use super::byte_reader::{ByteReader, Words};
use super::indexed::IndexedFaces;
use super::text::{is_blank, number};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::limits::{MAX_TRIANGLES, coordinate_fits};
use std::io::Read;

/// Reads a file from its beginning to its end.
pub(super) fn read<R: Read>(reader: ByteReader<R>, faces: &mut IndexedFaces) -> Result<(), Halt> {
    let mut words = Words::new(reader);
    let result = read_points(&mut words, faces);
    words.reader.finish(result)?;
    finish(faces)
}

/// Ends the points of a file, of which there must be one.
pub(super) fn finish(faces: &mut IndexedFaces) -> Result<(), Halt> {
    if faces.vertex_count() == 0 {
        return Err(Fault::new(Place::File, "at least one point", "none").into());
    }
    Ok(faces.finish()?)
}

fn read_points<R: Read>(words: &mut Words<R>, faces: &mut IndexedFaces) -> Result<(), Halt> {
    while let Some((line, _)) = words.line() {
        let mut numbers = line
            .split(|&byte| is_blank(byte) || byte == b',' || byte == b';')
            .filter(|word| !word.is_empty())
            .peekable();
        if numbers.peek().is_none_or(|word| word.starts_with(b"#") || word.starts_with(b"//")) {
            continue;
        }
        let mut point = [0.0; 3];
        for coordinate in &mut point {
            let invalid = || Fault::new(words.place(), "a point: three numbers", excerpt(&line));
            *coordinate = numbers.next().and_then(number).ok_or_else(invalid)?;
        }
        add(faces, point, words.place())?;
    }
    Ok(())
}

/// Adds a point that was read at a place.
pub(super) fn add(faces: &mut IndexedFaces, point: [f64; 3], place: Place) -> Result<(), Halt> {
    if let Some(misfit) = point.into_iter().find(|&coordinate| !coordinate_fits(coordinate)) {
        let found = format!("{misfit:e}; leave out points without a position");
        return Err(Fault::new(place, COORDINATE, found).into());
    }
    let number = faces.vertex_count();
    if number == MAX_TRIANGLES {
        return Err(Fault::Limit { place, most: MAX_TRIANGLES, what: "points" }.into());
    }
    faces.add_vertices(&[point])?;
    Ok(faces.add_run(3, 1, 0, 0, &[number as u32; 3])?)
}
