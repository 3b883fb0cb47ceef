//! Queriers for the pairs of a question: one, or one for each thread that takes part.

use crate::error::QueryError;
use crate::isa::Backend;
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::budget::Budget;
use std::fmt;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Queriers that keep their memory from question to question.
pub(super) struct Workers {
    backend: Backend,
    pub(super) budget: u64,
    /// How many visits the question may still make, over all its pairs and on all threads.
    left: AtomicU64,
    #[cfg(feature = "parallel")]
    pub(super) parallel: bool,
    idle: Mutex<Vec<Querier>>,
}

impl Clone for Workers {
    /// Copies the settings; queriers are made when they are needed.
    fn clone(&self) -> Self {
        Self {
            backend: self.backend,
            budget: self.budget,
            left: AtomicU64::new(self.budget),
            #[cfg(feature = "parallel")]
            parallel: self.parallel,
            idle: Mutex::default(),
        }
    }
}

impl fmt::Debug for Workers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Workers").field("backend", &self.backend).field("budget", &self.budget).finish()
    }
}

impl Workers {
    pub(super) fn new(backend: Backend) -> Self {
        Self {
            backend,
            budget: u64::MAX,
            left: AtomicU64::new(u64::MAX),
            #[cfg(feature = "parallel")]
            parallel: false,
            idle: Mutex::default(),
        }
    }

    /// Adopts settings, and keeps its queriers if they are of the same backend.
    pub(super) fn adopt(&mut self, source: &Self) {
        let idle =
            if self.backend == source.backend { std::mem::take(&mut self.idle) } else { Mutex::default() };
        *self = Self { idle, ..source.clone() };
    }

    pub(super) fn backend(&self) -> Backend {
        self.backend
    }

    /// Returns the number of threads that questions use.
    pub(super) fn threads(&self) -> usize {
        #[cfg(feature = "parallel")]
        if self.parallel {
            return rayon::current_num_threads();
        }
        1
    }

    /// Starts a question.
    pub(super) fn start(&mut self) {
        *self.left.get_mut() = self.budget;
    }

    /// Returns what is left of the budget of the question.
    pub(super) fn rest(&self) -> Budget {
        Budget::new(self.budget).rest(self.left.load(Ordering::Relaxed))
    }

    /// Charges visits to the question.
    pub(super) fn charge(&self, visits: u64) -> Result<(), QueryError> {
        if self.budget == u64::MAX {
            // Threads need not wait for each other to count what has no limit.
            return Ok(());
        }
        let take = |left: u64| Some(left.saturating_sub(visits));
        // Nothing else is read that depends on it. The update never fails.
        let left = self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).unwrap_or_default();
        if visits <= left { Ok(()) } else { Err(self.rest().error()) }
    }

    /// Asks one of several queries of the question, which may make the visits that are left and is charged those it made.
    /// Queries that other threads ask at the same time may together make more, and then one of them fails.
    pub(super) fn ask_rest<R>(
        &self,
        querier: &mut Querier,
        ask: impl FnOnce(&mut Querier) -> Result<R, QueryError>,
    ) -> Result<R, QueryError> {
        if self.budget == u64::MAX {
            return ask(querier);
        }
        querier.set_rest(self.rest());
        let questions = querier.questions();
        let answer = ask(querier);
        if querier.questions() != questions {
            self.charge(querier.visits())?;
        }
        answer
    }

    /// Asks about pairs by their numbers, one after the other, and returns the work that it took. It calls `ask` through a
    /// pointer, so that it is compiled once, and not for each question.
    fn share(
        &self,
        mut numbers: Range<usize>,
        ask: &mut dyn FnMut(&mut Querier, usize) -> Result<(), QueryError>,
    ) -> Result<QueryStats, (usize, QueryError)> {
        // A panic elsewhere leaves the list of queriers whole.
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let mut querier = idle().pop().unwrap_or_else(|| Querier::with_backend(self.backend));
        querier.set_budget(self.budget);
        let mut stats = QueryStats::default();
        let asked = numbers.try_for_each(|number| {
            let before = querier.questions();
            ask(&mut querier, number).map_err(|error| (number, error))?;
            if querier.questions() != before {
                stats.add(querier.stats().node_tests, querier.stats());
            }
            Ok(())
        });
        idle().push(querier);
        asked.map(|()| stats)
    }

    /// Asks about each pair and returns the answers that are not `None`, in the order of the pairs. The error is that of the
    /// first pair, in their order, that has one.
    pub(super) fn each<P: Sync, R: Send>(
        &self,
        pairs: &[P],
        stats: &mut QueryStats,
        ask: impl Fn(&mut Querier, &P) -> Result<Option<R>, QueryError> + Sync,
    ) -> Result<Vec<R>, (usize, QueryError)> {
        if pairs.is_empty() {
            return Ok(Vec::new());
        }
        let share = |numbers: Range<usize>| {
            let mut found = Vec::new();
            let part = self.share(numbers, &mut |querier, number| {
                found.extend(ask(querier, &pairs[number])?);
                Ok(())
            })?;
            Ok((found, part))
        };
        #[cfg(feature = "parallel")]
        if self.threads() > 1 && pairs.len() > 1 {
            use rayon::prelude::*;
            // A few shares for each thread, because pairs take different times.
            let size = pairs.len().div_ceil(4 * self.threads());
            let of_share = |first: usize| share(first..pairs.len().min(first + size));
            let firsts: Vec<usize> = (0..pairs.len()).step_by(size).collect();
            let shares: Vec<_> = firsts.into_par_iter().map(of_share).collect();
            let mut all = Vec::new();
            for part in shares {
                let (found, part) = part?;
                all.extend(found);
                stats.add(part.node_tests, part);
            }
            return Ok(all);
        }
        let (found, part) = share(0..pairs.len())?;
        stats.add(part.node_tests, part);
        Ok(found)
    }
}
