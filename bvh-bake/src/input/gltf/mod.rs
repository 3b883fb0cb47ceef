//! Reads glTF 2.0 scenes, in one of two ways. As a mesh, each node with a mesh becomes an object, and the nodes above it
//! place it. As a scene, each mesh becomes an object, or one per scale (module `frame`), and each node an instance of it.
//!
//! Module `document` reads the JSON, whose parts module `schema` lists; nothing else is in memory as a whole. Module
//! `accessor` reads accessors block by block. Module `buffer` finds buffers, and module `beside` opens files that the
//! document names.
//!
//! The reader takes the default scene or, if there is none, the first scene or, if there is no scene, all nodes without
//! a parent. Transforms are read as f32 and multiplied in f64. Triangles, strips and fans are read; points and lines
//! are not. Skins, morph targets and animations are ignored. As a mesh, a mesh that several nodes share is copied for
//! each of them. The degenerate triangles that join the parts of a strip are left out, because they are not part of the
//! surface; other degenerate triangles are kept.
//!
//! Required extensions that do not change triangles are ignored, `KHR_mesh_quantization` is supported, and any other
//! extension (Draco, meshopt) is refused.

mod accessor;
mod beside;
mod buffer;
mod document;
mod schema;
mod sink;

use crate::error::{Fault, Halt, Place, excerpt};
use crate::input::frame::{self, Affine, Frame, IDENTITY, Scales};
use crate::input::input_file::{InputFile, RandomAccess};
use crate::limits::MAX_VERTICES;
use crate::progress::Progress;
use crate::storage::resources::Allowance;
use buffer::Buffers;
use bvh_format::checksum::Hasher;
use bvh_format::instances::Instance;
use schema::{Document, Mode, Node};
pub(crate) use sink::{InMemory, Sink};
use std::collections::HashMap;

/// The number of vertices and indices that a scene may have besides one per byte of its buffers. A small file can
/// require any number of them by placing one mesh many times.
const MAX_COPIES: u64 = 1 << 26;
/// The number of vertices that a primitive counts as, besides its own, to bound the time that primitives take.
const PRIMITIVE_ITEMS: u64 = 16;

/// Reads a file as a mesh or as a scene, and passes on what it finds. The document must fit in `memory`. Returns a
/// checksum of all that was passed on.
pub(crate) fn read(
    input: &InputFile,
    access: &RandomAccess,
    sink: &mut impl Sink,
    memory: Allowance,
    progress: &Progress,
) -> Result<u64, Halt> {
    let parsed = document::read(input, access, memory, progress)?;
    let document = &parsed.document;
    let buffers = Buffers::new(document, input.path(), access, parsed.blob, input.allows_outside(), progress);
    let mut scene = Scene {
        document,
        as_scene: input.is_scene(),
        buffers,
        sink,
        hasher: Hasher::default(),
        objects: 0,
        variants: HashMap::new(),
        scales: Scales::of(document.nodes.iter().map(Node::transform)),
        items: 0,
    };
    scene.read_nodes()?;
    Ok(scene.hasher.finish())
}

/// Whether S of a [`Frame`] is the same, to the bit.
type ShapeBits = [[u64; 3]; 3];

struct Scene<'a, S> {
    document: &'a Document,
    /// Whether nodes become instances.
    as_scene: bool,
    buffers: Buffers<'a>,
    sink: &'a mut S,
    /// Hashes what the sink gets.
    hasher: Hasher,
    /// The number of objects so far.
    objects: u32,
    /// The object of each mesh and shape, as a scene.
    variants: HashMap<(usize, ShapeBits), u32>,
    scales: Scales,
    items: u64,
}

/// The transform of a node's parent: a matrix, or a frame if nodes become instances.
#[derive(Clone, Copy)]
enum Parent {
    Matrix(Affine),
    Frame(Frame),
}

impl Parent {
    fn of_child(&self, node: &Node, scales: &mut Scales) -> Self {
        match self {
            Self::Matrix(matrix) => Self::Matrix(frame::product(matrix, &frame::local(node.transform()))),
            Self::Frame(frame) => Self::Frame(frame.of_child(node.transform(), scales)),
        }
    }
}

