//! Bakes a mesh into the bytes of a file, stage by stage.

pub(crate) mod files;
mod object;
pub(crate) mod provenance;
pub(crate) mod report;

use crate::check::open_edges::{count_all, count_object};
use crate::check::prove::prove;
use crate::check::provenance::value_of;
use crate::error::{BakeError, LimitError, excerpt};
use crate::input::gather::Gatherer;
use crate::input::gather::weld::check_length;
use crate::input::mesh::{Instance, Mesh};
use crate::options::{Effort, Options, Rounding};
use crate::pages::assemble::{Contents, assemble};
use crate::pages::brick::EncodedObject;
use crate::pages::unnumbered::ObjectPages;
use crate::prepare::quantization::grid_error;
use crate::progress::{Progress, Stage, Step};
use crate::storage::external_sort::Sorter;
use crate::storage::output::Output;
use crate::storage::resources::Resources;
use crate::threads;
use crate::topology::TopologyLists;
use crate::triangles::Gathered;
use bvh_format::Layout;
use bvh_format::object::{MAX_RADIUS, ObjectRecord};
use bvh_format::open_edges::OpenEdges;
use bvh_format::page::MAX_PAGES;
use object::{Built, Prepared, Shared, next_batch};
use report::{BakeReport, FileSummary};
use std::borrow::Cow;
use std::path::Path;
use std::time::Instant;

/// Bakes a mesh into the bytes of a `.cbvh` file.
///
/// The bytes depend only on the mesh and the options, and not on the number of threads, which are those of rayon's
/// current pool. Every bake is proved: the bytes are validated and every bound is checked.
///
/// Cost: about 0.6 microseconds per triangle on two cores, and up to 300 bytes of memory per triangle.
///
/// # Errors
/// `BakeError::Input` for a mesh that breaks the input contract (see `Mesh::check`), `Limit` for a mesh that exceeds a
/// limit of the format, `MaxError` for an `Options::max_error` above a hundredth of the diagonal of an object's box, `Weld` for an
/// `Options::weld` that is no finite length or exceeds that diagonal, `Stopped` if `Options::stop` was set, and `Unproved` if the result
/// fails its own checks.
pub fn to_bytes(mesh: &Mesh, options: &Options) -> Result<(Vec<u8>, BakeReport), BakeError> {
    let count: usize = mesh.objects.iter().map(|object| object.triangles.len()).sum();
    let pays = count as u64 <= threads::MAX_ALONE_TRIANGLES;
    threads::alone_if(pays, || threads::enter(|| to_bytes_with(mesh, options, "", &mut |_| ())))
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
    let progress = Progress::default().stopped_by(options.stop.clone());
    progress.go_on()?;
    mesh.check()?;
    let resources = Resources::unlimited(&progress);
    let split = options.split_objects || !mesh.instances.is_empty();
    let mut gatherer = Gatherer::new(&resources, split).rounding(options.round).of_one_mesh();
    // A mesh in memory has no file name.
    gatherer.add_mesh(mesh).map_err(|halt| halt.in_file(Path::new("")))?;
    let mut output = Output::in_memory(&progress);
    let mut report = bake(gatherer, options, provenance, &mut output, begin)?;
    report.seconds = start.map_or(0.0, |start| start.elapsed().as_secs_f64());
    let Output::Memory { bytes, .. } = output else { unreachable!("a bake does not move its output") };
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
    let id_end = gatherer.id_end();
    let (instances, warnings) = (gatherer.take_instances(), gatherer.take_warnings());
    check_numbers(options)?;
    let provenance = &stating_moves(provenance, options);
    let gathered = gatherer.finish(options.weld, |name, diagonal| grid_error(options, name, diagonal))?;
    resources.progress.end_reading();
    let count: u64 = gathered.iter().map(|object| object.stream.count).sum();
    threads::alone_if(count <= threads::MAX_ALONE_TRIANGLES, || {
        let mut baker = Baker::new(options, instances, id_end, resources);
        let mut gathered = gathered.into_iter().peekable();
        while gathered.peek().is_some() {
            baker.add(next_batch(&mut gathered), begin)?;
        }
        Ok(BakeReport { warnings, ..baker.finish(provenance, output, begin)? })
    })
}

/// Checks the numbers of options that do not depend on the mesh.
///
/// # Errors
/// [`BakeError::Radius`] and [`BakeError::Weld`].
fn check_numbers(options: &Options) -> Result<(), BakeError> {
    if !(0.0..=MAX_RADIUS).contains(&options.radius) {
        return Err(BakeError::Radius(options.radius));
    }
    check_length(options.weld)
}

/// Returns a provenance text with lines that state the distance of a weld and how coordinates are rounded before it, without which
/// nobody can compare the file with the mesh.
fn stating_moves<'a>(provenance: &'a str, options: &Options) -> Cow<'a, str> {
    let mut text = Cow::Borrowed(provenance);
    let mut state = |key: &str, value: String| {
        if value_of(&text, key).is_none() {
            let end = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
            text = Cow::Owned(format!("{text}{end}{key}={value}\n"));
        }
    };
    if options.weld == 0.0 {
        return text;
    }
    if options.round != Rounding::None {
        state("round", options.round.name().to_owned());
    }
    state("weld", format!("{:?}", options.weld));
    text
}

/// Collects the objects that are baked.
struct Baker<'a> {
    shared: Shared<'a>,
    /// The pairs (kept id, id of an equal triangle that is left out) of all objects.
    duplicates: Sorter<[u32; 2]>,
    instances: Vec<Instance>,
    records: Vec<(String, ObjectRecord)>,
    objects: Vec<ObjectPages>,
    topology: TopologyLists,
    /// The number of pages of all objects so far.
    pages: usize,
    /// The reason for the layout of the first object.
    reason: Option<String>,
    /// The smallest advised error of the objects whose allowed error is coarse.
    advised_max_error: Option<f64>,
    children: u64,
    treelets: u64,
}

