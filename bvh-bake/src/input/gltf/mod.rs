//! Reads glTF 2.0 scenes, in one of two ways. As a mesh, each node with a mesh becomes an object, and the nodes above it
//! place it. As a scene, each mesh becomes an object, or one per scale (module `frame`), and each node an instance of it.
//!
//! The `gltf` crate reads and validates the document. Accessors are read in module `accessor`, because the crate's own
//! iterators panic on counts and strides that a file may contain; buffers are found in module `buffer`. The reader
//! takes the default scene or, if there is none, the first scene or, if there is no scene, all nodes without a parent.
//! Transforms are read as f32 and multiplied in f64. Triangles, strips and fans are read; points and lines are not.
//! Skins, morph targets and animations move nothing. As a mesh, what several nodes share is copied for each. The degenerate
//! triangles that join the parts of a strip are left out, because they are no part of the surface; other degenerate
//! triangles are kept.
//!
//! Required extensions that do not change triangles are ignored, `KHR_mesh_quantization` is supported, and any other
//! extension (Draco, meshopt) is refused.

mod accessor;
mod buffer;
mod frame;

use super::next_ids;
use crate::error::{Fault, Place, excerpt};
use crate::input::mesh::{Mesh, Object};
use crate::progress::Progress;
use buffer::Buffers;
use bvh_format::instances::Instance;
use frame::{Affine, Frame, IDENTITY, Scales};
use gltf::Document;
use gltf::json::{self, validation::Checked};
use gltf::mesh::{Mode, Semantic};
use std::collections::HashMap;
use std::path::Path;

/// The number of vertices and indices that a scene may have besides one per byte of its buffers. A small file can
/// require any number of them by placing one mesh many times.
const MAX_COPIES: u64 = 1 << 26;
/// The number of vertices that a primitive counts as, besides its own, to bound the time that primitives take.
const PRIMITIVE_ITEMS: usize = 16;

/// Reads a file as a mesh or as a scene.
pub(super) fn read(bytes: &[u8], path: &Path, as_scene: bool, progress: &Progress) -> Result<Mesh, Fault> {
    let (text, blob) = split(bytes)?;
    let document = parse(text, blob.is_some())?;
    let mut scene = Scene {
        document: &document,
        as_scene,
        buffers: Buffers::new(blob, path, progress),
        mesh: Mesh::default(),
        variants: HashMap::new(),
        scales: Scales::of(document.nodes().map(|node| node.transform())),
        next_id: 0,
        items: 0,
    };
    scene.read_nodes()?;
    Ok(scene.mesh)
}

/// Splits a binary file into its JSON and the embedded bytes.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word =
        |at: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?)) };
    let (version, length) = (word(4).unwrap_or(0), word(8).unwrap_or(0));
    if version != 2 {
        return Err(Fault::new(Place::Byte(4), "binary glTF of version 2", version.to_string()));
    }
    let file = bytes.get(..length as usize);
    let file = file.ok_or_else(|| {
        Fault::new(Place::Byte(8), format!("a length of at most {}", bytes.len()), length.to_string())
    })?;
    let mut chunks = [None; 2];
    let mut at = 12;
    for (chunk, kind) in chunks.iter_mut().zip([b"JSON", b"BIN\0"]) {
        let Some(head) = file.get(at..at + 8) else { break };
        let (size, name) = head.split_at(4);
        let size = u32::from_le_bytes([size[0], size[1], size[2], size[3]]) as usize;
        let content = file.get(at + 8..).and_then(|rest| rest.get(..size));
        *chunk = content.filter(|_| name == kind);
        if chunk.is_none() {
            let expected = format!("a chunk {} inside the file", excerpt(kind));
            return Err(Fault::new(
                Place::Byte(at as u64),
                expected,
                format!("{} of {size} bytes", excerpt(name)),
            ));
        }
        at += 8 + size;
    }
    let [text, blob] = chunks;
    let text = text.ok_or_else(|| Fault::new(Place::Byte(12), "a JSON chunk", "the end of the file"))?;
    Ok((text, blob))
}

