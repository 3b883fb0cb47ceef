//! Asks all questions of a file on one thread or several, and times each query by itself.
//!
//! First come `warm` untimed queries from the end of the file, then all items in order until the budget is spent. Each
//! thread takes the next one. The answers are put back in order, so that a budget that ends early leaves the first ones.

use super::RunArguments;
use bvh_query::{Backend, Querier, QueryError, QueryStats};
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// The results of a run.
pub(crate) struct Run<A> {
    /// The answers and their nanoseconds, in the order of the file. There are fewer than asked if the budget ended.
    pub(crate) answers: Vec<(A, u64)>,
    pub(crate) requested: usize,
    /// The number of threads used.
    pub(crate) jobs: usize,
    /// The seconds from the first query to the last.
    pub(crate) total_seconds: f64,
    pub(crate) stats: QueryStats,
}

/// The results of one thread.
struct Share<A> {
    answers: Vec<(usize, (A, u64))>,
    stats: QueryStats,
    seconds: f64,
}

/// Asks about all items.
pub(crate) fn run<T: Sync, A: Clone + Send>(
    items: &[T],
    ask: impl Fn(&mut Querier, &T) -> Result<A, QueryError> + Sync,
    backend: Backend,
    limits: &RunArguments,
) -> Result<Run<A>, QueryError> {
    let jobs = usize::from(limits.jobs).min(items.len()).max(1);
    let budget = limits.budget.unwrap_or(f64::INFINITY);
    let (next, ready) = (AtomicUsize::new(0), Barrier::new(jobs));
    let work = || -> Result<Share<A>, QueryError> {
        let mut querier = Querier::with_backend(backend);
        let start = Instant::now();
        for item in items.iter().rev().take(limits.warm) {
            if start.elapsed().as_secs_f64() >= budget / 4.0 {
                break;
            }
            // The timed part meets the same error again. Returning it here would leave the other threads at the barrier.
            let _ = ask(&mut querier, item);
        }
        let mut share =
            Share { answers: Vec::with_capacity(items.len()), stats: QueryStats::default(), seconds: 0.0 };
        ready.wait();
        let start = Instant::now();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { break };
            let before = Instant::now();
            let answer = ask(&mut querier, item);
            let nanoseconds = before.elapsed().as_nanos() as u64;
            share.answers.push((index, (answer?, nanoseconds)));
            add(&mut share.stats, querier.stats());
            if start.elapsed().as_secs_f64() > budget {
                break;
            }
        }
        share.seconds = start.elapsed().as_secs_f64();
        Ok(share)
    };
    let shares: Vec<_> = std::thread::scope(|scope| {
        let others: Vec<_> = (1..jobs).map(|_| scope.spawn(work)).collect();
        let own = work();
        let joined = others.into_iter().map(|thread| match thread.join() {
            Ok(share) => share,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        std::iter::once(own).chain(joined).collect()
    });
    let mut answers = vec![None; items.len()];
    let mut stats = QueryStats::default();
    let mut total_seconds = 0.0f64;
    for share in shares {
        let share = share?;
        add(&mut stats, share.stats);
        total_seconds = total_seconds.max(share.seconds);
        share.answers.into_iter().for_each(|(index, timed)| answers[index] = Some(timed));
    }
    // Items are taken in order, and each one that is taken is answered, so that there are no gaps.
    let answers = answers.into_iter().map_while(|answer| answer).collect();
    Ok(Run { answers, requested: items.len(), jobs, total_seconds, stats })
}

/// Adds the work of one query to a sum.
pub(crate) fn add(sum: &mut QueryStats, stats: QueryStats) {
    sum.node_tests += stats.node_tests;
    sum.packet_tests += stats.packet_tests;
    sum.exact_tests += stats.exact_tests;
}
