//! Caches opened nodes: a treelet is decoded once, however many partners its children meet.
//!
//! Each opened node remembers which of its children have been opened, so that finding one again is one load. Decoded
//! nodes do not depend on the pose, so they stay from one query to the next until there are many of them.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::cache::second_level_kib;
use crate::isa::{Isa, Lanes, Task};
use crate::traverse::decode::{Parent, decode_group};
use crate::traverse::node_filter::Reach;
use crate::traverse::stages::Stage;
use bvh_format::kdop::DirectionSet;
use bvh_format::object::Object;
use bvh_format::page::{Page, RootRef, check_crossing, check_parent};
use bvh_format::slabs::{Group, NodeSlabs};
use bvh_format::treelet::{Child, Links, child_slabs};
use bvh_format::turning::TurningCodes;
use bvh_format::{FormatError, Rule};

/// A child of an opened node: the number of the node and, in the lowest two bits, that of the child.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ChildRef(u32);

impl ChildRef {
    /// Stands for no child.
    pub(crate) const NONE: Self = Self(0);

    #[inline(always)]
    pub(crate) fn new(node: usize, child: usize) -> Self {
        Self((node as u32) << 2 | child as u32)
    }

    #[inline(always)]
    pub(crate) fn bits(self) -> u32 {
        self.0
    }

    /// Converts back from `bits`.
    #[inline(always)]
    pub(crate) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub(crate) fn node(self) -> usize {
        (self.0 >> 2) as usize
    }

    #[inline(always)]
    pub(crate) fn child(self) -> usize {
        (self.0 & 3) as usize
    }
}

/// Up to four children of a node, decoded. The others of a node of more than four are under the next number.
#[derive(Clone, Copy)]
pub(crate) struct CachedNode {
    pub(crate) group: Group,
    pub(crate) turning: TurningCodes,
    /// Where all children of the node are.
    links: Links,
    page: u32,
    /// The place of the first of these children among those of the node: 0 or 4.
    first: u8,
    /// Whether the next number has more children of the same node.
    pub(crate) continues: bool,
    /// The lanes of the children in tests of 16 pairs.
    pub(crate) lanes: ChildLanes,
}

/// What a walk asks first of a child.
#[derive(Clone, Copy)]
pub(crate) struct ChildInfo {
    /// The largest side of its box, in mesh units.
    pub(crate) extent: f32,
    /// The number of its opened node, or `CLOSED`; of a leaf packet, `LEAF` with the number of the packet in the lowest bits,
    /// and how many triangles it has above.
    opened: u32,
}

/// Stands for the number of a node that has not been opened.
const CLOSED: u32 = LEAF - 1;
/// The lowest of what stands for leaf packets.
const LEAF: u32 = 1 << 31;
/// How many bits the number of a packet takes.
const PACKET_BITS: u32 = 16;

impl ChildInfo {
    const NONE: Self = Self { extent: 0.0, opened: CLOSED };

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.opened >= LEAF
    }
}

/// The lanes in which four children take part in a test of 16 pairs: as children of A, and as children of B.
#[derive(Clone, Copy)]
pub(crate) struct ChildLanes {
    /// Of all children.
    pub(crate) all: [u16; 2],
    /// Of leaf packets.
    pub(crate) leaves: [u16; 2],
}

impl ChildLanes {
    const NONE: Self = Self { all: [0; 2], leaves: [0; 2] };

    /// `children` and `leaves` have a bit for each of four children.
    #[inline(always)]
    fn new(children: u16, leaves: u16) -> Self {
        let lanes = |bits: u16| [ROWS_OF_LANES[usize::from(bits & 15)], 0x1111 * bits];
        Self { all: lanes(children), leaves: lanes(leaves) }
    }
}

/// For the bits of four rows, the bits of the four lanes of each row.
static ROWS_OF_LANES: [u16; 16] = {
    let mut lanes = [0; 16];
    let mut at: usize = 0;
    while at < 64 {
        let bit = (((at / 4) >> (at % 4)) & 1) as u16;
        lanes[at / 4] |= (bit * 0xf) << (4 * (at % 4));
        at += 1;
    }
    lanes
};

