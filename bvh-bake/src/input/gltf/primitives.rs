//! Reads the primitives of a mesh: the vertices of each, which several may share, and triangles from lists, strips and fans.

use super::Scene;
use super::accessor::{self, BLOCK_BYTES, BLOCK_VALUES, Reader};
use super::schema::{Mode, Primitive};
use super::vertices::{Shape, Sources};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::limits::MAX_VERTICES;
use std::collections::HashMap;

/// The number of vertices that a primitive counts as, besides its own, to bound the time that primitives take.
pub(super) const PRIMITIVE_ITEMS: u64 = 16;

/// Vertices that have been read: the number of the first as the sink and as the object count, and how many.
#[derive(Clone, Copy)]
struct Known {
    first: u64,
    own: u64,
    count: u64,
}

impl<'a> Scene<'a> {
    /// Reads a mesh as an object whose vertices are moved by `place`.
    pub(super) fn read_mesh(
        &mut self,
        name: &str,
        shape: &Shape,
        mirrors: bool,
        place: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<(), Halt> {
        self.hash_name(name);
        self.sink.begin(name)?;
        self.objects += 1;
        let mut known = HashMap::new();
        let mut vertices = 0;
        let document = self.document;
        let mesh = shape.mesh;
        let is_first = self.told.begin_mesh(mesh);
        for (number, primitive) in document.meshes[mesh].primitives.iter().enumerate() {
            let position = primitive.position().filter(|_| primitive.mode != Mode::PointsOrLines);
            let Some(position) = position else {
                self.told.leave_out(primitive, is_first);
                continue;
            };
            let user = move || format!("primitive {number} of meshes[{mesh}]");
            self.spend(PRIMITIVE_ITEMS + shape.morph.targets() + primitive.attributes.len())?;
            let sources = Sources::of(position, primitive, shape, &user)?;
            let found = match known.get(&sources) {
                Some(&found) => found,
                None => {
                    let opened = sources.open(document, &mut self.buffers, &user)?;
                    let found = Known { first: self.sink.next_vertex(), own: vertices, count: opened.count };
                    self.spend(opened.cost())?;
                    vertices += found.count;
                    let Self { sink, hasher, told, .. } = self;
                    opened.read(shape.joints.as_deref(), &mut told.mended, |positions| {
                        positions.iter_mut().for_each(|position| *position = place(*position));
                        hasher.update(bytemuck::cast_slice(positions));
                        sink.vertices(positions)
                    })?;
                    known.insert(sources, found);
                    found
                }
            };
            if found.first + found.count > MAX_VERTICES {
                return Err(Fault::Limit { place: Place::File, most: MAX_VERTICES, what: "vertices" }.into());
            }
            self.read_triangles(name, primitive, found, mirrors, &user)?;
        }
        Ok(())
    }

    fn read_triangles(
        &mut self,
        name: &str,
        primitive: &Primitive,
        Known { first, own, count }: Known,
        mirrors: bool,
        user: &dyn Fn() -> String,
    ) -> Result<(), Halt> {
        let mode = primitive.mode;
        let indices = match primitive.indices {
            None => None,
            Some(number) => {
                let accessor = self.document.accessor(number, user)?;
                let wanted = &accessor::INDICES;
                let reader = Reader::<1>::of(number, accessor, wanted, BLOCK_BYTES, &mut self.buffers)?;
                Some((accessor.count, reader))
            }
        };
        self.spend(indices.as_ref().map_or(count, |&(count, _)| count))?;
        let mut triangles = Triangles::of(mode, first as u32, mirrors);
        let Self { sink, hasher, .. } = self;
        hasher.update(&[mode as u8, u8::from(mirrors)]);
        hasher.update(&own.to_le_bytes());
        let mut give = |indices: &[u32]| {
            if let Some(found) = indices.iter().find(|&&index| u64::from(index) >= count) {
                let expected =
                    format!("vertex numbers below {count} in object \"{}\"", excerpt(name.as_bytes()));
                return Err(Halt::from(Fault::new(Place::File, expected, found.to_string())));
            }
            hasher.update(bytemuck::cast_slice(indices));
            sink.triangles(triangles.add(indices))
        };
        let mut block = Vec::new();
        match indices {
            Some((mut left, mut reader)) => {
                while left > 0 {
                    // Every index is exact in f64 and in the range of u32.
                    reader.block(BLOCK_VALUES, &mut block, |[index]| index as u32)?;
                    left -= block.len() as u64;
                    give(&block)?;
                }
            }
            None => {
                for start in (0..count as u32).step_by(BLOCK_VALUES) {
                    block.clear();
                    block.extend((start..count as u32).take(BLOCK_VALUES));
                    give(&block)?;
                }
            }
        }
        Ok(triangles.finish()?)
    }
}

/// Turns vertex numbers into triangles of one winding, some at a time.
struct Triangles {
    mode: Mode,
    /// The vertex that has the number 0.
    first: u32,
    mirrors: bool,
    /// The numbers before those that come next, on which they depend: of a list those that are no triangle yet, of a
    /// strip the last two, of a fan the first and the last.
    before: [u32; 2],
    waiting: usize,
    /// The number of indices so far.
    count: usize,
    made: Vec<[u32; 3]>,
}

impl Triangles {
    fn of(mode: Mode, first: u32, mirrors: bool) -> Self {
        Self { mode, first, mirrors, before: [0; 2], waiting: 0, count: 0, made: Vec::new() }
    }

    /// Adds indices, and returns the triangles that they complete.
    fn add(&mut self, indices: &[u32]) -> &[[u32; 3]] {
        self.made.clear();
        for &index in indices {
            self.count += 1;
            if self.waiting < 2 {
                self.before[self.waiting] = index;
                self.waiting += 1;
                continue;
            }
            let [a, b] = self.before;
            let triangle = match self.mode {
                Mode::TriangleStrip => {
                    self.before = [b, index];
                    // The degenerate triangles that join parts of a strip are left out.
                    if a == b || b == index || index == a {
                        continue;
                    }
                    if self.count % 2 == 1 { [a, b, index] } else { [b, a, index] }
                }
                Mode::TriangleFan => {
                    self.before = [a, index];
                    [a, b, index]
                }
                _ => {
                    self.waiting = 0;
                    [a, b, index]
                }
            };
            let [a, b, c] = triangle.map(|corner| self.first + corner);
            self.made.push(if self.mirrors { [a, c, b] } else { [a, b, c] });
        }
        &self.made
    }

    /// Checks that no indices are left over.
    fn finish(&self) -> Result<(), Fault> {
        if self.mode == Mode::Triangles && self.waiting > 0 {
            let expected = "a multiple of three vertex numbers in a list of triangles";
            return Err(Fault::new(Place::File, expected, self.count.to_string()));
        }
        Ok(())
    }
}