fn parse(text: &[u8], is_binary: bool) -> Result<Document, Fault> {
    let mut root: json::Root = json::deserialize::from_slice(text).map_err(|error| {
        let place = if is_binary { Place::File } else { Place::Line(error.line() as u64) };
        Fault::new(place, "a glTF document", excerpt(error.to_string().as_bytes()))
    })?;
    let changes_triangles = |name: &str| {
        !["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_"]
            .iter()
            .any(|kind| name.starts_with(kind))
            && name != "KHR_mesh_quantization"
    };
    if let Some(name) = root.extensions_required.iter().find(|name| changes_triangles(name)) {
        return Err(Fault::new(
            Place::File,
            "no required extension that changes triangles",
            excerpt(name.as_bytes()),
        ));
    }
    root.extensions_required.clear();
    // The crate's validation looks up each POSITION before it checks the number, and requires bounds that are not used
    // here.
    let accessors = root.accessors.len();
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        if let Some(index) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) {
            let Some(accessor) = root.accessors.get_mut(index.value()) else {
                let expected = format!("an accessor below {accessors}");
                return Err(Fault::new(Place::File, expected, index.value().to_string()));
            };
            let anything = || json::serialize::to_value([0.0f32; 3]).ok();
            accessor.min = anything();
            accessor.max = anything();
        }
    }
    Document::from_json(root).map_err(|error| {
        let found = match error {
            gltf::Error::Validation(errors) => {
                errors.first().map_or(String::new(), |(path, error)| format!("{error} at {path}"))
            }
            other => other.to_string(),
        };
        Fault::new(Place::File, "glTF that follows its schema", excerpt(found.as_bytes()))
    })
}

/// Whether S of a [`Frame`] is the same, to the bit.
type ShapeBits = [[u64; 3]; 3];

struct Scene<'a> {
    document: &'a Document,
    /// Whether nodes become instances.
    as_scene: bool,
    buffers: Buffers<'a>,
    mesh: Mesh,
    /// The object of each mesh and shape, as a scene.
    variants: HashMap<(usize, ShapeBits), u32>,
    scales: Scales,
    next_id: u32,
    items: u64,
}

/// What a node stands in: a matrix, or a frame if nodes become instances.
#[derive(Clone, Copy)]
enum Parent {
    Matrix(Affine),
    Frame(Frame),
}

impl Parent {
    fn of_child(&self, node: &gltf::Node, scales: &mut Scales) -> Self {
        match self {
            Self::Matrix(matrix) => Self::Matrix(frame::product(matrix, &frame::local(node.transform()))),
            Self::Frame(frame) => Self::Frame(frame.of_child(node.transform(), scales)),
        }
    }
}