impl CachedNode {
    const EMPTY: Self = Self {
        group: Group::ZERO,
        turning: TurningCodes::NONE,
        links: Links::NONE,
        page: 0,
        first: 0,
        continues: false,
        lanes: ChildLanes::NONE,
    };

    /// Adopts the children of a treelet from `first` on, whose slabs have been decoded.
    #[inline(always)]
    fn adopt<I: Isa>(
        &mut self,
        isa: I,
        (opened, count): (&Opened<'_>, usize),
        first: usize,
        infos: &mut [ChildInfo],
    ) {
        (self.links, self.page) = (opened.links, opened.page.header().page_number.get());
        (self.first, self.continues) = (first as u8, first + 4 < count);
        let children = (1u16 << count.saturating_sub(first).min(4)) - 1;
        let leaves = leaf_lanes(&self.links, first / 4);
        self.lanes = ChildLanes::new(children, leaves);
        let (rows, mut extents) = (self.group.rows(), [0.0; 4]);
        let mut widest = isa.load4(&rows[16]).sub(isa.load4(&rows[0]));
        for axis in 1..3 {
            widest = widest.max(isa.load4(&rows[16 + axis]).sub(isa.load4(&rows[axis])));
        }
        isa.store4(widest, &mut extents);
        for (child, info) in infos.iter_mut().enumerate() {
            let (packet, triangles) = self.links.packet(first + child);
            let leaf = LEAF | u32::from(triangles) << PACKET_BITS | u32::from(packet);
            let opened = if leaves >> child & 1 == 1 { leaf } else { CLOSED };
            *info = ChildInfo { extent: extents[child & 3], opened };
        }
    }
}

/// Returns a child, if it is a leaf packet.
#[inline(always)]
pub(super) fn leaf_at(links: &Links, page: u32, child: usize) -> Option<LeafPacket> {
    match links.child(child) {
        Child::Leaf { packet, triangles } => Some(LeafPacket { page, packet, triangles }),
        _ => None,
    }
}

/// Returns a bit for each of four children, set for leaf packets.
#[inline(always)]
pub(super) fn leaf_lanes(links: &Links, part: usize) -> u16 {
    // Every fourth bit, brought together: the product has them side by side, from the twelfth on.
    let kinds = links.kinds >> (16 * (part & 1) + 2) & 0x1111;
    ((kinds * 0x1248) >> 12 & 0xf) as u16
}

/// The opened nodes of all objects that were walked lately, of whichever side. Above the root of each object is a node with the
/// root as its only child. Node 0 stands for none.
#[derive(Default)]
pub(crate) struct NodeCache {
    nodes: Vec<CachedNode>,
    /// By `ChildRef`: four for each node.
    children: Vec<ChildInfo>,
    used: usize,
    /// With more nodes than this, the next walk starts anew.
    kept: usize,
    /// How often the cache has started anew.
    generation: u64,
    /// The objects whose nodes these are. An object is in one of a few places, which follow from its file and page.
    roots: [Root; ROOTS],
}

/// An object that is walked.
#[derive(Clone, Copy, Default)]
pub(crate) struct Root {
    /// The file and the first page of the object.
    of: (u64, u32),
    /// When the node was made: of another generation it is gone. 0 stands for none.
    generation: u64,
    /// The node above the root.
    pub(crate) node: usize,
    /// Bounds on all nodes of the object.
    pub(crate) reach: Reach,
}

impl Root {
    /// Returns the object's root.
    #[inline(always)]
    pub(crate) fn child(&self) -> ChildRef {
        ChildRef::new(self.node, 0)
    }
}

/// More treelets than a page has by rule 17: its header and one anchor take two of its 64 lines, and a short treelet
/// takes half a line.
const MAX_TREELETS_PER_PAGE: usize = 124;
/// The most numbers of nodes in the cache, fewer than a `ChildRef` has bits for. So many take 320 GB.
const MAX_NODES: usize = 1 << 29;
/// The most objects whose roots are found again.
const ROOTS: usize = 32;
/// The places in which an object may be, one after another. With one place, a pair of objects that share it would never find its nodes.
const PLACES: usize = 4;

/// With more nodes than this, the next walk starts anew; more are kept by and by. What a walk reads of a node with four children takes 600 bytes.
const KEPT_AT_FIRST: usize = 256;

/// The most nodes with which a walk starts: one for each KiB of the second-level cache, of which more than 2 MiB are not needed.
#[inline(always)]
fn most_kept() -> usize {
    second_level_kib().min(2048)
}

impl NodeCache {
    /// Starts a walk. Nodes stay from the walks before, unless there are many.
    #[inline(always)]
    pub(crate) fn start(&mut self) {
        if self.used > self.kept || self.used == 0 {
            self.start_anew();
        }
    }

