//! Bakes a mesh into the bytes of a file, stage by stage.

pub(crate) mod files;
pub(crate) mod provenance;
pub(crate) mod report;

use crate::check::prove::prove;
use crate::error::{BakeError, LimitError, excerpt};
use crate::input::gather::Gatherer;
use crate::input::mesh::{Instance, Mesh};
use crate::options::{Effort, Options};
use crate::pages::Style;
use crate::pages::assemble::{Contents, assemble};
use crate::pages::brick::{EncodedObject, encode_object};
use crate::prepare::duplicates::Found;
use crate::prepare::layout_choice::{self, Choice};
use crate::prepare::quantization::{advised_error, grid_error};
use crate::prepare::{measure, survey};
use crate::progress::{Progress, Stage, Step};
use crate::storage::external_sort::Sorter;
use crate::storage::output::Output;
use crate::storage::resources::Resources;
use crate::topology::{MAX_FEW_PARTS, Nets, Survey, TopologyLists};
use crate::tree::{Aabb, Bricks};
use crate::triangles::{Gathered, Kept};
use bvh_format::object::{F16_EXPONENTS, MAX_RADIUS, ObjectRecord};
use bvh_format::page::MAX_PAGES;
use report::{BakeReport, FileSummary};
use std::path::Path;
use std::time::Instant;
use zerocopy::FromZeros;

/// Bakes a mesh into the bytes of a `.cbvh` file.
///
/// The bytes depend only on the mesh and the options, and not on the number of threads, which are those of rayon's
/// current pool. Every bake is proved: the bytes are validated and every bound is checked.
///
/// Cost: about 0.6 microseconds per triangle on two cores, and up to 300 bytes of memory per triangle.
///
/// # Errors
/// `BakeError::Input` for a mesh that breaks the input contract (see `Mesh::check`), `Limit` for a mesh that exceeds a
/// limit of the format, `MaxError` for an `Options::max_error` above a hundredth of the diagonal of an object's box,
/// and `Unproved` if the result fails its own checks.
pub fn to_bytes(mesh: &Mesh, options: &Options) -> Result<(Vec<u8>, BakeReport), BakeError> {
    to_bytes_with(mesh, options, "", &mut |_| ())
}

/// Bakes like `to_bytes`, with a provenance text (lines `key=value`, which are not part of the content) and a callback
/// at the beginning of each stage.
///
/// # Errors
/// The errors of `to_bytes`.
pub fn to_bytes_with(
    mesh: &Mesh,
    options: &Options,
    provenance: &str,
    begin: &mut dyn FnMut(Stage),
) -> Result<(Vec<u8>, BakeReport), BakeError> {
    // The standard library has no clock in a web page; asking for the time would panic.
    let has_clock = !cfg!(all(target_family = "wasm", target_os = "unknown"));
    let start = has_clock.then(Instant::now);
    mesh.check()?;
    let resources = Resources::unlimited(&Progress::default());
    let split = options.split_objects || !mesh.instances.is_empty();
    let mut gatherer = Gatherer::new(&resources, split);
    // A mesh in memory has no file name.
    gatherer.add_mesh(mesh).map_err(|halt| halt.in_file(Path::new("")))?;
    let mut output = Output::Memory(Vec::new());
    let mut report = bake(gatherer, options, provenance, &mut output, begin)?;
    report.seconds = start.map_or(0.0, |start| start.elapsed().as_secs_f64());
    let Output::Memory(bytes) = output else { unreachable!("a bake does not move its output") };
    Ok((bytes, report))
}

/// Bakes the objects that have been gathered.
fn bake(
    mut gatherer: Gatherer,
    options: &Options,
    provenance: &str,
    output: &mut Output,
    begin: &mut dyn FnMut(Stage),
) -> Result<BakeReport, BakeError> {
    let resources = gatherer.resources();
    let (triangles, id_end) = (gatherer.triangles(), gatherer.id_end());
    let instances = gatherer.take_instances();
    if !(0.0..=MAX_RADIUS).contains(&options.radius) {
        return Err(BakeError::Radius(options.radius));
    }
    let gathered = gatherer.finish(|name, diagonal| grid_error(options, name, diagonal))?;
    resources.progress.expect(triangles);
    let mut baker = Baker::new(options, instances, id_end, resources);
    for object in gathered {
        begin(Stage::Prepare);
        baker.add(object, begin)?;
    }
    baker.finish(provenance, output, begin)
}

