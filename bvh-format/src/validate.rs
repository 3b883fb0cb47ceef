//! Checks the structure and all checksums of a whole file, page by page.
//!
//! The check reads the bytes in order, from memory or from storage, and holds a few pages at a time. One pass is for
//! the checksums of sections, one for the pages and their blocks, and one for the links between pages. It keeps only
//! sums over the pages, so memory does not grow with the file.

mod counts;
mod topology_in_pages;

pub use counts::Counts;
pub use topology_in_pages::check_in_pages;

use crate::checksum::{Hasher, hex};
use crate::error::{FormatError, ensure, require};
use crate::header::SectionKind;
use crate::ids::decode_ids;
use crate::instances::Instance;
use crate::layout::{ContentHasher, Layout, PairsInOrder};
use crate::leaf::{PACKET, PackedHead, Packet, TriangleEncoding, VertexBlock, decode_packet};
use crate::object::{MAX_COORDINATE, Object};
use crate::page::decode::decode_page;
use crate::page::{Page, check_crossing, check_page};
use crate::rule::Rule;
use crate::source::{Block, PageBytes, Source, chunks};
use crate::topology::{ObjectTopology, boundary_of};
use crate::treelet::Child;
use crate::vertex::{NO_FINER, Vertices, is_multiple_of_least};
use std::ops::Range;

/// The number of pages that workers share, and whose counts are in memory at a time.
const PAGES_PER_BATCH: u32 = 1 << 12;

/// How the work of [`validate_with`] is shared: by one thread, or by several.
///
/// ```
/// use bvh_format::validate::{Workers, validate_with};
/// use std::ops::Range;
///
/// /// Checks the sections on a thread of their own.
/// struct TwoThreads;
///
/// impl Workers for TwoThreads {
///     fn both<A: Send, B: Send, E: Send>(
///         &self,
///         a: impl FnOnce() -> Result<A, E> + Send,
///         b: impl FnOnce() -> Result<B, E> + Send,
///     ) -> Result<(A, B), E> {
///         std::thread::scope(|threads| {
///             let a = threads.spawn(a);
///             let b = b();
///             Ok((a.join().expect("no panic")?, b?))
///         })
///     }
///
///     fn each<T: Send, E: Send>(
///         &self,
///         pages: Range<u32>,
///         check: impl Fn(u32) -> Result<T, E> + Sync + Send,
///     ) -> Result<Vec<T>, E> {
///         pages.map(check).collect()
///     }
/// }
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// assert_eq!(validate_with(&bytes[..], &TwoThreads)?.objects.len(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Workers: Sync {
    /// Runs both functions, perhaps at the same time.
    ///
    /// # Errors
    /// The error of `a`, or else that of `b`.
    fn both<A: Send, B: Send, E: Send>(
        &self,
        a: impl FnOnce() -> Result<A, E> + Send,
        b: impl FnOnce() -> Result<B, E> + Send,
    ) -> Result<(A, B), E>;

    /// Checks some pages, and returns the results in the order of the pages.
    ///
    /// # Errors
    /// The error of the first page that fails.
    fn each<T: Send, E: Send>(
        &self,
        pages: Range<u32>,
        check: impl Fn(u32) -> Result<T, E> + Sync + Send,
    ) -> Result<Vec<T>, E>;
}

/// Does all work in the calling thread.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OneThread;

impl Workers for OneThread {
    fn both<A, B, E>(
        &self,
        a: impl FnOnce() -> Result<A, E>,
        b: impl FnOnce() -> Result<B, E>,
    ) -> Result<(A, B), E> {
        Ok((a()?, b()?))
    }

    fn each<T, E>(&self, pages: Range<u32>, check: impl Fn(u32) -> Result<T, E>) -> Result<Vec<T>, E> {
        pages.map(check).collect()
    }
}

/// Checks the structure and the checksums of a whole file in memory, in the calling thread.
///
/// # Errors
/// The errors of [`validate_with`].
pub fn validate(bytes: &[u8]) -> Result<Layout, FormatError> {
    validate_with(bytes, &OneThread)
}

/// Checks the structure and the checksums of a whole file. It does not check bounds (rule 35): see
/// [`crate::bounds::check_bounds`].
///
/// The check takes two passes over all bytes, and one over the pages for their links, with one more page read per link.
/// It needs three times the memory of the object table and of the instances, 48 bytes per object for the topology, and some
/// 300 KiB for counts. Each worker also holds a page with its blocks. These take at most 1 MiB, and 64 KiB in files of
/// `bvh-bake`.
///
/// # Errors
/// The first rule that does not hold, in the order of the specification, or an error of the source. The rule depends
/// neither on how the work is shared nor on where the bytes are.
pub fn validate_with<S: Source + ?Sized>(source: &S, workers: &impl Workers) -> Result<Layout, S::Error> {
    let layout = Layout::read_from(source)?;
    let pages = || {
        // Records that break a rule break it in `check_sections` as well, whose error comes first.
        let topology = layout.read_topology(source)?;
        let check = |(number, object)| check_object(&layout, source, object, topology.get(number), workers);
        layout.objects.iter().enumerate().try_for_each(check)
    };
    workers.both(|| check_sections(&layout, source), pages)?;
    Ok(layout)
}