    /// Forgets all nodes. Memory that is touched first takes long, so only a cache that is used for long becomes large.
    #[cold]
    fn start_anew(&mut self) {
        self.kept = (self.kept + self.kept / 16).clamp(KEPT_AT_FIRST.min(most_kept()), most_kept());
        self.generation += 1;
        self.used = 1;
    }

    /// Returns the root of an object.
    #[inline(always)]
    pub(crate) fn root<I: Isa>(&mut self, isa: I, bvh: &Bvh, object: &Object) -> Result<Root, QueryError> {
        let of = (bvh.identity(), object.record().first_page.get());
        for place in places_of(of) {
            let known = &self.roots[place];
            if known.of == of && known.generation == self.generation {
                return Ok(*known);
            }
        }
        self.make_root(isa, bvh, object, of)
    }

    #[inline(never)]
    fn make_root<I: Isa>(
        &mut self,
        isa: I,
        bvh: &Bvh,
        object: &Object,
        of: (u64, u32),
    ) -> Result<Root, QueryError> {
        let slabs = bvh.page(object, of.1)?.anchor_slabs(0);
        let node = self.room(bvh, object)?;
        let above = &mut self.nodes[node];
        *above = CachedNode {
            group: isa.run(Spread(&slabs)),
            links: Links { kinds: 1, ..Links::NONE },
            page: of.1,
            lanes: ChildLanes::new(1, 0),
            ..CachedNode::EMPTY
        };
        self.children[4 * node] = ChildInfo { extent: f32::INFINITY, opened: CLOSED };
        self.used = node + 1;
        let root = Root { of, generation: self.generation, node, reach: Reach::of(&slabs) };
        let mut places = places_of(of);
        // If all are taken, the first one gives way.
        let place = places.find(|&place| self.roots[place].generation != self.generation);
        self.roots[place.unwrap_or(place_of(of))] = root;
        Ok(root)
    }

    /// Returns the number of the next node, for which there is room, and for the next number.
    #[inline(always)]
    fn room(&mut self, bvh: &Bvh, object: &Object) -> Result<usize, QueryError> {
        if self.used + 1 >= self.nodes.len() {
            if self.used + 1 >= MAX_NODES {
                return Err(too_many(bvh, object, MAX_NODES));
            }
            // Not many at once, because filling them takes time in the middle of a query.
            self.nodes.resize(self.used + 64, CachedNode::EMPTY);
            self.children.resize(4 * self.nodes.len(), ChildInfo::NONE);
        }
        Ok(self.used)
    }

    /// Returns a number that changes whenever the cache starts anew, and numbers stand for other nodes.
    pub(crate) fn generation(&self) -> u64 {
        self.generation
    }

    #[inline(always)]
    pub(crate) fn get(&self, node: usize) -> &CachedNode {
        &self.nodes[node]
    }

    /// Returns what a walk asks first of a child.
    #[inline(always)]
    pub(crate) fn child(&self, at: ChildRef) -> ChildInfo {
        self.children[at.bits() as usize]
    }

    /// Returns the first number of a child's node, and the child's place among all children of the node.
    #[cfg(feature = "trace")]
    pub(crate) fn place_in_treelet(&self, at: ChildRef) -> (usize, usize) {
        let first = usize::from(self.nodes[at.node()].first);
        (at.node() - first / 4, first + at.child())
    }

