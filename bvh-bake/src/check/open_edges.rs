//! Counts the open edges of a file, on all threads and in limited memory: see [`bvh_format::open_edges`].

use crate::check::verify::{VerifyError, VerifyOptions};
use crate::error::BakeError;
use crate::progress::Progress;
use crate::storage::external_sort::Sorter;
use crate::storage::{Scratch, Spill};
use crate::threads;
use bvh_format::Layout;
use bvh_format::leaf::PACKET;
use bvh_format::object::Object;
use bvh_format::open_edges::{Classifier, OpenEdges, Sums, Traversal, count, edges_of_page, uncancelled};
use bvh_format::source::Source;
use bvh_format::topology::ObjectTopology;

/// The memory for counting whose caller sets no limit.
const USUAL_BYTES: u64 = 512 << 20;
/// The least and the most bytes of a sorted run, of which there are two at a time, besides blocks of the others and what scratch keeps.
const RUN_BYTES: [u64; 2] = [1 << 16, 32 << 20];
/// Bytes of memory per open edge in the set of all of them.
const BYTES_PER_OPEN_EDGE: u64 = 128;

/// Counts the open edges of all objects of a validated file, and lists the first ones. A file that does not state which objects are
/// closed has no nets; equal triangles that were left out then do not count.
///
/// Cost: reading each open object twice. With little memory and many open edges, up to 200 bytes of scratch files per
/// triangle. Closed objects are not read.
///
/// # Errors
/// [`VerifyError::Input`] if scratch files cannot be written, and the errors of the source.
pub fn open_edges<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    options: &VerifyOptions,
) -> Result<OpenEdges, VerifyError>
where
    VerifyError: From<S::Error>,
{
    let budget = options.max_memory.unwrap_or(USUAL_BYTES);
    let usual = || if cfg!(target_family = "wasm") { ".".into() } else { std::env::temp_dir() };
    let directory = options.scratch.clone().unwrap_or_else(usual);
    let scratch = Scratch::in_directory(&directory, budget / 32, &Progress::default());
    count_all(layout, source, &scratch.spill(), budget)
}

/// Counts the open edges of all objects of a validated file in about `budget` bytes.
pub(crate) fn count_all<S: Source + ?Sized, E: From<S::Error> + From<BakeError> + Send>(
    layout: &Layout,
    source: &S,
    spill: &Spill,
    budget: u64,
) -> Result<OpenEdges, E> {
    let topology = layout.read_topology(source)?;
    let mut all = OpenEdges::default();
    for (number, object) in (0..).zip(&layout.objects) {
        let of_object = topology.get(number as usize);
        if of_object.is_none_or(|of_object| !of_object.closed) {
            all.join(
                Counter { layout, source, object, topology: of_object, spill, budget }.count::<E>(number)?,
            );
        }
    }
    Ok(all)
}

/// Counts the open edges of the object with this number.
pub(crate) fn count_object<S: Source<Error = BakeError> + ?Sized>(
    layout: &Layout,
    source: &S,
    number: usize,
    spill: &Spill,
    budget: u64,
) -> Result<OpenEdges, BakeError> {
    let topology = layout.read_topology(source)?;
    let (object, topology) = (&layout.objects[number], topology.get(number));
    Counter { layout, source, object, topology, spill, budget }.count(number as u32)
}

/// Counts the open edges of an object.
struct Counter<'a, S: ?Sized> {
    layout: &'a Layout,
    source: &'a S,
    object: &'a Object,
    topology: Option<&'a ObjectTopology>,
    spill: &'a Spill,
    budget: u64,
}

impl<S: Source + ?Sized> Counter<'_, S> {
    fn count<E: From<S::Error> + From<BakeError> + Send>(&self, number: u32) -> Result<OpenEdges, E> {
        // A web page has no scratch files, and needs none of the code that uses them.
        if cfg!(all(target_family = "wasm", target_os = "unknown")) {
            let mut failed = None;
            let mut edges_of = |page| self.edges(page).map_err(|error| failed = Some(error)).ok();
            let edges = count(number, self.object.pages(), usize::MAX, &mut edges_of);
            return failed.map_or_else(|| Ok(edges.unwrap_or_default()), |error| Err(error.into()));
        }
        let [least, most] = RUN_BYTES;
        let run = (self.budget / 64).clamp(least, most) as usize / size_of::<Traversal>();
        let most = (self.budget / 4 / BYTES_PER_OPEN_EDGE) as usize;
        let mut left = Sorter::of_runs(run);
        self.each_page::<E>(&mut left, uncancelled)?;
        let mut sums = Sums::default();
        left.visit(|edge| {
            sums.add(edge, most);
            Ok(())
        })?;
        let open = sums.finish(most);
        let mut left = Sorter::of_runs(run);
        if !open.is_empty() {
            self.each_page::<E>(&mut left, |mut edges| {
                open.keep(&mut edges);
                edges
            })?;
        }
        let mut classifier = Classifier::new(number);
        left.visit(|edge| {
            classifier.add(edge);
            Ok(())
        })?;
        Ok(classifier.finish())
    }

    /// Adds to a sorter what is kept of the edges of each page.
    fn each_page<E: From<S::Error> + From<BakeError> + Send>(
        &self,
        sorter: &mut Sorter<Traversal>,
        kept: impl Fn(Vec<Traversal>) -> Vec<Traversal> + Sync,
    ) -> Result<(), E> {
        let (pages, batch) = (self.object.pages(), threads::current_num_threads());
        for start in pages.clone().step_by(batch) {
            let batch = start..(start + batch as u32).min(pages.end);
            for edges in threads::map(batch, |page| Ok::<_, E>(kept(self.edges(page)?))) {
                sorter.extend(&edges?, self.spill)?;
            }
        }
        Ok(())
    }

    /// Returns the edges of the triangles of a page.
    fn edges(&self, number: u32) -> Result<Vec<Traversal>, S::Error> {
        let Self { layout, source, object, .. } = *self;
        let bytes = layout.read_page(source, number)?;
        let page = bytes.page(object);
        let header = page.header();
        let (leaves, ids) = (layout.read_leaf_block(source, header)?, layout.read_id_block(source, header)?);
        let first = PACKET as u32 * header.first_packet.get();
        let end = first + PACKET as u32 * u32::from(header.packets.get());
        let nets = match self.topology {
            Some(topology) if topology.net_count() > 0 => topology.nets_between(source, first..end)?,
            _ => Vec::new(),
        };
        let net = |place: u32| {
            let found = nets.binary_search_by_key(&place, |net| net.place.get());
            found.map_or(1, |number| nets[number].net.get())
        };
        let ids = layout.has_ids().then_some(ids.bytes());
        Ok(edges_of_page(object, &page, leaves.bytes(), ids, &net))
    }
}
