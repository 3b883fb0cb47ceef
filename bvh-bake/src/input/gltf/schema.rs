//! The parts of a glTF document from which triangles come, as its JSON has them (glTF 2.0 specification, section 5). All others,
//! such as materials and skins, are skipped.

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
    pub(super) scene: Option<usize>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<View>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
}

#[derive(Deserialize)]
pub(super) struct Asset {
    pub(super) version: String,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub(super) nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    pub(super) mesh: Option<usize>,
    #[serde(default)]
    pub(super) children: Vec<usize>,
    /// The columns of a 4x4 matrix, which takes the place of the three fields below.
    matrix: Option<[f32; 16]>,
    translation: Option<[f32; 3]>,
    /// A quaternion x, y, z, w.
    rotation: Option<[f32; 4]>,
    scale: Option<[f32; 3]>,
}

impl Node {
    pub(super) fn transform(&self) -> Transform {
        if let Some(matrix) = self.matrix {
            let column = |at: usize| [matrix[at], matrix[at + 1], matrix[at + 2], matrix[at + 3]];
            return Transform::Matrix { matrix: [0, 4, 8, 12].map(column) };
        }
        Transform::Decomposed {
            translation: self.translation.unwrap_or([0.0; 3]),
            rotation: self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            scale: self.scale.unwrap_or([1.0; 3]),
        }
    }
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: Attributes,
    pub(super) indices: Option<usize>,
    #[serde(default)]
    pub(super) mode: Mode,
}

#[derive(Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<usize>,
}

#[derive(Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(try_from = "u32")]
pub(super) enum Mode {
    PointsOrLines,
    #[default]
    Triangles = 4,
    TriangleStrip = 5,
    TriangleFan = 6,
}

impl TryFrom<u32> for Mode {
    type Error = String;

    fn try_from(number: u32) -> Result<Self, String> {
        match number {
            0..=3 => Ok(Self::PointsOrLines),
            4 => Ok(Self::Triangles),
            5 => Ok(Self::TriangleStrip),
            6 => Ok(Self::TriangleFan),
            _ => Err(format!("mode {number}, expected 0 to 6")),
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: ComponentType,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) dimensions: Dimensions,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(try_from = "u32")]
pub(super) enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl TryFrom<u32> for ComponentType {
    type Error = String;

    fn try_from(number: u32) -> Result<Self, String> {
        Ok(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(format!("componentType {number}, expected 5120 to 5123, 5125 or 5126")),
        })
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Dimensions {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

/// Values of an accessor that replace others.
#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: ComponentType,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) byte_length: u64,
    /// Data in base64, or a file; none for the bytes embedded in a binary file.
    pub(super) uri: Option<String>,
}

impl Document {
    /// Checks the version, strides, and that all numbers of parts are those of parts that exist.
    pub(super) fn check(&self) -> Result<(), Fault> {
        if self.asset.version.split('.').next() != Some("2") {
            return Err(wrong("asset.version 2.0", &self.asset.version));
        }
        let below = |list: &str, count: usize, at: usize, user: &str, of: usize, field: &str| {
            if at < count {
                return Ok(());
            }
            Err(wrong(
                &format!("a number below {count} of one of the {list}"),
                &format!("{at} in {user}[{of}].{field}"),
            ))
        };
        let (nodes, accessors, views) = (self.nodes.len(), self.accessors.len(), self.buffer_views.len());
        if let Some(scene) = self.scene.filter(|&scene| scene >= self.scenes.len()) {
            return Err(wrong(&format!("a scene below {}", self.scenes.len()), &scene.to_string()));
        }
        for (of, scene) in self.scenes.iter().enumerate() {
            scene.nodes.iter().try_for_each(|&at| below("nodes", nodes, at, "scenes", of, "nodes"))?;
        }
        for (of, node) in self.nodes.iter().enumerate() {
            node.mesh.map_or(Ok(()), |at| below("meshes", self.meshes.len(), at, "nodes", of, "mesh"))?;
            node.children.iter().try_for_each(|&at| below("nodes", nodes, at, "nodes", of, "children"))?;
        }
        for (of, mesh) in self.meshes.iter().enumerate() {
            for Primitive { attributes, indices, .. } in &mesh.primitives {
                let mut accessor = attributes.position.into_iter().chain(*indices);
                accessor.try_for_each(|at| below("accessors", accessors, at, "meshes", of, "primitives"))?;
            }
        }
        for (of, accessor) in self.accessors.iter().enumerate() {
            let mut used = accessor.views();
            used.try_for_each(|at| below("bufferViews", views, at, "accessors", of, "bufferView"))?;
        }
        for (of, view) in self.buffer_views.iter().enumerate() {
            below("buffers", self.buffers.len(), view.buffer, "bufferViews", of, "buffer")?;
            if let Some(stride) = view.byte_stride.filter(|stride| !(4..=252).contains(stride)) {
                return Err(wrong("byteStride from 4 to 252", &format!("{stride} in bufferViews[{of}]")));
            }
        }
        Ok(())
    }
}

impl Accessor {
    /// The buffer views that the accessor uses.
    pub(super) fn views(&self) -> impl Iterator<Item = usize> {
        let sparse = self.sparse.as_ref();
        let of_sparse = sparse.map(|sparse| [sparse.indices.buffer_view, sparse.values.buffer_view]);
        self.buffer_view.into_iter().chain(of_sparse.into_iter().flatten())
    }
}

fn wrong(expected: &str, found: &str) -> Fault {
    Fault::new(
        Place::File,
        format!("glTF that follows its schema: {expected}"),
        crate::error::excerpt(found.as_bytes()),
    )
}
