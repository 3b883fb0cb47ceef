//! Asks questions about poses of several subjects in rounds and times each query alone.
//!
//! A turn is a few untimed questions and then all items in their order. Caches hold what the previous questions left there,
//! which is called warm. Within a round all subjects take their turn at each question, and the next round starts with
//! another subject, so that drift (clock, temperature, neighbours) affects all of them alike.

use bvh_query::{Backend, Bvh, DistanceOptions, Pose, Querier, QueryError, QueryStats};
use std::time::Instant;

/// Untimed questions before each turn.
const WARM_UP_QUESTIONS: usize = 3;
/// The number of subjects by which the start moves on from round to round. It shares no factor with usual numbers of
/// subjects, so that the order of turns differs from round to round.
const STRIDE: usize = 17;

/// A question about two meshes in a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Question {
    /// Whether they touch.
    Collide,
    /// How far apart they are, with an allowed relative error.
    Distance(f64),
}

impl Question {
    /// The questions without an allowed error.
    pub const EXACT: [Self; 2] = [Self::Collide, Self::Distance(0.0)];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Collide => "collide",
            Self::Distance(_) => "distance",
        }
    }

    /// The allowed relative error of a distance.
    pub fn rel_err(self) -> Option<f64> {
        match self {
            Self::Collide => None,
            Self::Distance(rel_err) => Some(rel_err),
        }
    }

    /// Returns the answer as a number: 1 for contact, or the distance in mesh units.
    ///
    /// # Errors
    /// Returns the error of the query.
    #[inline]
    pub fn ask(self, querier: &mut Querier, a: &Bvh, b: &Bvh, pose: &Pose) -> Result<f64, QueryError> {
        Ok(match self {
            Self::Collide => f64::from(u8::from(querier.collide(a, b, pose)?)),
            Self::Distance(rel_err) => {
                let options = DistanceOptions::new().rel_err(rel_err);
                querier.distance_with(a, b, pose, &options)?.distance
            }
        })
    }

    /// Returns how many of its answers say that the meshes touch.
    pub fn touching(self, answers: &[f64]) -> u64 {
        let touching = if self == Self::Collide { 1.0 } else { 0.0 };
        answers.iter().filter(|&&answer| answer == touching).count() as u64
    }
}

/// Two baked meshes and the poses to ask about.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The first mesh.
    pub a: &'a Bvh,
    /// The mesh that the poses place.
    pub b: &'a Bvh,
    /// The poses, in the order in which they are asked about.
    pub poses: &'a [Pose],
}

/// The answers and times of one question to one subject.
#[derive(Debug, Default, Clone)]
pub struct Asked {
    /// The answer in each pose.
    pub answers: Vec<f64>,
    /// Nanoseconds by round and pose.
    pub rounds: Vec<Vec<u64>>,
    /// The work of one round, summed over the poses.
    pub stats: QueryStats,
}

impl Asked {
    /// Mean work per query.
    pub fn work(&self) -> Work {
        Work::mean(self.stats, self.answers.len())
    }
}

/// Mean work per query.
#[derive(Debug, Clone, Copy, Default)]
pub struct Work {
    /// Tests of up to 16 pairs of nodes.
    pub node_tests: Option<f64>,
    /// Tests of up to 16 pairs of triangles.
    pub packet_tests: Option<f64>,
    /// Pairs of triangles that were decided exactly.
    pub exact_tests: Option<f64>,
}

impl Work {
    /// The mean of a sum over so many queries.
    pub fn mean(sum: QueryStats, queries: usize) -> Self {
        let mean = |count: u64| Some(count as f64 / queries as f64);
        Self {
            node_tests: mean(sum.node_tests),
            packet_tests: mean(sum.packet_tests),
            exact_tests: mean(sum.exact_tests),
        }
    }
}

/// Adds the work of one query to a sum.
pub fn add(sum: &mut QueryStats, stats: QueryStats) {
    sum.node_tests += stats.node_tests;
    sum.packet_tests += stats.packet_tests;
    sum.exact_tests += stats.exact_tests;
}

/// Asks all subjects all questions in `rounds` rounds. The result is indexed by subject, then by question.
///
/// # Errors
/// Returns the first error of a query.
pub fn rounds(
    subjects: &[Subject<'_>],
    questions: &[Question],
    backend: Backend,
    rounds: usize,
) -> Result<Vec<Vec<Asked>>, QueryError> {
    let mut all = vec![vec![Asked::default(); questions.len()]; subjects.len()];
    let mut queriers: Vec<Querier> = subjects.iter().map(|_| Querier::with_backend(backend)).collect();
    for round in 0..rounds {
        for (number, &question) in questions.iter().enumerate() {
            for subject in order(round, subjects.len()) {
                let (querier, &Subject { a, b, poses }) = (&mut queriers[subject], &subjects[subject]);
                let answers = take_turn(poses, |pose| {
                    let answer = question.ask(querier, a, b, pose)?;
                    Ok((answer, querier.stats()))
                })?;
                let asked = &mut all[subject][number];
                if asked.rounds.is_empty() {
                    for &((answer, stats), _) in &answers {
                        asked.answers.push(answer);
                        add(&mut asked.stats, stats);
                    }
                }
                asked.rounds.push(answers.into_iter().map(|(_, nanoseconds)| nanoseconds).collect());
            }
        }
    }
    Ok(all)
}

/// Returns the order in which so many subjects take turns in a round.
pub fn order(round: usize, subjects: usize) -> impl Iterator<Item = usize> {
    (0..subjects).map(move |turn| (turn + STRIDE * round) % subjects)
}

/// Asks about all items, and returns the answers with their nanoseconds.
///
/// # Errors
/// Returns the first error of a question.
#[inline]
pub fn take_turn<T, A>(
    items: &[T],
    mut ask: impl FnMut(&T) -> Result<A, QueryError>,
) -> Result<Vec<(A, u64)>, QueryError> {
    for item in items.iter().rev().take(WARM_UP_QUESTIONS) {
        ask(item)?;
    }
    let mut answers = Vec::with_capacity(items.len());
    for item in items {
        let before = Instant::now();
        let answer = ask(item)?;
        let nanoseconds = before.elapsed().as_nanos() as u64;
        answers.push((answer, nanoseconds));
    }
    Ok(answers)
}
