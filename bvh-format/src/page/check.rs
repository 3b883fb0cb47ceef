//! Checks a page against the rules before it is read.

use super::{NO_PARENT, PAGE, Page, PageShape, RootRef, anchor_at, page_checksum};
use crate::checksum::hex;
use crate::error::{FormatError, ensure, require};
use crate::object::Object;
use crate::page::decode::decode_page;
use crate::profile::Encoding;
use crate::quantize::F16_MAX_CODE;
use crate::rule::Rule;
use crate::slabs::{NodeSlabs, row};
use crate::treelet::CodePlaces;

/// Checks everything that can be checked in a page alone: its checksum, shape, anchors, codes and links. `number` is
/// the page's number in the node section, and `at` its byte offset in the file.
///
/// The page to which a remote link leads is checked when the link is followed: see [`check_crossing`].
///
/// # Errors
/// The first of rules 15 to 25, 38 and 49 that does not hold.
pub fn check_page(bytes: &[u8; PAGE], number: u32, object: &Object, at: u64) -> Result<(), FormatError> {
    let page = Page::new(bytes, object.profile);
    let header = page.header();
    require(Rule::PageChecksum, at, hex(header.checksum.get()), hex(page_checksum(bytes)))?;
    require(Rule::PageNumber, at + 44, number, header.page_number.get())?;
    require(Rule::PageProfile, at + 62, object.profile.number(), header.profile)?;
    let shape = header.shape();
    let PageShape { roots, remotes, treelets, short } = shape;
    let room = if object.profile.has_short_treelets() { treelets.saturating_sub(roots) } else { 0 };
    ensure(short <= room, Rule::ShortTreelets, at + 63, || {
        (format!("at most {room} short treelets"), short.to_string())
    })?;
    let first_line = shape.treelet_line(object.profile);
    let holds = (1..=treelets).contains(&roots)
        && shape.fits(object.profile)
        && usize::from(header.treelet_line) == first_line;
    ensure(holds, Rule::PageShape, at + 56, || {
        let found = format!("{roots} roots, {remotes} links, {treelets} treelets, {short} of them short");
        (format!("treelets at line {first_line} and all within {PAGE} bytes"), found)
    })?;
    check_anchors(&page, number, object, at)?;
    check_codes(&page, at)?;
    check_links(&page, at)?;
    check_remotes(&page, number, object, at)?;
    check_nested_ends(&page, at)
}

/// The largest magnitude of a slab end: 2^122, more than the sum of three coordinates of at most 2^120.
const MAX_END: f32 = f32::from_bits((127 + 122) << 23);

fn check_anchors(page: &Page, number: u32, object: &Object, at: u64) -> Result<(), FormatError> {
    let slabs = object.profile.directions().slabs();
    for root in 0..page.header().roots {
        let at = at + anchor_at(object.profile, root.into()) as u64;
        let anchor = page.anchor(root);
        let ordered = (0..slabs).all(|slab| {
            let (lo, hi) = (anchor.slabs.lo[row(slab)], anchor.slabs.hi[row(slab)]);
            -MAX_END <= lo && lo <= hi && hi <= MAX_END
        });
        ensure(ordered, Rule::AnchorSlabs, at, || {
            ("lo <= hi, both within 2^122".into(), format!("{anchor:?}"))
        })?;
        let is_object_root = number == object.record.first_page.get() && root == 0;
        let parent = anchor.parent_page;
        let known = if is_object_root {
            parent == NO_PARENT && anchor.parent_link == 0
        } else {
            parent >= object.record.first_page.get() && parent < number
        };
        ensure(known, Rule::AnchorParent, at, || {
            ("a parent in an earlier page of the object".into(), parent.to_string())
        })?;
    }
    Ok(())
}

/// Checks that codes that are floats are finite, and that f16 codes move ends inward.
fn check_codes(page: &Page, at: u64) -> Result<(), FormatError> {
    let profile = page.profile();
    if !matches!(profile.encoding(), Encoding::F16 | Encoding::F32) {
        return Ok(());
    }
    for slot in 0..page.header().treelets {
        let treelet = page.treelet(slot);
        let at = at + page.treelet_at(slot) as u64;
        for child in 0..page.links(slot).children().min(profile.width()) {
            let places = CodePlaces::new(profile, treelet, child);
            for slab in 0..profile.directions().slabs() {
                let (code_lo, code_hi) = places.read(treelet, slab);
                let (lo, hi) = places.read_ends(treelet, slab);
                let finite = match profile.encoding() {
                    Encoding::F16 => code_lo <= F16_MAX_CODE && code_hi <= F16_MAX_CODE,
                    _ => lo.abs() <= MAX_END && hi.abs() <= MAX_END,
                };
                ensure(finite, Rule::Codes, at, || {
                    (
                        format!("finite codes for child {child}, slab {slab}"),
                        format!("{code_lo:#06x}, {code_hi:#06x}, {lo}, {hi}"),
                    )
                })?;
            }
        }
    }
    Ok(())
}

