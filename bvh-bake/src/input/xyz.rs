//! Reads XYZ: text with a point per line, and passes points on as triangles whose corners are equal.
//!
//! The first three numbers of a line are x, y and z, between blanks, commas or semicolons. What follows them, such as colours
//! or normals, is ignored. Empty lines and those that start with `#` or `//` are skipped. Above the first point, there may be a
//! line with the number of points and one with the names of the columns.

use super::byte_reader::{ByteReader, Words};
use super::indexed::IndexedFaces;
use super::input_file::InputFile;
use super::text::{is_blank, is_filler, number};
use super::warnings::LeftOut;
use super::{COORDINATE, misfit};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::limits::{MAX_TRIANGLES, coordinate_fits};
use std::io::Read;

/// Reads a file from its beginning to its end.
pub(super) fn read<R: Read>(
    reader: ByteReader<R>,
    faces: &mut IndexedFaces,
    input: &InputFile,
) -> Result<(), Halt> {
    let mut words = Words::new(reader);
    let mut points = Points::new(faces, input);
    let result = read_points(&mut words, &mut points);
    words.reader.finish(result)?;
    points.finish()
}

fn read_points<R: Read>(words: &mut Words<R>, points: &mut Points) -> Result<(), Halt> {
    let mut above = Above::default();
    while let Some((line, _)) = words.line() {
        let mut numbers = line.split(|&byte| is_separator(byte)).filter(|word| !word.is_empty()).peekable();
        let is_comment = |word: &&[u8]| word.starts_with(b"#") || word.starts_with(b"//");
        if numbers.peek().is_none_or(|word| is_comment(word) || is_filler(word)) {
            continue;
        }
        if points.count() == 0 && above.take(numbers.clone(), words.place()) {
            continue;
        }
        if line.contains(&b',') && has_other_separators(line.trim_ascii()) {
            let found = format!("{}; write decimal points, not commas", excerpt(&line));
            let expected = "a point: three numbers with the same separator between them";
            return Err(Fault::new(words.place(), expected, found).into());
        }
        let mut point = [0.0; 3];
        for coordinate in &mut point {
            let invalid = || Fault::new(words.place(), "a point: three numbers", excerpt(&line));
            *coordinate = numbers.next().and_then(number).ok_or_else(invalid)?;
        }
        points.add(point, words.place())?;
    }
    if let Some((count, place)) = above.count.filter(|&(count, _)| count != points.count()) {
        let told = format!("{} points follow this line, which states {count}", points.count());
        points.input.warnings().add(place, told);
    }
    Ok(())
}

fn is_separator(byte: u8) -> bool {
    is_blank(byte) || byte == b',' || byte == b';'
}

/// Returns whether a line has commas within words that other separators part: these are decimal commas, or nobody can tell.
fn has_other_separators(line: &[u8]) -> bool {
    let within = |part: &[u8]| part[1] == b',' && !is_separator(part[0]) && !is_separator(part[2]);
    line.iter().any(|&byte| is_blank(byte) || byte == b';') && line.windows(3).any(within)
}

/// What a file may have above its first point, each once.
#[derive(Default)]
struct Above {
    /// The number of points, and where it is stated.
    count: Option<(u64, Place)>,
    has_names: bool,
}

impl Above {
    /// Returns whether a line is no point: a whole number, or names of columns.
    fn take<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]> + Clone, place: Place) -> bool {
        if !self.has_names && words.clone().all(|word| number(word).is_none()) {
            self.has_names = true;
            return true;
        }
        let (word, has_more) = (words.next(), words.next().is_some());
        let stated = word.and_then(|word| std::str::from_utf8(word).ok()?.parse().ok());
        match stated.filter(|_| self.count.is_none() && !has_more) {
            Some(count) => self.count = Some((count, place)),
            None => return false,
        }
        true
    }
}

/// Takes the points of a file.
pub(super) struct Points<'a> {
    faces: &'a mut IndexedFaces,
    input: &'a InputFile<'a>,
    left_out: LeftOut,
}

impl<'a> Points<'a> {
    pub(super) fn new(faces: &'a mut IndexedFaces, input: &'a InputFile<'a>) -> Self {
        Self { faces, input, left_out: LeftOut::default() }
    }

    /// Returns the number of points so far, with those that were left out.
    pub(super) fn count(&self) -> u64 {
        self.faces.vertex_count() + self.left_out.count
    }

    /// Adds a point that was read at a place.
    pub(super) fn add(&mut self, point: [f64; 3], place: Place) -> Result<(), Halt> {
        if let Some(value) = point.into_iter().find(|&coordinate| !coordinate_fits(coordinate)) {
            if self.input.drops_nan() && !value.is_finite() {
                self.left_out.add(place);
                return Ok(());
            }
            return Err(Fault::new(place, COORDINATE, misfit(value, true)).into());
        }
        let number = self.faces.vertex_count();
        if number == MAX_TRIANGLES {
            return Err(Fault::Limit { place, most: MAX_TRIANGLES, what: "points" }.into());
        }
        self.faces.add_vertices(&[point])?;
        Ok(self.faces.add_run(3, 1, 0, 0, &[number as u32; 3])?)
    }

    /// Ends the points of a file, of which there must be one.
    pub(super) fn finish(self) -> Result<(), Halt> {
        tell_dropped(&self.left_out, self.input);
        if self.faces.vertex_count() == 0 {
            return Err(Fault::new(Place::File, "at least one point", no_point(&self.left_out)).into());
        }
        Ok(self.faces.finish()?)
    }
}

/// Warns of points that were left out.
pub(super) fn tell_dropped(left_out: &LeftOut, input: &InputFile) {
    left_out.tell(input.warnings(), ["point without a position", "points without a position"]);
}

/// Returns what was found instead of points.
fn no_point(left_out: &LeftOut) -> String {
    match left_out.count {
        0 => "none".to_owned(),
        count => format!("none, but {count} without a position"),
    }
}
