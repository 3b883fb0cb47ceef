//! The way from a mesh to the bytes of a file, stage by stage.

use crate::auto;
use crate::build;
use crate::encode::{Encoder, Sections, Totals};
use crate::error::BakeError;
use crate::mesh::{self, Mesh};
use crate::options::Options;
use crate::pages;
use crate::prepare::{Prepared, box_and_sphere, prepare};
use crate::prove::{prove_bounds, validate_in_parallel};
use crate::report::BakeReport;
use crate::treelets::Cutter;
use bvh_format::checksum::checksum;
use bvh_format::header::{Section, SectionKind, write_header};
use bvh_format::layout::ContentHasher;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::{F16_EXPONENTS, ObjectRecord, write_objects};
use bvh_format::page::{MAX_PAGES, PAGE};
use bvh_format::profile::Profile;
use std::time::Instant;
use zerocopy::FromZeros;

/// A stage of a bake, for those who show progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Origins, rounding, duplicates.
    Prepare,
    /// The binary tree.
    Build,
    /// Treelets and pages.
    Encode,
    /// The proof of the finished bytes.
    Prove,
}

impl Stage {
    /// The stage's name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prepare => "preparing",
            Self::Build => "building the tree",
            Self::Encode => "encoding pages",
            Self::Prove => "proving bounds",
        }
    }
}

/// Bakes a mesh into the bytes of a `.cbvh` file.
///
/// The bytes depend on the mesh and the options alone, not on the number of threads (rayon's current
/// pool is used). Every bake is proved: the bytes are validated and every bound checked.
///
/// Cost: about a microsecond a triangle on two cores, and 400 bytes of memory a triangle.
///
/// # Errors
/// `BakeError::Input` for a mesh that breaks the input contract (see `Mesh::check`), `Limit` for one
/// that outgrows the format, `Unproved` if the result fails its own checks.
pub fn to_bytes(mesh: &Mesh, options: &Options) -> Result<(Vec<u8>, BakeReport), BakeError> {
    to_bytes_with(mesh, options, "", &mut |_| ())
}

/// `to_bytes` with a provenance text (lines `key=value`, kept out of the content) and a callback at
/// the start of each stage.
///
/// # Errors
/// As `to_bytes`.
pub fn to_bytes_with(
    mesh: &Mesh,
    options: &Options,
    provenance: &str,
    progress: &mut dyn FnMut(Stage),
) -> Result<(Vec<u8>, BakeReport), BakeError> {
    let start = Instant::now();
    mesh.check()?;
    let merged;
    let objects = if options.split_objects || mesh.objects.len() == 1 {
        &mesh.objects
    } else {
        merged = mesh.clone().merged();
        &merged.objects
    };
    let triangles_in = mesh.objects.iter().map(|object| object.triangles.len() as u64).sum();
    let largest_id = mesh.objects.iter().flat_map(|object| &object.triangle_ids).max();
    let id_count = largest_id.map_or(0, |&id| u64::from(id) + 1);
    let mut baker = Baker::new(options, triangles_in, id_count);
    for object in objects.iter().filter(|object| !object.triangles.is_empty()) {
        baker.add(object, progress)?;
    }
    let mut report = baker.report;
    let bytes = assemble(baker.records, baker.sections, baker.duplicates, options, provenance, &mut report);
    progress(Stage::Prove);
    prove(&bytes, &mut report)?;
    report.seconds = start.elapsed().as_secs_f64();
    Ok((bytes, report))
}

fn prove(bytes: &[u8], report: &mut BakeReport) -> Result<(), BakeError> {
    let layout = validate_in_parallel(bytes).map_err(BakeError::Unproved)?;
    let inflation = prove_bounds(&layout, bytes).map_err(BakeError::Unproved)?;
    report.content_xxh3 = layout.content_checksum;
    report.width_inflation = inflation.mean_width();
    report.volume_inflation = inflation.mean_volume();
    Ok(())
}

