//! Compares decoded bounds with tight ones: proves that each slab contains its triangles, and measures how loose it is.
//!
//! The functions here take one page at a time, from the last page of an object to the first. They compute the tight
//! k-DOP of each subtree from the stored triangles, and compare it with what a query decodes. Slabs along different
//! directions cannot be joined on the way up, so a turning slab is compared with all triangles below it. These are kept
//! for subtrees that are small enough to have one.

use crate::decode::decode_child;
use crate::error::{FormatError, ensure};
use crate::kdop::Kdop;
use crate::layout::Layout;
use crate::leaf::{PACKET, Packet, decode_packet};
use crate::object::Object;
use crate::page::{Page, RootRef};
use crate::rule::Rule;
use crate::slabs::NodeSlabs;
use crate::treelet::{Child, Links};
use crate::turning::{MAX_TRIANGLES, TurningSlab, decode_turning};

/// A child of a treelet or a subtree root of a page, with both of its bounds.
pub struct Bound<'a> {
    /// The treelet's slot.
    pub slot: u8,
    /// The number of the child in the treelet; `None` for a subtree root.
    pub child: Option<usize>,
    /// The bound that a query decodes.
    pub decoded: Kdop,
    /// The turning slab that a query decodes, if the child has one.
    pub turning: Option<TurningSlab>,
    /// The tightest bound of the triangles below.
    pub tight: Kdop,
    /// The triangles below a child that has a turning slab, unless there are more than [`MAX_TRIANGLES`].
    pub patch: Option<&'a [Packet]>,
}

/// What is below a subtree root.
#[derive(Debug, Clone)]
pub struct Subtree {
    /// The tightest k-DOP of its triangles.
    pub kdop: Kdop,
    /// Its triangles, unless there are more than [`MAX_TRIANGLES`], or the profile has no turning slabs.
    pub patch: Option<Patch>,
}

impl Subtree {
    /// A subtree of which nothing is known.
    pub const UNKNOWN: Self = Self { kdop: Kdop::EMPTY, patch: None };

    fn packets(&self) -> Option<&[Packet]> {
        self.patch.as_ref().map(|patch| &patch.packets[..])
    }

    /// The k-DOP, and the packets with the number of their triangles.
    fn parts(&self) -> (Kdop, Option<(&[Packet], usize)>) {
        (self.kdop, self.patch.as_ref().map(|patch| (&patch.packets[..], patch.triangles)))
    }
}

/// At most [`MAX_TRIANGLES`] triangles, in packets whose unused lanes repeat the last one.
#[derive(Debug, Clone, Default)]
pub struct Patch {
    packets: Vec<Packet>,
    triangles: usize,
}

impl Patch {
    /// Adds the triangles of packets, unless they are too many.
    fn joined(mut self, packets: &[Packet], triangles: usize) -> Option<Self> {
        self.triangles += triangles;
        if self.triangles > MAX_TRIANGLES {
            return None;
        }
        self.packets.extend_from_slice(packets);
        Some(self)
    }
}

