//! The report of a bake: the file that it made, and what the file itself does not state.

use crate::progress::Traffic;
use bvh_format::Layout;
use bvh_format::header::SectionKind;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::open_edges::OpenEdges;
use bvh_format::profile::Profile;
use bvh_format::topology::ObjectTopology;

/// The outcome of a bake.
///
/// [`FileSummary`] has an example.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BakeReport {
    /// The summary of the file: layout, counts, bytes and errors.
    pub file: FileSummary,
    /// The reason for this layout: one sentence about the first object, or empty if the user chose the whole layout.
    pub reason: String,
    /// The edges that leave objects open; `None` if the file does not state which objects are closed, and for open objects with
    /// `Effort::Quick` and on `wasm32-unknown-unknown`, where `bvh_query::Bvh::open_edges` counts them.
    pub open_edges: Option<OpenEdges>,
    /// The largest error that is not coarse for an object of this size and number of triangles, in mesh units. `None`
    /// unless `Options::max_error` exceeds it, so that quantisation may have collapsed triangles that matter.
    pub advised_max_error: Option<f64>,
    /// What the readers did that the authors of the inputs may not expect, such as bytes or points that they left out. Each is one
    /// line that names the file and the place. None of them are known if the output was up to date.
    pub warnings: Vec<String>,
    /// The mean of decoded width over tight width, over all nodes and slabs.
    pub width_inflation: f64,
    /// The mean of decoded box volume over tight box volume, over all nodes.
    pub volume_inflation: f64,
    /// The mean number of children per treelet.
    pub mean_children: f64,
    /// The bytes read from files and written to files.
    pub traffic: Traffic,
    /// The seconds from the parsed mesh (with a memory budget, from the start of reading) to the finished bytes, or to
    /// the closed file if one is written. 0 on `wasm32-unknown-unknown`, which has no clock.
    pub seconds: f64,
}

/// Counts and sizes of a file, from its header and object table.
///
/// ```
/// use bvh_bake::{BakeReport, Options, shapes, to_bytes};
///
/// let (bytes, report): (Vec<u8>, BakeReport) = to_bytes(&shapes::block([2.0, 2.0, 2.0])?, &Options::default())?;
/// assert_eq!((report.file.triangles, report.file.closed), (12, Some(1)));
/// assert_eq!(report.file.file_bytes, bytes.len() as u64);
/// println!("{} with {}: {}", report.file.profile.name(), report.file.triangle_encoding.name(), report.reason);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FileSummary {
    /// The major and the minor version of the format.
    pub version: (u16, u16),
    /// The profile of the first object.
    pub profile: Profile,
    /// The triangle encoding of the first object.
    pub triangle_encoding: TriangleEncoding,
    /// The number of triangles in the input.
    pub triangles_in: u64,
    /// The number of stored triangles.
    pub triangles: u64,
    /// The number of stored triangles without area.
    pub degenerate: u64,
    /// The number of exact duplicates that were left out.
    pub duplicates: u64,
    /// The number of objects in the file.
    pub objects: u64,
    /// The number of instances; 0 if the file is no scene.
    pub instances: u64,
    /// The number of closed objects; `None` if the file does not state which are.
    pub closed: Option<u64>,
    /// The bytes of the file.
    pub file_bytes: u64,
    /// The bytes of the treelet pages.
    pub node_bytes: u64,
    /// The bytes of the leaf blocks.
    pub triangle_bytes: u64,
    /// The bytes of the id blocks and duplicate pairs.
    pub id_bytes: u64,
    /// The largest distance by which a vertex moved before it was quantised, in mesh units: 0 unless it was rounded or welded on
    /// purpose, or lay below the least unit of the format.
    pub max_vertex_rounding: f64,
    /// The largest distance by which quantisation moved a vertex, in mesh units.
    pub max_quantization_error: f64,
    /// The content checksum.
    pub content_xxh3: u64,
}

impl FileSummary {
    /// Makes the summary from the header and the object table, given the length of the file, the number of its instances and
    /// the records of its topology.
    pub fn new(layout: &Layout, file_bytes: u64, instances: u64, topology: &[ObjectTopology]) -> Self {
        let records = || layout.objects.iter().map(|object| object.record());
        let bytes = |kinds: &[SectionKind]| {
            let sections = layout.sections.iter().filter(|section| kinds.contains(&section.kind));
            sections.map(|section| section.range.len() as u64).sum()
        };
        let first = layout.objects.first();
        Self {
            version: layout.version,
            profile: first.map_or(Profile::Dop14U8, |object| object.profile()),
            triangle_encoding: first.map_or(TriangleEncoding::F32, |object| object.triangle_encoding()),
            triangles_in: records().map(|record| record.input_triangles.get()).max().unwrap_or(0),
            triangles: records().map(|record| record.triangles.get()).fold(0, u64::saturating_add),
            degenerate: records().map(|record| record.degenerate.get()).fold(0, u64::saturating_add),
            duplicates: records().map(|record| record.duplicates.get()).fold(0, u64::saturating_add),
            objects: layout.objects.len() as u64,
            instances,
            closed: layout
                .has_topology()
                .then(|| topology.iter().filter(|object| object.closed).count() as u64),
            file_bytes,
            node_bytes: bytes(&[SectionKind::Nodes]),
            triangle_bytes: bytes(&[SectionKind::Leaves]),
            id_bytes: bytes(&[SectionKind::Ids, SectionKind::Duplicates]),
            max_vertex_rounding: records().map(|r| r.max_vertex_rounding.get()).fold(0.0, f64::max),
            max_quantization_error: records().map(|r| r.max_quantization_error.get()).fold(0.0, f64::max),
            content_xxh3: layout.content_checksum,
        }
    }

    /// Returns the bytes of the whole file per stored triangle.
    pub fn bytes_per_tri(&self) -> f64 {
        self.file_bytes as f64 / self.triangles as f64
    }
}