/// Checks the checksums of whole sections and of the content, the order of duplicate ids, the instances, and what the
/// topology section shows by itself.
///
/// # Errors
/// The first of rules 10, 36, 40 to 47, 50 and 51 that does not hold, or an error of the source.
pub fn check_sections<S: Source + ?Sized>(layout: &Layout, source: &S) -> Result<(), S::Error> {
    let mut content = ContentHasher::default();
    let mut pairs = PairsInOrder::default();
    for section in &layout.sections {
        let mut hasher = Hasher::default();
        if section.kind.is_content() {
            content.begin(section.kind, section.range.len() as u64);
        }
        for chunk in chunks(section.range.clone()) {
            let bytes = source.read(chunk)?;
            hasher.update(&bytes);
            if section.kind.is_content() {
                content.update(&bytes);
            }
            if section.kind == SectionKind::Duplicates {
                pairs.add(&bytes);
            }
        }
        let at = section.range.start as u64;
        require(Rule::SectionChecksum, at, hex(section.checksum), hex(hasher.finish()))?;
    }
    require(Rule::SectionChecksum, 24, hex(layout.content_checksum), hex(content.finish()))?;
    let duplicates = layout.sections.iter().find(|section| section.kind == SectionKind::Duplicates);
    duplicates.map_or(Ok(()), |section| pairs.check(section))?;
    let instances = layout.read_instances(source)?;
    let topology = layout.check_topology(source)?;
    check_solids(layout, &instances, &topology)?;
    Ok(())
}

/// Checks that each object that is solid, or of which an instance is, is closed (rule 51).
fn check_solids(
    layout: &Layout,
    instances: &[Instance],
    topology: &[ObjectTopology],
) -> Result<(), FormatError> {
    let objects = layout.objects.iter().enumerate();
    let solid = objects.filter(|(_, object)| object.is_solid()).map(|(number, _)| number);
    let placed = instances.iter().filter(|instance| instance.solid).map(|instance| instance.object as usize);
    let is_closed = |number: usize| topology.get(number).is_some_and(|topology| topology.closed);
    let open = solid.chain(placed).find(|&number| !is_closed(number));
    open.map_or(Ok(()), |number| {
        let at = layout.sections.first().map_or(0, |section| section.range.start as u64);
        Err(FormatError::new(
            Rule::SolidClosed,
            at,
            "a closed object",
            format!("object {number}, which is not"),
        ))
    })
}

fn check_object<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    object: &Object,
    topology: Option<&ObjectTopology>,
    workers: &impl Workers,
) -> Result<(), S::Error> {
    let pages = object.pages();
    let closed = topology.is_some_and(|topology| topology.closed);
    let batches = || {
        let end = pages.end;
        pages
            .clone()
            .step_by(PAGES_PER_BATCH as usize)
            .map(move |start| start..end.min(start.saturating_add(PAGES_PER_BATCH)))
    };
    // A breach is reported at the end, since the rules for links come before it.
    let mut counts = Ok(Counts::default());
    let mut boundary = 0u64;
    for batch in batches() {
        let checked = workers.each(batch, |number| {
            let validated = validate_page(layout, source, object, closed, number)?;
            Ok::<_, S::Error>((validated.counts, validated.boundary))
        })?;
        for (page, of_page) in &checked {
            counts = counts.and_then(|counts| counts.followed_by(page, layout));
            boundary = boundary.wrapping_add(*of_page);
        }
    }
    for batch in batches() {
        workers.each(batch, |number| check_links(layout, source, object, number))?;
    }
    counts?.check(layout, object)?;
    topology.map_or(Ok(()), |topology| check_in_pages(layout, source, object, topology, boundary))
}

/// A page that has been validated, except for the targets of its remote links.
///
/// [`validate_page`] has an example.
pub struct ValidatedPage<'a> {
    /// The bytes of the page.
    pub bytes: PageBytes<'a>,
    /// The leaf block of the page.
    pub leaves: Block<'a>,
    /// How many parts the page has.
    pub counts: Counts,
    /// The sum of the [boundaries](boundary_of) of its triangles if the object is closed, else 0.
    pub boundary: u64,
}

