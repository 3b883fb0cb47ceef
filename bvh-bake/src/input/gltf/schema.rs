//! The parts of a glTF document from which triangles come, as its JSON has them (glTF 2.0 specification, section 5). All others,
//! such as materials, are skipped.
//!
//! An accessor and a buffer view are judged when they are read: what no triangle needs may be wrong. The tree of nodes is judged as
//! a whole.

use super::attributes::{Attribute, Attributes};
use super::data::{Accessor, Buffer, View};
use super::whole::{self, Number};
use crate::error::{Fault, Place};
use crate::input::frame::Transform;
use serde::Deserialize;

/// A parsed document. `check` must pass before any number of a part is used as a place in a list.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    pub(super) asset: Asset,
    #[serde(default)]
    pub(super) extensions_required: Vec<String>,
    #[serde(default, deserialize_with = "whole::maybe")]
    pub(super) scene: Option<usize>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) skins: Vec<Skin>,
    #[serde(default)]
    pub(super) animations: Vec<Animation>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<View>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Asset {
    pub(super) version: String,
    /// The least version that a reader must know, which may be less than `version`.
    pub(super) min_version: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default, deserialize_with = "whole::list")]
    pub(super) nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    #[serde(default, deserialize_with = "whole::maybe")]
    pub(super) mesh: Option<usize>,
    #[serde(default, deserialize_with = "whole::maybe")]
    pub(super) skin: Option<usize>,
    #[serde(default, deserialize_with = "whole::list")]
    pub(super) children: Vec<usize>,
    /// The columns of a 4x4 matrix, which takes the place of the three fields below.
    matrix: Option<[f32; 16]>,
    translation: Option<[f32; 3]>,
    /// A quaternion x, y, z, w.
    rotation: Option<[f32; 4]>,
    scale: Option<[f32; 3]>,
    /// The weights of the morph targets, which take the place of those of the mesh.
    pub(super) weights: Option<Vec<f32>>,
    extensions: Option<Box<NodeExtensions>>,
}

#[derive(Deserialize)]
struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    instancing: Option<Instancing>,
    #[serde(rename = "KHR_node_visibility")]
    visibility: Option<Visibility>,
    #[serde(rename = "MSFT_lod")]
    levels: Option<Levels>,
}

#[derive(Deserialize)]
struct Instancing {
    #[serde(default)]
    attributes: Attributes,
}

#[derive(Deserialize)]
struct Visibility {
    #[serde(default = "visible")]
    visible: bool,
}

fn visible() -> bool {
    true
}

#[derive(Deserialize)]
struct Levels {
    #[serde(default, deserialize_with = "whole::list")]
    ids: Vec<usize>,
}

impl Node {
    /// Returns the attributes of the instances of the node's mesh, if the node has any.
    pub(super) fn instancing(&self) -> Option<&Attributes> {
        self.extensions.as_ref()?.instancing.as_ref().map(|instancing| &instancing.attributes)
    }

    /// Returns whether the node hides itself and those below it.
    pub(super) fn is_hidden(&self) -> bool {
        let visibility = self.extensions.as_ref().and_then(|extensions| extensions.visibility.as_ref());
        visibility.is_some_and(|visibility| !visibility.visible)
    }

    /// Returns the nodes that show this one with less detail.
    pub(super) fn levels(&self) -> &[usize] {
        let levels = self.extensions.as_ref().and_then(|extensions| extensions.levels.as_ref());
        levels.map_or(&[], |levels| &levels.ids)
    }

    pub(super) fn transform(&self) -> Transform {
        if let Some(matrix) = self.matrix {
            let column = |at: usize| [matrix[at], matrix[at + 1], matrix[at + 2], matrix[at + 3]];
            return Transform::Matrix { matrix: [0, 4, 8, 12].map(column) };
        }
        Transform::Decomposed {
            translation: self.translation.unwrap_or([0.0; 3]).map(f64::from),
            rotation: self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]).map(f64::from),
            scale: self.scale.unwrap_or([1.0; 3]).map(f64::from),
        }
    }
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    pub(super) primitives: Vec<Primitive>,
    /// The weights of the morph targets of each primitive.
    #[serde(default)]
    pub(super) weights: Vec<f32>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: Attributes,
    #[serde(default, deserialize_with = "whole::maybe")]
    pub(super) indices: Option<usize>,
    #[serde(default)]
    pub(super) mode: Mode,
    /// What each morph target adds.
    #[serde(default)]
    pub(super) targets: Vec<Attributes>,
}