impl Scene<'_> {
    /// Visits the nodes of the scene, each before its children.
    fn read_nodes(&mut self) -> Result<(), Fault> {
        let document = self.document;
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let mut seen = vec![false; document.nodes().len()];
        let mut todo: Vec<(gltf::Node, Parent)> = match scene {
            Some(scene) => scene.nodes().map(|node| (node, self.world())).collect(),
            None => {
                let mut has_parent = seen.clone();
                document
                    .nodes()
                    .flat_map(|node| node.children())
                    .for_each(|child| has_parent[child.index()] = true);
                document
                    .nodes()
                    .filter(|node| !has_parent[node.index()])
                    .map(|node| (node, self.world()))
                    .collect()
            }
        };
        todo.reverse();
        while let Some((node, parent)) = todo.pop() {
            if std::mem::replace(&mut seen[node.index()], true) {
                let found = format!("node {} twice", node.index());
                return Err(Fault::new(Place::File, "nodes that form trees", found));
            }
            let own = parent.of_child(&node, &mut self.scales);
            if let Some(mesh) = node.mesh() {
                let name = node.name().or(mesh.name()).unwrap_or_default();
                match &own {
                    Parent::Matrix(placed) => {
                        self.read_mesh(name, &mesh, frame::mirrors(placed), |point| {
                            frame::apply(placed, point)
                        })?;
                    }
                    Parent::Frame(frame) => self.add_instance(name, &mesh, frame)?,
                }
            }
            let first = todo.len();
            todo.extend(node.children().map(|child| (child, own)));
            todo[first..].reverse();
        }
        Ok(())
    }

    /// Returns what the topmost nodes stand in.
    fn world(&self) -> Parent {
        if self.as_scene { Parent::Frame(Frame::WORLD) } else { Parent::Matrix(IDENTITY) }
    }

    /// Adds an instance of a mesh, which is read once for each shape.
    fn add_instance(&mut self, name: &str, mesh: &gltf::Mesh, frame: &Frame) -> Result<(), Fault> {
        // An inherited name is a copy.
        self.spend(name.len() / 8 + PRIMITIVE_ITEMS)?;
        let key = (mesh.index(), frame.shape.map(|row| row.map(|value| (value + 0.0).to_bits())));
        let object = match self.variants.get(&key) {
            Some(&object) => object,
            None => {
                let object = self.mesh.objects.len() as u32;
                let of_mesh = mesh.name().unwrap_or(name);
                self.read_mesh(of_mesh, mesh, frame.mirrors(), |point| frame.shaped(point))?;
                self.variants.insert(key, object);
                object
            }
        };
        let (rotation, translation) = (frame.rotation, frame.translation);
        let instance =
            Instance { name: name.to_owned(), rotation, translation, ..Instance::of_object(object) };
        self.mesh.instances.push(instance);
        Ok(())
    }

    /// Reads a mesh as an object whose vertices are moved by `place`.
    fn read_mesh(
        &mut self,
        name: &str,
        mesh: &gltf::Mesh,
        mirrors: bool,
        place: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<(), Fault> {
        let mut object = Object { name: name.to_owned(), ..Object::default() };
        // Primitives often share their vertices. The map leads from an accessor to its first vertex and its number of
        // vertices.
        let mut shared: HashMap<usize, (usize, usize)> = HashMap::new();
        for primitive in mesh.primitives() {
            let mode = primitive.mode();
            if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
                continue;
            }
            let Some(accessor) = primitive.get(&Semantic::Positions) else { continue };
            let (first, count) = match shared.get(&accessor.index()) {
                Some(&known) => known,
                None => {
                    let first = object.positions.len();
                    let positions = accessor::positions(&accessor, &mut self.buffers)?;
                    self.spend(positions.len())?;
                    object.positions.extend(positions.iter().map(|&position| place(position)));
                    let known = (first, positions.len());
                    shared.insert(accessor.index(), known);
                    known
                }
            };
            let indices = match primitive.indices() {
                Some(accessor) => accessor::indices(&accessor, &mut self.buffers)?,
                None => (0..count as u32).collect(),
            };
            self.spend(indices.len() + PRIMITIVE_ITEMS)?;
            if let Some(found) = indices.iter().find(|&&index| index as usize >= count) {
                let expected =
                    format!("vertex numbers below {count} in object \"{}\"", excerpt(name.as_bytes()));
                return Err(Fault::new(Place::File, expected, found.to_string()));
            }
            let triangles = assemble(mode, &indices)?;
            // Only a checked mesh has all its vertices in 32 bits. Before the check, a number may be out of range.
            let first = u32::try_from(first).unwrap_or(u32::MAX);
            object.triangles.extend(triangles.iter().map(|&[a, b, c]| {
                let [a, b, c] = [a, b, c].map(|corner| corner.saturating_add(first));
                if mirrors { [a, c, b] } else { [a, b, c] }
            }));
        }
        object.triangle_ids = next_ids(&mut self.next_id, object.triangles.len())?;
        self.mesh.objects.push(object);
        Ok(())
    }

    /// Counts what was read against the limit. Each single accessor is no longer than its buffer.
    fn spend(&mut self, items: usize) -> Result<(), Fault> {
        let most = MAX_COPIES + self.buffers.total;
        self.items += items as u64;
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

/// Turns vertex numbers into triangles of one winding.
fn assemble(mode: Mode, indices: &[u32]) -> Result<Vec<[u32; 3]>, Fault> {
    let joins = |t: &[u32; 3]| t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    match mode {
        Mode::TriangleStrip => {
            let windows = indices.windows(3).enumerate();
            let turned = windows
                .map(|(place, w)| if place % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
            Ok(turned.filter(|triangle| !joins(triangle)).collect())
        }
        Mode::TriangleFan => {
            let Some((&hub, rim)) = indices.split_first() else { return Ok(Vec::new()) };
            Ok(rim.windows(2).map(|pair| [hub, pair[0], pair[1]]).collect())
        }
        _ => match indices.as_chunks::<3>() {
            (triangles, []) => Ok(triangles.to_vec()),
            _ => {
                let found = indices.len().to_string();
                Err(Fault::new(
                    Place::File,
                    "a multiple of three vertex numbers in a list of triangles",
                    found,
                ))
            }
        },
    }
}
