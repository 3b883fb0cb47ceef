//! The way from a mesh to the bytes of a file, stage by stage.

use crate::assemble::{Contents, assemble};
use crate::auto;
use crate::brick::{Drafted, draft};
use crate::build::{Aabb, Bricks};
use crate::encode::Style;
use crate::error::BakeError;
use crate::means::Means;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::pages::order::arrange;
use crate::prepare::{Prepared, measure, survey};
use crate::progress::{Progress, Step};
use crate::prove::prove;
use crate::report::BakeReport;
use crate::sorter::Sorter;
use crate::soup::Kept;
use crate::summary::FileSummary;
use crate::target::Target;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::{F16_EXPONENTS, ObjectRecord};
use bvh_format::page::MAX_PAGES;
use std::borrow::Cow;
use std::time::Instant;
use zerocopy::FromZeros;

/// A stage of a bake, for those who show progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Origins, rounding, duplicates.
    Prepare,
    /// Bricks, their trees and the drafts of their pages.
    Build,
    /// Pages with their numbers, sections, checksums.
    Encode,
    /// The proof of the finished bytes.
    Prove,
}

impl Stage {
    /// The stage's name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prepare => "preparing",
            Self::Build => "building bricks",
            Self::Encode => "assembling",
            Self::Prove => "proving bounds",
        }
    }
}

/// Bakes a mesh into the bytes of a `.cbvh` file.
///
/// The bytes depend on the mesh and the options alone, not on the number of threads (rayon's current
/// pool is used). Every bake is proved: the bytes are validated and every bound checked.
///
/// Cost: about 0.6 microseconds a triangle on two cores, and up to 300 bytes of memory a triangle.
///
/// # Errors
/// `BakeError::Input` for a mesh that breaks the input contract (see `Mesh::check`), `Limit` for one
/// that outgrows the format, `Unproved` if the result fails its own checks.
pub fn to_bytes(mesh: &Mesh, options: &Options) -> Result<(Vec<u8>, BakeReport), BakeError> {
    to_bytes_with(mesh, options, "", &mut |_| ())
}

/// `to_bytes` with a provenance text (lines `key=value`, kept out of the content) and a callback at
/// the beginning of each stage.
///
/// # Errors
/// As `to_bytes`.
pub fn to_bytes_with(
    mesh: &Mesh,
    options: &Options,
    provenance: &str,
    begin: &mut dyn FnMut(Stage),
) -> Result<(Vec<u8>, BakeReport), BakeError> {
    let start = Instant::now();
    mesh.check()?;
    let means = Means::unlimited(&Progress::default());
    let mut target = Target::Memory(Vec::new());
    let mesh = if options.split_objects || mesh.objects.len() == 1 {
        Cow::Borrowed(mesh)
    } else {
        Cow::Owned(mesh.clone().merged())
    };
    let mut report = of_objects(mesh, options, provenance, &means, &mut target, begin)?;
    report.seconds = start.elapsed().as_secs_f64();
    let Target::Memory(bytes) = target else { return Ok((Vec::new(), report)) };
    Ok((bytes, report))
}

/// Bakes each object of a mesh that has been checked.
pub(crate) fn of_objects(
    mesh: Cow<Mesh>,
    options: &Options,
    provenance: &str,
    means: &Means,
    target: &mut Target,
    begin: &mut dyn FnMut(Stage),
) -> Result<BakeReport, BakeError> {
    means.progress.expect(mesh.triangle_count());
    let largest_id = mesh.objects.iter().flat_map(|object| &object.triangle_ids).max();
    let id_count = largest_id.map_or(0, |&id| u64::from(id) + 1);
    let mut baker = Baker::new(options, id_count, means);
    for number in (0..mesh.objects.len()).filter(|&number| !mesh.objects[number].triangles.is_empty()) {
        begin(Stage::Prepare);
        let object = &mesh.objects[number];
        let prepared = Prepared::of_object(object, |diagonal| grid_error(options, diagonal), means)?;
        baker.add(prepared, begin)?;
    }
    drop(mesh);
    baker.finish(provenance, target, begin)
}

/// The largest move that quantisation may make in an object of this diagonal, `None` for none.
pub(crate) fn grid_error(options: &Options, diagonal: f64) -> Option<f64> {
    let quantized = options.triangles == Some(TriangleEncoding::Quantized);
    quantized.then(|| options.max_error.unwrap_or(1e-5 * diagonal)).filter(|&error| error > 0.0)
}

/// Gathers the objects of a file.
pub(crate) struct Baker<'a> {
    options: &'a Options,
    means: &'a Means,
    /// One more than the largest triangle id.
    id_count: u64,
    contents: Contents,
    /// Why the first object is laid out as it is.
    reason: Option<String>,
    vertices: u64,
    children: u64,
    treelets: u64,
    /// Triangles of the objects so far, and those of them that are stored.
    triangles: u64,
    kept: u64,
}

impl<'a> Baker<'a> {
    pub(crate) fn new(options: &'a Options, id_count: u64, means: &'a Means) -> Self {
        let contents = Contents {
            records: Vec::new(),
            drafts: Vec::new(),
            duplicates: Sorter::of_runs(means.sorted_at_once::<[u32; 2]>(id_count)),
            spill: means.scratch.spill(),
        };
        Self {
            options,
            means,
            id_count,
            contents,
            reason: None,
            vertices: 0,
            children: 0,
            treelets: 0,
            triangles: 0,
            kept: 0,
        }
    }