/// Reads a page and its blocks, and checks them value by value, except for the targets of remote links. `closed` tells
/// whether the file states that the object is closed.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::source::{Block, PageBytes};
/// use bvh_format::validate::{Counts, ValidatedPage, validate_page};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// let object = &layout.objects[0];
/// let mut counts = Counts::default();
/// for number in object.pages() {
///     let ValidatedPage { bytes: page, leaves, counts: of_page, .. }: ValidatedPage<'_> =
///         validate_page(&layout, &bytes[..], object, false, number)?;
///     let (page, leaves): (PageBytes<'_>, Block<'_>) = (page, leaves);
///     assert_eq!(leaves.bytes().len(), page.page(object).header().leaf_bytes().len());
///     counts = counts.followed_by(&of_page, &layout)?;
/// }
/// counts.check(&layout, object)?; // as many as the object table states
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The first of rules 15 to 33, 37, 38 and 52 that does not hold, or an error of the source.
pub fn validate_page<'a, S: Source + ?Sized>(
    layout: &Layout,
    source: &'a S,
    object: &Object,
    closed: bool,
    number: u32,
) -> Result<ValidatedPage<'a>, S::Error> {
    let bytes = layout.read_page(source, number)?;
    let page = bytes.page(object);
    check_page(page.bytes(), number, object, layout.page_offset(number))?;
    // The page must be checked first: a damaged one may state blocks of any length.
    let header = page.header();
    let leaves = layout.read_leaf_block(source, header)?;
    layout.check_leaf_block_of(&leaves, &page, object)?;
    let ids = layout.read_id_block(source, header)?;
    layout.check_id_block_of(&ids, &page)?;
    let (triangles, boundary) = check_values(layout, object, closed, &page, leaves.bytes(), ids.bytes())?;
    let counts = Counts {
        first_page: number,
        first_packet: header.first_packet.get().into(),
        treelets: header.treelets.into(),
        packets: header.packets.get().into(),
        triangles,
        roots: header.roots.into(),
        remotes: header.remotes.into(),
    };
    Ok(ValidatedPage { bytes, leaves, counts, boundary })
}

/// Checks where the remote links of a page lead (rules 20 and 49), after all pages have been checked.
fn check_links<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    object: &Object,
    number: u32,
) -> Result<(), S::Error> {
    let bytes = layout.read_page(source, number)?;
    let page = bytes.page(object);
    if page.header().remotes == 0 {
        return Ok(());
    }
    decode_page(&page, object.f16_scale, |slot, child, _, slabs| {
        let Child::Remote(link) = page.links(slot).child(child) else { return Ok(()) };
        let to = page.remote(link);
        let target = layout.read_page(source, to.page())?;
        let at = layout.page_offset(to.page());
        Ok(check_crossing(&target.page(object), to, (number, link), slabs, at)?)
    })
}

/// Checks the values in the leaf and id blocks of a page, and returns the number of its triangles and, for a closed
/// object, the sum of their boundaries.
fn check_values(
    layout: &Layout,
    object: &Object,
    closed: bool,
    page: &Page,
    block: &[u8],
    ids: &[u8],
) -> Result<(u64, u64), FormatError> {
    let at = layout.page_offset(page.header().page_number.get());
    let vertices = &object.vertices;
    let (are_sums, are_corrected) = (vertices.are_sums(), vertices.are_corrected());
    let behind =
        VertexBlock::new(object.triangle_encoding, vertices, block, page.header().packets.get().into());
    ensure(behind.are_in_order(), Rule::Corrections, at + 24, || {
        ("lists of ascending numbers of corners".into(), "others".into())
    })?;
    let (mut triangles, mut sum) = (0, 0u64);
    for (packet, count) in packets(page) {
        triangles += count as u64;
        if object.triangle_encoding != TriangleEncoding::F32 {
            check_record(block, usize::from(packet), at)?;
        }
        let values = decode_packet(object.triangle_encoding, block, usize::from(packet));
        check_offsets(&values, vertices, at)?;
        if !are_sums && !are_corrected {
            check_predicted(&values, vertices, at)?;
        }
        for lane in 0..if are_corrected { PACKET } else { 0 } {
            let offsets = values.triangle(lane);
            let corners = behind.behind(packet.into(), lane, offsets);
            check_vertices(&offsets, &corners, vertices, at)?;
            if closed && lane < count {
                sum = sum.wrapping_add(boundary_of(&offsets, Some(&corners)));
            }
        }
        for lane in 0..if closed && !are_corrected { count } else { 0 } {
            sum = sum.wrapping_add(boundary_of(&values.triangle(lane), None));
        }
        let of_lanes = if ids.is_empty() { [0; PACKET] } else { decode_ids(ids, usize::from(packet)) };
        for &id in &of_lanes[..if ids.is_empty() { 0 } else { count }] {
            let id = u64::from(id);
            ensure(id < object.record.input_triangles.get(), Rule::IdRange, at + 32, || {
                (format!("an id below {}", object.record.input_triangles), id.to_string())
            })?;
        }
    }
    Ok((triangles, sum))
}

