//! Writes glTF files for tests, a tetrahedron and accessors of all kinds beside it, and compares what is read.

use super::{refused, try_bytes};
use bvh_bake::Options;
use bvh_bake::input::{MeshFormat, read_bytes_with};
use bvh_bake::mesh::Mesh;
use std::path::Path;

/// A file that is being written. Accessor 0 has the corners of the tetrahedron (0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), and
/// accessor 1 its 12 vertex numbers, which lead outwards.
#[derive(Clone)]
pub(super) struct Model {
    pub(super) nodes: String,
    pub(super) meshes: String,
    /// More fields of the document, each followed by a comma.
    pub(super) fields: String,
    accessors: Vec<String>,
    views: Vec<String>,
    buffer: Vec<u8>,
}

/// A primitive of the tetrahedron, without the closing brace.
pub(super) const PRIMITIVE: &str = r#"{"attributes":{"POSITION":0},"indices":1"#;

impl Model {
    pub(super) fn new() -> Self {
        let mut model = Self {
            nodes: r#"{"mesh":0}"#.to_owned(),
            meshes: format!(r#"{{"primitives":[{PRIMITIVE}}}]}}"#),
            fields: String::new(),
            accessors: Vec::new(),
            views: Vec::new(),
            buffer: Vec::new(),
        };
        model.floats("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0]);
        model.integers("SCALAR", 5123, false, &[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
        model
    }

    /// Returns a file with a skin, morph targets, instances and what is told.
    pub(super) fn everything() -> Self {
        let mut model = Self::new();
        let joints = model.integers("VEC4", 5121, false, &[0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0]);
        let weights =
            model.integers("VEC4", 5121, true, &[127, 128, 0, 0, 0, 0, 0, 0, 255, 0, 0, 0, 9, 9, 0, 0]);
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 2.0, 3.0, 1.0];
        let matrices = model.floats("MAT4", &[identity; 2].concat());
        let sparse = model.sparse(4, &[0, 3], &[-1.0, 0.0, 0.0, 0.0, 0.0, 3.0]);
        let deltas = model.integers("VEC3", 5120, false, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
        let places = model.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
        let turns = model.integers("VEC4", 5122, true, &[0, 0, 0, 32767, 0, 0, 32767, 32767]);
        model.meshes = format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":0,"JOINTS_0":{joints},"WEIGHTS_0":{weights}}},"indices":1,
            "targets":[{{"POSITION":{sparse}}},{{"POSITION":{deltas}}}]}},{{"attributes":{{"POSITION":0}},"mode":1}}],"weights":[0.5,1]}}"#
        );
        model.nodes = format!(
            r#"{{"mesh":0,"skin":0}},{{"children":[2],"scale":[1,2,3]}},{{"translation":[1,2,3]}},{{"mesh":0,"weights":[1,0],"extensions":{{
            "EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{places},"ROTATION":{turns},"SCALE":{places}}}}},
            "KHR_node_visibility":{{"visible":false}},"MSFT_lod":{{"ids":[4]}}}}}},{{"mesh":0}}"#
        );
        model.fields = format!(
            r#""skins":[{{"joints":[1,2],"inverseBindMatrices":{matrices}}}],"scenes":[{{"nodes":[0,1,3]}}],"scene":0,
            "animations":[{{"channels":[{{"target":{{"path":"weights"}}}}]}}],"extensionsRequired":["EXT_mesh_gpu_instancing"],"#
        );
        model
    }

    /// Adds a buffer view with other fields, such as a stride, and returns its number.
    pub(super) fn view(&mut self, bytes: &[u8], fields: &str) -> usize {
        let (at, length) = (self.buffer.len(), bytes.len());
        self.views.push(format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{length}{fields}}}"#));
        self.buffer.extend(bytes);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    /// Adds an accessor, and returns its number.
    pub(super) fn accessor(&mut self, json: String) -> usize {
        self.accessors.push(json);
        self.accessors.len() - 1
    }

    /// Adds an accessor of f32, and returns its number.
    pub(super) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let (view, count) = (self.view(&bytes, ""), values.len() / numbers(kind));
        self.accessor(format!(
            r#"{{"bufferView":{view},"componentType":5126,"count":{count},"type":"{kind}"}}"#
        ))
    }

    /// Adds an accessor of integers of a component type, and returns its number.
    pub(super) fn integers(&mut self, kind: &str, component: u32, normalized: bool, values: &[i64]) -> usize {
        let size = [1, 1, 2, 2, 0, 4][component as usize - 5120];
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()[..size].to_vec()).collect();
        let (view, count) = (self.view(&bytes, ""), values.len() / numbers(kind));
        self.accessor(format!(
            r#"{{"bufferView":{view},"componentType":{component},"normalized":{normalized},"count":{count},"type":"{kind}"}}"#
        ))
    }

    /// Adds an accessor of f32 of which only some values are not zero, by their places, and returns its number.
    pub(super) fn sparse(&mut self, count: usize, places: &[u8], values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let (at, values, some) = (self.view(places, ""), self.view(&bytes, ""), places.len());
        self.accessor(format!(
            r#"{{"componentType":5126,"count":{count},"type":"VEC3","sparse":{{"count":{some},
            "indices":{{"bufferView":{at},"componentType":5121}},"values":{{"bufferView":{values}}}}}}}"#
        ))
    }

    /// Changes the text of an accessor.
    pub(super) fn edit(&mut self, accessor: usize, from: &str, to: &str) {
        let edited = self.accessors[accessor].replacen(from, to, 1);
        assert_ne!(edited, self.accessors[accessor]);
        self.accessors[accessor] = edited;
    }

    pub(super) fn json(&self) -> String {
        let Self { nodes, meshes, fields, .. } = self;
        let [accessors, views] = [&self.accessors, &self.views].map(|list| list.join(","));
        format!(
            r#"{{"asset":{{"version":"2.0"}},{fields}"nodes":[{nodes}],"meshes":[{meshes}],"accessors":[{accessors}],
            "bufferViews":[{views}],"buffers":[{{"byteLength":{}}}]}}"#,
            self.buffer.len()
        )
    }

    pub(super) fn buffer(&self) -> &[u8] {
        &self.buffer
    }

    /// Returns the binary file.
    pub(super) fn glb(&self) -> Vec<u8> {
        crate::glb(&self.json(), &self.buffer)
    }
}

