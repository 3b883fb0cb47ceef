//! Asks about every pose, each query timed alone, on one thread or several.
//!
//! The order of events is that of the peers: `warm` untimed queries from the end of the file, then all
//! poses in order until the budget is spent. Poses are independent, so threads take the next one each;
//! the answers are put back in order, and those there are when the budget ends are always the first.

use super::{Question, Sides, add};
use bvh_query::{Backend, Pose, Querier, QueryError, QueryStats};
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// What a query said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Answer {
    /// Yes or no.
    Flag(bool),
    /// Pairs of triangles.
    Count(u64),
    /// Mesh units.
    Length(f64),
}

/// An answer and the nanoseconds that it took.
pub(crate) type Timed = (Answer, u64);

/// How to run.
pub(crate) struct Limits {
    pub(crate) jobs: usize,
    pub(crate) warm: usize,
    /// Seconds; `None` for no limit.
    pub(crate) budget: Option<f64>,
}

/// All answers to the poses of a file.
pub(crate) struct Run {
    /// In the order of the poses; fewer than those if the budget ended.
    pub(crate) answers: Vec<Timed>,
    pub(crate) requested: usize,
    /// Threads used.
    pub(crate) jobs: usize,
    /// Seconds from the first query to the last.
    pub(crate) total_seconds: f64,
    pub(crate) stats: QueryStats,
}

/// Asks about all poses.
pub(crate) fn run(
    sides: &Sides<'_>,
    poses: &[Pose],
    question: &Question,
    backend: Backend,
    limits: &Limits,
) -> Result<Run, QueryError> {
    let jobs = limits.jobs.min(poses.len()).max(1);
    let worker = Worker {
        sides,
        poses,
        question,
        backend,
        limits,
        next: AtomicUsize::new(0),
        ready: Barrier::new(jobs),
    };
    let shares = if jobs == 1 { vec![worker.work()] } else { work_together(&worker, jobs) };
    let mut answers = vec![None; poses.len()];
    let mut stats = QueryStats::default();
    let mut total_seconds = 0.0f64;
    for share in shares {
        let share = share?;
        add(&mut stats, share.stats);
        total_seconds = total_seconds.max(share.seconds);
        share.answers.into_iter().for_each(|(index, timed)| answers[index] = Some(timed));
    }
    // Poses are taken in order and each that is taken is answered: no gaps.
    let answers = answers.into_iter().map_while(|answer| answer).collect();
    Ok(Run { answers, requested: poses.len(), jobs, total_seconds, stats })
}

fn work_together(worker: &Worker<'_>, jobs: usize) -> Vec<Result<Share, QueryError>> {
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..jobs).map(|_| scope.spawn(|| worker.work())).collect();
        let own = worker.work();
        let joined = others.into_iter().map(|thread| match thread.join() {
            Ok(share) => share,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        std::iter::once(own).chain(joined).collect()
    })
}

/// What all threads share.
struct Worker<'a> {
    sides: &'a Sides<'a>,
    poses: &'a [Pose],
    question: &'a Question,
    backend: Backend,
    limits: &'a Limits,
    next: AtomicUsize,
    ready: Barrier,
}

/// What one thread has done.
struct Share {
    answers: Vec<(usize, Timed)>,
    stats: QueryStats,
    seconds: f64,
}

impl Worker<'_> {
    fn work(&self) -> Result<Share, QueryError> {
        let mut querier = Querier::with_backend(self.backend);
        let budget = self.limits.budget.unwrap_or(f64::INFINITY);
        let start = Instant::now();
        for pose in self.poses.iter().rev().take(self.limits.warm) {
            if start.elapsed().as_secs_f64() >= budget / 4.0 {
                break;
            }
            // What is wrong is met again in the timed part. Here it would keep others waiting.
            let _ = self.question.ask(&mut querier, self.sides, pose);
        }
        let mut share = Share {
            answers: Vec::with_capacity(self.poses.len()),
            stats: QueryStats::default(),
            seconds: 0.0,
        };
        self.ready.wait();
        let start = Instant::now();
        loop {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(pose) = self.poses.get(index) else { break };
            let before = Instant::now();
            let answer = self.question.ask(&mut querier, self.sides, pose);
            let nanoseconds = before.elapsed().as_nanos() as u64;
            share.answers.push((index, (answer?, nanoseconds)));
            add(&mut share.stats, querier.stats());
            if start.elapsed().as_secs_f64() > budget {
                break;
            }
        }
        share.seconds = start.elapsed().as_secs_f64();
        Ok(share)
    }
}
