//! Writes the bounds of a file again, with any changes: anchors, slabs, turning slabs, the sphere and the unit of f16
//! residuals. Triangles and the shape of the tree stay as they are, so that where bounds become looser, answers must stay, too.

use crate::Random;
use crate::seal::{put, put_together, seal, section, take_apart};
use bvh_format::Layout;
use bvh_format::bounds::{Bound, Subtree, visit_bounds};
use bvh_format::kdop::Kdop;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::{ObjectRecord, write_objects};
use bvh_format::page::decode::decode_child;
use bvh_format::page::{PAGE, Page, PageWriter, RootRef, TightBound};
use bvh_format::profile::{Encoding, Profile};
use bvh_format::treelet::Child;
use bvh_format::turning::{DIRECTION_ROW, END_ROW};
use bvh_format::vertex::Vertices;
use std::collections::BTreeMap;
use zerocopy::IntoBytes;

/// A node whose bound is written.
pub struct Node {
    /// The page and the number of a subtree root; for other nodes, those of the root that they are below.
    pub root: (u32, u8),
    /// Whether it is a subtree root.
    pub is_root: bool,
    /// What must contain it: its parent or, for a root, the child that links to it. The root of the object has none.
    pub limit: Option<Kdop>,
}

/// Returns an end of a slab, upwards positive: the upper one, or the negated lower one.
pub fn end(bound: &Kdop, slab: usize, upper: bool) -> f32 {
    if upper { bound.hi[slab] } else { -bound.lo[slab] }
}

/// Moves an end of a slab outward to `to`, upwards positive, if that is further out.
pub fn widen(bound: &mut Kdop, slab: usize, upper: bool, to: f32) {
    let to = end(bound, slab, upper).max(to);
    if upper { bound.hi[slab] = to } else { bound.lo[slab] = -to }
}

/// Returns a file of the profile dop26-u8-wide without the turning slabs of its children, which zeros in their places stand for.
pub fn without_turning_slabs(file: &[u8]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for page in section(file, 2).step_by(PAGE) {
        let (line, treelets) = (usize::from(file[page + 61]), usize::from(file[page + 59]));
        for treelet in 0..treelets {
            let start = page + 64 * line + treelet * Profile::Dop26U8Wide.treelet_bytes();
            for row in [END_ROW, DIRECTION_ROW, 16 + END_ROW, 16 + DIRECTION_ROW] {
                bytes[start + 4 * row..start + 4 * row + 4].fill(0);
            }
        }
    }
    seal(&mut bytes);
    bytes
}

/// Returns the subtree roots of a file of one object that remote links lead to.
///
/// # Panics
/// Panics if the file breaks a rule that is checked when a file is opened.
pub fn remote_roots(bytes: &[u8]) -> Vec<(u32, u8)> {
    let layout = Layout::read(bytes).expect("a valid file");
    let profile = layout.objects[0].profile();
    let roots = |page: u32| {
        let bytes = layout.page_bytes(bytes, page).expect("a page");
        (0..Page::new(bytes, profile).header().roots).map(move |root| (page, root))
    };
    (0..layout.page_count()).flat_map(roots).skip(1).collect()
}

