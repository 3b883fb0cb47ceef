//! Reads glTF 2.0 scenes, in one of two ways. As a mesh, each node with a mesh becomes an object, and the nodes above it
//! place it. As a scene, each mesh becomes an object, or one per scale (module `frame`), and each node an instance of it.
//!
//! Module `document` reads the JSON, whose parts modules `schema` and `data` list; nothing else is in memory as a whole. Module
//! `accessor` reads accessors block by block. Module `buffer` finds buffers, and module `beside` opens files that the
//! document names. Module `primitives` reads triangles, and module `vertices` their corners, which modules `morph` and `skin`
//! may move. Module `instancing` repeats a mesh.
//!
//! The reader takes the default scene or, if there is none, the first scene or, if there is no scene, all nodes without
//! a parent. Transforms are read as f32 and multiplied in f64. Triangles, strips and fans are read; points and lines
//! are not. The file is read as it is at rest, with the weights of morph targets and the joints of skins as it states them;
//! animations are ignored. A mesh with a skin stands in the world, and is an object of its own in a scene. As a mesh, a mesh that
//! several nodes share is copied for each of them. The degenerate triangles that join the parts of a strip are left out, because
//! they are not part of the surface; other degenerate triangles are kept. Invisible nodes are read, because a missed contact is
//! worse than one too many, and because programs that do not know `KHR_node_visibility` read them. Module `tell` warns of what
//! changes triangles and is not read.
//!
//! Required extensions that do not change triangles are ignored, as module `extensions` lists them, and any other
//! extension that is not read (Draco, meshopt) is refused.

mod accessor;
mod attributes;
mod beside;
mod buffer;
mod data;
mod document;
mod extensions;
mod instancing;
mod morph;
mod primitives;
mod schema;
mod sink;
mod skin;
mod tell;
mod version;
mod vertices;
mod whole;

use crate::error::{Fault, Halt, Place};
use crate::input::frame::{self, Affine, Frame, IDENTITY, Scales, Transform};
use crate::input::input_file::{InputFile, RandomAccess};
use crate::progress::Progress;
use crate::storage::resources::Allowance;
use buffer::Buffers;
use bvh_format::checksum::Hasher;
use bvh_format::instances::Instance;
use instancing::Placements;
use morph::Morphs;
use primitives::PRIMITIVE_ITEMS;
use schema::{Document, Node};
pub(crate) use sink::{InMemory, Sink};
use skin::Skins;
use std::collections::HashMap;
use tell::Told;
use vertices::{Key, Shape};

/// The number of vertices and indices that a scene may have besides one per byte of its buffers. A small file can
/// require any number of them by placing one mesh many times.
const MAX_COPIES: u64 = 1 << 26;
/// Bytes of memory per object that is there for an instance which no node states, and per joint of a skin.
const BYTES_PER_VARIANT: u64 = 256;
const BYTES_PER_JOINT: u64 = 128;

/// Reads a file as a mesh or as a scene, and passes on what it finds. The document must fit in `memory`. Returns a
/// checksum of all that was passed on.
pub(crate) fn read(
    input: &InputFile,
    access: &RandomAccess,
    sink: &mut dyn Sink,
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
        morphs: Morphs::new(document),
        skins: Skins::new(document),
        told: Told::new(document),
        memory: parsed.left,
        items: 0,
    };
    let seen = scene.read_nodes()?;
    scene.told.tell(document, &seen, input.warnings());
    Ok(scene.hasher.finish())
}

/// Whether S of a [`Frame`] is the same, to the bit.
type ShapeBits = [[u64; 3]; 3];

struct Scene<'a> {
    document: &'a Document,
    /// Whether nodes become instances.
    as_scene: bool,
    buffers: Buffers<'a>,
    sink: &'a mut dyn Sink,
    /// Hashes what the sink gets.
    hasher: Hasher,
    /// The number of objects so far.
    objects: u32,
    /// The object of each mesh and shape, as a scene.
    variants: HashMap<(Key, ShapeBits), u32>,
    scales: Scales,
    morphs: Morphs<'a>,
    skins: Skins<'a>,
    told: Told,
    /// The memory that is left beside the document.
    memory: Allowance,
    items: u64,
}

/// The transform of a node's parent: a matrix, or a frame if nodes become instances.
#[derive(Clone, Copy)]
enum Parent {
    Matrix(Affine),
    Frame(Frame),
}

impl Parent {
    fn of_child(&self, transform: Transform, scales: &mut Scales) -> Self {
        match self {
            Self::Matrix(matrix) => Self::Matrix(frame::product(matrix, &frame::local(transform))),
            Self::Frame(frame) => Self::Frame(frame.of_child(transform, scales)),
        }
    }
}

/// A node that waits to be read: its number, its parent's transform, and whether a node above it is invisible.
type Waiting = (usize, Parent, bool);

