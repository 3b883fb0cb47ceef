//! Asks all questions of a run, on one thread or several, times each of them, and prints the answers.
//!
//! First come `warm` untimed questions from the end of the list, then all items in order until the budget is spent.
//! Each thread takes the next item. The answers are put back in order: if the budget ends early, the first ones are
//! there.

use super::files::write_file;
use super::{Answer, RunArguments, quantile};
use crate::console::{self, Failure, Record, hex, record};
use crate::process;
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Querier, QueryError, QueryStats};
use std::path::Path;
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// The results of a run.
pub(crate) struct Run<A> {
    /// The answers and their nanoseconds, in the order of the questions. There are fewer than asked if the budget ended.
    pub(crate) answers: Vec<(A, u64)>,
    requested: usize,
    /// The number of threads used.
    jobs: usize,
    /// The seconds from the first question to the last.
    total_seconds: f64,
    /// The work of all questions; `None` if the asker does not count it.
    stats: Option<QueryStats>,
}

/// The results of one thread: answers with their places and nanoseconds.
struct Share<A> {
    answers: Vec<(usize, (A, u64))>,
    stats: Option<QueryStats>,
    seconds: f64,
}

/// Asks about the items whose places `next` returns. `ready` waits until all threads are warm, and `stats` returns the work
/// of the last question, or `None` if it is not counted.
fn share<Q, T, A, E>(
    asker: &mut Q,
    items: &[T],
    limits: &RunArguments,
    (ready, next): (impl FnOnce(), impl Fn() -> usize),
    ask: impl Fn(&mut Q, &T) -> Result<A, E>,
    stats: impl Fn(&mut Q) -> Option<QueryStats>,
) -> Result<Share<A>, E> {
    let budget = limits.budget.unwrap_or(f64::INFINITY);
    let start = Instant::now();
    for item in items.iter().rev().take(limits.warm) {
        if start.elapsed().as_secs_f64() >= budget / 4.0 {
            break;
        }
        // The timed part meets the same error again. Returning it here would leave the other threads at the barrier.
        let _ = ask(asker, item);
    }
    let answers = Vec::with_capacity(items.len());
    let mut share = Share { answers, stats: Some(QueryStats::default()), seconds: 0.0 };
    ready();
    let start = Instant::now();
    loop {
        let index = next();
        let Some(item) = items.get(index) else { break };
        let before = Instant::now();
        let answer = ask(asker, item);
        let nanoseconds = before.elapsed().as_nanos() as u64;
        share.answers.push((index, (answer?, nanoseconds)));
        share.stats = sum(share.stats, stats(asker));
        if start.elapsed().as_secs_f64() > budget {
            break;
        }
    }
    share.seconds = start.elapsed().as_secs_f64();
    Ok(share)
}

impl<A> Run<A> {
    /// Asks two meshes about all items, with a querier on each of as many threads as the arguments say.
    pub(crate) fn new<T: Sync>(
        items: &[T],
        ask: impl Fn(&mut Querier, &T) -> Result<A, QueryError> + Sync,
        backend: Backend,
        limits: &RunArguments,
    ) -> Result<Self, QueryError>
    where
        A: Clone + Send,
    {
        let askers = (|| Querier::with_backend(backend), |querier: &mut Querier| Some(querier.stats()));
        Self::shared(items, askers, ask, limits)
    }