    /// Returns a child, if it is a leaf packet.
    #[inline(always)]
    pub(crate) fn leaf(&self, at: ChildRef) -> Option<LeafPacket> {
        let opened = self.child(at).opened;
        let (packet, triangles) = (opened as u16, (opened >> PACKET_BITS) as u8);
        let page = self.nodes[at.node()].page;
        (opened >= LEAF).then_some(LeafPacket { page, packet, triangles })
    }

    /// Returns the number of the opened node of an inner child. For a leaf that is a node without children. `left` is the
    /// number of nodes that the walk may still add for the object: by the rules of the format, it never needs more than the
    /// object can have, and with this limit every walk ends, even if the bytes change after they were checked.
    #[inline(always)]
    pub(crate) fn open<I: Isa>(
        &mut self,
        isa: I,
        bvh: &Bvh,
        object: &Object,
        at: ChildRef,
        left: &mut usize,
    ) -> Result<usize, QueryError> {
        let known = self.child(at).opened;
        if known < CLOSED {
            return Ok(known as usize);
        }
        let _stage = Stage::Decode.enter();
        *left = left.checked_sub(1).ok_or_else(|| too_many(bvh, object, max_nodes(object)))?;
        let number = self.room(bvh, object)?;
        let (before, behind) = self.nodes.split_at_mut(number);
        let (parent, infos) = (&before[at.node()], &mut self.children[4 * number..]);
        let parts = isa.run(DecodeNode { bvh, object, parent, child: at.child(), to: behind, infos })?;
        self.children[at.bits() as usize].opened = number as u32;
        self.used += parts;
        Ok(number)
    }
}

/// Returns the first place in which an object may be among the roots.
#[inline(always)]
fn place_of((file, page): (u64, u32)) -> usize {
    (file.wrapping_mul(37) as usize).wrapping_add(page as usize) % ROOTS
}

/// Returns all places in which an object may be.
#[inline(always)]
fn places_of(of: (u64, u32)) -> impl Iterator<Item = usize> {
    let first = place_of(of);
    (0..PLACES).map(move |next| (first + next) % ROOTS)
}

/// Returns the number of treelets that an object can have.
#[inline(always)]
pub(super) fn max_nodes(object: &Object) -> usize {
    let pages = object.record().pages.get() as usize;
    pages.saturating_mul(MAX_TREELETS_PER_PAGE).min(MAX_NODES)
}

#[cold]
pub(super) fn too_many(bvh: &Bvh, object: &Object, max_nodes: usize) -> QueryError {
    let at = bvh.layout().page_offset(object.record().first_page.get());
    let expected = format!("at most {max_nodes} treelets to open");
    FormatError::new(Rule::Counts, at, expected, "more").into()
}

/// Spreads the slabs of a root to a group.
struct Spread<'a>(&'a NodeSlabs);

impl Task for Spread<'_> {
    type Output = Group;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Group {
        spread(isa, self.0)
    }
}

/// Decodes an inner child of an opened node. Returns how many numbers it takes.
struct DecodeNode<'a> {
    bvh: &'a Bvh,
    object: &'a Object,
    parent: &'a CachedNode,
    child: usize,
    to: &'a mut [CachedNode],
    infos: &'a mut [ChildInfo],
}

impl Task for DecodeNode<'_> {
    type Output = Result<usize, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { bvh, object, parent, child, to: [to, next, ..], infos } = self else { return Ok(1) };
        let from = (&parent.group, child, &parent.links, parent.page);
        let place = usize::from(parent.first) + child;
        let Some(opened) = open_child(isa, (bvh, object), from, place, [&mut to.group, &mut next.group])?
        else {
            (to.continues, to.lanes) = (false, ChildLanes::NONE);
            return Ok(1);
        };
        let profile = object.profile();
        to.turning = match opened.treelet.first_chunk() {
            Some(treelet) if profile.has_turning_slabs() => TurningCodes::read(treelet),
            _ => TurningCodes::NONE,
        };
        isa.prefetch::<10>(bvh.packets_to_prefetch(object, &opened.page, &opened.links));
        if bvh.is_worth_prefetching() {
            for treelets in opened.page.treelets_ahead(&opened.links) {
                isa.prefetch::<8>(treelets);
            }
        }
        let count = opened.links.children().min(profile.width());
        let (first, second) = infos.split_at_mut(4);
        to.adopt(isa, (&opened, count), 0, first);
        if count > 4 {
            next.turning = TurningCodes::NONE;
            next.adopt(isa, (&opened, count), 4, &mut second[..4]);
        }
        Ok(1 + usize::from(to.continues))
    }
}

