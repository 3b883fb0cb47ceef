//! Reads Wavefront OBJ: vertices, faces and the names of objects, in one pass over blocks that are parsed in parallel.
//!
//! The reader accepts any line ending, a byte order mark, `\` at the end of a `v` or `f` line, faces before their
//! vertices, negative numbers that count back from the face, missing texture coordinates and normals, and statements
//! that do not concern triangles. A vertex that is `nan` or beyond the range of f64 or of the format is an error only
//! if a face uses it. Faces of fewer than three corners, lines, points, free-form curves and surfaces, and calls of other files
//! are left out and counted. Objects are named by `o`, or by `g` if the file has no `o`; all faces under one name form one
//! object.
//!
//! A face may use vertices that follow it, so that corners are checked after the whole file has been read. Only a
//! malformed file is read again (module `faults`), to find the error and its line.

mod block;
mod blocks;
mod faults;
mod statements;

use super::byte_reader::ByteReader;
use super::indexed::IndexedFaces;
use super::warnings::{LeftOut, Warnings};
use crate::error::{Fault, Halt, Place};
use crate::input::names::Names;
use crate::limits::{MAX_TRIANGLES, MAX_VERTICES};
use crate::storage::resources::Resources;
use crate::threads;
use block::{Block, Event};
use blocks::{BLOCK_BYTES, next_block};
use statements::Kind;
use std::io::Read;

/// Bytes of memory per block: its text and its parsed content.
const BYTES_PER_BLOCK: usize = 4 * BLOCK_BYTES;

/// Bytes of memory per name, besides two copies of its letters.
const BYTES_PER_NAME: u64 = 160;

/// Reads a file into `faces` and returns the names of its objects. After a success, all corners are vertices that the
/// format can hold. `open` opens the file at its beginning.
pub(crate) fn read<R: Read>(
    open: impl Fn() -> Result<ByteReader<R>, Halt>,
    faces: &mut IndexedFaces,
    warnings: &Warnings,
    resources: &Resources,
) -> Result<Names, Halt> {
    let names = Names::default();
    let (triangles, lines, left_out, has_wrong_face) = (0, 0, <[LeftOut; _]>::default(), false);
    let mut reading = Reading { faces, names, resources, triangles, lines, left_out, has_wrong_face };
    let mut reader = open()?;
    reader.skip_mark();
    let blocks_at_once = resources.reading_tasks(BYTES_PER_BLOCK);
    loop {
        let mut texts = Vec::new();
        let mut is_too_long = false;
        while texts.len() < blocks_at_once && !is_too_long {
            match next_block(&mut reader) {
                Ok(Some(length)) => {
                    texts.push(reader.peek(length).to_vec());
                    reader.skip(length);
                }
                Ok(None) => break,
                Err(_) => is_too_long = true,
            }
        }
        if texts.is_empty() && !is_too_long {
            break;
        }
        for block in threads::map(texts, |text| Block::parse(&text)) {
            if !reading.add(block)? {
                return Err(faults::find(open));
            }
        }
        if is_too_long {
            return Err(faults::find(open));
        }
    }
    reader.finish(Ok(()))?;
    let Reading { faces, names, triangles, left_out, has_wrong_face, .. } = reading;
    faces.finish()?;
    let out_of_range = faces.first_out_of_range()?.map(|(place, _)| place);
    // A vertex that the format cannot hold is an error at the first face that uses it, which comes before errors below.
    if let Some((_, vertex)) = faces.first_misfit(out_of_range)? {
        return Err(faults::misfit(open()?, vertex.into()));
    }
    if has_wrong_face || out_of_range.is_some() {
        return Err(faults::find(open));
    }
    let kinds = || Kind::ALL.into_iter().map(Kind::words).zip(&left_out);
    kinds().for_each(|(words, left_out)| left_out.tell(warnings, words));
    if triangles == 0 {
        let mut counted = kinds().filter_map(|(words, left_out)| left_out.counted(words));
        let found = counted.next().map_or("none".to_owned(), |counted| format!("none but {counted}"));
        return Err(Fault::new(Place::File, "at least one face", found).into());
    }
    Ok(names)
}

/// The content that has been read so far.
struct Reading<'a> {
    faces: &'a mut IndexedFaces,
    names: Names,
    resources: &'a Resources,
    triangles: u64,
    /// The number of lines.
    lines: u64,
    /// What is left out, by its kind.
    left_out: [LeftOut; Kind::ALL.len()],
    has_wrong_face: bool,
}

impl Reading<'_> {
    /// Adds a block. Returns false if the block has a malformed vertex or a vertex beyond the limit.
    fn add(&mut self, mut block: Block) -> Result<bool, Halt> {
        let above = self.faces.vertex_count();
        for (left_out, (count, first)) in self.left_out.iter_mut().zip(block.left_out) {
            left_out.add_all(count, Place::Line(self.lines + first));
        }
        self.lines += block.lines;
        self.faces.add_vertices(&block.vertices)?;
        if block.has_wrong_vertex || self.faces.vertex_count() > MAX_VERTICES {
            return Ok(false);
        }
        if self.has_wrong_face {
            return Ok(true);
        }
        self.has_wrong_face = block.has_wrong_face;
        for &(place, vertex) in &block.relative {
            match u32::try_from(above as i64 + vertex) {
                Ok(vertex) => block.corners[place] = vertex,
                Err(_) => {
                    self.has_wrong_face = true;
                    block.corners.truncate(place);
                    break;
                }
            }
        }
        let mut rest = &block.corners[..];
        for event in block.events {
            match event {
                Event::Name { is_object, name } => {
                    if self.names.enter(is_object, &name) {
                        self.resources.keep(BYTES_PER_NAME + 2 * name.len() as u64)?;
                    }
                }
                Event::Faces { corners, faces } => {
                    let (object, group) = self.names.current();
                    let count = (u64::from(corners) * u64::from(faces)).min(rest.len() as u64) as usize;
                    let (now, later) = rest.split_at(count);
                    self.faces.add_run(corners, faces, object, group, now)?;
                    self.triangles += u64::from(faces) * u64::from(corners - 2);
                    rest = later;
                }
            }
        }
        // The valid corners of a malformed face may still be misfits.
        self.faces.add_corners(rest)?;
        self.has_wrong_face |= self.triangles > MAX_TRIANGLES;
        Ok(true)
    }
}
