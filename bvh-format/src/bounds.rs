//! Compares decoded bounds with tight ones: proves that each slab contains its triangles, and measures how loose it is.
//!
//! The functions here take one page at a time, from the last page of an object to the first. They compute the tight
//! k-DOP of each subtree from the stored triangles, and compare it with what a query decodes.

use crate::decode::decode_child;
use crate::error::{FormatError, ensure};
use crate::kdop::Kdop;
use crate::layout::Layout;
use crate::leaf::decode_packet;
use crate::object::Object;
use crate::page::{Page, RootRef};
use crate::rule::Rule;
use crate::slabs::NodeSlabs;
use crate::treelet::{Child, Links};

/// A child of a treelet or a subtree root of a page, with both of its bounds.
pub struct Bound {
    /// The treelet's slot.
    pub slot: u8,
    /// The number of the child in the treelet; `None` for a subtree root.
    pub child: Option<usize>,
    /// The bound that a query decodes.
    pub decoded: Kdop,
    /// The tightest bound of the triangles below.
    pub tight: Kdop,
}

/// Visits all subtree roots and children of a page, and returns the tight k-DOPs of the roots.
///
/// The page and its leaf block must have been checked. `below` returns the tight k-DOPs of roots in later pages.
///
/// # Errors
/// The first error of `visit`.
pub fn visit_bounds(
    object: &Object,
    page: &Page,
    leaf_block: &[u8],
    below: impl Fn(RootRef) -> Kdop,
    mut visit: impl FnMut(Bound) -> Result<(), FormatError>,
) -> Result<Vec<Kdop>, FormatError> {
    let header = page.header();
    let slabs = object.profile.directions().slabs();
    let treelets = usize::from(header.treelets);
    // A child has a higher slot than its parent: tight bounds go up from the last slot, decoded ones down from the first.
    let mut tight = vec![Kdop::EMPTY; treelets];
    let width = object.profile.width();
    let mut children = vec![Kdop::EMPTY; treelets * width];
    for slot in (0..treelets).rev() {
        let links = Links::read(page.treelet(slot as u8));
        for child in 0..links.children() {
            let kdop = match links.child(child) {
                Child::Treelet(slot) => tight[usize::from(slot)],
                Child::Remote(link) => below(page.remote(link)),
                Child::Leaf { packet, triangles } => {
                    let values = decode_packet(object.triangle_encoding, leaf_block, usize::from(packet));
                    values.kdop(usize::from(triangles), slabs)
                }
                Child::Empty => continue,
            };
            children[slot * width + child] = kdop;
            tight[slot].join(&kdop, slabs);
        }
    }
    let mut decoded = vec![NodeSlabs::default(); treelets];
    for root in 0..header.roots {
        let slot = usize::from(root);
        decoded[slot] = page.anchor_slabs(root);
        visit(Bound { slot: root, child: None, decoded: decoded[slot].to_kdop(slabs), tight: tight[slot] })?;
    }
    for slot in 0..treelets {
        let treelet = page.treelet(slot as u8);
        let links = Links::read(treelet);
        for child in 0..links.children() {
            let node = decode_child(object.profile, object.f16_scale, treelet, child, &decoded[slot]);
            let (held, tight) = (node.to_kdop(slabs), children[slot * width + child]);
            visit(Bound { slot: slot as u8, child: Some(child), decoded: held, tight })?;
            if let Child::Treelet(slot) = links.child(child) {
                decoded[usize::from(slot)] = node;
            }
        }
    }
    tight.truncate(usize::from(header.roots));
    Ok(tight)
}

/// Checks that each slab decoded in a page contains the triangles below it.
///
/// Returns the tight k-DOPs of the page's subtree roots, and how loose the slabs of the children are. The arguments are
/// those of [`visit_bounds`].
///
/// # Errors
/// Rule 35, if a decoded slab cuts its triangles.
pub fn check_bounds(
    layout: &Layout,
    object: &Object,
    page: &Page,
    leaf_block: &[u8],
    below: impl Fn(RootRef) -> Kdop,
) -> Result<(Vec<Kdop>, Inflation), FormatError> {
    let slabs = object.profile.directions().slabs();
    let at = layout.page_offset(page.header().page_number.get());
    let mut inflation = Inflation::default();
    let tight = visit_bounds(object, page, leaf_block, below, |bound| {
        let Bound { slot, child, decoded, tight } = bound;
        ensure(decoded.contains(&tight, slabs), Rule::BoundContains, at, || {
            let place =
                child.map_or_else(|| format!("slot {slot}"), |child| format!("slot {slot}, child {child}"));
            (format!("{place} to contain {tight:?}"), format!("{decoded:?}"))
        })?;
        if child.is_some() {
            inflation.add(&decoded, &tight, slabs);
        }
        Ok(())
    })?;
    Ok((tight, inflation))
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