/// Visits all subtree roots and children of a page, and returns the subtrees of the roots.
///
/// The page and its leaf block must have been checked. `below` returns the subtrees of roots in later pages.
///
/// # Errors
/// The first error of `visit`.
pub fn visit_bounds<'b>(
    object: &Object,
    page: &Page,
    leaf_block: &[u8],
    below: impl Fn(RootRef) -> &'b Subtree,
    mut visit: impl FnMut(Bound) -> Result<(), FormatError>,
) -> Result<Vec<Subtree>, FormatError> {
    let (header, profile) = (page.header(), object.profile);
    let slabs = profile.directions().slabs();
    let treelets = usize::from(header.treelets);
    let packet_of = |packet: u16, triangles: u8| {
        decode_packet(object.triangle_encoding, leaf_block, usize::from(packet)).filled(triangles.into())
    };
    // A child has a higher slot than its parent: tight bounds go up from the last slot, decoded ones down from the first.
    let nothing = Subtree { kdop: Kdop::EMPTY, patch: profile.has_turning_slabs().then(Patch::default) };
    let mut subtrees = vec![nothing; treelets];
    let width = profile.width();
    let mut children = vec![Kdop::EMPTY; treelets * width];
    for slot in (0..treelets).rev() {
        let links = Links::read(page.treelet(slot as u8));
        let (before, behind) = subtrees.split_at_mut(slot + 1);
        let whole = &mut before[slot];
        for child in 0..links.children() {
            let packets;
            let (kdop, patch) = match links.child(child) {
                Child::Leaf { packet, triangles } => {
                    packets = [packet_of(packet, triangles)];
                    (packets[0].kdop(PACKET, slabs), Some((&packets[..], usize::from(triangles))))
                }
                Child::Treelet(below) => behind[usize::from(below) - (slot + 1)].parts(),
                Child::Remote(link) => below(page.remote(link)).parts(),
                Child::Empty => continue,
            };
            whole.kdop.join(&kdop, slabs);
            let all = whole.patch.take().zip(patch);
            whole.patch = all.and_then(|(all, (packets, triangles))| all.joined(packets, triangles));
            children[slot * width + child] = kdop;
        }
    }
    let mut decoded = vec![NodeSlabs::default(); treelets];
    for root in 0..header.roots {
        let slot = usize::from(root);
        decoded[slot] = page.anchor_slabs(root);
        let (held, tight) = (decoded[slot].to_kdop(slabs), subtrees[slot].kdop);
        visit(Bound { slot: root, child: None, decoded: held, turning: None, tight, patch: None })?;
    }
    for slot in 0..treelets {
        let treelet = page.treelet(slot as u8);
        let links = Links::read(treelet);
        for child in 0..links.children() {
            let node = decode_child(profile, object.f16_scale, treelet, child, &decoded[slot]);
            let turning = decode_turning(profile, treelet, child, &node);
            let packets;
            let patch = match links.child(child) {
                Child::Leaf { packet, triangles } if turning.is_some() => {
                    packets = [packet_of(packet, triangles)];
                    Some(&packets[..])
                }
                Child::Treelet(slot) => subtrees[usize::from(slot)].packets(),
                Child::Remote(link) => below(page.remote(link)).packets(),
                _ => None,
            };
            visit(Bound {
                slot: slot as u8,
                child: Some(child),
                decoded: node.to_kdop(slabs),
                turning,
                tight: children[slot * width + child],
                patch,
            })?;
            if let Child::Treelet(slot) = links.child(child) {
                decoded[usize::from(slot)] = node;
            }
        }
    }
    subtrees.truncate(usize::from(header.roots));
    Ok(subtrees)
}

/// Checks that each slab decoded in a page contains the triangles below it.
///
/// Returns the page's subtrees, and how loose the slabs of the children are. The arguments are those of
/// [`visit_bounds`].
///
/// # Errors
/// Rule 35, if a decoded slab cuts its triangles; rule 39, if a turning slab has too many.
pub fn check_bounds<'b>(
    layout: &Layout,
    object: &Object,
    page: &Page,
    leaf_block: &[u8],
    below: impl Fn(RootRef) -> &'b Subtree,
) -> Result<(Vec<Subtree>, Inflation), FormatError> {
    let slabs = object.profile.directions().slabs();
    let at = layout.page_offset(page.header().page_number.get());
    let mut inflation = Inflation::default();
    let subtrees = visit_bounds(object, page, leaf_block, below, |bound| {
        let Bound { slot, child, decoded, turning, tight, patch } = bound;
        let place =
            || child.map_or_else(|| format!("slot {slot}"), |child| format!("slot {slot}, child {child}"));
        ensure(decoded.contains(&tight, slabs), Rule::BoundContains, at, || {
            (format!("{} to contain {tight:?}", place()), format!("{decoded:?}"))
        })?;
        if let Some(slab) = turning {
            let patch = patch.ok_or_else(|| {
                let expected = format!("at most {MAX_TRIANGLES} triangles below {}", place());
                FormatError::new(Rule::TurningTriangles, at, expected, "more")
            })?;
            ensure(slab.contains(patch), Rule::BoundContains, at, || {
                (format!("the turning slab of {} to contain its triangles", place()), format!("{slab:?}"))
            })?;
        }
        if child.is_some() {
            inflation.add(&decoded, &tight, slabs);
        }
        Ok(())
    })?;
    Ok((subtrees, inflation))
}

/// How much wider decoded bounds are than tight ones, as sums over nodes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Inflation {
    /// The nodes that have been counted.
    pub nodes: u64,
    /// The sum over nodes of: decoded width / tight width, as the mean over slabs.
    pub width: f64,
    /// The sum over nodes of: decoded width / tight width, as the product over the sides of the box.
    pub volume: f64,
}

impl Inflation {
    /// Adds a node. A point, which is flat in every direction, has no ratio and is not counted.
    pub fn add(&mut self, held: &Kdop, tight: &Kdop, slabs: usize) {
        let ratio = |slab: usize| {
            let tight = f64::from(tight.hi[slab]) - f64::from(tight.lo[slab]);
            let held = f64::from(held.hi[slab]) - f64::from(held.lo[slab]);
            (tight > 0.0).then_some(held / tight)
        };
        let (sum, count) =
            (0..slabs).filter_map(ratio).fold((0.0, 0), |(sum, n), ratio| (sum + ratio, n + 1));
        if count == 0 {
            return;
        }
        self.nodes += 1;
        self.width += sum / f64::from(count);
        self.volume += (0..3).filter_map(ratio).product::<f64>();
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