impl<S: Sink> Scene<'_, S> {
    /// Visits the nodes of the scene, each before its children.
    fn read_nodes(&mut self) -> Result<(), Halt> {
        let document = self.document;
        let nodes = &document.nodes;
        let mut seen = vec![false; nodes.len()];
        let topmost = match document.scenes.get(document.scene.unwrap_or(0)) {
            Some(scene) => scene.nodes.clone(),
            None => {
                let mut has_parent = seen.clone();
                nodes.iter().flat_map(|node| &node.children).for_each(|&child| has_parent[child] = true);
                (0..nodes.len()).filter(|&node| !has_parent[node]).collect()
            }
        };
        let mut todo: Vec<(usize, Parent)> =
            topmost.into_iter().rev().map(|node| (node, self.world())).collect();
        while let Some((number, parent)) = todo.pop() {
            if std::mem::replace(&mut seen[number], true) {
                return Err(
                    Fault::new(Place::File, "nodes that form trees", format!("node {number} twice")).into()
                );
            }
            let node = &nodes[number];
            let own = parent.of_child(node, &mut self.scales);
            if let Some(mesh) = node.mesh {
                let of_mesh = document.meshes[mesh].name.as_deref();
                let name = node.name.as_deref().or(of_mesh).unwrap_or_default();
                match &own {
                    Parent::Matrix(placed) => {
                        self.read_mesh(name, mesh, frame::mirrors(placed), |point| {
                            frame::apply(placed, point)
                        })?;
                    }
                    Parent::Frame(frame) => self.add_instance(name, mesh, frame)?,
                }
            }
            todo.extend(node.children.iter().rev().map(|&child| (child, own)));
        }
        Ok(())
    }

    /// Returns the parent transform of the topmost nodes.
    fn world(&self) -> Parent {
        if self.as_scene { Parent::Frame(Frame::WORLD) } else { Parent::Matrix(IDENTITY) }
    }

    /// Adds an instance of a mesh, which is read once for each shape.
    fn add_instance(&mut self, name: &str, mesh: usize, frame: &Frame) -> Result<(), Halt> {
        // An inherited name is a copy.
        self.spend(name.len() as u64 / 8 + PRIMITIVE_ITEMS)?;
        let key = (mesh, frame.shape.map(|row| row.map(|value| (value + 0.0).to_bits())));
        let object = match self.variants.get(&key) {
            Some(&object) => object,
            None => {
                let object = self.objects;
                let of_mesh = self.document.meshes[mesh].name.as_deref().unwrap_or(name);
                self.read_mesh(of_mesh, mesh, frame.mirrors(), |point| frame.shaped(point))?;
                self.variants.insert(key, object);
                object
            }
        };
        let (rotation, translation) = (frame.rotation, frame.translation);
        self.hash_name(name);
        self.hasher.update(&object.to_le_bytes());
        let pose = rotation.as_flattened().iter().chain(&translation);
        pose.for_each(|value| self.hasher.update(&value.to_le_bytes()));
        let instance =
            Instance { name: name.to_owned(), rotation, translation, ..Instance::of_object(object) };
        self.sink.instance(instance)
    }

    fn hash_name(&mut self, name: &str) {
        self.hasher.update(&(name.len() as u64).to_le_bytes());
        self.hasher.update(name.as_bytes());
    }

    /// Reads a mesh as an object whose vertices are moved by `place`.
    fn read_mesh(
        &mut self,
        name: &str,
        mesh: usize,
        mirrors: bool,
        place: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<(), Halt> {
        self.hash_name(name);
        self.sink.begin(name)?;
        self.objects += 1;
        // Primitives often share their vertices. The map leads from an accessor to its first vertex, as the sink and as the
        // object count, and to its number of vertices.
        let mut shared: HashMap<usize, (u64, u64, u64)> = HashMap::new();
        let mut vertices = 0;
        let document = self.document;
        for primitive in &document.meshes[mesh].primitives {
            let mode = primitive.mode;
            let Some(number) = primitive.attributes.position.filter(|_| mode != Mode::PointsOrLines) else {
                continue;
            };
            let (first, own, count) = match shared.get(&number) {
                Some(&known) => known,
                None => {
                    let accessor = &document.accessors[number];
                    let count = accessor.count;
                    let known = (self.sink.next_vertex(), vertices, count);
                    accessor::find(accessor, &mut self.buffers)?;
                    self.spend(count)?;
                    vertices += count;
                    let Self { buffers, sink, hasher, .. } = self;
                    accessor::positions(number, accessor, buffers, |positions| {
                        positions.iter_mut().for_each(|position| *position = place(*position));
                        hasher.update(bytemuck::cast_slice(positions));
                        sink.vertices(positions)
                    })?;
                    shared.insert(number, known);
                    known
                }
            };
            if first + count > MAX_VERTICES {
                return Err(Fault::Limit { place: Place::File, most: MAX_VERTICES, what: "vertices" }.into());
            }
            let indices = primitive.indices.map(|number| (number, &document.accessors[number]));
            if let Some((_, accessor)) = indices {
                accessor::find(accessor, &mut self.buffers)?;
            }
            self.spend(
                indices.map_or(count, |(_, accessor)| accessor.count).saturating_add(PRIMITIVE_ITEMS),
            )?;
            let mut triangles = Triangles::of(mode, first as u32, mirrors);
            let Self { buffers, sink, hasher, .. } = self;
            hasher.update(&[mode as u8, u8::from(mirrors)]);
            hasher.update(&own.to_le_bytes());
            let mut give = |indices: &[u32]| {
                if let Some(found) = indices.iter().find(|&&index| u64::from(index) >= count) {
                    let expected =
                        format!("vertex numbers below {count} in object \"{}\"", excerpt(name.as_bytes()));
                    return Err(Fault::new(Place::File, expected, found.to_string()).into());
                }
                hasher.update(bytemuck::cast_slice(indices));
                sink.triangles(triangles.add(indices))
            };
            match indices {
                Some((number, accessor)) => accessor::indices(number, accessor, buffers, &mut give)?,
                None => {
                    let mut block = Vec::new();
                    for start in (0..count as u32).step_by(PLAIN_INDICES) {
                        block.clear();
                        block.extend((start..count as u32).take(PLAIN_INDICES));
                        give(&block)?;
                    }
                }
            }
            triangles.finish()?;
        }
        Ok(())
    }

    /// Counts what is about to be read against the limit. Each single accessor is no longer than its buffer.
    fn spend(&mut self, items: u64) -> Result<(), Fault> {
        let most = MAX_COPIES + self.buffers.total;
        self.items = self.items.saturating_add(items);
        if self.items > most {
            return Err(Fault::Limit {
                place: Place::File,
                most,
                what: "vertices, indices and names, nodes that share a mesh each with its own (as a scene they share it)",
            });
        }
        Ok(())
    }
}

/// The number of indices that are made at a time for a primitive that states none.
const PLAIN_INDICES: usize = 1 << 14;

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