/// Checks the kinds and the numbering of children: each slot except those of the roots, each remote link and each packet
/// must be the child of exactly one treelet.
fn check_links(page: &Page, at: u64) -> Result<(), FormatError> {
    let header = page.header();
    let width = page.profile().width();
    let (mut treelets, mut remotes, mut packets) = (u32::from(header.roots), 0u32, 0u32);
    let full = u32::from(header.treelets - header.short);
    let mut short = full;
    for slot in 0..header.treelets {
        let at = at + page.treelet_at(slot) as u64;
        let (links, is_short) = (page.links(slot), page.is_short(slot));
        let children = links.children();
        let kinds = (1..=width).contains(&children) && links.kinds_are_known(children, is_short);
        ensure(kinds, Rule::ChildKinds, at, || {
            let sort = if is_short { "leaf packets" } else { "children" };
            (format!("1 to {width} {sort}, no gaps"), format!("kinds {:08x}", links.kinds))
        })?;
        let numbered = |rule, bits: u32, first: u32, expected: &mut u32| {
            let count = bits.count_ones();
            let found = first;
            let right = count == 0 || found == *expected;
            ensure(right, rule, at, || (format!("{expected} as the first of its kind"), found.to_string()))?;
            *expected += count;
            Ok::<(), FormatError>(())
        };
        let first = u32::from(links.first_treelet);
        ensure(links.treelets() == 0 || first > u32::from(slot), Rule::TreeletLinks, at, || {
            (format!("children in slots after {slot}"), first.to_string())
        })?;
        numbered(Rule::TreeletLinks, links.treelets(), first, &mut treelets)?;
        numbered(Rule::TreeletLinks, links.short_treelets(), links.first_short.into(), &mut short)?;
        numbered(Rule::RemoteLinks, links.remotes(), links.first_remote.into(), &mut remotes)?;
        numbered(Rule::LeafLinks, links.leaves(), links.first_leaf.into(), &mut packets)?;
    }
    require(Rule::TreeletLinks, at + 59, full, treelets)?;
    require(Rule::TreeletLinks, at + 59, u32::from(header.treelets), short)?;
    require(Rule::RemoteLinks, at + 60, u32::from(header.remotes), remotes)?;
    require(Rule::LeafLinks, at + 56, u32::from(header.packets.get()), packets)
}

fn check_remotes(page: &Page, number: u32, object: &Object, at: u64) -> Result<(), FormatError> {
    let end = u64::from(object.record.first_page.get()) + u64::from(object.record.pages.get());
    for link in 0..page.header().remotes {
        let target = page.remote(link).page();
        ensure(target > number && u64::from(target) < end, Rule::RemoteLinks, at, || {
            (format!("a page between {number} and {end}"), target.to_string())
        })?;
    }
    Ok(())
}

/// Checks that slabs which are stored as they are lie within those of their treelets. Codes cannot say anything else of slabs
/// that contain a triangle.
fn check_nested_ends(page: &Page, at: u64) -> Result<(), FormatError> {
    let profile = page.profile();
    if profile.encoding() != Encoding::F32 {
        return Ok(());
    }
    let set = profile.directions();
    decode_page(page, 1.0, |slot, child, parent, node| {
        let place = || format!("child {child} of slot {slot}");
        check_nested(parent, node, set.slabs(), place, at + page.treelet_at(slot) as u64)
    })
}

/// Checks that the slabs of a node lie within those of its parent. `place` names the node, and `at` is its byte in the file.
///
/// # Errors
/// Rule 49.
pub fn check_nested(
    parent: &NodeSlabs,
    node: &NodeSlabs,
    slabs: usize,
    place: impl FnOnce() -> String,
    at: u64,
) -> Result<(), FormatError> {
    let is_nested = |row| parent.lo[row] <= node.lo[row] && node.hi[row] <= parent.hi[row];
    let Some(beyond) = (0..slabs).map(row).position(|row| !is_nested(row)) else { return Ok(()) };
    let ends = |node: &NodeSlabs| format!("{:e} to {:e}", node.lo[row(beyond)], node.hi[row(beyond)]);
    let expected = format!("slab {beyond} of {} within {}", place(), ends(parent));
    Err(FormatError::new(Rule::Nested, at, expected, ends(node)))
}

/// Checks that a remote link and the root to which it leads name each other, and that the root's slabs lie within those
/// decoded for the child with that link. `link` is the page and the number of the link, and `slabs` are the decoded
/// slabs. The root is in page `target`, which is at byte `at` of the file.
///
/// # Errors
/// Rules 20 and 49.
pub fn check_crossing(
    target: &Page,
    to: RootRef,
    link: (u32, u8),
    slabs: &NodeSlabs,
    at: u64,
) -> Result<(), FormatError> {
    check_parent(target, to, link, at)?;
    let place = || format!("the anchor of root {}", to.root());
    let count = target.profile().directions().slabs();
    check_nested(slabs, &target.anchor_slabs(to.root()), count, place, at)
}

/// Checks that a remote link and the root to which it leads name each other, as [`check_crossing`] does.
///
/// # Errors
/// Rule 20.
#[inline]
pub fn check_parent(target: &Page, to: RootRef, link: (u32, u8), at: u64) -> Result<(), FormatError> {
    let found =
        if to.root() < target.header().roots { target.anchor_parent(to.root()) } else { (NO_PARENT, 0) };
    check_named_link(found, to, link, at)
}

/// Checks that the link that a root names, `found`, is the one that leads to it, as [`check_parent`] does.
///
/// # Errors
/// Rule 20.
#[inline]
pub fn check_named_link(
    found: (u32, u8),
    to: RootRef,
    (from, link): (u32, u8),
    at: u64,
) -> Result<(), FormatError> {
    ensure(found == (from, link), Rule::AnchorParent, at, || {
        (format!("root {} with parent {from}, link {link}", to.root()), format!("{found:?}"))
    })
}