    /// Asks about all items on as many threads as the arguments say. Each thread makes its own asker, and `stats` returns the work
    /// of the asker's last question, or `None` if it is not counted.
    pub(crate) fn shared<Q, T: Sync, E: Send>(
        items: &[T],
        (asker, stats): (impl Fn() -> Q + Sync, impl Fn(&mut Q) -> Option<QueryStats> + Sync),
        ask: impl Fn(&mut Q, &T) -> Result<A, E> + Sync,
        limits: &RunArguments,
    ) -> Result<Self, E>
    where
        A: Clone + Send,
    {
        let jobs = usize::from(limits.jobs).min(items.len()).max(1);
        let (place, barrier) = (AtomicUsize::new(0), Barrier::new(jobs));
        let work = || {
            let ready = || {
                barrier.wait();
            };
            let next = || place.fetch_add(1, Ordering::Relaxed);
            share(&mut asker(), items, limits, (ready, next), &ask, &stats)
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
        let mut stats = Some(QueryStats::default());
        let mut total_seconds = 0.0f64;
        for share in shares {
            let share = share?;
            stats = sum(stats, share.stats);
            total_seconds = total_seconds.max(share.seconds);
            share.answers.into_iter().for_each(|(index, timed)| answers[index] = Some(timed));
        }
        // Items are taken in order, and each one that is taken is answered, so that there are no gaps.
        let answers = answers.into_iter().map_while(|answer| answer).collect();
        Ok(Self { answers, requested: items.len(), jobs, total_seconds, stats })
    }

    /// Asks about all items one after another. The asker may use several threads itself.
    pub(crate) fn in_turn<Q, T, E>(
        asker: &mut Q,
        items: &[T],
        ask: impl Fn(&mut Q, &T) -> Result<A, E>,
        stats: impl Fn(&mut Q) -> QueryStats,
        limits: &RunArguments,
    ) -> Result<Self, E> {
        let place = AtomicUsize::new(0);
        let next = || place.fetch_add(1, Ordering::Relaxed);
        let Share { answers, stats, seconds } =
            share(asker, items, limits, (|| (), next), ask, |asker| Some(stats(asker)))?;
        let answers = answers.into_iter().map(|(_, timed)| timed).collect();
        Ok(Self { answers, requested: items.len(), jobs: limits.jobs.into(), total_seconds: seconds, stats })
    }

    /// Turns each answer into another form.
    pub(crate) fn map<B>(self, with: impl Fn(A) -> B) -> Run<B> {
        let Self { answers, requested, jobs, total_seconds, stats } = self;
        let answers = answers.into_iter().map(|(answer, ns)| (with(answer), ns)).collect();
        Run { answers, requested, jobs, total_seconds, stats }
    }
}

impl<A: Answer> Run<A> {
    pub(crate) fn answers(&self) -> impl Iterator<Item = &A> {
        self.answers.iter().map(|(answer, _)| answer)
    }

    /// Writes the lines of all answers, each with its nanoseconds.
    pub(crate) fn write_raw(&self, path: &Path) -> Result<(), Failure> {
        let line = |(answer, ns): &(A, u64)| format!("{} {ns}\n", answer.line());
        write_file(path, &self.answers.iter().map(line).collect::<String>())
    }

    /// Prints the answers: a line each, or as JSON a record each, which begins with the number of the question. If there are
    /// several files of questions, `stem` names this one. The words call a question and several of them by their names.
    pub(crate) fn tell(
        &self,
        words: [&'static str; 2],
        stem: Option<&str>,
        as_json: bool,
    ) -> Result<(), Failure> {
        if !as_json {
            return console::lines(self.answers().map(Answer::line));
        }
        console::lines((0..).zip(self.answers()).map(|(number, answer)| {
            let file = stem.map(|stem| Record::of(words[1], &stem));
            Record::of(words[0], &number).with(file).with(answer.json())
        }))
    }

    /// Returns what the line of `--bench` tells about the questions and the answers. The hash of the answers is null if there
    /// may be others.
    pub(crate) fn bench(&self, backend: Backend, is_exact: bool) -> Record {
        let mut times: Vec<u64> = self.answers.iter().map(|&(_, ns)| ns).collect();
        times.sort_unstable();
        let (sum, queries) = (times.iter().sum::<u64>(), times.len());
        let mut hasher = Hasher::default();
        self.answers().for_each(|answer| answer.hash(&mut hasher));
        let is_complete = is_exact && queries == self.requested;
        record! {
            queries: queries,
            requested: self.requested,
            total_s: self.total_seconds,
            query_sum_s: sum as f64 * 1e-9,
            ns_median: quantile(&times, 0.5),
            ns_mean: if queries == 0 { 0.0 } else { sum as f64 / queries as f64 },
            ns_p10: quantile(&times, 0.1),
            ns_p90: quantile(&times, 0.9),
            ns_max: times.last().copied().unwrap_or(0),
            positives: self.answers().filter(|answer| answer.is_positive()).count(),
            // A distance of nothing is infinite, and is not added.
            sum: self.answers().map(Answer::value).filter(|value| value.is_finite()).sum::<f64>(),
            peak_rss_mb: process::peak_bytes().map(|bytes| bytes as f64 / 1048576.0),
            isa: backend.name(),
            answers_xxh3: is_complete.then(|| hex(hasher.finish())),
            node_tests: self.stats.map(|of| of.node_tests),
            triangle_tests: self.stats.map(|of| of.packet_tests),
            exact_tests: self.stats.map(|of| of.exact_tests),
            jobs: self.jobs,
        }
        .with(A::counts(self.answers()))
    }
}

/// Returns the sum of what was counted; `None` if some of it was not.
fn sum(all: Option<QueryStats>, stats: Option<QueryStats>) -> Option<QueryStats> {
    let mut all = all?;
    add(&mut all, stats?);
    Some(all)
}

/// Adds the work of one query to a sum.
pub(crate) fn add(sum: &mut QueryStats, stats: QueryStats) {
    sum.node_tests += stats.node_tests;
    sum.packet_tests += stats.packet_tests;
    sum.exact_tests += stats.exact_tests;
}
