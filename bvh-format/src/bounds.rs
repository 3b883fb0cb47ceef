//! Compares decoded bounds with tight ones: proves that each slab contains its triangles, and measures how loose it is.
//!
//! The functions here take one page at a time, from the last page of an object to the first. They compute the tight
//! k-DOP of each subtree from the stored triangles, and compare it with what a query decodes. Slabs along different
//! directions cannot be joined on the way up, so a turning slab is compared with all triangles below it. These are kept
//! for subtrees that are small enough to have one.

use crate::error::{FormatError, ensure};
use crate::kdop::Kdop;
use crate::layout::Layout;
use crate::leaf::{PACKET, Packet, decode_packet};
use crate::object::Object;
use crate::page::decode::decode_page;
use crate::page::{Page, RootRef};
use crate::rule::Rule;
use crate::treelet::Child;
use crate::turning::{MAX_TRIANGLES, TurningCodes, TurningSlab, decode_turning};
use crate::validate::packets as packets_of;

/// A child of a treelet or a subtree root of a page, with both of its bounds.
///
/// [`visit_bounds`] has an example.
pub struct Bound<'a> {
    /// The treelet's slot.
    pub slot: u8,
    /// The number of the child in the treelet; `None` for a subtree root.
    pub child: Option<usize>,
    /// The bound that a query decodes.
    pub decoded: Kdop,
    /// The turning slab that a query decodes, if the child has one.
    pub turning: Option<TurningSlab>,
    /// The tightest bound of the triangles below, whose vertices are as near to their offsets as the object states.
    pub tight: &'a Kdop,
    /// The anchor of the subtree root that the child leads to; for other children [`Kdop::EMPTY`].
    pub anchor: &'a Kdop,
    /// The triangles of a leaf packet, and those below a child in a profile with turning slabs, unless there are more than
    /// [`MAX_TRIANGLES`].
    pub patch: Option<&'a [Packet]>,
}

/// The part of the tree below a subtree root.
///
/// [`visit_bounds`] has an example.
#[derive(Debug, Clone)]
pub struct Subtree {
    /// The slabs of the root's anchor.
    pub anchor: Kdop,
    /// The tightest k-DOP of its triangles.
    pub kdop: Kdop,
    /// The number of its triangles; more than [`MAX_TRIANGLES`] if it is not known.
    pub triangles: usize,
    /// Its triangles, in packets whose unused lanes repeat the last one. None are kept if there are more than
    /// [`MAX_TRIANGLES`], or if the profile has no turning slabs.
    pub packets: Vec<Packet>,
}

impl Subtree {
    /// Returns a stand-in for a subtree that has not been visited. Its bounds are empty, and its number of triangles
    /// exceeds every limit.
    pub fn unknown() -> &'static Self {
        static UNKNOWN: Subtree =
            Subtree { anchor: Kdop::EMPTY, kdop: Kdop::EMPTY, triangles: usize::MAX, packets: Vec::new() };
        &UNKNOWN
    }
}

/// The packets of all subtrees of a page that are small enough for a turning slab. Those of one subtree are adjacent.
struct Patches {
    packets: Vec<Packet>,
    /// Per slot, where its packets start, if they are kept.
    starts: Vec<Option<usize>>,
    /// Per slot, the number of packets and of triangles below.
    sizes: Vec<(usize, usize)>,
}

