//! Forges files that keep every rule but have loose bounds: anchors, slabs, turning slabs, the box, the sphere and the unit
//! of f16 residuals, each larger than what it contains by any factor. Triangles and the shape of the tree stay as they are,
//! so answers must stay, too.

use bvh_format::Layout;
use bvh_format::bounds::{Bound, Subtree, visit_bounds};
use bvh_format::decode::decode_child;
use bvh_format::kdop::Kdop;
use bvh_format::object::write_objects;
use bvh_format::page::{Page, PageWriter, RootRef, TightBound};
use bvh_format::profile::Encoding;
use bvh_format::treelet::Child;
use cbvh_testkit::Random;
use cbvh_testkit::seal::{put_together, take_apart};
use std::collections::BTreeMap;
use zerocopy::IntoBytes;

const PAGE: usize = 4096;

/// How much looser ends become.
struct Looseness {
    /// One end of so many is loose, of anchors and of children.
    one_in: [usize; 2],
    /// How far ends of anchors may lie outside, as a power of two of the size of the object.
    power: i32,
    /// Whether anchors of remote roots may exceed the child that links to them, and `f32` slabs their parents.
    is_free: bool,
}

/// Returns a file of one object with looser bounds, or `None` if the file is not one of a single valid object.
pub(super) fn loosened(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let layout = Layout::read(bytes).ok()?;
    let [object] = &layout.objects[..] else { return None };
    let (profile, slabs) = (object.profile(), object.profile().directions().slabs());
    let mut record = *object.record();
    let size =
        (0..3).fold(f32::MIN_POSITIVE, |size, k| size.max(record.box_hi[k].get() - record.box_lo[k].get()));
    let looseness = Looseness {
        one_in: [[1, 2, 4, 26, 60][random.below(5)], [1, 2, 4, 60, usize::MAX, usize::MAX][random.below(6)]],
        power: random.below(100) as i32 - 20,
        is_free: random.below(2) == 0,
    };
    let mut sections = take_apart(bytes);
    if random.below(4) == 0 {
        let more = size * 2f32.powi(random.below(60) as i32 - 20);
        record.sphere_radius = (record.sphere_radius.get() + more).min(1e30).into();
        let axis = random.below(3);
        record.sphere_centre[axis] = (record.sphere_centre[axis].get() + more / 4.0).min(1e30).into();
    }
    if profile.encoding() == Encoding::F16 && random.below(2) == 0 {
        let exponent = (record.f16_exponent.get() + random.below(24) as i32).min(112);
        record.f16_exponent = exponent.into();
    }
    let scale = 2f32.powi(record.f16_exponent.get());
    sections[0].2 = write_objects(&[(object.name().to_owned(), record)]);

    let pages = record.pages.get();
    let page = |number: u32| Some(Page::new(layout.page_bytes(bytes, number)?, profile));
    let below = subtrees(&layout, bytes, pages)?;
    let subtree = |to: RootRef| below.get(&(to.page(), to.root())).unwrap_or(Subtree::unknown());
    // The slabs decoded for the child that links to a root.
    let mut linking: BTreeMap<(u32, u8), Kdop> = BTreeMap::new();
    for number in 0..pages {
        let page = page(number)?;
        let (header, leaf_block) = (page.header(), layout.leaf_block(bytes, page.header()));
        let mut children = BTreeMap::new();
        let mut roots = Vec::new();
        visit_bounds(object, &page, leaf_block, subtree, |bound: Bound| {
            match bound.child {
                None => roots.push(bound.tight),
                Some(child) => _ = children.insert((bound.slot, child), (bound.tight, bound.turning)),
            }
            Ok(())
        })
        .ok()?;
        let mut writer = PageWriter::new(profile, scale, header.shape());
        let mut given: BTreeMap<u8, Kdop> = BTreeMap::new();
        for (root, tight) in (0..).zip(&roots) {
            let limit = linking.get(&(number, root)).filter(|_| !looseness.is_free);
            let far = size * 2f32.powi(looseness.power);
            let anchor = looser(tight, limit, slabs, far, looseness.one_in[0], random);
            let (parent, link) = page.anchor_parent(root);
            writer.root(&anchor, (parent != u32::MAX).then_some((parent, link)));
            given.insert(root, anchor);
        }
        for slot in 0..header.treelets {
            writer.begin_treelet();
            let links = page.links(slot);
            for child in 0..links.children() {
                let (tight, turning) = children.get(&(slot, child))?;
                let limit = given.get(&slot).copied();
                let is_free = looseness.is_free && profile.encoding() == Encoding::F32;
                let limit = limit.as_ref().filter(|_| !is_free);
                let far = size * 2f32.powi(looseness.power);
                let kdop = looser(tight, limit, slabs, far, looseness.one_in[1], random);
                let turning = turning.filter(|_| random.below(8) != 0).map(|mut slab| {
                    let more = size * 2f32.powi(random.below(40) as i32 - 35);
                    if random.below(looseness.one_in[1]) == 0 {
                        (slab.lo, slab.hi) = (slab.lo - more, slab.hi + more);
                    }
                    slab
                });
                let bound = TightBound { kdop, turning };
                match links.child(child) {
                    Child::Treelet(below) if below >= header.treelets - header.short => {
                        writer.short_treelet(&bound);
                        given.insert(below, kdop);
                    }
                    Child::Treelet(below) => {
                        writer.treelet(&bound);
                        given.insert(below, kdop);
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
        let mut written = writer.finish(object.triangle_encoding(), false).bytes;
        written[..64].copy_from_slice(header.as_bytes());
        let page = Page::new(&written, profile);
        // Decodes from the roots on, to learn what is decoded for remote children.
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

/// Returns all subtrees of an object by page and root.
fn subtrees(layout: &Layout, bytes: &[u8], pages: u32) -> Option<BTreeMap<(u32, u8), Subtree>> {
    let object = &layout.objects[0];
    let mut subtrees: BTreeMap<(u32, u8), Subtree> = BTreeMap::new();
    for number in (0..pages).rev() {
        let page = Page::new(layout.page_bytes(bytes, number)?, object.profile());
        let below = |to: RootRef| subtrees.get(&(to.page(), to.root())).unwrap_or(Subtree::unknown());
        let block = layout.leaf_block(bytes, page.header());
        let found = visit_bounds(object, &page, block, below, |_| Ok(())).ok()?;
        subtrees.extend((0..).zip(found).map(|(root, subtree)| ((number, root), subtree)));
    }
    Some(subtrees)
}

/// Returns a bound around a tight one. Its ends are tight, or anywhere up to the limit, or up to `far` outside.
fn looser(
    tight: &Kdop,
    limit: Option<&Kdop>,
    slabs: usize,
    far: f32,
    one_in: usize,
    random: &mut Random,
) -> Kdop {
    const MOST: f32 = 1e35;
    let mut bound = *tight;
    for slab in 0..slabs {
        for is_high in [false, true] {
            if random.below(one_in) != 0 {
                continue;
            }
            let end = if is_high { bound.hi[slab] } else { -bound.lo[slab] };
            let share = [1.0, 1.0, 0.5, 2f32.powi(-(random.below(60) as i32))][random.below(4)];
            let to = match limit {
                Some(limit) if is_high => limit.hi[slab],
                Some(limit) => -limit.lo[slab],
                None => (end + far).min(MOST),
            };
            let moved = if share == 1.0 { to } else { (end + (to - end) * share).min(to) };
            let moved = moved.max(end);
            if is_high { bound.hi[slab] = moved } else { bound.lo[slab] = -moved }
        }
    }
    bound
}
