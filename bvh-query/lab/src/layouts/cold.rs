//! Times queries with cold caches.
//!
//! Before a question is put to the layouts, a buffer larger than the last cache is read through. That evicts what the
//! caches held: files, the queriers' own memory, and address translations. Then each layout is asked once. Files share
//! no memory, so each is cold when its turn comes. The code of queries is cold only for the first layout of a sweep, and
//! each sweep starts with another one. Pages have been checked before; in an application the first touch adds that.

use bvh_query::{Backend, Querier, QueryError};
use cbvh_measure::rounds::{Question, Subject};
use std::hint::black_box;
use std::time::Instant;

/// The buffer that is read through.
pub(super) struct Sweep(Vec<u64>);

impl Sweep {
    /// Makes a buffer of `bytes` bytes and touches all of it.
    pub(super) fn new(bytes: u64) -> Self {
        // The numbers differ, because the system would map all pages of zeros to the same memory.
        Self((0..bytes / 8).collect())
    }

    /// Reads one word per cache line.
    fn run(&self) {
        black_box(self.0.iter().step_by(8).fold(0u64, |sum, &word| sum.wrapping_add(word)));
    }
}

/// Returns nanoseconds by subject, exact question and pose. All subjects have the same poses.
pub(super) fn times(
    subjects: &[Subject<'_>],
    backend: Backend,
    sweep: &Sweep,
) -> Result<Vec<[Vec<u64>; 2]>, QueryError> {
    let mut all = vec![[Vec::new(), Vec::new()]; subjects.len()];
    let mut queriers: Vec<Querier> = subjects.iter().map(|_| Querier::with_backend(backend)).collect();
    let Some(first) = subjects.first() else { return Ok(all) };
    let mut sweeps = 0;
    for pose in first.poses {
        for (number, question) in Question::EXACT.into_iter().enumerate() {
            // The queriers' memory grows to what this query needs; that is not what is measured.
            for (querier, subject) in queriers.iter_mut().zip(subjects) {
                question.ask(querier, subject.a, subject.b, pose)?;
            }
            sweep.run();
            for turn in 0..subjects.len() {
                let place = (turn + sweeps) % subjects.len();
                let before = Instant::now();
                black_box(question.ask(&mut queriers[place], subjects[place].a, subjects[place].b, pose)?);
                all[place][number].push(before.elapsed().as_nanos() as u64);
            }
            sweeps += 1;
        }
    }
    Ok(all)
}