impl Patches {
    /// Takes the packets of a page, in the order of their numbers, and those of subtrees in later pages.
    fn of_page<'b>(page: &Page, own: &[Packet], below: impl Fn(RootRef) -> &'b Subtree) -> Self {
        let treelets = page.header().treelets;
        let mut sizes = vec![(0, 0); usize::from(treelets)];
        let size_of = |sizes: &[(usize, usize)], child: Child| match child {
            Child::Treelet(slot) => sizes[usize::from(slot)],
            Child::Remote(link) => {
                let subtree = below(page.remote(link));
                (subtree.packets.len(), subtree.triangles)
            }
            Child::Leaf { triangles, .. } => (1, usize::from(triangles)),
            Child::Empty => (0, 0),
        };
        let children = |slot: u8| {
            let links = page.links(slot);
            (0..links.children()).map(move |child| links.child(child))
        };
        for slot in (0..treelets).rev() {
            sizes[usize::from(slot)] = children(slot).fold((0, 0), |(packets, triangles), child| {
                let size = size_of(&sizes, child);
                (packets + size.0, size.1.saturating_add(triangles))
            });
        }
        // Parents come before children, and give them their places.
        let (mut packets, mut starts) = (Vec::new(), vec![None; usize::from(treelets)]);
        for slot in 0..treelets {
            let place = usize::from(slot);
            let (count, triangles) = sizes[place];
            if triangles > MAX_TRIANGLES {
                continue;
            }
            let start = *starts[place].get_or_insert(packets.len());
            if start == packets.len() {
                packets.resize(start + count, Packet::default());
            }
            let mut next = start;
            for child in children(slot) {
                match child {
                    Child::Treelet(slot) => starts[usize::from(slot)] = Some(next),
                    Child::Leaf { packet, .. } => packets[next] = own[usize::from(packet)],
                    Child::Remote(link) => {
                        let subtree = &below(page.remote(link)).packets;
                        packets[next..next + subtree.len()].copy_from_slice(subtree);
                    }
                    Child::Empty => {}
                }
                next += size_of(&sizes, child).0;
            }
        }
        Self { packets, starts, sizes }
    }

    /// The packets below a slot, unless there are too many triangles.
    fn of_slot(&self, slot: usize) -> Option<&[Packet]> {
        let start = self.starts[slot]?;
        self.packets.get(start..start + self.sizes[slot].0)
    }
}

/// Visits all subtree roots and children of a page, and returns the subtrees of the roots.
///
/// The page and its leaf block must have been checked. `below` returns the subtrees of roots in later pages.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::bounds::{Bound, Subtree, visit_bounds};
/// use bvh_format::page::{Page, check_page};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// let object = &layout.objects[0]; // a cube from -1 to 1, in one page
/// let page = layout.page_bytes(&bytes, 0).expect("a page");
/// check_page(page, 0, object, layout.page_offset(0))?;
/// let page = Page::new(page, object.profile());
/// let leaves = layout.leaf_block(&bytes, page.header());
/// let roots = visit_bounds(object, &page, leaves, |_| Subtree::unknown(), |Bound { decoded, tight, .. }| {
///     assert!((0..3).all(|axis| decoded.lo[axis] <= tight.lo[axis] && tight.hi[axis] <= decoded.hi[axis]));
///     Ok(())
/// })?;
/// assert_eq!((roots[0].kdop.lo[0], roots[0].kdop.hi[0]), (-1.0, 1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The first error of `visit`.
pub fn visit_bounds<'b>(
    object: &Object,
    page: &Page,
    leaf_block: &[u8],
    below: impl Fn(RootRef) -> &'b Subtree,
    visit: impl FnMut(Bound) -> Result<(), FormatError>,
) -> Result<Vec<Subtree>, FormatError> {
    visit_with(object, page, leaf_block, object.profile.has_turning_slabs(), below, visit)
}

