//! Reads glTF 2.0 scenes: each node with a mesh becomes an object, and the nodes above it place it.
//!
//! The `gltf` crate reads and validates the document. Accessors are read in module `accessor`, because the crate's own
//! iterators panic on counts and strides that a file may contain; buffers are found in module `buffer`. The reader
//! takes the default scene or, if there is none, the first scene or, if there is no scene, all nodes without a parent.
//! Transforms are read as f32 and multiplied in f64. Triangles, strips and fans are read; points and lines are not.
//! Skins, morph targets and animations move nothing. A mesh that several nodes share is copied for each. The degenerate
//! triangles that join the parts of a strip are left out, because they are no part of the surface; other degenerate
//! triangles are kept.
//!
//! Required extensions that do not change triangles are ignored, `KHR_mesh_quantization` is supported, and any other
//! extension (Draco, meshopt) is refused.

mod accessor;
mod buffer;

use super::next_ids;
use crate::error::{Fault, Place, excerpt};
use crate::input::mesh::{Mesh, Object};
use crate::progress::Progress;
use buffer::Buffers;
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

pub(super) fn read(bytes: &[u8], path: &Path, progress: &Progress) -> Result<Mesh, Fault> {
    let (text, blob) = split(bytes)?;
    let document = parse(text, blob.is_some())?;
    let mut scene = Scene {
        document: &document,
        buffers: Buffers::new(blob, path, progress),
        mesh: Mesh::default(),
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

/// The first three rows of a 4x4 matrix.
type Affine = [[f64; 4]; 3];

const IDENTITY: Affine = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

struct Scene<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    mesh: Mesh,
    next_id: u32,
    items: u64,
}

impl Scene<'_> {
    /// Visits the nodes of the scene, each before its children.
    fn read_nodes(&mut self) -> Result<(), Fault> {
        let document = self.document;
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let mut seen = vec![false; document.nodes().len()];
        let mut todo: Vec<(gltf::Node, Affine)> = match scene {
            Some(scene) => scene.nodes().map(|node| (node, IDENTITY)).collect(),
            None => {
                let mut has_parent = seen.clone();
                document
                    .nodes()
                    .flat_map(|node| node.children())
                    .for_each(|child| has_parent[child.index()] = true);
                document
                    .nodes()
                    .filter(|node| !has_parent[node.index()])
                    .map(|node| (node, IDENTITY))
                    .collect()
            }
        };
        todo.reverse();
        while let Some((node, scene_from_parent)) = todo.pop() {
            if std::mem::replace(&mut seen[node.index()], true) {
                let found = format!("node {} twice", node.index());
                return Err(Fault::new(Place::File, "nodes that form trees", found));
            }
            let scene_from_node = product(&scene_from_parent, &local(node.transform()));
            if let Some(mesh) = node.mesh() {
                let name = node.name().or(mesh.name()).unwrap_or_default();
                self.read_mesh(name, &mesh, &scene_from_node)?;
            }
            let first = todo.len();
            todo.extend(node.children().map(|child| (child, scene_from_node)));
            todo[first..].reverse();
        }
        Ok(())
    }

    fn read_mesh(&mut self, name: &str, mesh: &gltf::Mesh, placed: &Affine) -> Result<(), Fault> {
        let mut object = Object { name: name.to_owned(), ..Object::default() };
        let mirrors = determinant(placed) < 0.0;
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
                    object.positions.extend(positions.iter().map(|&position| apply(placed, position)));
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
            return Err(Fault::Limit { place: Place::File, most, what: "vertices and indices in the scene" });
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

/// Returns a node's own transform. A rotation is normalised, because its f32 numbers are inexact.
fn local(transform: gltf::scene::Transform) -> Affine {
    match transform {
        gltf::scene::Transform::Matrix { matrix } => {
            std::array::from_fn(|row| std::array::from_fn(|column| f64::from(matrix[column][row])))
        }
        gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
            let [x, y, z, w] = rotation.map(f64::from);
            let norm = x * x + y * y + z * z + w * w;
            let s = if norm > 0.0 { 2.0 / norm } else { 0.0 };
            let rotation = [
                [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
                [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
                [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
            ];
            std::array::from_fn(|row| {
                let [a, b, c] =
                    std::array::from_fn(|column| rotation[row][column] * f64::from(scale[column]));
                [a, b, c, f64::from(translation[row])]
            })
        }
    }
}

fn product(a: &Affine, b: &Affine) -> Affine {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let [x, y, z, w] = a[row];
            let sum = x * b[0][column] + y * b[1][column] + z * b[2][column];
            if column == 3 { sum + w } else { sum }
        })
    })
}

fn apply(m: &Affine, [x, y, z]: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * x + row[1] * y + row[2] * z + row[3])
}

fn determinant(m: &Affine) -> f64 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}
