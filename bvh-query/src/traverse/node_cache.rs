//! Caches opened nodes: a treelet is decoded once, however many partners its children meet.
//!
//! Each opened node remembers which of its children have been opened, so that finding one again is one load. Decoded
//! nodes do not depend on the pose, so they stay from one query to the next until there are many of them.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::Isa;
use crate::isa::cache::second_level_kib;
use crate::traverse::cached_node::{CachedNode, ChildInfo, ChildRef, DecodeNode, Spread};
use crate::traverse::node_filter::Reach;
use bvh_format::object::Object;
use bvh_format::{FormatError, Rule};

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
        *above = CachedNode::above(isa.run(Spread(&slabs)), of.1);
        self.children[4 * node] = ChildInfo::ROOT;
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
    #[cfg(feature = "__trace")]
    pub(crate) fn place_in_treelet(&self, at: ChildRef) -> (usize, usize) {
        let place = self.nodes[at.node()].place(at);
        (at.node() - place / 4, place)
    }

    /// Returns a child, if it is a leaf packet.
    #[inline(always)]
    pub(crate) fn leaf(&self, at: ChildRef) -> Option<LeafPacket> {
        self.child(at).leaf(self.nodes[at.node()].page)
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
        if let Some(known) = self.child(at).opened() {
            return Ok(known);
        }
        *left = left.checked_sub(1).ok_or_else(|| too_many(bvh, object, max_nodes(object)))?;
        let number = self.room(bvh, object)?;
        let (before, behind) = self.nodes.split_at_mut(number);
        let (parent, infos) = (&before[at.node()], &mut self.children[4 * number..]);
        let parts = isa.run(DecodeNode { bvh, object, parent, child: at, to: behind, infos })?;
        self.children[at.bits() as usize].open(number);
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