/// Visits as [`visit_bounds`] does. Without `patches`, no packets are kept but those of children that are packets.
fn visit_with<'b>(
    object: &Object,
    page: &Page,
    leaf_block: &[u8],
    patches: bool,
    below: impl Fn(RootRef) -> &'b Subtree,
    mut visit: impl FnMut(Bound) -> Result<(), FormatError>,
) -> Result<Vec<Subtree>, FormatError> {
    let (header, profile) = (page.header(), object.profile);
    let slabs = profile.directions().slabs();
    let (are_sums, margins) = (object.vertices.are_sums(), object.vertices.margins());
    let treelets = usize::from(header.treelets);
    let mut packets = vec![Packet::default(); usize::from(header.packets.get())];
    for (number, triangles) in packets_of(page) {
        let place = usize::from(number);
        packets[place] = decode_packet(object.triangle_encoding, leaf_block, place).filled(triangles);
    }
    // A child has a higher slot than its parent: tight bounds go up from the last slot, decoded ones down from the first.
    let mut tight = vec![Kdop::EMPTY; treelets];
    let width = profile.width();
    let mut children = vec![Kdop::EMPTY; treelets * width];
    for slot in (0..treelets).rev() {
        let links = page.links(slot as u8);
        for child in 0..links.children() {
            let kdop = match links.child(child) {
                Child::Treelet(slot) => tight[usize::from(slot)],
                Child::Remote(link) => below(page.remote(link)).kdop,
                Child::Leaf { packet, .. } => {
                    let kdop = packets[usize::from(packet)].kdop(PACKET, slabs);
                    if are_sums { kdop } else { kdop.widened(&margins) }
                }
                Child::Empty => continue,
            };
            children[slot * width + child] = kdop;
            tight[slot].join(&kdop, slabs);
        }
    }
    let patches = patches.then(|| Patches::of_page(page, &packets, &below));
    for root in 0..header.roots {
        let decoded = page.anchor_slabs(root).to_kdop(slabs);
        let (tight, anchor) = (&tight[usize::from(root)], &Kdop::EMPTY);
        visit(Bound { slot: root, child: None, decoded, turning: None, tight, anchor, patch: None })?;
    }
    decode_page(page, object.f16_scale, |slot, child, _, node| {
        let (mut anchor, link) = (&Kdop::EMPTY, page.links(slot).child(child));
        let patch = match (&patches, link) {
            (_, Child::Leaf { packet, .. }) => packets.get(usize::from(packet)..=usize::from(packet)),
            (Some(patches), Child::Treelet(slot)) => patches.of_slot(usize::from(slot)),
            (Some(_), Child::Remote(link)) => Some(below(page.remote(link)))
                .filter(|subtree| subtree.triangles <= MAX_TRIANGLES)
                .map(|subtree| &subtree.packets[..]),
            _ => None,
        };
        if let Child::Remote(link) = link {
            anchor = &below(page.remote(link)).anchor;
        }
        visit(Bound {
            slot,
            child: Some(child),
            decoded: node.to_kdop(slabs),
            turning: decode_turning(profile, page.treelet(slot), child, node),
            tight: &children[usize::from(slot) * width + child],
            anchor,
            patch,
        })
    })?;
    let subtree = |slot: usize| Subtree {
        anchor: page.anchor_slabs(slot as u8).to_kdop(slabs),
        kdop: tight[slot],
        triangles: patches.as_ref().map_or(usize::MAX, |patches| patches.sizes[slot].1),
        packets: patches.as_ref().and_then(|patches| patches.of_slot(slot)).unwrap_or_default().to_vec(),
    };
    Ok((0..usize::from(header.roots)).map(subtree).collect())
}

/// Checks that each slab decoded in a page contains the triangles below it, and that the object's sphere contains the
/// triangles of the page.
///
/// Returns the page's subtrees, and how loose the slabs of the children are. The arguments are those of
/// [`visit_bounds`], and whether any child of the object may have a turning slab: if none has, which [`has_turning_slabs`] tells of
/// a page, no triangles are kept for them.
///
/// # Errors
/// Rule 35, if a decoded slab or the sphere cuts its triangles; rule 39, if a turning slab has too many; rule 49, if the
/// anchor that a child leads to reaches beyond the child's slabs.
pub fn check_bounds<'b>(
    layout: &Layout,
    object: &Object,
    page: &Page,
    leaf_block: &[u8],
    may_turn: bool,
    below: impl Fn(RootRef) -> &'b Subtree,
) -> Result<(Vec<Subtree>, Inflation), FormatError> {
    let slabs = object.profile.directions().slabs();
    let at = layout.page_offset(page.header().page_number.get());
    let (mut inflation, margins) = (Inflation::default(), object.vertices.margins());
    let patches = may_turn && object.profile.has_turning_slabs();
    let subtrees = visit_with(object, page, leaf_block, patches, below, |bound| {
        let Bound { slot, child, decoded, turning, tight, anchor, patch } = bound;
        let place =
            || child.map_or_else(|| format!("slot {slot}"), |child| format!("slot {slot}, child {child}"));
        ensure(decoded.contains(tight, slabs), Rule::BoundContains, at, || {
            (format!("{} to contain {tight:?}", place()), format!("{decoded:?}"))
        })?;
        ensure(decoded.contains(anchor, slabs), Rule::Nested, at, || {
            (format!("{} to contain the anchor it leads to, {anchor:?}", place()), format!("{decoded:?}"))
        })?;
        if let (Some(child), Some(packets)) = (child, patch)
            && matches!(page.links(slot).child(child), Child::Leaf { .. })
        {
            ensure(object.sphere_contains(packets), Rule::BoundContains, at, || {
                (format!("the object's sphere to contain {}", place()), format!("{:?}", object.record))
            })?;
        }
        if let Some(slab) = turning {
            let patch = patch.ok_or_else(|| {
                let expected = format!("at most {MAX_TRIANGLES} triangles below {}", place());
                FormatError::new(Rule::TurningTriangles, at, expected, "more")
            })?;
            ensure(slab.contains(patch, object.vertices.left_out), Rule::BoundContains, at, || {
                (format!("the turning slab of {} to contain its triangles", place()), format!("{slab:?}"))
            })?;
        }
        if child.is_some() {
            inflation.add(&decoded, tight, slabs, &margins);
        }
        Ok(())
    })?;
    Ok((subtrees, inflation))
}