fn check_record(block: &[u8], packet: usize, at: u64) -> Result<(), FormatError> {
    let Some(head) = PackedHead::read(block) else { return Ok(()) };
    let record = head.record(block, packet);
    ensure(record.is_valid(head.vertices, head.further), Rule::PackedRecord, at + 24, || {
        let expected = format!(
            "rotations of at most 2, slots below {} and further slots among {}",
            head.vertices, head.further
        );
        (expected, format!("{record:?}"))
    })
}

/// Checks the offsets of a packet: their size and, where coordinates are sums of the origin and an offset, that these are exact.
fn check_offsets(packet: &Packet, vertices: &Vertices, at: u64) -> Result<(), FormatError> {
    // All at once, which compilers turn into vector code. Only what breaks a rule is looked for one by one.
    let origin = vertices.origin;
    let mut all_keep_the_rules = true;
    for corner in &packet.corners {
        for axis in 0..3 {
            for value in corner[axis].map(f64::from) {
                let sum = origin[axis] + value;
                let exact = (sum - origin[axis] == value) & (sum - value == origin[axis]);
                all_keep_the_rules &= (value.abs() <= MAX_COORDINATE) & exact;
            }
        }
    }
    if all_keep_the_rules {
        return Ok(());
    }
    for corner in &packet.corners {
        for axis in 0..3 {
            for value in corner[axis].map(f64::from) {
                ensure(value.abs() <= MAX_COORDINATE, Rule::VertexFinite, at + 24, || {
                    ("a finite coordinate of at most 2^120".into(), value.to_string())
                })?;
                let sum = origin[axis] + value;
                let exact = sum - origin[axis] == value && sum - value == origin[axis];
                let holds = exact || !vertices.is_sum(axis);
                ensure(holds, Rule::VertexPlace, at + 24, || {
                    (format!("a coordinate whose sum with {} is exact", origin[axis]), value.to_string())
                })?;
            }
        }
    }
    Ok(())
}

/// Checks a packet of vertices without corrections, as [`check_vertices`] does.
fn check_predicted(packet: &Packet, vertices: &Vertices, at: u64) -> Result<(), FormatError> {
    // All at once, which compilers turn into vector code. Only what breaks a rule is looked for one by one.
    let mut all_keep_the_rules = true;
    for corner in &packet.corners {
        for (axis, offsets) in corner.iter().enumerate() {
            let (origin, most) = (vertices.origin[axis], f64::from(vertices.left_out[axis]));
            for (coordinate, offset) in vertices.predicted(axis, offsets).into_iter().zip(offsets) {
                let sum = origin + f64::from(*offset);
                let is_exact = (sum - f64::from(*offset) == origin) & (sum - origin == f64::from(*offset));
                // Rounding keeps the order of a difference and of what it may be.
                let distance = (coordinate - sum).abs();
                let is_near = (distance < most) | (distance == 0.0);
                let has_unit = (coordinate.abs() >= NO_FINER) | (coordinate == 0.0);
                all_keep_the_rules &= is_exact & is_near & has_unit;
            }
        }
    }
    for lane in 0..if all_keep_the_rules { 0 } else { PACKET } {
        let offsets = packet.triangle(lane);
        check_vertices(&offsets, &vertices.predicted_triangle(&offsets), vertices, at)?;
    }
    Ok(())
}

/// Checks that the coordinates of a triangle are as near to their offsets as the object states, and of its units.
fn check_vertices(
    offsets: &[[f32; 3]; 3],
    corners: &[[f64; 3]; 3],
    vertices: &Vertices,
    at: u64,
) -> Result<(), FormatError> {
    for (offsets, corner) in offsets.iter().zip(corners) {
        for axis in 0..3 {
            let (offset, coordinate) = (offsets[axis], corner[axis]);
            let holds = vertices.is_within(axis, offset, coordinate) && is_multiple_of_least(coordinate);
            ensure(holds, Rule::VertexPlace, at + 24, || {
                let [origin, left_out] = [vertices.origin[axis], vertices.left_out[axis].into()];
                let expected = format!("a multiple of 2^-180 within {left_out} of {origin} + {offset}");
                (expected, coordinate.to_string())
            })?;
        }
    }
    Ok(())
}

/// Returns the leaf packets of a checked page in the order of slots: the number of each packet, and of its triangles.
pub fn packets<'a>(page: &'a Page<'a>) -> impl Iterator<Item = (u16, usize)> + 'a {
    (0..page.header().treelets).flat_map(|slot| {
        let links = page.links(slot);
        (0..8).filter_map(move |child| match links.child(child) {
            Child::Leaf { packet, triangles } => Some((packet, usize::from(triangles))),
            _ => None,
        })
    })
}
