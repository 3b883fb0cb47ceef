//! A pool of queriers, and the one way in which many questions are divided among threads.
//!
//! Questions are cut into runs. Each thread takes the next run, with one querier for all of its runs. Queriers stay in the
//! pool from one call to the next, with the memory that they have grown.
//!
//! A call ends at the first question, in their order, that ends it. Runs are taken in order, and questions are left out only if
//! they lie behind a known end. Every question before the first end is therefore asked, and only the last few runs can be wasted
//! work. So the result does not depend on the number of threads, if no question depends on the cut.

use crate::isa::Backend;
use crate::query::querier::Querier;
use bvh_format::Stop;
use std::fmt;
#[cfg(feature = "parallel")]
use std::ops::Range;
#[cfg(feature = "parallel")]
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Queriers that keep their memory from call to call, and how they are made.
pub(crate) struct Pool {
    pub(crate) backend: Backend,
    /// The budget of each query.
    pub(crate) budget: u64,
    /// Stops each query when it is set.
    pub(crate) stop: Option<Arc<dyn Stop>>,
    /// In boxes, because a querier takes some KiB, which would be copied whenever it is lent.
    idle: Mutex<Vec<Box<Querier>>>,
}

impl Clone for Pool {
    /// Copies the settings; queriers are made when they are needed.
    fn clone(&self) -> Self {
        Self { budget: self.budget, stop: self.stop.clone(), ..Self::new(self.backend) }
    }
}

impl fmt::Debug for Pool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pool").field("backend", &self.backend).field("budget", &self.budget).finish()
    }
}

impl Pool {
    pub(crate) fn new(backend: Backend) -> Self {
        Self { backend, budget: u64::MAX, stop: None, idle: Mutex::default() }
    }

    /// Adopts settings, and keeps its queriers if they are of the same backend.
    pub(crate) fn adopt(&mut self, source: &Self) {
        if self.backend != source.backend {
            *self = source.clone();
        }
        self.budget = source.budget;
        self.stop.clone_from(&source.stop);
    }

    /// Takes a querier out, with the settings of the pool. Inlined, each question would have the code.
    #[inline(never)]
    fn take(&self) -> Box<Querier> {
        let idle = lock(&self.idle).pop();
        let mut querier = idle.unwrap_or_else(|| Box::new(Querier::with_backend(self.backend)));
        querier.set_budget(self.budget);
        querier.set_stop(self.stop.clone());
        querier
    }

    /// Lends a querier.
    fn lend<R>(&self, ask: impl FnOnce(&mut Querier) -> R) -> R {
        let mut querier = self.take();
        let result = ask(&mut querier);
        lock(&self.idle).push(querier);
        result
    }

    /// Calls `run` with the numbers from 0 to `count`, in runs of some `length`, and passes the results to `join`, in order. If a
    /// number ends the call, it returns the first of these, and what it ended with.
    #[cfg(feature = "parallel")]
    pub(crate) fn runs<T: Send, E: Send>(
        &self,
        threads: usize,
        count: usize,
        length: usize,
        run: impl Fn(&mut Querier, &mut dyn Iterator<Item = usize>) -> Result<T, (usize, E)> + Sync,
        mut join: impl FnMut(T),
    ) -> Result<(), (usize, E)> {
        let runs = Runs { count, length, next: AtomicUsize::new(0), end: AtomicUsize::new(usize::MAX) };
        let results: Vec<Mutex<Option<_>>> = (0..runs.number()).map(|_| Mutex::default()).collect();
        self.each_run(threads, &runs, &|querier, number, numbers| {
            let result = run(querier, numbers);
            if let Err((end, _)) = &result {
                runs.end_at(*end);
            }
            *lock(&results[number]) = Some(result);
        });
        // The first run that ended has the first end. Those that were not asked, or not to their end, are behind it.
        results.iter().filter_map(|result| lock(result).take()).try_for_each(|result| result.map(&mut join))
    }

    /// Calls `run` with the numbers from 0 to `count` in one run, because there are no threads.
    #[cfg(not(feature = "parallel"))]
    pub(crate) fn runs<T, E>(
        &self,
        _threads: usize,
        count: usize,
        _length: usize,
        run: impl Fn(&mut Querier, &mut dyn Iterator<Item = usize>) -> Result<T, (usize, E)>,
        join: impl FnOnce(T),
    ) -> Result<(), (usize, E)> {
        self.lend(|querier| run(querier, &mut (0..count))).map(join)
    }

    /// Calls `run` with each run, on some threads. It is compiled once, and not for each question.
    #[cfg(feature = "parallel")]
    fn each_run(
        &self,
        threads: usize,
        runs: &Runs,
        run: &(dyn Fn(&mut Querier, usize, &mut dyn Iterator<Item = usize>) + Sync),
    ) {
        use rayon::prelude::*;
        let share = |first: usize| {
            self.lend(|querier| {
                for number in std::iter::once(first).chain(std::iter::from_fn(|| runs.take())) {
                    let numbers = runs.numbers(number);
                    run(querier, number, &mut numbers.take_while(|number| runs.is_needed(*number)));
                }
            });
        };
        // A thread that finds nothing left to do needs no querier.
        let share = |_| runs.take().map_or((), share);
        let threads = threads.min(runs.number());
        if threads > 1 {
            (0..threads).into_par_iter().with_max_len(1).for_each(share);
        } else {
            share(0);
        }
    }
}

/// Locks what a panic on another thread leaves whole.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What threads know of each other. The numbers do not depend on each other, so that relaxed accesses suffice.
#[cfg(feature = "parallel")]
struct Runs {
    count: usize,
    length: usize,
    /// The next run to take.
    next: AtomicUsize,
    /// The first number known to end the call.
    end: AtomicUsize,
}

#[cfg(feature = "parallel")]
impl Runs {
    /// How many runs there are.
    fn number(&self) -> usize {
        self.count.div_ceil(self.length)
    }

    /// Returns the numbers in a run.
    fn numbers(&self, run: usize) -> Range<usize> {
        let start = run * self.length;
        start..self.count.min(start + self.length)
    }

    /// Returns the next run, if one is left that is needed.
    fn take(&self) -> Option<usize> {
        let run = self.next.fetch_add(1, Ordering::Relaxed);
        (run < self.number() && self.is_needed(run * self.length)).then_some(run)
    }

    /// Returns whether no end before the number is known.
    fn is_needed(&self, number: usize) -> bool {
        number < self.end.load(Ordering::Relaxed)
    }

    fn end_at(&self, number: usize) {
        self.end.fetch_min(number, Ordering::Relaxed);
    }
}
