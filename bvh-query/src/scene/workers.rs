//! Asks about the pairs of a question, on one thread or on all, within one budget.

use crate::error::QueryError;
use crate::isa::Backend;
use crate::query::pool::Pool;
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::budget::Budget;
use std::sync::atomic::{AtomicU64, Ordering};

/// The queriers of a scene, and the budget of its questions.
#[derive(Debug)]
pub(super) struct Workers {
    pub(super) pool: Pool,
    /// How many visits the question may still make, over all its pairs and on all threads.
    left: AtomicU64,
    #[cfg(feature = "parallel")]
    pub(super) parallel: bool,
}

impl Clone for Workers {
    /// Copies the settings; queriers are made when they are needed.
    fn clone(&self) -> Self {
        Self {
            pool: self.pool.clone(),
            left: AtomicU64::new(self.pool.budget),
            #[cfg(feature = "parallel")]
            parallel: self.parallel,
        }
    }
}

impl Workers {
    pub(super) fn new(backend: Backend) -> Self {
        Self {
            pool: Pool::new(backend),
            left: AtomicU64::new(u64::MAX),
            #[cfg(feature = "parallel")]
            parallel: false,
        }
    }

    /// Adopts settings, and keeps its queriers if they are of the same backend.
    pub(super) fn adopt(&mut self, source: &Self) {
        self.pool.adopt(&source.pool);
        #[cfg(feature = "parallel")]
        {
            self.parallel = source.parallel;
        }
    }

    pub(super) fn backend(&self) -> Backend {
        self.pool.backend
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
        *self.left.get_mut() = self.pool.budget;
    }

    /// Returns what is left of the budget of the question. Inlined, each question would have the code.
    #[inline(never)]
    pub(super) fn rest(&self) -> Budget {
        Budget::new(self.pool.budget)
            .stopped_by(self.pool.stop.clone())
            .rest(self.left.load(Ordering::Relaxed))
    }

    /// Charges visits to the question.
    pub(super) fn charge(&self, visits: u64) -> Result<(), QueryError> {
        if self.pool.budget == u64::MAX {
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
        if self.pool.budget == u64::MAX {
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

    /// Asks about each pair and returns the answers that are not `None`, in the order of the pairs. The error is that of the
    /// first pair, in their order, that has one.
    pub(super) fn each<P: Sync, R: Send>(
        &self,
        pairs: &[P],
        stats: &mut QueryStats,
        ask: impl Fn(&mut Querier, &P) -> Result<Option<R>, QueryError> + Sync,
    ) -> Result<Vec<R>, (usize, QueryError)> {
        let threads = self.threads();
        // A few runs for each thread, because pairs take different times.
        let runs = if threads > 1 { 4 * threads } else { 1 };
        let length = pairs.len().div_ceil(runs).max(1);
        let mut all = Vec::new();
        self.pool.runs(
            threads,
            pairs.len(),
            length,
            |querier, numbers| {
                let (mut found, mut of_run) = (Vec::new(), QueryStats::default());
                for number in numbers {
                    let before = querier.questions();
                    found.extend(ask(querier, &pairs[number]).map_err(|error| (number, error))?);
                    if querier.questions() != before {
                        of_run.add(querier.stats().node_tests, querier.stats());
                    }
                }
                Ok((found, of_run))
            },
            |(found, of_run)| {
                all.extend(found);
                stats.add(of_run.node_tests, of_run);
            },
        )?;
        Ok(all)
    }
}
