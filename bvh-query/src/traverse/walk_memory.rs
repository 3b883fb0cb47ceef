//! The memory of walks, kept from one query to the next, and the budget of a query.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::traverse::frames::Frames;
use crate::traverse::large_leaf::LargeLeaves;
use crate::traverse::leaf_pairs::LeafPairs;
use crate::traverse::node_cache::NodeCache;
use crate::traverse::node_filter::NodeFilter;
use crate::traverse::probe_walk::{ProbeStack, ProbeVisitor, ProbeWalk};
use crate::traverse::slab_memory::SlabMemory;
use bvh_format::object::Object;
use bvh_format::slabs::Group;

/// The number of visits that a look ahead may make beyond those of the query: they cost less than finding out whether
/// they pay.
const EXTRA_LOOK_AHEAD_VISITS: u64 = 8;

/// What walks need, and how many visits are left to a query.
#[derive(Default)]
pub(crate) struct WalkMemory {
    /// Taken out while a walk is under way.
    pub(super) node_filter: Option<Box<NodeFilter>>,
    pub(super) nodes_a: NodeCache,
    pub(super) nodes_b: NodeCache,
    /// The groups of A's opened nodes along B's directions, computed when they are first needed.
    pub(super) aligned_a: Aligned,
    /// The groups of B's opened nodes along A's directions.
    pub(super) aligned_b: Aligned,
    /// The test along turning slabs.
    pub(super) slabs: SlabMemory,
    /// Depth-first: the pairs that node tests left.
    pub(super) stack: Frames,
    /// Depth-first: pairs of leaf packets, visited several at a time in the order in which they came.
    pub(super) leaf_pairs: LeafPairs,
    /// Best-first: the entry of least bound is next.
    pub(super) list: Frames,
    pub(super) large_leaves: LargeLeaves,
    probes: ProbeStack,
    budget: Budget,
}

/// The visits of a query.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Budget {
    /// What errors name: the budget of the question that the query is part of.
    visits: u64,
    /// How many visits the query may make, and how many of them are left.
    given: u64,
    left: u64,
}

impl Budget {
    /// The budget of a query that is a question of its own.
    pub(crate) fn new(visits: u64) -> Self {
        Self { visits, given: visits, left: visits }
    }

    /// What is `left` to the next query of a question that has more than one.
    pub(crate) fn rest(self, left: u64) -> Self {
        Self { given: left, left, ..self }
    }

    /// Returns the number of visits that are left.
    pub(crate) fn left(&self) -> u64 {
        self.left
    }

    /// Returns the number of visits that have been made.
    pub(crate) fn made(&self) -> u64 {
        self.given - self.left
    }

    /// Returns the error of a query that needs more visits than are left.
    #[cold]
    pub(crate) fn error(&self) -> QueryError {
        QueryError::Budget { visits: self.visits }
    }

    /// Counts a visit.
    #[inline(always)]
    pub(crate) fn visit(&mut self) -> Result<(), QueryError> {
        self.charge(1)
    }

    /// Counts some visits. If they are more than are left, none are left.
    #[inline(always)]
    pub(crate) fn charge(&mut self, visits: u64) -> Result<(), QueryError> {
        match self.left.checked_sub(visits) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => {
                self.left = 0;
                Err(self.error())
            }
        }
    }
}

impl WalkMemory {
    /// Starts a query.
    pub(crate) fn start(&mut self, budget: Budget) {
        self.budget = budget;
    }

    /// Returns what the query has visited and may still visit.
    pub(crate) fn budget(&self) -> &Budget {
        &self.budget
    }

    /// Returns a walk of one object for a probe.
    pub(crate) fn probe_walk<'a, V: ProbeVisitor>(
        &'a mut self,
        bvh: &'a Bvh,
        object: &'a Object,
        visitor: &'a mut V,
    ) -> ProbeWalk<'a, V> {
        let Self { probes, budget, .. } = self;
        ProbeWalk { bvh, object, stack: probes, budget, visitor }
    }

    /// Lets what follows make as many visits as have been made since `start` and a few more, but none beyond the budget.
    pub(crate) fn allow_as_much_again(&mut self) {
        let made = self.budget.made();
        let left = self.budget.left.min(made.saturating_add(EXTRA_LOOK_AHEAD_VISITS));
        (self.budget.given, self.budget.left) = (made + left, left);
    }

    /// Counts a visit.
    #[inline(always)]
    pub(crate) fn visit(&mut self) -> Result<(), QueryError> {
        self.budget.visit()
    }

    /// Counts some visits.
    pub(crate) fn charge(&mut self, visits: u64) -> Result<(), QueryError> {
        self.budget.charge(visits)
    }
}

/// The groups of opened nodes along the directions of the other side, by the number of the node.
#[derive(Default)]
pub(super) struct Aligned {
    groups: Vec<[Group; 2]>,
    /// The walk for which each was computed; 0 for none.
    walks: Vec<u32>,
    walk: u32,
}

impl Aligned {
    /// Forgets all groups, before a walk.
    pub(super) fn start(&mut self) {
        self.walk = self.walk.wrapping_add(1);
        if self.walk == 0 {
            self.walks.fill(0);
            self.walk = 1;
        }
    }

    /// Returns the groups of a node, and whether they have been computed. If not, the caller computes them.
    #[inline(always)]
    pub(super) fn of(&mut self, node: usize) -> (&mut [Group; 2], bool) {
        if self.walks.len() <= node {
            self.grow(node);
        }
        let known = std::mem::replace(&mut self.walks[node], self.walk) == self.walk;
        (&mut self.groups[node], known)
    }

    #[cold]
    fn grow(&mut self, node: usize) {
        self.groups.resize(node + 64, [Group::ZERO; 2]);
        self.walks.resize(node + 64, 0);
    }
}