/// Gathers the objects of a file.
struct Baker<'a> {
    options: &'a Options,
    /// One more than the largest triangle id.
    id_count: u64,
    sections: Sections,
    records: Vec<(String, ObjectRecord)>,
    duplicates: Vec<[u32; 2]>,
    children: u64,
    treelets: u64,
    report: BakeReport,
}

impl<'a> Baker<'a> {
    fn new(options: &'a Options, triangles_in: u64, id_count: u64) -> Self {
        let report = BakeReport {
            profile: Profile::Dop14U8,
            triangle_encoding: TriangleEncoding::F32,
            reason: String::new(),
            triangles_in,
            triangles: 0,
            degenerate: 0,
            duplicates: 0,
            vertices: 0,
            objects: 0,
            file_bytes: 0,
            node_bytes: 0,
            triangle_bytes: 0,
            id_bytes: 0,
            max_vertex_rounding: 0.0,
            max_quantization_error: 0.0,
            width_inflation: 1.0,
            volume_inflation: 1.0,
            mean_children: 0.0,
            content_xxh3: 0,
            seconds: 0.0,
        };
        Self {
            options,
            id_count,
            sections: Sections::default(),
            records: Vec::new(),
            duplicates: Vec::new(),
            children: 0,
            treelets: 0,
            report,
        }
    }

    fn add(&mut self, object: &mesh::Object, progress: &mut dyn FnMut(Stage)) -> Result<(), BakeError> {
        progress(Stage::Prepare);
        let quantized = self.options.triangles == Some(TriangleEncoding::Quantized);
        let grid_error = quantized.then(|| self.options.max_error.unwrap_or_else(|| 1e-5 * diagonal(object)));
        let prepared = prepare(object, grid_error.filter(|&error| error > 0.0));
        let choice = auto::choose(&prepared.triangles, self.options);
        progress(Stage::Build);
        let (profile, encoding) = (choice.profile, choice.encoding);
        let tree = build::build(&prepared.triangles, profile.width());
        let slabs = profile.directions().slabs();
        let cutter = Cutter { triangles: &prepared.triangles, width: profile.width(), slabs };
        let root = cutter.cut(tree);
        let (bounds, centre, radius) = box_and_sphere(&prepared.triangles);
        let arena = pages::flatten(root);
        progress(Stage::Encode);
        let plan = pages::plan(&arena, profile);
        let first_page = self.sections.nodes.len() / PAGE;
        if (first_page + plan.pages.len()) as u64 > MAX_PAGES {
            return Err(BakeError::Limit("2^26 pages".into()));
        }
        let f16_exponent = f16_exponent(&bounds);
        let encoder = Encoder {
            arena: &arena,
            plan: &plan,
            prepared: &prepared,
            profile,
            encoding,
            f16_scale: 2f32.powi(f16_exponent),
            ids: self.options.ids,
            first_page: first_page as u32,
        };
        let totals = encoder.encode(&mut self.sections);
        if totals.packets >= 1 << 30 {
            return Err(BakeError::Limit("2^30 leaf packets".into()));
        }
        let record = ObjectRecord {
            origin: prepared.origin.map(Into::into),
            box_lo: [0, 1, 2].map(|a| bounds.lo[a].into()),
            box_hi: [0, 1, 2].map(|a| bounds.hi[a].into()),
            triangles: (prepared.triangles.len() as u64).into(),
            packets: totals.packets.into(),
            treelets: totals.treelets.into(),
            first_page: (first_page as u32).into(),
            pages: (plan.pages.len() as u32).into(),
            max_vertex_rounding: prepared.max_rounding.into(),
            max_quantization_error: prepared.max_quantization.into(),
            input_triangles: self.id_count.into(),
            degenerate: prepared.degenerate.into(),
            duplicates: (prepared.duplicates.len() as u64).into(),
            f16_exponent: f16_exponent.into(),
            profile: profile.number(),
            triangle_encoding: encoding as u8,
            sphere_centre: centre.map(Into::into),
            sphere_radius: radius.into(),
            ..ObjectRecord::new_zeroed()
        };
        self.children += arena.treelets.iter().map(|t| t.children.len() as u64).sum::<u64>();
        self.account(prepared, record, choice, totals);
        Ok(())
    }

