//! Asks all questions of all variants in rounds, each query timed alone.
//!
//! Within a round the variants take turns at each question, and the next round starts with another variant, so
//! that what drifts (clock, temperature, neighbours) drifts for all of them. A turn is some untimed queries, then
//! all poses in their order: caches hold what the queries before have left there, which is called warm.

use super::variant::Variant;
use bvh_query::{Backend, Bvh, DistanceOptions, Pose, Querier, QueryError, QueryStats};
use std::sync::Arc;
use std::time::Instant;

/// Untimed queries before each turn.
const WARM: usize = 3;

/// A question.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Question {
    Collide,
    /// With an allowed relative error.
    Distance(f64),
}

impl Question {
    /// All that are asked.
    pub(super) const ALL: [Self; 5] = [
        Self::Collide,
        Self::Distance(0.0),
        Self::Distance(1e-3),
        Self::Distance(1e-2),
        Self::Distance(1e-1),
    ];

    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Collide => "collide",
            Self::Distance(_) => "distance",
        }
    }

    /// The allowed relative error of a distance.
    pub(super) fn rel_err(self) -> Option<f64> {
        match self {
            Self::Collide => None,
            Self::Distance(rel_err) => Some(rel_err),
        }
    }

    /// The answer as a number: 1 for contact, or mesh units.
    #[inline]
    pub(super) fn ask(self, querier: &mut Querier, bake: &Baked, pose: &Pose) -> Result<f64, QueryError> {
        let (a, b) = (&*bake.a, &*bake.b);
        Ok(match self {
            Self::Collide => f64::from(u8::from(querier.collide(a, b, pose)?)),
            Self::Distance(rel_err) => {
                let errors = DistanceOptions { rel_err, abs_err: 0.0 };
                querier.distance_with(a, b, pose, &errors)?.distance
            }
        })
    }
}

/// A variant, baked.
pub(super) struct Baked {
    pub(super) variant: Variant,
    pub(super) a: Arc<Bvh>,
    /// The same as `a` if the pair is a mesh and itself.
    pub(super) b: Arc<Bvh>,
}

/// What came of one question to one variant.
#[derive(Default, Clone)]
pub(super) struct Asked {
    /// By pose.
    pub(super) answers: Vec<f64>,
    /// Nanoseconds by round and pose.
    pub(super) rounds: Vec<Vec<u64>>,
    /// Sum over the poses.
    pub(super) stats: QueryStats,
}

/// Asks; the results are by variant and question, both in their order.
pub(super) fn rounds(
    bakes: &[Baked],
    poses: &[Pose],
    backend: Backend,
    rounds: usize,
) -> Result<Vec<Vec<Asked>>, QueryError> {
    let mut all = vec![vec![Asked::default(); Question::ALL.len()]; bakes.len()];
    let mut queriers: Vec<Querier> = bakes.iter().map(|_| Querier::with_backend(backend)).collect();
    for round in 0..rounds {
        for (number, question) in Question::ALL.into_iter().enumerate() {
            for turn in 0..bakes.len() {
                // A stride that has no factor in common with many counts: neighbours differ from round to round.
                let variant = (turn + 7 * round) % bakes.len();
                let querier = &mut queriers[variant];
                turn_of(question, querier, &bakes[variant], poses, &mut all[variant][number])?;
            }
        }
    }
    Ok(all)
}

/// One turn: all poses after a few that are not timed.
pub(super) fn turn_of(
    question: Question,
    querier: &mut Querier,
    bake: &Baked,
    poses: &[Pose],
    asked: &mut Asked,
) -> Result<(), QueryError> {
    for pose in poses.iter().rev().take(WARM) {
        question.ask(querier, bake, pose)?;
    }
    let is_first = asked.rounds.is_empty();
    let mut times = Vec::with_capacity(poses.len());
    for pose in poses {
        let before = Instant::now();
        let answer = question.ask(querier, bake, pose)?;
        times.push(before.elapsed().as_nanos() as u64);
        if is_first {
            asked.answers.push(answer);
            crate::query::add(&mut asked.stats, querier.stats());
        }
    }
    asked.rounds.push(times);
    Ok(())
}
