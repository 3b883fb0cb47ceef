//! Times a batch of poses on one thread and on two.
//!
//! The poses are those of the single queries, gap by gap, and do not follow a path. Threads are not bound to processors.

use super::Measured;
use super::row::{Part, Row};
use super::sizes::Size;
use crate::Failure;
use bvh_query::{Backend, Batch, Pose, Querier, QueryError};
use cbvh_measure::rounds::Question;
use cbvh_measure::spread::Spread;
use std::hint::black_box;
use std::time::Instant;

const THREADS: [usize; 2] = [1, 2];

/// Asks each question on each number of threads, which take turns in rounds.
pub(super) fn measure(size: &Size, backend: Backend, rounds: usize) -> Result<Measured, Failure> {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = THREADS.map(pool).into_iter().collect::<Result<Vec<_>, _>>();
    let pools = pools?;
    let poses = size.all_poses();
    let batch = Batch::with_backend(&size.bvh, &size.bvh, backend);
    let mut querier = Querier::with_backend(backend);
    let mut measured = Measured::default();
    for question in Question::EXACT {
        let one_by_one = poses.iter().map(|pose| question.ask(&mut querier, &size.bvh, &size.bvh, pose));
        let expected = one_by_one.collect::<Result<Vec<f64>, _>>()?;
        let mut times = vec![Vec::new(); THREADS.len()];
        for (threads, pool) in THREADS.iter().zip(&pools) {
            let answers = pool.install(|| ask(question, &batch, &poses))?;
            if answers != expected {
                let name = question.name();
                measured.wrong.push(format!("batch, {threads} threads, {name}: not as one by one"));
            }
        }
        for round in 0..rounds {
            for turn in 0..pools.len() {
                let place = (turn + round) % pools.len();
                let before = Instant::now();
                black_box(pools[place].install(|| ask(question, &batch, &poses))?);
                times[place].push(before.elapsed().as_nanos() as u64);
            }
        }
        let spreads: Vec<_> = times.into_iter().map(Spread::of).collect();
        for (&threads, spread) in THREADS.iter().zip(&spreads) {
            let mut row = Row::new(Part::Batch, Some(size.facts.clone()), question.name());
            row.threads = Some(threads as u64);
            row.poses = poses.len() as u64;
            row.touching = question.touching(&expected);
            row.warm = spread.map(|spread| spread.over(poses.len()));
            row.speedup = spreads[0].zip(*spread).map(|(one, these)| one.median / these.median);
            measured.rows.push(row);
        }
    }
    Ok(measured)
}

/// Returns the answers as numbers, as `Question::ask` does.
fn ask(question: Question, batch: &Batch<'_>, poses: &[Pose]) -> Result<Vec<f64>, QueryError> {
    Ok(match question {
        Question::Collide => {
            batch.collide(poses)?.into_iter().map(|touch| f64::from(u8::from(touch))).collect()
        }
        Question::Distance(_) => batch.distances(poses)?.into_iter().map(|found| found.distance).collect(),
    })
}