    fn account(&mut self, prepared: Prepared, record: ObjectRecord, choice: auto::Choice, totals: Totals) {
        let report = &mut self.report;
        if report.objects == 0 {
            report.profile = choice.profile;
            report.triangle_encoding = choice.encoding;
            report.reason = choice.reason;
        }
        report.objects += 1;
        report.triangles += prepared.triangles.len() as u64;
        report.degenerate += prepared.degenerate;
        report.duplicates += prepared.duplicates.len() as u64;
        report.vertices += prepared.vertices;
        report.max_vertex_rounding = report.max_vertex_rounding.max(prepared.max_rounding);
        report.max_quantization_error = report.max_quantization_error.max(prepared.max_quantization);
        self.treelets += totals.treelets;
        report.mean_children = self.children as f64 / self.treelets as f64;
        if self.options.ids {
            self.duplicates.extend(prepared.duplicates);
        }
        self.records.push((prepared.name, record));
    }
}

/// The diagonal of the box of the vertices in use, in mesh units.
fn diagonal(object: &mesh::Object) -> f64 {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &index in object.triangles.iter().flatten() {
        for axis in 0..3 {
            let value = object.positions[index as usize][axis];
            lo[axis] = lo[axis].min(value);
            hi[axis] = hi[axis].max(value);
        }
    }
    (0..3).map(|a| (hi[a] - lo[a]).powi(2)).sum::<f64>().sqrt()
}

/// The power of two that f16 residuals count, such that the object's largest slab stays below half
/// of f16's range.
fn f16_exponent(bounds: &bvh_format::kdop::Kdop) -> i32 {
    let widest = (0..3).map(|a| f64::from(bounds.hi[a]) - f64::from(bounds.lo[a])).sum::<f64>();
    if widest == 0.0 {
        return 0;
    }
    // The power of two at or above, from the bits: a logarithm may differ between platforms.
    let exponent = ((widest.to_bits() - 1) >> 52) as i32 - 1022;
    (exponent - 14).clamp(*F16_EXPONENTS.start(), *F16_EXPONENTS.end())
}

/// Lays the sections out page by page and writes the header.
fn assemble(
    records: Vec<(String, ObjectRecord)>,
    sections: Sections,
    mut duplicates: Vec<[u32; 2]>,
    options: &Options,
    provenance: &str,
    report: &mut BakeReport,
) -> Vec<u8> {
    duplicates.sort_unstable();
    let duplicates: Vec<u8> = duplicates.iter().flatten().flat_map(|id| id.to_le_bytes()).collect();
    report.node_bytes = sections.nodes.len() as u64;
    report.triangle_bytes = sections.leaves.len() as u64;
    report.id_bytes = (sections.ids.len() + duplicates.len()) as u64;
    let mut parts = vec![
        (SectionKind::Objects, write_objects(&records)),
        (SectionKind::Nodes, sections.nodes),
        (SectionKind::Leaves, sections.leaves),
    ];
    if options.ids {
        parts.push((SectionKind::Ids, sections.ids));
        if !duplicates.is_empty() {
            parts.push((SectionKind::Duplicates, duplicates));
        }
    }
    if !provenance.is_empty() {
        parts.push((SectionKind::Provenance, provenance.as_bytes().to_vec()));
    }
    let mut content = ContentHasher::default();
    let mut table = Vec::new();
    let mut length = PAGE;
    for (kind, data) in &parts {
        let add_to_content = || {
            if kind.is_content() {
                content.begin(*kind, data.len() as u64);
                content.update(data);
            }
        };
        let (sum, ()) = rayon::join(|| checksum(data), add_to_content);
        table.push(Section { kind: *kind, range: length..length + data.len(), checksum: sum });
        length = (length + data.len()).next_multiple_of(PAGE);
    }
    let mut bytes = Vec::with_capacity(length);
    bytes.extend(write_header(length as u64, content.finish(), &table));
    for (_, data) in parts {
        bytes.extend_from_slice(&data);
        bytes.resize(bytes.len().next_multiple_of(PAGE), 0);
    }
    report.file_bytes = bytes.len() as u64;
    bytes
}