impl<'a> Baker<'a> {
    fn new(options: &'a Options, instances: Vec<Instance>, id_count: u64, resources: &'a Resources) -> Self {
        let has_solids = options.solid || instances.iter().any(|instance| instance.solid);
        let shared = Shared {
            options,
            resources,
            has_topology: options.topology || has_solids,
            id_count,
            spill: resources.scratch.spill(),
        };
        Self {
            shared,
            duplicates: Sorter::of_runs(resources.sorted_at_once::<[u32; 2]>(id_count)),
            instances,
            records: Vec::new(),
            objects: Vec::new(),
            topology: TopologyLists::new(),
            pages: 0,
            reason: None,
            advised_max_error: None,
            children: 0,
            treelets: 0,
        }
    }

    /// Bakes objects up to their pages. Of several failures, that of the first object is returned.
    fn add(&mut self, batch: Vec<Gathered>, begin: &mut dyn FnMut(Stage)) -> Result<(), BakeError> {
        let (shared, progress) = (&self.shared, &self.shared.resources.progress);
        begin(Stage::Prepare);
        let prepared = threads::map(batch, |object| Prepared::new(object, shared));
        let mut prepared: Vec<Prepared> = prepared.into_iter().collect::<Result<_, _>>()?;
        for object in &mut prepared {
            if let Some(duplicates) = object.duplicates.take() {
                self.duplicates.append(duplicates, &shared.spill)?;
            }
            self.advised_max_error =
                self.advised_max_error.into_iter().chain(object.advised_error).reduce(f64::min);
            progress.leave_out(object.left_out);
        }
        begin(Stage::Build);
        let built = threads::map(prepared, |object| Built::new(object, shared));
        built.into_iter().try_for_each(|object| self.push(object?))
    }

    /// Adds an object after all others.
    fn push(&mut self, object: Built) -> Result<(), BakeError> {
        let Built { name, mut record, encoded, reason } = object;
        let EncodedObject { pages, packets, treelets, children, topology } = encoded;
        let page_count = pages.page_count();
        if (self.pages + page_count) as u64 > MAX_PAGES {
            return Err(LimitError::Pages.into());
        }
        if packets >= 1 << 30 {
            return Err(LimitError::Packets.into());
        }
        (record.first_page, record.pages) = ((self.pages as u32).into(), (page_count as u32).into());
        match topology {
            Some(topology) => self.topology.add(topology, &self.shared.spill)?,
            None if self.shared.has_topology => self.topology.add_cloud(),
            None => {}
        }
        self.reason.get_or_insert(reason);
        self.pages += page_count;
        self.children += children;
        self.treelets += treelets;
        self.objects.push(pages);
        self.records.push((name, record));
        Ok(())
    }

    /// Writes the file and proves it.
    fn finish(
        self,
        provenance: &str,
        target: &mut Output,
        begin: &mut dyn FnMut(Stage),
    ) -> Result<BakeReport, BakeError> {
        let Shared { options, resources, spill, .. } = self.shared;
        let (instances, topology, records, objects, duplicates) =
            (self.instances, self.topology, self.records, self.objects, self.duplicates);
        let progress = &resources.progress;
        let solids =
            instances.iter().filter(|instance| instance.solid).map(|instance| instance.object as usize);
        let all = if options.solid { 0..records.len() } else { 0..0 };
        let open_solid = all.chain(solids).find(|&object| !topology.is_closed(object));
        let open_solid = open_solid.map(|object| (object, excerpt(records[object].0.as_bytes())));
        let is_open = topology.records.iter().any(|record| record.closed == 0);
        begin(Stage::Encode);
        let instance_count = instances.len() as u64;
        let contents = Contents { records, objects, instances, duplicates, topology, spill };
        assemble(contents, options.ids, provenance, target)?;
        progress.end(Step::Bake(Stage::Encode));
        // Open edges are counted in the finished bytes, with the memory that bricks no longer take.
        let counting = (resources.scratch.spill(), resources.brick_bytes as u64);
        if let Some((number, object)) = open_solid {
            let layout = Layout::read_from(&target.source())?;
            let edges = count_object(&layout, &target.source(), number, &counting.0, counting.1)?;
            return Err(BakeError::NotClosed { object, edges: Box::new(edges) });
        }
        begin(Stage::Prove);
        let (layout, inflation) = prove(&target.source(), progress)?;
        let topology = layout.read_topology(&target.source())?;
        // A web page does not read the report, and asks the library instead. Nor does a bake of little time count.
        let is_counted =
            options.effort != Effort::Quick && !cfg!(all(target_family = "wasm", target_os = "unknown"));
        let open_edges = match is_open {
            true if !is_counted => None,
            true => Some(count_all::<_, BakeError>(&layout, &target.source(), &counting.0, counting.1)?),
            false => layout.has_topology().then(OpenEdges::default),
        };
        progress.end(Step::Bake(Stage::Prove));
        Ok(BakeReport {
            file: FileSummary::new(&layout, target.length(), instance_count, &topology),
            open_edges,
            reason: self.reason.unwrap_or_default(),
            advised_max_error: self.advised_max_error,
            warnings: Vec::new(),
            width_inflation: inflation.mean_width(),
            volume_inflation: inflation.mean_volume(),
            mean_children: self.children as f64 / self.treelets as f64,
            traffic: progress.traffic(),
            seconds: 0.0,
        })
    }
}
