//! How many visits a query may make, and whether it may go on.
//!
//! A [`Stop`] can end a query at any time. The count of visits pays for it: with one, a query gets its visits in portions, and
//! the flag is read when a portion is used up. So a visit costs as much with a flag as without.

use crate::error::QueryError;
use bvh_format::Stop;
use std::sync::Arc;

/// The number of visits that a look ahead may make beyond those of the query. They cost less than finding out whether
/// they pay.
const EXTRA_LOOK_AHEAD_VISITS: u64 = 8;

/// The number of visits after which a query reads its flag: some 30 microseconds.
const VISITS_PER_PORTION: u64 = 256;

/// The visits of a query.
#[derive(Clone, Default, Debug)]
pub(crate) struct Budget {
    /// What errors name: the budget of the question that the query is part of.
    visits: u64,
    /// How many visits the query may make.
    given: u64,
    /// How many of them are left: of the portion under way, and behind it. Without a flag, all are one portion.
    portion: u64,
    behind: u64,
    /// Stops the query when it is set.
    stop: Option<Arc<dyn Stop>>,
}

impl Budget {
    /// The budget of a query that is a question of its own.
    pub(crate) fn new(visits: u64) -> Self {
        Self { visits, given: visits, portion: visits, behind: 0, stop: None }
    }

    /// The same budget, for queries that a flag may stop.
    pub(crate) fn stopped_by(self, stop: Option<Arc<dyn Stop>>) -> Self {
        let left = self.left();
        Self { stop, ..self }.with_left(left)
    }

    /// The flag that may stop the query.
    pub(crate) fn stop(&self) -> Option<&Arc<dyn Stop>> {
        self.stop.as_ref()
    }

    /// With a flag, the next visit reads it.
    fn with_left(self, left: u64) -> Self {
        let (portion, behind) = if self.stop.is_none() { (left, 0) } else { (0, left) };
        Self { portion, behind, ..self }
    }

    /// What is `left` to the next query of a question that has more than one.
    pub(crate) fn rest(self, left: u64) -> Self {
        Self { given: left, ..self }.with_left(left)
    }

    /// Returns whether nothing limits the question.
    #[inline(always)]
    pub(crate) fn is_unlimited(&self) -> bool {
        self.visits == u64::MAX
    }

    /// Returns the number of visits that are left.
    pub(crate) fn left(&self) -> u64 {
        self.portion + self.behind
    }

    /// Returns the number of visits that have been made.
    pub(crate) fn made(&self) -> u64 {
        self.given - self.left()
    }

    /// Returns this budget after some visits were made, at most those given.
    pub(crate) fn after(self, made: u64) -> Self {
        let left = self.given.saturating_sub(made);
        self.with_left(left)
    }

    /// Lets what follows make as many visits as have been made and a few more, but none beyond the budget.
    pub(crate) fn allow_as_much_again(&mut self) {
        let made = self.made();
        let left = self.left().min(made.saturating_add(EXTRA_LOOK_AHEAD_VISITS));
        *self = Self { given: made + left, ..std::mem::take(self) }.with_left(left);
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
    // Pages load one copy.
    #[cfg_attr(not(all(target_arch = "wasm32", target_os = "unknown")), inline(always))]
    #[cfg_attr(all(target_arch = "wasm32", target_os = "unknown"), inline(never))]
    pub(crate) fn charge(&mut self, visits: u64) -> Result<(), QueryError> {
        match self.portion.checked_sub(visits) {
            Some(left) => {
                self.portion = left;
                Ok(())
            }
            None => self.charge_next_portion(visits),
        }
    }

    /// Counts visits that are more than the portion has.
    #[cold]
    fn charge_next_portion(&mut self, visits: u64) -> Result<(), QueryError> {
        self.go_on()?;
        let left = self.left().checked_sub(visits);
        self.portion = left.unwrap_or_default().min(VISITS_PER_PORTION);
        self.behind = left.unwrap_or_default() - self.portion;
        left.map_or_else(|| Err(self.error()), |_| Ok(()))
    }

    /// Reads the flag.
    pub(crate) fn go_on(&self) -> Result<(), QueryError> {
        match &self.stop {
            Some(stop) if stop.is_set() => Err(QueryError::Stopped),
            _ => Ok(()),
        }
    }
}
