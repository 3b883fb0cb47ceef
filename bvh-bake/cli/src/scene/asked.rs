//! Asks about each frame and times it: first the moving instances get their poses, then the question.

use super::file::LoadedScene;
use super::frames::Frame;
use super::{Mode, SceneArguments};
use crate::console::Failure;
use bvh_query::{Pose, QueryError, QueryStats, Relation, SceneDistance, SceneError, ScenePair};
use cbvh_measure::rounds::add;
use std::time::Instant;

/// A question with its parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question {
    pub(super) mode: Mode,
    /// The distance of `Mode::Within`, in mesh units.
    pub(super) within: f64,
}

/// An answer about a frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Answer {
    /// Whether any pair touches.
    Flag(bool),
    /// The pairs that touch, or that are near enough.
    Pairs(Vec<ScenePair>),
    /// The pairs that have anything in common, and how they lie.
    Relations(Vec<(ScenePair, Relation)>),
    /// The nearest pair and its distance, with points in the world; `None` if there are no pairs.
    Nearest(Option<SceneDistance>),
}

impl Answer {
    /// Returns the answer as a number: the distance of no pairs is infinite.
    pub(super) fn value(&self) -> f64 {
        match self {
            Self::Flag(flag) => f64::from(u8::from(*flag)),
            Self::Pairs(pairs) => pairs.len() as f64,
            Self::Relations(pairs) => pairs.len() as f64,
            Self::Nearest(nearest) => nearest.map_or(f64::INFINITY, |of| of.distance.distance),
        }
    }

    /// Returns true if a pair touches, is near enough or has anything in common.
    pub(super) fn is_positive(&self) -> bool {
        match self {
            Self::Nearest(_) => self.value() <= 0.0,
            _ => self.value() > 0.0,
        }
    }
}

impl Question {
    /// Takes the question from the command line.
    pub(super) fn new(arguments: &SceneArguments) -> Result<Self, Failure> {
        match (arguments.mode, arguments.within) {
            (Mode::Within, None) => {
                Err(Failure::Usage("--mode within requires --within D (see --help)".into()))
            }
            (mode, Some(_)) if mode != Mode::Within => {
                Err(Failure::Usage("--within requires --mode within (see --help)".into()))
            }
            (mode, within) => Ok(Self { mode, within: within.unwrap_or(0.0) }),
        }
    }

    fn ask(&self, loaded: &mut LoadedScene, frame: &[Pose]) -> Result<Answer, SceneError> {
        let LoadedScene { scene, moving, .. } = loaded;
        scene.set_poses(moving.iter().copied().zip(frame.iter().copied()))?;
        Ok(match self.mode {
            Mode::Collide => Answer::Flag(scene.collide()?),
            Mode::Pairs => Answer::Pairs(scene.pairs_in_contact()?),
            Mode::Within => Answer::Pairs(scene.pairs_within(self.within)?),
            Mode::Relation => Answer::Relations(scene.relations()?),
            Mode::Distance => {
                let mut found = scene.distance()?;
                if let Some(SceneDistance { pair, distance, .. }) = &mut found {
                    let world = scene.pose(pair.a)?;
                    distance.point_a = world.place(distance.point_a);
                    distance.point_b = world.place(distance.point_b);
                }
                Answer::Nearest(found)
            }
        })
    }
}

/// The results of a run.
pub(super) struct Run {
    /// The answers and their nanoseconds, in the order of the frames. There are fewer than frames if the budget ended.
    pub(super) answers: Vec<(Answer, u64)>,
    pub(super) requested: usize,
    pub(super) total_seconds: f64,
    pub(super) stats: QueryStats,
    /// The number of pairs that were asked about.
    pub(super) pairs_asked: u64,
}

impl Run {
    pub(super) fn new(
        scene: &mut LoadedScene,
        frames: &[Frame],
        question: &Question,
        arguments: &SceneArguments,
    ) -> Result<Self, Failure> {
        let budget = arguments.budget.unwrap_or(f64::INFINITY);
        let start = Instant::now();
        for frame in frames.iter().rev().take(arguments.warm) {
            if start.elapsed().as_secs_f64() >= budget / 4.0 {
                break;
            }
            // The timed part meets the same error again, with its frame.
            let _ = question.ask(scene, &frame.poses);
        }
        let mut run = Self {
            answers: Vec::with_capacity(frames.len()),
            requested: frames.len(),
            total_seconds: 0.0,
            stats: QueryStats::default(),
            pairs_asked: 0,
        };
        let start = Instant::now();
        for (number, frame) in (1..).zip(frames) {
            let before = Instant::now();
            let answer = question.ask(scene, &frame.poses);
            let nanoseconds = before.elapsed().as_nanos() as u64;
            let answer = answer.map_err(|error| blame(&error, number, frame.line, arguments))?;
            run.answers.push((answer, nanoseconds));
            add(&mut run.stats, scene.scene.stats());
            run.pairs_asked += scene.scene.pairs_asked();
            if start.elapsed().as_secs_f64() > budget {
                break;
            }
        }
        run.total_seconds = start.elapsed().as_secs_f64();
        Ok(run)
    }
}

/// Turns an error about a frame into one of the file that caused it.
fn blame(error: &SceneError, number: usize, line: usize, arguments: &SceneArguments) -> Failure {
    match error {
        SceneError::Pair { source: QueryError::Budget { .. }, .. } => {
            Failure::Limit(format!("frame {number}: {error}"))
        }
        SceneError::Pose { .. } => {
            let frames = arguments.frames.as_ref().unwrap_or(&arguments.scene);
            Failure::invalid(frames, format_args!("line {line}: {error}"))
        }
        _ => Failure::invalid(&arguments.scene, format_args!("frame {number}: {error}")),
    }
}