/// Returns whether a child in a page may have a turning slab. The page need not have been checked.
pub fn has_turning_slabs(page: &Page) -> bool {
    page.profile().has_turning_slabs()
        && (0..page.header().treelets).any(|slot| {
            page.treelet(slot).first_chunk().is_some_and(|treelet| TurningCodes::read(treelet).any())
        })
}

/// Checks that the box of an object's record contains its triangles, given those below its root.
///
/// # Errors
/// Rule 35.
pub fn check_box(layout: &Layout, object: &Object, root: &Subtree) -> Result<(), FormatError> {
    let (record, kdop) = (&object.record, &root.kdop);
    let inside = (0..3).all(|a| record.box_lo[a].get() <= kdop.lo[a] && kdop.hi[a] <= record.box_hi[a].get());
    ensure(inside, Rule::BoundContains, layout.page_offset(record.first_page.get()), || {
        ("the object's box to contain its triangles".into(), format!("{record:?}"))
    })
}

/// How much wider decoded bounds are than tight ones, as sums over nodes.
///
/// ```
/// use bvh_format::bounds::Inflation;
/// use bvh_format::kdop::Kdop;
///
/// let tight = Kdop::of_points([[0.0; 3], [1.0; 3]]);
/// let decoded = Kdop::of_points([[0.0; 3], [2.0, 1.0, 1.0]]);
/// let mut inflation = Inflation::default();
/// inflation.add(&decoded, &tight, 3, &[0.0; 13]);
/// assert_eq!((inflation.mean_width(), inflation.mean_volume()), ((2.0 + 1.0 + 1.0) / 3.0, 2.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Inflation {
    /// The nodes that have been counted.
    pub nodes: u64,
    /// The sum over nodes of the mean, over their slabs, of decoded width / tight width.
    pub width: f64,
    /// The sum over nodes of the product, over the sides of their boxes, of decoded width / tight width.
    pub volume: f64,
}

impl Inflation {
    /// Adds a node, whose tight slabs were widened by margins. What is flat in a direction has no ratio there, and a point,
    /// which is flat in every direction, is not counted.
    pub fn add(&mut self, held: &Kdop, tight: &Kdop, slabs: usize, margins: &[f64; 13]) {
        // All slabs at a time, those that are not there included, which compilers turn into vector code.
        let (mut ratios, mut has_ratio) = ([0.0; 13], [false; 13]);
        for slab in 0..13 {
            let [lo, hi] = [tight.lo[slab], tight.hi[slab]].map(f64::from);
            let (width, held) = (hi - lo, f64::from(held.hi[slab]) - f64::from(held.lo[slab]));
            // Both ends of what is flat are as far out as the margin, and were rounded by less than 2^-23 of themselves each.
            let largest = if lo.abs() > hi.abs() { lo.abs() } else { hi.abs() };
            let rounding = if margins[slab] > 0.0 { 2f64.powi(-22) * largest } else { 0.0 };
            (ratios[slab], has_ratio[slab]) = (held / width, width > 2.0 * margins[slab] + rounding);
        }
        let (mut sum, mut count) = (0.0, 0u32);
        for slab in 0..slabs {
            sum += if has_ratio[slab] { ratios[slab] } else { 0.0 };
            count += u32::from(has_ratio[slab]);
        }
        if count == 0 {
            return;
        }
        self.nodes += 1;
        self.width += sum / f64::from(count);
        self.volume += (0..3).filter(|&axis| has_ratio[axis]).map(|axis| ratios[axis]).product::<f64>();
    }

    /// Adds the sums of other nodes.
    pub fn join(&mut self, other: &Self) {
        self.nodes += other.nodes;
        self.width += other.width;
        self.volume += other.volume;
    }

    /// The mean ratio of widths; 1 without nodes.
    pub fn mean_width(&self) -> f64 {
        if self.nodes == 0 { 1.0 } else { self.width / self.nodes as f64 }
    }

    /// The mean ratio of volumes; 1 without nodes.
    pub fn mean_volume(&self) -> f64 {
        if self.nodes == 0 { 1.0 } else { self.volume / self.nodes as f64 }
    }
}