fn numbers(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => 16,
    }
}

pub(super) type Point = [f64; 3];

#[track_caller]
pub(super) fn read(model: &Model) -> Mesh {
    try_bytes(&model.glb(), MeshFormat::Gltf).unwrap()
}

#[track_caller]
pub(super) fn read_scene(model: &Model) -> Mesh {
    read_bytes_with(&model.glb(), MeshFormat::Gltf, Path::new("test"), &Options::default().scene(true))
        .unwrap()
}

#[track_caller]
pub(super) fn told(mesh: &Mesh, expected: &[&str]) {
    let found: Vec<_> = mesh.warnings.iter().map(|told| told.strip_prefix("test: ").unwrap()).collect();
    assert_eq!(found, expected);
}

#[track_caller]
pub(super) fn wrong(model: &Model, expected: &str) {
    refused(&model.glb(), MeshFormat::Gltf, expected);
}

#[track_caller]
pub(super) fn near(found: &[Point], expected: &[Point]) {
    assert_eq!(found.len(), expected.len());
    let off = found.as_flattened().iter().zip(expected.as_flattened()).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 1e-6, "{found:?}, not {expected:?}");
}

pub(super) fn corners() -> [Point; 4] {
    [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]
}

/// Returns six times the volume inside, which is negative if the surface is inside out.
pub(super) fn volume(mesh: &Mesh) -> f64 {
    let of = |[a, b, c]: [Point; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    let of_object = |object: &bvh_bake::mesh::Object| {
        let corners =
            object.triangles.iter().map(|corners| corners.map(|corner| object.positions[corner as usize]));
        corners.map(of).sum::<f64>()
    };
    mesh.objects.iter().map(of_object).sum()
}
