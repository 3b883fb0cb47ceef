//! Asks about every pose of a file on one thread or several, and times each query by itself.
//!
//! First come `warm` untimed queries from the end of the file, then all poses in order until the budget is spent. Each
//! thread takes the next pose. The answers are put back in order, so that a budget that ends early leaves the first ones.

use super::question::{Answer, Question};
use super::side::Sides;
use bvh_query::{Backend, Pose, Querier, QueryError, QueryStats};
use cbvh_measure::rounds::add;
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// An answer and its nanoseconds.
pub(super) type Timed = (Answer, u64);

/// The limits of a run.
pub(super) struct Limits {
    pub(super) jobs: usize,
    pub(super) warm: usize,
    /// The budget in seconds; `None` for no limit.
    pub(super) budget: Option<f64>,
}

/// The results of a run.
pub(super) struct Run {
    /// The answers in the order of the poses. There are fewer than poses if the budget ended.
    pub(super) answers: Vec<Timed>,
    pub(super) requested: usize,
    /// The number of threads used.
    pub(super) jobs: usize,
    /// The seconds from the first query to the last.
    pub(super) total_seconds: f64,
    pub(super) stats: QueryStats,
}

/// Asks about all poses.
pub(super) fn run(
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
    // Poses are taken in order, and each one that is taken is answered, so that there are no gaps.
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

/// The work that all threads share.
struct Worker<'a> {
    sides: &'a Sides<'a>,
    poses: &'a [Pose],
    question: &'a Question,
    backend: Backend,
    limits: &'a Limits,
    next: AtomicUsize,
    ready: Barrier,
}

/// The results of one thread.
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
            // The timed part meets the same error again. Returning it here would leave the other threads at the barrier.
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