/// Bakes one object after another.
struct Baker<'a> {
    options: &'a Options,
    resources: &'a Resources,
    /// Whether the file states which objects are closed.
    has_topology: bool,
    /// One more than the largest triangle id.
    id_count: u64,
    contents: Contents,
    /// The reason for the layout of the first object.
    reason: Option<String>,
    /// The smallest advised error of the objects whose allowed error is coarse.
    advised_max_error: Option<f64>,
    vertices: u64,
    children: u64,
    treelets: u64,
    /// The number of triangles of the objects so far, and the number of those that are stored.
    triangles: u64,
    kept: u64,
}

impl<'a> Baker<'a> {
    fn new(options: &'a Options, instances: Vec<Instance>, id_count: u64, resources: &'a Resources) -> Self {
        let has_solids = options.solid || instances.iter().any(|instance| instance.solid);
        let contents = Contents {
            records: Vec::new(),
            objects: Vec::new(),
            instances,
            topology: TopologyLists::new(),
            duplicates: Sorter::of_runs(resources.sorted_at_once::<[u32; 2]>(id_count)),
            spill: resources.scratch.spill(),
        };
        Self {
            options,
            resources,
            has_topology: options.topology || has_solids,
            id_count,
            contents,
            reason: None,
            advised_max_error: None,
            vertices: 0,
            children: 0,
            treelets: 0,
            triangles: 0,
            kept: 0,
        }
    }

    /// Bakes an object up to its pages.
    fn add(&mut self, prepared: Gathered, begin: &mut dyn FnMut(Stage)) -> Result<(), BakeError> {
        let Self { options, resources, has_topology, .. } = *self;
        let Gathered { name, origin, stream, moved, vertices, is_cloud } = prepared;
        let Contents { duplicates, spill, topology, .. } = &mut self.contents;
        let before = duplicates.count();
        // The edges of points do not count.
        let is_counted = has_topology && !(is_cloud && stream.count > MAX_FEW_PARTS);
        let mut nets = is_counted.then(|| Nets::new(resources));
        let measured = measure(&stream, is_cloud, resources, |found| match (found, &mut nets) {
            (Found::Pair(pair), _) => duplicates.extend(&[pair], spill),
            (Found::Net { id, net, corners }, Some(nets)) => nets.add(id, net, corners, spill),
            (Found::Net { .. }, None) => Ok(()),
        })?;
        let left_out = duplicates.count() - before;
        let moved = moved.joined(measured.moved).rounded_up();
        let advised = advised_error(options, diagonal(&measured.bounds), stream.count);
        self.advised_max_error = self.advised_max_error.into_iter().chain(advised).reduce(f64::min);
        let kept = Kept::new(&stream, &measured.dropped);
        let mut surveyed = survey(&kept, &measured, resources)?;
        self.triangles += stream.count;
        resources.progress.leave_out(left_out);
        resources.progress.reach(Step::Bake(Stage::Prepare), self.triangles);
        begin(Stage::Build);
        let f16_exponent = f16_exponent(&measured.bounds);
        let (grid, width) = (surveyed.grid.take(), layout_choice::width(options));
        // Points have no extent, so that finer splits make no better tree of them.
        let effort = if is_cloud { Effort::Fast } else { options.effort };
        let mut bricks = Bricks::divide(&kept, &measured.bounds, grid, width, effort, resources)?;
        let triangles = kept.count();
        drop(stream);
        let survey = nets.map(|nets| Survey::new(nets, bricks.boxes(), triangles));
        let (tree, of_brick) = bricks.first_tree(resources)?;
        let Choice { profile, encoding, reason } =
            layout_choice::choose(triangles, tree, of_brick, is_cloud, options);
        let style = Style {
            profile,
            encoding,
            f16_scale: 2f32.powi(f16_exponent),
            ids: options.ids,
            is_cloud,
            turning_slabs: options.turning_slabs && profile.has_turning_slabs() && !is_cloud,
        };
        if has_topology && survey.is_none() {
            topology.add_cloud();
        }
        let encoded = encode_object(bricks, style, survey, topology, resources)?;
        if options.solid && !topology.is_closed(topology.records.len() - 1) {
            return Err(BakeError::NotClosed { object: excerpt(name.as_bytes()) });
        }
        let EncodedObject { pages, packets, treelets, children } = encoded;
        self.kept += triangles;
        resources.progress.reach(Step::Bake(Stage::Build), self.kept);
        let (first_page, page_count) = (self.contents.page_count(), pages.page_count());
        if (first_page + page_count) as u64 > MAX_PAGES {
            return Err(LimitError::Pages.into());
        }
        if packets >= 1 << 30 {
            return Err(LimitError::Packets.into());
        }
        let record = ObjectRecord {
            origin: origin.map(Into::into),
            box_lo: [0, 1, 2].map(|a| measured.bounds.lo(a).into()),
            box_hi: [0, 1, 2].map(|a| measured.bounds.hi(a).into()),
            triangles: triangles.into(),
            packets: packets.into(),
            treelets: treelets.into(),
            first_page: (first_page as u32).into(),
            pages: (page_count as u32).into(),
            max_vertex_rounding: moved.rounding.into(),
            max_quantization_error: moved.quantization.into(),
            input_triangles: self.id_count.into(),
            degenerate: surveyed.degenerate.into(),
            duplicates: left_out.into(),
            f16_exponent: f16_exponent.into(),
            profile: style.profile.number(),
            triangle_encoding: style.encoding as u8,
            sphere_centre: surveyed.centre.map(Into::into),
            sphere_radius: surveyed.radius.into(),
            // -0.0 + 0.0 is 0.0.
            radius: (options.radius + 0.0).into(),
            solid: options.solid.into(),
            ..ObjectRecord::new_zeroed()
        };
        self.reason.get_or_insert(reason);
        self.vertices += vertices;
        self.children += children;
        self.treelets += treelets;
        self.contents.objects.push(pages);
        self.contents.records.push((name, record));
        Ok(())
    }