    /// Bakes an object up to its pages.
    pub(crate) fn add(&mut self, prepared: Prepared, begin: &mut dyn FnMut(Stage)) -> Result<(), BakeError> {
        let Self { options, means, .. } = *self;
        let Prepared { name, origin, soup, moved, vertices } = prepared;
        let Contents { duplicates, spill, .. } = &mut self.contents;
        let before = duplicates.count();
        let measured = measure(&soup, means, |pair| duplicates.extend(&[pair], spill))?;
        let left_out = duplicates.count() - before;
        let moved = moved.joined(measured.moved).rounded_up();
        let kept = Kept::new(&soup, &measured.dropped);
        let trials = auto::trials(kept.count(), options);
        let mut surveyed = survey(&kept, &measured, &trials, means)?;
        let choice = auto::choose(kept.count(), &trials, &surveyed.patches, options);
        self.triangles += soup.count;
        means.progress.leave_out(left_out);
        means.progress.reach(Step::Bake(Stage::Prepare), self.triangles);
        begin(Stage::Build);
        let f16_exponent = f16_exponent(&measured.bounds);
        let style = Style {
            profile: choice.profile,
            encoding: choice.encoding,
            f16_scale: 2f32.powi(f16_exponent),
            ids: options.ids,
        };
        let (width, splits) = (choice.profile.width(), options.ablation.splits);
        let bricks = Bricks::divide(&kept, surveyed.grid.take(), width, options.effort, splits, means)?;
        let triangles = kept.count();
        drop(soup);
        let Drafted { mut drafts, children } = draft(bricks, style, means)?;
        self.kept += triangles;
        means.progress.reach(Step::Bake(Stage::Build), self.kept);
        if options.ablation.pages != Default::default() {
            drafts.order = Some(arrange(&drafts.links()?, options.ablation.pages));
        }
        let (first_page, pages) = (self.contents.page_count(), drafts.page_count());
        if (first_page + pages) as u64 > MAX_PAGES {
            return Err(BakeError::Limit("2^26 pages".into()));
        }
        let packets: u64 = drafts.drafts.iter().map(|draft| draft.packets).sum();
        let treelets: u64 = drafts.drafts.iter().map(|draft| draft.treelets).sum();
        if packets >= 1 << 30 {
            return Err(BakeError::Limit("2^30 leaf packets".into()));
        }
        let record = ObjectRecord {
            origin: origin.map(Into::into),
            box_lo: [0, 1, 2].map(|a| measured.bounds.lo(a).into()),
            box_hi: [0, 1, 2].map(|a| measured.bounds.hi(a).into()),
            triangles: triangles.into(),
            packets: packets.into(),
            treelets: treelets.into(),
            first_page: (first_page as u32).into(),
            pages: (pages as u32).into(),
            max_vertex_rounding: moved.rounding.into(),
            max_quantization_error: moved.quantization.into(),
            input_triangles: self.id_count.into(),
            degenerate: surveyed.degenerate.into(),
            duplicates: left_out.into(),
            f16_exponent: f16_exponent.into(),
            profile: choice.profile.number(),
            triangle_encoding: choice.encoding as u8,
            sphere_centre: surveyed.centre.map(Into::into),
            sphere_radius: surveyed.radius.into(),
            ..ObjectRecord::new_zeroed()
        };
        self.reason.get_or_insert(choice.reason);
        self.vertices += vertices;
        self.children += children;
        self.treelets += treelets;
        self.contents.drafts.push(drafts);
        self.contents.records.push((name, record));
        Ok(())
    }

    /// Writes the file and proves it.
    pub(crate) fn finish(
        self,
        provenance: &str,
        target: &mut Target,
        begin: &mut dyn FnMut(Stage),
    ) -> Result<BakeReport, BakeError> {
        let progress = &self.means.progress;
        begin(Stage::Encode);
        assemble(self.contents, self.options.ids, provenance, target, progress)?;
        progress.reach(Step::Bake(Stage::Encode), self.kept);
        begin(Stage::Prove);
        let (layout, inflation) = prove(&target.source(), progress)?;
        progress.reach(Step::Bake(Stage::Prove), self.kept);
        Ok(BakeReport {
            file: FileSummary::new(&layout, target.length()),
            reason: self.reason.unwrap_or_default(),
            vertices: self.vertices,
            width_inflation: inflation.mean_width(),
            volume_inflation: inflation.mean_volume(),
            mean_children: self.children as f64 / self.treelets as f64,
            traffic: progress.traffic(),
            seconds: 0.0,
        })
    }
}

/// The power of two that f16 residuals count, such that the object's largest slab stays below half
/// of f16's range.
fn f16_exponent(bounds: &Aabb) -> i32 {
    let widest = (0..3).map(|a| f64::from(bounds.hi(a)) - f64::from(bounds.lo(a))).sum::<f64>();
    if widest == 0.0 {
        return 0;
    }
    // The power of two at or above, from the bits: a logarithm may differ between platforms.
    let exponent = ((widest.to_bits() - 1) >> 52) as i32 - 1022;
    (exponent - 14).clamp(*F16_EXPONENTS.start(), *F16_EXPONENTS.end())
}