/// Returns the file with its record and then all of its bounds edited, and with correct checksums. The bounds given to `node`
/// are as tight as they can be. Ends beyond the parent are cut off where they are stored relative to it. Returns `None` if the
/// file is not one of a single valid object.
pub fn rewritten(
    bytes: &[u8],
    record: impl FnOnce(&mut ObjectRecord),
    mut node: impl FnMut(&Node, &mut TightBound),
) -> Option<Vec<u8>> {
    let layout = Layout::read(bytes).ok()?;
    let [object] = &layout.objects[..] else { return None };
    let (profile, slabs) = (object.profile(), object.profile().directions().slabs());
    let mut edited = *object.record();
    record(&mut edited);
    let scale = 2f32.powi(edited.f16_exponent.get());
    let mut sections = take_apart(bytes);
    sections[0].2 = write_objects(&[(object.name().to_owned(), edited)]);

    let pages = edited.pages.get();
    let page = |number: u32| Some(Page::new(layout.page_bytes(bytes, number)?, profile));
    let mut subtrees: BTreeMap<(u32, u8), Subtree> = BTreeMap::new();
    for number in (0..pages).rev() {
        let page = page(number)?;
        let below = |to: RootRef| subtrees.get(&(to.page(), to.root())).unwrap_or(Subtree::unknown());
        let block = layout.leaf_block(bytes, page.header());
        let found = visit_bounds(object, &page, block, below, |_| Ok(())).ok()?;
        subtrees.extend((0..).zip(found).map(|(root, subtree)| ((number, root), subtree)));
    }
    let subtree = |to: RootRef| subtrees.get(&(to.page(), to.root())).unwrap_or(Subtree::unknown());
    // The slabs decoded for the child that links to a root.
    let mut linking: BTreeMap<(u32, u8), Kdop> = BTreeMap::new();
    for number in 0..pages {
        let page = page(number)?;
        let (header, leaf_block) = (page.header(), layout.leaf_block(bytes, page.header()));
        let mut children = BTreeMap::new();
        let mut roots = Vec::new();
        visit_bounds(object, &page, leaf_block, subtree, |bound: Bound| {
            match bound.child {
                None => roots.push(*bound.tight),
                Some(child) => _ = children.insert((bound.slot, child), (*bound.tight, bound.turning)),
            }
            Ok(())
        })
        .ok()?;
        let mut writer = PageWriter::new(profile, scale, header.shape());
        // The bounds of the slots, and the roots that they are below.
        let mut given: BTreeMap<u8, (Kdop, u8)> = BTreeMap::new();
        for (root, kdop) in (0..).zip(roots) {
            let limit = linking.get(&(number, root)).copied();
            let mut bound = TightBound { kdop, turning: None };
            node(&Node { root: (number, root), is_root: true, limit }, &mut bound);
            let (parent, link) = page.anchor_parent(root);
            writer.root(&bound.kdop, (parent != u32::MAX).then_some((parent, link)));
            given.insert(root, (bound.kdop, root));
        }
        for slot in 0..header.treelets {
            writer.begin_treelet();
            let links = page.links(slot);
            for child in 0..links.children() {
                let (kdop, turning) = *children.get(&(slot, child))?;
                let (parent, root) = *given.get(&slot)?;
                let mut bound = TightBound { kdop, turning };
                node(&Node { root: (number, root), is_root: false, limit: Some(parent) }, &mut bound);
                if profile.encoding() != Encoding::F32 {
                    for slab in 0..slabs {
                        bound.kdop.hi[slab] = bound.kdop.hi[slab].min(parent.hi[slab]);
                        bound.kdop.lo[slab] = bound.kdop.lo[slab].max(parent.lo[slab]);
                    }
                }
                match links.child(child) {
                    Child::Treelet(below) => {
                        let is_short = below >= header.treelets - header.short;
                        if is_short {
                            writer.short_treelet(&bound)
                        } else {
                            writer.treelet(&bound)
                        }
                        given.insert(below, (bound.kdop, root));
                    }
                    Child::Remote(link) => writer.remote(&bound, page.remote(link)),
                    // The blocks stay, so any triangles do here.
                    Child::Leaf { triangles, .. } => {
                        writer.leaf(&bound, (0..triangles).map(|_| ([[0.0; 3]; 3], 0)))
                    }
                    Child::Empty => return None,
                }
            }
        }
        let mut written = writer.finish(object.triangle_encoding(), &Vertices::around([0.0; 3]), false).bytes;
        written[..64].copy_from_slice(header.as_bytes());
        // Decodes from the roots on, to learn what is decoded for remote children.
        let page = Page::new(&written, profile);
        let mut decoded: BTreeMap<u8, _> =
            (0..header.roots).map(|root| (root, page.anchor_slabs(root))).collect();
        for slot in 0..header.treelets {
            let links = page.links(slot);
            for child in 0..links.children() {
                let node = decode_child(profile, scale, page.treelet(slot), child, decoded.get(&slot)?);
                match links.child(child) {
                    Child::Treelet(below) => _ = decoded.insert(below, node),
                    Child::Remote(link) => {
                        let to = page.remote(link);
                        linking.insert((to.page(), to.root()), node.to_kdop(slabs));
                    }
                    _ => {}
                }
            }
        }
        let nodes = sections.iter_mut().find(|section| section.0 == 2)?;
        nodes.2[PAGE * number as usize..][..PAGE].copy_from_slice(&written[..]);
    }
    Some(put_together(&sections))
}

/// Moves the sphere's centre to `by` away along an axis, and makes the sphere larger by so much and a little more.
pub fn move_sphere(record: &mut ObjectRecord, axis: usize, by: f32) {
    let centre = record.sphere_centre[axis].get() + by;
    record.sphere_centre[axis] = centre.into();
    record.sphere_radius = ((record.sphere_radius.get() + centre.abs() + by.abs()) * 1.000001).into();
}

