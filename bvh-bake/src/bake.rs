//! The way from a mesh to the bytes of a file, stage by stage.

use crate::arena::Arena;
use crate::assemble::{Contents, assemble};
use crate::auto;
use crate::build::Bricks;
use crate::encode::Encoder;
use crate::error::BakeError;
use crate::mesh::{self, Mesh};
use crate::options::Options;
use crate::pages;
use crate::prepare::{Corners, box_and_sphere, prepare};
use crate::prove::{prove_bounds, validate_in_parallel};
use crate::report::BakeReport;
use crate::summary::FileSummary;
use crate::treelets::{Child, ChildKind, Cutter, packet};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::{F16_EXPONENTS, ObjectRecord};
use bvh_format::page::MAX_PAGES;
use bvh_format::profile::Profile;
use std::ops::Range;
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
/// Cost: about 0.6 microseconds a triangle on two cores, and up to 300 bytes of memory a triangle.
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
    let largest_id = mesh.objects.iter().flat_map(|object| &object.triangle_ids).max();
    let id_count = largest_id.map_or(0, |&id| u64::from(id) + 1);
    let mut baker = Baker::new(options, id_count);
    for object in objects.iter().filter(|object| !object.triangles.is_empty()) {
        baker.add(object, progress)?;
    }
    let bytes = assemble(baker.contents, options.ids, provenance);
    progress(Stage::Prove);
    let layout = validate_in_parallel(&bytes).map_err(BakeError::Unproved)?;
    let inflation = prove_bounds(&layout, &bytes).map_err(BakeError::Unproved)?;
    let report = BakeReport {
        file: FileSummary::new(&layout, bytes.len() as u64),
        reason: baker.reason.unwrap_or_default(),
        vertices: baker.vertices,
        width_inflation: inflation.mean_width(),
        volume_inflation: inflation.mean_volume(),
        mean_children: baker.children as f64 / baker.treelets as f64,
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok((bytes, report))
}

/// Gathers the objects of a file.
struct Baker<'a> {
    options: &'a Options,
    /// One more than the largest triangle id.
    id_count: u64,
    contents: Contents,
    /// Why the first object is laid out as it is.
    reason: Option<String>,
    vertices: u64,
    children: u64,
    treelets: u64,
}

impl<'a> Baker<'a> {
    fn new(options: &'a Options, id_count: u64) -> Self {
        let contents = Contents::default();
        Self { options, id_count, contents, reason: None, vertices: 0, children: 0, treelets: 0 }
    }

    fn add(&mut self, object: &mesh::Object, progress: &mut dyn FnMut(Stage)) -> Result<(), BakeError> {
        progress(Stage::Prepare);
        let quantized = self.options.triangles == Some(TriangleEncoding::Quantized);
        let grid_error = quantized.then(|| self.options.max_error.unwrap_or_else(|| 1e-5 * diagonal(object)));
        let prepared = prepare(object, grid_error.filter(|&error| error > 0.0));
        let choice = auto::choose(&prepared.triangles, self.options);
        progress(Stage::Build);
        let (profile, encoding) = (choice.profile, choice.encoding);
        let (arena, bricks) = plant(&prepared.triangles, profile, self.options);
        let (bounds, centre, radius) = box_and_sphere(&prepared.triangles);
        progress(Stage::Encode);
        let plan = pages::plan(&arena, &bricks, profile, self.options.ablation.pages);
        let first_page = self.contents.ends.pages;
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
        let (mut pages, totals) = encoder.encode(&mut self.contents.ends);
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
        self.reason.get_or_insert(choice.reason);
        self.vertices += prepared.vertices;
        self.children += arena.treelets.iter().map(|t| t.children.len() as u64).sum::<u64>();
        self.treelets += totals.treelets;
        self.contents.pages.append(&mut pages);
        self.contents.duplicates.extend(prepared.duplicates);
        self.contents.records.push((prepared.name, record));
        Ok(())
    }
}

/// The treelets of an object, and those of each brick if there is more than one.
fn plant(triangles: &[Corners], profile: Profile, options: &Options) -> (Arena, Vec<Range<usize>>) {
    let (width, slabs) = (profile.width(), profile.directions().slabs());
    let cutter = Cutter { width, slabs, leaf: |leaf| packet(triangles, leaf) };
    let grow = |tree| {
        let root = cutter.cut(tree);
        (root.kdop(slabs), Arena::flatten(root))
    };
    let bricks = Bricks::divide(triangles, width, options.effort, options.ablation.splits);
    let (mut bricks, top) = bricks.build(triangles, grow);
    if bricks.len() == 1
        && let Some((_, arena)) = bricks.pop()
    {
        return (arena, Vec::new());
    }
    let brick = |brick: u32| Child { kdop: bricks[brick as usize].0, kind: ChildKind::Brick(brick) };
    let top = Arena::flatten(Cutter { width, slabs, leaf: brick }.cut(top));
    Arena::join(top, bricks.into_iter().map(|(_, arena)| arena).collect())
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
