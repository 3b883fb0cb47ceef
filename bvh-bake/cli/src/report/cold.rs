//! Times queries whose data are in no cache.
//!
//! Before a question is put to the variants, a buffer larger than the last cache is read through, which drives
//! out what was in it: files, the queriers' own memory, and the processor's notes on page addresses. Then each
//! variant is asked once. Files share no memory, so each is cold when its turn comes. The code of queries is not:
//! only the first to be asked meets it cold, and who is first changes with each sweep. Pages have been checked
//! before; in an application the first touch of a page adds that.

use super::measure::{Baked, Question};
use bvh_query::{Backend, Pose, Querier, QueryError};
use std::hint::black_box;
use std::time::Instant;

/// What is read through.
pub(super) struct Sweep(Vec<u64>);

impl Sweep {
    /// A buffer of so many bytes, all of it touched.
    pub(super) fn new(bytes: u64) -> Self {
        // Numbers, not zeros, which the system would all keep in one place.
        Self((0..bytes / 8).collect())
    }

    /// Reads a word of each line.
    fn run(&self) {
        black_box(self.0.iter().step_by(8).fold(0u64, |sum, &word| sum.wrapping_add(word)));
    }
}

/// Nanoseconds by variant, question and pose.
pub(super) fn times(
    bakes: &[Baked],
    poses: &[Pose],
    backend: Backend,
    sweep: &Sweep,
) -> Result<Vec<Vec<Vec<u64>>>, QueryError> {
    let mut all = vec![vec![Vec::new(); Question::ALL.len()]; bakes.len()];
    let mut queriers: Vec<Querier> = bakes.iter().map(|_| Querier::with_backend(backend)).collect();
    let mut sweeps = 0;
    for pose in poses {
        for (number, question) in Question::ALL.into_iter().enumerate() {
            // The queriers' memory grows to what this query needs; that is not what is measured.
            for (querier, bake) in queriers.iter_mut().zip(bakes) {
                question.ask(querier, bake, pose)?;
            }
            sweep.run();
            for turn in 0..bakes.len() {
                let variant = (turn + sweeps) % bakes.len();
                let before = Instant::now();
                black_box(question.ask(&mut queriers[variant], &bakes[variant], pose)?);
                all[variant][number].push(before.elapsed().as_nanos() as u64);
            }
            sweeps += 1;
        }
    }
    Ok(all)
}