/// Fills the lanes of leaf packets that hold no triangle with a coordinate, and corrects the checksums. Only plain packets have
/// room for it; returns how many lanes were filled.
///
/// # Panics
/// Panics if the file breaks a rule that is checked when a file is opened.
pub fn fill_unused_lanes(bytes: &mut [u8], coordinate: f32) -> usize {
    let layout = Layout::read(bytes).expect("a valid file");
    if layout.objects[0].triangle_encoding() != TriangleEncoding::F32 {
        return 0;
    }
    let (profile, leaves) = (layout.objects[0].profile(), section(bytes, 3).start);
    let mut places = Vec::new();
    for page in 0..layout.page_count() {
        let page = Page::new(layout.page_bytes(bytes, page).expect("a page"), profile);
        let at = leaves + page.header().leaf_bytes().start;
        for (packet, triangles) in bvh_format::validate::packets(&page) {
            let lanes = (triangles..4).map(|lane| at + 144 * usize::from(packet) + 4 * lane);
            places.extend(lanes);
        }
    }
    for &place in &places {
        (0..9).for_each(|value| put(bytes, place + 16 * value, &coordinate.to_le_bytes()));
    }
    seal(bytes);
    places.len()
}

/// Returns a file of one object in which any bounds are looser by any factor, or `None` if the file is not one of a single
/// valid object.
pub fn loosened(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let layout = Layout::read(bytes).ok()?;
    let object = layout.objects.first()?;
    let (encoding, slabs) = (object.profile().encoding(), object.profile().directions().slabs());
    let record = object.record();
    let size =
        (0..3).fold(f32::MIN_POSITIVE, |size, k| size.max(record.box_hi[k].get() - record.box_lo[k].get()));
    // One end of so many is loose, of anchors and of children.
    let of_roots = [1, 2, 4, 26, 60][random.below(5)];
    let of_children = [1, 2, 4, 60, usize::MAX, usize::MAX][random.below(6)];
    let far = size * 2f32.powi(random.below(100) as i32 - 20);
    // Whether anchors of remote roots may exceed the child that links to them, and `f32` slabs their parents.
    let is_free = random.below(2) == 0;
    let sphere =
        (random.below(4) == 0).then(|| (size * 2f32.powi(random.below(60) as i32 - 20), random.below(3)));
    let exponent = if random.below(2) == 0 { random.below(24) as i32 } else { 0 };
    let edit = |record: &mut ObjectRecord| {
        if let Some((more, axis)) = sphere {
            record.sphere_radius = (record.sphere_radius.get() + more).min(1e30).into();
            record.sphere_centre[axis] = (record.sphere_centre[axis].get() + more / 4.0).min(1e30).into();
        }
        if encoding == Encoding::F16 {
            record.f16_exponent = (record.f16_exponent.get() + exponent).min(112).into();
        }
    };
    rewritten(bytes, edit, |node, bound| {
        let is_free = is_free && (node.is_root || encoding == Encoding::F32);
        let limit = node.limit.as_ref().filter(|_| !is_free);
        loosen(&mut bound.kdop, limit, slabs, far, if node.is_root { of_roots } else { of_children }, random);
        bound.turning = bound.turning.filter(|_| random.below(8) != 0).map(|mut slab| {
            let more = size * 2f32.powi(random.below(40) as i32 - 35);
            if random.below(of_children) == 0 {
                (slab.lo, slab.hi) = (slab.lo - more, slab.hi + more);
            }
            slab
        });
    })
}

/// Moves one end in `one_in` outward: anywhere up to the limit, or up to `far` outside.
fn loosen(
    bound: &mut Kdop,
    limit: Option<&Kdop>,
    slabs: usize,
    far: f32,
    one_in: usize,
    random: &mut Random,
) {
    const MOST: f32 = 1e35;
    for slab in 0..slabs {
        for upper in [false, true] {
            if random.below(one_in) != 0 {
                continue;
            }
            let now = end(bound, slab, upper);
            let share = [1.0, 1.0, 0.5, 2f32.powi(-(random.below(60) as i32))][random.below(4)];
            let to = limit.map_or((now + far).min(MOST), |limit| end(limit, slab, upper));
            widen(bound, slab, upper, if share == 1.0 { to } else { (now + (to - now) * share).min(to) });
        }
    }
}
