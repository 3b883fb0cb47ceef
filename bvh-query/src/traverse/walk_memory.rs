//! The memory of walks, kept from one query to the next, and the budget of a query.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::traverse::probe_walk::{ProbeStack, ProbeVisitor, ProbeWalk};
use crate::traverse::walk::PairMemory;
use bvh_format::object::Object;

/// The number of visits that a look ahead may make beyond those of the query: they cost less than finding out whether
/// they pay.
const EXTRA_LOOK_AHEAD_VISITS: u64 = 8;

/// What walks need, and how many visits are left to a query.
#[derive(Default)]
pub(crate) struct WalkMemory {
    pairs: PairMemory,
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

    /// Returns the memory of pair walks, and the budget.
    pub(super) fn pair_walk(&mut self) -> (&mut PairMemory, &mut Budget) {
        (&mut self.pairs, &mut self.budget)
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