/// What an opened node has besides slabs.
pub(super) struct Opened<'a> {
    pub(super) links: Links,
    pub(super) page: Page<'a>,
    pub(super) treelet: &'a [u8],
}

/// Decodes the slabs of the children of an inner child, given the slabs of four siblings and its column of them, the links of
/// all siblings, their page, and its place among them. A leaf or an empty place has nothing to open.
#[inline(always)]
pub(super) fn open_child<'a, I: Isa>(
    isa: I,
    (bvh, object): (&'a Bvh, &Object),
    (group, column, links, page): (&Group, usize, &Links, u32),
    child: usize,
    to: [&mut Group; 2],
) -> Result<Option<Opened<'a>>, QueryError> {
    let (at, slot, anchor);
    let decoded = (group, column);
    let parent = match links.child(child) {
        Child::Treelet(place) => {
            at = bvh.page(object, page)?;
            slot = place;
            Parent::Node(group, column)
        }
        Child::Remote(link) => {
            (at, slot) = cross(bvh, object, page, link)?;
            anchor = at.anchor_slabs(slot);
            if !is_nested(isa, object.profile().directions(), decoded, &anchor) {
                refuse(bvh, (page, link), decoded, &at, slot)?;
            }
            Parent::Anchor(&anchor)
        }
        Child::Leaf { .. } | Child::Empty => return Ok(None),
    };
    let profile = object.profile();
    let treelet = at.treelet(slot);
    let links = Links::read(profile, treelet);
    for (part, to) in to.into_iter().enumerate().take(profile.groups()) {
        let coding = (profile, object.f16_scale());
        decode_group(isa, coding, (treelet, part), parent, to);
    }
    Ok(Some(Opened { links, page: at, treelet }))
}

/// Returns the page and the root that a remote link leads to, after checking that link and root name each other.
#[inline(always)]
fn cross<'a>(bvh: &'a Bvh, object: &Object, from: u32, link: u8) -> Result<(Page<'a>, u8), QueryError> {
    let to = bvh.page(object, from)?.remote(link);
    let page = bvh.page(object, to.page())?;
    check_parent(&page, to, (from, link), bvh.layout().page_offset(to.page()))?;
    Ok((page, to.root()))
}

/// Returns whether the slabs of an anchor lie within those of a column: rule 49. Roundings in all nodes are charged by the
/// magnitudes of the object's root, which bound those of all nodes only because of this rule.
#[inline(always)]
fn is_nested<I: Isa>(
    isa: I,
    set: DirectionSet,
    (group, column): (&Group, usize),
    anchor: &NodeSlabs,
) -> bool {
    // A bit for each lane of a row with a slab, by register.
    let rows_with_slabs: &[u16] = match set {
        DirectionSet::Dop6 => &[0x0fff],
        DirectionSet::Dop14 => &[0xffff, 0x0fff],
        DirectionSet::Dop26 => &[0xffff, 0x0fff, 0xffff, 0x00ff],
    };
    let mut beyond = 0;
    for (q, &rows) in rows_with_slabs.iter().enumerate() {
        let (lo, hi) = Parent::Node(group, column).ends(isa, q);
        let (anchor_lo, anchor_hi) = Parent::Anchor(anchor).ends(isa, q);
        // False for NaN, which a forged file may decode to.
        beyond |= !(I::V::bits(lo.le(anchor_lo)) & I::V::bits(anchor_hi.le(hi))) & rows;
    }
    beyond == 0
}