impl Primitive {
    /// Returns the accessor of the positions.
    pub(super) fn position(&self) -> Option<usize> {
        self.attributes.of(Attribute::Position)
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    #[serde(deserialize_with = "whole::list")]
    pub(super) joints: Vec<usize>,
    #[serde(default, deserialize_with = "whole::maybe")]
    pub(super) inverse_bind_matrices: Option<usize>,
}

/// An animation, of which only what it changes is known.
#[derive(Deserialize)]
pub(super) struct Animation {
    #[serde(default)]
    channels: Vec<Channel>,
}

#[derive(Deserialize)]
struct Channel {
    target: Option<Target>,
}

#[derive(Deserialize)]
struct Target {
    path: Option<Path>,
    extensions: Option<TargetExtensions>,
}

#[derive(Deserialize)]
struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pointer: Option<Pointer>,
}

#[derive(Deserialize)]
struct Pointer {
    pointer: Option<Path>,
}

/// What an animation changes: a field of a node, or any part of the document by a JSON pointer.
#[derive(Deserialize)]
#[serde(from = "String")]
struct Path {
    moves: bool,
}

impl From<String> for Path {
    fn from(name: String) -> Self {
        let is_field = matches!(name.as_str(), "translation" | "rotation" | "scale" | "weights");
        Self { moves: is_field || name.starts_with("/nodes/") || name.starts_with("/meshes/") }
    }
}

impl Animation {
    /// Returns whether the animation moves nodes or changes weights.
    pub(super) fn moves(&self) -> bool {
        let moves = |path: &Option<Path>| path.as_ref().is_some_and(|path| path.moves);
        self.channels.iter().filter_map(|channel| channel.target.as_ref()).any(|target| {
            let pointer = target.extensions.as_ref().and_then(|extensions| extensions.pointer.as_ref());
            moves(&target.path) || pointer.is_some_and(|pointer| moves(&pointer.pointer))
        })
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(try_from = "Number")]
pub(super) enum Mode {
    PointsOrLines,
    #[default]
    Triangles = 4,
    TriangleStrip = 5,
    TriangleFan = 6,
}

impl TryFrom<Number> for Mode {
    type Error = String;

    fn try_from(Number(number): Number) -> Result<Self, String> {
        match number {
            0..=3 => Ok(Self::PointsOrLines),
            4 => Ok(Self::Triangles),
            5 => Ok(Self::TriangleStrip),
            6 => Ok(Self::TriangleFan),
            _ => Err(format!("mode {number}, expected 0 to 6")),
        }
    }
}

impl Document {
    /// Checks that all numbers of the tree of nodes are those of parts that exist.
    pub(super) fn check(&self) -> Result<(), Fault> {
        let nodes = |at: usize, user: &str, of: usize, field: &str| {
            part(&self.nodes, "nodes", at, || format!("{user}[{of}].{field}")).map(drop)
        };
        if let Some(scene) = self.scene.filter(|&scene| scene >= self.scenes.len()) {
            return Err(wrong(&format!("a scene below {}", self.scenes.len()), &scene.to_string()));
        }
        for (of, scene) in self.scenes.iter().enumerate() {
            scene.nodes.iter().try_for_each(|&at| nodes(at, "scenes", of, "nodes"))?;
        }
        for (of, node) in self.nodes.iter().enumerate() {
            if let Some(at) = node.mesh {
                part(&self.meshes, "meshes", at, || format!("nodes[{of}].mesh"))?;
            }
            node.children.iter().try_for_each(|&at| nodes(at, "nodes", of, "children"))?;
        }
        Ok(())
    }

    /// Returns the accessor that `user` needs.
    pub(super) fn accessor(&self, number: usize, user: impl FnOnce() -> String) -> Result<&Accessor, Fault> {
        part(&self.accessors, "accessors", number, user)
    }
}

/// Returns a part of the document by its number, which `user` states.
pub(super) fn part<'a, T>(
    list: &'a [T],
    kind: &str,
    number: usize,
    user: impl FnOnce() -> String,
) -> Result<&'a T, Fault> {
    list.get(number).ok_or_else(|| {
        wrong(
            &format!("a number below {} of one of the {kind}", list.len()),
            &format!("{number} in {}", user()),
        )
    })
}

/// Returns the fault of a document that does not follow the specification.
pub(super) fn wrong(expected: &str, found: &str) -> Fault {
    Fault::new(Place::File, format!("glTF that follows its schema: {expected}"), found)
}
