//! What a bake did: counts, bytes, errors, times.

use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// The outcome of a bake.
#[derive(Debug, Clone, PartialEq)]
pub struct BakeReport {
    /// Profile of the first object.
    pub profile: Profile,
    /// Triangle encoding of the first object.
    pub triangle_encoding: TriangleEncoding,
    /// Why these: one sentence, empty if the user chose both.
    pub reason: String,
    /// Triangles of the input.
    pub triangles_in: u64,
    /// Triangles stored.
    pub triangles: u64,
    /// Zero-area triangles among those stored.
    pub degenerate: u64,
    /// Exact duplicates left out.
    pub duplicates: u64,
    /// Distinct vertices that the input's triangles use.
    pub vertices: u64,
    /// Objects in the file.
    pub objects: u64,
    /// Bytes of the file.
    pub file_bytes: u64,
    /// Bytes of the pages of treelets.
    pub node_bytes: u64,
    /// Bytes of the leaf blocks.
    pub triangle_bytes: u64,
    /// Bytes of the id blocks and duplicate pairs.
    pub id_bytes: u64,
    /// Largest move of a vertex by rounding to f32, mesh units.
    pub max_vertex_rounding: f64,
    /// Largest move of a vertex by quantisation, mesh units.
    pub max_quantization_error: f64,
    /// Mean over nodes and slabs of decoded width / tight width.
    pub width_inflation: f64,
    /// Mean over nodes of the box volume's ratio.
    pub volume_inflation: f64,
    /// Mean number of children of a treelet.
    pub mean_children: f64,
    /// The content checksum.
    pub content_xxh3: u64,
    /// Seconds from the parsed mesh to the finished bytes, or to the closed file where one is written.
    pub seconds: f64,
}

impl BakeReport {
    /// Bytes of the whole file a stored triangle.
    pub fn bytes_per_tri(&self) -> f64 {
        self.file_bytes as f64 / self.triangles as f64
    }
}