/// Returns the error of the reference check, which names what the anchor of a forged file breaks.
#[cold]
fn refuse(
    bvh: &Bvh,
    link: (u32, u8),
    (decoded, column): (&Group, usize),
    page: &Page,
    root: u8,
) -> Result<(), QueryError> {
    let number = page.header().page_number.get();
    let (to, slabs) = (RootRef::new(number, root), child_slabs(decoded, column));
    Ok(check_crossing(page, to, link, &slabs, bvh.layout().page_offset(number))?)
}

/// Returns a group with the same node in all four columns.
#[inline(always)]
pub(super) fn spread<I: Isa>(isa: I, node: &NodeSlabs) -> Group {
    let mut group = Group::ZERO;
    let (lo, hi) = (node.lo.as_chunks::<4>().0, node.hi.as_chunks::<4>().0);
    for q in 0..4 {
        isa.store(isa.repeat(&lo[q]), &mut group.lo[q]);
        isa.store(isa.repeat(&hi[q]), &mut group.hi[q]);
    }
    group
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::{Backend, Task};

    struct OpenRoot<'a>(&'a Bvh, &'a mut NodeCache, usize);

    impl Task for OpenRoot<'_> {
        type Output = Result<usize, QueryError>;

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) -> Self::Output {
            let Self(bvh, nodes, mut left) = self;
            let object = &bvh.objects()[0];
            nodes.start();
            let root = nodes.root(isa, bvh, object)?;
            nodes.open(isa, bvh, object, root.child(), &mut left)
        }
    }

    /// No file that keeps the rules gets so far: the limit is for bytes that change after they were checked.
    #[test]
    fn no_more_nodes_are_opened_than_the_pages_can_hold() {
        let bytes = include_bytes!("../../../testdata/ok-plain.cbvh");
        let bvh = Bvh::from_static(bytes).unwrap();
        assert_eq!(max_nodes(&bvh.objects()[0]), 124);
        let mut nodes = NodeCache::default();
        let refused = Backend::Scalar.run(OpenRoot(&bvh, &mut nodes, 0)).unwrap_err();
        assert!(matches!(refused, QueryError::Damaged(error) if error.rule == Rule::Counts));
        assert_eq!(Backend::Scalar.run(OpenRoot(&bvh, &mut nodes, 1)), Ok(2));
    }

    #[test]
    fn nodes_of_several_files_stay_until_there_are_many() {
        let bytes = include_bytes!("../../../testdata/ok-plain.cbvh");
        let files = [Bvh::from_static(bytes).unwrap(), Bvh::from_static(bytes).unwrap()];
        let mut nodes = NodeCache::default();
        // Node 0 is none, and each file has a node above its root.
        for expected in [2, 4] {
            let bvh = &files[expected / 4];
            // A node that is known is not opened again.
            for left in [1, 0] {
                assert_eq!(Backend::Scalar.run(OpenRoot(bvh, &mut nodes, left)), Ok(expected));
            }
        }
        assert_eq!((nodes.used, nodes.generation()), (5, 1));
        nodes.used = nodes.kept + 1;
        assert_eq!(Backend::Scalar.run(OpenRoot(&files[1], &mut nodes, 1)), Ok(2));
        assert_eq!((nodes.used, nodes.generation()), (3, 2));
        assert_eq!(Backend::Scalar.run(OpenRoot(&files[0], &mut nodes, 1)), Ok(4));
    }

    #[test]
    fn objects_that_share_a_place_are_both_found_again() {
        let bytes = include_bytes!("../../../testdata/ok-plain.cbvh");
        let files: Vec<_> = (0..2 * ROOTS).map(|_| Bvh::from_static(bytes).unwrap()).collect();
        let place = |bvh: &Bvh| place_of((bvh.identity(), bvh.objects()[0].record().first_page.get()));
        let (shared, mut nodes) = (place(&files[0]), NodeCache::default());
        let sharing: Vec<_> = files.iter().filter(|bvh| place(bvh) == shared).take(PLACES).collect();
        assert!(sharing.len() > 1);
        for left in [1, 0] {
            for bvh in &sharing {
                assert!(Backend::Scalar.run(OpenRoot(bvh, &mut nodes, left)).is_ok());
            }
        }
    }
}