impl Scene<'_> {
    /// Visits the nodes of the scene, each before its children. Returns which nodes were read.
    fn read_nodes(&mut self) -> Result<Vec<bool>, Halt> {
        let nodes = &self.document.nodes;
        let mut seen = vec![false; nodes.len()];
        let topmost = self.topmost().into_iter().rev();
        let mut todo: Vec<Waiting> = topmost.map(|node| (node, self.world(), false)).collect();
        while let Some((number, parent, is_hidden)) = todo.pop() {
            if std::mem::replace(&mut seen[number], true) {
                return Err(skin::no_tree(number).into());
            }
            let node = &nodes[number];
            let own = parent.of_child(node.transform(), &mut self.scales);
            let is_hidden = is_hidden || node.is_hidden();
            if let Some(mesh) = node.mesh {
                if is_hidden {
                    self.told.hide(number);
                }
                self.read_node(number, mesh, &own)?;
            }
            todo.extend(node.children.iter().rev().map(|&child| (child, own, is_hidden)));
        }
        Ok(seen)
    }

    /// Returns the topmost nodes of the scene. Without a scene, a node that shows another with less detail is none of them.
    fn topmost(&self) -> Vec<usize> {
        let document = self.document;
        if let Some(scene) = document.scenes.get(document.scene.unwrap_or(0)) {
            return scene.nodes.clone();
        }
        let nodes = &document.nodes;
        let mut is_below = vec![false; nodes.len()];
        for &node in nodes.iter().flat_map(|node| node.children.iter().chain(node.levels())) {
            if let Some(is_below) = is_below.get_mut(node) {
                *is_below = true;
            }
        }
        (0..nodes.len()).filter(|&node| !is_below[node]).collect()
    }

    /// Returns the parent transform of the topmost nodes.
    fn world(&self) -> Parent {
        if self.as_scene { Parent::Frame(Frame::WORLD) } else { Parent::Matrix(IDENTITY) }
    }

    /// Reads the mesh of a node that is at `own`, as often as the node has instances.
    fn read_node(&mut self, number: usize, mesh: usize, own: &Parent) -> Result<(), Halt> {
        let document = self.document;
        let node = &document.nodes[number];
        let name = node.name.as_deref().or(document.meshes[mesh].name.as_deref()).unwrap_or_default();
        let mut shape = Shape { mesh, morph: self.morphs.of(number, mesh), joints: None };
        if let Some(skin) = node.skin {
            if node.instancing().is_some() {
                let expected = "a node with a skin or with EXT_mesh_gpu_instancing";
                return Err(schema::wrong(expected, &format!("both in nodes[{number}]")).into());
            }
            let joints = self.skins.cost(number, skin)?;
            self.spend(joints)?;
            self.memory.require(joints.saturating_mul(BYTES_PER_JOINT))?;
            shape.joints = Some(self.skins.joints(skin, &mut self.buffers)?);
            return self.place(name, &shape, &self.world());
        }
        let Some(attributes) = node.instancing() else { return self.place(name, &shape, own) };
        let mut placements = Placements::of(number, attributes, document, &mut self.buffers)?;
        self.spend(placements.count)?;
        let mut block = Vec::new();
        loop {
            placements.block(&mut block)?;
            if block.is_empty() {
                return Ok(());
            }
            for &transform in &block {
                let placed = own.of_child(transform, &mut self.scales);
                self.place(name, &shape, &placed)?;
                let more = (self.variants.len() as u64).saturating_sub(document.nodes.len() as u64);
                self.memory.require(more * BYTES_PER_VARIANT)?;
            }
        }
    }

    /// Reads a mesh where a node places it, as an object or as an instance.
    fn place(&mut self, name: &str, shape: &Shape, own: &Parent) -> Result<(), Halt> {
        match own {
            Parent::Matrix(placed) => {
                let mirrors = frame::mirrors(placed) != shape.mirrors();
                self.read_mesh(name, shape, mirrors, |point| frame::apply(placed, point))
            }
            Parent::Frame(frame) => self.add_instance(name, shape, frame),
        }
    }

    /// Adds an instance of a mesh, which is read once for each shape.
    fn add_instance(&mut self, name: &str, shape: &Shape, frame: &Frame) -> Result<(), Halt> {
        // An inherited name is a copy.
        self.spend(name.len() as u64 / 8 + PRIMITIVE_ITEMS)?;
        let key = (shape.key(), frame.shape.map(|row| row.map(|value| (value + 0.0).to_bits())));
        let object = match self.variants.get(&key) {
            Some(&object) => object,
            None => {
                let object = self.objects;
                let of_mesh = self.document.meshes[shape.mesh].name.as_deref().unwrap_or(name);
                let mirrors = frame.mirrors() != shape.mirrors();
                self.read_mesh(of_mesh, shape, mirrors, |point| frame.shaped(point))?;
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