    /// Writes the file and proves it.
    fn finish(
        self,
        provenance: &str,
        target: &mut Output,
        begin: &mut dyn FnMut(Stage),
    ) -> Result<BakeReport, BakeError> {
        let progress = &self.resources.progress;
        let Contents { instances, topology, records, .. } = &self.contents;
        let mut solids =
            instances.iter().filter(|instance| instance.solid).map(|instance| instance.object as usize);
        if let Some(open) = solids.find(|&object| !topology.is_closed(object)) {
            return Err(BakeError::NotClosed { object: excerpt(records[open].0.as_bytes()) });
        }
        begin(Stage::Encode);
        let instances = self.contents.instances.len() as u64;
        assemble(self.contents, self.options.ids, provenance, target, progress)?;
        progress.reach(Step::Bake(Stage::Encode), self.kept);
        begin(Stage::Prove);
        let (layout, inflation) = prove(&target.source(), progress)?;
        let topology = layout.read_topology(&target.source())?;
        progress.reach(Step::Bake(Stage::Prove), self.kept);
        Ok(BakeReport {
            file: FileSummary::new(&layout, target.length(), instances, &topology),
            reason: self.reason.unwrap_or_default(),
            advised_max_error: self.advised_max_error,
            vertices: self.vertices,
            width_inflation: inflation.mean_width(),
            volume_inflation: inflation.mean_volume(),
            mean_children: self.children as f64 / self.treelets as f64,
            traffic: progress.traffic(),
            seconds: 0.0,
        })
    }
}

/// Returns the diagonal of a box, in mesh units.
fn diagonal(bounds: &Aabb) -> f64 {
    (0..3).map(|a| (f64::from(bounds.hi(a)) - f64::from(bounds.lo(a))).powi(2)).sum::<f64>().sqrt()
}

/// Returns the power of two that is the unit of f16 residuals. The largest slab of the object stays below half of f16's
/// range.
fn f16_exponent(bounds: &Aabb) -> i32 {
    let widest = (0..3).map(|a| f64::from(bounds.hi(a)) - f64::from(bounds.lo(a))).sum::<f64>();
    if widest == 0.0 {
        return 0;
    }
    // The next power of two is taken from the bits, because a logarithm may differ between platforms.
    let exponent = ((widest.to_bits() - 1) >> 52) as i32 - 1022;
    (exponent - 14).clamp(*F16_EXPONENTS.start(), *F16_EXPONENTS.end())
}
