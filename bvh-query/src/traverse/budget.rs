//! How many visits a query may make.

use crate::error::QueryError;

/// The number of visits that a look ahead may make beyond those of the query. They cost less than finding out whether
/// they pay.
const EXTRA_LOOK_AHEAD_VISITS: u64 = 8;

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

    /// Returns whether nothing limits the question.
    #[inline(always)]
    pub(crate) fn is_unlimited(&self) -> bool {
        self.visits == u64::MAX
    }

    /// Returns the number of visits that are left.
    pub(crate) fn left(&self) -> u64 {
        self.left
    }

    /// Returns the number of visits that have been made.
    pub(crate) fn made(&self) -> u64 {
        self.given - self.left
    }

    /// Returns this budget after some visits were made, at most those given.
    pub(crate) fn after(self, made: u64) -> Self {
        Self { left: self.given.saturating_sub(made), ..self }
    }

    /// Lets what follows make as many visits as have been made and a few more, but none beyond the budget.
    pub(crate) fn allow_as_much_again(&mut self) {
        let made = self.made();
        self.left = self.left.min(made.saturating_add(EXTRA_LOOK_AHEAD_VISITS));
        self.given = made + self.left;
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
